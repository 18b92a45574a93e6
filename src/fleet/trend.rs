//! How a parameter drifts over a machine's records: the line through its estimates, by least squares.

use super::{Placed, Tracked};
use crate::identify::identifiability::DETERMINED;

/// A parameter of one machine over its records.
pub(super) struct Trend<'a> {
    /// The machine.
    pub machine: &'a str,
    /// The parameter: name and unit.
    pub parameter: &'a Tracked,
    /// Abscissae: days since the machine's first record, or the number of the record where not every one has a date.
    pub at: Vec<f64>,
    /// Estimates and standard errors.
    pub values: Vec<(f64, Option<f64>)>,
    /// Whether the abscissae are days.
    pub days: bool,
}

/// What a parameter did over the records.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Moved {
    /// No more than two standard errors.
    WithinItsError,
    /// By this share of itself.
    By(f64),
}

/// A change by a smaller share of the parameter is one of rounding.
const LEAST: f64 = 1e-6;

impl<'a> Trend<'a> {
    /// Every parameter of every machine that was determined at least twice; the rows in the summary's order.
    pub fn all(rows: &'a [Placed<'a>]) -> Vec<Self> {
        let mut trends: Vec<Self> = Vec::new();
        for of_machine in rows.chunk_by(|a, b| a.machine == b.machine) {
            let done = || of_machine.iter().filter(|p| p.row.done);
            let first = done().find_map(|p| p.when.as_ref()).map(|w| w.days);
            let last = done().filter_map(|p| p.when.as_ref()).next_back().map(|w| w.days);
            let days = done().all(|p| p.when.is_some()) && first < last;
            let mut of: Vec<Self> = Vec::new();
            for (k, placed) in done().enumerate() {
                let at = match (&placed.when, first) {
                    (Some(when), Some(first)) if days => when.days - first,
                    _ => k as f64 + 1.0,
                };
                for parameter in &placed.row.parameters {
                    let found = of.iter().position(|t| t.parameter.name == parameter.name);
                    let index = found.unwrap_or_else(|| {
                        let machine = placed.machine.as_str();
                        of.push(Self { machine, parameter, at: Vec::new(), values: Vec::new(), days });
                        of.len() - 1
                    });
                    of[index].at.push(at);
                    of[index].values.push((parameter.value, parameter.std));
                }
            }
            trends.extend(of.into_iter().map(Self::determined).filter(|t| t.at.len() > 1));
        }
        trends
    }

    /// Without the estimates that their records did not determine: those whose two standard errors are more of them, and of the largest
    /// that was determined, than `identify` calls determined, and those without an error where others have one.
    fn determined(self) -> Self {
        let within = |std: f64, of: f64| 2.0 * std <= DETERMINED * of;
        let has_errors = self.values.iter().any(|(_, std)| std.is_some());
        let sure = self.values.iter().filter(|(value, std)| std.is_some_and(|std| within(std, value.abs())));
        let largest = sure.map(|(value, _)| value.abs()).fold(0.0, f64::max);
        let kept = |(value, std): &(f64, Option<f64>)| std.map_or(!has_errors, |s| within(s, value.abs().max(largest)));
        let (at, values) = self.at.into_iter().zip(self.values).filter(|(_, v)| kept(v)).unzip();
        Self { at, values, ..self }
    }

    /// Change from the first record to the last, relative to the first.
    pub fn change(&self) -> Option<f64> {
        let (first, last) = (self.values.first()?.0, self.values.last()?.0);
        (first != 0.0).then(|| last / first - 1.0)
    }

    /// Change of a record's estimate from that of the first record that determined it, relative to that; none where the record did
    /// not determine it itself.
    pub fn since_first(&self, own: &Tracked) -> Option<f64> {
        let first = self.values.first()?.0;
        (first != 0.0 && self.values.contains(&(own.value, own.std))).then(|| own.value / first - 1.0)
    }

    /// Rise of the line over the period, relative to the mean, and its standard error: from the scatter about the line, and no less
    /// than the estimates' own standard errors make it, as a few records lie on a line by chance. Needs three records.
    pub fn drift(&self) -> Option<(f64, f64)> {
        let n = self.at.len() as f64;
        let mean = |of: &dyn Fn(usize) -> f64| (0..self.at.len()).map(of).sum::<f64>() / n;
        let (t, y) = (mean(&|k| self.at[k]), mean(&|k| self.values[k].0));
        let sum = |of: &dyn Fn(usize) -> f64| n * mean(of);
        let spread = sum(&|k| (self.at[k] - t).powi(2));
        if self.at.len() < 3 || spread <= 0.0 || y == 0.0 {
            return None;
        }
        let slope = sum(&|k| (self.at[k] - t) * (self.values[k].0 - y)) / spread;
        let rest = sum(&|k| (self.values[k].0 - y - slope * (self.at[k] - t)).powi(2));
        let own = sum(&|k| ((self.at[k] - t) * self.values[k].1.unwrap_or_default()).powi(2)) / spread;
        let std = ((rest / (n - 2.0)).max(own) / spread).sqrt();
        let span = self.at.last()? - self.at.first()?;
        Some((slope * span / y.abs(), std * span / y.abs()))
    }

    /// The drift, or of two records the change, and its standard error where it can be computed.
    fn shown(&self) -> Option<(f64, Option<f64>)> {
        if let Some((drift, std)) = self.drift() {
            return Some((drift, Some(std)));
        }
        let ((first, one), (_, other)) = (self.values.first()?, self.values.last()?);
        let std = one.zip(*other).map(|(one, other)| one.hypot(other) / first.abs());
        Some((self.change()?, std))
    }

    /// What the parameter did, as a table of many shows it: a change within two standard errors is not one of the machine.
    pub fn moved(&self) -> Option<Moved> {
        let (drift, std) = self.shown()?;
        let within = std.is_some_and(|std| drift.abs() <= 2.0 * std) || drift.abs() <= LEAST;
        Some(if within { Moved::WithinItsError } else { Moved::By(drift) })
    }

    /// Whether the drift stands out of the scatter: four standard errors.
    pub fn is_significant(&self) -> bool {
        self.drift().is_some_and(|(drift, std)| drift.abs() > 4.0 * std && drift.abs() > LEAST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records a day apart.
    fn of<T>(values: &[f64], std: Option<f64>, ask: impl Fn(&Trend) -> T) -> T {
        let parameter = Tracked { name: "K".into(), unit: String::new(), value: values[0], std };
        let at = (0..values.len()).map(|k| k as f64).collect();
        let values = values.iter().map(|v| (*v, std)).collect();
        ask(&Trend { machine: "press", parameter: &parameter, at, values, days: true })
    }

    #[test]
    fn an_estimate_that_its_record_does_not_determine_is_no_part_of_a_trend() {
        let parameter = Tracked { name: "K".into(), unit: String::new(), value: 20.0, std: None };
        let kept = |values: &[(f64, Option<f64>)]| {
            let at = (0..values.len()).map(|k| k as f64).collect();
            let trend = Trend { machine: "press", parameter: &parameter, at, values: values.to_vec(), days: true };
            trend.determined().at
        };
        let sure = (20.0, Some(0.2));
        // Two errors of three tenths, and one more; a value at the end of its range has no error.
        assert_eq!(kept(&[sure, (20.0, Some(3.0)), (20.0, Some(3.01)), sure]), [0.0, 1.0, 3.0]);
        assert_eq!(kept(&[sure, (1e9, Some(1e9)), (2.5e-98, None), sure]), [0.0, 3.0]);
        // A bias that begins at zero is known as well as later.
        assert_eq!(kept(&[(0.01, Some(0.2)), sure]), [0.0, 1.0]);
        assert_eq!(kept(&[(20.0, None), (21.0, None)]), [0.0, 1.0]);
    }

    fn drifts(values: [f64; 3], std: Option<f64>) -> bool {
        of(&values, std, |t| t.is_significant())
    }

    #[test]
    fn a_change_of_no_more_than_two_standard_errors_is_told_as_none() {
        let moved = |values: &[f64], std| of(values, std, |t| t.moved());
        assert_eq!(moved(&[20.0, 20.3, 20.1], Some(0.2)), Some(Moved::WithinItsError));
        assert!(
            matches!(moved(&[20.0, 20.5, 21.0], Some(0.2)), Some(Moved::By(drift)) if (drift - 1.0 / 20.5).abs() < 1e-9)
        );
        // Of two records: the errors of both, 0.2*sqrt(2).
        assert_eq!(moved(&[20.0, 20.56], Some(0.2)), Some(Moved::WithinItsError));
        assert!(matches!(moved(&[20.0, 20.58], Some(0.2)), Some(Moved::By(drift)) if (drift - 0.029).abs() < 1e-9));
        // Where the error is not known, the change is shown; one of rounding is not.
        assert!(matches!(moved(&[20.0, 20.1], None), Some(Moved::By(_))));
        assert_eq!(moved(&[20.0, 20.0 + 1e-9], None), Some(Moved::WithinItsError));
    }

    #[test]
    fn three_records_that_lie_on_a_line_within_their_errors_are_no_drift() {
        // A friction as it was estimated from three parts of one record of a ball screw, N.
        assert!(!drifts([20.97, 20.67, 19.91], Some(0.5)));
        assert!(drifts([20.97, 20.44, 19.91], Some(0.05)));
        assert!(drifts([20.97, 20.44, 19.91], None));
    }
}
