//! Effects against closed formulas: on the rigid axis, which has no place for a table but bears what acts on it, friction
//! that grows with its load, and readings that are late, early or filtered.

use eixo::axis::{
    Axis, Hold, Parameters, Scheme, SimulateOptions, State, Structure, dt_criterion, simulate, substeps,
    substeps_at_speed,
};
use eixo::effects::{Effect, Ramp, Settings};

const P: Parameters = Parameters { i1: 2e-3, i2: 1e-3, b: 0.0, k: 0.0, rho: 1.0 };
const INERTIA: f64 = 3e-3;

fn with(effects: &[(Effect, &[f64])]) -> Settings {
    let mut settings = Settings::default();
    for (effect, values) in effects {
        settings.of_mut(*effect)[..values.len()].copy_from_slice(values);
    }
    settings
}

fn rigid(effects: Settings, scheme: Scheme, h: f64) -> Axis {
    Axis::new(P, Structure::Rigid, effects, scheme, h)
}

/// Free motion from an angle and a speed; shows every state with its time.
fn swing(axis: &Axis, theta: f64, omega: f64, end: f64, mut visit: impl FnMut(f64, &State)) -> State {
    let mut s = axis.state(theta, omega, theta, omega, 0.0);
    for k in 0..(end / axis.h()).round() as usize {
        let t = k as f64 * axis.h();
        visit(t, &s);
        s = axis.advance(&s, Ramp::held(0.0), t);
    }
    s
}

/// Time of a number of periods of the free motion, between upward zeros of angle - rest, by straight lines.
fn period(axis: &Axis, rest: f64, theta: f64, periods: usize, end: f64) -> f64 {
    let mut last: Option<(f64, f64)> = None;
    let mut zeros = Vec::new();
    swing(axis, theta, 0.0, end, |t, s| {
        let x = s.theta1() - rest;
        if let Some((before, was)) = last
            && was < 0.0
            && x >= 0.0
        {
            zeros.push(before + (t - before) * was / (was - x));
        }
        last = Some((t, x));
    });
    (zeros[periods] - zeros[0]) / periods as f64
}

#[test]
fn a_rigid_pendulum_swings_at_the_frequency_of_its_weight() {
    // I*theta'' = -sine*sin(ratio*theta): w^2 = sine*ratio/I at small angles; at the amplitude x = ratio*a the period is longer
    // by 1 + x^2/16 + 11*x^4/3072 + 173*x^6/737280 (the series of the complete elliptic integral).
    let (sine, ratio) = (0.12, 2.5);
    let w = (sine * ratio / INERTIA).sqrt();
    let axis = rigid(with(&[(Effect::Gravity, &[sine, 0.0, ratio])]), Scheme::NEWMARK, 1e-4);
    for a in [1e-3, 0.2] {
        let x = ratio * a;
        let expected = std::f64::consts::TAU / w
            * (1.0 + x * x / 16.0 + 11.0 * x.powi(4) / 3072.0 + 173.0 * x.powi(6) / 737_280.0);
        let found = period(&axis, 0.0, a, 10, 11.0 * std::f64::consts::TAU / w * 1.1);
        // The trapezoid's own longer period is (w*h)^2/12, 8e-8 here.
        assert!((found / expected - 1.0).abs() < 1e-6, "{a}: {found} {expected}");
    }
}

#[test]
fn a_rigid_axis_rests_where_its_weight_hangs_and_a_cosine_is_a_turned_sine() {
    // sine*sin(x) + cosine*cos(x) = hypot*sin(x + atan2(cosine, sine)).
    let (sine, cosine) = (0.1, -0.07_f64);
    let turned = cosine.atan2(sine);
    let axis = rigid(with(&[(Effect::Gravity, &[sine, cosine, 1.0])]), Scheme::Exact, 1e-3);
    let still = swing(&axis, -turned, 0.0, 1.0, |_, _| {});
    assert!((still.theta1() + turned).abs() < 1e-12 && still.omega1().abs() < 1e-12);
    let a = axis.accelerations(&axis.state(0.4, 0.0, 0.4, 0.0, 0.0), 0.05, 0.0);
    let expected = (0.05 - sine * 0.4_f64.sin() - cosine * 0.4_f64.cos()) / INERTIA;
    assert!((a[0] - expected).abs() < 1e-12 * expected.abs() && a[0].to_bits() == a[1].to_bits());
}

