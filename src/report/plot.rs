//! Plots on two axes, drawn: one `svg` element from a [`Chart`].

use std::fmt::Write as _;

use maud::{Markup, html};

use super::chart::{Chart, Colour, Mark, Range, Series, Shape};
use super::decimate::{self, Point};
use super::scale::Scale;

/// Size of a drawing in CSS pixels at scale one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Size {
    pub width: f64,
    pub height: f64,
}

/// Font size of ticks and labels, and a width no digit of a common face exceeds at that size.
const FONT: f64 = 12.0;
const DIGIT: f64 = 0.6 * FONT;

/// A coordinate with one decimal, shortest form.
pub(super) fn px(value: f64) -> String {
    let text = format!("{value:.1}");
    match text.strip_suffix(".0") {
        Some("-0") => "0".to_owned(),
        Some(whole) => whole.to_owned(),
        None => text,
    }
}

/// A polyline's path.
pub(super) fn path(points: &[Point]) -> String {
    let mut out = String::with_capacity(points.len() * 11);
    for (i, (x, y)) in points.iter().enumerate() {
        out.push(if i == 0 { 'M' } else { ' ' });
        let _ = write!(out, "{} {}", px(*x), px(*y));
    }
    out
}

/// Room that a text takes at most.
pub(super) fn text_width(text: &str) -> f64 {
    text.chars()
        .map(|c| {
            if matches!(c, '⁰'..='⁹' | '⁻' | '.' | ',' | ' ' | '·' | '¹' | '²' | '³') {
                0.4 * FONT
            } else {
                DIGIT
            }
        })
        .sum()
}

/// A text cut to `room`, with an ellipsis where it was cut.
pub(super) fn cut(text: &str, room: f64) -> String {
    if text_width(text) <= room {
        return text.to_owned();
    }
    let mut out = String::new();
    for c in text.chars() {
        out.push(c);
        if text_width(&out) + FONT > room {
            break;
        }
    }
    out.push('…');
    out
}

