//! One step of the axis with its effects.
//!
//! Between events the axis is linear plus forces from the motion: the end of the step follows from the start by the
//! [`Propagator`], the effects' torques at the end by Newton's method (their tangents and the propagator's compliance
//! make the Jacobian). Dry friction at rest is a torque constant over the step that holds the end velocity at zero.
//!
//! Events (a velocity through zero under dry friction, a contact of backlash that opens or closes) are located in time
//! and the step is continued from there, so that reversals and impacts keep the order of the step (hybrid automaton;
//! Acary & Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, chapter 8, event-driven schemes). The
//! location runs in [`Scalar`] arithmetic, so that sensitivities jump there as they must.

use super::axis_model::{Axis, Motions, State};
use super::parameters::Structure;
use super::propagator::{Compliance, Propagator};
use crate::effects::{Effect, Memory, Motion, Place, Ramp, StepMotion};
use crate::scalar::Scalar;

/// Most events handled inside one step; past that the step is taken as it stands.
const EVENTS: usize = 24;
/// Most Newton iterations of a step.
const NEWTON: usize = 30;
/// Newton ends when the torques repeat to this share of their size.
const NEWTON_TOLERANCE: f64 = 1e-13;
/// Most iterations to locate an event.
const LOCATE: usize = 60;
/// An event is located to this share of the step.
const LOCATE_TOLERANCE: f64 = 1e-12;

const PLACES: [Place; 2] = [Place::Motor, Place::Table];

/// What ended a trial of the step early.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    /// The velocity of inertia 0 or 1 reached zero.
    Rest(usize),
    /// The twist left the gap on this side.
    Closes(i8),
    /// The contact would pull.
    Opens,
}

impl<S: Scalar> Axis<S> {
    /// The state one step later, under the torque `ramp` on the motor; `time` is the start of the step, s.
    #[must_use]
    #[inline]
    pub fn advance(&self, s: &State<S>, ramp: Ramp<S>, time: f64) -> State<S> {
        if self.on.motion_is_linear() {
            let zero = S::default();
            let linear = self.step.apply(&s.linear, [ramp.start, zero], [ramp.end, zero]);
            return State { linear, ..*s };
        }
        self.advance_with_effects(s, ramp, time)
    }

    fn advance_with_effects(&self, s: &State<S>, ramp: Ramp<S>, time: f64) -> State<S> {
        let full = self.step.h();
        if self.on.dry().is_empty() && !self.has_backlash() {
            // Nothing that sticks or opens: no event can end the step early.
            return self.solve(s, ramp, &self.step, &self.compliance, time + full.re());
        }
        let mut done = S::default();
        let mut now = *s;
        self.leave_rest(&mut now, ramp, &self.step, &self.compliance, time);
        for _ in 0..EVENTS {
            let whole = done.re() == 0.0;
            let (step, compliance);
            let (step, compliance) = if whole {
                (&self.step, &self.compliance)
            } else {
                step = self.partial(full - done);
                compliance = step.compliance();
                (&step, &compliance)
            };
            let part = Ramp { start: along(&ramp, done / full), end: ramp.end };
            let trial = self.solve(&now, part, step, compliance, time + full.re());
            let Some(event) = self.first_event(&now, &trial) else {
                return trial;
            };
            let (at, state) = self.locate(event, &now, &trial, part, full - done, time + done.re());
            now = state;
            done += at;
            self.enter(event, &mut now, time + done.re());
            let left = full - done;
            if left.re() <= LOCATE_TOLERANCE * full.re() {
                return now;
            }
            let step = self.partial(left);
            let rest = Ramp { start: along(&ramp, done / full), end: ramp.end };
            self.leave_rest(&mut now, rest, &step, &step.compliance(), time + done.re());
        }
        let step = self.partial(full - done);
        let part = Ramp { start: along(&ramp, done / full), end: ramp.end };
        self.solve(&now, part, &step, &step.compliance(), time + full.re())
    }

    fn partial(&self, h: S) -> Propagator<S> {
        Propagator::new(&self.parameters, self.structure, self.scheme, h)
    }

    /// Level of dry friction of inertia `i` for motion that way, N.m.
    #[inline]
    pub(super) fn level(&self, i: usize, direction: f64, speed: S, at: f64) -> (S, f64) {
        self.effects.dry_level(&self.on, PLACES[i], direction, speed, at)
    }

