//! The C interface of the exported FMU, through the import host as any tool would call it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::sync::OnceLock;

use eixo::fmu::host::{Fmu, Instance, InstanceOptions, Status};
use eixo::fmu::package::Package;
use eixo::variables::{COUNT, Causality, FIXED, Slot, Starts, Type, all, at, depends_at_start, depends_on_input, find};

const DT: f64 = 5.626e-4;
const T: u32 = Slot::Torque as u32;
const OUTPUTS: [u32; 7] = [1, 2, 3, 4, 5, 6, 7];

fn fmu() -> &'static Fmu {
    static FMU: OnceLock<Fmu> = OnceLock::new();
    FMU.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("axis.fmu");
        Package::default().write(&file).unwrap();
        Fmu::open(&file).unwrap()
    })
}

fn instance() -> Instance {
    fmu().instantiate("axis").unwrap()
}

fn reference(name: &str) -> u32 {
    at(find(name).unwrap_or_else(|| panic!("{name}"))).reference
}

fn set(i: &mut Instance, name: &str, value: f64) {
    i.set_real(&[reference(name)], &[value]).unwrap_or_else(|e| panic!("{name}: {e}"));
}

/// Several effects at once, one of each shape and most with memory.
const ROUGH: &[(&str, f64)] = &[
    ("coulomb_motor.level", 0.004),
    ("coulomb_motor.peak", 0.5),
    ("backlash.half_gap", 0.01),
    ("presliding_table.level", 0.002),
    ("flexible_mode.inertia", 2e-6),
    ("flexible_mode.stiffness", 0.05),
    ("delay.time", 2.6 * DT),
    ("actuator_lag.time_constant", 1e-3),
    ("sensor_delay.time", 1.5 * DT),
    ("lead_error.amplitude", 0.01),
    ("coulomb_motor.load", 0.2),
    ("gravity.sine", 0.002),
    ("external_spring.stiffness", 0.001),
    ("dead_zone.width", 0.002),
    ("position_friction.level", 0.001),
    ("motor_mode.inertia", 2e-5),
    ("latch.delay", 0.7 * DT),
    ("latch.filter", 1e-3),
];

fn started(settings: &[(&str, f64)]) -> Instance {
    let mut i = instance();
    settings.iter().for_each(|(name, value)| set(&mut i, name, *value));
    i.initialize(0.0, None).unwrap();
    i
}

fn torque(k: usize) -> f64 {
    0.03 * (0.05 * k as f64).sin() + 0.02 * (0.31 * k as f64).cos()
}

/// Steps on, from step `from`, and gives the bits of all outputs after each.
fn steps(i: &mut Instance, from: usize, count: usize) -> Vec<u64> {
    let mut bits = Vec::new();
    for k in from..from + count {
        i.set_real(&[T], &[torque(k)]).unwrap();
        i.do_step(k as f64 * DT, DT).unwrap();
        bits.extend(i.get_real(&OUTPUTS).unwrap().iter().map(|v| v.to_bits()));
    }
    bits
}

fn log(i: &Instance) -> String {
    i.take_log().iter().map(|m| format!("{} {}: {}\n", m.status, m.category, m.message)).collect()
}

#[test]
fn a_rollback_is_identical_to_the_last_bit() {
    for settings in [&[][..], ROUGH] {
        let mut i = started(settings);
        let _ = steps(&mut i, 0, 300);
        let state = i.get_state().unwrap();
        let bytes = i.serialize_state(&state).unwrap();
        let first = steps(&mut i, 300, 300);
        i.set_state(&state).unwrap();
        assert!(first == steps(&mut i, 300, 300));
        // Through bytes, in the same instance and in another.
        let again = i.deserialize_state(&bytes).unwrap();
        i.set_state(&again).unwrap();
        assert!(first == steps(&mut i, 300, 300));
        assert_eq!(bytes, i.serialize_state(&again).unwrap());
        let mut other = instance();
        let moved = other.deserialize_state(&bytes).unwrap();
        other.set_state(&moved).unwrap();
        assert!(first == steps(&mut other, 300, 300));
        i.free_state(state).unwrap();
        i.free_state(again).unwrap();
        other.free_state(moved).unwrap();
    }
}

