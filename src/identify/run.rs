//! One identification from start to finish: every method asked for, its fit, and which one to trust.

use super::frequency::{self, Measured};
use super::instrumental::instrumental;
use super::output_error::{Fit, Free, OutputError};
use super::parameters::Estimated;
use super::record::{Record, period};
use super::regression::{NOISE_ORDER, RegressionError, extended_batch, extended_recursive, least_squares, recursive};
use super::result::{
    ExcitationEstimate, History, Identification, MethodResult, OutputFit, Recommendation, SCHEMA, Series, TraceSummary,
};
use super::statistics::{deviation, noise_level, rms, spectrum, whiteness};
use super::{paper, rigid};
use crate::axis::{Hold, Parameters, Scheme, Structure};
use crate::effects::EFFECTS;
use crate::trace::{Machine, Motion, Signal, Trace, TraceError};

/// An estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Least squares.
    Ls,
    /// Recursive least squares.
    Rls,
    /// Extended least squares, recursive.
    Els,
    /// Extended least squares, in batches.
    ElsBatch,
    /// Instrumental variables.
    Iv,
    /// Output error.
    Oe,
    /// Frequency response of a periodic record.
    Frequency,
}

impl Method {
    /// All of them, in the order they run: each may start from those before it.
    pub const ALL: [Self; 7] = [Self::Ls, Self::Rls, Self::Els, Self::ElsBatch, Self::Frequency, Self::Iv, Self::Oe];

    /// The name in files and on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ls => "ls",
            Self::Rls => "rls",
            Self::Els => "els",
            Self::ElsBatch => "els_batch",
            Self::Iv => "iv",
            Self::Oe => "oe",
            Self::Frequency => "frequency",
        }
    }

    const fn title(self) -> &'static str {
        match self {
            Self::Ls => "Least squares",
            Self::Rls => "Recursive least squares",
            Self::Els => "Extended least squares, recursive",
            Self::ElsBatch => "Extended least squares, batch",
            Self::Iv => "Instrumental variables",
            Self::Oe => "Output error",
            Self::Frequency => "Frequency response",
        }
    }
}

/// Noise below this share of a signal is rounding: the record was simulated.
const NOISE_FREE: f64 = 1e-9;

/// Relative difference of a logged speed from the derivative of its angle from which it is left out.
const DIFFERENT_SPEED: f64 = 0.5;

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The methods.
    pub methods: Vec<Method>,
    /// Forgetting factor of the recursive methods.
    pub forgetting: f64,
    /// `P(0)` of the recursive methods, on regressors of unit rms.
    pub p0: f64,
    /// The paper's Euler regression in place of the consistent one, for LS, RLS and ELS.
    pub paper: bool,
    /// Samples of a period; None: found from the torque.
    pub period: Option<usize>,
    /// Whether the machine's parameters are a reference to compare with.
    pub reference: bool,
    /// Integration of the simulations; None: the one that fits better.
    pub scheme: Option<Scheme>,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            methods: Method::ALL.to_vec(),
            forgetting: 1.0,
            p0: 1e8,
            paper: false,
            period: None,
            reference: false,
            scheme: None,
        }
    }
}

/// The name of a hold, as in axis.toml.
#[must_use]
pub const fn hold_name(hold: Hold) -> &'static str {
    match hold {
        Hold::Zoh => "zoh",
        Hold::Linear => "linear",
    }
}

fn torque_unit(motion: Motion) -> &'static str {
    Signal::T.unit(motion)
}

