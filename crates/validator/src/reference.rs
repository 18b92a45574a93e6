//! A run compared with reference results: per variable, whether the run stays within a tube around the reference.
//!
//! The tube follows the practice of the FMI cross-check, where results of two tools are the same when one stays within a
//! band around the other: its half height is a share of the reference's range, and it is as wide as the larger of the two
//! sampling intervals to either side, so that an event that two solvers place a step apart is no difference.

use std::path::Path;

use super::contained::{self, Host};
use super::description::{BaseType, Causality, Description};
use super::simulate::{Inputs, Options, Rows, SimulateError};
use crate::trace::{Hold, Table, TraceError};

/// What to compare with.
#[derive(Debug, Clone)]
pub struct Wanted<'a> {
    /// Reference results: a column `time`, and one for each variable to be compared.
    pub reference: &'a Path,
    /// Inputs of the run, where it has any.
    pub input: Option<&'a Path>,
    /// What the inputs do between samples.
    pub hold: Hold,
    /// Half height of the tube, as a share of the reference's range.
    pub tolerance: f64,
}

/// One variable of the run, compared with the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// Name of the variable.
    pub name: String,
    /// Its unit, where it has one.
    pub unit: Option<String>,
    /// Largest distance from the tube's middle region, as a share of the reference's range; above the tolerance is outside.
    pub worst: f64,
    /// Time of it, s.
    pub at: f64,
    /// Reference over its own time.
    pub reference: Vec<f64>,
    /// The run over its own time.
    pub run: Vec<f64>,
}

/// A whole comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The reference file.
    pub file: String,
    /// Half height of the tube, as a share of the reference's range.
    pub tolerance: f64,
    /// Time of the reference, s.
    pub reference_time: Vec<f64>,
    /// Time of the run, s.
    pub run_time: Vec<f64>,
    /// Each variable.
    pub variables: Vec<Compared>,
    /// What was left out, in sentences.
    pub notes: Vec<String>,
}

impl Compared {
    /// Whether the run stays within the tube.
    #[must_use]
    pub fn passes(&self, tolerance: f64) -> bool {
        self.worst <= tolerance
    }
}

impl Comparison {
    /// Whether every variable does.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.variables.iter().all(|v| v.passes(self.tolerance))
    }
}

/// Runs the FMU over the reference's time, in a child process, and compares.
///
/// # Errors
/// When a file cannot be read, no column of the reference is a variable of the FMU, or the FMU does not run.
pub fn compare(fmu: &Path, wanted: &Wanted<'_>, host: &Host) -> Result<Comparison, SimulateError> {
    let description = contained::describe(fmu)?;
    let table = Table::read(wanted.reference)?;
    let time_at = table
        .position("time")
        .ok_or_else(|| SimulateError::NoTime { file: table.file.clone(), present: table.names() })?;
    let reference_time = table.column(time_at)?.to_vec();
    if let Some(row) = reference_time.windows(2).position(|w| w[1] < w[0]) {
        let (before, after) = (reference_time[row], reference_time[row + 1]);
        let (file, line) = (table.file.clone(), table.line(row + 1));
        return Err(TraceError::NotIncreasing { file, line, before, after }.into());
    }
    let (names, left) = columns(&table, time_at, &description);
    if names.is_empty() {
        let outputs = description.variables.iter().filter(|v| v.causality == Causality::Output);
        let wanted = outputs.map(|v| v.name.as_str()).collect::<Vec<_>>().join(", ");
        return Err(SimulateError::NoReference { file: table.file.clone(), present: table.names(), wanted });
    }
    let inputs = match wanted.input {
        Some(path) => Inputs::from_table(&Table::read(path)?, &description)?,
        None => Inputs::default(),
    };
    let (first, last) = (reference_time.first().copied(), reference_time.last().copied());
    let span = last.unwrap_or(0.0) - first.unwrap_or(0.0);
    let declared = description.default_experiment.and_then(|e| e.step_size);
    let mean = span / (reference_time.len().max(2) - 1) as f64;
    let step = declared.or(inputs.dt).unwrap_or(mean);
    let options = Options {
        start: first,
        stop: last,
        step: Some(step),
        hold: wanted.hold,
        outputs: names.clone(),
        rows: Rows::StepEnd,
        ..Options::default()
    };
    let record = contained::simulate(fmu, &inputs, &options, host)?;
    let mut notes = record.notes.clone();
    if !left.is_empty() {
        notes.push(format!("{}: no variable of the FMU: {}", table.file, left.join(", ")));
    }
    let mut variables = Vec::new();
    for name in names {
        let index = table.position(&name).unwrap_or(time_at);
        let reference = table.column(index)?.to_vec();
        let Some(column) = record.columns.iter().find(|c| c.name == name && !c.input) else { continue };
        let (worst, at) = tube(&reference_time, &reference, &record.time, &column.values, step.max(mean));
        variables.push(Compared { name, unit: column.unit.clone(), worst, at, reference, run: column.values.clone() });
    }
    let (file, tolerance) = (table.file.clone(), wanted.tolerance);
    Ok(Comparison { file, tolerance, reference_time, run_time: record.time, variables, notes })
}

