//! Sound records pass, broken ones are refused by the name of their defect.

mod broken;
mod log;
mod slow;
mod sound;
mod table;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::axis::{Hold, Scheme, SimulateOptions, simulate};
use crate::effects::{Effect, Settings};
use crate::identify::excitation::{Kind, Multisine};

/// Torque, theta1, omega1, theta2, omega2.
#[derive(Clone)]
pub(crate) struct Columns {
    dt: f64,
    v: [Vec<f64>; 5],
}

const NOMINAL: Nominal = Nominal { structure: Structure::TwoInertia, parameters: Parameters::PAPER };

impl Columns {
    fn input(&self) -> Input<'_> {
        let [t, x1, w1, x2, w2] = &self.v;
        Input {
            dt: self.dt,
            torque: Some(t),
            theta1: Some(x1),
            omega1: Some(w1),
            theta2: Some(x2),
            omega2: Some(w2),
            ..Input::default()
        }
    }

    fn positions(&self) -> Input<'_> {
        Input { omega1: None, omega2: None, ..self.input() }
    }

    fn motor_only(&self) -> Input<'_> {
        Input { theta2: None, ..self.positions() }
    }
}

fn effect(id: &str, values: &[(&str, f64)]) -> Settings {
    let mut settings = Settings::default();
    let effect = Effect::from_id(id).unwrap();
    for (name, value) in values {
        settings.of_mut(effect)[effect.parameter(name).unwrap()] = *value;
    }
    settings
}

fn noise(seed: u64, size: f64) -> impl FnMut() -> f64 {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    move || {
        let e: f64 = StandardNormal.sample(&mut rng);
        size * e
    }
}

/// The paper's axis under a multisine, with effects and noise on its encoders.
fn axis(kind: Kind, samples: usize, periods: usize, settings: &Settings, sigma: f64) -> Columns {
    let dt = 1e-3;
    let high = (samples as f64 * dt * 90.0) as usize;
    let torque = Multisine::new(kind, samples, 1, high, 0.03, 0.0, 5).unwrap().period().repeat(periods);
    let options = SimulateOptions { start: 0.0, dt, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 4 };
    let run = simulate(&Parameters::PAPER, Structure::TwoInertia, settings, [0.0; 4], &torque, &options);
    let mut e = noise(3, 1.0);
    let mut of = |f: &dyn Fn(usize) -> f64, size: f64| (0..torque.len()).map(|k| f(k) + size * e()).collect::<Vec<_>>();
    let r = &run.readings;
    let columns = [
        of(&|k| r[k].theta1, sigma),
        of(&|k| r[k].omega1, 50.0 * sigma),
        of(&|k| r[k].theta2, sigma),
        of(&|k| r[k].omega2, 50.0 * sigma),
    ];
    let [a, b, c, d] = columns;
    Columns { dt, v: [torque, a, b, c, d] }
}

fn plain() -> Columns {
    axis(Kind::RandomPhase, 4096, 2, &Settings::default(), 1e-4)
}

fn refused(input: &Input<'_>) -> Vec<&'static str> {
    let found = examine(input);
    found.findings.iter().filter(|f| f.severity == Severity::Refuse).map(|f| f.id).collect()
}

fn sound(input: &Input<'_>, name: &str) {
    let found = examine(input);
    assert!(!found.refuses(), "{name}: {:#?}", found.findings);
}
