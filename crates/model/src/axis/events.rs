//! Events inside a step: a velocity through zero under dry friction, a contact of backlash that closes or opens.
//!
//! They are found and located in time in `f64`.

use super::axis_model::State;
use super::mechanics::Mechanics;
use super::parameters::Structure;
use super::segment::Segment;
use crate::effects::Ramp;
use crate::scalar::Scalar;

/// Most iterations to locate an event.
const LOCATE: usize = 60;
/// An event is located to this share of the step.
pub(super) const LOCATE_TOLERANCE: f64 = 1e-12;

/// What ends a segment of the step early.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Event {
    /// The velocity of inertia 0 or 1 reached zero.
    Rest(usize),
    /// The twist left the gap on this side.
    Closes(i8),
    /// The contact would pull.
    Opens,
}

/// The stretch of a step in which an event is sought.
pub(super) struct Stretch<S> {
    pub ramp: Ramp<S>,
    /// Its begin and its length, s.
    pub begin: f64,
    pub h: S,
}

impl<S: Scalar> Stretch<S> {
    /// The torque up to `t` seconds into it.
    pub fn until(&self, t: S) -> Ramp<S> {
        Ramp { start: self.ramp.start, end: self.ramp.at(t / self.h) }
    }

    /// The same without derivatives.
    pub fn primal(&self) -> Stretch<f64> {
        Stretch { ramp: self.ramp.primal(), begin: self.begin, h: self.h.re() }
    }
}

impl<S: Scalar> Mechanics<S> {
    /// The quantity whose zero is the event; it falls along the segment.
    pub fn indicator(&self, event: Event, from: &State<S>, s: &State<S>) -> S {
        match event {
            Event::Rest(i) => velocity(s, i) * f64::from(from.modes.dry[i]),
            Event::Closes(side) => self.clearance(side, s),
            Event::Opens => self.pressure(from.modes.contact, s),
        }
    }

    /// Changes the modes at an event.
    pub fn enter(&self, event: Event, s: &mut State<S>, time: f64) {
        match event {
            Event::Rest(i) => {
                s.modes.dry[i] = 0;
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
                    s.modes.dry = [0; 2];
                }
            }
            Event::Closes(side) => s.modes.contact = side,
            Event::Opens => s.modes.contact = 0,
        }
        self.refresh_force(s, time);
    }
}

impl Mechanics<f64> {
    /// The first event between a state and a trial, by the straight line between them.
    pub fn first_event(&self, from: &State<f64>, to: &State<f64>) -> Option<Event> {
        let mut first: Option<(f64, Event)> = None;
        let mut propose = |before: f64, after: f64, event| {
            if after < 0.0 {
                let fraction = if before > 0.0 { before / (before - after) } else { 0.0 };
                if first.is_none_or(|(f, _)| fraction < f) {
                    first = Some((fraction, event));
                }
            }
        };
        for i in 0..2 {
            if from.modes.dry[i] != 0 && self.dry[i] {
                let along = |s| self.indicator(Event::Rest(i), from, s);
                propose(along(from), along(to), Event::Rest(i));
            }
        }
        if self.backlash {
            let event = if from.modes.contact == 0 { Event::Closes(to.linear[2].signum() as i8) } else { Event::Opens };
            propose(self.indicator(event, from, from), self.indicator(event, from, to), event);
        }
        first.map(|(_, e)| e)
    }

    /// The state `t` seconds into a stretch.
    fn at(&self, t: f64, from: &State<f64>, stretch: &Stretch<f64>) -> State<f64> {
        self.solve(from, &Segment { ramp: stretch.until(t), length: &self.length(t), end: stretch.begin + t })
    }

    /// Time into a stretch, s, and the state, at which the event's indicator is zero; `to` is the end after it. `None` if the
    /// indicator is zero at the start already.
    ///
    /// By inverse quadratic interpolation inside a bracket, halved where that is not to be trusted (Chandrupatla, Advances
    /// in Engineering Software 28(3), 1997).
    pub fn locate(
        &self,
        event: Event,
        from: &State<f64>,
        to: &State<f64>,
        stretch: &Stretch<f64>,
    ) -> Option<(f64, State<f64>)> {
        let before = (0.0, self.indicator(event, from, from));
        if before.1 <= 0.0 {
            return None;
        }
        let tolerance = LOCATE_TOLERANCE * self.whole.step.h();
        // The newest point, the end of the bracket on the other side of the zero, and the point last dropped.
        let mut newest = (stretch.h, self.indicator(event, from, to));
        let mut across = before;
        let mut t = stretch.h * before.1 / (before.1 - newest.1);
        let mut state = *from;
        for _ in 0..LOCATE {
            state = self.at(t, from, stretch);
            let point = (t, self.indicator(event, from, &state));
            let given_up =
                if (point.1 > 0.0) == (newest.1 > 0.0) { newest } else { std::mem::replace(&mut across, newest) };
            newest = point;
            t = interpolate(newest, across, given_up);
            if (t - newest.0).abs() <= tolerance || newest.1 == 0.0 || (across.0 - newest.0).abs() <= tolerance {
                break;
            }
        }
        Some((newest.0, state))
    }

    /// Slope along time of the indicator of an event that happens `t` seconds into a stretch, by a short difference.
    pub fn slope(&self, event: Event, t: f64, from: &State<f64>, stretch: &Stretch<f64>) -> f64 {
        let dt = self.whole.step.h() * 1e-4;
        let indicator = |t| self.indicator(event, from, &self.at(t, from, stretch));
        (indicator(t + dt) - indicator(t)) / dt
    }
}

/// Zero of the inverse quadratic through three points, of which the first two bracket it.
fn interpolate(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> f64 {
    let (xi, phi) = ((a.0 - b.0) / (c.0 - b.0), (a.1 - b.1) / (c.1 - b.1));
    let share = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
        let far = (c.0 - a.0) / (b.0 - a.0);
        a.1 / (b.1 - a.1) * (c.1 / (b.1 - c.1)) + far * (a.1 / (c.1 - a.1)) * (b.1 / (c.1 - b.1))
    } else {
        0.5
    };
    a.0 + share * (b.0 - a.0)
}

fn velocity<S: Scalar>(s: &State<S>, i: usize) -> S {
    if i == 0 { s.omega1() } else { s.omega2() }
}