#[test]
fn a_rigid_axis_on_a_spring_to_the_frame_is_an_oscillator() {
    let (k, rest) = (0.8, 0.3);
    let w = (k / INERTIA).sqrt();
    let axis = rigid(with(&[(Effect::ExternalSpring, &[k, rest])]), Scheme::NEWMARK, 1e-3);
    // The step is the trapezoidal rule: its angle is that of the closed form with w replaced by 2*atan(w*h/2)/h.
    let slow = 2.0 * (w * 1e-3 / 2.0).atan() / 1e-3;
    let end = swing(&axis, rest + 0.1, 0.0, 2.0, |t, s| {
        let expected = rest + 0.1 * (slow * t).cos();
        assert!((s.theta1() - expected).abs() < 1e-10, "{t}: {} {expected}", s.theta1());
    });
    assert!((end.theta2() - end.theta1()).abs() < 1e-15);
}

#[test]
fn a_swinging_rigid_axis_keeps_its_energy_to_the_order_of_the_step() {
    let (sine, cosine, ratio, k, rest) = (0.1, 0.04, 2.0, 0.2, 0.1);
    let effects = with(&[(Effect::Gravity, &[sine, cosine, ratio]), (Effect::ExternalSpring, &[k, rest])]);
    for scheme in [Scheme::NEWMARK, Scheme::Exact] {
        let worst = |h: f64| {
            let energy = |s: &State| {
                let (x, v) = (s.theta1(), s.omega1());
                0.5 * INERTIA * v * v
                    + (cosine * (ratio * x).sin() - sine * (ratio * x).cos()) / ratio
                    + 0.5 * k * (x - rest).powi(2)
            };
            let axis = rigid(effects, scheme, h);
            let before = energy(&axis.state(0.9, 0.0, 0.9, 0.0, 0.0));
            let mut most: f64 = 0.0;
            swing(&axis, 0.9, 0.0, 2.0, |_, s| most = most.max((energy(s) - before).abs()));
            most
        };
        let order = (worst(2e-3) / worst(1e-3)).log2();
        assert!((1.8..2.4).contains(&order) && worst(1e-3) < 1e-4, "{scheme:?} {order} {}", worst(1e-3));
    }
}

#[test]
fn table_effects_act_on_the_one_inertia_of_a_rigid_axis() {
    // Torque at theta 0.7, omega 3, time 0.2, by each effect's equation.
    let cases: [(Effect, &[f64], f64); 5] = [
        (Effect::EndStop, &[0.5, 0.3, -0.2, 0.02], 0.5 * 0.4 * (1.0 + 0.02 * 3.0)),
        (Effect::Disturbance, &[0.01, 7.0, 0.4], -0.01 * (std::f64::consts::TAU * 7.0 * 0.2 + 0.4).sin()),
        (Effect::Unbalance, &[0.02, 0.2], -0.02 * 0.9_f64.sin()),
        (Effect::QuadraticDrag, &[1e-3], 1e-3 * 9.0),
        (Effect::ViscousTable, &[1e-3, 0.2], 1e-3 * 1.2 * 3.0),
    ];
    for (effect, values, torque) in cases {
        let axis = rigid(with(&[(effect, values)]), Scheme::NEWMARK, 1e-4);
        let s = axis.state(0.7, 3.0, 0.7, 3.0, 0.2);
        let a = axis.accelerations(&s, 0.0, 0.2);
        assert!((a[0] + torque / INERTIA).abs() < 1e-9 && a[0].to_bits() == a[1].to_bits(), "{effect:?}: {a:?}");
        // And over a step: the mean of the torques at its ends moves all of the inertia.
        let next = axis.advance(&s, Ramp::held(0.0), 0.2);
        let mean = 0.5 * (a[0] + axis.accelerations(&next, 0.0, 0.2 + 1e-4)[0]);
        assert!((next.omega1() - 3.0 - mean * 1e-4).abs() < 1e-12, "{effect:?}");
        assert!((next.theta2() - next.theta1()).abs() < 1e-15 && (next.omega2() - next.omega1()).abs() < 1e-15);
    }
}

/// Speed of a body of `inertia` that a torque drives from rest, with a free body of `third` on a spring `k` behind it: the
/// centre runs at T/(I + I3)*t, and the twist e'' = T/I - w^2*e about it. Steps of the trapezoidal rule only turn the
/// phase by less, 2*atan(w*h/2) each.
fn driven(inertia: f64, third: f64, k: f64, torque: f64, h: f64, n: u32) -> f64 {
    let w = (k * (1.0 / inertia + 1.0 / third)).sqrt();
    let rate = torque / (inertia * w) * (2.0 * f64::from(n) * (w * h / 2.0).atan()).sin();
    (torque * f64::from(n) * h + third * rate) / (inertia + third)
}

