//! One identification from start to finish: every method asked for, its fit, and which one to trust.

use super::bridged;
use super::frequency;
use super::identifiability::{Evidence, Identifiability};
use super::joined::{Joined, noise_in_pieces};
use super::known::Known;
use super::methods::Run;
use super::output_error::OutputError;
use super::record::{RegressionRecord, period};
use super::result::{Identification, MethodResult, Recommendation, SCHEMA, Series, TraceSummary};
use super::rigid;
use super::statistics::spectrum;
use crate::axis::{Hold, Scheme, Structure};
use crate::numerics::level::rms;
use crate::trace::{AxisKind, Machine, Signal, Trace, TraceError};

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

    pub(super) const fn title(self) -> &'static str {
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
pub(super) const NOISE_FREE: f64 = 1e-9;

/// Relative difference of a logged speed from the derivative of its angle from which it is left out.
pub(super) const DIFFERENT_SPEED: f64 = 0.5;

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

pub(super) fn torque_unit(motion: AxisKind) -> &'static str {
    Signal::T.unit(motion)
}

/// Progress over a known number of steps: each is reported as "n of N".
pub(super) struct Steps<'a> {
    done: usize,
    all: usize,
    progress: &'a mut dyn FnMut(&str),
}

impl<'a> Steps<'a> {
    /// Of `all` steps, reported to `progress`.
    pub(super) fn new(all: usize, progress: &'a mut dyn FnMut(&str)) -> Self {
        Self { done: 0, all, progress }
    }

    /// The next one begins.
    pub(super) fn next(&mut self, what: &str) {
        self.done += 1;
        (self.progress)(&format!("{} of {}: {what}", self.done, self.all));
    }
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
    identify_joined(Joined::one(trace), machine, request, file, progress)
}

/// Identifies the machine from the pieces of a record, used together: see [`identify`].
///
/// # Errors
/// As [`identify`].
pub fn identify_joined(
    mut joined: Joined<'_>,
    machine: &Machine,
    request: &Request,
    file: &str,
    progress: &mut dyn FnMut(&str),
) -> Result<Identification, TraceError> {
    let mut warnings = bridged::lost(&mut joined);
    if machine.structure == Structure::Rigid {
        let mut result = rigid::identify(&joined, machine, request, file, progress)?;
        result.warnings.splice(0..0, warnings);
        return Ok(result);
    }
    for (angle, speed) in [(Signal::Theta1, Signal::Omega1), (Signal::Theta2, Signal::Omega2)] {
        let off = speed_error(&joined, angle, speed);
        if off > DIFFERENT_SPEED {
            joined.remove(speed);
            warnings.push(different_speed(speed, angle, off));
        }
    }
    let joined = &joined;
    // The regressions have no term for the effects that the axis file gives.
    let known = Known::of(machine);
    warnings.extend(known.warnings(machine.structure));
    let taken_off = known.taken_off(joined, machine)?;
    let regressed = taken_off.as_ref().unwrap_or(joined);
    let record = RegressionRecord::of(regressed, machine.parameters.rho)?;
    if record.zero_offset != 0.0 {
        warnings.push(format!(
            "the zeros of the two encoders differ by {:.6} {}: the mean twist was taken off, and output error fits the \
             rest",
            record.zero_offset,
            Signal::Theta2.unit(machine.signals.motion)
        ));
    }
    // Only within a piece are the periods known to follow each other.
    let longest = regressed.longest_trace();
    let pieces = joined.pieces().len();
    let samples = request.period.or_else(|| period(longest.get(Signal::T)?));
    let measured = samples.and_then(|n| frequency::measure(&longest, n));
    // On a measured record of several periods the regressions work on the average of the periods: drift, most of the
    // noise and what lies between the excited lines would rule them otherwise.
    let noisy = || noise_in_pieces(record.theta1, joined.pieces()) > NOISE_FREE * rms(record.theta1);
    let averaged = match &measured {
        Some(m) if m.periods >= 3 && noisy() && taken_off.is_none() => Some(frequency::average(&longest, m)?),
        _ => None,
    };
    let torque = joined.samples().require(Signal::T)?;
    let averaged_joined = averaged.as_ref().map(Joined::one);
    let record = match (&averaged, &averaged_joined) {
        (Some(average), _) => {
            warnings.push(format!(
                "the record is periodic: what is identified is the average of {} periods{}, excited lines only, speeds \
                 derived from the angles line by line",
                measured.as_ref().map_or(0, |m| m.periods),
                if pieces > 1 { " of its longest piece, the other pieces have no part in it" } else { "" }
            ));
            RegressionRecord::new(average, machine.parameters.rho)?
        }
        _ => record,
    };
    if averaged.is_none() && measured.is_some() && pieces > 1 && request.methods.contains(&Method::Frequency) {
        warnings.push(
            "the frequency response is that of the longest piece of the record alone: which phase the period has in the \
             others is not known"
                .to_owned(),
        );
    }
    if record.omega.is_none() {
        warnings.push(
            "speeds are not measured on both sides: the regressions work on differences of positions and are easily \
             biased by noise; trust output error"
                .to_owned(),
        );
    }
    // The derived speeds add nothing to the angles.
    let angles = averaged.as_ref().map(|average| {
        let mut angles = average.clone();
        angles.remove(Signal::Omega1);
        angles.remove(Signal::Omega2);
        angles
    });
    let angles = angles.as_ref().map(Joined::one);
    let compared = angles.as_ref().unwrap_or(joined);
    let outputs = OutputError::of(compared, machine.parameters.rho, machine.structure, machine.effects)?;
    let mut run = Run {
        joined,
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
    let wanted = Method::ALL
        .into_iter()
        .filter(|m| request.methods.contains(m) && (*m != Method::Frequency || measured.is_some()))
        .collect::<Vec<_>>();
    let mut steps = Steps::new(wanted.len() + 2, progress);
    for method in wanted {
        steps.next(method.title());
        methods.push(run.method(method));
    }
    steps.next("fits of the estimates");
    let scheme = run.scheme();
    for result in &mut methods {
        run.assess(result, scheme);
    }
    let recommended = recommend(&methods, record.omega.is_some());
    steps.next("held-out part");
    let best = recommended.as_ref().map(|r| &methods[r.method]);
    let simulated = best.and_then(|best| {
        let name = best.method;
        let found = run.estimates.iter().find(|(n, _)| *n == name && name != Method::Frequency.name())?;
        Some((best, found.1.parameters(machine.parameters.rho)))
    });
    let held_out = simulated.and_then(|(_, p)| run.held_out(&p, scheme));
    let driven = simulated.and_then(|(best, p)| run.driven(best, &p, scheme));
    let unseen_follows = simulated.is_some_and(|(_, p)| run.unseen_follows(&p, scheme));
    let evidence = Evidence { held_out, driven, unseen_follows, ..Evidence::default() };
    let identifiability = Identifiability::of(&methods, best, evidence);
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
        trace: summary(joined, file, samples.filter(|_| measured.is_some())),
        methods,
        recommended,
        identifiability,
        torque: Series::over("T", unit, |k| joined.time(k), torque),
        torque_spectrum: spectrum("T", unit, joined.samples().dt, &torque[joined.longest()]),
        frequency_response,
        warnings,
    })
}

