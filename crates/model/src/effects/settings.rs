//! Which effects are on, and with which parameters.

use std::fmt;
use std::ops::Range;

use super::info::{Place, Role};
use super::input::{Ramp, TorqueHistory};
use super::law::slip;
use super::shapes::{Base, Coordinate, Internal, Modes, Moment, Motion, Reaction, Slip};
use super::{EFFECTS, Effect, Law, WithLaw};
use crate::scalar::Scalar;

const COUNT: usize = EFFECTS.len();

/// Where each effect's parameters start in the flat array; the last entry is their number.
const OFFSETS: [usize; COUNT + 1] = {
    let mut offsets = [0; COUNT + 1];
    let mut i = 0;
    while i < COUNT {
        offsets[i + 1] = offsets[i] + EFFECTS[i].info().parameters.len();
        i += 1;
    }
    offsets
};

/// Where each effect's internal states start; the last entry is their number.
const MEMORY_OFFSETS: [usize; COUNT + 1] = {
    let mut offsets = [0; COUNT + 1];
    let mut i = 0;
    while i < COUNT {
        offsets[i + 1] = offsets[i] + EFFECTS[i].info().memory;
        i += 1;
    }
    offsets
};

/// Where an effect's internal states lie.
#[inline]
#[must_use]
pub fn memory_of(effect: Effect) -> Range<usize> {
    MEMORY_OFFSETS[effect as usize]..MEMORY_OFFSETS[effect as usize + 1]
}

/// Number of effect parameters in all.
pub const PARAMETERS: usize = OFFSETS[COUNT];
/// Number of internal states of all effects.
pub const MEMORY: usize = MEMORY_OFFSETS[COUNT];
/// Most internal states of one effect.
pub(crate) const MEMORY_OF_ONE: usize = {
    let (mut most, mut i) = (0, 0);
    while i < COUNT {
        let states = EFFECTS[i].info().memory;
        most = if states > most { states } else { most };
        i += 1;
    }
    most
};

/// Internal states of all effects.
pub type Memory<S> = [S; MEMORY];
/// The same over a step.
pub(crate) type Internals<S> = [Internal<S>; MEMORY];

/// A name that is no effect, or no parameter of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownEffect {
    /// The name given, `effect` or `effect.parameter`.
    pub name: String,
}

impl fmt::Display for UnknownEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no effect or effect parameter is named `{}`", self.name)
    }
}

impl std::error::Error for UnknownEffect {}

impl Effect {
    /// The effect of that id.
    ///
    /// # Errors
    /// If there is none.
    pub fn from_id(id: &str) -> Result<Self, UnknownEffect> {
        EFFECTS.iter().copied().find(|e| e.info().id == id).ok_or_else(|| UnknownEffect { name: id.to_owned() })
    }

    /// Whether the other can stand for this one: of the same family, with a size of the same name and unit. It is the same effect
    /// on the other side of the coupling, or another law of the same phenomenon.
    #[must_use]
    pub fn is_alternative_to(self, other: Self) -> bool {
        let size = |(i, _): &(usize, usize)| self.info().parameters[*i].role == Role::Size;
        self != other && self.info().family == other.info().family && self.shared(other).any(|pair| size(&pair))
    }

    /// Parameters that two effects share by name and unit: their indices in each.
    pub fn shared(self, other: Self) -> impl Iterator<Item = (usize, usize)> {
        let its = other.info().parameters;
        self.info()
            .parameters
            .iter()
            .enumerate()
            .filter_map(move |(i, p)| its.iter().position(|q| q.name == p.name && q.unit == p.unit).map(|j| (i, j)))
    }

    /// Index of a parameter of that name.
    ///
    /// # Errors
    /// If the effect has none of that name.
    pub fn parameter(self, name: &str) -> Result<usize, UnknownEffect> {
        let info = self.info();
        info.parameters
            .iter()
            .position(|p| p.name == name)
            .ok_or_else(|| UnknownEffect { name: format!("{}.{name}", info.id) })
    }
}

/// The parameters of every effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<S = f64> {
    values: [S; PARAMETERS],
}

impl<S: Scalar> Default for Settings<S> {
    /// Every effect off.
    fn default() -> Self {
        let mut values = [S::default(); PARAMETERS];
        for &effect in EFFECTS {
            for (i, p) in effect.info().parameters.iter().enumerate() {
                values[OFFSETS[effect as usize] + i] = p.off.into();
            }
        }
        Self { values }
    }
}

impl<S: Scalar> Settings<S> {
    /// The same over another scalar, as constants.
    #[must_use]
    pub fn lift(other: &Settings<f64>) -> Self {
        Self { values: other.values.map(S::from) }
    }