    pub(super) fn has_dry(&self, i: usize) -> bool {
        self.on.dry().iter().any(|e| e.info().place == PLACES[i])
    }

    fn has_backlash(&self) -> bool {
        self.on.forces().contains(&Effect::Backlash) && self.gap().re() > 0.0
    }

    fn gap(&self) -> S {
        self.effects.of(Effect::Backlash)[0]
    }

    /// The side of contact that belongs to the twist: the one beyond whose end it is, if that side pushes.
    pub(super) fn settle_contact(&self, s: &mut State<S>) {
        if self.has_backlash() {
            let side = s.linear[2].re().signum() as i8;
            s.contact = if self.clearance(side, s).re() < 0.0 { side } else { 0 };
        }
    }

    /// Recomputes the effects' torques at the state, as its modes are.
    pub(super) fn refresh_force(&self, s: &mut State<S>, time: f64) {
        let motions = self.motions(&s.linear);
        let step = StepMotion { start: motions, end: motions, time, h: S::default(), contact: s.contact };
        let mut memory = s.memory;
        let forces = self.effects.forces(&self.on, &self.base, &step, &mut memory);
        s.force = forces.torque;
        for (i, motion) in motions.iter().take(2).enumerate() {
            if s.dry[i] != 0 && self.has_dry(i) {
                let direction = f64::from(s.dry[i]);
                s.force[i] += self.level(i, direction, motion.v.abs(), time).0 * direction;
                s.friction[i] = S::default();
            }
        }
    }

    fn motions(&self, l: &[S; 4]) -> Motions<S> {
        [Motion { x: l[0], v: l[1] }, Motion { x: l[0] - l[2], v: l[1] - l[3] }, Motion { x: l[2], v: l[3] }]
    }

    /// Where dry friction sticks and cannot hold, lets it slip in the direction of the excess.
    fn leave_rest(&self, s: &mut State<S>, ramp: Ramp<S>, step: &Propagator<S>, c: &Compliance, time: f64) {
        for _ in 0..3 {
            let mut changed = false;
            let sticks = |s: &State<S>, i: usize| s.dry[i] == 0 && self.has_dry(i);
            if !sticks(s, 0) && !sticks(s, 1) {
                return;
            }
            let trial = self.solve(s, ramp, step, c, time + step.h().re());
            let mut worst = (0.0, 0, 0);
            for i in 0..2 {
                if sticks(s, i) {
                    let hold = trial.friction[i].re();
                    let level = self.level(i, hold.signum(), S::default(), time).0.re();
                    let excess = hold.abs() - level;
                    if excess > 1e-12 * level.abs() && excess > worst.0 {
                        worst = (excess, i, hold.signum() as i8);
                    }
                }
            }
            if worst.2 != 0 {
                s.dry[worst.1] = worst.2;
                self.refresh_force(s, time);
                changed = true;
            }
            if !changed {
                return;
            }
        }
    }

    /// The first event between a state and a trial, by the straight line between them.
    fn first_event(&self, from: &State<S>, to: &State<S>) -> Option<Event> {
        let mut first: Option<(f64, Event)> = None;
        let mut propose = |fraction: f64, event| {
            if first.is_none_or(|(f, _)| fraction < f) {
                first = Some((fraction, event));
            }
        };
        for i in 0..2 {
            let m = f64::from(from.dry[i]);
            if m != 0.0 && self.has_dry(i) {
                let (v0, v1) = (velocity(from, i).re() * m, velocity(to, i).re() * m);
                if v1 < 0.0 {
                    propose(if v0 > 0.0 { v0 / (v0 - v1) } else { 0.0 }, Event::Rest(i));
                }
            }
        }
        if self.has_backlash() {
            if from.contact == 0 {
                let side = to.linear[2].re().signum() as i8;
                let (c0, c1) = (self.clearance(side, from).re(), self.clearance(side, to).re());
                if c1 < 0.0 {
                    propose(if c0 > 0.0 { c0 / (c0 - c1) } else { 0.0 }, Event::Closes(side));
                }
            } else {
                let pressure = |s| self.pressure(from.contact, s).re();
                let (p0, p1) = (pressure(from), pressure(to));
                if p1 < 0.0 {
                    propose(if p0 > 0.0 { p0 / (p0 - p1) } else { 0.0 }, Event::Opens);
                }
            }
        }
        first.map(|(_, e)| e)
    }