#[test]
fn a_stored_state_that_was_tampered_with_is_refused() {
    let mut i = started(ROUGH);
    let _ = steps(&mut i, 0, 10);
    let state = i.get_state().unwrap();
    let bytes = i.serialize_state(&state).unwrap();
    for at in (0..bytes.len()).step_by(97).chain([0, 8, 24, 25, bytes.len() - 1]) {
        let mut bad = bytes.clone();
        bad[at] ^= 0x41;
        assert!(i.deserialize_state(&bad).is_err(), "byte {at}");
    }
    assert!(i.deserialize_state(&bytes[..bytes.len() - 8]).is_err());
    assert!(i.deserialize_state(&[]).is_err());
    assert!(log(&i).contains("checksum"));
    i.free_state(state).unwrap();
}

#[test]
fn reset_and_a_new_instance_start_alike() {
    let mut i = started(ROUGH);
    let first = steps(&mut i, 0, 50);
    i.reset().unwrap();
    i.initialize(0.0, None).unwrap();
    let plain = steps(&mut i, 0, 50);
    assert!(plain == steps(&mut started(&[]), 0, 50), "a reset must put the start values back");
    i.reset().unwrap();
    ROUGH.iter().for_each(|(name, value)| set(&mut i, name, *value));
    i.initialize(0.0, None).unwrap();
    assert!(first == steps(&mut i, 0, 50));
}

#[test]
fn instances_on_threads_do_not_know_of_each_other() {
    let alone: Vec<Vec<u64>> = [&[][..], ROUGH].iter().map(|s| steps(&mut started(s), 0, 200)).collect();
    std::thread::scope(|scope| {
        for n in 0..8 {
            let alone = &alone;
            scope.spawn(move || {
                let mut i = started([&[][..], ROUGH][n % 2]);
                assert!(steps(&mut i, 0, 200) == alone[n % 2]);
            });
        }
    });
}

/// Outputs at 0.4 s when the communication points lie at multiples of `step`, the torque held over 0.1 s each.
fn at_the_end(settings: &[(&str, f64)], per: usize) -> Vec<f64> {
    let mut i = started(settings);
    for k in 0..4 {
        i.set_real(&[T], &[torque(40 * k)]).unwrap();
        for j in 0..per {
            let step = 0.1 / per as f64;
            i.do_step(0.1 * k as f64 + j as f64 * step, step).unwrap();
        }
    }
    i.get_real(&OUTPUTS).unwrap()
}

#[test]
fn the_communication_step_is_free_and_the_order_of_the_result_stays() {
    // One internal step of 1 ms whatever the communication step: the same result but for rounding.
    for settings in
        [&[("dt_internal", 1e-3)][..], &[("dt_internal", 1e-3), ("coulomb_motor.level", 0.004), ("delay.time", 2.5e-3)]]
    {
        let want = at_the_end(settings, 1);
        for per in [2, 5, 10, 100] {
            let got = at_the_end(settings, per);
            for (a, b) in got.iter().zip(&want) {
                assert!((a - b).abs() <= 1e-10 * b.abs().max(1e-3), "{per} steps: {got:?} {want:?}");
            }
        }
    }
    // Communication steps shorter than the internal step: second order in them. Longer, and no multiple of it: 0.1/7 s is
    // cut into five steps, then into ten.
    let exact = at_the_end(&[("dt_internal", 1e-5)], 1);
    let error = |settings: &[(&str, f64)], per| (at_the_end(settings, per)[3] - exact[3]).abs();
    let (coarse, fine) = (error(&[("dt_internal", 1.0)], 30), error(&[("dt_internal", 1.0)], 60));
    assert!((coarse / fine).log2() > 1.9, "{coarse:e} {fine:e}");
    let (coarse, fine) = (error(&[("dt_internal", 3.3e-3)], 7), error(&[("dt_internal", 1.5e-3)], 7));
    assert!((coarse / fine).log2() > 1.8, "{coarse:e} {fine:e}");
}

