//! The table's encoder beside the motor's: its sign, its unit, and what moves the table beside the coupling.

use super::*;
use crate::examine::motor_side::{coupling_explains_torque, motor_holds_coupling};

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
fn the_twist_in_the_tables_place_is_found_either_way_round_in_any_unit_and_whatever_acts_on_the_table() {
    for settings in [
        Settings::default(),
        effect("coulomb_table", &[("level", 0.002)]),
        effect("coulomb_motor", &[("level", 0.002)]),
    ] {
        let sound = axis(Kind::RandomPhase, 4096, 2, &settings, 1e-5);
        assert_eq!(refused(&Input { nominal: Some(NOMINAL), ..sound.positions() }), [""; 0]);
        for (multiple, way_out) in [
            (1.0, "theta1 less it."),
            (-1.0, "theta1 plus it."),
            (10.0, "theta1 less 0.1 times it."),
            (-0.1, "theta1 plus 10 times it."),
        ] {
            let mut c = sound.clone();
            c.v[3] = c.v[1].iter().zip(&c.v[3]).map(|(a, b)| multiple * (a - b)).collect();
            let found = examine(&Input { nominal: Some(NOMINAL), ..c.positions() });
            let finding = found.find("twist").unwrap_or_else(|| panic!("{multiple}: {:#?}", found.findings));
            assert_eq!(finding.severity, Severity::Refuse);
            assert!(finding.remedy.contains(way_out), "{multiple}: {finding:#?}");
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
    let feels = |x: &Columns| coupling_explains_torque(&Input { nominal: Some(nominal), ..x.positions() });
    assert!(feels(&columns));
    columns.v[3] = another.iter().map(|[x, ..]| x + e()).collect();
    assert!(!feels(&columns));
}

#[test]
fn a_motor_under_friction_feels_a_table_at_rest_and_no_table_of_another_axis() {
    // The motor goes to and fro slowly; friction and load are most of its torque, and the table rests until the coupling overcomes it.
    let (p, dt, breakaway) = (Parameters::PAPER, 1e-3, 4e-3);
    let parts: Vec<(f64, f64, f64)> = (1..6).map(f64::from).map(|i| (0.3 / i, 1.7 * i, 1.3 * i * i)).collect();
    let of = |t: f64, n: i32| -> f64 { parts.iter().map(|(a, w, p)| a * w.powi(n) * (w * t + p).sin()).sum() };
    let rate = |t: f64| -> f64 { parts.iter().map(|(a, w, p)| a * w * (w * t + p).cos()).sum() };
    let mut e = noise(45, 1e-5);
    let mut columns = Columns { dt, v: Default::default() };
    let (mut table, mut before) = (of(0.0, 0), of(0.0, 0));
    for k in 0..8192_u32 {
        let t = f64::from(k) * dt;
        // Dragged along at the end of what its friction holds.
        let twist = (of(t, 0) - table).clamp(-breakaway / p.k, breakaway / p.k);
        table = of(t, 0) - twist;
        let pull = p.k * twist + p.b * (rate(t) - (table - before) / dt);
        before = table;
        columns.v[0].push(-p.i1 * of(t, 2) + pull + 0.01 * rate(t).signum() + 0.002 * rate(t) + 0.003);
        columns.v[1].push(of(t, 0) + e());
        columns.v[3].push(table + e());
    }
    let feels = |x: &Columns| motor_holds_coupling(&Input { nominal: Some(NOMINAL), ..x.positions() });
    assert!(feels(&columns));
    columns.v[3].reverse();
    assert!(!feels(&columns));
    columns.v[3] = (0..8192).map(|k| 0.3 * (2.9 * f64::from(k) * dt).sin() + e()).collect();
    assert!(!feels(&columns));
}

#[test]
fn a_table_that_moves_only_where_the_coupling_pulls_hardest_is_held_by_friction_though_the_torque_hides_the_pull() {
    // Friction of the motor that grows and falls with the angle is nearly all of its torque.
    let (p, dt, breakaway) = (Parameters::PAPER, 1e-3, 7e-3);
    let parts: Vec<(f64, f64, f64)> = (1..6).map(f64::from).map(|i| (0.3 / i, 1.7 * i, 1.3 * i * i)).collect();
    let of = |t: f64, n: i32| -> f64 { parts.iter().map(|(a, w, p)| a * w.powi(n) * (w * t + p).sin()).sum() };
    let rate = |t: f64| -> f64 { parts.iter().map(|(a, w, p)| a * w * (w * t + p).cos()).sum() };
    let mut e = noise(46, 1e-5);
    let mut columns = Columns { dt, v: Default::default() };
    let mut table = 0.0;
    for k in 0..8192_u32 {
        let t = f64::from(k) * dt;
        let twist = (of(t, 0) - table).clamp(-breakaway / p.k, breakaway / p.k);
        table = of(t, 0) - twist;
        let friction = 0.1 * (1.0 + 0.8 * (9.0 * of(t, 0)).sin()) * rate(t).signum();
        columns.v[0].push(-p.i1 * of(t, 2) + p.k * twist + friction);
        columns.v[1].push(of(t, 0) + e());
        columns.v[3].push(table + e());
    }
    let feels = |x: &Columns| motor_holds_coupling(&Input { nominal: Some(NOMINAL), ..x.positions() });
    assert!(feels(&columns));
    assert!(standing::friction_holds_table(&columns.positions()));
    // Encoders that count from different zeros.
    columns.v[3].iter_mut().for_each(|y| *y += 3.0);
    assert!(standing::friction_holds_table(&columns.positions()));
    columns.v[3].reverse();
    assert!(!standing::friction_holds_table(&columns.positions()));
}

#[test]
fn a_table_that_its_bristles_hold_creeps_with_the_motor_and_is_not_taken_for_the_twist() {
    // A light table held by presliding friction seventy times as stiff as its coupling; slow bows, to and fro, under a motor ruled by a drive.
    let p = Parameters { i1: 2.4e-4, i2: 6e-6, b: 5.5e-4, k: 0.0176, rho: 1.0 };
    let nominal = Some(Nominal { structure: Structure::TwoInertia, parameters: p });
    let (dt, share) = (5.6e-4, 0.0144);
    let looked_at = |noisy: f64| {
        let (mut of_motor, mut of_table) = (noise(47, noisy), noise(48, noisy));
        let mut columns = Columns { dt, v: Default::default() };
        for k in 0..888_u32 {
            let t = f64::from(k) * dt;
            let (x, v, a) = (0.0135 * (1.0 - (14.0 * t).cos()), 0.19 * (14.0 * t).sin(), 2.6 * (14.0 * t).cos());
            columns.v[0].push(p.i1 * a + (1.0 - share) * (p.k * x + p.b * v) + 4e-4 * (97.0 * t).sin());
            columns.v[1].push(x + of_motor());
            columns.v[3].push(share * x + of_table());
        }
        refused(&Input { nominal, ..columns.positions() })
    };
    assert_eq!(looked_at(2e-5), [""; 0]);
    // Without noise nothing is left of it as the table's angle, either.
    assert_eq!(looked_at(1e-9), [""; 0]);
}

#[test]
fn two_encoders_of_an_axis_that_goes_a_million_noises_far_are_no_copies() {
    let (mut of_motor, mut of_table) = (noise(49, 1e-4), noise(50, 1e-4));
    let mut c = Columns { dt: 1e-2, v: Default::default() };
    for k in 0..8192_u32 {
        let t = f64::from(k) * 1e-2;
        let v = 20.0 + 2.0 * (0.7 * t).sin();
        let x = 20.0 * t - 2.0 / 0.7 * (0.7 * t).cos();
        c.v[0].push(2e-4 * v + 1e-3 * (0.7 * t).cos());
        c.v[1].push(x + of_motor());
        c.v[3].push(x + of_table());
    }
    assert!(!refused(&c.positions()).contains(&"copy"), "{:?}", refused(&c.positions()));
    // Nor where the motion itself is fast, beside which their noise is small.
    let mut fast = c.clone();
    for k in 0..8192 {
        let way = 1e-2 * (f64::from(k) * 1.7).sin();
        fast.v[1][k as usize] += way;
        fast.v[3][k as usize] += way;
    }
    assert!(!refused(&fast.positions()).contains(&"copy"), "{:?}", refused(&fast.positions()));
    // The one of them scaled, and written with so few digits that rounding is a tenth of its noise.
    c.v[3] = c.v[1].iter().map(|x| (1e5 * 2.5 * x).round() / 1e5).collect();
    assert!(refused(&c.positions()).contains(&"copy"), "{:?}", refused(&c.positions()));
}