#[test]
fn a_third_inertia_on_a_rigid_axis_swings_against_all_of_it_on_either_side() {
    let (third, k, h, torque) = (5e-4, 2.0, 1e-3, 0.02);
    for effect in [Effect::FlexibleMode, Effect::MotorMode] {
        let axis = rigid(with(&[(effect, &[third, k, 0.0])]), Scheme::NEWMARK, h);
        let mut s = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
        for n in 0..2000_u32 {
            let expected = driven(INERTIA, third, k, torque, h, n);
            assert!((s.omega1() - expected).abs() < 1e-9, "{effect:?} {n}: {} {expected}", s.omega1());
            s = axis.advance(&s, Ramp::held(torque), f64::from(n) * h);
        }
    }
}

#[test]
fn a_mode_on_the_motors_side_swings_against_the_motor() {
    // A coupling that transmits nothing: motor and third inertia are two bodies on a spring, the table stays.
    let p = Parameters { k: 1e-12, ..P };
    let (third, k, h, torque) = (5e-4, 2.0, 1e-3, 0.02);
    let axis = Axis::new(p, Structure::TwoInertia, with(&[(Effect::MotorMode, &[third, k, 0.0])]), Scheme::NEWMARK, h);
    let mut s = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    for n in 0..2000_u32 {
        let expected = driven(p.i1, third, k, torque, h, n);
        assert!((s.omega1() - expected).abs() < 1e-7 && s.omega2().abs() < 1e-7, "{n}: {} {expected}", s.omega1());
        s = axis.advance(&s, Ramp::held(torque), f64::from(n) * h);
    }
}

#[test]
fn an_axis_slides_down_its_slope_or_stays_by_its_coefficient_of_friction() {
    // A weight g with friction load*g: down the slope with (1 - load)*g/I, up it with -(1 + load)*g/I; at rest if load > 1.
    let g = 0.09;
    let slope = |load: f64| with(&[(Effect::LoadTable, &[g]), (Effect::CoulombTable, &[0.0, 0.0, 1.0, 0.0, load])]);
    let axis = rigid(slope(0.4), Scheme::NEWMARK, 1e-3);
    let (up, down) = (1.4 * g / INERTIA, 0.6 * g / INERTIA);
    swing(&axis, 0.0, 10.0, 1.0, |t, s| {
        let turn = 10.0 / up;
        let expected = if t < turn { 10.0 - up * t } else { -down * (t - turn) };
        assert!((s.omega1() - expected).abs() < 1e-9, "{t}: {} {expected}", s.omega1());
    });
    let stays = rigid(slope(1.1), Scheme::NEWMARK, 1e-3);
    let end = swing(&stays, 0.0, 10.0, 2.0, |_, _| {});
    assert!((end.theta1() - 100.0 / (2.0 * 2.1 * g / INERTIA)).abs() < 1e-9, "{}", end.theta1());
    assert!(end.omega1().abs() < 1e-15);
    let a = stays.accelerations(&end, 0.0, 2.0);
    assert!(a[0].abs() < 1e-15, "{a:?}");
    assert!((stays.accelerations(&end, 2.2 * g, 2.0)[0] - 0.1 * g / INERTIA).abs() < 1e-9);
}

#[test]
fn a_rigid_axis_breaks_away_beyond_the_friction_of_both_its_sides() {
    let effects = with(&[(Effect::CoulombMotor, &[0.02]), (Effect::CoulombTable, &[0.01])]);
    let axis = rigid(effects, Scheme::NEWMARK, 1e-3);
    let mut s = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    // Below the sum either way and back again nothing moves, whichever side would have slipped alone.
    for (k, torque) in [0.015, 0.025, 0.0, -0.025, 0.029, -0.029, 0.012, -0.005].iter().cycle().take(400).enumerate() {
        s = axis.advance(&s, Ramp::held(*torque), k as f64 * 1e-3);
        assert!(s.theta1().abs() < 1e-15 && s.omega1().abs() < 1e-15, "{k} {torque}: {} {}", s.theta1(), s.omega1());
    }
    for k in 0..100 {
        s = axis.advance(&s, Ramp::held(-0.05), 0.4 + f64::from(k) * 1e-3);
    }
    assert!((s.omega1() + 0.02 / INERTIA * 0.1).abs() < 1e-12, "{}", s.omega1());
}

