//! Input signals over time, between whose samples a run interpolates.

use crate::description::{BaseType, Causality, Description};
use crate::trace::{Hold, Sampling, Table, Trace, TraceError, Unit, grid, nearest};

use super::SimulateError;

/// Sampled signals with one time axis, increasing, s.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Inputs {
    /// Time of each sample, s.
    pub time: Vec<f64>,
    /// Name and samples of each signal.
    pub signals: Vec<(String, Vec<f64>)>,
    /// Sampling interval, s, where it is uniform.
    pub dt: Option<f64>,
    /// What was left out, in sentences.
    pub notes: Vec<String>,
}

/// Most samples that inputs are resampled to.
const MOST: f64 = 1e8;

impl Inputs {
    /// The torque of a trace.
    ///
    /// # Errors
    /// When the trace has none.
    pub fn of(trace: &Trace) -> Result<Self, TraceError> {
        let torque = trace.require(crate::trace::Signal::T)?.to_vec();
        Ok(Self {
            time: (0..trace.len()).map(|k| trace.time(k)).collect(),
            signals: vec![("T".to_owned(), torque)],
            dt: Some(trace.dt),
            notes: Vec::new(),
        })
    }

    /// The columns of a table that are inputs of the FMU; the column `time` gives the time.
    ///
    /// # Errors
    /// When no column is an input, a unit does not fit, a value is missing, or time does not increase.
    pub fn from_table(table: &Table, description: &Description) -> Result<Self, SimulateError> {
        let time_at = table
            .position("time")
            .ok_or_else(|| SimulateError::NoTime { file: table.file.clone(), present: table.names() })?;
        let unit = table.headers[time_at].unit.as_deref();
        let to_seconds = factor(table, "time", unit, Some("s"))?;
        let time: Vec<f64> = table.column(time_at)?.iter().map(|t| t * to_seconds).collect();
        if let Some(row) = time.windows(2).position(|w| w[1] <= w[0]) {
            let (before, after) = (time[row], time[row + 1]);
            return Err(TraceError::NotIncreasing {
                file: table.file.clone(),
                line: table.line(row + 1),
                before,
                after,
            }
            .into());
        }
        let mut inputs = Self { dt: None, time, signals: Vec::new(), notes: Vec::new() };
        let mut left = Vec::new();
        for (index, header) in table.headers.iter().enumerate().filter(|(i, _)| *i != time_at) {
            let named = |name: &str| name == header.name || column_name(name) == header.name;
            let input = description.variables.iter().find(|v| v.causality == Causality::Input && named(&v.name));
            let Some(input) = input.filter(|v| v.base() != BaseType::String) else {
                left.push(header.name.as_str());
                continue;
            };
            let own = description.resolved(input).unit;
            let scale = factor(table, &header.name, header.unit.as_deref(), own.as_deref())?;
            let values = table.column(index)?.iter().map(|v| v * scale).collect();
            inputs.signals.push((input.name.clone(), values));
        }
        if inputs.signals.is_empty() {
            let names =
                || description.variables.iter().filter(|v| v.causality == Causality::Input).map(|v| v.name.as_str());
            let near = left.iter().map(|l| nearest(l, names())).find(|n| !n.is_empty()).unwrap_or_default();
            return Err(SimulateError::NoInput {
                file: table.file.clone(),
                present: table.names(),
                wanted: names().collect::<Vec<_>>().join(", "),
                near,
            });
        }
        if !left.is_empty() {
            inputs.notes.push(format!("{}: no inputs of the FMU, left out: {}", table.file, left.join(", ")));
        }
        if let Some(found) = grid(&inputs.time).ok().filter(|g| g.sampling == Sampling::Uniform) {
            // Stamps that are uniform up to rounding: the grid itself, so that samples and steps coincide.
            inputs.dt = Some(found.dt);
            inputs.time = (0..inputs.time.len()).map(|k| found.start + k as f64 * found.dt).collect();
        }
        Ok(inputs)
    }

