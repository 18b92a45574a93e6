//! The record cut into windows, and a model run over them, each from its own initial state (multiple shooting).
//!
//! The free rigid-body mode makes a simulation of the whole record lose its phase; windows of some hundred samples with
//! their own initial states do not. A window begins a few samples before the part that is compared, so that what an
//! effect remembers (a late sensor) has come into being by then. Internal states of effects run on from window to
//! window; the torque's own effects (delay, lag, limit) run along the whole record.

use std::ops::Range;

use super::model::{LOOPS, Model};
use super::record::Record;
use crate::axis::{Axis, Hold, Scheme, Structure, substeps};
use crate::effects::{Effect, MEMORY, Memory, Ramp, Reading, Settings, TorqueHistory};
use crate::scalar::Scalar;

/// Samples in a window that are compared.
pub const LENGTH: usize = 512;
/// Samples before them.
const WARM: usize = 12;
/// Windows fitted at most: a longer record is sampled by so many, spread evenly.
const MOST: usize = 32;

/// One window.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Window {
    /// First sample simulated.
    pub begin: usize,
    /// The samples compared.
    pub compared: Range<usize>,
}

/// Cuts a part of the record into windows.
#[must_use]
pub fn cut(part: Range<usize>) -> Vec<Window> {
    let usable = part.len().saturating_sub(WARM);
    let count = (usable as f64 / LENGTH as f64).round().max(1.0) as usize;
    let length = usable / count;
    let all = (0..count).map(|w| {
        let from = part.start + WARM + w * length;
        let to = if w + 1 == count { part.end } else { from + length };
        Window { begin: from - WARM.min(from - part.start), compared: from..to }
    });
    if count <= MOST {
        return all.collect();
    }
    let all: Vec<Window> = all.collect();
    (0..MOST).map(|i| all[i * count / MOST].clone()).collect()
}

/// Steps a sample the model needs, at its present parameters.
#[must_use]
pub fn steps(model: &Model, record: &Record) -> usize {
    substeps(&model.parameters, model.structure, &model.effects, record.dt)
}

/// Runs the model over the windows; `visit(window, sample, reading)` for every compared sample.
///
/// `initial`: the state at the beginning of each window, see [`Initial`]. `also`: effects taken as on whatever their size.
/// `forget` drops what internal states know of the window they come from (derivatives to its initial state).
#[allow(clippy::too_many_arguments)]
pub fn run<S: Scalar>(
    model: &Model<S>,
    also: &[Effect],
    per: usize,
    record: &Record,
    windows: &[Window],
    initial: impl Fn(usize) -> Initial<S>,
    forget: impl Fn(S) -> S,
    mut visit: impl FnMut(usize, usize, &Reading<S>),
) {
    let h = record.dt / per as f64;
    let axis = Axis::with_on(model.parameters, model.structure, model.effects, also, Scheme::Exact, h);
    let torque = Torque::new(&axis, record, per);
    let sensed = !axis.on().sensors().is_empty();
    let flexible = axis.on().forces().contains(&Effect::FlexibleMode);
    let mut memory: Memory<S> = [S::default(); MEMORY];
    for (effect, share) in LOOPS.iter().zip(&model.loops) {
        if axis.on().forces().contains(effect) {
            Settings::set_loop(&mut memory, *effect, *share);
        }
    }
    for (w, window) in windows.iter().enumerate() {
        let next = windows.get(w + 1).map_or(usize::MAX, |n| n.begin);
        let time = |k: usize| record.start + k as f64 * record.dt;
        let [theta1, omega1, theta2, omega2, twist, rate] = initial(w);
        if flexible {
            model.effects.set_mode(&mut memory, twist, rate);
        }
        let mut state = axis.resume([theta1, omega1, theta2, omega2], &memory, time(window.begin));
        let mut history = sensed.then(|| model.effects.settle_sensors(axis.on(), state.reading(), record.dt));
        for k in window.begin..window.compared.end {
            if k == next {
                memory = state.memory().map(&forget);
            }
            if window.compared.contains(&k) {
                match &history {
                    Some(history) => {
                        visit(w, k, &model.effects.transform_sensor(axis.on(), history, record.dt));
                    }
                    None => visit(w, k, &state.reading()),
                }
            }
            if k + 1 == window.compared.end {
                break;
            }
            for j in 0..per {
                state = axis.advance(&state, torque.at(k, j), time(k) + j as f64 * h);
            }
            if let Some(history) = &mut history {
                model.effects.push_sensors(axis.on(), history, state.reading());
            }
        }
        if next >= window.compared.end {
            memory = state.memory().map(&forget);
        }
    }
}

