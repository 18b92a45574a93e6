//! Sound records pass, broken ones are refused by the name of their defect.

use std::path::PathBuf;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::motor_side::feels_the_table;
use super::*;
use crate::axis::{Hold, Scheme, SimulateOptions, simulate};
use crate::effects::{EFFECTS, Effect, Settings};
use crate::identify::excitation::{Kind, Multisine};
use crate::trace::{Column, Machine, Mapping, Signal, load};

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
fn a_drive_switched_off_for_the_last_third_is_found_and_left_out() {
    let settings = effect("coulomb_motor", &[("level", 0.004)]);
    let dt = 1e-3;
    let mut torque = Multisine::new(Kind::RandomPhase, 4000, 1, 300, 0.03, 0.0, 5).unwrap().period().repeat(2);
    torque.extend(vec![0.0; 4000]);
    let options = SimulateOptions { start: 0.0, dt, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 4 };
    let run = simulate(&Parameters::PAPER, Structure::TwoInertia, &settings, [0.0; 4], &torque, &options);
    let mut e = noise(4, 1e-6);
    let x1: Vec<f64> = run.readings.iter().map(|r| r.theta1 + e()).collect();
    let x2: Vec<f64> = run.readings.iter().map(|r| r.theta2 + e()).collect();
    let input = Input { dt, torque: Some(&torque), theta1: Some(&x1), theta2: Some(&x2), ..Input::default() };
    let found = examine(&input);
    assert!(!found.refuses(), "{:#?}", found.findings);
    assert!(found.find("drive_off").is_some(), "{:#?}", found.findings);
    let longest = found.longest().unwrap();
    assert!(longest.start == 0 && (7900..8600).contains(&longest.end), "{longest:?}");
    // A drive that holds a torque against the friction is on.
    let holding: Vec<f64> = torque.iter().enumerate().map(|(k, t)| if k < 8000 { *t } else { 0.01 }).collect();
    let found = examine(&Input { torque: Some(&holding), ..input });
    assert!(found.find("drive_off").is_none() && found.find("standing").is_some(), "{:#?}", found.findings);
}

#[test]
fn samples_that_are_missing_under_even_stamps_are_found_where_the_axis_moves_and_a_jump_of_one_encoder_is_none() {
    let whole = plain();
    let speed = |k: usize| (whole.v[3][k] - whole.v[3][k - 1]).abs();
    let fast = robust::quantile((1..8192).map(speed), 0.9);
    // Rows in fast motion, far from each other, with so many missing before them.
    let mut lost: Vec<(usize, usize)> = Vec::new();
    for missing in [1, 1, 2, 1, 4] {
        let from = lost.last().map_or(200, |(k, _)| k + 900);
        lost.push(((from..8192).find(|k| speed(*k) > fast && speed(*k + missing) > fast).unwrap(), missing));
    }
    let without = |lost: &[(usize, usize)]| {
        let mut c = whole.clone();
        let there = |k: &usize| !lost.iter().any(|(first, count)| (*first..first + count).contains(k));
        for (column, all) in c.v.iter_mut().zip(&whole.v) {
            *column = (0..all.len()).filter(there).map(|k| all[k]).collect();
        }
        c
    };
    let broken = without(&lost);
    for input in [broken.positions(), broken.motor_only(), Input { theta1: None, ..broken.positions() }] {
        let found = examine(&input);
        let slips = found.find("lost_samples").expect("they are found");
        assert_eq!((slips.severity, slips.stretches.len()), (Severity::Refuse, 5), "{slips:?}");
        assert!(slips.seen.starts_with("9 samples are missing"), "{}", slips.seen);
        let mut before = 0;
        for ((first, missing), at) in lost.iter().zip(&slips.stretches) {
            assert!(at.start.abs_diff(first - before) <= 2, "{first} - {before}: {at:?}");
            before += missing;
        }
    }
    // One place alone is no logger that drops rows.
    let one = examine(&without(&lost[..1]).positions());
    let slip = one.find("lost_samples").expect("it is found");
    assert_eq!(slip.severity, Severity::Warn, "{slip:?}");
    assert!(slip.seen.starts_with("1 sample is missing under even time stamps, at 1 place,"), "{}", slip.seen);
    sound(&whole.positions(), "nothing is missing");
    // Counts that one encoder lost are as much as a sample of the motion now and then; the other has not moved.
    let mut jumped = whole.clone();
    let (k, _) = lost[0];
    let size = jumped.v[1][k] - jumped.v[1][k - 1];
    jumped.v[1][k..].iter_mut().for_each(|v| *v += size);
    assert!(examine(&jumped.positions()).find("lost_samples").is_none());
}