/// Identifies the machine from a trace. `file` names the trace in the result; `progress` hears what is being done.
///
/// # Errors
/// When the trace lacks a signal. A method that cannot give an estimate is no error: its result says why.
pub fn identify(
    trace: &Trace,
    machine: &Machine,
    request: &Request,
    file: &str,
    progress: &mut dyn FnMut(&str),
) -> Result<Identification, TraceError> {
    if machine.structure == Structure::Rigid {
        return rigid::identify(trace, machine, request, file, progress);
    }
    let mut warnings = Vec::new();
    let mut consistent = trace.clone();
    for (angle, speed) in [(Signal::Theta1, Signal::Omega1), (Signal::Theta2, Signal::Omega2)] {
        let off = speed_error(trace, angle, speed);
        if off > DIFFERENT_SPEED {
            consistent.remove(speed);
            warnings.push(format!(
                "{speed} is not the derivative of {angle} (they differ by {:.0} %): a filtered, delayed or differently \
                 scaled speed; it is left out. Leave it out of [signals], or mend its scale there",
                100.0 * off
            ));
        }
    }
    let trace = &consistent;
    let record = Record::new(trace, machine.parameters.rho)?;
    let known: Vec<&str> = EFFECTS.iter().filter(|e| machine.effects.is_on(**e)).map(|e| e.info().id).collect();
    if !known.is_empty() {
        warnings.push(format!(
            "the effects of the axis file ({}) are part of the output-error model alone; the regressions leave them out",
            known.join(", ")
        ));
    }
    if record.zero_offset != 0.0 {
        warnings.push(format!(
            "the zeros of the two encoders differ by {:.6} {}: the mean twist was taken off, and output error fits the \
             rest",
            record.zero_offset,
            Signal::Theta2.unit(machine.signals.motion)
        ));
    }
    let samples = request.period.or_else(|| period(record.torque));
    let measured = samples.and_then(|n| frequency::measure(trace, n));
    // On a measured record of several periods the regressions work on the average of the periods: drift, most of the
    // noise and what lies between the excited lines would rule them otherwise.
    let noisy = || noise_level(record.theta1) > NOISE_FREE * rms(record.theta1);
    let averaged = match &measured {
        Some(m) if m.periods >= 3 && noisy() => Some(frequency::average(trace, m)?),
        _ => None,
    };
    let whole = Record::new(trace, machine.parameters.rho)?;
    let record = match &averaged {
        Some(average) => {
            warnings.push(format!(
                "the record is periodic: what is identified is the average of {} periods, excited lines only, speeds \
                 derived from the angles line by line",
                measured.as_ref().map_or(0, |m| m.periods)
            ));
            Record::new(average, machine.parameters.rho)?
        }
        None => record,
    };
    if record.omega.is_none() {
        warnings.push(
            "speeds are not measured on both sides: the regressions work on differences of positions and are easily \
             biased by noise; trust output error"
                .to_owned(),
        );
    }
    // The derived speeds say nothing that the angles do not.
    let angles = averaged.as_ref().map(|average| {
        let mut angles = average.clone();
        angles.remove(Signal::Omega1);
        angles.remove(Signal::Omega2);
        angles
    });
    let compared = angles.as_ref().unwrap_or(trace);
    let outputs = OutputError::new(compared, machine.parameters.rho, machine.structure, machine.effects)?;
    let mut run = Run {
        trace,
        compared,
        machine,
        request,
        record: &record,
        outputs: &outputs,
        measured: measured.as_ref(),
        estimates: Vec::new(),
        oe: None,
    };
    let mut methods = Vec::new();
    for method in Method::ALL {
        if !request.methods.contains(&method) || (method == Method::Frequency && measured.is_none()) {
            continue;
        }
        progress(method.title());
        methods.push(run.method(method));
    }
    progress("fits of the estimates");
    let scheme = run.scheme();
    for result in &mut methods {
        run.judge(result, scheme);
    }
    let recommended = recommend(&methods, record.omega.is_some());
    let frequency_response = measured.as_ref().and_then(|m| {
        let index = recommended.as_ref()?.method;
        let p = run.estimates.iter().find(|(name, _)| *name == methods[index].method)?.1.parameters(1.0);
        p.check(Structure::TwoInertia).ok()?;
        Some(m.against(&p, Structure::TwoInertia, scheme))
    });
    let unit = torque_unit(machine.signals.motion);
    Ok(Identification {
        schema: SCHEMA,
        machine: machine.name.clone(),
        structure: "two_inertia",
        trace: summary(trace, file, samples.filter(|_| measured.is_some())),
        methods,
        recommended,
        torque: Series::over_time("T", unit, trace.start, trace.dt, whole.torque),
        torque_spectrum: spectrum("T", unit, trace.dt, whole.torque),
        frequency_response,
        warnings,
    })
}

