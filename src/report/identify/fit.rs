//! How well a simulation with the estimates follows the record.

use std::sync::Arc;

use super::{line, recommended};
use crate::identify::frequency;
use crate::identify::joined::Joined;
use crate::identify::result::{Identification, MethodResult, OutputFit};
use crate::report::chart::{Axis, Chart, Colour, Dash, Series};
use crate::report::format::{self, Medium};
use crate::report::{Block, Cell, Figure, Table};
use crate::trace::{Signal, Trace};

/// One row a method: how well its simulation follows each output, and whether what is left is noise.
pub fn fits(found: &Identification) -> Table {
    let signals: Vec<Signal> = {
        let mut all: Vec<Signal> = Vec::new();
        for o in found.methods.iter().flat_map(|m| &m.outputs) {
            if !all.contains(&o.signal) {
                all.push(o.signal);
            }
        }
        all
    };
    let columns = std::iter::once("method".to_owned())
        .chain(signals.iter().map(|s| format!("fit of {}", s.name())))
        .chain(["what is left is white noise".to_owned()]);
    let mut table = Table::new("A simulation with the estimates against the measured outputs", columns);
    for m in found.methods.iter().filter(|m| !m.outputs.is_empty()) {
        let mut cells = vec![Cell::text(&*m.title)];
        for s in &signals {
            let fit = m.outputs.iter().find(|o| o.signal == *s);
            cells.push(fit.map_or(Cell::Empty, |o| {
                if o.fit_percent >= -100.0 {
                    Cell::Percent(o.fit_percent / 100.0)
                } else {
                    Cell::text("does not follow")
                }
            }));
        }
        let coloured: Vec<&str> =
            m.outputs.iter().filter(|o| !o.whiteness.white && !o.is_rounding()).map(|o| o.signal.name()).collect();
        cells.push(Cell::text(if m.outputs.iter().all(OutputFit::is_rounding) {
            "nothing is left but rounding".to_owned()
        } else if coloured.is_empty() {
            "yes".to_owned()
        } else {
            format!("not of {}", coloured.join(", "))
        }));
        table.row(cells);
    }
    table
}

pub fn fit(found: &Identification) -> Vec<Block> {
    let mut blocks = vec![Block::Table(fits(found))];
    if let Some(best) = recommended(found) {
        let figures = best
            .outputs
            .iter()
            .map(|o| {
                let chart = Chart::new(
                    format!("What {} leaves of {}", best.title, o.signal.name()),
                    Axis::linear("time", o.residual.x_unit),
                    Axis::linear(format!("measured minus simulated, {}", o.signal.name()), o.residual.y_unit),
                )
                .with(line("", &o.residual));
                let w = &o.whiteness;
                let caption = if o.is_rounding() {
                    "Rounding of the simulation: nothing is left.".to_owned()
                } else {
                    format!(
                        "{}: Ljung-Box over {} lags, p = {}.",
                        if w.white {
                            "White, as noise is"
                        } else {
                            "Not white: the model leaves something out, or the noise is coloured"
                        },
                        w.lags,
                        format::number(w.p_value, 2, Medium::Page)
                    )
                };
                Figure::new(chart, caption)
            })
            .collect::<Vec<_>>();
        if !figures.is_empty() {
            blocks.push(Block::Figures(figures));
        }
    }
    blocks
}

/// Most outputs that are drawn at the head of the page.
const DRAWN: usize = 2;

/// Measured against simulated, of the method to trust.
pub fn measured_and_simulated(found: &Identification, record: Option<&Joined>) -> Option<Block> {
    let best = recommended(found)?;
    let record = compared(found, record?, best);
    let figure = |o: &OutputFit| {
        let (time, measured, simulated) = match &record {
            Compared::Record(record) => pair(o, best, record),
            Compared::Average(average) => pair(o, best, &Joined::one(average)),
        }?;
        let time: Arc<[f64]> = time.into();
        let chart = Chart::new(
            format!("{}, measured and simulated", o.signal.name()),
            Axis::linear("time", o.residual.x_unit),
            Axis::linear(o.signal.name(), o.residual.y_unit),
        )
        .with(Series::line("measured", time.clone(), measured).in_colour(Colour::Ink).with_dash(Dash::Broad))
        .with(Series::line(format!("simulated with {}", best.title), time, simulated).in_colour(Colour::Blue));
        let share = format::percent(o.fit_percent / 100.0, Medium::Page);
        Some(Figure::new(chart, format!("Fit {share}: how much of the deviation from the mean is followed.")))
    };
    let figures: Vec<Figure> = best.outputs.iter().filter_map(figure).take(DRAWN).collect();
    match figures.len() {
        0 => None,
        1 => figures.into_iter().next().map(Block::figure),
        _ => Some(Block::Figures(figures)),
    }
}

/// What the simulation was compared with: the record, or the average of the periods of its longest piece.
enum Compared<'a> {
    Record(&'a Joined<'a>),
    Average(Box<Trace>),
}

fn compared<'a>(found: &Identification, record: &'a Joined<'a>, best: &MethodResult) -> Compared<'a> {
    let end = best.outputs.iter().filter_map(|o| o.residual.x.last()).fold(f64::NEG_INFINITY, |m, t| m.max(*t));
    let last = record.len().saturating_sub(1);
    let short = record.len() > 1 && end < record.time(last) - 0.5 * record.samples().dt;
    let longest = record.longest_trace();
    let average = || frequency::average(&longest, &frequency::measure(&longest, found.trace.period?)?).ok();
    match short.then(average).flatten() {
        Some(average) => Compared::Average(Box::new(average)),
        None => Compared::Record(record),
    }
}

/// Time, measured and simulated values of an output; none where the values are not those that were compared.
fn pair(o: &OutputFit, m: &MethodResult, record: &Joined) -> Option<(Vec<f64>, Vec<f64>, Vec<f64>)> {
    if o.signal == Signal::T {
        // A rigid axis is compared in torque, in means over windows: the record itself is not what was compared.
        let e = m.excitation.as_ref().filter(|e| e.estimate.x == e.error.x)?;
        let measured = e.estimate.y.iter().zip(&e.error.y).map(|(estimate, error)| estimate - error).collect();
        return Some((e.estimate.x.clone(), measured, e.estimate.y.clone()));
    }
    let values = record.samples().get(o.signal)?;
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let rms = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt();
    if (rms - o.rms).abs() > 1e-6 * o.rms {
        return None;
    }
    let at = |t: f64| values.get(record.at(t)?).copied();
    let measured = o.residual.x.iter().map(|t| at(*t)).collect::<Option<Vec<f64>>>()?;
    let simulated = measured.iter().zip(&o.residual.y).map(|(y, e)| y - e).collect();
    Some((o.residual.x.clone(), measured, simulated))
}