#[test]
fn steps_of_changing_length_end_where_equal_steps_do() {
    let mut even = started(&[("dt_internal", 2e-5)]);
    even.set_real(&[T], &[0.02]).unwrap();
    even.do_step(0.0, 0.3).unwrap();
    let want = even.get_real(&OUTPUTS).unwrap();
    let mut i = started(&[("dt_internal", 2e-5)]);
    i.set_real(&[T], &[0.02]).unwrap();
    let mut time = 0.0;
    for step in [1e-5, 0.1, 3.3e-3, 0.04669, 0.15] {
        i.do_step(time, step).unwrap();
        time += step;
    }
    assert!((time - 0.3).abs() < 1e-15);
    for (a, b) in i.get_real(&OUTPUTS).unwrap().iter().zip(&want) {
        assert!((a - b).abs() <= 1e-6 * b.abs(), "{a} {b}");
    }
}

#[test]
fn readings_older_than_what_is_remembered_are_refused_by_name() {
    for (settings, name) in [
        (&[("latch.delay", 0.1)][..], "latch.delay"),
        (&[("sensor_delay.time", 0.1)][..], "sensor_delay.time"),
        (&[("sensor_delay.time", 0.02), ("latch.delay", 0.08)][..], "latch.delay"),
    ] {
        let mut i = started(settings);
        assert!(i.do_step(0.0, DT).is_err());
        assert!(log(&i).contains(name), "{}", log(&i));
    }
    // Early readings need no past.
    let mut early = started(&[("latch.delay", -0.1)]);
    early.do_step(0.0, DT).unwrap();
}

#[test]
fn a_torque_with_a_slope_is_integrated_exactly() {
    // A free rigid body under T = s*t: theta1 = s*t^3/(6*I), omega1 = s*t^2/(2*I), alpha1 = s*t/I.
    let mut i = instance();
    i.set_integer(&[reference("structure"), reference("scheme")], &[2, 2]).unwrap();
    i.initialize(0.0, None).unwrap();
    let inertia = 2.37e-4 + 6.07e-6;
    i.set_real(&[T], &[0.0]).unwrap();
    i.set_input_derivatives(&[T], &[1], &[0.5]).unwrap();
    i.do_step(0.0, 0.2).unwrap();
    let y = i.get_real(&OUTPUTS).unwrap();
    for (got, want) in y.iter().zip([0.5 * 0.008 / 6.0, 0.5 * 0.04 / 2.0, 0.1]) {
        assert!((got - want / inertia).abs() < 1e-12 * got.abs(), "{y:?}");
    }
    // The slope counts for one step; the torque stays where it arrived.
    assert!((i.get_real(&[T]).unwrap()[0] - 0.1).abs() < 1e-16);
    i.do_step(0.2, 0.1).unwrap();
    assert!((i.get_real(&[OUTPUTS[2]]).unwrap()[0] - 0.1 / inertia).abs() < 1e-9);
    for (order, message) in [(2, "order 2"), (0, "order 0")] {
        assert!(i.set_input_derivatives(&[T], &[order], &[0.0]).is_err());
        assert!(log(&i).contains(message));
    }
    assert!(i.set_input_derivatives(&[1], &[1], &[0.0]).is_err());
    assert!(i.set_input_derivatives(&[T], &[1], &[f64::NAN]).is_err());
}