    /// The samples from one time to another, s, and at even steps where those are asked for: each takes the value that was
    /// logged last, as a held input has it.
    ///
    /// # Errors
    /// When fewer than two samples are left.
    pub fn part(mut self, from: Option<f64>, to: Option<f64>, resample: Option<f64>) -> Result<Self, SimulateError> {
        if from.is_none() && to.is_none() && resample.is_none() {
            return Ok(self);
        }
        let (Some(first), Some(last)) = (self.time.first().copied(), self.time.last().copied()) else {
            return Ok(self);
        };
        let (from, to) = (from.unwrap_or(first), to.unwrap_or(last));
        let slack = 1e-6 * (last - first) / (self.time.len() as f64);
        let rows: Vec<usize> = match resample {
            None => (0..self.time.len()).filter(|k| (from - slack..=to + slack).contains(&self.time[*k])).collect(),
            Some(dt) => {
                let (start, end) = (from.max(first), to.min(last));
                let count = ((end - start) / dt + 1.0 + 1e-9).max(0.0);
                if count > MOST {
                    return Err(SimulateError::Part { from, to, left: count });
                }
                let at =
                    |k: usize| self.time.partition_point(|t| *t <= start + k as f64 * dt + slack).saturating_sub(1);
                let rows = (0..count as usize).map(at).collect();
                self.notes.push(format!(
                    "the inputs were resampled to dt = {dt:e} s, each with the value logged last: what moves faster than {:.4} Hz \
                     is lost",
                    0.1 / dt
                ));
                rows
            }
        };
        if rows.len() < 2 {
            return Err(SimulateError::Part { from, to, left: rows.len() as f64 });
        }
        self.time = match resample {
            None => rows.iter().map(|k| self.time[*k]).collect(),
            Some(dt) => (0..rows.len()).map(|k| from.max(first) + k as f64 * dt).collect(),
        };
        self.dt = resample.or(self.dt);
        for (_, values) in &mut self.signals {
            *values = rows.iter().map(|k| values[*k]).collect();
        }
        Ok(self)
    }

    /// Value of signal `index` at `time`, and its mean slope over the `step` s after it (zero where it is held).
    pub(super) fn at(&self, index: usize, time: f64, step: f64, hold: Hold) -> (f64, f64) {
        let values = &self.signals[index].1;
        let value = |t: f64| {
            // A sample that is a rounding error ahead counts.
            let after = self.time.partition_point(|s| *s <= t + 1e-6 * step);
            let Some(before) = after.checked_sub(1) else { return values[0] };
            match (hold, values.get(after)) {
                (Hold::Linear, Some(next)) => {
                    let share = ((t - self.time[before]) / (self.time[after] - self.time[before])).max(0.0);
                    values[before] + (next - values[before]) * share
                }
                _ => values[before],
            }
        };
        let now = value(time);
        let slope = if hold == Hold::Linear { (value(time + step) - now) / step } else { 0.0 };
        (now, slope)
    }
}

/// A variable's name as a column has it: indices in parentheses, because brackets hold the unit.
pub(super) fn column_name(name: &str) -> String {
    name.replace('[', "(").replace(']', ")")
}

/// Factor from a column's unit to the FMU's.
fn factor(table: &Table, column: &str, from: Option<&str>, to: Option<&str>) -> Result<f64, SimulateError> {
    let (Some(from), Some(to)) = (from, to) else { return Ok(1.0) };
    if from == to {
        return Ok(1.0);
    }
    match (Unit::parse(from), Unit::parse(to)) {
        (Some(a), Some(b)) if a.quantity == b.quantity => Ok(a.factor / b.factor),
        _ => Err(SimulateError::Unit {
            file: table.file.clone(),
            column: column.to_owned(),
            unit: from.to_owned(),
            wanted: to.to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_and_linear_inputs_differ_between_samples_and_agree_at_them() {
        let inputs = Inputs {
            time: vec![1.0, 2.0, 4.0],
            signals: vec![("u".to_owned(), vec![10.0, 20.0, 0.0])],
            ..Inputs::default()
        };
        let at = |t, hold| inputs.at(0, t, 0.5, hold);
        assert_eq!(at(2.0, Hold::Zoh), (20.0, 0.0));
        assert_eq!(at(2.0, Hold::Linear), (20.0, -10.0));
        assert_eq!(at(1.5, Hold::Zoh), (10.0, 0.0));
        assert_eq!(at(1.5, Hold::Linear), (15.0, 10.0));
        // A step that reaches over a sample gets its mean slope; outside the record the end values hold.
        assert_eq!(inputs.at(0, 1.5, 1.5, Hold::Linear), (15.0, (10.0 - 15.0) / 1.5));
        assert_eq!(at(0.0, Hold::Linear).0, 10.0);
        assert_eq!(at(9.0, Hold::Linear), (0.0, 0.0));
    }
}
