use super::*;
use crate::effects::{EFFECTS, Effect, Ramp, Settings};
use crate::scalar::{Dual, Scalar};

const P: Parameters = Parameters::PAPER;

fn axis(effects: Settings, scheme: Scheme, h: f64) -> Axis {
    Axis::new(P, Structure::TwoInertia, effects, scheme, h)
}

/// Free vibration of the twist, stepped to `end` s.
fn twist_at(p: Parameters, scheme: Scheme, h: f64, end: f64) -> f64 {
    let a = Axis::new(p, Structure::TwoInertia, Settings::default(), scheme, h);
    let mut s = a.state(0.1, 0.0, 0.0, 0.0, 0.0);
    for k in 0..(end / h).round() as usize {
        s = a.advance(&s, Ramp::held(0.0), k as f64 * h);
    }
    s.theta1() - s.theta2()
}

#[test]
fn newmark_is_second_order() {
    // Against the closed form of a damped vibration.
    let m = P.modal();
    let end = 0.05;
    let phase = m.wd * end;
    let exact =
        0.1 * (-m.zeta * m.wn * end).exp() * (phase.cos() + m.zeta / (1.0 - m.zeta * m.zeta).sqrt() * phase.sin());
    let error = |h: f64| (twist_at(P, Scheme::NEWMARK, h, end) - exact).abs();
    let order = (error(1e-3) / error(5e-4)).log2();
    assert!((order - 2.0).abs() < 0.02, "{order}");
}

#[test]
fn newmark_keeps_the_energy_of_an_undamped_axis() {
    let p = Parameters { b: 0.0, ..P };
    let a = Axis::new(p, Structure::TwoInertia, Settings::default(), Scheme::NEWMARK, 5.626e-4);
    let mut s = a.state(0.3, 1.0, 0.0, -2.0, 0.0);
    let energy = |s: &State| {
        0.5 * (p.i1 * s.omega1().powi(2) + p.i2 * s.omega2().powi(2) + p.k * (s.theta1() - s.theta2()).powi(2))
    };
    let before = energy(&s);
    for k in 0..100_000 {
        s = a.advance(&s, Ramp::held(0.0), f64::from(k) * 5.626e-4);
    }
    assert!((energy(&s) / before - 1.0).abs() < 1e-10, "{}", energy(&s) / before - 1.0);
}

#[test]
fn newmark_lengthens_the_period_by_the_closed_formula() {
    // One period of the discrete vibration turns by 2*atan(h/2)*n: after n steps the twist is cos(2*n*atan(wn*dt/2)).
    let p = Parameters { b: 0.0, ..P };
    let dt = 2e-3;
    let wn = p.modal().wn;
    for n in [1_usize, 7, 100, 1000] {
        let expected = 0.1 * (2.0 * n as f64 * (wn * dt / 2.0).atan()).cos();
        assert!((twist_at(p, Scheme::NEWMARK, dt, n as f64 * dt) - expected).abs() < 1e-11);
    }
    let discrete_period = std::f64::consts::TAU / (2.0 * (wn * dt / 2.0).atan() / dt);
    assert!((discrete_period / (std::f64::consts::TAU / wn) - 1.0 - period_elongation(wn, dt)).abs() < 1e-15);
}

#[test]
fn newmark_with_the_papers_weights_is_the_trapezoidal_rule() {
    // (I - A*dt/2)*Theta+ = (I + A*dt/2)*Theta + C*dt*(T + T+)/2, solved densely here.
    let dt = 5.626e-4;
    let (i1, i2, b, k) = (P.i1, P.i2, P.b, P.k);
    let a = nalgebra::Matrix4::new(
        0.0,
        1.0,
        0.0,
        0.0, //
        -k / i1,
        -b / i1,
        k / i1,
        b / i1, //
        0.0,
        0.0,
        0.0,
        1.0, //
        k / i2,
        b / i2,
        -k / i2,
        -b / i2,
    );
    let c = nalgebra::Vector4::new(0.0, 1.0 / i1, 0.0, 0.0);
    let eye = nalgebra::Matrix4::identity();
    let lu = (eye - a * (dt / 2.0)).lu();
    let mut theta = nalgebra::Vector4::new(0.2, 1.0, -0.1, 3.0);
    let ax = axis(Settings::default(), Scheme::NEWMARK, dt);
    let mut s = ax.state(0.2, 1.0, -0.1, 3.0, 0.0);
    let torque = |k: usize| (k as f64 * 0.37).sin() * 0.03;
    for k in 0..500 {
        let ramp = Ramp { start: torque(k), end: torque(k + 1) };
        s = ax.advance(&s, ramp, k as f64 * dt);
        let rhs = (eye + a * (dt / 2.0)) * theta + c * (dt / 2.0 * (ramp.start + ramp.end));
        theta = lu.solve(&rhs).expect("regular");
    }
    for (ours, theirs) in [s.theta1(), s.omega1(), s.theta2(), s.omega2()].iter().zip(theta.iter()) {
        assert!((ours - theirs).abs() < 1e-11 * (1.0 + theirs.abs()), "{ours} {theirs}");
    }
}

