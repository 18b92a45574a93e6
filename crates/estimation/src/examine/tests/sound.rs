//! Records with nothing wrong: simulated ones with effects, and real ones.

use std::path::PathBuf;

use super::*;
use crate::effects::EFFECTS;
use crate::trace::{Column, Machine, Mapping, Signal, load};

#[test]
fn the_papers_axis_is_sound_with_every_effect_and_few_or_many_channels() {
    for (kind, samples, periods) in [(Kind::Schroeder, 2048, 1), (Kind::RandomPhase, 4096, 2), (Kind::Odd, 1024, 8)] {
        for sigma in [0.0, 1e-5, 1e-3] {
            let c = axis(kind, samples, periods, &Settings::default(), sigma);
            for (input, name) in [(c.input(), "all"), (c.positions(), "positions"), (c.motor_only(), "motor")] {
                for nominal in [None, Some(NOMINAL)] {
                    sound(&Input { nominal, ..input }, &format!("{kind:?} {sigma} {name} {nominal:?}"));
                }
            }
            let table = Input { theta1: None, ..c.positions() };
            sound(&Input { nominal: Some(NOMINAL), ..table }, &format!("{kind:?} {sigma} table"));
        }
    }
    for &one in EFFECTS {
        let info = one.info();
        let mut settings = Settings::default();
        for (k, p) in info.parameters.iter().enumerate() {
            let size = p.off + 0.3 * p.nominal;
            settings.of_mut(one)[k] = size.clamp(p.min, p.max);
        }
        let c = axis(Kind::RandomPhase, 4096, 2, &settings, 1e-5);
        sound(&Input { nominal: Some(NOMINAL), ..c.positions() }, info.id);
    }
}

#[test]
fn friction_quantisation_a_bias_a_dead_end_and_stops_are_no_reason_to_refuse() {
    let coulomb = effect("coulomb_motor", &[("level", 0.02)]);
    let c = axis(Kind::RandomPhase, 4096, 3, &coulomb, 0.0);
    sound(&c.positions(), "friction");
    let rounded = |c: &Columns, step: f64| {
        let mut c = c.clone();
        for k in [1, 3] {
            c.v[k].iter_mut().for_each(|v| *v = (*v / step).round() * step);
        }
        c
    };
    let swing = robust::span(&c.v[1]);
    for steps in [40.0, 400.0, 4e4] {
        sound(&rounded(&c, swing / steps).positions(), &format!("{steps} steps"));
        sound(
            &rounded(&plain(), robust::span(&plain().v[1]) / steps).positions(),
            &format!("{steps} steps, no friction"),
        );
    }
    let mut biased = c.clone();
    biased.v[0].iter_mut().for_each(|v| *v += 0.05);
    biased.v[1].iter_mut().for_each(|v| *v += 40.0);
    sound(&biased.positions(), "bias");
    let mut spiky = plain();
    for k in (100..8000).step_by(371) {
        spiky.v[1][k] += 0.7;
    }
    sound(&spiky.positions(), "spikes");
    assert!(examine(&spiky.positions()).find("spikes").is_some());
    let mut slow = plain();
    for k in [1, 3] {
        slow.v[k] = (0..slow.v[k].len()).map(|i| slow.v[k][i - i % 4]).collect();
    }
    sound(&slow.positions(), "held");
    assert!(examine(&slow.positions()).find("held").is_some());
}

#[test]
fn real_records_are_sound() {
    let Some(data) = crate::skip::traces("") else { return };
    let machine = |name: &str| {
        Machine::read(&PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data").join(name)).unwrap()
    };
    let mapped = |t: &str, x: &str| Mapping {
        time: Column::named("t_s"),
        signals: vec![(Signal::T, Column::named(t)), (Signal::Theta1, Column::named(x))],
        ..Mapping::default()
    };
    let cases = [
        ("emps/train.csv", machine("emps.toml").signals),
        ("two_inertia_bench/schroeder.csv", machine("two_inertia_bench.toml").signals),
        ("qube/prbs_1.csv", mapped("plant_input_V", "theta_rad")),
        ("qube/prbs_2.csv", mapped("plant_input_V", "theta_rad")),
    ];
    for (file, mapping) in cases {
        let trace = load(&data.join(file), &mapping).unwrap().trace;
        let input = Input { motion: mapping.motion, ..Input::of(&trace, None) };
        let found = examine(&input);
        println!("{file}: {:?} {:?}", found.usable, found.band);
        for f in &found.findings {
            println!("   {:?} {} {}", f.severity, f.id, f.sentence());
        }
        assert!(!found.refuses(), "{file}");
    }
}

#[test]
fn a_torque_that_dies_away_to_nothing_is_no_mark_of_a_missing_value() {
    let dying: Vec<f64> = (0..1500).map(|k| 0.9_f64.powi(k)).collect();
    assert!(dying[1499] < 1e-68 && (0..1500).all(|k| !super::super::is_no_reading(&dying, k)));
}
