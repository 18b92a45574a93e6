//! Whether a record identifies the axis, by these conditions.
//!
//! The parameters are those of an axis that can exist; each is known within 30 % at two standard errors, or what it stands
//! for is known to be of no account; a simulation with them follows the record; and one that never saw the last third of
//! the record follows that too.

use serde::Serialize;

use super::levenberg::Termination;
use super::result::{Estimate, MethodResult, UNSEEN};
use super::run::Method;

/// Two standard errors of a determined parameter are at most this share of it.
pub const DETERMINED: f64 = 0.3;
/// Two standard errors of the damping ratio below which a damping is known to be small, whatever its share of itself.
const SMALL_DAMPING: f64 = 0.02;
/// A friction or load whose two standard errors make less than this share of the torque is known well enough.
pub(super) const SMALL_TORQUE: f64 = 0.05;
/// A simulation that follows an output worse than this, per cent, does not follow it.
pub const LEAST_FIT: f64 = 50.0;

/// Whether a record identifies the axis, and why not.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Identifiability {
    /// Whether the record identifies the axis.
    pub identified: bool,
    /// What speaks against it, each a sentence.
    pub doubts: Vec<String>,
    /// Parameters that this record does not determine.
    pub undetermined: Vec<&'static str>,
    /// What experiment would determine it, a sentence; empty where nothing is undetermined.
    pub advice: String,
    /// How well a fit to the first two thirds of the record follows the last third: the worst output, per cent.
    pub held_out_percent: Option<f64>,
}

/// What is known in addition to the method's own result.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Evidence {
    /// Fit on the held-out part, per cent.
    pub held_out: Option<f64>,
    /// Share of an output that the torque explains beyond the initial state, per cent, where that is largest.
    pub driven: Option<f64>,
    /// Whether a simulation with a natural frequency beyond half the sampling rate follows every output about as well.
    pub unseen_follows: bool,
    /// Share of the accelerations that the equations of motion explain, motor and table, where no simulation was compared.
    pub explained: Option<[f64; 2]>,
    /// Torques that go with viscous friction, dry friction and load at one unit of each, as shares of the torque's size.
    pub shares: Option<[f64; 3]>,
}

/// What speaks against a record whose estimates have a natural frequency that no sample shows, and what to do.
const BEYOND: [&str; 2] = [
    "Its natural frequency lies beyond half the sampling rate: no sample shows it.",
    "Sample faster, or identify a rigid axis (structure = \"rigid\" in the axis file); look at the torque of the record (`eixo inspect`).",
];

/// Whether a method's estimates were refused for that.
fn is_unseen(m: &MethodResult) -> bool {
    m.failure.as_deref() == Some(UNSEEN)
}

/// Whether a figure is below a bound; one that is no number is.
fn is_below(figure: f64, bound: f64) -> bool {
    figure.is_nan() || figure < bound
}

impl Identifiability {
    /// The record identifies the axis.
    #[must_use]
    pub fn yes() -> Self {
        Self { identified: true, ..Self::default() }
    }