#[test]
fn output_derivatives_are_the_slopes_of_the_outputs() {
    // Coulomb friction slides here; the sensors' delay makes omega2 something other than the table's speed.
    let friction: &[_] = &[("dt_internal", 1e-5), ("coulomb_motor.level", 0.004), ("viscous_table.coefficient", 1e-4)];
    let sensors: &[_] = &[("dt_internal", 1e-5), ("lead_error.amplitude", 0.01), ("lead_error.order", 3.0)];
    let late: &[_] = &[("dt_internal", 1e-5), ("latch.delay", 6e-4), ("latch.filter", 1e-3), ("gravity.sine", 3e-3)];
    let early: &[_] = &[("dt_internal", 1e-5), ("latch.delay", -6e-4), ("latch.filter", 1e-3)];
    let load: &[_] = &[("dt_internal", 1e-5), ("coulomb_motor.level", 1e-3), ("coulomb_motor.load", 0.3)];
    for settings in [&[("dt_internal", 1e-5)], friction, sensors, late, early, load] {
        let mut i = started(settings);
        i.set_real(&[T], &[0.02]).unwrap();
        i.set_input_derivatives(&[T], &[1], &[0.3]).unwrap();
        i.do_step(0.0, 0.05).unwrap();
        let slopes = i.get_output_derivatives(&OUTPUTS, &[1; 7]).unwrap();
        let state = i.get_state().unwrap();
        // Central difference over the step to come, with the same slope of the torque; Richardson once.
        let now = i.get_real(&OUTPUTS).unwrap();
        let mut ahead = |h: f64| {
            i.set_state(&state).unwrap();
            i.set_input_derivatives(&[T], &[1], &[0.3]).unwrap();
            i.do_step(0.05, h).unwrap();
            i.get_real(&OUTPUTS).unwrap()
        };
        let (one, two) = (ahead(1e-4), ahead(2e-4));
        for k in 0..7 {
            let want = (4.0 * one[k] - 3.0 * now[k] - two[k]) / 2e-4;
            assert!((slopes[k] - want).abs() < 2e-4 * want.abs(), "{}: {} {want}", at(k + 1), slopes[k]);
        }
        assert!(i.get_output_derivatives(&[1], &[2]).is_err());
        assert!(i.get_output_derivatives(&[T], &[1]).is_err());
        i.free_state(state).unwrap();
    }
}

/// Start values away from any kink, so that differences make sense.
fn generic(i: &mut Instance, effects: bool) {
    for (name, value) in
        [("T", 0.013), ("theta1_0", 0.3), ("omega1_0", 2.0), ("theta2_0", 0.25), ("omega2_0", 1.7), ("rho", 4e-4)]
    {
        set(i, name, value);
    }
    if effects {
        for (index, v) in all().enumerate().skip(FIXED.len()) {
            let start = Starts::default().values[index];
            let value = match v.to_string().as_str() {
                "encoder_quantisation.step" => 0.0,
                "saturation.limit" => 10.0,
                "delay.time" | "sensor_delay.time" | "actuator_lag.time_constant" => 0.0,
                "backlash.half_gap" => 0.01,
                "torque_gain.gain" => 1.1,
                "end_stop.upper" => 0.1,
                _ if start == 0.0 && v.max.unwrap_or(1.0) > 0.0 => 0.1 * v.nominal.min(1.0),
                _ => start,
            };
            i.set_real(&[v.reference], &[value]).unwrap_or_else(|e| panic!("{v} = {value}: {e}"));
        }
    }
}

fn in_initialisation(effects: bool) -> Instance {
    let mut i = instance();
    i.setup_experiment(None, 0.0, None).unwrap();
    generic(&mut i, effects);
    i.enter_initialization().unwrap();
    i
}