    /// Contact torque of a side, N.m: positive while it pushes.
    fn pressure(&self, side: i8, s: &State<S>) -> S {
        let side = f64::from(side);
        ((s.linear[2] - self.gap() * side) * self.base.k + s.linear[3] * self.base.b) * side
    }

    /// What is missing for a side to push, rad: negative where the twist is beyond the gap's end and the contact would
    /// not pull. A contact that has opened while compressed closes again only when both hold.
    fn clearance(&self, side: i8, s: &State<S>) -> S {
        let gap = self.gap() - s.linear[2] * f64::from(side);
        let pull = -(self.pressure(side, s) / self.base.k);
        if pull.re() > gap.re() { pull } else { gap }
    }

    /// The quantity whose zero is the event; it falls along the step.
    fn indicator(&self, event: Event, from: &State<S>, s: &State<S>) -> S {
        match event {
            Event::Rest(i) => velocity(s, i) * f64::from(from.dry[i]),
            Event::Closes(side) => self.clearance(side, s),
            Event::Opens => self.pressure(from.contact, s),
        }
    }

    /// Time into the part step, and the state, at which the event's indicator is zero.
    ///
    /// Bracketed secant on the value (the derivative follows from one last Newton step in [`Scalar`] arithmetic).
    fn locate(&self, event: Event, from: &State<S>, to: &State<S>, ramp: Ramp<S>, h: S, time: f64) -> (S, State<S>) {
        let mut low = (0.0, self.indicator(event, from, from).re());
        if low.1 <= 0.0 {
            return (S::default(), *from);
        }
        let mut high = (h.re(), self.indicator(event, from, to).re());
        let at = |fraction: S| {
            let end = along(&ramp, fraction / h);
            let step = self.partial(fraction);
            self.solve(from, Ramp { start: ramp.start, end }, &step, &step.compliance(), time + fraction.re())
        };
        let mut t = S::from(low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1));
        let mut last_side = 0_i8;
        for _ in 0..LOCATE {
            let state = at(t);
            let g = self.indicator(event, from, &state);
            let side = if g.re() > 0.0 { 1 } else { -1 };
            // Illinois: the end that stays put counts half, so that the bracket closes from both sides.
            if side > 0 {
                low = (t.re(), g.re());
                if last_side > 0 {
                    high.1 *= 0.5;
                }
            } else {
                high = (t.re(), g.re());
                if last_side < 0 {
                    low.1 *= 0.5;
                }
            }
            last_side = side;
            let next = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
            let close = (next - t.re()).abs() <= LOCATE_TOLERANCE * self.step.h().re() || g.re() == 0.0;
            if close || high.0 - low.0 <= LOCATE_TOLERANCE * self.step.h().re() {
                return self.polish(event, from, t, &at);
            }
            t = S::from(next);
        }
        self.polish(event, from, t, &at)
    }

    /// One Newton step on the located time, which gives it its derivatives (implicit function theorem).
    fn polish(&self, event: Event, from: &State<S>, t: S, at: &impl Fn(S) -> State<S>) -> (S, State<S>) {
        let state = at(t);
        let g = self.indicator(event, from, &state);
        // Slope of the indicator along time, by a short difference of the step itself.
        let dt = self.step.h().re() * 1e-4;
        let ahead = self.indicator(event, from, &at(S::from(t.re() + dt))).re();
        let slope = (ahead - g.re()) / dt;
        if slope == 0.0 {
            return (t, state);
        }
        let t = t - g / slope;
        (t, at(t))
    }

    /// Changes the modes at an event.
    fn enter(&self, event: Event, s: &mut State<S>, time: f64) {
        match event {
            Event::Rest(i) => {
                s.dry[i] = 0;
                // At rest exactly: the located velocity is zero but for rounding.
                match i {
                    0 => {
                        let slip = s.linear[1];
                        s.linear[1] = S::default();
                        s.linear[3] -= slip;
                    }
                    _ => s.linear[3] = s.linear[1],
                }
                if self.structure == Structure::Rigid {
                    s.linear = [s.linear[0], S::default(), S::default(), S::default()];
                    s.dry = [0; 2];
                }
            }
            Event::Closes(side) => s.contact = side,
            Event::Opens => s.contact = 0,
        }
        self.refresh_force(s, time);
    }

    /// The end of a step with the modes held: Newton's method on the effects' torques there.
    fn solve(&self, s: &State<S>, ramp: Ramp<S>, step: &Propagator<S>, c: &Compliance, end: f64) -> State<S> {
        let start = self.motions(&s.linear);
        let sticks = [0, 1].map(|i| s.dry[i] == 0 && self.has_dry(i));
        let hold = Hold::new(sticks, step, c, self.structure);
        let tau0 = [ramp.start - s.force[0], -s.force[1]];
        let mut force = s.force;
        let smooth =
            !self.on.forces().is_empty() || self.on.dry().len() > usize::from(sticks[0]) + usize::from(sticks[1]);
        let unresisted = step.apply(&s.linear, tau0, [ramp.end, S::default()]);
        let end_at = |force: [S; 2]| {
            let free = step.less(&unresisted, force);
            hold.apply(step, &s.linear, tau0, [ramp.end - force[0], -force[1]], free)
        };
        if !smooth {
            let (linear, friction) = end_at(force);
            return State { linear, friction, force, ..*s };
        }
        let mut previous = f64::INFINITY;
        let mut settled = false;
        let mut iteration = 0;
        loop {
            let (linear, friction) = end_at(force);
            let mut memory = s.memory;
            let motion = self.motions(&linear);
            let (found, tangent) = self.end_forces(s, &start, &motion, step.h(), end, &mut memory);
            let residual = [force[0] - found[0], force[1] - found[1]];
            let size = residual[0].re().abs().max(residual[1].re().abs());
            let scale = found[0].re().abs().max(found[1].re().abs()) + ramp.end.re().abs();
            iteration += 1;
            let stands = size <= NEWTON_TOLERANCE * scale;
            // Once the value stands still, one more pass carries derivatives through.
            if settled || (stands && !S::HAS_DERIVATIVES) || iteration == NEWTON {
                return State { linear, friction, force: found, memory, ..*s };
            }
            settled = stands;
            let step2 = solve2(&hold.jacobian(&tangent), residual);
            // A residual that grows means a kink was crossed: half the step.
            let damp = if size > previous * 2.0 { 0.5 } else { 1.0 };
            previous = size;
            force = [force[0] - step2[0] * damp, force[1] - step2[1] * damp];
            // Newton squares the share that is missing, and is there at once where the motion has no say; an internal
            // state or a derivative would miss its last step.
            let near = size <= NEWTON_TOLERANCE.sqrt() * scale || tangent == [[[0.0; 2]; 2]; 2];
            if near && !S::HAS_DERIVATIVES && !self.remembers {
                let (linear, friction) = end_at(force);
                return State { linear, friction, force, ..*s };
            }
        }
    }

    /// Torques of the effects at the trial end, and their tangent `[stiffness, damping]`.
    fn end_forces(
        &self,
        s: &State<S>,
        start: &Motions<S>,
        end: &Motions<S>,
        h: S,
        time: f64,
        memory: &mut Memory<S>,
    ) -> ([S; 2], [[[f64; 2]; 2]; 2]) {
        let step = StepMotion { start: *start, end: *end, time, h, contact: s.contact };
        let forces = self.effects.forces(&self.on, &self.base, &step, memory);
        let mut torque = forces.torque;
        let mut damping = forces.damping;
        for i in 0..2 {
            if s.dry[i] != 0 && self.has_dry(i) {
                let direction = f64::from(s.dry[i]);
                // On trial the velocity may have passed zero: the sliding law continues there until the event is found.
                let speed = end[i].v * direction;
                let (level, slope) = self.level(i, direction, speed, time);
                torque[i] += level * direction;
                damping[i][i] += slope;
            }
        }
        (torque, [forces.stiffness, damping])
    }
}

