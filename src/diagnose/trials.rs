//! The shapes at which an effect is tried, on the scales of the record.

use super::model::Model;
use super::record::Record;
use super::response::States;
use super::tones::Lines;
use crate::axis::Structure;
use crate::effects::{Effect, Place, Role, Scale, Settings, Start, Variant};

/// Phase that the highest order tried turns by in a sample, at the rms speed, rad.
const FINEST: f64 = 2.0;
/// Highest frequency tried, as a share of the sampling rate.
const HIGHEST: f64 = 0.45;

/// The order or frequency among a form's parameters, and its scale; `None` if it is no sine.
#[must_use]
pub fn tone(effect: Effect, form: &Variant) -> Option<(usize, Scale)> {
    form.free.iter().find_map(|&i| match effect.info().parameters[i].start {
        Start::Grid(scale @ (Scale::Order | Scale::Frequency), _) => Some((i, scale)),
        _ => None,
    })
}

/// Whether an effect is a sine of an order or a frequency to be found.
#[must_use]
pub fn is_sine(effect: Effect) -> bool {
    effect.info().variants.iter().any(|form| tone(effect, form).is_some())
}

/// Shapes of an effect to be tried, with the fractions they came from.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The effect at its sizes and shapes, every other off.
    pub settings: Settings,
    fractions: Vec<(usize, Scale, f64)>,
}

impl Trial {
    /// Takes the regression's factor into a size that it was found at.
    pub fn rescale(&self, effect: Effect, settings: &mut Settings, c: f64, scales: &Scales) {
        for &(i, scale, _) in &self.fractions {
            if matches!(scale, Scale::Sample | Scale::Inertia) {
                settings.of_mut(effect)[i] *= c.clamp(0.2, 5.0);
            }
        }
        // Shapes that hang on the size follow it.
        for &(i, scale, fraction) in &self.fractions {
            if matches!(scale, Scale::Mode | Scale::One) && effect == Effect::FlexibleMode {
                settings.of_mut(effect)[i] = scales.value(effect, scale, fraction, settings);
            }
        }
    }
}

/// Scales of the record.
pub struct Scales {
    speed: [f64; 2],
    twist: f64,
    torque: f64,
    rotation: [f64; 2],
    dt: f64,
    mode: f64,
    inertia: f64,
    orders: [Lines; 2],
    frequencies: Lines,
    /// Lowest and highest angle of the table.
    travel: [f64; 2],
}

impl Scales {
    #[must_use]
    pub fn new(model: &Model, record: &Record, states: &States) -> Self {
        let rms = |f: &dyn Fn(&[f64; 4]) -> f64| {
            (states.motion.iter().map(|s| f(s).powi(2)).sum::<f64>() / states.motion.len() as f64).sqrt()
        };
        let p = &model.parameters;
        let speed = [rms(&|s| s[1]), rms(&|s| s[3])];
        let rotation = |i: usize| {
            let n = states.motion.len() as f64;
            let mean = states.motion.iter().map(|s| s[i]).sum::<f64>() / n;
            rms(&|s| s[i] - mean).max(1e-12)
        };
        let orders = |side: usize, speed: f64| {
            let step = 0.25 * std::f64::consts::TAU / states.travel(side).max(1e-12);
            Lines::up_to(FINEST / (record.dt * speed.max(1e-12)), step)
        };
        let length = record.len() as f64 * record.dt;
        let mode = match model.structure {
            Structure::TwoInertia => p.modal().wn,
            Structure::Rigid => std::f64::consts::TAU * 0.05 / record.dt,
        };
        Self {
            orders: [orders(0, speed[0]), orders(1, speed[1])],
            speed,
            twist: rms(&|s| s[0] - s[2]),
            torque: record.torque.iter().fold(0.0, |m, t| t.abs().max(m)),
            rotation: [rotation(0), rotation(2)],
            dt: record.dt,
            mode,
            inertia: p.i1 + p.i2,
            frequencies: Lines::up_to(HIGHEST / record.dt, 0.5 / length),
            travel: states.ends(1),
        }
    }

    /// Orders or frequencies that an effect is tried at.
    #[must_use]
    pub fn lines(&self, effect: Effect, scale: Scale) -> Option<Lines> {
        match scale {
            Scale::Order => Some(self.orders[usize::from(effect.info().place != Place::Motor)]),
            Scale::Frequency => Some(self.frequencies),
            _ => None,
        }
    }

    /// The parameter of a trial that lies on a grid of lines, its line, and the grid's step.
    #[must_use]
    pub fn line(&self, effect: Effect, trial: &Trial) -> Option<(usize, f64, f64)> {
        trial.fractions.iter().find_map(|&(i, scale, line)| self.lines(effect, scale).map(|all| (i, line, all.step)))
    }

    /// Whether two trials are the same line but for a step of the grid.
    #[must_use]
    pub fn neighbours(&self, effect: Effect, a: &Trial, b: &Trial) -> bool {
        match (self.line(effect, a), self.line(effect, b)) {
            (Some((_, a, step)), Some((_, b, _))) => (a - b).abs() < 1.5 * step,
            _ => false,
        }
    }

    fn value(&self, effect: Effect, scale: Scale, fraction: f64, settings: &Settings) -> f64 {
        let side = usize::from(effect.info().place == Place::Table);
        match scale {
            Scale::One if effect == Effect::FlexibleMode => {
                // A damping ratio.
                let p = settings.of(effect);
                2.0 * fraction * (p[0] * p[1]).sqrt()
            }
            Scale::One | Scale::Order | Scale::Frequency => fraction,
            Scale::Speed => fraction * self.speed[side],
            Scale::Twist => fraction * self.twist,
            Scale::Torque => fraction * self.torque,
            Scale::Rotation => fraction * self.rotation[side],
            Scale::Sample => fraction * self.dt,
            Scale::Mode => {
                let w = fraction * self.mode;
                settings.of(effect)[0] * w * w
            }
            Scale::Inertia => fraction * self.inertia,
            // From the upper end of the travel downwards, or from the lower end upwards.
            Scale::Travel if fraction > 0.0 => self.travel[1] - fraction * (self.travel[1] - self.travel[0]),
            Scale::Travel => self.travel[0] - fraction * (self.travel[1] - self.travel[0]),
        }
    }

    /// Every combination of the starts of the variant's free parameters; `tones`: the orders or frequencies to try.
    #[must_use]
    pub fn trials(&self, effect: Effect, form: &Variant, tones: &[f64]) -> Vec<Trial> {
        let info = effect.info();
        let mut trials = vec![Trial { settings: Settings::default(), fractions: Vec::new() }];
        // Sizes first: shapes may hang on them.
        let mut order: Vec<usize> = form.free.to_vec();
        order.sort_by_key(|&i| (info.parameters[i].role == Role::Shape, i));
        for i in order {
            let Start::Grid(scale, fractions) = info.parameters[i].start else { continue };
            let fractions = self.lines(effect, scale).map_or(fractions, |_| tones);
            trials = trials
                .iter()
                .flat_map(|t| {
                    fractions.iter().map(|&fraction| {
                        let mut settings = t.settings;
                        settings.of_mut(effect)[i] = self.value(effect, scale, fraction, &settings);
                        let mut all = t.fractions.clone();
                        all.push((i, scale, fraction));
                        Trial { settings, fractions: all }
                    })
                })
                .collect();
        }
        trials
    }
}
