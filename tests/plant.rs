//! Every effect of the crate against an independent plant: explicit Runge-Kutta with fine sub-steps, bristle friction, flank
//! contact and continuous-time delays. The oracle and its script: `tests/plant/oracle.txt`, `scripts/blind/oracle.py`. Beside it
//! scipy's integrator with events, from the effects' equations: `scripts/oracles/further_effects.txt` and `.py`.

#![allow(clippy::unwrap_used, reason = "a test that cannot read its oracle has failed")]

use eixo::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate, substeps};
use eixo::effects::{EFFECTS, Effect, Settings};

const SAMPLES: usize = 1024;
const EVERY: usize = 32;

struct Case {
    effect: Effect,
    axis: String,
    parameters: Parameters,
    effects: Settings,
    torque: Vec<f64>,
    w0: f64,
    dt: f64,
    hold: Hold,
    /// theta1, theta2 with the effect and without, every `EVERY`th sample.
    rows: Vec<[f64; 4]>,
}

fn cases() -> Vec<Case> {
    let texts = [include_str!("plant/oracle.txt"), include_str!("../scripts/oracles/further_effects.txt")];
    let mut lines = texts.iter().flat_map(|text| text.lines()).filter(|l| !l.starts_with('#'));
    let mut out = Vec::new();
    while let Some(head) = lines.next() {
        let f: Vec<&str> = head.split(' ').collect();
        let n: Vec<f64> = f[3..13].iter().map(|x| x.parse().unwrap()).collect();
        let [dt, i1, i2, b, k, amplitude, a, bb, c, w0] = n[..] else { panic!("{head}") };
        let effect = Effect::from_id(f[0]).unwrap();
        let mut effects = Settings::default();
        for pair in &f[13..] {
            let (name, value) = pair.split_once('=').unwrap();
            effects.of_mut(effect)[effect.parameter(name).unwrap()] = value.parse().unwrap();
        }
        let torque = (0..SAMPLES)
            .map(|k| k as f64 * dt)
            .map(|t| amplitude * ((a * t).sin() + 0.7 * (bb * t).sin() + 0.5 * (c * t).sin()))
            .collect();
        let rows = (0..SAMPLES / EVERY)
            .map(|_| {
                let row: Vec<f64> = lines.next().unwrap().split(' ').map(|x| x.parse().unwrap()).collect();
                [row[0], row[1], row[2], row[3]]
            })
            .collect();
        out.push(Case {
            effect,
            axis: f[1].to_owned(),
            parameters: Parameters { i1, i2, b, k, rho: 1.0 },
            effects,
            torque,
            w0,
            dt,
            hold: if f[2] == "zoh" { Hold::Zoh } else { Hold::Linear },
            rows,
        });
    }
    out
}

/// Rms error against the plant and rms of what the effect adds, both encoders together, rad.
fn error_and_size(case: &Case, finer: usize) -> (f64, f64) {
    let structure = Structure::TwoInertia;
    let options = SimulateOptions {
        start: 0.0,
        dt: case.dt,
        hold: case.hold,
        scheme: Scheme::Exact,
        substeps: finer * substeps(&case.parameters, structure, &case.effects, case.dt),
    };
    let initial = [0.0, case.w0, 0.0, case.w0];
    let got = simulate(&case.parameters, structure, &case.effects, initial, &case.torque, &options).readings;
    let (mut error, mut size) = (0.0, 0.0);
    for (r, row) in got.iter().step_by(EVERY).zip(&case.rows) {
        error += (r.theta1 - row[0]).powi(2) + (r.theta2 - row[1]).powi(2);
        size += (row[0] - row[2]).powi(2) + (row[1] - row[3]).powi(2);
    }
    let n = 2.0 * case.rows.len() as f64;
    ((error / n).sqrt(), (size / n).sqrt())
}

#[test]
fn the_oracle_has_every_effect_on_both_axes() {
    let cases = cases();
    for &effect in EFFECTS {
        for axis in ["seed", "ballscrew"] {
            assert!(cases.iter().any(|c| c.effect == effect && c.axis == axis), "{} {axis}", effect.info().id);
        }
    }
}

/// What the plant itself is good for, relative to the effect: a bristle breaks away over some 1e-7 rad, a Coulomb level at once.
fn plant_error(effect: Effect) -> f64 {
    match effect {
        Effect::CoulombMotor | Effect::CoulombTable | Effect::FrictionDrift => 1e-3,
        _ => 2e-4,
    }
}

#[test]
fn with_fine_steps_every_effect_adds_what_the_independent_plant_says() {
    for case in cases() {
        let (error, size) = error_and_size(&case, 8);
        let share = error / size;
        assert!(share < plant_error(case.effect), "{} {}: {share:e}", case.effect.info().id, case.axis);
    }
}

#[test]
fn with_its_own_steps_every_effect_is_right_to_a_third_of_a_percent_of_itself() {
    for case in cases() {
        let (error, size) = error_and_size(&case, 1);
        // A ramp that crosses the limit within a step is clipped at the step's ends only.
        let limit = if case.effect == Effect::Saturation && case.hold == Hold::Linear { 0.02 } else { 1.0 / 300.0 };
        assert!(error / size < limit, "{} {}: {:e}", case.effect.info().id, case.axis, error / size);
    }
}