#[test]
fn the_exact_scheme_is_scipys_zero_order_hold() {
    // scripts/oracles/axis_zoh.py: scipy.signal.cont2discrete(A, C, 'zoh') of the paper's axis at 5 ms, 40 steps of
    // T(k) = 0.03*cos(k).
    let expected = include_str!("../../../../scripts/oracles/axis_zoh.txt");
    let values: Vec<f64> = expected.split_whitespace().map(|v| v.parse().expect("a number")).collect();
    let torque: Vec<f64> = (0..41).map(|k| 0.03 * f64::from(k).cos()).collect();
    let options = SimulateOptions { start: 0.0, dt: 5e-3, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 1 };
    let r = simulate(&P, Structure::TwoInertia, &Settings::default(), [0.1, 0.0, 0.0, 0.0], &torque, &options);
    let last = r.readings[40];
    for (ours, scipy) in [last.theta1, last.omega1, last.theta2, last.omega2].iter().zip(&values) {
        assert!((ours - scipy).abs() < 1e-11 * (1.0 + scipy.abs()), "{ours} {scipy}");
    }
    // Newmark comes to the same as the step shrinks, with its own order.
    let newmark = |substeps| {
        let options = SimulateOptions { scheme: Scheme::NEWMARK, substeps, ..options };
        let r = simulate(&P, Structure::TwoInertia, &Settings::default(), [0.1, 0.0, 0.0, 0.0], &torque, &options);
        (r.readings[40].theta2 - values[2]).abs()
    };
    let order = (newmark(8) / newmark(16)).log2();
    assert!((order - 2.0).abs() < 0.05, "{order}");
}

#[test]
fn below_breakaway_a_sticking_axis_does_not_creep() {
    let mut effects = Settings::default();
    effects.of_mut(Effect::CoulombMotor)[0] = 0.01;
    for scheme in [Scheme::NEWMARK, Scheme::Exact] {
        let a = axis(effects, scheme, 1e-3);
        let mut s = a.state(0.0, 0.0, 0.0, 0.0, 0.0);
        for k in 0..20_000 {
            s = a.advance(&s, Ramp::held(0.0099), f64::from(k) * 1e-3);
        }
        assert_eq!((s.theta1(), s.omega1()), (0.0, 0.0));
        // The table hangs on the spring, whose torque is zero to rounding.
        assert!(s.theta2().abs() < 1e-15, "{}", s.theta2());
        s = a.advance(&s, Ramp::held(0.0101), 20.0);
        assert!(s.omega1() > 0.0);
    }
}

#[test]
fn a_sliding_rigid_axis_stops_where_the_closed_form_says() {
    // v0^2/(2*f/I) and there it stays.
    let mut effects = Settings::default();
    effects.of_mut(Effect::CoulombMotor)[0] = 0.01;
    let p = Parameters { i1: 1e-3, i2: 0.0, ..P };
    let a = Axis::new(p, Structure::Rigid, effects, Scheme::NEWMARK, 7e-3);
    let mut s = a.state(0.0, 1.234, 0.0, 1.234, 0.0);
    for k in 0..100 {
        s = a.advance(&s, Ramp::held(0.0), f64::from(k) * 7e-3);
    }
    assert!((s.theta1() - 1.234_f64.powi(2) / 20.0).abs() < 1e-12, "{}", s.theta1());
    assert_eq!(s.omega1(), 0.0);
}

#[test]
fn reversals_under_coulomb_friction_keep_second_order() {
    let mut effects = Settings::default();
    effects.of_mut(Effect::CoulombMotor)[0] = 0.008;
    effects.of_mut(Effect::CoulombTable)[0] = 0.002;
    let end = |h: f64| {
        let a = axis(effects, Scheme::Exact, h);
        let mut s = a.state(0.0, 0.0, 0.0, 0.0, 0.0);
        let n = (0.5 / h).round() as usize;
        for k in 0..n {
            let t = |k: usize| 0.03 * (20.0 * k as f64 * h).sin();
            s = a.advance(&s, Ramp { start: t(k), end: t(k + 1) }, k as f64 * h);
        }
        s.theta1()
    };
    let fine = end(1e-5);
    let (coarse, half) = ((end(2e-3) - fine).abs(), (end(5e-4) - fine).abs());
    // A quarter of the step: a sixteenth of the error.
    assert!(half < coarse / 12.0, "{coarse} {half}");
}

