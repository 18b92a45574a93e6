//! LS and RLS of a record larger than memory: its rows come in pieces, in three passes, and no piece is kept.
//!
//! ```text
//! pass 1   zeros of the encoders, whether the logged speeds are the derivatives of their angles
//! pass 2   least squares (the triangles of whole blocks, as in memory), scales of the regressors, the torque's plot
//! pass 3   recursive least squares
//! ```
//!
//! The numbers are those of the record in memory: the same rows, in the same blocks, in the same order.

use std::borrow::Cow;

use super::identifiability::{Evidence, Identifiability};
use super::lsq::BLOCK;
use super::parameters::Estimated;
use super::record::{DIFFERENT_ZEROS, RegressionRecord};
use super::regression::{LeastSquares, Moments, Recursion, RegressionError, RegressorScales, Sums};
use super::result::{History, Identification, MethodResult, Recommendation, SCHEMA, Series, Thinned, TraceSummary};
use super::run::{DIFFERENT_SPEED, Method, Request, Steps, different_speed, hold_name};
use crate::trace::stream::Stream;
use crate::trace::{Machine, Signal, Trace, TraceError};

/// The methods that can be streamed.
pub const METHODS: [Method; 2] = [Method::Ls, Method::Rls];

/// Samples that are not worked on yet, of every signal in use.
#[derive(Default)]
struct Pending {
    torque: Vec<f64>,
    theta1: Vec<f64>,
    theta2: Vec<f64>,
    omega1: Vec<f64>,
    omega2: Vec<f64>,
    /// Rows worked on before them.
    rows: usize,
}

/// The record, and what the first pass found.
struct Frame<'a> {
    stream: &'a Stream,
    /// Travel of the table per angle, m/rad.
    rho: f64,
    /// Added to theta2, rad.
    zero_offset: f64,
    /// Whether the rows use the logged speeds.
    speeds: bool,
}

impl Frame<'_> {
    /// Samples that a row spans beyond its first.
    const fn span(&self) -> usize {
        if self.speeds { 1 } else { 2 }
    }

    fn rows(&self) -> usize {
        self.stream.len().saturating_sub(self.span())
    }

    /// Passes the rows to `take(record, count, first)`, from the first to the last: the first `count` rows of `record` are those from
    /// number `first` on.
    ///
    /// # Errors
    /// As [`Stream::each`].
    fn each(&self, mut take: impl FnMut(&RegressionRecord, usize, usize)) -> Result<(), TraceError> {
        let mut pending = Pending::default();
        let total = self.rows();
        self.stream.each(|_, piece| {
            pending.torque.extend_from_slice(piece.require(Signal::T)?);
            pending.theta1.extend_from_slice(piece.require(Signal::Theta1)?);
            pending.theta2.extend(table_angle(&piece, self.rho)?.iter().map(|v| v + self.zero_offset));
            if self.speeds {
                pending.omega1.extend_from_slice(piece.require(Signal::Omega1)?);
                pending.omega2.extend_from_slice(piece.require(Signal::Omega2)?);
            }
            let there = pending.torque.len().saturating_sub(self.span());
            let last = pending.rows + there == total;
            let count = if last { there } else { there / BLOCK * BLOCK };
            if count > 0 {
                take(&self.record(&pending), count, pending.rows);
                let p = &mut pending;
                for values in [&mut p.torque, &mut p.theta1, &mut p.theta2, &mut p.omega1, &mut p.omega2] {
                    values.drain(..count.min(values.len()));
                }
                p.rows += count;
            }
            Ok(())
        })
    }

    /// The pending samples as a record; its times are counted from the start of the whole one.
    fn record<'a>(&self, pending: &'a Pending) -> RegressionRecord<'a> {
        let frame = self.stream.frame();
        RegressionRecord {
            torque: &pending.torque,
            theta1: &pending.theta1,
            theta2: Cow::Borrowed(&pending.theta2),
            omega: self.speeds.then_some((&pending.omega1[..], &pending.omega2[..])),
            dt: frame.dt,
            start: frame.start,
            hold: frame.hold,
            zero_offset: self.zero_offset,
            pieces: Cow::Borrowed(&[]),
        }
    }
}

