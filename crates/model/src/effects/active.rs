//! The effects that are on, sorted by shape, without heap.

use super::{EFFECTS, Effect};

const COUNT: usize = EFFECTS.len();

/// The effects that are on, by shape.
#[derive(Debug, Clone, Copy, Default)]
pub struct ActiveEffects {
    dry: EffectList,
    forces: EffectList,
    inputs: EffectList,
    sensors: EffectList,
}

impl ActiveEffects {
    /// Those of the list that are on.
    pub(super) fn select(is_on: impl Fn(Effect) -> bool) -> Self {
        let mut active = Self::default();
        for &effect in EFFECTS.iter().filter(|e| is_on(**e)) {
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
        active
    }

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

/// Calls `f` with the effects that are marked, one flag per effect of the list, as a slice; without heap.
pub fn effect_scope<R>(marked: &[bool; COUNT], f: impl FnOnce(&[Effect]) -> R) -> R {
    let mut list = EffectList::default();
    EFFECTS.iter().zip(marked).filter(|(_, m)| **m).for_each(|(e, _)| list.push(*e));
    f(list.as_slice())
}

/// A short list without heap.
#[derive(Debug, Clone, Copy)]
struct EffectList {
    effects: [Effect; COUNT],
    len: usize,
}

impl Default for EffectList {
    fn default() -> Self {
        Self { effects: [EFFECTS[0]; COUNT], len: 0 }
    }
}

impl EffectList {
    fn push(&mut self, effect: Effect) {
        self.effects[self.len] = effect;
        self.len += 1;
    }
    #[inline]
    fn as_slice(&self) -> &[Effect] {
        &self.effects[..self.len]
    }
}