/// How far a logged speed is from the derivative of its angle, relative root mean square: the angle's way over eight
/// samples against the integral of the speed. Zero where one of them is not logged.
fn speed_error(trace: &Trace, angle: Signal, speed: Signal) -> f64 {
    const SPAN: usize = 8;
    let (Some(x), Some(v)) = (trace.get(angle), trace.get(speed)) else { return 0.0 };
    let (mut difference, mut size) = (0.0, 0.0);
    for k in (0..x.len().saturating_sub(SPAN)).step_by(SPAN) {
        let way = x[k + SPAN] - x[k];
        let integral = trace.dt * (v[k..k + SPAN].iter().sum::<f64>() + 0.5 * (v[k + SPAN] - v[k]));
        difference += (way - integral).powi(2);
        size += way * way;
    }
    if size > 0.0 { (difference / size).sqrt() } else { 0.0 }
}

/// What the record was.
pub(super) fn summary(trace: &Trace, file: &str, period: Option<usize>) -> TraceSummary {
    TraceSummary {
        file: file.to_owned(),
        samples: trace.len(),
        dt: trace.dt,
        start: trace.start,
        duration: trace.len() as f64 * trace.dt,
        hold: hold_name(trace.hold),
        signals: trace.signals().collect(),
        period,
    }
}

struct Run<'a> {
    trace: &'a Trace,
    /// What simulations are compared with.
    compared: &'a Trace,
    machine: &'a Machine,
    request: &'a Request,
    record: &'a Record<'a>,
    outputs: &'a OutputError<'a>,
    measured: Option<&'a Measured>,
    estimates: Vec<(&'static str, Estimated)>,
    oe: Option<Fit>,
}

type Found = (Estimated, Option<History>);