/// Angle of the table in a piece, rad: theta2, or x2 over `rho` (m/rad).
///
/// # Errors
/// When neither is measured.
fn table_angle(piece: &Trace, rho: f64) -> Result<Cow<'_, [f64]>, TraceError> {
    match (piece.get(Signal::Theta2), piece.get(Signal::X2)) {
        (Some(theta2), _) => Ok(Cow::Borrowed(theta2)),
        (None, Some(x2)) if rho != 0.0 => Ok(Cow::Owned(x2.iter().map(|x| x / rho).collect())),
        _ => Ok(Cow::Borrowed(piece.require(Signal::Theta2)?)),
    }
}

/// Compares the travel of an angle over eight samples with the integral of the speed, in running sums: see `run::speed_error`.
#[derive(Default)]
struct SpeedError {
    angle: Vec<f64>,
    speed: Vec<f64>,
    travel: f64,
    difference: f64,
}

impl SpeedError {
    const SPAN: usize = 8;

    fn take(&mut self, angle: &[f64], speed: &[f64], dt: f64) {
        self.angle.extend_from_slice(angle);
        self.speed.extend_from_slice(speed);
        let mut k = 0;
        while k + Self::SPAN < self.angle.len() {
            let (x, v) = (&self.angle[k..], &self.speed[k..]);
            let travel = x[Self::SPAN] - x[0];
            let integral = dt * (v[..Self::SPAN].iter().sum::<f64>() + 0.5 * (v[Self::SPAN] - v[0]));
            self.difference += (travel - integral).powi(2);
            self.travel += travel * travel;
            k += Self::SPAN;
        }
        self.angle.drain(..k);
        self.speed.drain(..k);
    }

    fn relative(&self) -> f64 {
        if self.travel > 0.0 { (self.difference / self.travel).sqrt() } else { 0.0 }
    }
}

/// Identifies a two-inertia axis from a record that is read piece by piece, by LS and RLS. `file` names it in the result.
///
/// # Errors
/// When the record lacks a signal or cannot be read. A method that cannot give an estimate is no error: its result says why.
pub fn identify(
    stream: &Stream,
    machine: &Machine,
    request: &Request,
    file: &str,
    progress: &mut dyn FnMut(&str),
) -> Result<Identification, TraceError> {
    let motion = machine.signals.motion;
    let mut warnings = stream.warnings.clone();
    let wanted = METHODS.into_iter().filter(|m| request.methods.contains(m)).collect::<Vec<_>>();
    let mut steps = Steps::new(2 + wanted.iter().filter(|m| **m != Method::Ls).count(), progress);
    steps.next("zeros and speeds");
    let (frame, notes) = first_pass(stream, machine)?;
    warnings.extend(notes);
    let n = frame.rows();

    steps.next(Method::Ls.title());
    let mut squares = LeastSquares::new(n);
    let mut sums = Sums::default();
    let mut torque = Thinned::new(stream.len());
    let mut plotted = 0;
    frame.each(|record, count, first| {
        squares.extend(record, count);
        (0..count).for_each(|k| sums.take(&record.row(k)));
        let samples = if first + count == n { record.len() } else { count };
        record.torque[plotted - first..samples].iter().for_each(|v| torque.take(*v));
        plotted = first + samples;
    })?;

    let mut methods = Vec::new();
    for method in wanted {
        let found = if method == Method::Ls {
            squares.rows().map(|rows| (rows.reconcile(), None))
        } else {
            steps.next(method.title());
            recursive(&frame, &sums, squares.moments(), request)?.map(|(e, h)| (e, Some(h)))
        };
        methods.push(assessed(method, found, machine, request, &frame));
    }
    let best = methods.iter().position(|m| !m.modal.is_empty());
    let explained = Some(squares.explained());
    let evidence = Evidence { explained, ..Evidence::default() };
    let identifiability = Identifiability::of(&methods, best.map(|k| &methods[k]), evidence);
    let unit = Signal::T.unit(motion);
    let at = stream.frame();
    Ok(Identification {
        schema: SCHEMA,
        machine: machine.name.clone(),
        structure: "two_inertia",
        trace: TraceSummary {
            file: file.to_owned(),
            samples: stream.len(),
            dt: at.dt,
            start: at.start,
            duration: stream.len() as f64 * at.dt,
            hold: hold_name(at.hold),
            signals: stream.signals().collect(),
            period: None,
            pieces: 1,
        },
        methods,
        recommended: best.map(|method| Recommendation {
            method,
            why: "it takes every sample of a streamed record; no simulation is compared with it: check it by output error \
                  (--method oe) on a part cut out with --from and --to, without --stream"
                .to_owned(),
        }),
        identifiability,
        torque: Series {
            name: "T".to_owned(),
            x_unit: "s",
            y_unit: unit,
            x: torque.kept.iter().map(|(k, _)| at.time(*k)).collect(),
            y: torque.kept.iter().map(|(_, v)| *v).collect(),
        },
        torque_spectrum: Series { name: "T".to_owned(), x_unit: "Hz", y_unit: unit, x: Vec::new(), y: Vec::new() },
        frequency_response: None,
        warnings,
    })
}