/// The torque `fraction` into a step.
fn along<S: Scalar>(ramp: &Ramp<S>, fraction: S) -> S {
    ramp.start + (ramp.end - ramp.start) * fraction
}

fn velocity<S: Scalar>(s: &State<S>, i: usize) -> S {
    if i == 0 { s.omega1() } else { s.omega2() }
}

/// Dry friction that holds: the torques, constant over the step, that bring the held velocities to zero at its end.
struct Hold<'a, S> {
    sticks: [bool; 2],
    /// Inverse of the velocity answers of the held inertias.
    inverse: [[S; 2]; 2],
    c: &'a Compliance,
}

impl<'a, S: Scalar> Hold<'a, S> {
    fn new(sticks: [bool; 2], step: &Propagator<S>, c: &'a Compliance, structure: Structure) -> Self {
        let zero = S::default();
        let mut inverse = [[zero; 2]; 2];
        let mut sticks = sticks;
        if structure == Structure::Rigid && sticks == [true, true] {
            // One body: one holding torque.
            sticks[1] = false;
        }
        if sticks != [false, false] {
            let h = step.velocity_per_constant_torque();
            match sticks {
                [true, true] => {
                    let det = h[0][0] * h[1][1] - h[0][1] * h[1][0];
                    inverse = [[h[1][1] / det, -(h[0][1] / det)], [-(h[1][0] / det), h[0][0] / det]];
                }
                [true, false] => inverse[0][0] = S::from(1.0) / h[0][0],
                _ => inverse[1][1] = S::from(1.0) / h[1][1],
            }
        }
        Self { sticks, inverse, c }
    }