impl Run<'_> {
    fn method(&mut self, method: Method) -> MethodResult {
        let (lambda, p0) = (self.request.forgetting, self.request.p0);
        let mut result = MethodResult {
            method: method.name(),
            title: method.title().to_owned(),
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
        };
        let plain = format!("F5, {}", self.record.equations());
        let recursive_words = format!("forgetting factor {lambda}, P(0) = {p0:e}");
        let found: Result<Found, String> = match method {
            _ if self.request.paper && matches!(method, Method::Ls | Method::Rls | Method::Els | Method::ElsBatch) => {
                result.formulation = "Euler 5x4 (paper, eq. 6)".to_owned();
                result.notes.push(paper::EULER_NOTE.to_owned());
                self.euler(method)
            }
            Method::Ls => {
                result.formulation = format!("{plain}; QR");
                least_squares(self.record).map(|e| (e, None)).map_err(|e| e.to_string())
            }
            Method::Rls => {
                result.formulation = format!("{plain}; {recursive_words}");
                recursive(self.record, lambda, p0).map(|(e, h)| (e, Some(h))).map_err(|e| e.to_string())
            }
            Method::Els => {
                result.formulation = format!("{plain}; noise model of order {NOISE_ORDER}; {recursive_words}");
                extended_recursive(self.record, lambda, p0).map(|(e, h)| (e, Some(h))).map_err(|e| e.to_string())
            }
            Method::ElsBatch => {
                result.formulation = format!("{plain}; noise model of order {NOISE_ORDER}");
                extended_batch(self.record).map(|e| (e, None)).map_err(|e| e.to_string())
            }
            Method::Iv => {
                result.formulation = format!("S4, {}; instruments simulated", self.record.equations());
                self.instrumental(&mut result).map(|e| (e, None)).map_err(|e| e.to_string())
            }
            Method::Oe => self.output_error(&mut result).map(|e| (e, None)),
            Method::Frequency => self.frequency(&mut result).map(|e| (e, None)),
        };
        match found {
            Ok((estimated, history)) => {
                result.history = history;
                self.take(&mut result, estimated);
            }
            Err(why) => result.failure = Some(why),
        }
        result
    }

    fn take(&mut self, result: &mut MethodResult, estimated: Estimated) {
        let reference = self.request.reference.then_some(&self.machine.parameters);
        result.parameters = estimated.estimates(reference, self.machine.signals.motion);
        if estimated.is_physical() {
            result.modal = estimated.modal(reference);
            for e in &result.parameters {
                if e.std.is_some_and(|s| s > 0.5 * e.value.abs()) {
                    result.notes.push(format!(
                        "{} is hardly determined by this record (standard error {:.0} % of the estimate); excite the \
                         axis more around its natural frequency, or trust the modal parameters",
                        e.name,
                        100.0 * e.std.unwrap_or_default() / e.value.abs()
                    ));
                }
            }
        } else {
            result.notes.push(
                "the estimates are not physical (an inertia or the stiffness is not positive): noise or an unmodelled \
                 effect rules this regression; use OE, or diagnose the record"
                    .to_owned(),
            );
        }
        self.estimates.push((result.method, estimated));
    }

    fn euler(&self, method: Method) -> Result<Found, String> {
        let (lambda, p0) = (self.request.forgetting, self.request.p0);
        match method {
            Method::Ls => paper::euler_least_squares(self.record).map(|e| (e, None)),
            Method::Rls => paper::euler_recursive(self.record, lambda, p0, false).map(|(e, h)| (e, Some(h))),
            Method::Els => paper::euler_recursive(self.record, lambda, p0, true).map(|(e, h)| (e, Some(h))),
            _ => Err(RegressionError::Diverged { what: "batch ELS has no Euler form; it" }),
        }
        .map_err(|e| e.to_string())
    }

    /// The start that simulates best, of all estimates so far and the axis file.
    fn start(&self) -> Option<Parameters> {
        let rho = self.machine.parameters.rho;
        let mut starts: Vec<Parameters> = self
            .estimates
            .iter()
            .filter(|(_, e)| e.is_physical())
            .map(|(_, e)| e.parameters(rho))
            .map(|p| Parameters { b: p.b.max(0.0), ..p })
            .collect();
        if starts.is_empty() {
            // Nothing was asked for that could serve: least squares costs next to nothing.
            starts.extend(least_squares(self.record).ok().filter(Estimated::is_physical).map(|e| e.parameters(rho)));
        }
        if let Some(measured) = self.measured {
            starts.extend(measured.guess(rho));
        }
        starts.push(self.machine.parameters);
        let free = Free { parameters: false, offset: self.record.zero_offset != 0.0, bias: true };
        starts
            .into_iter()
            .filter(|p| p.check(Structure::TwoInertia).is_ok() && p.k > 0.0)
            .map(|p| (likelihood(&self.outputs.fit(&p, Scheme::Exact, free), self.record.len()), p))
            .filter(|(l, _)| l.is_finite())
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, p)| p)
    }

    fn instrumental(&self, result: &mut MethodResult) -> Result<Estimated, RegressionError> {
        let start = self.start().ok_or(RegressionError::Diverged { what: "the search for a start" })?;
        let (estimated, rounds) = instrumental(self.record, self.outputs, &start)?;
        result.iterations = Some(rounds);
        Ok(estimated)
    }

    fn output_error(&mut self, result: &mut MethodResult) -> Result<Estimated, String> {
        let start = self.start().ok_or("no physical start was found: give one with --axis")?;
        let offset = self.record.zero_offset != 0.0;
        let plain = Free { parameters: true, offset, bias: false };
        let schemes = self.request.scheme.map_or_else(|| vec![Scheme::Exact, Scheme::NEWMARK], |s| vec![s]);
        let n = self.compared.len();
        let better = |a: Fit, b: Fit| if likelihood(&b, n) > likelihood(&a, n) { b } else { a };
        let mut best = schemes
            .iter()
            .map(|s| self.outputs.fit(&start, *s, plain))
            .reduce(better)
            .ok_or("no integration scheme was asked for")?;
        // A constant torque (amplifier offset, gravity) joins where it explains more than chance would.
        let exact = best.sigma.iter().zip(self.outputs.outputs()).all(|(s, (_, y))| *s < 1e-9 * rms(y));
        if !exact {
            let rho = self.machine.parameters.rho;
            let with = self.outputs.fit(&best.estimated.parameters(rho), best.scheme, Free { bias: true, ..plain });
            if likelihood(&with, n) - likelihood(&best, n) > (n as f64).ln() + 10.0 {
                best = with;
            }
        }
        let integration = match best.scheme {
            Scheme::Exact => "exact integration",
            Scheme::Newmark { .. } => "Newmark integration at the sampling interval",
        };
        let hold = hold_name(self.trace.hold);
        let channels: Vec<&str> = self.outputs.outputs().map(|(s, _)| s.name()).collect();
        result.formulation = format!("simulation of {} against the record; {integration}, {hold}", channels.join(", "));
        if best.bias != 0.0 {
            let unit = torque_unit(self.machine.signals.motion);
            result.notes.push(format!("a constant torque of {:.6e} {unit} was fitted with the parameters", best.bias));
        }
        result.termination = Some(best.termination);
        result.iterations = Some(best.iterations);
        if !best.termination.is_converged() {
            result.notes.push("the fit did not converge: give a nearer start with --axis".to_owned());
        }
        let estimated = best.estimated.clone();
        self.oe = Some(best);
        Ok(estimated)
    }

    fn frequency(&self, result: &mut MethodResult) -> Result<Estimated, String> {
        let measured = self.measured.ok_or("the record is not periodic")?;
        let rho = self.machine.parameters.rho;
        let scheme = self.request.scheme.unwrap_or(Scheme::Exact);
        let mut starts: Vec<Parameters> = measured.guess(rho).into_iter().collect();
        starts.extend(self.estimates.iter().filter(|(_, e)| e.is_physical()).map(|(_, e)| e.parameters(rho)));
        starts.push(self.machine.parameters);
        let fit = starts
            .iter()
            .filter(|p| p.check(Structure::TwoInertia).is_ok() && p.k > 0.0)
            .map(|p| measured.fit(p, scheme))
            .min_by(|a, b| a.model_error.total_cmp(&b.model_error))
            .ok_or("no physical start was found: give one with --axis")?;
        let f = measured.frequencies();
        result.formulation = format!(
            "response averaged over {} periods of {} samples, {} lines from {:.4} to {:.4} Hz",
            measured.periods,
            measured.period,
            f.len(),
            f.first().copied().unwrap_or_default(),
            f.last().copied().unwrap_or_default()
        );
        result.notes.push(format!(
            "the linear model leaves {:.1} % of the response unexplained beyond its noise; the standard errors take \
             that error as independent from line to line",
            100.0 * fit.model_error
        ));
        result.termination = Some(fit.termination);
        result.iterations = Some(fit.iterations);
        Ok(fit.estimated)
    }

    /// The integration that fits the record: as output error found it, else as asked for.
    fn scheme(&self) -> Scheme {
        self.oe.as_ref().map(|f| f.scheme).or(self.request.scheme).unwrap_or(Scheme::Exact)
    }

    /// Fit, whiteness and excitation estimate of a method's parameters.
    fn judge(&self, result: &mut MethodResult, scheme: Scheme) {
        let Some((_, estimated)) = self.estimates.iter().find(|(name, _)| *name == result.method) else { return };
        result.excitation = Some(self.excitation(estimated));
        let p = estimated.parameters(self.machine.parameters.rho);
        if p.check(Structure::TwoInertia).is_err() || p.k == 0.0 {
            return;
        }
        let free = Free {
            parameters: false,
            offset: self.record.zero_offset != 0.0,
            bias: self.oe.as_ref().is_some_and(|f| f.bias != 0.0),
        };
        let refit;
        let fit = match &self.oe {
            Some(fit) if result.method == Method::Oe.name() => fit,
            _ => {
                refit = self.outputs.fit(&p, scheme, free);
                &refit
            }
        };
        let residuals = self.outputs.residuals(fit);
        for ((signal, measured), (_, residual)) in self.outputs.outputs().zip(residuals) {
            result.outputs.push(output_fit(signal, measured, &residual, self.compared, self.machine.signals.motion));
        }
    }

    /// The torque from the motion (Inverse Problem 2): `I1*a1 + I2*a2` with measured accelerations, else row 1 of (2)
    /// between samples.
    fn excitation(&self, estimated: &Estimated) -> ExcitationEstimate {
        let v = &estimated.values;
        let (start, dt) = (self.trace.start, self.trace.dt);
        let accelerations = self.trace.get(Signal::Alpha1).zip(self.trace.get(Signal::Alpha2));
        let (formulation, first, estimate, truth): (_, f64, Vec<f64>, Vec<f64>) = match accelerations {
            Some((a1, a2)) => (
                "I1*alpha1 + I2*alpha2",
                start,
                a1.iter().zip(a2).map(|(a1, a2)| v[0] * a1 + v[1] * a2).collect(),
                self.trace.get(Signal::T).map_or_else(Vec::new, <[f64]>::to_vec),
            ),
            None => {
                let rows: Vec<_> = (0..self.record.rows()).map(|k| self.record.row(k)).collect();
                (
                    "I1*a1 + B*(w1 - w2) + K*(th1 - th2) between samples",
                    self.record.time(0),
                    rows.iter().map(|r| v[0] * r.a1 + v[2] * r.rate + v[3] * r.twist).collect(),
                    rows.iter().map(|r| r.torque).collect(),
                )
            }
        };
        let error: Vec<f64> = estimate.iter().zip(&truth).map(|(a, b)| a - b).collect();
        let unit = torque_unit(self.machine.signals.motion);
        ExcitationEstimate {
            formulation,
            error_percent: 100.0 * rms(&error) / rms(&truth).max(f64::MIN_POSITIVE),
            estimate: Series::over_time("estimated T", unit, first, dt, &estimate),
            error: Series::over_time("error of T", unit, first, dt, &error),
            spectrum: spectrum("estimated T", unit, dt, &estimate),
        }
    }
}