    /// Assesses the recommended method, `best`, among all `methods`.
    pub(super) fn of(methods: &[MethodResult], best: Option<&MethodResult>, evidence: Evidence) -> Self {
        let mut doubts = Vec::new();
        let Some(best) = best.filter(|m| m.failure.is_none() && !m.parameters.is_empty()) else {
            let [doubt, advice] = if methods.iter().any(is_unseen) {
                BEYOND
            } else {
                [
                    "No method gives parameters of an axis that can exist.",
                    "Look at the record (`eixo inspect`); excite the axis around and above its natural frequency, with both \
                     sides moving.",
                ]
            };
            return Self { doubts: vec![doubt.to_owned()], advice: advice.to_owned(), ..Self::default() };
        };
        let zeta = best.modal.iter().find(|e| e.name == "zeta");
        // No axis has a damping clearly below zero.
        let grows = zeta.is_some_and(|z| z.value < -SMALL_DAMPING);
        let zeta = zeta.and_then(|e| e.std);
        let account = |e: &Estimate| -> bool {
            let Some(std) = e.std else { return true };
            let share = |i: usize| evidence.shares.is_some_and(|s| 2.0 * std * s[i] <= SMALL_TORQUE);
            if e.name == "B" && grows {
                return false;
            }
            2.0 * std <= DETERMINED * e.value.abs()
                || match e.name {
                    "B" => zeta.is_some_and(|z| 2.0 * z <= SMALL_DAMPING),
                    "viscous_motor.coefficient" => share(0),
                    "coulomb_motor.level" => share(1),
                    "load_motor.torque" => share(2),
                    _ => false,
                }
        };
        let undetermined: Vec<&'static str> = best.parameters.iter().filter(|e| !account(e)).map(|e| e.name).collect();
        let mut advice = String::new();
        if !undetermined.is_empty() {
            doubts.push(format!(
                "This record does not determine {} to {:.0} %.",
                undetermined.join(", "),
                100.0 * DETERMINED
            ));
            "Excite the axis more around its natural frequency and record longer: what stands still or moves slowly tells of \
             no inertia and no stiffness."
                .clone_into(&mut advice);
        }
        // The simulation that follows the record best is one that no sample shows: another that follows it too is not more than that.
        // One that runs away has no end: whether it was given up on the way is up to rounding.
        let stands = |m: &MethodResult| evidence.unseen_follows || m.termination.is_some_and(Termination::is_converged);
        if methods.iter().any(|m| m.method == Method::Oe.name() && is_unseen(m) && stands(m)) {
            doubts.push(BEYOND[0].to_owned());
            BEYOND[1].clone_into(&mut advice);
        }
        if let Some(worst) = best.outputs.iter().min_by(|a, b| a.fit_percent.total_cmp(&b.fit_percent))
            && is_below(worst.fit_percent, LEAST_FIT)
        {
            doubts.push(format!("Its simulation does not follow {}.", worst.signal.name()));
            "Diagnose the record for what the model leaves out (`eixo diagnose`).".clone_into(&mut advice);
        } else if evidence.driven.is_some_and(|d| is_below(d, LEAST_FIT)) {
            doubts.push("Its simulation follows the record as well without the torque: an inertia shows in what a torque does to it.".to_owned());
            "Look at the torque of the record (`eixo inspect`): its sign, its unit, whether it is clipped or of another axis."
                .clone_into(&mut advice);
        } else if let Some(held) = evidence.held_out.filter(|h| is_below(*h, LEAST_FIT)) {
            doubts.push(if held.is_finite() && held > 0.0 {
                format!("A fit to the first two thirds of the record follows the last third to {held:.0} % only.")
            } else {
                "A fit to the first two thirds of the record does not follow the last third.".to_owned()
            });
            "Diagnose the record for what the model leaves out (`eixo diagnose`); a drift or a change of load shows so, too."
                .clone_into(&mut advice);
        }
        if let Some(shares) = evidence.explained {
            for (share, side) in shares.into_iter().zip(["motor", "table"]) {
                if is_below(share, 0.01 * LEAST_FIT) {
                    doubts.push(format!(
                        "The equations of motion explain {:.0} % of the {side}'s acceleration.",
                        100.0 * share.max(0.0)
                    ));
                    "Fit a part of the record by its simulation, which noise on positions hurts less (--method oe with --from \
                     and --to, without --stream)."
                        .clone_into(&mut advice);
                }
            }
        }
        Self {
            identified: doubts.is_empty(),
            doubts,
            undetermined,
            advice,
            held_out_percent: evidence.held_out.filter(|v| v.is_finite()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_that_run_beyond_half_the_sampling_rate_and_follow_the_record_are_a_doubt_wherever_they_were_given_up()
    {
        let mut least_squares = MethodResult::empty("ls", "Least squares");
        least_squares.parameters.push(Estimate::new("K", "N.m/rad", 2.0, Some(0.1), None));
        let judged = |termination: Termination, unseen_follows: bool| {
            let mut output_error = MethodResult::empty(Method::Oe.name(), "Output error");
            (output_error.failure, output_error.termination) = (Some(UNSEEN.to_owned()), Some(termination));
            let methods = [least_squares.clone(), output_error];
            Identifiability::of(&methods, methods.first(), Evidence { unseen_follows, ..Evidence::default() })
        };
        for termination in [Termination::Iterations, Termination::NoProgress, Termination::Cost] {
            let judged = judged(termination, true);
            assert!(!judged.identified && judged.doubts == [BEYOND[0]], "{termination:?}: {judged:?}");
        }
        // One that was given up and follows the record less says nothing of it.
        assert!(judged(Termination::Iterations, false).identified);
    }
}
