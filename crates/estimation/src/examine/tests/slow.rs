//! Slow motions, of which averaged spectra show few lines: the balance of torque in the time domain.

use super::*;
use crate::examine::rigid::{EstimatedInertia, inertia_finding};

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
    // A weight that swings 90 degrees is no spring, and over a whole swing its mean is none of the mean angle's.
    let told = found.inertia.expect("an inertia");
    assert!(told.is_shown && (told.value / inertia - 1.0).abs() < 0.05, "{told:?}");
}

#[test]
fn the_inertia_of_an_axis_that_never_goes_back_is_read_from_its_changes_of_speed() {
    let (dt, n) = (1e-3, 800);
    let (inertia, viscous, friction) = (1.7e-4, 5e-4, 2.5e-2);
    let (mut e, mut off) = (noise(7, 2e-4), noise(8, 1e-3));
    // It speeds up by 9 rad/s and slows down by 15.
    let since = |k: usize| ((k as f64 * dt).min(0.3), (k as f64 * dt - 0.3).max(0.0));
    let mut angle = |k: usize| {
        let (up, down) = since(k);
        50.0 * (up + down) + 15.0 * up * up + 9.0 * down - 15.0 * down * down + e()
    };
    let x: Vec<f64> = (0..n).map(&mut angle).collect();
    let mut torque = |k: usize| {
        let (up, down) = since(k);
        let acceleration = if down > 0.0 { -30.0 } else { 30.0 };
        inertia * acceleration + viscous * (50.0 + 30.0 * (up - down)) + friction + off()
    };
    let torque: Vec<f64> = (0..n).map(&mut torque).collect();
    let found = examine(&Input { dt, torque: Some(&torque), theta1: Some(&x), ..Input::default() });
    let told = found.inertia.expect("an inertia");
    assert!(told.is_shown && (told.value / inertia - 1.0).abs() < 0.1, "{told:?}");
}

#[test]
fn a_torque_that_runs_straight_between_samples_is_told_from_one_that_is_held() {
    // A table to and fro under friction, read ten times a move: a torque of its own at each sample, or the mean since the last one.
    let (dt, n, fine) = (1e-2, 800, 20);
    let (inertia, viscous, friction) = (2e-5, 1.2e-4, 1.5e-2);
    let told = |held: bool, late: bool, seed: u64| {
        let mut e = noise(seed, 2e-4);
        let wanted = |t: f64| 1500.0 * (12.0 * t).sin() + 1800.0 * (61.0 * t + 1.0).sin();
        let (mut x, mut v) = (0.0, 0.0);
        let (mut torque, mut angle) = (vec![], vec![]);
        for k in 0..n {
            angle.push(x + e());
            torque.push(inertia * wanted(k as f64 * dt));
            for j in 0..fine {
                let t = (k as f64 + if held { 0.0 } else { f64::from(j) / f64::from(fine) }) * dt;
                let resists = viscous * v + friction * (v / 1.0_f64).tanh();
                v += (wanted(t) - resists / inertia) * dt / f64::from(fine);
                x += v * dt / f64::from(fine);
            }
        }
        // An encoder that is a sample early turns the motion as a torque that runs straight does half of.
        let (torque, angle) = if late { (&torque[..n - 1], &angle[1..]) } else { (&torque[..], &angle[..]) };
        examine(&Input { dt, torque: Some(torque), theta1: Some(angle), ..Input::default() }).runs_straight
    };
    for seed in 0..4 {
        let told = [(false, false), (true, false), (true, true)].map(|(held, late)| told(held, late, seed));
        assert_eq!(told, [true, false, false], "{seed}");
    }
}