/// The torque on the motor over every step of the record.
struct Torque<'a, S> {
    record: &'a Record,
    per: usize,
    changed: Vec<Ramp<S>>,
}

impl<'a, S: Scalar> Torque<'a, S> {
    fn new(axis: &Axis<S>, record: &'a Record, per: usize) -> Self {
        let mut torque = Self { record, per, changed: Vec::new() };
        if axis.on().inputs().is_empty() {
            return torque;
        }
        let h = record.dt / per as f64;
        let first = record.torque.first().copied().unwrap_or_default();
        let mut history = TorqueHistory::settled(S::from(first));
        let mut changed = Vec::with_capacity(record.len() * per);
        for k in 0..record.len() {
            for j in 0..per {
                changed.push(axis.effects().transform_input(axis.on(), torque.commanded(k, j), h.into(), &mut history));
            }
        }
        torque.changed = changed;
        torque
    }

    fn commanded(&self, k: usize, j: usize) -> Ramp<S> {
        let ramp: Ramp<S> = self.record.hold.ramp(&self.record.torque, k);
        if self.per == 1 || self.record.hold == Hold::Zoh {
            return ramp;
        }
        let part = |i: usize| ramp.start + (ramp.end - ramp.start) * (i as f64 / self.per as f64);
        Ramp { start: part(j), end: part(j + 1) }
    }

    #[inline]
    fn at(&self, k: usize, j: usize) -> Ramp<S> {
        if self.changed.is_empty() { self.commanded(k, j) } else { self.changed[k * self.per + j] }
    }
}

/// State at the beginning of a window: `[theta1, omega1, theta2, omega2]`, and twist and rate of a third inertia.
pub type Initial<S = f64> = [S; 6];

/// Which numbers of an initial state are free: a rigid axis has no twist, only a flexible mode has a third inertia.
#[must_use]
pub const fn local_indices(structure: Structure, flexible: bool) -> &'static [usize] {
    match (structure, flexible) {
        (Structure::TwoInertia, false) => &[0, 1, 2, 3],
        (Structure::TwoInertia, true) => &[0, 1, 2, 3, 4, 5],
        (Structure::Rigid, false) => &[0, 1],
        (Structure::Rigid, true) => &[0, 1, 4, 5],
    }
}

/// The initial state from its free numbers.
#[must_use]
pub fn local_state<S: Scalar>(structure: Structure, indices: &[usize], free: &[S]) -> Initial<S> {
    let mut state = [S::default(); 6];
    for (i, v) in indices.iter().zip(free) {
        state[*i] = *v;
    }
    if structure == Structure::Rigid {
        state[2] = state[0];
        state[3] = state[1];
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_cover_the_part_without_a_gap() {
        let windows = cut(100..8292);
        assert_eq!(windows[0].begin, 100);
        assert_eq!(windows[0].compared.start, 112);
        for pair in windows.windows(2) {
            assert_eq!(pair[0].compared.end, pair[1].compared.start);
        }
        assert_eq!(windows.last().expect("some").compared.end, 8292);
    }

    #[test]
    fn a_long_record_is_sampled() {
        assert_eq!(cut(0..1_000_000).len(), MOST);
    }
}
