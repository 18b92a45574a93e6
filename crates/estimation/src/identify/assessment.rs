//! Assesses a method's estimates: a simulation compared with the record, and the torque computed from the measured motion.

use super::methods::Run;
use super::output_error::{Free, OutputError};
use super::parameters::Estimated;
use super::result::{ExcitationEstimate, MethodResult, OutputFit, Series};
use super::run::{Method, NOISE_FREE, torque_unit};
use super::statistics::{spectrum, whiteness};
use crate::axis::{Parameters, Scheme, Structure};
use crate::numerics::level::{deviation, rms};
use crate::trace::{AxisKind, Signal};

/// Least samples of a record of which a part is held out.
const LEAST_PARTED: usize = 192;
/// Residual of one simulation over another's up to which both follow an output alike: what a model leaves out moves it by as much from one
/// weighting of the outputs to the next.
const ABOUT_AS_WELL: f64 = 2.0;

impl Run<'_> {
    /// The integration that fits the record: as output error found it, else as asked for.
    pub fn scheme(&self) -> Scheme {
        self.oe.as_ref().map(|f| f.scheme).or(self.request.scheme).unwrap_or(Scheme::Exact)
    }

    /// What a simulation beside this record is free in: the zeros of its positions and a bias of its torque where the estimates have them, and
    /// the parameters where asked.
    fn free(&self, parameters: bool) -> Free {
        Free {
            parameters,
            offset: self.record.zero_offset != 0.0,
            bias: self.oe.as_ref().is_some_and(|f| f.bias != 0.0),
        }
    }

    /// Adds fit, whiteness and excitation estimate to a result, unless its estimates were refused.
    pub fn assess(&self, result: &mut MethodResult, scheme: Scheme) {
        let found = self.estimates.iter().find(|(name, _)| *name == result.method && result.failure.is_none());
        let Some((_, estimated)) = found else { return };
        result.excitation = Some(self.excitation(estimated));
        let p = estimated.parameters(self.machine.parameters.rho);
        if p.check(Structure::TwoInertia).is_err() || p.k == 0.0 {
            return;
        }
        let free = self.free(false);
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
            let time = |k: usize| self.compared.time(k);
            result.outputs.push(output_fit(signal, measured, &residual, time, self.machine.signals.motion));
        }
    }

    /// How well a fit to the first two thirds of the record, started from `p`, follows the last third in free run: the worst
    /// output, per cent; None for a record too short to be parted.
    pub fn held_out(&self, p: &Parameters, scheme: Scheme) -> Option<f64> {
        let n = self.compared.len();
        if n < LEAST_PARTED || p.check(Structure::TwoInertia).is_err() || p.k == 0.0 {
            return None;
        }
        let (rho, structure, effects) = (self.machine.parameters.rho, self.machine.structure, self.machine.effects);
        let free = self.free(true);
        let (first, rest) = (self.compared.part(0..2 * n / 3), self.compared.part(2 * n / 3..n));
        let fitted = OutputError::of(&first, rho, structure, effects).ok()?.fit(p, scheme, free);
        let p = fitted.estimated.parameters(rho);
        if p.check(Structure::TwoInertia).is_err() {
            return Some(f64::NEG_INFINITY);
        }
        let model = OutputError::of(&rest, rho, structure, effects).ok()?;
        let residuals = model.residuals(&model.fit(&p, scheme, Free { parameters: false, ..free }));
        // Relative to the output over the whole record: in a part where it hardly moves, its own size means nothing.
        let fits = self.outputs.outputs().zip(residuals).map(|((_, measured), (_, r))| {
            let size = deviation(measured);
            if rms(&r) <= NOISE_FREE * size { 100.0 } else { 100.0 * (1.0 - rms(&r) / size) }
        });
        fits.reduce(f64::min)
    }

    /// Share of what an axis that coasts leaves of an output that the torque explains by the method's parameters `p`, per cent, of the output
    /// where that is largest: below a half the record is followed by its initial state, whatever the inertias.
    pub fn driven(&self, assessed: &MethodResult, p: &Parameters, scheme: Scheme) -> Option<f64> {
        if p.check(Structure::TwoInertia).is_err() || p.k == 0.0 {
            return None;
        }
        let still = vec![0.0; self.compared.len()];
        let coasting = self.outputs.driven_by(&still);
        let left = coasting.residuals(&coasting.fit(p, scheme, self.free(false)));
        let explained = assessed
            .outputs
            .iter()
            .zip(&left)
            .map(|(output, (_, without))| 100.0 * (1.0 - output.rms_error / rms(without).max(f64::MIN_POSITIVE)));
        explained.reduce(f64::max)
    }

    /// Whether output error ended at a natural frequency beyond half the sampling rate, and its simulation follows every output about as well
    /// as that with a method's parameters `p`: the record then shows neither.
    pub fn unseen_follows(&self, p: &Parameters, scheme: Scheme) -> bool {
        let Some(unseen) = self.oe.as_ref().filter(|fit| fit.estimated.is_unseen(self.joined.samples().dt)) else {
            return false;
        };
        if p.check(Structure::TwoInertia).is_err() || p.k == 0.0 {
            return false;
        }
        let shown = self.outputs.fit(p, scheme, self.free(false));
        unseen.sigma.iter().zip(&shown.sigma).all(|(unseen, shown)| *unseen <= ABOUT_AS_WELL * shown)
    }

    /// The torque from the motion (Inverse Problem 2): `I1*a1 + I2*a2` with measured accelerations, else row 1 of (2)
    /// between samples.
    fn excitation(&self, estimated: &Estimated) -> ExcitationEstimate {
        let v = &estimated.values;
        let trace = self.joined.samples();
        let accelerations = trace.get(Signal::Alpha1).zip(trace.get(Signal::Alpha2));
        let of_samples = accelerations.is_some();
        let (formulation, estimate, truth): (_, Vec<f64>, Vec<f64>) = match accelerations {
            Some((a1, a2)) => (
                "I1*alpha1 + I2*alpha2",
                a1.iter().zip(a2).map(|(a1, a2)| v[0] * a1 + v[1] * a2).collect(),
                trace.get(Signal::T).map_or_else(Vec::new, <[f64]>::to_vec),
            ),
            None => {
                let rows: Vec<_> = (0..self.record.rows()).map(|k| self.record.row(k)).collect();
                (
                    "I1*a1 + B*(w1 - w2) + K*(th1 - th2) between samples",
                    rows.iter().map(|r| v[0] * r.a1 + v[2] * r.rate + v[3] * r.twist).collect(),
                    rows.iter().map(|r| r.torque).collect(),
                )
            }
        };
        let time = |k: usize| if of_samples { self.joined.time(k) } else { self.record.time(k) };
        let error: Vec<f64> = estimate.iter().zip(&truth).map(|(a, b)| a - b).collect();
        let unit = torque_unit(self.machine.signals.motion);
        // A spectrum over a gap would show the gap.
        let longest = if of_samples { self.joined.longest() } else { self.record.longest_rows() };
        ExcitationEstimate {
            formulation,
            error_percent: 100.0 * rms(&error) / rms(&truth).max(f64::MIN_POSITIVE),
            estimate: Series::over("estimated T", unit, time, &estimate),
            error: Series::over("error of T", unit, time, &error),
            spectrum: spectrum("estimated T", unit, trace.dt, &estimate[longest]),
        }
    }
}

/// Fit and whiteness of one output.
pub(super) fn output_fit(
    signal: Signal,
    measured: &[f64],
    residual: &[f64],
    time: impl Fn(usize) -> f64,
    motion: AxisKind,
) -> OutputFit {
    let size = deviation(measured);
    let error = rms(residual);
    OutputFit {
        signal,
        rms: size,
        rms_error: error,
        fit_percent: 100.0 * (1.0 - error / size.max(f64::MIN_POSITIVE)),
        whiteness: whiteness(residual),
        residual: Series::over(format!("{signal}: measured - simulated"), signal.unit(motion), time, residual),
    }
}