#[test]
fn a_soft_coupling_that_turns_the_motion_is_no_torque_that_runs_straight() {
    // The paper's axis, whose table follows late through its coupling: half a sample turns what is slow of the motion by less than that.
    let dt = 5.6e-4;
    let torque = Multisine::in_band(Kind::Schroeder, 8192, dt, 0.2, 40.0, 0.04, 0.0, 5).unwrap().period();
    let options = SimulateOptions { start: 0.0, dt, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 4 };
    let run = simulate(&Parameters::PAPER, Structure::TwoInertia, &Settings::default(), [0.0; 4], &torque, &options);
    let mut e = noise(4, 3e-5);
    let angle: Vec<f64> = run.readings.iter().map(|r| r.theta1 + e()).collect();
    let found = examine(&Input { dt, torque: Some(&torque), theta1: Some(&angle), ..Input::default() });
    assert!(found.inertia.is_some() && !found.runs_straight, "{found:?}");
}

#[test]
fn an_inertia_that_hardly_shows_beside_friction_and_a_foreign_torque_is_a_guess() {
    let (dt, n) = (1e-2, 4000);
    let (inertia, friction, foreign) = (0.1, 4.0, 2.0);
    let mut e = noise(5, 5e-5);
    let at = |k: usize| k as f64 * dt;
    let x: Vec<f64> = (0..n).map(|k| 0.7 * (0.9 * at(k)).sin() + 0.3 * (2.3 * at(k)).sin() + e()).collect();
    let torque: Vec<f64> = (0..n)
        .map(|k| {
            let t = at(k);
            let speed = 0.63 * (0.9 * t).cos() + 0.69 * (2.3 * t).cos();
            let acceleration = -0.567 * (0.9 * t).sin() - 1.587 * (2.3 * t).sin();
            inertia * acceleration + friction * (speed / 0.02).tanh() + foreign * (1.3 * t).sin()
        })
        .collect();
    let found = examine(&Input { dt, torque: Some(&torque), theta1: Some(&x), ..Input::default() });
    let told = found.inertia.expect("a guess");
    assert!(!told.is_shown && (0.1..10.0).contains(&(told.value / inertia)), "{told:?}");
}