    /// The same without derivatives.
    #[must_use]
    pub fn primal(&self) -> Settings<f64> {
        Settings { values: self.values.map(S::re) }
    }

    /// The settings from every effect's parameters in the order of the list.
    #[must_use]
    pub fn from_flat(values: [S; PARAMETERS]) -> Self {
        Self { values }
    }

    /// Every effect's parameters in the order of the list.
    #[must_use]
    pub fn flat(&self) -> &[S; PARAMETERS] {
        &self.values
    }

    /// The parameters of an effect, in the order of its info.
    #[must_use]
    pub fn of(&self, effect: Effect) -> &[S] {
        &self.values[OFFSETS[effect as usize]..OFFSETS[effect as usize + 1]]
    }

    /// The parameters of an effect, to be changed.
    pub fn of_mut(&mut self, effect: Effect) -> &mut [S] {
        &mut self.values[OFFSETS[effect as usize]..OFFSETS[effect as usize + 1]]
    }

    /// True if a size of the effect differs from its off value.
    #[must_use]
    pub fn is_on(&self, effect: Effect) -> bool {
        #[allow(clippy::float_cmp, reason = "off is an exact value, not a measurement")]
        effect.info().parameters.iter().zip(self.of(effect)).any(|(p, v)| p.role == Role::Size && v.re() != p.off)
    }

    /// The effects that are on, sorted by shape, ready for the step.
    #[must_use]
    pub fn active(&self) -> ActiveEffects {
        self.active_with(&[])
    }

    /// The same, with some taken as on whatever their size: a derivative at the off value needs them.
    #[must_use]
    pub fn active_with(&self, also: &[Effect]) -> ActiveEffects {
        let mut active = ActiveEffects::default();
        for &effect in EFFECTS {
            if self.is_on(effect) || also.contains(&effect) {
                let list = if effect.is_force() {
                    &mut active.forces
                } else if effect.is_dry() {
                    &mut active.dry
                } else if effect.is_input() {
                    &mut active.inputs
                } else {
                    &mut active.sensors
                };
                list.push(effect);
            }
        }
        active
    }

    /// Level of dry friction at a place against a slip, N.m.
    pub(crate) fn dry_level(&self, on: &ActiveEffects, place: Place, slip: &Slip<S>) -> S {
        let mut sum = S::default();
        for effect in on.dry().iter().filter(|e| e.info().place == place) {
            sum += effect.level(self.of(*effect), slip).level;
        }
        sum
    }

    /// Sum of the forces and of sliding friction: torque on motor and table, N.m, and the tangent. It sets the internal states'
    /// end on trial.
    #[inline]
    pub(crate) fn forces(
        &self,
        on: &ActiveEffects,
        base: &Base<S>,
        step: &StepMotion<S>,
        memory: &mut Internals<S>,
    ) -> Forces<S> {
        let mut sum = Forces::default();
        let none = S::default();
        for &effect in on.forces() {
            let coordinate = effect.info().place.coordinate();
            sum.add(coordinate, &self.reaction(effect, base, &step.moment(coordinate, none), memory));
        }
        let load = if self.counts_load(on) { self.transmitted(on, base, step) } else { Forces::default() };
        for &effect in on.dry() {
            let coordinate = effect.info().place.coordinate();
            let moment = step.moment(coordinate, load.torque[0].abs());
            if moment.slides != 0.0 {
                sum.add(coordinate, &self.reaction(effect, base, &moment, memory));
                if self.is_loaded(effect) {
                    // The level depends on the motion of both inertias, through the load.
                    let towards = if load.torque[0].re() < 0.0 { -moment.slides } else { moment.slides };
                    let per = effect.level(self.of(effect), &slip(&moment)).per_load * towards;
                    let row = usize::from(coordinate == Coordinate::Table);
                    for column in 0..2 {
                        sum.stiffness[row][column] += per * load.stiffness[0][column];
                        sum.damping[row][column] += per * load.damping[0][column];
                    }
                }
            }
        }
        sum
    }

    /// The torque of one effect on the motion; it sets its internal states' end on trial.
    #[inline]
    fn reaction(&self, effect: Effect, base: &Base<S>, moment: &Moment<S>, memory: &mut Internals<S>) -> Reaction<S> {
        let memory = &mut memory[memory_of(effect)];
        effect.with_law(React { p: self.of(effect), base, moment, memory })
    }