/// Fit and whiteness of one output.
pub(super) fn output_fit(
    signal: Signal,
    measured: &[f64],
    residual: &[f64],
    trace: &Trace,
    motion: Motion,
) -> OutputFit {
    let size = deviation(measured);
    let error = rms(residual);
    OutputFit {
        signal,
        rms: size,
        rms_error: error,
        fit_percent: 100.0 * (1.0 - error / size.max(f64::MIN_POSITIVE)),
        whiteness: whiteness(residual),
        residual: Series::over_time(
            format!("{signal}: measured - simulated"),
            signal.unit(motion),
            trace.start,
            trace.dt,
            residual,
        ),
    }
}

/// Twice the logarithm of the likelihood, but for a constant, at the levels of the residuals.
fn likelihood(fit: &Fit, samples: usize) -> f64 {
    -2.0 * samples as f64 * fit.sigma.iter().map(|s| s.ln()).sum::<f64>()
}

fn recommend(methods: &[MethodResult], speeds: bool) -> Option<Recommendation> {
    let usable = |m: &&(usize, &MethodResult)| m.1.failure.is_none() && !m.1.modal.is_empty();
    let all: Vec<(usize, &MethodResult)> = methods.iter().enumerate().collect();
    let find = |name: &str| all.iter().filter(usable).find(|(_, m)| m.method == name);
    let fit = |m: &MethodResult| {
        let n = m.outputs.len().max(1) as f64;
        m.outputs.iter().map(|o| (o.rms_error / o.rms).powi(2)).sum::<f64>() / n
    };
    let oe = find("oe").filter(|(_, m)| m.termination.is_some_and(super::levenberg::Termination::is_converged));
    let frequency =
        find("frequency").filter(|(_, m)| m.termination.is_some_and(super::levenberg::Termination::is_converged));
    if let Some((index, m)) = oe {
        let white = m.outputs.iter().all(|o| o.whiteness.white);
        if let (Some((other, _)), false) = (frequency, white) {
            return Some(Recommendation {
                method: *other,
                why: "the record is periodic and the simulation's residual is not white: the averaged frequency \
                      response is not ruled by drift and friction outside the excited lines"
                    .to_owned(),
            });
        }
        let why = if white {
            "its residuals are white: the model explains the record down to the noise"
        } else {
            "it follows the record best; its residuals are not white, so its standard errors are too small: diagnose \
             the record for what the model leaves out"
        };
        return Some(Recommendation { method: *index, why: why.to_owned() });
    }
    if let Some((index, _)) = frequency {
        return Some(Recommendation { method: *index, why: "it averages over the periods".to_owned() });
    }
    all.iter().filter(usable).min_by(|a, b| fit(a.1).total_cmp(&fit(b.1))).map(|(index, _)| Recommendation {
        method: *index,
        why: if speeds {
            "its simulation follows the record best of those asked for".to_owned()
        } else {
            "its simulation follows the record best of those asked for; with positions alone, output error (--method \
             oe) is less biased"
                .to_owned()
        },
    })
}