/// Columns that are numeric variables of the FMU, and those that are none.
fn columns(table: &Table, time_at: usize, description: &Description) -> (Vec<String>, Vec<String>) {
    let names =
        table.headers.iter().enumerate().filter(|(at, _)| *at != time_at).map(|(_, header)| header.name.clone());
    names.partition(|name| {
        let named = |v: &&crate::description::Variable| v.name == *name && v.base() != BaseType::String;
        description.variables.iter().find(named).is_some_and(|v| v.causality != Causality::Input)
    })
}

/// Largest distance of a run from the reference within `width` s to either side, over the reference's range; and when.
fn tube(time: &[f64], reference: &[f64], run_time: &[f64], run: &[f64], width: f64) -> (f64, f64) {
    let finite = || reference.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let range = if high > low { high - low } else { high.abs().max(1.0) };
    let at = |t: f64| {
        let after = time.partition_point(|&x| x < t).min(time.len() - 1);
        let before = after.saturating_sub(1);
        let (t0, t1) = (time[before], time[after]);
        if t1 > t0 {
            let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
            reference[before] + share * (reference[after] - reference[before])
        } else {
            reference[after]
        }
    };
    let mut worst = (0.0, run_time.first().copied().unwrap_or(0.0));
    for (&t, &value) in run_time.iter().zip(run) {
        let (from, to) = (t - width, t + width);
        let mut band = (at(from).min(at(to)).min(at(t)), at(from).max(at(to)).max(at(t)));
        let inside = time.partition_point(|&x| x < from)..time.partition_point(|&x| x <= to);
        for &v in &reference[inside] {
            band = (band.0.min(v), band.1.max(v));
        }
        // A NaN is at no finite distance.
        let outside = (band.0 - value).max(value - band.1).max(0.0);
        let distance = if value.is_finite() { outside / range } else { f64::INFINITY };
        if distance > worst.0 {
            worst = (distance, t);
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::tube;

    #[test]
    fn a_jump_one_step_apart_is_within_the_tube_and_an_offset_is_not() {
        let time: Vec<f64> = (0..=100).map(|k| 0.01 * f64::from(k)).collect();
        let jump = |at: f64| time.iter().map(|t| f64::from(u8::from(*t >= at))).collect::<Vec<f64>>();
        assert_eq!(tube(&time, &jump(0.5), &time, &jump(0.509), 0.01).0, 0.0);
        assert!(tube(&time, &jump(0.5), &time, &jump(0.55), 0.01).0 > 0.9);
        let sine = |shift: f64| time.iter().map(|t| (6.0 * t).sin() + shift).collect::<Vec<f64>>();
        // The distance is the offset less what the sine moves within the width, at most 6*0.01, over the samples' range.
        let reference = sine(0.0);
        let range = reference.iter().fold(0.0_f64, |m, v| m.max(*v)) - reference.iter().fold(0.0_f64, |m, v| m.min(*v));
        let (worst, _) = tube(&time, &reference, &time, &sine(0.2), 0.01);
        let rounding = 1e-12;
        assert!(((0.2 - 0.06) / range..=0.2 / range + rounding).contains(&worst), "{worst}");
        let (worst, at) = tube(&time, &sine(0.0), &time, &vec![f64::NAN; 101], 0.01);
        assert!(worst.is_infinite() && at <= 1.0);
    }
}
