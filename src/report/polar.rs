//! The polar plot of a circular test (ISO 230-4): the deviation from the circle, magnified, over the angle.

use std::f64::consts::TAU;
use std::sync::Arc;

use maud::{Markup, html};

use super::chart::{Colour, Dash};
use super::decimate;
use super::format::{self, Medium};
use super::plot::{Size, path, px};
use super::scale;

/// A polar plot as data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PolarPlot {
    /// Heading above the plot.
    pub title: String,
    /// Unit of the deviations in ASCII.
    pub unit: String,
    /// Traces drawn over one another.
    pub traces: Vec<PolarTrace>,
    /// Deviation at the outer circle; none takes the largest one and a margin.
    pub full_scale: Option<f64>,
    /// Radius of the commanded circle, in the unit of the deviations: where it is known, the magnification is shown.
    pub radius: Option<f64>,
    /// The ring that holds the path.
    pub ring: Option<Ring>,
}

/// A ring about a centre of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Its centre, from that of the commanded circle.
    pub centre: (f64, f64),
    /// Its inner circle, as a deviation.
    pub low: f64,
    /// Its outer circle, as a deviation.
    pub high: f64,
    /// Its colour.
    pub colour: Colour,
}

/// One turn (or more) of the path.
#[derive(Debug, Clone, PartialEq)]
pub struct PolarTrace {
    /// Name in the legend.
    pub name: String,
    /// Angle on the circle, rad, counter-clockwise from the X axis.
    pub angle: Arc<[f64]>,
    /// Radial deviation from the commanded circle, outward positive.
    pub deviation: Arc<[f64]>,
    /// Colour; none takes the next of the palette.
    pub colour: Option<Colour>,
    /// Dash.
    pub dash: Dash,
}

/// Share of the drawing's radius at which the commanded circle stands.
const BASE: f64 = 0.62;

/// Corners of a ring's circles.
const RING: usize = 180;

/// The plot as one `svg` element.
pub(super) fn svg(plot: &PolarPlot, size: Size) -> Markup {
    let side = size.width.min(size.height);
    let (cx, cy) = (0.5 * size.width, 0.5 * size.height);
    let full = 0.5 * side - 26.0;
    let largest = plot
        .traces
        .iter()
        .flat_map(|t| t.deviation.iter())
        .filter(|d| d.is_finite())
        .fold(0.0_f64, |m, d| m.max(d.abs()));
    let wanted = plot.full_scale.unwrap_or(largest);
    let step = division(if wanted > 0.0 { wanted } else { 1.0 } / 2.0);
    let scale = full * (1.0 - BASE) / (2.0 * step);
    let radius = |d: f64| (full * BASE + scale * d).max(0.0);
    let at = |angle: f64, r: f64| (cx + r * angle.cos(), cy - r * angle.sin());
    let (exponent, unit) = scale::factor(2.0 * step, &plot.unit);
    let label = |d: f64| format::number(d / 10f64.powi(exponent), 2, Medium::Page).trim_end_matches(".0").to_owned();
    let data = serde_json::json!({ "x": {}, "polar": {
        "cx": cx, "cy": cy, "base": full * BASE, "k": scale, "axis": { "e": exponent, "u": unit },
    } });
    html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (px(size.width)) " " (px(size.height)) } role="img"
            aria-label={ "Polar plot: " (plot.title) ". Largest deviation " (format::number(largest, 3, Medium::Page)) " " (format::unit(&plot.unit, Medium::Page)) "." } data-plot=(data) {
            title { (plot.title) }
            g class="grid" fill="none" {
                @for k in -2..=2 {
                    circle class=(if k == 0 { "zero" } else { "" }) cx=(px(cx)) cy=(px(cy)) r=(px(radius(f64::from(k) * step))) {}
                }
                @for k in 0..8 {
                    @let end = at(TAU * f64::from(k) / 8.0, full);
                    path class=[(k % 2 == 1).then_some("minor")] d=(path(&[(cx, cy), end])) {}
                }
            }
            @if let Some(ring) = plot.ring {
                @let circle = |d: f64| path(&(0..=RING).map(|k| {
                    let a = TAU * k as f64 / RING as f64;
                    at(a, radius(d + ring.centre.0 * a.cos() + ring.centre.1 * a.sin()))
                }).collect::<Vec<_>>());
                path class={ "ring " (ring.colour.class()) } fill-rule="evenodd" d={ (circle(ring.low)) (circle(ring.high)) } {}
            }
            @for (i, t) in plot.traces.iter().enumerate() {
                g class=(t.colour.unwrap_or(Colour::nth(i)).class()) data-s=(i) {
                    title { (t.name) }
                    @let points = t.angle.iter().zip(t.deviation.iter()).map(|(a, d)| at(*a, radius(*d)));
                    @for run in decimate::runs(points) {
                        path class=(t.dash.class()) stroke-dasharray=[t.dash.pattern()] d=(path(&decimate::line(&run, 1.0, 4000))) {}
                    }
                }
            }
            g class="t" {
                @for (k, name) in ["+X", "+Y", "−X", "−Y"].iter().enumerate() {
                    @let p = at(TAU * k as f64 / 4.0, full + 13.0);
                    text x=(px(p.0)) y=(px(p.1 + 4.0)) text-anchor="middle" { (name) }
                }
                @for k in -2..=2 {
                    // Just off the diagonal, where quadrant glitches do not stand.
                    @let p = at(TAU / 8.0 + 0.06, radius(f64::from(k) * step));
                    text class="halo" x=(px(p.0)) y=(px(p.1 + 4.0)) text-anchor="middle" { (label(f64::from(k) * step)) }
                }
                text x=(px(cx)) y=(px(cy + 4.0)) text-anchor="middle" class="halo" { "deviation [" (unit) "]" }
                @if let Some(magnified) = plot.radius.map(|r| scale * r / (full * BASE)) {
                    text x=(px(cx)) y=(px(cy + 20.0)) text-anchor="middle" class="halo" {
                        "magnified " (format::number(magnified, 3, Medium::Page)) " times"
                    }
                }
            }
        }
    }
}

/// A round division nearest above.
fn division(raw: f64) -> f64 {
    let power = 10f64.powf(raw.log10().floor());
    let lead = raw / power;
    [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0].into_iter().find(|s| lead <= *s + 1e-9).unwrap_or(10.0) * power
}
