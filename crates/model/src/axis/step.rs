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
//! All that is sought (torques, events) is sought on plain numbers; one pass over [`Scalar`] numbers then carries the
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
            let solved = self.plain.solve(&s.plain(), &Segment { ramp: ramp.plain(), length: &self.plain.whole, end });
            return self.differentiate(s, ramp, None, end, &solved);
        }
        let mut now = *s;
        let mut done = S::default();
        for event in 0..=EVENTS {
            let length;
            let (ramp, length, left) = if event == 0 {
                (ramp, &self.plain.whole, None)
            } else {
                let left = h - done;
                length = self.plain.length(left.re());
                (Ramp { start: ramp.at(done / h), end: ramp.end }, &length, Some(left))
            };
            let begin = time + done.re();
            let segment = Segment { ramp: ramp.plain(), length, end: time + h.re() };
            let mut from = now.plain();
            let mut solved = self.plain.solve(&from, &segment);
            if self.plain.sticks(&from) != [false, false] {
                self.leave_rest(&mut now, &mut from, &mut solved, &segment, begin);
            }
            let reached = self.plain.first_event(&from, &solved).filter(|_| event < EVENTS);
            let Some(reached) = reached else {
                return self.differentiate(&now, ramp, left, segment.end, &solved);
            };
            let at;
            (at, now) = self.locate(reached, &now, &from, &solved, &Stretch { ramp, begin, h: left.unwrap_or(h) });
            done += at;
            self.full.enter(reached, &mut now, time + done.re());
            if (h - done).re() <= LOCATE_TOLERANCE * h.re() {
                break;
            }
        }
        now
    }

    /// What was solved on plain numbers, with derivatives if there are any; `h` is the length of a segment that is not whole.
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

    /// Where dry friction sticks and cannot hold, lets it slip in the direction of the excess: `now`, which is `from` with
    /// derivatives, and what is `solved` from there.
    fn leave_rest(
        &self,
        now: &mut State<S>,
        from: &mut State<f64>,
        solved: &mut State<f64>,
        segment: &Segment<f64>,
        time: f64,
    ) {
        let plain = &self.plain;
        for _ in 0..3 {
            let sticks = plain.sticks(from);
            let mut worst = (0.0, 0, 0);
            // The friction that holds is one over the segment, so its level is that of the mean load.
            let load = 0.5 * (plain.load(from, time) + plain.load(solved, segment.end));
            for i in (0..2).filter(|i| sticks[*i]) {
                let hold = solved.friction[i];
                let level = plain.rest_level(i, hold.signum(), from, load, time);
                let excess = hold.abs() - level;
                if excess > 1e-12 * level.abs() && excess > worst.0 {
                    worst = (excess, i, hold.signum() as i8);
                }
            }
            if worst.2 == 0 {
                break;
            }
            from.modes.dry[worst.1] = worst.2;
            plain.refresh_force(from, time);
            *solved = plain.solve(from, segment);
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
        let plain = left.plain();
        let Some((found, solved)) = self.plain.locate(event, from, to, &plain) else {
            return (S::default(), *now);
        };
        let at = |t: S| self.differentiate(now, left.until(t), Some(t), left.begin + t.re(), &solved);
        let t = S::from(found);
        let state = at(t);
        if !S::HAS_DERIVATIVES {
            return (t, state);
        }
        let slope = self.plain.slope(event, found, from, &plain);
        if slope == 0.0 {
            return (t, state);
        }
        // The derivatives of the time, by the implicit function theorem.
        let t = t - self.full.indicator(event, now, &state) / slope;
        (t, at(t))
    }
}