/// Makes the first pass; gives its warnings, too.
///
/// # Errors
/// When a signal is missing or the record cannot be read.
fn first_pass<'a>(stream: &'a Stream, machine: &Machine) -> Result<(Frame<'a>, Vec<String>), TraceError> {
    let rho = machine.parameters.rho;
    let dt = stream.frame().dt;
    let (mut sum, mut squares, mut origin) = (0.0, 0.0, None);
    let mut speeds = [SpeedError::default(), SpeedError::default()];
    let both = [(Signal::Theta1, Signal::Omega1), (Signal::Theta2, Signal::Omega2)];
    stream.each(|_, piece| {
        let theta1 = piece.require(Signal::Theta1)?;
        piece.require(Signal::T)?;
        for (a, b) in theta1.iter().zip(table_angle(&piece, rho)?.iter()) {
            let twist = a - b;
            let origin = *origin.get_or_insert(twist);
            sum += twist;
            // About the first twist: no cancellation where the encoders' zeros are far apart.
            squares += (twist - origin).powi(2);
        }
        for (error, (angle, speed)) in speeds.iter_mut().zip(both) {
            if let (Some(angle), Some(speed)) = (piece.get(angle), piece.get(speed)) {
                error.take(angle, speed, dt);
            }
        }
        Ok(())
    })?;
    let mut warnings = Vec::new();
    let mut usable = true;
    for (error, (angle, speed)) in speeds.iter().zip(both) {
        if error.relative() > DIFFERENT_SPEED {
            usable = false;
            warnings.push(different_speed(speed, angle, error.relative()));
        }
        usable &= stream.signals().any(|s| s == speed);
    }
    let n = stream.len() as f64;
    let mean = sum / n;
    let deviation = (squares / n - (mean - origin.unwrap_or(0.0)).powi(2)).max(0.0).sqrt();
    let zero_offset = if mean.abs() > DIFFERENT_ZEROS * deviation && deviation > 0.0 { mean } else { 0.0 };
    if zero_offset != 0.0 {
        let unit = Signal::Theta2.unit(machine.signals.motion);
        warnings.push(format!(
            "the zeros of the two encoders differ by {zero_offset:.6} {unit}: the mean twist was taken off"
        ));
    }
    if !usable {
        warnings.push(
            "speeds are not measured on both sides: the regressions work on differences of positions and are easily biased \
             by noise; check them by output error (--method oe) on a part cut out with --from and --to"
                .to_owned(),
        );
    }
    Ok((Frame { stream, rho, zero_offset, speeds: usable }, warnings))
}

type Found = Result<(Estimated, History), RegressionError>;

fn recursive(frame: &Frame, sums: &Sums, moments: &Moments, request: &Request) -> Result<Found, TraceError> {
    let scales = match RegressorScales::of(sums) {
        Ok(scales) => scales,
        Err(error) => return Ok(Err(error)),
    };
    let mut recursion = Recursion::new(scales, frame.rows(), request.forgetting, request.p0);
    frame.each(|record, count, first| {
        for k in 0..count {
            recursion.take(&record.row(k), first + k, record.time(first + k));
        }
    })?;
    Ok(recursion.finish(moments))
}

