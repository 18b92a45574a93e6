//! How the recursive estimates were reached.

use super::DASHES;
use super::estimates::names;
use crate::identify::result::Identification;
use crate::report::chart::{Axis, Chart, Mark, Range, Series};
use crate::report::{Block, Figure};

/// Histories of every parameter, the recursive methods in one chart each (the paper's Figures 6 to 9).
pub fn histories(found: &Identification) -> Vec<Block> {
    let mut figures = Vec::new();
    for (name, unit) in names(found) {
        let mut chart = Chart::new(
            format!("{name} as it is estimated"),
            Axis::linear("time", "s"),
            Axis::linear(name, unit).over(Range::Robust),
        );
        for (k, m) in found.methods.iter().filter(|m| m.history.is_some()).enumerate() {
            let Some(history) = &m.history else { continue };
            if let Some((_, values)) = history.parameters.iter().find(|(n, _)| *n == name) {
                let dash = DASHES[k % 3];
                chart.series.push(Series::line(&*m.title, history.time.as_slice(), values.as_slice()).with_dash(dash));
            }
        }
        let estimates = found.methods.iter().flat_map(|m| m.parameters.iter()).filter(|e| e.name == name);
        if let Some(reference) = estimates.filter_map(|e| e.reference).next() {
            chart.marks.push(Mark::Y(reference, "reference".into()));
        }
        if !chart.series.is_empty() {
            figures.push(Figure::new(chart, ""));
        }
    }
    figures.extend(distances(found));
    vec![Block::Figures(figures)]
}

/// How near each recursive method comes to the reference, where there is one.
fn distances(found: &Identification) -> Vec<Figure> {
    let mut figures = Vec::new();
    for m in &found.methods {
        let Some(history) = &m.history else { continue };
        let mut chart = Chart::new(
            format!("Distance from the reference, {}", m.title),
            Axis::linear("time", "s"),
            Axis::log("|estimate/reference - 1|", ""),
        );
        for (k, (name, values)) in history.parameters.iter().enumerate() {
            let reference = m.parameters.iter().find(|e| e.name == *name).and_then(|e| e.reference);
            if let Some(r) = reference.filter(|r| *r != 0.0) {
                let distance: Vec<f64> = values.iter().map(|v| (v / r - 1.0).abs()).collect();
                chart.series.push(Series::line(*name, history.time.as_slice(), distance).with_dash(DASHES[k % 3]));
            }
        }
        if !chart.series.is_empty() {
            figures.push(Figure::new(chart, ""));
        }
    }
    figures
}