#[test]
fn directional_derivatives_at_the_start_are_those_of_differences() {
    for effects in [false, true] {
        let mut i = in_initialisation(effects);
        for (index, v) in all().enumerate() {
            if v.causality == Causality::Output || v.kind != Type::Real {
                continue;
            }
            let exact = i.directional_derivative(&OUTPUTS, &[v.reference], &[1.0]).unwrap();
            let here = i.get_real(&[v.reference]).unwrap()[0];
            let h = 1e-6 * here.abs().max(v.nominal).min(1.0);
            let at_bound = v.min == Some(here) || v.max == Some(here);
            let mut outputs = |value: f64| {
                i.set_real(&[v.reference], &[value]).unwrap_or_else(|e| panic!("{v} = {value}: {e}"));
                i.get_real(&OUTPUTS).unwrap()
            };
            // Effects that are off have a kink there (their other parameters mean nothing yet): only what is on, or
            // inside its bounds.
            if at_bound || (index >= FIXED.len() && !effects) {
                continue;
            }
            let (up, down) = (outputs(here + h), outputs(here - h));
            let _ = outputs(here);
            for k in 0..7 {
                let want = (up[k] - down[k]) / (2.0 * h);
                let scale = want.abs().max(1e-6 * (up[k].abs() + down[k].abs()) / h * 1e-3).max(1e-9);
                assert!((exact[k] - want).abs() < 1e-4 * scale, "d{}/d{v}: {} {want}", at(k + 1), exact[k]);
            }
        }
        // A seed on several knowns is the sum.
        let (a, b) = (reference("I1"), reference("K"));
        let one = i.directional_derivative(&OUTPUTS, &[a], &[2.0]).unwrap();
        let other = i.directional_derivative(&OUTPUTS, &[b], &[-3.0]).unwrap();
        let both = i.directional_derivative(&OUTPUTS, &[a, b], &[2.0, -3.0]).unwrap();
        for k in 0..7 {
            assert!((both[k] - one[k] - other[k]).abs() <= 1e-12 * both[k].abs().max(1e-9));
        }
    }
}

