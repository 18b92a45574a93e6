//! The result of an identification as plain data: what the terminal, the JSON file and the HTML report show.

use serde::Serialize;

use super::identifiability::Identifiability;
use super::levenberg::Termination;
use super::parameters::Estimated;
use super::run::NOISE_FREE;
use crate::axis::Parameters;
use crate::trace::{AxisKind, Signal};

/// Version of the JSON form.
pub const SCHEMA: &str = "eixo.identification/1";

/// Why estimates with a natural frequency that no sample shows are refused.
pub(super) const UNSEEN: &str = "the natural frequency of its estimates lies beyond half the sampling rate, where no sample shows it: sample faster, or \
     identify a rigid axis (structure = \"rigid\" in the axis file)";

/// Everything an identification found.
#[derive(Debug, Clone, Serialize)]
pub struct Identification {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Name of the machine.
    pub machine: String,
    /// `two_inertia` or `rigid`.
    pub structure: &'static str,
    /// What was identified from.
    pub trace: TraceSummary,
    /// One a method, in the order asked for.
    pub methods: Vec<MethodResult>,
    /// Index of the method to trust, and why.
    pub recommended: Option<Recommendation>,
    /// Whether the record identifies the axis, and what speaks against it.
    #[serde(rename = "earned")]
    pub identifiability: Identifiability,
    /// The measured torque, for plotting, and its spectrum.
    pub torque: Series,
    /// Amplitude spectrum of the measured torque.
    pub torque_spectrum: Series,
    /// For periodic records: measured against modelled frequency response.
    pub frequency_response: Option<FrequencyResponse>,
    /// What the user should know, each with what to do.
    pub warnings: Vec<String>,
}

/// The method to trust.
#[derive(Debug, Clone, Serialize)]
pub struct Recommendation {
    /// Index into [`Identification::methods`].
    pub method: usize,
    /// Why.
    pub why: String,
}

/// What the record was.
#[derive(Debug, Clone, Serialize)]
pub struct TraceSummary {
    /// The file.
    pub file: String,
    /// Number of samples.
    pub samples: usize,
    /// Interval, s.
    pub dt: f64,
    /// First sample, s.
    pub start: f64,
    /// Length, s.
    pub duration: f64,
    /// `zoh` or `linear`.
    pub hold: &'static str,
    /// The signals it has.
    pub signals: Vec<Signal>,
    /// Samples of a period, where the record is periodic.
    pub period: Option<usize>,
    /// Pieces that the record is used in: gaps, standstill and stretches without drive lie between them.
    pub pieces: usize,
}

/// A parameter as estimated. In JSON `value` and `error_percent` are null where [`Estimate::is_determined`] says that it is none, which
/// `determined` repeats.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Its name: I1, I2, B, K, wn, wd, zeta, ...
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// The estimate.
    pub value: f64,
    /// Standard error as the estimator gives it; None where it gives none.
    pub std: Option<f64>,
    /// The reference, where one is given.
    pub reference: Option<f64>,
    /// `100*(value - reference)/reference`.
    pub error_percent: Option<f64>,
}

/// How well a simulation with the estimates follows a measured output.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutputFit {
    /// The output.
    pub signal: Signal,
    /// Root mean square of the measured output about its mean.
    pub rms: f64,
    /// Root mean square of measured minus simulated.
    pub rms_error: f64,
    /// `100*(1 - rms_error/rms)`.
    pub fit_percent: f64,
    /// Whiteness of measured minus simulated.
    pub whiteness: Whiteness,
    /// Measured minus simulated, for plotting.
    pub residual: Series,
}

/// Ljung-Box test of a residual.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Whiteness {
    /// The statistic.
    pub q: f64,
    /// Lags it sums over.
    pub lags: usize,
    /// Probability of a larger one if the residual were white.
    pub p_value: f64,
    /// Whether it passes at the 1 % level.
    pub white: bool,
}

