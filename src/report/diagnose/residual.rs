//! What a diagnosis leaves, in pictures: the held-out signals with the models' runs, and the residual torques in time,
//! frequency and state.

use std::sync::Arc;

use super::naming;
use crate::diagnose::location::{Bin, FrequencyPart, PartOf, Side, StateCurve, StateVariable};
use crate::diagnose::{ClosureOf, Location, Overlay, Site, TORQUE, Where};
use crate::effects::Place;
use crate::report::chart::{Axis, Chart, Colour, Dash, Mark, Range, Series, When};
use crate::report::{Block, Cell, Figure, Table};
use crate::trace::{AxisKind, Signal};

/// Most plots of a residual against a state.
const CURVES: usize = 4;

/// A held-out signal, the models' runs over it, and what they leave.
pub(super) fn overlay(o: &Overlay, of: ClosureOf, after_name: &str, motion: AxisKind) -> Vec<Block> {
    let unit = Signal::from_name(o.channel).map_or("", |s| s.unit(motion));
    let time: Arc<[f64]> = o.time.as_slice().into();
    let chart =
        Chart::new(format!("{} on held-out data", o.channel), Axis::linear("time", "s"), Axis::linear(o.channel, unit))
            .with(
                Series::line("measured", time.clone(), o.measured.as_slice())
                    .in_colour(Colour::Ink)
                    .with_dash(Dash::Broad),
            )
            .with(
                Series::line("model as given", time.clone(), o.before.as_slice())
                    .in_colour(Colour::Vermillion)
                    .with_dash(Dash::Dashed)
                    .of_model(When::Before),
            )
            .with(
                Series::line(after_name, time.clone(), o.after.as_slice())
                    .in_colour(Colour::Blue)
                    .of_model(When::After),
            );
    let minus = |model: &[f64]| -> Vec<f64> { o.measured.iter().zip(model).map(|(y, m)| y - m).collect() };
    let error = |title: &str| {
        Chart::new(
            format!("{title} of {}", o.channel),
            Axis::linear("time", "s"),
            Axis::linear(format!("measured minus model, {}", o.channel), unit),
        )
    };
    let left = Series::line(after_name, time.clone(), minus(&o.after)).in_colour(Colour::Blue).of_model(When::After);
    let both = error("Error")
        .with(
            Series::line("model as given", time.clone(), minus(&o.before))
                .in_colour(Colour::Vermillion)
                .of_model(When::Before),
        )
        .with(left.clone());
    let remainder = error("What is left")
        .with(left)
        .mark(Mark::Y(2.0 * o.noise, "2 standard deviations of the noise".into()))
        .mark(Mark::Y(-2.0 * o.noise, String::new()));
    let caption = match of {
        _ if o.channel == TORQUE => {
            "The torque that acted, and the torque that each model needs for the measured motion, in the band of that motion."
        }
        ClosureOf::FreeRun => {
            "Each model runs freely from one fitted state at the beginning, under the logged torque alone."
        }
        ClosureOf::Windows | ClosureOf::Torque => {
            "Each window starts from its own fitted state, so that an error does not run on into the next."
        }
    };
    vec![
        Block::figure(Figure::new(chart, caption)),
        Block::Figures(vec![Figure::new(both, ""), Figure::new(remainder, "")]),
    ]
}

/// Pictures of where the gap shows.
pub(super) fn blocks(w: &Where, motion: AxisKind) -> Vec<Block> {
    let located = &w.shown;
    let has = |side: Side| located.by_frequency.iter().any(|p| p.residual == side);
    let name = if w.site == Some(Site::At(Place::Table)) && has(Side::Table) { Side::Table } else { Side::Motor };
    let unit = motion.unit(naming::RESIDUAL);
    let mut figures = vec![along_time(located, name, unit)];
    figures.extend(over_frequency(&located.by_frequency, name, unit));
    let mut curves: Vec<&StateCurve> = located.by_state.iter().filter(|c| c.residual == name).collect();
    curves.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    figures.extend(curves.into_iter().take(CURVES).map(|c| against_state(c, unit, motion)));
    let mut blocks = vec![Block::Figures(figures)];
    let parts = parts(&located.by_frequency, name, unit);
    if !parts.rows.is_empty() {
        blocks.push(Block::Table(parts));
    }
    blocks
}