    /// The torque on the motor over a step, from the torque commanded over it.
    pub fn transform_input(&self, on: &ActiveEffects, ramp: Ramp<S>, h: S, history: &mut TorqueHistory<S>) -> Ramp<S> {
        on.inputs.as_slice().iter().fold(ramp, |ramp, &e| e.transform_input(self.of(e), ramp, h, history))
    }

    /// The torque on the motor at this instant, from the torque commanded now and the steps up to now.
    pub fn input_now(&self, on: &ActiveEffects, torque: S, history: &TorqueHistory<f64>) -> S {
        on.inputs.as_slice().iter().fold(torque, |torque, &e| e.input_now(self.of(e), torque, history))
    }
}

/// A law's torque.
pub(super) struct React<'a, S> {
    pub p: &'a [S],
    pub base: &'a Base<S>,
    pub moment: &'a Moment<S>,
    pub memory: &'a mut [Internal<S>],
}

impl<S: Scalar> WithLaw for React<'_, S> {
    type Output = Reaction<S>;

    #[inline]
    fn with<L: Law>(self) -> Reaction<S> {
        L::react(self.p, self.base, self.moment, self.memory)
    }
}

/// Hands the effects that are marked, one flag an effect of the list, to `f` as a slice; without heap.
pub fn effect_scope<R>(marked: &[bool; COUNT], f: impl FnOnce(&[Effect]) -> R) -> R {
    let mut few = Few::default();
    EFFECTS.iter().zip(marked).filter(|(_, m)| **m).for_each(|(e, _)| few.push(*e));
    f(few.as_slice())
}

/// Motion of both inertias at the start and at the trial end of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepMotion<S> {
    pub start: [Motion<S>; 3],
    pub end: [Motion<S>; 3],
    pub time: f64,
    pub h: S,
    pub modes: Modes,
}

impl<S: Scalar> StepMotion<S> {
    #[inline]
    pub(super) fn moment(&self, coordinate: Coordinate, load: S) -> Moment<S> {
        let i = coordinate as usize;
        Moment {
            start: self.start[i],
            end: self.end[i],
            time: self.time,
            h: self.h,
            contact: self.modes.contact,
            slides: self.modes.slides(coordinate),
            load,
        }
    }
}

/// Torques on motor and table that resist, with their tangent; row = inertia, column = coordinate.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Forces<S> {
    pub torque: [S; 2],
    pub stiffness: [[f64; 2]; 2],
    pub damping: [[f64; 2]; 2],
    /// Sum of the laws' curvature bounds, N.m/rad2: zero if all are linear.
    pub curvature: f64,
}

impl<S: Scalar> Forces<S> {
    #[inline]
    pub(crate) fn add(&mut self, coordinate: Coordinate, r: &Reaction<S>) {
        self.curvature += r.curvature;
        match coordinate {
            Coordinate::Table => {
                self.torque[1] += r.torque;
                self.stiffness[1][1] += r.stiffness;
                self.damping[1][1] += r.damping;
            }
            Coordinate::Twist => {
                self.torque[0] += r.torque;
                self.torque[1] -= r.torque;
                for (row, column, sign) in [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)] {
                    self.stiffness[row][column] += sign * r.stiffness;
                    self.damping[row][column] += sign * r.damping;
                }
            }
            Coordinate::Motor => {
                self.torque[0] += r.torque;
                self.stiffness[0][0] += r.stiffness;
                self.damping[0][0] += r.damping;
            }
        }
    }
}

/// A short list without heap.
#[derive(Debug, Clone, Copy)]
struct Few {
    effects: [Effect; COUNT],
    len: usize,
}

impl Default for Few {
    fn default() -> Self {
        Self { effects: [EFFECTS[0]; COUNT], len: 0 }
    }
}

impl Few {
    fn push(&mut self, effect: Effect) {
        self.effects[self.len] = effect;
        self.len += 1;
    }
    #[inline]
    fn as_slice(&self) -> &[Effect] {
        &self.effects[..self.len]
    }
}

/// The effects that are on, by shape.
#[derive(Debug, Clone, Copy, Default)]
pub struct ActiveEffects {
    dry: Few,
    forces: Few,
    inputs: Few,
    sensors: Few,
}

impl ActiveEffects {
    /// True if nothing acts on the motion: the step is then the linear one.
    #[must_use]
    pub fn motion_is_linear(&self) -> bool {
        self.dry.len == 0 && self.forces.len == 0
    }

    /// The dry frictions that are on.
    #[must_use]
    pub fn dry(&self) -> &[Effect] {
        self.dry.as_slice()
    }

    /// The force effects that are on.
    #[must_use]
    pub fn forces(&self) -> &[Effect] {
        self.forces.as_slice()
    }

