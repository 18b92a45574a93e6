//! Newton's method for the effects' torques at the end of a segment, `tau = law(motion(tau))`. It iterates on plain numbers; the
//! derivatives then follow from one more evaluation at the solution (implicit function theorem).

use crate::effects::Memory;
use crate::scalar::Scalar;

/// Most Newton iterations of a step.
const NEWTON: usize = 30;
/// Newton ends when the torques repeat to this share of their size.
const NEWTON_TOLERANCE: f64 = 1e-13;

/// Newton's method from `torque`, N.m, with a tolerance relative to `input`, the torque on the motor: the torques that led to
/// the end, and those that the laws give there. `memory` is left as it is at that end.
#[inline]
pub(super) fn newton<const N: usize>(
    equations: &impl TorqueEquations<f64, N>,
    mut torque: [f64; N],
    input: f64,
    memory: &mut Memory<f64>,
) -> [[f64; N]; 2] {
    let largest = |a: &[f64; N]| a.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let mut internals = equations.internals();
    let mut previous = f64::INFINITY;
    for iteration in 1.. {
        let pass = equations.pass(torque, &mut internals);
        let size = largest(&std::array::from_fn(|i| torque[i] - pass.found[i]));
        let scale = largest(&pass.found) + input.abs();
        if size <= NEWTON_TOLERANCE * scale || iteration == NEWTON {
            equations.remember(&internals, torque, [0.0; N], memory);
            return [torque, pass.found];
        }
        // A residual that grows means a kink was crossed: half the step.
        let kink = size > previous * 2.0;
        previous = size;
        let less = if kink { pass.correction.map(|c| c * 0.5) } else { pass.correction };
        // Newton's method converges quadratically: the relative residual is squared.
        if size <= NEWTON_TOLERANCE.sqrt() * scale || (pass.left <= NEWTON_TOLERANCE * scale && !kink) {
            equations.remember(&internals, torque, less, memory);
            torque = std::array::from_fn(|i| torque[i] - less[i]);
            break;
        }
        torque = std::array::from_fn(|i| torque[i] - less[i]);
    }
    [torque, torque]
}

/// The derivatives of torques whose values are a solution already; `memory` becomes that of the end.
pub(super) fn derive<S: Scalar, const N: usize>(
    equations: &impl TorqueEquations<S, N>,
    torque: [S; N],
    memory: &mut Memory<S>,
) -> [S; N] {
    let mut internals = equations.internals();
    let pass = equations.pass(torque, &mut internals);
    equations.remember(&internals, torque, pass.correction, memory);
    std::array::from_fn(|i| torque[i] - pass.correction[i])
}

/// An equation of `N` torques at the end of a segment.
pub(super) trait TorqueEquations<S, const N: usize> {
    /// Internal states of its laws over the segment.
    type Internals;

    /// The internal states as committed.
    fn internals(&self) -> Self::Internals;

    /// The torques of the laws for the motion under `torque`; it sets the end of the internal states.
    fn pass(&self, torque: [S; N], internals: &mut Self::Internals) -> Pass<S, N>;

    /// Leaves in `memory` the internal states for `less` than the `torque` of the last pass, by their tangents there.
    fn remember(&self, internals: &Self::Internals, torque: [S; N], less: [S; N], memory: &mut Memory<S>);
}

pub(super) struct Pass<S, const N: usize> {
    /// Torques of the laws.
    pub found: [S; N],
    /// The Newton correction: subtracted from the torques, it makes them agree with the laws to first order.
    pub correction: [S; N],
    /// Bound of the residual after the correction.
    pub left: f64,
}