fn along_time(located: &Location, name: Side, unit: &str) -> Figure {
    let middle: Vec<f64> = located.by_time.iter().map(|s| 0.5 * (s.start + s.end)).collect();
    let rms: Vec<f64> = located
        .by_time
        .iter()
        .map(|s| match name {
            Side::Motor => s.r1,
            Side::Table => s.r2.unwrap_or(f64::NAN),
        })
        .collect();
    let chart = Chart::new(
        "Along the record",
        Axis::linear("time", "s"),
        Axis::linear(format!("{}, rms", naming::residual(name)), unit).over(Range::WithZero),
    )
    .with(Series::line("", middle.clone(), rms.clone()).in_colour(Colour::Vermillion))
    .with(Series::points("", middle, rms).in_colour(Colour::Vermillion));
    Figure::new(chart, "Level: always there. Rising or falling: a drift. One peak: an event.")
}

/// The bands of a spectrum without lines; with lines the table of parts shows more.
fn over_frequency(parts: &[FrequencyPart], name: Side, unit: &str) -> Option<Figure> {
    let bands: Vec<&FrequencyPart> = parts.iter().filter(|p| p.residual == name && p.of == PartOf::Band).collect();
    if bands.len() < 3 {
        return None;
    }
    let x: Vec<f64> = bands.iter().map(|p| (p.from.max(0.1 * p.to) * p.to).sqrt()).collect();
    let y: Vec<f64> = bands.iter().map(|p| p.rms).collect();
    let chart = Chart::new(
        "Over frequency",
        Axis::log("frequency", "Hz"),
        Axis::linear(format!("{}, rms", naming::residual(name)), unit).over(Range::WithZero),
    )
    .with(Series::line("", x.clone(), y.clone()).in_colour(Colour::Vermillion))
    .with(Series::points("", x, y).in_colour(Colour::Vermillion));
    Some(Figure::new(chart, ""))
}

fn against_state(c: &StateCurve, unit: &str, motion: AxisKind) -> Figure {
    let (against, rotary) = naming::variable(c.against);
    let against_unit = motion.unit(rotary);
    let bins = if matches!(c.against, StateVariable::Turn1 | StateVariable::Turn2) {
        apart(&c.bins)
    } else {
        c.bins.iter().map(Some).collect()
    };
    // A line and a band are broken where a value is missing.
    let of = |f: &dyn Fn(&Bin) -> f64| -> Vec<f64> { bins.iter().map(|b| b.map_or(f64::NAN, f)).collect() };
    let x: Arc<[f64]> = of(&|b| b.x).into();
    let mean: Arc<[f64]> = of(&|b| b.mean).into();
    let low = of(&|b| b.mean - b.std);
    let high = of(&|b| b.mean + b.std);
    let chart = Chart::new(
        format!("Against {against}"),
        Axis::linear(against, against_unit),
        Axis::linear(naming::residual(c.residual), unit),
    )
    .with(Series::band("± 1 standard deviation", x.clone(), low, high).in_colour(Colour::Orange))
    .with(Series::line("mean", x.clone(), mean.clone()).in_colour(Colour::Vermillion))
    .with(Series::points("", x, mean).in_colour(Colour::Vermillion));
    Figure::new(chart, format!("Explains {:.0} % of the residual's variance.", 100.0 * c.explained.clamp(0.0, 1.0)))
}

/// Distance of two bins, in that of the bins next to them, from which no sample lies between the two: bins hold as many samples each, and
/// the reversal of a sine brings neighbours no further apart than three times.
const EMPTY: f64 = 4.0;