#[test]
fn backlash_closes_and_opens_with_the_order_of_the_step() {
    let mut effects = Settings::default();
    effects.of_mut(Effect::Backlash)[0] = 0.05;
    let end = |h: f64| {
        let a = axis(effects, Scheme::Exact, h);
        let mut s = a.state(0.0, 0.0, 0.0, 0.0, 0.0);
        let n = (0.5 / h).round() as usize;
        for k in 0..n {
            let t = |k: usize| 0.03 * (20.0 * k as f64 * h).sin();
            s = a.advance(&s, Ramp { start: t(k), end: t(k + 1) }, k as f64 * h);
        }
        s.theta2()
    };
    let fine = end(1e-5);
    let (coarse, half) = ((end(2e-3) - fine).abs(), (end(5e-4) - fine).abs());
    assert!(half < coarse / 8.0 && half < 1e-4 * fine.abs().max(0.1), "{coarse} {half} {fine}");
}

#[test]
fn a_contact_that_lets_go_while_compressed_closes_again_only_when_it_pushes() {
    // The paper's damper pulls long before its spring has relaxed. Oracle: `scripts/blind/plant.py` (Runge-Kutta 4, 3200
    // sub-steps a sample) with backlash 0.01 under this torque gives theta1 1.0625389, theta2 1.0531331 at the end.
    let mut effects = Settings::default();
    effects.of_mut(Effect::Backlash)[0] = 0.01;
    let h = 5e-4;
    let a = axis(effects, Scheme::Exact, h);
    let mut s = a.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let t = |k: usize| 0.03 * (60.0 * k as f64 * h).sin();
    for k in 0..1000 {
        s = a.advance(&s, Ramp { start: t(k), end: t(k + 1) }, k as f64 * h);
        let (d, coupling) = (s.theta1() - s.theta2(), P.i2 * a.accelerations(&s, t(k + 1), 0.0)[1]);
        assert!(coupling * d >= -1e-12, "step {k}: twist {d}, torque {coupling}");
    }
    assert!((s.theta1() - 1.062_538_9).abs() < 1e-6 && (s.theta2() - 1.053_133_1).abs() < 1e-5);
}

/// Each effect at its example.
pub(crate) fn shown(effect: Effect) -> Settings {
    let mut s = Settings::default();
    s.of_mut(effect).copy_from_slice(effect.info().example);
    s
}

fn excitation(n: usize, dt: f64) -> Vec<f64> {
    (0..n)
        .map(|k| {
            let t = k as f64 * dt;
            0.03 * ((13.0 * t).sin() + 0.6 * (31.0 * t + 1.0).sin() + 0.4 * (77.0 * t + 2.0).cos())
        })
        .collect()
}

const OPTIONS: SimulateOptions =
    SimulateOptions { start: 0.0, dt: 1e-3, hold: Hold::Zoh, scheme: Scheme::NEWMARK, substeps: 1 };

#[test]
fn every_effect_off_is_the_papers_model_to_the_bit() {
    let torque = excitation(600, 1e-3);
    let plain = simulate(&P, Structure::TwoInertia, &Settings::default(), [0.0; 4], &torque, &OPTIONS);
    for &effect in EFFECTS {
        let off: Settings = Settings::default();
        assert!(!off.is_on(effect), "{effect:?}");
        let on = simulate(&P, Structure::TwoInertia, &shown(effect), [0.0; 4], &torque, &OPTIONS);
        let moved = plain.readings.iter().zip(&on.readings).any(|(a, b)| (a.theta2 - b.theta2).abs() > 1e-5);
        assert!(moved, "{effect:?} at a size that shows changes nothing");
    }
}

#[test]
fn every_effect_sensitivity_is_its_finite_difference() {
    // Forward-mode duals through Newton, events and all, against central differences of the same simulation.
    let torque = excitation(500, 1e-3);
    for &effect in EFFECTS {
        if effect.step_parameter().is_some() {
            continue; // Piecewise constant: its derivative to the step is zero nearly everywhere by definition.
        }
        let s = shown(effect);
        for i in 0..s.of(effect).len() {
            let value = s.of(effect)[i];
            if value.abs() >= 1e6 {
                continue;
            }
            let mut dual: Settings<Dual<1>> = Settings::lift(&s);
            dual.of_mut(effect)[i] = Dual::variable(value, 0);
            let r =
                simulate(&Parameters::lift(&P), Structure::TwoInertia, &dual, [Dual::default(); 4], &torque, &OPTIONS);
            let step = 1e-6 * value.abs().max(1e-6);
            let at = |v: f64| {
                let mut s = s;
                s.of_mut(effect)[i] = v;
                simulate(&P, Structure::TwoInertia, &s, [0.0; 4], &torque, &OPTIONS)
            };
            let (up, down) = (at(value + step), at(value - step));
            let mut error: f64 = 0.0;
            let mut size: f64 = 0.0;
            for k in 0..torque.len() {
                let fd = (up.readings[k].theta1 - down.readings[k].theta1) / (2.0 * step);
                let fd2 = (up.readings[k].theta2 - down.readings[k].theta2) / (2.0 * step);
                error =
                    error.max((r.readings[k].theta1.eps[0] - fd).abs()).max((r.readings[k].theta2.eps[0] - fd2).abs());
                size = size.max(fd.abs()).max(fd2.abs());
            }
            let name = effect.info().parameters[i].name;
            assert!(error <= 2e-4 * size, "{effect:?}.{name}: {error} of {size}");
        }
    }
}