/// A curve, thinned for plotting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// What it shows.
    pub name: String,
    /// Unit of x.
    pub x_unit: &'static str,
    /// Unit of y.
    pub y_unit: &'static str,
    /// Abscissa.
    pub x: Vec<f64>,
    /// Ordinate.
    pub y: Vec<f64>,
}

/// The estimates of a recursive method over time (the paper's Figures 6 to 9).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct History {
    /// Time, s, at most some thousand points.
    pub time: Vec<f64>,
    /// One curve a parameter: name and values, NaN (null) while undetermined.
    pub parameters: Vec<(&'static str, Vec<f64>)>,
}

/// The torque estimated from the motion (Inverse Problem 2).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExcitationEstimate {
    /// How: the equation used.
    pub formulation: &'static str,
    /// `100*rms(estimate - T)/rms(T)`.
    pub error_percent: f64,
    /// Estimate, for plotting.
    pub estimate: Series,
    /// Estimate minus measured, for plotting (the paper's Figures 11 to 13).
    pub error: Series,
    /// Amplitude spectrum of the estimate (the paper's Figure 10).
    pub spectrum: Series,
}

/// What one method found.
#[derive(Debug, Clone, Serialize)]
pub struct MethodResult {
    /// `ls`, `rls`, `els`, `iv`, `oe`, `frequency`.
    pub method: &'static str,
    /// In words.
    pub title: String,
    /// The regression or the model behind it, in words.
    pub formulation: String,
    /// Estimates of the parameters.
    pub parameters: Vec<Estimate>,
    /// Modal parameters, standard errors propagated.
    pub modal: Vec<Estimate>,
    /// Fit of a simulation with the estimates, one an output.
    pub outputs: Vec<OutputFit>,
    /// Parameter histories of a recursive method.
    pub history: Option<History>,
    /// Excitation estimate with these parameters.
    pub excitation: Option<ExcitationEstimate>,
    /// How an iterative method ended.
    pub termination: Option<Termination>,
    /// Iterations of an iterative method.
    pub iterations: Option<usize>,
    /// Remarks.
    pub notes: Vec<String>,
    /// Why there is no estimate; the lists are then empty.
    pub failure: Option<String>,
}

/// Measured frequency response against the model's, at the excited lines.
#[derive(Debug, Clone, Serialize)]
pub struct FrequencyResponse {
    /// Frequencies of the lines, Hz.
    pub frequency: Vec<f64>,
    /// One a measured output.
    pub outputs: Vec<ResponseOf>,
    /// Periods averaged.
    pub periods: usize,
    /// Samples of a period.
    pub period: usize,
}

/// Frequency response from the torque to one output.
#[derive(Debug, Clone, Serialize)]
pub struct ResponseOf {
    /// The output.
    pub signal: Signal,
    /// Measured magnitude (output's unit over torque's).
    pub magnitude: Vec<f64>,
    /// Measured phase, rad.
    pub phase: Vec<f64>,
    /// Standard deviation of the measured response from the scatter between periods, magnitude.
    pub std: Vec<f64>,
    /// Modelled magnitude.
    pub model_magnitude: Vec<f64>,
    /// Modelled phase, rad.
    pub model_phase: Vec<f64>,
    /// `100*|G_model - G|/|G|` over all lines, root mean square with each line's own size.
    pub error_percent: f64,
    /// Frequency of the smallest magnitude inside the band, Hz, where it is a minimum (antiresonance).
    pub antiresonance: Option<f64>,
    /// Frequency of the largest inertia-normalised magnitude inside the band, Hz (resonance).
    pub resonance: Option<f64>,
}

impl OutputFit {
    /// Whether the residual is rounding, whose whiteness means nothing.
    #[must_use]
    pub fn is_rounding(&self) -> bool {
        self.rms_error <= NOISE_FREE * self.rms
    }
}

impl MethodResult {
    /// A method that has found nothing yet.
    #[must_use]
    pub fn empty(method: &'static str, title: &str) -> Self {
        Self {
            method,
            title: title.to_owned(),
            formulation: String::new(),
            parameters: Vec::new(),
            modal: Vec::new(),
            outputs: Vec::new(),
            history: None,
            excitation: None,
            termination: None,
            iterations: None,
            notes: Vec::new(),
            failure: None,
        }
    }