/// The plot as one `svg` element.
pub(super) fn svg(chart: &Chart, size: Size) -> Markup {
    let Size { width, height } = size;
    let x_values = chart.series.iter().flat_map(|s| s.x.iter().copied());
    let y_values = chart.series.iter().flat_map(|s| {
        let low: &[f64] = match &s.shape {
            Shape::Band { low } => low,
            _ => &[],
        };
        s.y.iter().chain(low).copied()
    });
    let stems = chart.series.iter().any(|s| s.shape == Shape::Stem);
    let mut y_axis = chart.y.clone();
    if stems && y_axis.range == Range::Auto {
        y_axis.range = Range::WithZero;
    }
    let lines: Vec<f64> =
        chart.marks.iter().filter_map(|m| if let Mark::Y(at, _) = m { Some(*at) } else { None }).collect();
    let y = Scale::holding(&y_axis, y_values, &lines, (height / if chart.y.log { 36.0 } else { 55.0 }) as usize, 0.05);
    let x_pad = if stems { 0.02 } else { 0.0 };
    let x = Scale::new(&chart.x, x_values, (width / 95.0) as usize, x_pad);

    let tick_width = |s: &Scale| s.ticks.iter().filter_map(|t| t.label.as_deref()).map(text_width).fold(0.0, f64::max);
    let last_label = x.ticks.iter().rev().find_map(|t| t.label.as_deref()).map_or(0.0, text_width);
    let (left, right) = ((tick_width(&y) + 12.0).max(28.0), (0.5 * last_label + 2.0).max(12.0));
    let (top, bottom) = (26.0, 42.0);
    let (w, h) = (width - left - right, height - top - bottom);
    let sx = |v: f64| w * x.share(v);
    let sy = |v: f64| h * (1.0 - y.share(v));
    // Far outside the plot a coordinate only needs to be far outside.
    let clamp = |v: f64, extent: f64| if v.is_finite() { v.clamp(-2.0 * extent, 3.0 * extent) } else { v };
    let place = |s: &Series, ys: &[f64]| -> Vec<Point> {
        s.x.iter().zip(ys).map(|(a, b)| (clamp(sx(*a), w), clamp(sy(*b), h))).collect()
    };
    let zero = if chart.y.log { h } else { clamp(sy(0.0), h) };

    let data = serde_json::json!({ "l": left, "t": top, "x": x.reading(&chart.x), "y": y.reading(&chart.y) });
    html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (px(width)) " " (px(height)) } role="img" aria-label=(summary(chart))
            data-plot=(data) {
            title { (chart.title) }
            g class="grid" {
                @for t in &x.ticks {
                    path class=[t.label.is_none().then_some("minor")] d={ "M" (px(left + w * t.share)) " " (px(top)) "v" (px(h)) } {}
                }
                @for t in &y.ticks {
                    path class=[t.label.is_none().then_some("minor")] d={ "M" (px(left)) " " (px(top + h * (1.0 - t.share))) "h" (px(w)) } {}
                }
                @if !chart.y.log && zero > 0.0 && zero < h {
                    path class="zero" d={ "M" (px(left)) " " (px(top + zero)) "h" (px(w)) } {}
                }
            }
            svg x=(px(left)) y=(px(top)) width=(px(w)) height=(px(h)) viewBox={ "0 0 " (px(w)) " " (px(h)) } {
                @for m in &chart.marks {
                    @if let Mark::Span(a, b, _) = m {
                        @let (a, b) = (clamp(sx(a.min(*b)), w), clamp(sx(a.max(*b)), w));
                        @if a.is_finite() && b.is_finite() {
                            path class="span" d={ "M" (px(a)) " 0H" (px(b)) "V" (px(h)) "H" (px(a)) "Z" } {}
                        }
                    }
                }
                @for (i, s) in chart.series.iter().enumerate() {
                    @let colour = s.colour.unwrap_or(Colour::nth(i));
                    g class=(colour.class()) data-s=(i) {
                        @if !s.name.is_empty() { title { (s.name) } }
                        (draw(s, &place, zero, w))
                    }
                }
                @for m in &chart.marks {
                    @match m {
                        Mark::X(at, _) if sx(*at).is_finite() => { path class="mark" d={ "M" (px(clamp(sx(*at), w))) " 0v" (px(h)) } {} }
                        Mark::Y(at, _) if sy(*at).is_finite() => { path class="mark" d={ "M0 " (px(clamp(sy(*at), h))) "h" (px(w)) } {} }
                        _ => {}
                    }
                }
            }
            path class="frame" d={ "M" (px(left)) " " (px(top)) "v" (px(h)) "h" (px(w)) } {}
            g class="t" {
                @for t in &y.ticks {
                    @if let Some(label) = &t.label {
                        text x=(px(left - 6.0)) y=(px(top + h * (1.0 - t.share) + 4.0)) text-anchor="end" { (label) }
                    }
                }
                @for (t, label) in x_labels(&x, w) {
                    text x=(px(left + w * t)) y=(px(top + h + 17.0)) text-anchor="middle" { (label) }
                }
                (mark_labels(chart, &sx, &sy, left, top, w, h))
            }
            g class="l" {
                text x=(px(0.0_f64.max(left - tick_width(&y) - 6.0))) y="14" { (cut(&y.title, width - 8.0)) }
                text x=(px(left + w)) y=(px(height - 6.0)) text-anchor="end" { (cut(&x.title, w)) }
            }
        }
    }
}

/// Labels of the horizontal axis that do not touch one another.
fn x_labels(x: &Scale, w: f64) -> Vec<(f64, &str)> {
    let mut free = f64::NEG_INFINITY;
    let mut out = Vec::new();
    for t in &x.ticks {
        let Some(label) = t.label.as_deref() else { continue };
        let half = 0.5 * text_width(label);
        if w * t.share - half >= free {
            free = w * t.share + half + 6.0;
            out.push((t.share, label));
        }
    }
    out
}

/// The drawn form of one series inside the plot.
fn draw(s: &Series, place: &dyn Fn(&Series, &[f64]) -> Vec<Point>, zero: f64, w: f64) -> Markup {
    const MOST: usize = 4000;
    let points = place(s, &s.y);
    let dash = s.dash.pattern();
    match &s.shape {
        Shape::Line => html! {
            @for run in decimate::runs(points.into_iter()) {
                @if run.len() == 1 { path class="dots" d=(dots(&run)) {} }
                @else { path class=(s.dash.class()) stroke-dasharray=[dash] d=(path(&decimate::line(&run, 1.0, MOST.max(4 * w as usize)))) {} }
            }
        },
        Shape::Step => html! {
            @for run in decimate::runs(points.into_iter()) {
                path class=(s.dash.class()) stroke-dasharray=[dash] d=(path(&decimate::line(&stairs(&run), 1.0, MOST.max(4 * w as usize)))) {}
            }
        },
        Shape::Points => {
            html! { path class=(if s.y.len() > 400 { "dots fine" } else { "dots" }) d=(dots(&decimate::cloud(&points, 3000))) {} }
        }
        Shape::Stem => {
            let kept = decimate::extremes(&points, 1.5);
            let stalks = kept.iter().fold(String::new(), |mut out, (x, y)| {
                let _ = write!(out, "M{} {}V{}", px(*x), px(zero), px(*y));
                out
            });
            html! {
                path class="stalk" d=(stalks) {}
                path class=(if kept.len() > 80 { "dots fine" } else { "dots" }) d=(dots(&kept)) {}
            }
        }
        Shape::Band { low } => {
            let low = place(s, low);
            let both = points.iter().zip(&low).map(|(a, b)| if b.1.is_finite() { *a } else { (f64::NAN, f64::NAN) });
            let back = low.iter().zip(&points).map(|(b, a)| if a.1.is_finite() { *b } else { (f64::NAN, f64::NAN) });
            let edges: Vec<String> = decimate::runs(both)
                .iter()
                .zip(&decimate::runs(back))
                .map(|(upper, lower)| {
                    let mut edge = decimate::line(upper, 1.0, MOST);
                    edge.extend(decimate::line(lower, 1.0, MOST).into_iter().rev());
                    path(&edge)
                })
                .collect();
            html! { @for edge in &edges { path class="band" d={ (edge) "Z" } {} } }
        }
    }
}