/// The bins of an angle within its turn, `None` between two that lie apart: an axis that does not go all the way round leaves a part of
/// the turn out. A bin alone between two such gaps took its samples from either side, and has no place of its own.
fn apart(bins: &[Bin]) -> Vec<Option<&Bin>> {
    let step = |i: usize| bins[i + 1].x - bins[i].x;
    let steps = bins.len().saturating_sub(1);
    // The larger step of the two on the far sides of steps `i` to `j`.
    let neighbouring = |i: usize, j: usize| {
        let before = i.checked_sub(1).map_or(0.0, step);
        before.max(if j + 1 < steps { step(j + 1) } else { 0.0 })
    };
    let wide = |i: usize, j: usize| (i..=j).all(|k| step(k) > EMPTY * neighbouring(i, j)) && neighbouring(i, j) > 0.0;
    let mut out = Vec::with_capacity(bins.len() + 2);
    let mut i = 0;
    while i < bins.len() {
        out.push(Some(&bins[i]));
        if i + 1 < steps && wide(i, i + 1) {
            out.push(None);
            i += 1;
        } else if i < steps && wide(i, i) {
            out.push(None);
        }
        i += 1;
    }
    out
}

/// The parts of the residual by lines of the excitation and of the turn.
fn parts(all: &[FrequencyPart], name: Side, unit: &str) -> Table {
    let mut table =
        Table::new(format!("The {} by frequency", naming::residual(name)), ["part", "share", "rms", "largest line"]);
    let mut chosen: Vec<&FrequencyPart> =
        all.iter().filter(|p| p.residual == name && p.of != PartOf::Band && p.share >= 5e-3).collect();
    chosen.sort_by(|a, b| b.share.total_cmp(&a.share));
    for p in chosen {
        let kind = match p.of {
            PartOf::Mean => "mean: a constant torque".to_owned(),
            PartOf::Excited => "lines of the excitation".to_owned(),
            PartOf::Even => "even lines that were not excited: asymmetry, offsets".to_owned(),
            PartOf::Odd => "odd lines that were not excited: friction, play".to_owned(),
            PartOf::Foreign => "foreign frequencies: disturbance, noise".to_owned(),
            PartOf::Turn(order) => format!("order {order} of the turn"),
            PartOf::Band => "band".to_owned(),
        };
        table.row(vec![
            Cell::Text(kind),
            Cell::Bar(p.share),
            Cell::quantity(p.rms, unit),
            Cell::quantity(p.peak, "Hz"),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bins(at: &[f64]) -> Vec<Bin> {
        at.iter().map(|x| Bin { x: *x, mean: 0.0, std: 1.0, count: 50 }).collect()
    }

    fn drawn(at: &[f64]) -> Vec<Option<f64>> {
        apart(&bins(at)).iter().map(|b| b.map(|b| b.x)).collect()
    }

    #[test]
    fn a_part_of_the_turn_that_the_axis_does_not_reach_breaks_the_line() {
        let both = [0.1, 0.2, 0.3, 0.4, 6.0, 6.1, 6.2];
        assert_eq!(drawn(&both), [&[0.1, 0.2, 0.3, 0.4].map(Some)[..], &[None], &[6.0, 6.1, 6.2].map(Some)].concat());
        // One bin with samples of either side.
        let across = [0.1, 0.2, 0.3, 3.2, 6.0, 6.1, 6.2];
        assert_eq!(drawn(&across), [&[0.1, 0.2, 0.3].map(Some)[..], &[None], &[6.0, 6.1, 6.2].map(Some)].concat());
    }

    #[test]
    fn a_turn_that_is_gone_through_is_one_line_however_the_axis_dwells() {
        // To and fro over a turn: the bins are the quantiles of a sine.
        let sine: Vec<f64> =
            (0..24).map(|k| 3.1 - 3.0 * (std::f64::consts::PI * (f64::from(k) + 0.5) / 24.0).cos()).collect();
        let even: Vec<f64> = (0..24).map(|k| 0.26 * f64::from(k)).collect();
        for at in [sine, even] {
            assert!(drawn(&at).iter().all(Option::is_some), "{at:?}");
        }
        assert!(drawn(&[]).is_empty());
        assert_eq!(drawn(&[1.0]), [Some(1.0)]);
    }
}
