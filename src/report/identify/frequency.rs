//! The measured frequency response compared with the model's.

use std::sync::Arc;

use crate::identify::result::{FrequencyResponse, ResponseOf};
use crate::report::chart::{Axis, Chart, Colour, Mark, Series};
use crate::report::format::{self, Medium};
use crate::report::{Block, Cell, Figure, Table};

pub fn resonances(frf: &FrequencyResponse) -> Table {
    let mut table = Table::new(
        format!("Measured frequency response, {} periods of {} samples", frf.periods, frf.period),
        ["output", "antiresonance", "resonance", "error of the model"],
    );
    let hertz = |f: Option<f64>| f.map_or(Cell::Empty, |f| Cell::quantity(f, "Hz"));
    for o in &frf.outputs {
        table.row(vec![
            Cell::text(o.signal.name()),
            hertz(o.antiresonance),
            hertz(o.resonance),
            Cell::Percent(o.error_percent / 100.0),
        ]);
    }
    table
}

pub fn frequency_response(frf: &FrequencyResponse) -> Vec<Block> {
    let f: Arc<[f64]> = frf.frequency.as_slice().into();
    let mut figures = Vec::new();
    for o in &frf.outputs {
        figures.push(Figure::new(magnitude(&f, o), "Grey: two standard deviations from the scatter between periods."));
        figures.push(Figure::new(phase(&f, o), ""));
    }
    vec![Block::Table(resonances(frf)), Block::Figures(figures)]
}

fn magnitude(f: &Arc<[f64]>, o: &ResponseOf) -> Chart {
    let name = o.signal.name();
    let low: Vec<f64> = o.magnitude.iter().zip(&o.std).map(|(m, s)| (m - 2.0 * s).max(0.05 * m)).collect();
    let high: Vec<f64> = o.magnitude.iter().zip(&o.std).map(|(m, s)| m + 2.0 * s).collect();
    let mut chart = Chart::new(
        format!("From torque to {name}"),
        Axis::log("frequency", "Hz"),
        Axis::log(format!("gain, {name}/T"), ""),
    )
    .with(Series::band("", f.clone(), low, high).in_colour(Colour::Grey))
    .with(Series::points("measured", f.clone(), o.magnitude.as_slice()).in_colour(Colour::Ink))
    .with(Series::line("model", f.clone(), o.model_magnitude.as_slice()).in_colour(Colour::Blue));
    for (at, what) in [(o.antiresonance, "antiresonance"), (o.resonance, "resonance")] {
        if let Some(at) = at {
            chart.marks.push(Mark::X(at, format!("{what} {} Hz", format::number(at, 3, Medium::Page))));
        }
    }
    chart
}

fn phase(f: &Arc<[f64]>, o: &ResponseOf) -> Chart {
    let (measured, model) = unwrapped(&o.phase, &o.model_phase);
    Chart::new(
        format!("Phase from torque to {}", o.signal.name()),
        Axis::log("frequency", "Hz"),
        Axis::linear("phase", "°"),
    )
    .with(Series::points("measured", f.clone(), measured).in_colour(Colour::Ink))
    .with(Series::line("model", f.clone(), model).in_colour(Colour::Blue))
}

/// Phases in degrees without jumps of a turn: the model's along the frequency, which has no noise, and each measured one
/// within half a turn of it.
fn unwrapped(measured: &[f64], model: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let near = |angle: f64, to: f64| angle + 360.0 * ((to - angle) / 360.0).round();
    let mut last: Option<f64> = None;
    let model: Vec<f64> = model
        .iter()
        .map(|p| {
            let p = p.to_degrees();
            // A lag is a negative phase.
            let next = last.map_or(if p > 90.0 { p - 360.0 } else { p }, |l| near(p, l));
            if next.is_finite() {
                last = Some(next);
            }
            next
        })
        .collect();
    let measured = measured.iter().zip(&model).map(|(p, m)| near(p.to_degrees(), *m)).collect();
    (measured, model)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_that_passes_half_a_turn_does_not_jump() {
        // A lag from -100 to -500 degrees, wrapped as an argument is, and measured with some degrees of noise.
        let true_ones: Vec<f64> = (0..41).map(|k| -100.0 - 10.0 * f64::from(k)).collect();
        let wrap = |d: f64| ((d + 180.0).rem_euclid(360.0) - 180.0).to_radians();
        let model: Vec<f64> = true_ones.iter().map(|d| wrap(*d)).collect();
        let measured: Vec<f64> = true_ones.iter().enumerate().map(|(k, d)| wrap(d + 40.0 * (k as f64).sin())).collect();
        let (measured, model) = unwrapped(&measured, &model);
        for (k, d) in true_ones.iter().enumerate() {
            assert!((model[k] - d).abs() < 1e-9, "{k}: {} against {d}", model[k]);
            assert!((measured[k] - d - 40.0 * (k as f64).sin()).abs() < 1e-9, "{k}: {}", measured[k]);
        }
    }
}