/// Warning of a speed that is left out; `off` is its relative difference from the derivative of the angle.
pub(super) fn different_speed(speed: Signal, angle: Signal, off: f64) -> String {
    format!(
        "{speed} is not the derivative of {angle} (they differ by {:.0} %): a filtered, delayed or differently scaled \
         speed; it is left out. Leave it out of [signals], or mend its scale there",
        100.0 * off
    )
}

/// How far a logged speed is from the derivative of its angle, relative root mean square: the travel of the angle over eight
/// samples against the integral of the speed. Zero where one of them is not logged.
fn speed_error(joined: &Joined, angle: Signal, speed: Signal) -> f64 {
    const SPAN: usize = 8;
    let trace = joined.samples();
    let (Some(x), Some(v)) = (trace.get(angle), trace.get(speed)) else { return 0.0 };
    let (mut difference, mut size) = (0.0, 0.0);
    for piece in joined.pieces() {
        for k in (piece.start..piece.end.saturating_sub(SPAN)).step_by(SPAN) {
            let travel = x[k + SPAN] - x[k];
            let integral = trace.dt * (v[k..k + SPAN].iter().sum::<f64>() + 0.5 * (v[k + SPAN] - v[k]));
            difference += (travel - integral).powi(2);
            size += travel * travel;
        }
    }
    if size > 0.0 { (difference / size).sqrt() } else { 0.0 }
}

/// What the record was.
pub(super) fn summary(joined: &Joined, file: &str, period: Option<usize>) -> TraceSummary {
    let trace = joined.samples();
    TraceSummary {
        file: file.to_owned(),
        samples: trace.len(),
        dt: trace.dt,
        start: trace.start,
        duration: trace.len() as f64 * trace.dt,
        hold: hold_name(trace.hold),
        signals: trace.signals().collect(),
        period,
        pieces: joined.pieces().len(),
    }
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
        if m.explains_exactly() {
            let why = "its simulation is the record to within rounding: nothing is left to explain";
            return Some(Recommendation { method: *index, why: why.to_owned() });
        }
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
            "it follows the record best; its residuals are not white, which its standard errors allow for: diagnose the \
             record for what the model leaves out"
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