/// Two slow moves to and fro along `s(10 - 15 s + 6 s^2)s^2`, of which averaged spectra show few lines or none, and the torque that the
/// equation of motion gives for them beside Coulomb and viscous friction; noise on both encoders.
pub(super) fn slow_moves() -> Columns {
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
    assert!(rigid::explained_in_time(&columns.motor_only()));
    let own = columns.v[0].clone();
    columns.v[0].iter_mut().for_each(|t| *t = -*t);
    assert!(!rigid::explained_in_time(&columns.motor_only()), "it brakes the wrong way");
    let n = own.len();
    columns.v[0] = (0..n).map(|k| own[(k + n / 8) % n]).collect();
    assert!(!rigid::explained_in_time(&columns.motor_only()), "an eighth of the record late");
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
    assert!(rigid::explained_in_time(&columns.motor_only()));
    columns.v[0].iter_mut().for_each(|t| *t = -*t);
    assert!(!rigid::explained_in_time(&columns.motor_only()), "its inertia is none");
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

#[test]
fn a_torque_below_breakaway_is_held_by_friction_and_one_that_the_table_follows_is_not() {
    let (dt, n) = (1e-3, 4096);
    let at = |k: usize| k as f64 * dt;
    let torque: Vec<f64> = (0..n).map(|k| 0.01 * (at(k).rem_euclid(1.0) - 0.5).abs()).collect();
    let mut e = noise(31, 2e-4);
    let x1: Vec<f64> = (0..n).map(|_| e()).collect();
    let x2: Vec<f64> = (0..n).map(|k| 0.05 * (0.9 * at(k)).cos() + e()).collect();
    let input = Input {
        dt,
        torque: Some(&torque),
        theta1: Some(&x1),
        theta2: Some(&x2),
        nominal: Some(NOMINAL),
        ..Input::default()
    };
    assert!(standing::held_share(&input) > 0.99);
    let found = examine(&input);
    assert!(!found.refuses() && found.find("standing").is_some(), "{:#?}", found.findings);
    // What moves the table turned the motor, whose encoder does not tell.
    let follows: Vec<f64> = (0..n).map(|k| 5.0 * torque[k] + e()).collect();
    assert!(standing::held_share(&Input { theta2: Some(&follows), ..input }) <= 0.0);
    // A motor that moves under a torque that is not its own.
    let moves: Vec<f64> = (0..n).map(|k| 0.1 * (7.0 * at(k)).sin() + e()).collect();
    assert!(standing::held_share(&Input { theta1: Some(&moves), theta2: None, ..input }) < 0.2);
}

#[test]
fn an_inertia_is_in_another_unit_only_where_its_error_lets_no_other_factor_in() {
    let columns = slow_moves();
    let nominal = NOMINAL.parameters.i1 + NOMINAL.parameters.i2;
    let input = columns.motor_only();
    let told = |ratio: f64, error: f64, left: f64, sure: bool| {
        let found = EstimatedInertia { value: ratio * nominal, error: error * ratio * nominal, left };
        inertia_finding(&input, &found, nominal, sure).map(|f| (f.id, f.severity))
    };
    let (units, inertia) = (Some(("units", Severity::Refuse)), Some(("inertia", Severity::Warn)));
    // Nothing is left of the torque: no other fit leaves less.
    assert_eq!(told(57.3, 0.01, 0.0, false), units);
    assert_eq!(told(0.105, 0.05, 0.0, false), units);
    // 7.7 to 11.3 times is 9.55 of the factors, 5.7 to 13 times is 6.28 too, 2 to 17 times the nominal value.
    assert_eq!(told(9.5, 0.09, 0.0, false), units);
    assert_eq!(told(9.5, 0.2, 0.0, false), inertia);
    assert_eq!(told(9.5, 0.4, 0.0, true), None);
    // Beyond any nominal value, whatever the factor; and none that is not told from zero.
    assert_eq!(told(30.0, 0.2, 0.0, true), units);
    assert_eq!(told(30.0, 0.2, 0.0, false), inertia);
    assert_eq!(told(0.02, 0.6, 0.0, true), inertia);
    // The smoothed motion explains most of this record's torque with the nominal inertia.
    assert_eq!(told(0.105, 0.05, 0.5, false), None);
}

/// Slow triangles under control: the drive's torque, N.m, and both angles, rad. A weight on a soft coupling twists it by up to a radian, which
/// moves the table as a torque moves a motor; Coulomb friction, the weight and a ripple are nearly all of the torque.
fn slow_triangles() -> Columns {
    let (p, dt, steps) = (Parameters::PAPER, 1.125e-3, 20);
    let (friction, ripple) = (0.016, 0.017);
    let wanted = |t: f64| {
        let since = (t + 1.08).rem_euclid(2.25);
        1.4 - 1.75 * since.min(2.25 - since)
    };
    let weight = |x: f64| -0.02 * x.sin() - 0.0065 * x.cos();
    let (mut e1, mut e2) = (noise(61, 6e-4), noise(62, 6e-4));
    let ([mut x1, mut v1], [mut x2, mut v2]) = ([-0.043, 0.0], [1.15, 0.0]);
    let (mut before, mut columns) = (x1, Columns { dt, v: Default::default() });
    for k in 0..3747 {
        let seen = x1 + e1();
        let torque = 0.0057 * (4.64 * (wanted(f64::from(k) * dt) - seen) - (seen - before) / dt);
        before = seen;
        for (column, value) in columns.v.iter_mut().zip([torque, seen, 0.0, x2 + e2(), 0.0]) {
            column.push(value);
        }
        let h = dt / f64::from(steps);
        for _ in 0..steps {
            let pull = p.k * (x1 - x2) + p.b * (v1 - v2);
            let free: f64 = v1 + h / p.i1 * (torque - pull + ripple * (4.21 * x1 - 2.07).sin());
            v1 = free.signum() * (free.abs() - h / p.i1 * friction).max(0.0);
            v2 += h / p.i2 * (pull - weight(x2));
            x1 += h * v1;
            x2 += h * v2;
        }
    }
    columns
}

#[test]
fn slow_triangles_under_a_weight_and_friction_are_neither_exchanged_nor_late() {
    let columns = slow_triangles();
    let looked_at = |x: &Columns| refused(&Input { nominal: Some(NOMINAL), ..x.positions() });
    assert_eq!(looked_at(&columns), [""; 0]);
    assert!(as_logged::explains_as_well_as_exchanged(&columns.positions()));
    assert!(as_logged::explains_as_well_as_late(&columns.positions(), 56));
    // What is exchanged, or late, leaves much more of the torque than the same mended.
    let mut late = slow_moves();
    late.v[0].rotate_right(56);
    assert!(!as_logged::explains_as_well_as_late(&late.positions(), -56));
    let mut exchanged = plain();
    exchanged.v.swap(1, 3);
    assert!(!as_logged::explains_as_well_as_exchanged(&exchanged.positions()));
}

#[test]
fn a_motor_that_its_friction_holds_between_slow_moves_is_followed_where_it_moves() {
    // To and fro in half a second each, and at rest for two and a half, under a torque that wanders below breakaway.
    let (dt, inertia, weight, friction) = (1e-3, 2e-3, 0.08, 0.2);
    let mut e = noise(37, 1e-5);
    let mut columns = Columns { dt, v: Default::default() };
    for cycle in 0..4 {
        let (from, way) = if cycle % 2 == 0 { (0.0, 1.5) } else { (1.5, -1.5) };
        for k in 0..3000 {
            let s = (f64::from(k) / 500.0).min(1.0);
            let x = from + way * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
            let v = way * 30.0 * s * s * (1.0 - s).powi(2) / 0.5;
            let a = way * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / 0.25;
            let moves = inertia * a + friction * v.signum() + weight * x.sin();
            let rests = weight * x.sin() + 0.9 * friction * (7.0 * f64::from(k) * dt).sin();
            columns.v[0].push(if k < 500 { moves } else { rests });
            columns.v[1].push(x + e());
        }
    }
    assert!(rigid::explained_in_time(&columns.motor_only()));
    let own = columns.v[0].clone();
    columns.v[0].iter_mut().for_each(|t| *t = -*t);
    assert!(!rigid::explained_in_time(&columns.motor_only()), "it brakes the wrong way");
    columns.v[0] = (0..own.len()).map(|k| own[(k + 1000) % own.len()]).collect();
    assert!(!rigid::explained_in_time(&columns.motor_only()), "it moves under what held it");
}

#[test]
fn a_drive_that_holds_an_axis_against_a_foreign_torque_has_no_torque_turned_round() {
    // Slow triangles under position loops, and a foreign sine four times the friction.
    let (inertia, friction, foreign, dt) = (20.0, 5.0, 22.0, 1e-3);
    for (bandwidth, damping) in [(10.0, 0.7), (20.0, 1.5), (40.0, 1.5)] {
        let mut e = noise(31, 1e-6);
        let (mut x, mut v) = (0.0_f64, 0.0_f64);
        let mut columns = Columns { dt, v: Default::default() };
        for k in 0..6000 {
            let t = f64::from(k) * dt;
            let wanted = 0.1 * (2.0 * (0.5 * t - (0.5 * t + 0.5).floor()).abs());
            let seen = x + e();
            let torque = inertia * (bandwidth * bandwidth * (wanted - seen) - 2.0 * damping * bandwidth * v);
            columns.v[0].push(torque);
            columns.v[1].push(seen);
            let taken = friction * (v / 1e-3).tanh() + foreign * (3.0 * t + 2.8).sin();
            v += dt * (torque - taken) / inertia;
            x += dt * v;
        }
        let parameters = Parameters { i1: inertia, i2: 0.0, b: 0.0, k: 0.0, rho: 1.0 };
        let nominal = Some(Nominal { structure: Structure::Rigid, parameters });
        let input = Input { nominal, ..columns.motor_only() };
        assert_eq!(refused(&input), Vec::<&str>::new(), "{bandwidth} {damping}");
    }
}