#[test]
fn many_samples_in_a_row_that_are_missing_under_even_stamps_are_found_and_counted() {
    let c = slow_moves();
    for missing in [6, 9, 15, 24] {
        let mut broken = c.clone();
        // The later first, so that the earlier rows keep their numbers.
        for first in [1650, 1150, 700, 180] {
            broken.v.iter_mut().filter(|v| !v.is_empty()).for_each(|v| drop(v.drain(first..first + missing)));
        }
        for input in [broken.positions(), broken.motor_only()] {
            let found = examine(&input);
            let slips = found.find("lost_samples").unwrap_or_else(|| panic!("{missing}: {:#?}", found.findings));
            assert_eq!((slips.severity, slips.stretches.len()), (Severity::Refuse, 4), "{missing}: {slips:?}");
            assert!(slips.seen.starts_with(&format!("{} samples are missing", 4 * missing)), "{}", slips.seen);
        }
    }
    assert!(examine(&c.positions()).find("lost_samples").is_none());
}

#[test]
fn a_torque_that_the_log_clipped_is_refused_and_one_that_the_drive_limited_is_not() {
    let coulomb = effect("coulomb_motor", &[("level", 0.002)]);
    for settings in [Settings::default(), coulomb] {
        let free = axis(Kind::RandomPhase, 4096, 2, &settings, 2e-6);
        let largest = free.v[0].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for share in [0.5, 0.7] {
            let limit = share * largest;
            let mut clipped = free.clone();
            clipped.v[0].iter_mut().for_each(|t| *t = t.clamp(-limit, limit));
            let mut below = free.clone();
            below.v[0].iter_mut().for_each(|t| *t = t.min(limit));
            for record in [&clipped, &below] {
                for input in [record.positions(), record.motor_only()] {
                    let found = examine(&input);
                    let seen = found.find("clipped").expect("it stands at its ends");
                    assert_eq!(seen.severity, Severity::Refuse, "{share}: {seen:?}");
                }
            }
            // The drive's own limit: the axis felt what was logged.
            let mut settings = settings;
            let saturation = Effect::from_id("saturation").unwrap();
            settings.of_mut(saturation)[saturation.parameter("limit").unwrap()] = limit;
            let mut limited = axis(Kind::RandomPhase, 4096, 2, &settings, 2e-6);
            limited.v[0].iter_mut().for_each(|t| *t = t.clamp(-limit, limit));
            for input in [limited.positions(), limited.motor_only()] {
                let found = examine(&input);
                assert!(!found.refuses(), "{share}: {:#?}", found.findings);
                assert_eq!(found.find("clipped").map(|f| f.severity), Some(Severity::Note), "{share}");
            }
        }
    }
}