    /// Gives the result a reason instead of estimates and their history: values that no axis has would be misread.
    fn refuse(&mut self, why: &str) {
        self.history = None;
        self.failure = Some(why.to_owned());
    }

    /// Whether a simulation with the estimates is the record to within rounding: the residual then has no cause.
    #[must_use]
    pub fn explains_exactly(&self) -> bool {
        !self.outputs.is_empty() && self.outputs.iter().all(OutputFit::is_rounding)
    }

    /// Sets the estimates, compared with a reference where there is one, and the notes on them. `dt`: sampling interval, s.
    pub(super) fn assess(&mut self, estimated: &Estimated, reference: Option<&Parameters>, motion: AxisKind, dt: f64) {
        if !estimated.is_physical() {
            return self.refuse(
                "the estimates are not those of an axis (an inertia or the stiffness is not positive): noise or an unmodelled \
                 effect rules this regression; use OE, or diagnose the record",
            );
        }
        if estimated.is_unseen(dt) {
            return self.refuse(UNSEEN);
        }
        self.parameters = estimated.estimates(reference, motion);
        self.modal = estimated.modal(reference);
        for e in &self.parameters {
            if let Some(std) = e.std.filter(|s| *s > 0.5 * e.value.abs()) {
                let share = 100.0 * std / e.value.abs();
                let how = if share < 1e4 {
                    format!("hardly determined by this record (standard error {share:.0} % of the estimate)")
                } else {
                    "not determined by this record".to_owned()
                };
                self.notes.push(format!(
                    "{} is {how}; excite the axis more around its natural frequency, or trust the modal parameters",
                    e.name
                ));
            }
        }
    }
}

impl Estimate {
    /// An estimate against a reference.
    #[must_use]
    pub fn new(name: &'static str, unit: &'static str, value: f64, std: Option<f64>, reference: Option<f64>) -> Self {
        let error_percent = reference.filter(|r| *r != 0.0).map(|r| 100.0 * (value - r) / r);
        Self { name, unit, value, std, reference, error_percent }
    }

    /// Whether it is an estimate: one that an axis can have, and larger than its standard error.
    #[must_use]
    pub fn is_determined(&self) -> bool {
        let impossible = match self.name {
            "I" | "I1" | "I2" | "K" | "wn" => self.value <= 0.0,
            "B" | "zeta" => self.value < 0.0,
            _ => false,
        };
        let error = |std: f64| std.is_finite() && (std < self.value.abs() || self.value == 0.0);
        self.value.is_finite() && !impossible && self.std.is_none_or(error)
    }
}

impl Serialize for Estimate {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        /// The fields in their order.
        #[derive(Serialize)]
        struct Serialised {
            name: &'static str,
            unit: &'static str,
            value: Option<f64>,
            std: Option<f64>,
            reference: Option<f64>,
            error_percent: Option<f64>,
            determined: bool,
        }
        let &Self { name, unit, value, std, reference, error_percent } = self;
        let determined = self.is_determined();
        let if_determined = |v: Option<f64>| v.filter(|_| determined);
        Serialised {
            name,
            unit,
            value: if_determined(Some(value)),
            std,
            reference,
            error_percent: if_determined(error_percent),
            determined,
        }
        .serialize(serializer)
    }
}

/// Most points of a plotted curve.
const POINTS: usize = 4096;

impl Series {
    /// A curve over time `start + k*dt`, thinned so that every bucket keeps its extremes.
    #[must_use]
    pub fn over_time(name: impl Into<String>, y_unit: &'static str, start: f64, dt: f64, values: &[f64]) -> Self {
        Self::over(name, y_unit, |k| start + k as f64 * dt, values)
    }