    /// The input effects that are on.
    #[must_use]
    pub fn inputs(&self) -> &[Effect] {
        self.inputs.as_slice()
    }

    /// The sensor effects that are on.
    #[must_use]
    pub fn sensors(&self) -> &[Effect] {
        self.sensors.as_slice()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::tests::shown;

    /// Newton's method ends where the curvature bounds the residual after its step.
    #[test]
    fn no_law_leaves_its_tangent_by_more_than_its_curvature_bound() {
        let base = Base { k: 1.76e-2, b: 5.4e-4, rigid: false };
        let mut straight = 0;
        for &effect in EFFECTS.iter().filter(|e| e.is_force()) {
            let settings = shown(effect);
            for (x, v, contact) in [(0.3, 1.7, 0), (-0.2, -0.6, 1), (2.0, 0.4, -1)] {
                let reaction = |dx: f64, dv: f64| {
                    let (start, end) = (Motion { x: x - 2e-3, v }, Motion { x: x + dx, v: v + dv });
                    let moment = Moment { start, end, time: 0.7, h: 1e-3, contact, slides: 0.0, load: 0.0 };
                    settings.reaction(effect, &base, &moment, &mut [Internal::at(0.1); MEMORY])
                };
                let at = reaction(0.0, 0.0);
                for (dx, dv) in [(1e-2, 0.2), (-3e-3, 0.1), (0.5, -0.3)] {
                    let off = reaction(dx, dv).torque - (at.torque + at.stiffness * dx + at.damping * dv);
                    assert!(off.abs() <= 0.5 * at.curvature * dx * dx + 1e-15, "{effect:?} {off} {}", at.curvature);
                }
                straight += usize::from(at.curvature == 0.0);
            }
        }
        // Loads, play, drift of stiffness, third inertias, spring to the frame and disturbance, at each of the three.
        assert!(straight >= 8 * 3, "{straight}");
    }

    /// Newton's method takes the internal states along by their tangents.
    #[test]
    fn internal_states_have_their_tangents() {
        let base = Base { k: 1.76e-2, b: 5.4e-4, rigid: false };
        let mut states = 0;
        for &effect in EFFECTS.iter().filter(|e| e.info().memory > 0) {
            let settings = shown(effect);
            for (x, v) in [(0.3, 1.7), (-0.2, -0.6), (2.0, 0.4)] {
                let end = |dx: f64, dv: f64| {
                    let (start, end) = (Motion { x: x - 2e-3, v }, Motion { x: x + dx, v: v + dv });
                    let moment = Moment { start, end, time: 0.7, h: 1e-3, contact: 0, slides: 0.0, load: 0.0 };
                    let mut memory = [Internal::at(0.1); MEMORY];
                    settings.reaction(effect, &base, &moment, &mut memory);
                    memory
                };
                let at = end(0.0, 0.0);
                let d = 1e-6;
                for i in memory_of(effect) {
                    let difference =
                        |a: [Internal<f64>; MEMORY], b: [Internal<f64>; MEMORY]| (a[i].end - b[i].end) / (2.0 * d);
                    for (slope, own) in [
                        (difference(end(d, 0.0), end(-d, 0.0)), at[i].per.x),
                        (difference(end(0.0, d), end(0.0, -d)), at[i].per.v),
                    ] {
                        // The loop's is that of its equation, not of the Runge-Kutta step along it.
                        assert!((slope - own).abs() <= 1e-4 * (1.0 + own.abs()), "{effect:?} {i}: {slope} {own}");
                    }
                    states += 1;
                }
            }
        }
        // Two bristles, a loop, and the third inertias' three, at each of the three motions.
        assert_eq!(states, 9 * 3);
    }

    #[test]
    fn alternatives_are_the_laws_of_one_thing_on_both_sides_of_the_coupling() {
        let mut found: Vec<[&str; 2]> = EFFECTS
            .iter()
            .flat_map(|a| EFFECTS.iter().map(move |b| (a, b)))
            .filter(|(a, b)| a.is_alternative_to(**b) && a.info().id < b.info().id)
            .map(|(a, b)| [a.info().id, b.info().id])
            .collect();
        // Of DESIGN's table: dry friction by its level, viscous friction, loads and third inertias in their two places; a
        // drag's coefficient has another unit than a viscous one.
        let dry = ["coulomb_motor", "coulomb_table", "presliding_motor", "presliding_table"];
        let mut expected =
            vec![["viscous_motor", "viscous_table"], ["load_motor", "load_table"], ["flexible_mode", "motor_mode"]];
        expected.extend((0..4).flat_map(|i| (i + 1..4).map(move |j| [dry[i], dry[j]])));
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected);
    }
}