#[test]
fn friction_grows_with_what_the_coupling_transmits() {
    // Once the twist is still, both inertias run at a: t = I2*a at a frictionless table, so T = (I1 + I2)*a + load*I2*a;
    // with the friction on the table t*(1 - load) = I2*a and T = I1*a + t.
    let p = Parameters { i1: 2e-3, i2: 1e-3, b: 0.05, k: 20.0, rho: 1.0 };
    let load = 0.3;
    for (effect, expected) in [
        (Effect::CoulombMotor, 0.5 / (p.i1 + p.i2 * (1.0 + load))),
        (Effect::CoulombTable, 0.5 / (p.i1 + p.i2 / (1.0 - load))),
    ] {
        let effects = with(&[(effect, &[0.0, 0.0, 1.0, 0.0, load])]);
        for sign in [1.0, -1.0] {
            let axis = Axis::new(p, Structure::TwoInertia, effects, Scheme::NEWMARK, 1e-3);
            let mut s = axis.state(0.0, sign, 0.0, sign, 0.0);
            for k in 0..2000 {
                s = axis.advance(&s, Ramp::held(0.5 * sign), f64::from(k) * 1e-3);
            }
            let a = axis.accelerations(&s, 0.5 * sign, 2.0);
            assert!(
                (a[0] / expected * sign - 1.0).abs() < 1e-9 && (a[1] / a[0] - 1.0).abs() < 1e-9,
                "{effect:?} {a:?}"
            );
        }
    }
}

#[test]
fn friction_under_load_keeps_the_order_of_the_step() {
    let p = Parameters::PAPER;
    for (effect, values) in
        [(Effect::CoulombMotor, [2e-4, 0.3, 2.0, 0.1, 0.6]), (Effect::CoulombTable, [1e-4, 0.0, 1.0, 0.0, 0.5])]
    {
        let end = |h: f64| {
            let axis = Axis::new(p, Structure::TwoInertia, with(&[(effect, &values)]), Scheme::Exact, h);
            let mut s = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
            for k in 0..(0.5 / h).round() as usize {
                let t = |k: usize| 0.03 * (20.0 * k as f64 * h).sin();
                s = axis.advance(&s, Ramp { start: t(k), end: t(k + 1) }, k as f64 * h);
            }
            s.theta2()
        };
        let fine = end(1e-5);
        let (coarse, half) = ((end(2e-3) - fine).abs(), (end(5e-4) - fine).abs());
        // A quarter of the step: a sixteenth of the error.
        assert!(half < coarse / 12.0, "{effect:?} {coarse} {half}");
    }
}

#[test]
fn a_tight_spot_takes_the_work_of_its_bell() {
    // Through all of the spot the energy falls by the level times the area of the bell, width*sqrt(pi).
    let (level, width) = (0.02, 0.05);
    let effects = with(&[(Effect::PositionFriction, &[level, 1.0, width])]);
    let axis = rigid(effects, Scheme::NEWMARK, 1e-4);
    let end = swing(&axis, 0.0, 4.0, 0.6, |_, _| {});
    let lost = 0.5 * INERTIA * (16.0 - end.omega1().powi(2));
    let expected = level * width * std::f64::consts::PI.sqrt();
    assert!((lost / expected - 1.0).abs() < 1e-5, "{lost} {expected}");
    // And a push below the level in the middle of it moves nothing, one above it does.
    let held = axis.accelerations(&axis.state(1.0, 0.0, 1.0, 0.0, 0.0), 0.0199, 0.0);
    let moved = axis.accelerations(&axis.state(1.0 + width, 0.0, 1.0 + width, 0.0, 0.0), 0.0199, 0.0);
    let left = 0.0199 - level * (-1.0_f64).exp();
    assert!(held[0].abs() < 1e-15 && (moved[0] - left / INERTIA).abs() < 1e-9, "{held:?} {moved:?}");
}

/// Readings of a rigid axis from rest under a constant torque, every `dt` s.
fn read(latch: &[f64], torque: f64, dt: f64) -> Vec<[f64; 4]> {
    let effects = with(&[(Effect::Latch, latch)]);
    let options = SimulateOptions { start: 0.0, dt, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 1 };
    simulate(&P, Structure::Rigid, &effects, [0.0, 2.0, 0.0, 2.0], &vec![torque; 200], &options)
        .readings
        .iter()
        .map(|r| [r.theta1, r.omega1, r.theta2, r.omega2])
        .collect()
}