#[test]
fn a_torque_that_stands_at_its_ends_most_of_the_time_is_told_with_its_samples_and_one_of_a_few_levels_is_not() {
    let free = axis(Kind::RandomPhase, 4096, 2, &Settings::default(), 2e-6);
    let mut sizes: Vec<f64> = free.v[0].iter().map(|t| t.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    for share in [0.6, 0.8, 0.95] {
        let limit = sizes[((1.0 - share) * sizes.len() as f64) as usize];
        let at_end = free.v[0].iter().filter(|t| t.abs() >= limit).count();
        let mut clipped = free.clone();
        clipped.v[0].iter_mut().for_each(|t| *t = t.clamp(-limit, limit));
        for input in [clipped.positions(), clipped.motor_only()] {
            let found = examine(&input);
            let seen = found.find("clipped").expect("it stands at its ends");
            assert!(seen.severity <= Severity::Warn && !seen.stretches.is_empty(), "{share}: {seen:?}");
            // Stretches of less than three samples are chance.
            assert!(seen.samples <= at_end && seen.samples as f64 > 0.8 * at_end as f64, "{share}: {seen:?}");
        }
        let mut levels = free.clone();
        let step = limit / 3.0;
        levels.v[0].iter_mut().for_each(|t| *t = (t.clamp(-limit, limit) / step).round() * step);
        assert!(examine(&levels.positions()).find("clipped").is_none(), "{share}");
    }
}

/// Slow triangles under control, with an encoder whose noise from sample to sample is as large as the motion.
#[test]
fn a_drive_switched_off_after_a_slow_motion_is_no_stuck_sensor_and_its_table_is_no_foreign_one() {
    let (dt, n) = (1e-3, 3000);
    let (mut e1, mut e2) = (noise(1, 6e-4), noise(2, 6e-4));
    let inertia = Parameters::PAPER.i1 + Parameters::PAPER.i2;
    let (gain, damping) = (inertia * 900.0, inertia * 42.0);
    let wanted = |k: usize| 0.2 * ((k.min(2 * n / 3) as f64 * dt).rem_euclid(1.0) - 0.5).abs();
    let (mut x, mut v, mut before) = (wanted(0), 0.0, wanted(0));
    let (mut torque, mut x1, mut x2) = (vec![], vec![], vec![]);
    for k in 0..n {
        let seen = x + e1();
        x1.push(seen);
        x2.push(x + e2());
        let t = if k < 2 * n / 3 { gain * (wanted(k) - seen) - damping * (seen - before) / dt } else { 0.0 };
        before = seen;
        torque.push(t);
        v = if k < 2 * n / 3 { v + t / inertia * dt } else { 0.9 * v };
        x += v * dt;
    }
    let input = Input { dt, torque: Some(&torque), theta1: Some(&x1), theta2: Some(&x2), ..Input::default() };
    let found = examine(&input);
    assert!(found.find("stuck").is_none() && found.find("foreign").is_none(), "{:#?}", found.findings);
}

#[test]
fn the_inertia_of_a_pendulum_under_friction_is_read_from_a_few_slow_swings() {
    let (dt, n) = (5e-3, 1200);
    let (inertia, weight, friction) = (7.0, 470.0, 60.0);
    let mut e = noise(3, 2e-4);
    let motion =
        |t: f64| (1.1 * (2.1 * t).sin() + 0.5 * (5.3 * t).sin(), 2.31 * (2.1 * t).cos() + 2.65 * (5.3 * t).cos());
    let acceleration = |t: f64| -4.851 * (2.1 * t).sin() - 14.045 * (5.3 * t).sin();
    let at = |k: usize| k as f64 * dt;
    let x: Vec<f64> = (0..n).map(|k| motion(at(k)).0 + e()).collect();
    let torque: Vec<f64> = (0..n)
        .map(|k| {
            let (x, v) = motion(at(k));
            inertia * acceleration(at(k)) + weight * x.sin() + friction * v.signum()
        })
        .collect();
    let input = Input { dt, torque: Some(&torque), theta1: Some(&x), ..Input::default() };
    let found = examine(&input);
    // Roughly: a weight that swings 90 degrees is no spring.
    let told = found.inertia.expect("an inertia") / inertia;
    assert!((0.7..1.5).contains(&told), "{told}");
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

/// A record, what is wrong with it, and the id of the finding that must refuse it.
fn broken() -> Vec<(&'static str, Columns, &'static [&'static str])> {
    let base = plain();
    let n = base.v[0].len();
    let other = axis(Kind::Odd, 4096, 2, &Settings::default(), 1e-4);
    let mut e = noise(11, 0.03);
    let mut cases: Vec<(&'static str, Columns, &'static [&'static str])> = Vec::new();
    let mut add = |name, change: &mut dyn FnMut(&mut Columns), ids| {
        let mut c = base.clone();
        change(&mut c);
        cases.push((name, c, ids));
    };
    add("dead torque", &mut |c| c.v[0].fill(0.0), &["constant"]);
    add("dead theta1", &mut |c| c.v[1].fill(0.3), &["constant"]);
    add("dead omega2", &mut |c| c.v[4].fill(0.0), &["constant"]);
    add("dead theta2", &mut |c| c.v[3].fill(0.0), &["constant"]);
    add(
        "stuck theta1",
        &mut |c| {
            let v = c.v[1][3000];
            c.v[1][3000..4500].fill(v)
        },
        &["stuck"],
    );
    add(
        "stuck theta2 to the end",
        &mut |c| {
            let v = c.v[3][5000];
            c.v[3][5000..].fill(v)
        },
        &["stuck"],
    );
    add(
        "stuck omega1",
        &mut |c| {
            let v = c.v[2][2000];
            c.v[2][2000..4000].fill(v)
        },
        &["stuck", "foreign"],
    );
    add(
        "stuck torque",
        &mut |c| {
            let v = c.v[0][2000];
            c.v[0][2000..5000].fill(v)
        },
        &["stuck"],
    );
    add(
        "encoders exchanged",
        &mut |c| {
            c.v.swap(1, 3);
            c.v.swap(2, 4)
        },
        &["swapped"],
    );
    add("angle and speed exchanged", &mut |c| c.v.swap(1, 2), &["swapped", "foreign"]);
    add("speeds exchanged", &mut |c| c.v.swap(2, 4), &["swapped", "foreign", "sign"]);
    add("torque turned", &mut |c| c.v[0].iter_mut().for_each(|v| *v = -*v), &["sign"]);
    add("theta2 turned", &mut |c| c.v[3].iter_mut().for_each(|v| *v = -*v), &["sign"]);
    add("omega1 turned", &mut |c| c.v[2].iter_mut().for_each(|v| *v = -*v), &["sign"]);
    add("foreign torque", &mut |c| c.v[0].clone_from(&other.v[0]), &["not_followed"]);
    add("white torque", &mut |c| c.v[0] = (0..n).map(|_| e()).collect(), &["not_followed"]);
    add("torque reversed in time", &mut |c| c.v[0].reverse(), &["not_followed"]);
    add("foreign theta2", &mut |c| c.v[3].clone_from(&other.v[3]), &["foreign"]);
    add("degrees", &mut |c| [1, 3].iter().for_each(|k| c.v[*k].iter_mut().for_each(|v| *v *= 57.295_78)), &["units"]);
    add(
        "all in degrees",
        &mut |c| c.v[1..].iter_mut().for_each(|c| c.iter_mut().for_each(|v| *v *= 57.295_78)),
        &["units"],
    );
    add("one angle in degrees", &mut |c| c.v[3].iter_mut().for_each(|v| *v *= 57.295_78), &["units"]);
    add("mN.m", &mut |c| c.v[0].iter_mut().for_each(|v| *v *= 1e3), &["units"]);
    add("milliseconds", &mut |c| c.dt = 1.0, &["units"]);
    add(
        "turns",
        &mut |c| c.v[1..].iter_mut().for_each(|c| c.iter_mut().for_each(|v| *v /= std::f64::consts::TAU)),
        &["units"],
    );
    add("omega in rpm", &mut |c| c.v[2].iter_mut().for_each(|v| *v *= 9.5493), &["units"]);
    add("theta1 jumps", &mut |c| c.v[1][4000..].iter_mut().for_each(|v| *v += 2.0), &["jump"]);
    add("theta1 within a turn", &mut |c| c.v[1].iter_mut().for_each(|v| *v = v.rem_euclid(1.0)), &["wrapped"]);
    add("torque late", &mut |c| c.v[0].rotate_right(12), &["misaligned"]);
    add("1e308", &mut |c| c.v[1][17] = 1e308, &["magnitude"]);
    add("dt of 1e300", &mut |c| c.dt = 1e300, &["interval"]);
    add(
        "the motor's encoder twice, the second time a cycle later and in another unit",
        &mut |c| {
            c.v[3] = c.v[1].iter().map(|v| 0.5 * v - 1.0).collect();
            c.v[3].rotate_right(2);
            (0..2).for_each(|k| c.v[3][k] = c.v[3][2]);
        },
        &["copy"],
    );
    add("the motor's angle as torque", &mut |c| c.v[0] = c.v[1].iter().map(|v| -3.0 * v).collect(), &["copy"]);
    add(
        "the motor's speed by differences as torque",
        &mut |c| {
            let x = c.v[1].clone();
            (1..n - 1).for_each(|k| c.v[0][k] = x[k + 1] - x[k - 1]);
            (c.v[0][0], c.v[0][n - 1]) = (0.0, 0.0);
        },
        &["copy"],
    );
    add(
        "an inertia times the second differences of the motor's angle as torque",
        &mut |c| {
            let x = c.v[1].clone();
            (1..n - 1).for_each(|k| c.v[0][k] = 2.4e2 * (x[k + 1] - 2.0 * x[k] + x[k - 1]));
            (c.v[0][0], c.v[0][n - 1]) = (0.0, 0.0);
        },
        &["computed"],
    );
    add("counts as angle", &mut |c| c.v[1].iter_mut().for_each(|v| *v = (*v * 1e9).round()), &["magnitude"]);
    cases
}

#[test]
fn a_broken_record_is_refused_by_the_name_of_its_defect() {
    let mut missed = Vec::new();
    for (name, columns, ids) in broken() {
        let found = refused(&Input { nominal: Some(NOMINAL), ..columns.input() });
        if !found.iter().any(|id| ids.contains(id)) {
            missed.push(format!("{name}: {found:?}, not {ids:?}"));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn a_table_that_counts_the_other_way_or_in_degrees_is_found_in_a_record_of_one_period_too() {
    let sound = axis(Kind::Schroeder, 2048, 1, &Settings::default(), 1e-4);
    let found = |by: f64| {
        let mut columns = sound.clone();
        columns.v[3].iter_mut().for_each(|v| *v *= by);
        refused(&Input { nominal: Some(NOMINAL), ..columns.positions() })
    };
    assert_eq!(found(1.0), [""; 0]);
    assert!(found(-1.0).contains(&"sign"), "{:?}", found(-1.0));
    assert!(found(57.3).contains(&"units"), "{:?}", found(57.3));
}

#[test]
fn a_table_that_goes_five_times_as_far_as_its_motor_is_refused_and_one_that_goes_half_as_far_told() {
    for (factor, severity) in [(5.0, Severity::Refuse), (0.5, Severity::Warn)] {
        let mut c = plain();
        c.v[3].iter_mut().for_each(|v| *v *= factor);
        let found = examine(&Input { nominal: Some(NOMINAL), ..c.positions() });
        assert_eq!(found.find("scale").map(|f| f.severity), Some(severity), "{factor}: {:#?}", found.findings);
    }
}

#[test]
fn the_twist_in_the_tables_place_is_found_either_way_round_and_whatever_acts_on_the_table() {
    for settings in [
        Settings::default(),
        effect("coulomb_table", &[("level", 0.002)]),
        effect("coulomb_motor", &[("level", 0.002)]),
    ] {
        for sign in [1.0, -1.0] {
            let mut c = axis(Kind::RandomPhase, 4096, 2, &settings, 1e-5);
            c.v[3] = c.v[1].iter().zip(&c.v[3]).map(|(a, b)| sign * (a - b)).collect();
            let found = examine(&Input { nominal: Some(NOMINAL), ..c.positions() });
            let finding = found.find("twist").unwrap_or_else(|| panic!("{sign}: {:#?}", found.findings));
            assert_eq!(finding.severity, Severity::Refuse);
            let way_out = if sign > 0.0 { "theta1 less it" } else { "theta1 plus it" };
            assert!(finding.remedy.contains(way_out), "{sign}: {finding:#?}");
        }
    }
}

#[test]
fn two_encoders_that_take_turns_in_one_column_are_found() {
    for turns in [2, 5] {
        let mut c = plain();
        let table = c.v[3].clone();
        c.v[1].iter_mut().zip(table).step_by(turns).for_each(|(v, w)| *v = w);
        for nominal in [None, Some(NOMINAL)] {
            assert_eq!(refused(&Input { nominal, ..c.positions() }), ["copy"], "{turns}");
        }
    }
}

#[test]
fn a_table_that_friction_holds_has_no_broken_encoder_and_one_that_moves_has() {
    let held = axis(Kind::Schroeder, 4096, 4, &effect("coulomb_table", &[("level", 0.05)]), 1e-5);
    let looked_at = |columns: &Columns| refused(&Input { nominal: Some(NOMINAL), ..columns.positions() });
    assert_eq!(looked_at(&held), [""; 0]);
    let mut dead = axis(Kind::Schroeder, 4096, 4, &Settings::default(), 1e-5);
    dead.v[3].clone_from(&held.v[3]);
    assert!(looked_at(&dead).contains(&"foreign"), "{:?}", looked_at(&dead));
}

#[test]
fn what_moves_the_table_beside_its_coupling_is_no_unit_and_no_sign() {
    // A light table on a soft coupling, on which a weight above its hinge pulls nearly as hard as the coupling holds it: slowly it goes
    // seven times as far as the motor, which friction brakes.
    let p = Parameters { i1: 2.4e-4, i2: 6e-6, b: 5.5e-4, k: 0.0176, rho: 1.0 };
    let nominal = Some(Nominal { structure: Structure::TwoInertia, parameters: p });
    let looked_at = |x: &Columns| refused(&Input { nominal, ..x.positions() });
    let (dt, far) = (2e-3, 7.0);
    let parts: Vec<(f64, f64, f64)> =
        (1..30).map(f64::from).map(|i| (0.02 / i.powf(1.5), 2.0 * i, 1.3 * i * i)).collect();
    let of = |t: f64, n: i32| -> f64 { parts.iter().map(|(a, w, p)| a * w.powi(n) * (w * t + p).sin()).sum() };
    let rate = |t: f64| -> f64 { parts.iter().map(|(a, w, p)| a * w * (w * t + p).cos()).sum() };
    let mut e = noise(41, 1e-5);
    let mut columns = Columns { dt, v: Default::default() };
    for k in 0..8192_u32 {
        let t = f64::from(k) * dt;
        let twisted = (1.0 - far) * (p.k * of(t, 0) + p.b * rate(t));
        columns.v[0].push(-p.i1 * of(t, 2) + twisted + 0.002 * rate(t).signum());
        columns.v[1].push(of(t, 0) + e());
        columns.v[3].push(far * of(t, 0) + e());
    }
    assert_eq!(looked_at(&columns), [""; 0]);
    // The same where the table goes with the motor and is logged in degrees.
    for k in 0..8192_u32 {
        let t = f64::from(k) * dt;
        columns.v[0][k as usize] -= (1.0 - far) * (p.k * of(t, 0) + p.b * rate(t));
        columns.v[3][k as usize] = of(t, 0).to_degrees() + e();
    }
    assert_eq!(looked_at(&columns), ["units"]);
}

#[test]
fn a_torque_on_the_table_that_the_drive_brakes_is_no_sign_turned_round() {
    let p = Parameters::PAPER;
    let (dt, inertia) = (1e-3, p.i1 + p.i2);
    let parts: Vec<(f64, f64, f64)> = (1..30).map(f64::from).map(|i| (0.5 / i.powi(2), 2.0 * i, 1.3 * i * i)).collect();
    let way = |t: f64| -> f64 { parts.iter().map(|(a, w, p)| a * (w * t + p).sin()).sum() };
    let rate = |t: f64| -> f64 { -parts.iter().map(|(a, w, p)| a * w * w * (w * t + p).sin()).sum::<f64>() };
    let logged = |foreign: f64| {
        let mut e = noise(43, 1e-7);
        let mut columns = Columns { dt, v: Default::default() };
        for k in 0..8192_u32 {
            let t = f64::from(k) * dt;
            // The foreign torque moves so many times the axis' inertia; the drive holds the rest of it back.
            columns.v[0].push((1.0 - foreign) * inertia * rate(t));
            columns.v[1].push(way(t) + e());
            columns.v[3].push(way(t) - (p.i2 - foreign * inertia) * rate(t) / p.k + e());
        }
        columns
    };
    let looked_at = |x: &Columns| refused(&Input { nominal: Some(NOMINAL), ..x.positions() });
    assert_eq!(looked_at(&logged(0.0)), [""; 0]);
    assert_eq!(looked_at(&logged(2.5)), [""; 0]);
    let mut turned = logged(0.0);
    turned.v[0].iter_mut().for_each(|t| *t = -*t);
    assert_eq!(looked_at(&turned), ["sign"]);
}

#[test]
fn a_motor_feels_its_own_table_whatever_swings_that_and_no_other_axis() {
    // A soft coupling: the table hardly shows in what the torque moves.
    let p = Parameters { k: 4.0 * Parameters::PAPER.i1, ..Parameters::PAPER };
    let dt = 1e-3;
    let swings = |seed: u64| -> Vec<[f64; 3]> {
        let mut random = noise(seed, 1.0);
        let parts: Vec<[f64; 2]> = (0..40).map(|_| [random(), random()]).collect();
        let at = |t: f64| {
            parts.iter().fold([0.0; 3], |[x, v, a], [frequency, phase]| {
                let w = 20.0 + 5.0 * frequency;
                let (sin, cos) = (w * t + 9.0 * phase).sin_cos();
                [x + 0.01 * sin, v + 0.01 * w * cos, a - 0.01 * w * w * sin]
            })
        };
        (0..16_384).map(|k| at(f64::from(k) * dt)).collect()
    };
    let (motor, table, another) = (swings(51), swings(52), swings(53));
    let mut e = noise(44, 1e-9);
    let mut columns = Columns { dt, v: Default::default() };
    for ([x1, v1, a1], [x2, v2, _]) in motor.iter().zip(&table) {
        columns.v[0].push(p.i1 * a1 + p.b * (v1 - v2) + p.k * (x1 - x2));
        columns.v[1].push(x1 + e());
        columns.v[3].push(x2 + e());
    }
    let nominal = Nominal { parameters: p, ..NOMINAL };
    let feels = |x: &Columns| feels_the_table(&Input { nominal: Some(nominal), ..x.positions() });
    assert!(feels(&columns));
    columns.v[3] = another.iter().map(|[x, ..]| x + e()).collect();
    assert!(!feels(&columns));
}

/// Two slow moves to and fro along `s(10 - 15 s + 6 s^2)s^2`, of which averaged spectra show few lines or none, and the torque that the
/// equation of motion gives for them beside Coulomb and viscous friction; noise on both encoders.
fn slow_moves() -> Columns {
    let p = Parameters::PAPER;
    let (dt, duration, way) = (1e-3, 0.5, 1.5);
    let samples = (duration / dt) as usize;
    let inertia = p.i1 + p.i2;
    // The largest torque of acceleration; friction is half of it, the current's noise a hundredth.
    let largest = inertia * 10.0 / 3.0_f64.sqrt() * way / (duration * duration);
    let (mut torque, mut x1) = (Vec::new(), Vec::new());
    let mut e = noise(17, 1e-5);
    let mut of_current = noise(18, 0.01 * largest);
    for (start, sense) in [(0.0, 1.0), (way, -1.0), (0.0, 1.0), (way, -1.0)] {
        for k in 0..samples {
            let s = k as f64 / samples as f64;
            let x = s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
            let v = 30.0 * s * s * (1.0 - s).powi(2) / duration;
            let a = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration.powi(2);
            let of = |y: f64| sense * way * y;
            x1.push(start + of(x));
            torque.push(inertia * of(a) + 0.01 * largest * of(v) + 0.5 * largest * of(v).signum() + of_current());
        }
    }
    let x2 = x1.iter().map(|x| x + e()).collect();
    let x1 = x1.iter().map(|x| x + e()).collect();
    Columns { dt, v: [torque, x1, Vec::new(), x2, Vec::new()] }
}

#[test]
fn a_torque_that_friction_and_inertia_explain_in_time_is_followed_and_another_is_not() {
    // Noise of the encoder from sample to sample as large as the motion: a few lines stand above it.
    let mut e = noise(23, 2e-3);
    let mut columns = slow_moves();
    columns.v[1].iter_mut().for_each(|x| *x += e());
    assert!(rigid::follows(&columns.motor_only()));
    let own = columns.v[0].clone();
    columns.v[0].iter_mut().for_each(|t| *t = -*t);
    assert!(!rigid::follows(&columns.motor_only()), "it brakes the wrong way");
    let n = own.len();
    columns.v[0] = (0..n).map(|k| own[(k + n / 8) % n]).collect();
    assert!(!rigid::follows(&columns.motor_only()), "an eighth of the record late");
}

#[test]
fn a_weight_that_pushes_away_from_rest_is_followed_without_friction_and_one_turned_round_is_not() {
    // On a hinge, half a turn about where the weight stands above the axis.
    let (inertia, weight) = (0.1, 2.0);
    let parts = [(0.6, 3.0, 0.0), (0.3, 7.0, 1.0)];
    let time = |k: usize| k as f64 * 2e-3;
    let mut e = noise(29, 3e-4);
    let at = |k: usize| parts.iter().map(|(a, w, p)| a * (w * time(k) + p).sin()).sum::<f64>();
    let rate = |k: usize| -parts.iter().map(|(a, w, p)| a * w * w * (w * time(k) + p).sin()).sum::<f64>();
    let torque = (0..1024).map(|k| inertia * rate(k) - weight * at(k).sin()).collect();
    let x1 = (0..1024).map(|k| at(k) + e()).collect();
    let mut columns = Columns { dt: 2e-3, v: [torque, x1, Vec::new(), Vec::new(), Vec::new()] };
    assert!(rigid::follows(&columns.motor_only()));
    columns.v[0].iter_mut().for_each(|t| *t = -*t);
    assert!(!rigid::follows(&columns.motor_only()), "its inertia is none");
}

#[test]
fn slow_moves_under_friction_tell_sign_and_unit_of_torque_and_table() {
    let looked_at = |change: &dyn Fn(&mut Columns)| {
        let mut columns = slow_moves();
        change(&mut columns);
        let two = Input { nominal: Some(NOMINAL), ..columns.positions() };
        let rigid = Nominal { structure: Structure::Rigid, ..NOMINAL };
        let one = Input { nominal: Some(rigid), ..columns.motor_only() };
        [refused(&two), refused(&one)]
    };
    let torque = |by: f64| looked_at(&|c| c.v[0].iter_mut().for_each(|t| *t *= by));
    let table = |by: f64| looked_at(&|c| c.v[3].iter_mut().for_each(|x| *x *= by))[0].clone();
    assert_eq!(torque(1.0), [Vec::<&str>::new(), Vec::new()]);
    assert_eq!(torque(-1.0), [["sign"], ["sign"]]);
    for by in [1000.0, 1e-3, 57.3, 8.0 * std::f64::consts::PI] {
        assert_eq!(torque(by), [["units"], ["units"]], "{by}");
    }
    assert_eq!(table(-1.0), ["sign"]);
    assert_eq!(table(57.3), ["units"]);
}
