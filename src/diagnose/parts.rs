//! What of an effect is linear in its sizes: the columns that a regression can size at once.

use crate::effects::{Effect, Settings, Start, Variant};

/// A column of an effect that is linear in its sizes.
pub struct Part {
    /// The parameter that it stands for.
    pub parameter: usize,
    /// The effect with this part alone, as large as one.
    pub unit: Settings,
    /// How large it is in the settings: the effect is the sum of its parts, each times this.
    pub value: f64,
}

/// The columns whose sum, each times its size, is the effect of any size; none if the effect is linear in nothing.
#[must_use]
pub fn linear_parts(effect: Effect, form: &Variant, settings: &Settings) -> Vec<Part> {
    let info = effect.info();
    let start = |i: usize| info.parameters[i].start;
    let now = settings.of(effect);
    let beyond = |i: usize| now[i] - info.parameters[i].off;
    let mut blank = *settings;
    for &i in form.free {
        if matches!(start(i), Start::Linear | Start::Share | Start::Phase) {
            blank.of_mut(effect)[i] = info.parameters[i].off;
        }
    }
    let phase = form.free.iter().copied().find(|&i| start(i) == Start::Phase);
    let share = form.free.iter().copied().find(|&i| start(i) == Start::Share);
    let mut parts = Vec::new();
    for &i in form.free {
        let mut unit = blank;
        unit.of_mut(effect)[i] += 1.0;
        match start(i) {
            Start::Linear if info.parameters[i].name == "amplitude" && phase.is_some() => {
                let phase = phase.unwrap_or(i);
                let (s, c) = now[phase].sin_cos();
                parts.push(Part { parameter: i, unit, value: beyond(i) * c });
                unit.of_mut(effect)[phase] = std::f64::consts::FRAC_PI_2;
                parts.push(Part { parameter: phase, unit, value: beyond(i) * s });
            }
            Start::Linear => {
                let shared = share.filter(|_| i == form.free[0]).map_or(0.0, |j| now[j]);
                parts.push(Part { parameter: i, unit, value: beyond(i) * (1.0 - shared) });
            }
            Start::Share => {
                unit.of_mut(effect)[form.free[0]] += 1.0;
                parts.push(Part { parameter: i, unit, value: beyond(form.free[0]) * now[i] });
            }
            _ => {}
        }
    }
    parts
}
