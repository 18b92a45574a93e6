//! One step of the axis with its effects.
//!
//! Between events the axis is linear plus forces from the motion: the end of the step follows from the start by the
//! [`Propagator`](super::Propagator), the effects' torques at the end by Newton's method (their tangents and the
//! propagator's compliance make the Jacobian). Dry friction at rest is a torque constant over the step that holds the end
//! velocity at zero.
//!
//! Events (a velocity through zero under dry friction, a contact of backlash that opens or closes) are located in time
//! and the step is continued from there, so that reversals and impacts keep the order of the step (hybrid automaton;
//! Acary & Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, chapter 8, event-driven schemes).
//!
//! Torques and events are solved for in `f64`; one pass over [`Scalar`] numbers then carries the
//! derivatives through, jumps at events included.

use super::axis_model::{Axis, State};
use super::events::{Event, LOCATE_TOLERANCE, Stretch};
use super::segment::Segment;
use crate::effects::Ramp;
use crate::scalar::Scalar;

/// Most events handled inside one step; past that the step is taken as it stands.
const EVENTS: usize = 24;

impl<S: Scalar> Axis<S> {
    /// The state one step later, under the torque `ramp` on the motor; `time` is the start of the step, s.
    #[must_use]
    #[inline]
    pub fn advance(&self, s: &State<S>, ramp: Ramp<S>, time: f64) -> State<S> {
        if self.full.on.motion_is_linear() {
            let zero = S::default();
            let linear = self.full.whole.step.apply(&s.linear, [ramp.start, zero], [ramp.end, zero]);
            return State { linear, ..*s };
        }
        self.advance_with_effects(s, ramp, time)
    }

    fn advance_with_effects(&self, s: &State<S>, ramp: Ramp<S>, time: f64) -> State<S> {
        let h = self.full.whole.step.h();
        if !self.full.has_events() {
            let end = time + h.re();
            let solved =
                self.primal.solve(&s.primal(), &Segment { ramp: ramp.primal(), length: &self.primal.whole, end });
            return self.differentiate(s, ramp, None, end, &solved);
        }
        let mut now = *s;
        let mut done = S::default();
        for event in 0..=EVENTS {
            let length;
            let (ramp, length, left) = if event == 0 {
                (ramp, &self.primal.whole, None)
            } else {
                let left = h - done;
                length = self.primal.length(left.re());
                (Ramp { start: ramp.at(done / h), end: ramp.end }, &length, Some(left))
            };
            let begin = time + done.re();
            let segment = Segment { ramp: ramp.primal(), length, end: time + h.re() };
            let mut from = now.primal();
            let mut solved = self.primal.solve(&from, &segment);
            if self.primal.sticks(&from) != [false, false] {
                self.leave_rest(&mut now, &mut from, &mut solved, &segment, begin);
            }
            let next = self.primal.first_event(&from, &solved).filter(|_| event < EVENTS);
            let Some(next) = next else {
                return self.differentiate(&now, ramp, left, segment.end, &solved);
            };
            let at;
            (at, now) = self.locate(next, &now, &from, &solved, &Stretch { ramp, begin, h: left.unwrap_or(h) });
            done += at;
            self.full.enter(next, &mut now, time + done.re());
            if (h - done).re() <= LOCATE_TOLERANCE * h.re() {
                break;
            }
        }
        now
    }

    /// The solution found in `f64`, with derivatives if there are any; `h` is the length in s of a segment that is not the whole
    /// step.
    #[inline]
    fn differentiate(&self, s: &State<S>, ramp: Ramp<S>, h: Option<S>, end: f64, solved: &State<f64>) -> State<S> {
        if !S::HAS_DERIVATIVES {
            return State::lift(solved);
        }
        let length;
        let length = match h {
            None => &self.full.whole,
            Some(h) => {
                length = self.full.length(h);
                &length
            }
        };
        self.full.differentiate(s, &Segment { ramp, length, end }, solved)
    }

    /// Lets friction slip whose sticking torque exceeds its level, in the direction of the excess. It changes `from`, the same
    /// state with derivatives `now`, and `solved`, the end computed from it; `time` is the start of the segment, s.
    fn leave_rest(
        &self,
        now: &mut State<S>,
        from: &mut State<f64>,
        solved: &mut State<f64>,
        segment: &Segment<f64>,
        time: f64,
    ) {
        let primal = &self.primal;
        for _ in 0..3 {
            let sticks = primal.sticks(from);
            let mut worst = (0.0, 0, 0);
            // The torque of sticking friction is constant over the segment, so its level is that of the mean load.
            let load = 0.5 * (primal.load(from, time) + primal.load(solved, segment.end));
            for i in (0..2).filter(|i| sticks[*i]) {
                let hold = solved.friction[i];
                let level = primal.rest_level(i, hold.signum(), from, load, time);
                let excess = hold.abs() - level;
                if excess > 1e-12 * level.abs() && excess > worst.0 {
                    worst = (excess, i, hold.signum() as i8);
                }
            }
            if worst.2 == 0 {
                break;
            }
            from.modes.dry[worst.1] = worst.2;
            primal.refresh_force(from, time);
            *solved = primal.solve(from, segment);
        }
        if from.modes.dry != now.modes.dry {
            now.modes.dry = from.modes.dry;
            self.full.refresh_force(now, time);
        }
    }

    /// Time into what is left of the step, and the state, at which an event happens; `to` is the trial beyond it.
    fn locate(
        &self,
        event: Event,
        now: &State<S>,
        from: &State<f64>,
        to: &State<f64>,
        left: &Stretch<S>,
    ) -> (S, State<S>) {
        let stretch = left.primal();
        let Some((found, solved)) = self.primal.locate(event, from, to, &stretch) else {
            return (S::default(), *now);
        };
        let at = |t: S| self.differentiate(now, left.until(t), Some(t), left.begin + t.re(), &solved);
        let t = S::from(found);
        let state = at(t);
        if !S::HAS_DERIVATIVES {
            return (t, state);
        }
        let slope = self.primal.slope(event, found, from, &stretch);
        if slope == 0.0 {
            return (t, state);
        }
        // The derivatives of the time, by the implicit function theorem.
        let t = t - self.full.indicator(event, now, &state) / slope;
        (t, at(t))
    }
}