#[test]
fn passive_effects_do_no_net_work() {
    // Energy given by the torque, less that stored, must not be negative: friction and contacts only take.
    let passive = [
        Effect::CoulombMotor,
        Effect::CoulombTable,
        Effect::PreslidingMotor,
        Effect::PreslidingTable,
        Effect::ViscousMotor,
        Effect::ViscousTable,
        Effect::QuadraticDrag,
        Effect::CouplingHysteresis,
        Effect::Backlash,
        Effect::FlexibleMode,
    ];
    let h = 1e-4;
    for effect in passive {
        let a = axis(shown(effect), Scheme::Exact, h);
        // Ring down from a twist and a spin: kinetic energy can only fall below what was there.
        let mut s = a.state(0.2, 3.0, 0.0, -4.0, 0.0);
        let kinetic = |s: &State| 0.5 * (P.i1 * s.omega1().powi(2) + P.i2 * s.omega2().powi(2));
        let stored = kinetic(&s) + 0.5 * P.k * 0.2 * 0.2;
        let mut most: f64 = 0.0;
        for k in 0..5000 {
            s = a.advance(&s, Ramp::held(0.0), f64::from(k) * h);
            most = most.max(kinetic(&s));
        }
        assert!(most < stored * (1.0 + 1e-6), "{effect:?}: {most} of {stored}");
    }
}

#[test]
fn a_step_leaves_the_committed_state_alone_and_repeats_to_the_bit() {
    for &effect in EFFECTS {
        let a = axis(shown(effect), Scheme::NEWMARK, 1e-3);
        let s = a.state(0.1, 1.0, 0.05, -1.0, 0.0);
        let copy = s;
        let once = a.advance(&s, Ramp::held(0.03), 0.0);
        assert_eq!(s, copy);
        assert_eq!(a.advance(&s, Ramp::held(0.03), 0.0), once, "{effect:?}");
    }
}

#[test]
fn a_rigid_axis_moves_as_one_inertia() {
    let a = Axis::new(P, Structure::Rigid, Settings::default(), Scheme::NEWMARK, 1e-3);
    let mut s = a.state(0.0, 0.0, 0.0, 0.0, 0.0);
    for k in 0..1000 {
        s = a.advance(&s, Ramp::held(0.01), f64::from(k) * 1e-3);
    }
    let expected = 0.5 * 0.01 / (P.i1 + P.i2);
    assert!((s.theta1() / expected - 1.0).abs() < 1e-12 && s.theta1() == s.theta2());
}

#[test]
fn duals_agree_with_plain_numbers() {
    let torque = excitation(300, 1e-3);
    for &effect in EFFECTS {
        let s = shown(effect);
        let plain = simulate(&P, Structure::TwoInertia, &s, [0.0; 4], &torque, &OPTIONS);
        let dual: Response<Dual<2>> = simulate(
            &Parameters::lift(&P),
            Structure::TwoInertia,
            &Settings::lift(&s),
            [Dual::default(); 4],
            &torque,
            &OPTIONS,
        );
        for (a, b) in plain.readings.iter().zip(&dual.readings) {
            assert!((a.theta2 - b.theta2.re()).abs() < 1e-9, "{effect:?}");
        }
    }
}

#[test]
fn an_impulse_leaves_a_third_inertia_its_speed() {
    let mut effects = Settings::default();
    effects.of_mut(Effect::FlexibleMode)[..3].copy_from_slice(&[2e-6, 0.02, 1e-5]);
    let a = axis(effects, Scheme::Exact, 1e-4);
    let mut s = a.state(0.0, 1.0, 0.0, 0.5, 0.0);
    for k in 0..50 {
        s = a.advance(&s, Ramp::held(0.01), f64::from(k) * 1e-4);
    }
    // The internal states are relative to the table.
    let relative = crate::effects::memory_of(Effect::FlexibleMode).start + 1;
    let third = |s: &State| s.omega2() - s.memory()[relative];
    let (table, before) = (s.omega2(), third(&s));
    let taken = a.kick(&mut s, [0.0, 1e-6], 1e-4, 5e-3);
    assert!((s.omega2() - table - taken[1] / P.i2).abs() < 1e-9 && taken[1] > 0.0);
    assert!((third(&s) - before).abs() < 1e-9, "{before} {}", third(&s));
}