#[test]
fn readings_under_a_latch_are_those_of_another_instant_or_behind_a_filter() {
    let (torque, dt) = (0.06, 1e-3);
    let a = torque / INERTIA;
    let check = |latch: &[f64], expected: &dyn Fn(f64) -> [f64; 2]| {
        for (k, row) in read(latch, torque, dt).iter().enumerate().skip(10) {
            let [theta, omega] = expected(k as f64 * dt);
            for (got, want) in row.iter().zip([theta, omega, theta, omega]) {
                assert!((got - want).abs() < 1e-12, "{latch:?} {k}: {row:?} {theta} {omega}");
            }
        }
    };
    let theta = |t: f64| 2.0 * t + 0.5 * a * t * t;
    check(&[3.7e-3], &|t| [theta(t - 3.7e-3), 2.0 + a * (t - 3.7e-3)]);
    check(&[-1.6e-3], &|t| [theta(t) + 1.6e-3 * (2.0 + a * t), 2.0 + a * t]);
    // y + f*y' = theta: the speed lags by f*(1 - exp(-t/f)).
    for f in [2e-5, 2e-3, 0.05] {
        let lagged = |t: f64| 2.0 + a * (t - f * (1.0 - (-t / f).exp()));
        check(&[0.0, f], &|t| [theta(t) - f * lagged(t), lagged(t)]);
    }
}

#[test]
fn what_else_the_encoders_do_is_late_with_them() {
    // A late reading of a scale with an error is the scale's reading of the late angle; the table's own delay comes on top.
    let effects = with(&[
        (Effect::SensorDelay, &[1.3e-3]),
        (Effect::LeadError, &[0.01, 0.02, 3.0, 0.4]),
        (Effect::Latch, &[2.2e-3]),
    ]);
    let options = SimulateOptions { start: 0.0, dt: 1e-3, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 1 };
    let r = simulate(&P, Structure::Rigid, &effects, [0.0, 2.0, 0.0, 2.0], &[0.06; 100], &options);
    let theta = |t: f64| 2.0 * t + 10.0 * t * t;
    for (k, row) in r.readings.iter().enumerate().skip(10) {
        let t = k as f64 * 1e-3;
        let table = theta(t - 3.5e-3);
        let expected = table * 1.01 + 0.02 * (3.0 * table + 0.4).sin();
        assert!(
            (row.theta1 - theta(t - 2.2e-3)).abs() < 1e-12 && (row.theta2 - expected).abs() < 1e-12,
            "{k}: {row:?}"
        );
    }
}

#[test]
fn steps_a_sample_follow_what_swings_fastest() {
    let dt = dt_criterion(10.0, 2048, 54.53);
    let per = |effects: &[(Effect, &[f64])]| substeps(&P, Structure::Rigid, &with(effects), dt);
    assert_eq!(per(&[(Effect::LoadTable, &[1.0])]), 1);
    // A quarter of a radian a step: w*dt/0.25 steps, rounded up.
    let needed = |w: f64| (w * dt / 0.25).ceil() as usize;
    let k = 4e3;
    assert_eq!(per(&[(Effect::ExternalSpring, &[k])]), needed((k / INERTIA).sqrt()));
    assert_eq!(per(&[(Effect::Gravity, &[30.0, 40.0, 80.0])]), needed((50.0 * 80.0 / INERTIA).sqrt()));
    assert_eq!(per(&[(Effect::MotorMode, &[1e-3, k])]), needed((k / 1e-3).sqrt()));
    assert_eq!(per(&[(Effect::Disturbance, &[1.0, 60.0])]), needed(std::f64::consts::TAU * 60.0));
    // What repeats with the angle repeats in time as fast as its place turns.
    let ripple = with(&[(Effect::TorqueRipple, &[1.0, 8.0])]);
    let turning = |speed: [f64; 2]| substeps_at_speed(&P, Structure::Rigid, &ripple, dt, speed);
    assert_eq!([[0.0; 2], [0.0, 90.0], [90.0, 0.0]].map(turning), [1, 1, needed(8.0 * 90.0)]);
    // The coupling's own mode, and twice that for the absolute value of its torque.
    let flexible = Parameters { k: 400.0, ..P };
    let with_load = |load: f64| {
        substeps(&flexible, Structure::TwoInertia, &with(&[(Effect::CoulombTable, &[0.1, 0.0, 1.0, 0.0, load])]), dt)
    };
    let w = (400.0 * flexible.twist_mobility()).sqrt();
    assert_eq!((with_load(0.0), with_load(0.2)), (needed(w), needed(2.0 * w)));
}
