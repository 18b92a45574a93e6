//! What the logger or the drive did to a record: rows dropped, a torque clipped, a drive switched off, columns in turns.

use super::slow::slow_moves;
use super::*;

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
    // The same beside an encoder's noise of more than the fiftieth of a block's way that is rest without any.
    let mut e = noise(5, 4e-3);
    let noisy: Vec<f64> = x1.iter().map(|x| x + e()).collect();
    let found = examine(&Input { theta1: Some(&noisy), ..input });
    assert!(found.find("drive_off").is_some_and(|f| f.samples > 3500), "{:#?}", found.findings);
    // A drive that holds a torque against the friction is on.
    let holding: Vec<f64> = torque.iter().enumerate().map(|(k, t)| if k < 8000 { *t } else { 0.01 }).collect();
    let found = examine(&Input { torque: Some(&holding), ..input });
    assert!(found.find("drive_off").is_none() && found.find("standing").is_some(), "{:#?}", found.findings);
}

#[test]
fn a_weight_that_swings_on_while_the_drive_is_off_is_left_out_and_a_torque_that_stands_there_is_refused() {
    let dt = 1e-3;
    let settings = effect("gravity", &[("sine", 0.02)]);
    let mut torque = Multisine::new(Kind::RandomPhase, 4000, 1, 30, 0.005, 0.0, 5).unwrap().period().repeat(2);
    torque.extend(vec![0.0; 4000]);
    let options = SimulateOptions { start: 0.0, dt, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 4 };
    let run = simulate(&Parameters::PAPER, Structure::Rigid, &settings, [1.0, 0.0, 1.0, 0.0], &torque, &options);
    let mut e = noise(4, 1e-5);
    let x: Vec<f64> = run.readings.iter().map(|r| r.theta1 + e()).collect();
    let input = Input { dt, torque: Some(&torque), theta1: Some(&x), ..Input::default() };
    let found = examine(&input);
    assert!(!found.refuses(), "{:#?}", found.findings);
    let off = found.find("drive_off").expect("it swings on");
    assert!(off.severity == Severity::Warn && off.samples == 4000, "{off:?}");
    assert!(off.seen.starts_with("T is zero for 4000 samples (33.3 % of the record)"), "{}", off.seen);
    assert!(found.longest().is_some_and(|r| r.end <= 8000), "{:?}", found.longest());
    let standing: Vec<f64> = torque.iter().enumerate().map(|(k, t)| if k < 8000 { *t } else { 0.005 }).collect();
    let found = examine(&Input { torque: Some(&standing), ..input });
    assert!(found.refuses() && found.find("stuck").is_some(), "{:#?}", found.findings);
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
