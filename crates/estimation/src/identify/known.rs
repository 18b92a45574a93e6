//! Effects that the axis file already knows: their torque along the measured motion, taken off the record's torque before a
//! regression that has no term for them.
//!
//! ```text
//! T - f(theta, omega, t) = I1*a1 + B*(omega1 - omega2) + K*(theta1 - theta2)
//! ```
//!
//! Only the motor's equation has a torque to take them off from, so that of two inertias the effects on the motor are taken;
//! a rigid axis has one equation and all of them. Laws with a memory of their own, those of the coupling, of the drive and of
//! the encoders give no torque along a measured motion.

use super::joined::Joined;
use crate::axis::Structure;
use crate::effects::{Base, EFFECTS, Effect, Kinematics, Law, Moment, Place, WithLaw};
use crate::trace::{Machine, Signal, TraceError};

/// Samples to either side over which a speed that is not measured is a difference of the angle.
const HALF_WIDTH: usize = 4;

/// The known effects of a machine, and how a regression uses them.
pub(super) struct Known {
    /// Taken off the torque.
    pub taken: Vec<Effect>,
    /// Left out of the regressions.
    pub left: Vec<Effect>,
}

fn names(effects: &[Effect]) -> String {
    effects.iter().map(|e| e.info().id).collect::<Vec<_>>().join(", ")
}

impl Known {
    pub fn of(machine: &Machine) -> Self {
        let rigid = machine.structure == Structure::Rigid;
        let on = EFFECTS.iter().copied().filter(|e| machine.effects.is_on(*e));
        // The textbook's friction is what a rigid axis' regression estimates itself.
        let on = on.filter(|e| !(rigid && e.info().textbook));
        let (taken, left) = on.partition(|e| {
            let info = e.info();
            let place = info.place == Place::Motor || (rigid && info.place == Place::Table);
            // A friction that depends on the transmitted torque depends on the parameters to be identified.
            let loaded = e.load_parameter().is_some_and(|i| machine.effects.of(*e)[i] != 0.0);
            (e.is_force() || e.is_dry()) && place && info.memory == 0 && !loaded
        });
        Self { taken, left }
    }

    /// Warnings on which effects are taken off and which are left out.
    pub fn warnings(&self, structure: Structure) -> Vec<String> {
        let mut warnings = Vec::new();
        let simulated = if structure == Structure::Rigid { "" } else { "; output error simulates it" };
        if !self.taken.is_empty() {
            warnings.push(format!(
                "the torque of {} in the axis file, along the measured motion, is taken off the record's torque before the \
                 regressions, so that it is not counted twice{simulated}",
                names(&self.taken)
            ));
        }
        if !self.left.is_empty() {
            let simulated =
                if structure == Structure::Rigid { "" } else { " are part of the output-error model alone;" };
            warnings.push(format!(
                "of the effects of the axis file, {}{simulated} the regressions leave them out: they have no torque along a \
                 measured motion that could be taken off",
                names(&self.left)
            ));
        }
        warnings
    }

    /// The record with the torque of the known effects subtracted; `None` where there is none to subtract.
    ///
    /// # Errors
    /// When the record has no torque or no motor angle.
    pub fn taken_off(&self, joined: &Joined, machine: &Machine) -> Result<Option<Joined<'static>>, TraceError> {
        if self.taken.is_empty() {
            return Ok(None);
        }
        let trace = joined.samples();
        let mut torque = trace.require(Signal::T)?.to_vec();
        let theta = trace.require(Signal::Theta1)?;
        let omega = trace.get(Signal::Omega1);
        let base =
            Base { k: machine.parameters.k, b: machine.parameters.b, rigid: machine.structure == Structure::Rigid };
        for piece in joined.pieces() {
            for k in piece.clone() {
                let v = omega.map_or_else(
                    || {
                        let (a, b) =
                            (k.saturating_sub(HALF_WIDTH).max(piece.start), (k + HALF_WIDTH).min(piece.end - 1));
                        (theta[b] - theta[a]) / ((b - a).max(1) as f64 * trace.dt)
                    },
                    |w| w[k],
                );
                let motion = Kinematics { x: theta[k], v };
                let slides = if v == 0.0 { 0.0 } else { v.signum() };
                let time = joined.time(k);
                let moment = Moment { start: motion, end: motion, time, h: 0.0, contact: 0, slides, load: 0.0 };
                for effect in &self.taken {
                    if effect.is_dry() && slides == 0.0 {
                        continue;
                    }
                    torque[k] -=
                        effect.with_law(Along { p: machine.effects.of(*effect), base: &base, moment: &moment });
                }
            }
        }
        joined.with_torque(torque).map(Some)
    }
}

/// The torque of a law along a measured motion, which it resists.
struct Along<'a> {
    p: &'a [f64],
    base: &'a Base<f64>,
    moment: &'a Moment<f64>,
}

impl WithLaw for Along<'_> {
    type Output = f64;

    fn with<L: Law>(self) -> f64 {
        L::react(self.p, self.base, self.moment, &mut []).torque
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Hold, Parameters};
    use crate::effects::Settings;
    use crate::identify::run::{Request, identify};
    use crate::trace::Trace;

    /// A hinged weight on a rigid axis, in closed form: `T = I*a + m*g*l*sin(theta + phase)`.
    fn hinge() -> (Trace, Machine) {
        let (inertia, weight) = (0.02, 0.8);
        let dt = 1e-3;
        let (mut torque, mut theta) = (Vec::new(), Vec::new());
        for k in 0..8000 {
            let t = k as f64 * dt;
            let (mut x, mut a) = (0.0, 0.0);
            for (size, w) in [(0.9, 1.7), (0.3, 5.1), (0.1, 13.0)] {
                x += size * f64::sin(w * t);
                a -= size * w * w * f64::sin(w * t);
            }
            theta.push(x);
            torque.push(inertia * a + weight * x.sin());
        }
        let trace = Trace::new(0.0, dt, Hold::Linear)
            .with(Signal::T, torque)
            .and_then(|t| t.with(Signal::Theta1, theta))
            .unwrap();
        let mut effects = Settings::default();
        let gravity = Effect::from_id("gravity").unwrap();
        // Its first parameter is the torque with the sine of the angle.
        effects.of_mut(gravity)[0] = weight;
        let parameters = Parameters { i1: 0.02, i2: 0.0, ..Parameters::PAPER };
        (trace, Machine { structure: Structure::Rigid, effects, parameters, ..Machine::default() })
    }

    #[test]
    fn a_known_weight_on_a_hinge_is_not_taken_for_inertia() {
        let (trace, machine) = hinge();
        let inertia = |machine: &Machine| {
            let found = identify(&trace, machine, &Request::default(), "", &mut |_| ()).unwrap();
            let value = found.methods[0].parameters.iter().find(|e| e.name == "I").map(|e| e.value);
            (value, found.warnings.join(" "))
        };
        let (known, warnings) = inertia(&machine);
        assert!((known.unwrap() / 0.02 - 1.0).abs() < 0.01, "{known:?}");
        assert!(warnings.contains("gravity") && warnings.contains("taken off"), "{warnings}");
        let (unknown, warnings) = inertia(&Machine { effects: Settings::default(), ..machine });
        assert!(unknown.is_none_or(|i| (i / 0.02 - 1.0).abs() > 0.2), "{unknown:?}");
        assert!(warnings.is_empty(), "{warnings}");
    }
}