    /// A curve over the times of a record that need not be even, thinned in the same way.
    pub(super) fn over(
        name: impl Into<String>,
        y_unit: &'static str,
        time: impl Fn(usize) -> f64,
        values: &[f64],
    ) -> Self {
        let kept = thin(values);
        Self {
            name: name.into(),
            x_unit: "s",
            y_unit,
            x: kept.iter().map(|k| time(*k)).collect(),
            y: kept.iter().map(|k| values[*k]).collect(),
        }
    }
}

/// Indices to plot: all, or the smallest and the largest of each bucket.
fn thin(values: &[f64]) -> Vec<usize> {
    let mut thinned = Thinned::new(values.len());
    values.iter().for_each(|v| thinned.take(*v));
    thinned.kept.into_iter().map(|(k, _)| k).collect()
}

/// The points of a long curve that are plotted, taken value by value.
pub(super) struct Thinned {
    length: usize,
    next: usize,
    /// The end of the bucket that is being filled, and its smallest and largest.
    bucket: usize,
    extremes: Option<[(usize, f64); 2]>,
    /// Index and value.
    pub kept: Vec<(usize, f64)>,
}

impl Thinned {
    /// For so many values.
    pub const fn new(length: usize) -> Self {
        Self { length, next: 0, bucket: 0, extremes: None, kept: Vec::new() }
    }

    /// Takes the next value.
    pub fn take(&mut self, value: f64) {
        let k = self.next;
        self.next += 1;
        if self.length <= POINTS {
            self.kept.push((k, value));
            return;
        }
        let [low, high] = self.extremes.get_or_insert([(k, value); 2]);
        if value < low.1 {
            *low = (k, value);
        }
        if value > high.1 {
            *high = (k, value);
        }
        let buckets = POINTS / 2;
        if self.next == (self.bucket + 1) * self.length / buckets {
            let (first, last) = if low.0 < high.0 { (*low, *high) } else { (*high, *low) };
            self.kept.push(first);
            if first.0 != last.0 {
                self.kept.push(last);
            }
            self.extremes = None;
            self.bucket += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_curve_keeps_its_extremes() {
        let mut values: Vec<f64> = (0..100_000).map(|k| (f64::from(k) * 1e-3).sin()).collect();
        values[54_321] = 9.0;
        values[12_345] = -9.0;
        let series = Series::over_time("a", "rad", 0.0, 0.5, &values);
        assert!(series.x.len() <= POINTS);
        assert!(series.y.contains(&9.0) && series.y.contains(&-9.0));
        assert!(series.x.contains(&(54_321.0 * 0.5)));
        assert!(series.x.windows(2).all(|w| w[0] < w[1]));
    }

    #[test]
    fn an_estimate_that_is_none_is_no_number_in_json() {
        let json =
            |name, value, std| serde_json::to_value(Estimate::new(name, "kg.m2", value, std, Some(2.0))).unwrap();
        let sure = json("I2", 1.0, Some(0.5));
        assert_eq!((sure["value"].as_f64(), sure["error_percent"].as_f64()), (Some(1.0), Some(-50.0)));
        assert_eq!(sure["determined"].as_bool(), Some(true));
        for (name, value, std) in
            [("I2", 1.0, Some(1.5)), ("I1", -1.0, Some(0.1)), ("B", -0.1, None), ("K", 1.0, Some(f64::NAN))]
        {
            let none = json(name, value, std);
            assert!(none["value"].is_null() && none["error_percent"].is_null(), "{none}");
            assert_eq!((none["name"].as_str(), none["determined"].as_bool()), (Some(name), Some(false)));
        }
        // No friction at all is one.
        assert_eq!(json("B", 0.0, Some(0.1))["value"].as_f64(), Some(0.0));
    }

    #[test]
    fn an_error_is_relative_to_its_reference() {
        let error = Estimate::new("K", "N.m/rad", 1.1, None, Some(2.0)).error_percent.unwrap();
        assert!((error + 45.0).abs() < 1e-12);
        assert_eq!(Estimate::new("K", "N.m/rad", 1.1, None, Some(0.0)).error_percent, None);
    }
}