    /// The end with the holding torques, and these.
    #[inline]
    fn apply(&self, step: &Propagator<S>, from: &[S; 4], tau0: [S; 2], tau1: [S; 2], free: [S; 4]) -> ([S; 4], [S; 2]) {
        if self.sticks == [false, false] {
            return (free, [S::default(); 2]);
        }
        let v = [free[1], free[1] - free[3]];
        let mut hold = [S::default(); 2];
        for (i, row) in self.inverse.iter().enumerate() {
            for (j, g) in row.iter().enumerate() {
                if self.sticks[i] && self.sticks[j] {
                    hold[i] += *g * v[j];
                }
            }
        }
        let less = |t: [S; 2]| [t[0] - hold[0], t[1] - hold[1]];
        let mut held = step.apply(from, less(tau0), less(tau1));
        // Zero exactly, not to rounding, and no motion from rest to rest: a body that sticks does not creep.
        let table = from[0] - from[2];
        if self.sticks[0] {
            held[1] = S::default();
            if from[1].re() == 0.0 {
                held[2] -= held[0] - from[0];
                held[0] = from[0];
            }
        }
        if self.sticks[1] {
            held[3] = held[1];
            if (from[1] - from[3]).re() == 0.0 {
                held[2] = held[0] - table;
            }
        }
        (held, hold)
    }

    /// Jacobian of `force - found(force)`: `1 + stiffness*X + damping*V`, with the compliance as held.
    fn jacobian(&self, tangent: &[[[f64; 2]; 2]; 2]) -> [[f64; 2]; 2] {
        let mut x = self.c.position;
        let mut v = self.c.velocity;
        if self.sticks != [false, false] {
            // The holding torques answer too: they take back the held velocities.
            let (cx, cv) = (&self.c.constant_position, &self.c.constant_velocity);
            let v0 = v;
            for column in 0..2 {
                for i in 0..2 {
                    if !self.sticks[i] {
                        continue;
                    }
                    let hold: f64 =
                        (0..2).filter(|&j| self.sticks[j]).map(|j| self.inverse[i][j].re() * v0[j][column]).sum();
                    for row in 0..2 {
                        x[row][column] -= cx[row][i] * hold;
                        v[row][column] -= cv[row][i] * hold;
                    }
                }
            }
        }
        let mut j = [[1.0, 0.0], [0.0, 1.0]];
        for row in 0..2 {
            for column in 0..2 {
                for m in 0..2 {
                    j[row][column] += tangent[0][row][m] * x[m][column] + tangent[1][row][m] * v[m][column];
                }
            }
        }
        j
    }
}

/// Solves a 2 x 2 system whose matrix is real.
fn solve2<S: Scalar>(a: &[[f64; 2]; 2], b: [S; 2]) -> [S; 2] {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [(b[0] * a[1][1] - b[1] * a[0][1]) / det, (b[1] * a[0][0] - b[0] * a[1][0]) / det]
}