fn assessed(
    method: Method,
    found: Result<(Estimated, Option<History>), RegressionError>,
    machine: &Machine,
    request: &Request,
    frame: &Frame,
) -> MethodResult {
    let equations = frame.record(&Pending::default()).equations();
    let how = match method {
        Method::Ls => "QR".to_owned(),
        _ => format!("forgetting factor {}, P(0) = {:e}", request.forgetting, request.p0),
    };
    let mut result = MethodResult::empty(method.name(), method.title());
    result.formulation = format!("F5, {equations}; {how}; streamed");
    match found {
        Err(why) => result.failure = Some(why.to_string()),
        Ok((estimated, history)) => {
            result.history = history;
            let reference = request.reference.then_some(&machine.parameters);
            result.assess(&estimated, reference, machine.signals.motion, frame.stream.frame().dt);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::super::run::identify as in_memory;
    use super::*;
    use crate::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate};
    use crate::effects::Settings;
    use crate::identify::excitation::{Kind, Multisine};
    use crate::trace::{AxisKind, Mapping, load, write_csv};

    /// A record of more than one piece of 8 MiB, noisy angles, encoders with zeros of their own.
    fn record(path: &std::path::Path, speeds: bool) {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let torque = Multisine::new(Kind::RandomPhase, 150_000, 1, 7000, 0.03, 0.0, 5).unwrap().period();
        let options = SimulateOptions { start: 0.0, dt: 5e-4, hold: Hold::Zoh, scheme: Scheme::NEWMARK, substeps: 1 };
        let effects = Settings::default();
        let run = simulate(&Parameters::PAPER, Structure::TwoInertia, &effects, [0.0; 4], &torque, &options);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(9);
        let mut noisy = |offset: f64, size: f64, values: Vec<f64>| -> Vec<f64> {
            values
                .into_iter()
                .map(|v| {
                    let e: f64 = StandardNormal.sample(&mut rng);
                    v + offset + size * e
                })
                .collect()
        };
        let r = &run.readings;
        let mut trace = Trace::new(0.0, 5e-4, Hold::Zoh)
            .with(Signal::T, torque)
            .and_then(|t| t.with(Signal::Theta1, noisy(0.0, 1e-9, r.iter().map(|r| r.theta1).collect())))
            .and_then(|t| t.with(Signal::Theta2, noisy(900.0, 1e-9, r.iter().map(|r| r.theta2).collect())))
            .unwrap();
        if speeds {
            trace.set(Signal::Omega1, noisy(0.0, 1e-4, r.iter().map(|r| r.omega1).collect())).unwrap();
            trace.set(Signal::Omega2, noisy(0.0, 1e-4, r.iter().map(|r| r.omega2).collect())).unwrap();
        }
        write_csv(path, &trace, AxisKind::Rotary).unwrap();
    }

    #[test]
    fn a_streamed_record_gives_the_estimates_of_the_one_in_memory() {
        let folder = tempfile::tempdir().unwrap();
        for speeds in [true, false] {
            let path = folder.path().join("record.csv");
            record(&path, speeds);
            assert!(std::fs::metadata(&path).unwrap().len() > 9 << 20);
            let machine = Machine::default();
            let request = Request { methods: METHODS.to_vec(), ..Request::default() };
            let whole = load(&path, &Mapping::default()).unwrap().trace;
            let expected = in_memory(&whole, &machine, &request, "record.csv", &mut |_| ()).unwrap();
            let stream = Stream::open(&path, &Mapping::default()).unwrap();
            let found = identify(&stream, &machine, &request, "record.csv", &mut |_| ()).unwrap();
            assert_eq!(found.methods.len(), 2);
            for (a, b) in found.methods.iter().zip(&expected.methods) {
                assert_eq!((a.method, &a.failure), (b.method, &b.failure));
                assert_eq!(a.parameters, b.parameters, "{}", a.method);
                assert_eq!(a.modal, b.modal, "{}", a.method);
                let finite = |h: &Option<History>| {
                    h.clone()
                        .map(|h| h.parameters.into_iter().flat_map(|(_, v)| v).map(f64::to_bits).collect::<Vec<_>>())
                };
                assert_eq!(finite(&a.history), finite(&b.history), "{}", a.method);
                assert_eq!(a.history.as_ref().map(|h| &h.time), b.history.as_ref().map(|h| &h.time));
            }
            assert_eq!(found.torque, expected.torque);
        }
    }
}