/// Points as zero-length strokes with round ends: the shortest way to write a dot.
fn dots(points: &[Point]) -> String {
    points.iter().fold(String::new(), |mut out, (x, y)| {
        let _ = write!(out, "M{} {}h0", px(*x), px(*y));
        out
    })
}

/// Each value held until the next.
fn stairs(points: &[Point]) -> Vec<Point> {
    let mut out = Vec::with_capacity(2 * points.len());
    for (i, p) in points.iter().enumerate() {
        if i > 0 {
            out.push((p.0, points[i - 1].1));
        }
        out.push(*p);
    }
    out
}

/// Labels of the marks, kept inside the plot and off one another.
fn mark_labels(
    chart: &Chart,
    sx: &dyn Fn(f64) -> f64,
    sy: &dyn Fn(f64) -> f64,
    left: f64,
    top: f64,
    w: f64,
    h: f64,
) -> Markup {
    let mut taken: Vec<(f64, f64, f64)> = Vec::new();
    let mut placed = Vec::new();
    for m in &chart.marks {
        let (x, y, label) = match m {
            Mark::X(at, label) => (sx(*at) + 4.0, 13.0, label),
            Mark::Span(a, b, label) => (sx(a.min(*b)).max(0.0) + 4.0, 13.0, label),
            Mark::Y(at, label) => ((w - text_width(label) - 4.0).max(0.0), sy(*at) - 5.0, label),
        };
        // A line across the plot is named in the legend; one that is too far off to be drawn, at the edge it lies beyond.
        let beyond = match m {
            Mark::Y(at, _) if sy(*at) < -1e-6 => Some(("↑", 13.0)),
            Mark::Y(at, _) if sy(*at) > h + 1e-6 => Some(("↓", h - 5.0)),
            _ => None,
        };
        let (label, y) = match beyond {
            Some((sign, y)) if !label.is_empty() => (format!("{label} {sign}"), y),
            _ if matches!(m, Mark::Y(..)) => continue,
            _ => (label.clone(), y),
        };
        let label = &label;
        if label.is_empty() || !x.is_finite() || !y.is_finite() || x < 0.0 || x > w || y < 0.0 || y > h {
            continue;
        }
        let text = cut(label, w - 8.0);
        let room = text_width(&text);
        let is_line = matches!(m, Mark::X(..));
        let x = if x + room > w {
            if is_line && x - 8.0 - room > 0.0 { x - 8.0 - room } else { (w - room).max(0.0) }
        } else {
            x
        };
        let mut y = y.max(12.0);
        while taken.iter().any(|(a, b, row)| (row - y).abs() < 13.0 && x < *b && x + room > *a) && y + 14.0 < h {
            y += 14.0;
        }
        taken.push((x, x + room, y));
        placed.push((left + x, top + y, text));
    }
    html! { @for (x, y, text) in &placed { text class="note" x=(px(*x)) y=(px(*y)) { (text) } } }
}

/// The plot in words, for who cannot see it.
fn summary(chart: &Chart) -> String {
    let mut out = format!("Plot: {}. {} against {}", chart.title, chart.y.label, chart.x.label);
    let names: Vec<&str> = chart.series.iter().map(|s| s.name.as_str()).filter(|n| !n.is_empty()).collect();
    if !names.is_empty() {
        let _ = write!(out, ": {}", names.join(", "));
    }
    for m in &chart.marks {
        let (Mark::X(_, label) | Mark::Y(_, label) | Mark::Span(_, _, label)) = m;
        if !label.is_empty() {
            let _ = write!(out, "; marked: {label}");
        }
    }
    out.push('.');
    out
}