#[test]
fn after_initialisation_the_torque_reaches_the_accelerations_only() {
    let mut i = started(&[]);
    let _ = steps(&mut i, 0, 20);
    let d = i.directional_derivative(&OUTPUTS, &[T], &[1.0]).unwrap();
    assert_eq!((d[0], d[1], d[3], d[4], d[5], d[6]), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    assert!((d[2] - 1.0 / 2.37e-4).abs() < 1e-9);
    assert!(i.directional_derivative(&OUTPUTS, &[reference("I1")], &[1.0]).is_err());
    assert!(i.directional_derivative(&[T], &[T], &[1.0]).is_err());
    // What sticks does not answer.
    let mut stuck = started(&[("coulomb_motor.level", 0.1)]);
    assert_eq!(stuck.directional_derivative(&OUTPUTS, &[T], &[1.0]).unwrap(), [0.0; 7]);
}

#[test]
fn no_dependency_of_the_outputs_is_left_out() {
    for effects in [false, true] {
        let mut i = in_initialisation(effects);
        let base = i.get_real(&OUTPUTS).unwrap();
        for (index, v) in all().enumerate().filter(|(_, v)| v.causality != Causality::Output) {
            let changed = match v.kind {
                Type::Enumeration(_) => {
                    i.set_integer(&[v.reference], &[2]).unwrap();
                    let changed = i.get_real(&OUTPUTS).unwrap();
                    i.set_integer(&[v.reference], &[1]).unwrap();
                    changed
                }
                Type::Real => {
                    let here = i.get_real(&[v.reference]).unwrap()[0];
                    let there = if v.max == Some(here) { here * 0.5 } else { here + 0.1 * here.abs().max(1e-3) };
                    i.set_real(&[v.reference], &[there.min(v.max.unwrap_or(there))]).unwrap();
                    let changed = i.get_real(&OUTPUTS).unwrap();
                    i.set_real(&[v.reference], &[here]).unwrap();
                    changed
                }
            };
            for k in 0..7 {
                assert!(base[k] == changed[k] || depends_at_start(k + 1, index), "{} depends on {v}", at(k + 1));
            }
        }
    }
    // After initialisation, the input on the rigid and on the flexible axis.
    for structure in [1, 2] {
        let mut i = instance();
        i.set_integer(&[reference("structure")], &[structure]).unwrap();
        i.initialize(0.0, None).unwrap();
        let base = i.get_real(&OUTPUTS).unwrap();
        i.set_real(&[T], &[0.01]).unwrap();
        let changed = i.get_real(&OUTPUTS).unwrap();
        (0..7).for_each(|k| assert!(base[k] == changed[k] || depends_on_input(k + 1), "{}", at(k + 1)));
    }
}

#[test]
fn bad_arguments_are_refused_with_a_reason_and_change_nothing() {
    let mut i = started(&[]);
    let _ = steps(&mut i, 0, 5);
    let before = i.get_real(&OUTPUTS).unwrap();
    let nan = f64::NAN;
    macro_rules! refuse {
        ($what:expr, $i:ident => $call:expr) => {{
            let mut other = started(&[]);
            let _ = steps(&mut other, 0, 5);
            let $i = &mut other;
            let done = $call;
            assert!(done.is_err(), "{}", $what);
            let said = log($i);
            assert!(said.contains("fmi2Error logStatusError") && said.contains($what), "{}: {said}", $what);
            assert_eq!(before, $i.get_real(&OUTPUTS).unwrap(), "{}", $what);
        }};
    }
    refuse!("value reference 77", i => i.get_real(&[77]));
    refuse!("value reference 4294967295", i => i.get_real(&[u32::MAX]));
    refuse!("no Real variable", i => i.get_real(&[reference("structure")]));
    refuse!("no Integer or Enumeration variable", i => i.get_integer(&[T]));
    refuse!("no Boolean variable", i => i.get_boolean(&[T]));
    refuse!("no String variable", i => i.get_string(&[T]));
    refuse!("no String variable", i => i.set_string(&[T], &["x"]));
    refuse!("T = NaN", i => i.set_real(&[T], &[nan]));
    refuse!("T = inf", i => i.set_real(&[T], &[f64::INFINITY]));
    refuse!("I1 = -1.0", i => i.set_real(&[reference("I1")], &[-1.0]));
    refuse!("theta1_0 (Fixed", i => i.set_real(&[reference("theta1_0")], &[1.0]));
    refuse!("alpha1 (Continuous Output)", i => i.set_real(&[OUTPUTS[2]], &[1.0]));
    refuse!("structure", i => i.set_integer(&[reference("structure")], &[2]));
    // All or nothing.
    refuse!("value reference 999", i => i.set_real(&[reference("K"), 999], &[1.0, 1.0]));
    refuse!("communicationStepSize = 0", i => i.do_step(5.0 * DT, 0.0));
    refuse!("communicationStepSize = -1", i => i.do_step(5.0 * DT, -1.0));
    refuse!("communicationStepSize = NaN", i => i.do_step(5.0 * DT, nan));
    refuse!("currentCommunicationPoint = 0", i => i.do_step(0.0, DT));
    refuse!("currentCommunicationPoint = NaN", i => i.do_step(nan, DT));
    refuse!("internal steps", i => i.do_step(5.0 * DT, 1e9));
    refuse!("startTime", i => { i.reset().unwrap(); let r = i.setup_experiment(None, nan, None); i.initialize(0.0, None).unwrap(); let _ = steps(i, 0, 5); r });
}

#[test]
fn a_step_past_the_stop_time_is_refused() {
    let mut i = instance();
    i.initialize(0.0, Some(2.0 * DT)).unwrap();
    let _ = steps(&mut i, 0, 2);
    assert!(i.do_step(2.0 * DT, DT).is_err());
    assert!(log(&i).contains("stop time"));
}

#[test]
fn a_motion_without_bounds_ends_in_the_error_mode_and_a_stored_state_leads_back() {
    // Newmark's explicit end (alpha = 0) with a step far beyond its limit of stability.
    let mut i = started(&[("newmark.alpha", 0.0), ("newmark.delta", 0.5), ("dt_internal", 100.0)]);
    i.set_real(&[T], &[1.0]).unwrap();
    let state = i.get_state().unwrap();
    let mut time = 0.0;
    let status = loop {
        match i.do_step_status(time, 90.0, true).unwrap() {
            Status::Ok => time += 90.0,
            other => break other,
        }
        assert!(time < 90.0 * 1000.0);
    };
    assert_eq!(status, Status::Error);
    assert!(log(&i).contains("no longer finite"));
    assert!(i.do_step(time, 1.0).is_err());
    i.set_state(&state).unwrap();
    i.do_step(0.0, 1e-3).unwrap();
    i.free_state(state).unwrap();
}

#[test]
fn tuning_in_motion_is_a_jump_of_the_torques_alone() {
    let mut i = started(&[]);
    let _ = steps(&mut i, 0, 40);
    let before = i.get_real(&OUTPUTS).unwrap();
    set(&mut i, "load_motor.torque", 0.01);
    let after = i.get_real(&OUTPUTS).unwrap();
    for k in [0, 1, 3, 4, 5, 6] {
        assert_eq!(before[k], after[k]);
    }
    assert!((before[2] - after[2] - 0.01 / 2.37e-4).abs() < 1e-9 * before[2].abs().max(1.0));
}

#[test]
fn instantiation_takes_only_its_own_guid_and_kind_and_a_name() {
    let make = |name: &str, guid: &str| {
        let options = InstanceOptions { name: name.to_owned(), guid: guid.to_owned(), ..Default::default() };
        fmu().instantiate_with(&options).map(drop)
    };
    let guid = fmu().description.guid.clone();
    make("a", &guid).unwrap();
    assert!(make("a", "{00000000-0000-0000-0000-000000000000}").unwrap_err().to_string().contains("GUID"));
    assert!(make("", &guid).unwrap_err().to_string().contains("instanceName"));
    assert_eq!(instance().version().unwrap(), "2.0");
    assert_eq!(instance().types_platform().unwrap(), "default");
}

#[test]
fn logging_follows_the_categories() {
    let mut i = started(&[]);
    // A percent sign in nothing we log can be taken for a format; errors come without being asked for.
    assert!(i.get_real(&[999]).is_err());
    assert_eq!(i.take_log()[0].category, "logStatusError");
    i.set_debug_logging(false, &["logStatusError"]).unwrap();
    assert!(i.get_real(&[999]).is_err());
    assert!(i.take_log().is_empty());
    i.set_debug_logging(true, &["logAll"]).unwrap();
    assert_eq!(i.step_status().ok(), None);
    assert_eq!(i.take_log()[0].category, "logStatusDiscard");
    assert!(i.set_debug_logging(true, &["logNonsense"]).is_err());
    assert_eq!(i.last_successful_time().unwrap(), 0.0);
    assert!(!i.terminated().unwrap());
}

#[test]
fn the_start_values_of_the_description_are_those_of_the_binary() {
    let mut i = instance();
    i.setup_experiment(None, 0.0, None).unwrap();
    i.enter_initialization().unwrap();
    let starts = Starts::default();
    for index in 0..COUNT {
        let v = at(index);
        match (v.causality, v.kind) {
            (Causality::Output, _) => {}
            (_, Type::Real) => assert_eq!(i.get_real(&[v.reference]).unwrap(), [starts.values[index]], "{v}"),
            (_, Type::Enumeration(_)) => {
                assert_eq!(i.get_integer(&[v.reference]).unwrap()[0] as f64, starts.values[index], "{v}");
            }
        }
    }
}

/// "file" with or without an authority (FMI 2.0.4, section 2.1.5), and folders that are not there: all that the FMU needs is in
/// its binary.
#[test]
fn the_run_is_the_same_however_the_uri_of_the_resources_is_written() {
    let long = fmu().resources();
    assert!(long.starts_with("file:///"), "{long}");
    let run = |resources: &str| {
        let (name, guid) = ("axis".to_owned(), fmu().description.guid.clone());
        let options = InstanceOptions { name, guid, resources: resources.to_owned(), ..Default::default() };
        let mut i = fmu().instantiate_with(&options).unwrap_or_else(|e| panic!("{resources}: {e}"));
        ROUGH.iter().for_each(|(name, value)| set(&mut i, name, *value));
        i.initialize(0.0, None).unwrap();
        steps(&mut i, 0, 50)
    };
    let expected = run(&long);
    for other in
        [&*long.replacen("file:///", "file:/", 1), "file:/nowhere/resources", "file:///C:/my%20FMU/resources", ""]
    {
        assert_eq!(run(other), expected, "{other}");
    }
}
