//! Rigid axes: what is named, and what is not.

use std::f64::consts::SQRT_2;

use super::*;
use crate::effects::TorqueHistory;
use crate::hypothesis::descent::Descent;
use crate::hypothesis::fit::STEPS;
use crate::numerics::level::rms;

#[test]
fn a_cause_that_acts_beyond_the_part_searched_joins_the_verdict() {
    let effects = with(&[(Effect::CoulombMotor, 0, 3.0), (Effect::EndStop, 0, 200.0), (Effect::EndStop, 1, 1.4)]);
    // The way reaches the stop in its second half.
    let way = |t: f64| (0.9 * t).sin() * if t < 6.0 { 0.8 } else { 1.5 };
    for (effects, late) in [(effects, true), (with(&[(Effect::CoulombMotor, 0, 3.0)]), false)] {
        let record = led(SAMPLES, way, effects, 0.0, |_| 0.0, 5);
        let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
        let noise = estimate_noise(&record.torque, &channels, None);
        let nominal = Model::new(parameters(INERTIA), Structure::Rigid, Settings::default());
        let case = case(&record, nominal, &noise);
        let (searched, _) = prepared(&record.part(0..2800), &nominal, Reach::Ruled);
        let found = decide(searched.search(&case, EFFECTS.to_vec(), &Work::default(), &|_| ()), None).chosen;
        assert_eq!(found.effects(), [Effect::CoulombMotor]);
        let (part, lacks) = searched.worst_beyond(&record, &case, &found.model).expect("a further part");
        let search = part.search(&case, EFFECTS.to_vec(), &Work::default(), &|_| ());
        assert!(!late || search.leaves_materially_less(&lacks, &found));
        let all = decide_further(search, &found).map(|d| d.chosen.effects());
        assert_eq!(all, late.then(|| vec![Effect::CoulombMotor, Effect::EndStop]));
    }
}

#[test]
fn a_bristle_whose_reach_is_not_known_is_dry_friction_though_that_was_never_fitted() {
    let (bristle, dry) = (Effect::PreslidingMotor, Effect::CoulombMotor);
    let record = logged(with(&[(dry, 0, 3.0), (Effect::ViscousMotor, 0, 1.5)]), 1.0, 0.05, |_| 0.0, 5);
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let noise = estimate_noise(&record.torque, &channels, None);
    let nominal = Model::new(parameters(INERTIA), Structure::Rigid, Settings::default());
    let (searched, _) = prepared(&record, &nominal, Reach::Ruled);
    let search = searched.search(&case(&record, nominal, &noise), EFFECTS.to_vec(), &Work::default(), &|_| ());
    let start =
        Model { effects: with(&[(Effect::ViscousMotor, 0, 1.5), (bristle, 0, 3.0), (bristle, 1, 1e-5)]), ..nominal };
    let terms = [(Effect::ViscousMotor, 0), (bristle, 0)];
    let mut fit = search.problem.fit(&start, &terms, [f64::MAX; 2], STEPS).expect("a fit");
    let reach = fit.coordinates.iter().position(|c| c.free == Free::Effect(bristle, 1)).expect("a reach");
    for (error, told) in [(1e-9, None), (1.0, Some([Effect::CoulombMotor, Effect::ViscousMotor]))] {
        fit.std[reach] = error;
        let simple = search.simplified(&fit, 1.0, &[]);
        assert_eq!(simple.as_ref().map(Fit::effects), told.map(Vec::from));
        assert!(simple.is_none_or(|f| (f.model.effects.of(dry)[0] / 3.0 - 1.0).abs() < 0.02));
    }
}

#[test]
fn a_bristle_is_not_told_as_the_dry_friction_of_another_axis() {
    let (bristle, dry) = (Effect::PreslidingMotor, Effect::CoulombMotor);
    let record = logged(with(&[(dry, 0, 3.0)]), 1.0, 0.05, |_| 0.0, 5);
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let noise = estimate_noise(&record.torque, &channels, None);
    // The friction's own fit has the true inertia, which is nearly as far off as it may be; the bristle's is held where it is not.
    let nominal = Model::new(parameters(INERTIA / 4.5), Structure::Rigid, Settings::default());
    let (searched, _) = prepared(&record, &nominal, Reach::Ruled);
    let mut search = searched.search(&case(&record, nominal, &noise), EFFECTS.to_vec(), &Work::default(), &|_| ());
    search.gap = [1.0; 2];
    let start = Model { effects: with(&[(bristle, 0, 3.0), (bristle, 1, 1e-5)]), ..nominal };
    let mut fit = search.problem.fit(&start, &[(bristle, 0)], [f64::MAX; 2], 0).expect("a run");
    let coordinates = fit.coordinates.iter();
    fit.std = coordinates.map(|c| if c.free == Free::Effect(bristle, 1) { 1.0 } else { 1e-9 }).collect();
    let given = search.problem.given(&nominal).expect("a run");
    let simple = search.simplified(&fit, 1.0, &[]).expect("a likelier fit");
    assert!(simple.model.parameters.i1 > 4.1 * nominal.parameters.i1);
    let told = search.conclude(given.clone(), given, fit, Vec::new());
    assert_eq!(told.chosen.effects(), [bristle]);
}

#[test]
fn an_inertia_alone_stays_what_the_motion_has_where_friction_is_most_of_the_torque() {
    // To and fro at a constant speed. With the torque given the friction would make an inertia of ten times as much.
    let way = |t: f64| 0.5 * (0.6 * t).sin().asin();
    let record = led(SAMPLES, way, with(&[(Effect::CoulombMotor, 0, 20.0)]), 1e-3, |t| 2.0 * (1.1 * t).sin(), 7);
    let o = diagnosed(&record, INERTIA);
    let off = o.models[1].parameters.i1 / INERTIA;
    assert!((0.7..1.4).contains(&off), "{off}");
    assert_eq!(named(&o), ["dry_friction"], "{:?}", ranking(&o));
}

#[test]
fn the_friction_of_a_slow_joint_is_told_where_its_inertia_needs_next_to_none_of_the_torque() {
    // Inertia: 0.2 N.m rms; friction: 2.8; beside it a torque of 0.4 that no law follows. With the torque given nothing is told beside an
    // inertia that does not run off.
    let wanted = |t: f64| 0.4 * ((0.4 * t).sin() + 0.4 * (0.93 * t).sin());
    let wanders = |t: f64| 0.4 * ((0.31 * t * t).sin() + (0.17 * t * t + 1.0).cos());
    let friction = with(&[(Effect::ViscousMotor, 0, 12.0), (Effect::CoulombMotor, 0, 1.2)]);
    let o = diagnosed(&led(10_000, wanted, friction, 0.05, wanders, 5), INERTIA);
    assert_eq!(named(&o), ["dry_friction", "viscous_friction"], "{:#?}", ranking(&o));
    let [viscous, ..] = *o.improved.effects.of(Effect::ViscousMotor) else { unreachable!() };
    assert!((viscous / 12.0 - 1.0).abs() < 0.15, "{viscous}");
}

#[test]
fn causes_before_all_of_which_the_inertia_runs_off_are_found_at_once() {
    // Once to and fro at a constant speed: friction either way, a load and a ripple are nearly all of the torque.
    let way = |t: f64| 0.03 * (3.0 * t).sin().asin();
    let effects = with(&[
        (Effect::CoulombMotor, 0, 1.0),
        (Effect::ViscousMotor, 0, 75.0),
        (Effect::ViscousMotor, 1, -0.475),
        (Effect::LoadMotor, 0, -1.9),
        (Effect::TorqueRipple, 0, 0.55),
        (Effect::TorqueRipple, 1, 1800.0),
    ]);
    for seed in 0..2 {
        let o = diagnosed(&led(800, way, effects, 1e-4, |t| 0.01 * (31.0 * t).sin(), seed), INERTIA);
        assert_eq!(
            named(&o),
            ["dry_friction", "load_torque", "torque_ripple", "viscous_friction"],
            "{:?}",
            ranking(&o)
        );
        let off = o.models[2].parameters.i1 / INERTIA;
        assert!((off - 1.0).abs() < 0.01, "{off}");
    }
}

/// A log of a constant torque, by a load or by friction, along a way on and on, beside a torque that wanders slowly and is small beside it.
fn onwards(effect: Effect, wander: f64) -> Record {
    let way = |t: f64| 2.0 * t - 1.8 * (0.9 * t).sin();
    // Without its start from rest, where friction holds and a load does not.
    led(SAMPLES, way, with(&[(effect, 0, 0.5)]), 1e-4, |t| wander * (1.3 * t).sin(), 5).part(500..6000)
}

#[test]
fn a_friction_and_a_load_are_not_told_apart_where_the_axis_never_goes_back() {
    for effect in [Effect::LoadMotor, Effect::CoulombMotor] {
        let o = diagnosed(&onwards(effect, 0.03), INERTIA);
        let families: Vec<[&str; 2]> =
            o.decision.confusable.iter().map(|c| [c.named, c.other].map(|e| e.info().family.as_str())).collect();
        assert_eq!(families, [["dry_friction", "load_torque"]], "{:?} {:?}", named(&o), ranking(&o));
        // Every axis has friction, few carry a weight: five to one by the effects' own odds, less what is doubted beside the rest.
        let [friction, load] = [Effect::CoulombMotor, Effect::LoadMotor].map(|e| e.info().odds);
        let told = 0.5..friction / (friction + load);
        assert!(o.decision.probabilities.iter().all(|p| told.contains(p)), "{:?}", o.decision.probabilities);
    }
}

#[test]
fn what_follows_a_wandering_torque_is_no_cause() {
    for effect in [Effect::LoadMotor, Effect::CoulombMotor] {
        let o = diagnosed(&onwards(effect, 0.05), INERTIA);
        let causes: Vec<Effect> = o.diagnosis.causes.iter().map(|c| c.effect).collect();
        assert!(
            [vec![Effect::CoulombMotor], vec![Effect::LoadMotor]].contains(&causes),
            "{causes:?} {:?}",
            ranking(&o)
        );
        let pair =
            |c: &crate::diagnose::weighing::Confusable| [c.named, c.other] == [Effect::CoulombMotor, Effect::LoadMotor];
        assert!(o.decision.confusable.iter().any(pair), "{:?}", ranking(&o));
    }
}

#[test]
fn a_stage_with_nothing_hidden_has_no_cause_whatever_the_noise_of_its_torque() {
    for (noise, nominal) in [(1e-9, INERTIA), (0.2, INERTIA), (0.05, 1.2 * INERTIA)] {
        let o = diagnosed(&logged(Settings::default(), 1.0, noise, |_| 0.0, 1), nominal);
        assert!(matches!(o.decision.verdict, Verdict::NoGap | Verdict::Parameters), "{noise}: {:?}", named(&o));
        assert!((o.models[1].parameters.i1 / INERTIA - 1.0).abs() < 0.02, "{:?}", o.models[1].parameters);
    }
}

#[test]
fn three_hundredths_of_the_torque_are_a_gap_where_they_are_not_noise() {
    // Nothing may be named, as where the library lacks what a machine has.
    let all: Vec<Family> = EFFECTS.iter().map(|e| e.info().family).collect();
    let told = |noise: f64, foreign: f64| {
        let record = logged(Settings::default(), 1.0, noise, |t| foreign * (1.7 * t).sin(), 3);
        let o = diagnosed_without(&all, &record, Structure::Rigid, parameters(INERTIA));
        (o.decision.verdict, o.diagnosis.remainder.share)
    };
    let torque = rms(&logged(Settings::default(), 1.0, 0.0, |_| 0.0, 3).torque);
    let (verdict, share) = told(0.03 * torque, 0.0);
    assert!(verdict == Verdict::NoGap && share < 0.03, "{verdict:?} {share}");
    let (verdict, share) = told(1e-9, 0.03 * SQRT_2 * torque);
    assert!(verdict == Verdict::Unexplained && (0.015..0.04).contains(&share), "{verdict:?} {share}");
    // What no drive is true to.
    let (verdict, share) = told(1e-9, 0.005 * SQRT_2 * torque);
    assert!(matches!(verdict, Verdict::NoGap | Verdict::Parameters) && share < 0.01, "{verdict:?} {share}");
}

#[test]
fn friction_and_a_bias_are_named_with_their_sizes_at_the_axis() {
    let hidden = [(Effect::CoulombMotor, 0, 1.5), (Effect::ViscousMotor, 0, 2.0), (Effect::LoadMotor, 0, 0.8)];
    let o = diagnosed(&logged(with(&hidden), 1.0, 0.02, |t| 0.02 * (0.31 * t * t).sin(), 2), 1.1 * INERTIA);
    assert_eq!(named(&o), ["dry_friction", "load_torque", "viscous_friction"], "{:#?}", ranking(&o));
    for (effect, i, value) in hidden {
        let got = o.improved.effects.of(effect)[i];
        assert!((got / value - 1.0).abs() < 0.03, "{effect:?} {got}");
    }
    assert!(o.diagnosis.causes.iter().all(|c| c.site == Site::Axis), "{:?}", o.diagnosis.causes);
    let remainder = o.diagnosis.remainder;
    assert!(remainder.share < 0.05 && remainder.site == Site::Axis, "{remainder:?}");
}

#[test]
fn gravity_is_told_from_a_spring_where_the_hinge_turns_far_enough() {
    let hidden = [(Effect::Gravity, 0, 6.0), (Effect::CoulombMotor, 0, 0.5)];
    let o = diagnosed(&logged(with(&hidden), 1.2, 0.02, |_| 0.0, 3), INERTIA);
    assert_eq!(named(&o), ["dry_friction", "gravity"]);
    assert!((o.improved.effects.of(Effect::Gravity)[0] / 6.0 - 1.0).abs() < 0.02);
}

/// A record of an axis that is driven by a torque, with no controller.
fn driven(n: u32, torque: impl Fn(f64) -> f64, effects: Settings, seed: u64) -> Record {
    let axis = Axis::new(parameters(INERTIA), Structure::Rigid, effects, Scheme::Exact, DT);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut state = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let mut history = TorqueHistory::constant(0.0);
    let (mut given, mut theta) = (Vec::new(), Vec::new());
    for k in 0..n {
        let t = f64::from(k) * DT;
        given.push(torque(t));
        theta.push(state.theta1() + noise(&mut rng, 1e-6));
        let logged = Ramp { start: torque(t), end: torque(t) };
        let acts = effects.transform_input(axis.on(), logged, DT, &mut history);
        state = axis.advance(&state, acts, t);
    }
    of_one_encoder(0.0, given, theta)
}

#[test]
fn a_weight_of_many_times_the_torque_is_told_of_a_hinge_that_swings() {
    // The torque is in step with the swing, as where a weak drive swings a pendulum up.
    let hidden = [(Effect::Gravity, 0, 8.0), (Effect::ViscousMotor, 0, 0.3)];
    let record = driven(SAMPLES, |t| 0.9 * (1.9 * t).sin(), with(&hidden), 3);
    let swing = record.channels[0].iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!((0.6..1.5).contains(&swing), "{swing}");
    let o = diagnosed(&record, INERTIA);
    assert_eq!(named(&o), ["gravity", "viscous_friction"], "{:#?}", ranking(&o));
    assert!((o.improved.effects.of(Effect::Gravity)[0] / 8.0 - 1.0).abs() < 0.02);
}

#[test]
fn a_dead_zone_is_told_as_wide_as_it_is_from_a_command_that_changes_faster_than_the_motion() {
    let width = 1.0;
    let effects = with(&[(Effect::DeadZone, 0, width), (Effect::ActuatorLag, 0, 6e-3)]);
    let torque = |t: f64| {
        let slow: f64 = [(2.0, 3.0), (1.5, 7.1), (1.0, 12.3)].iter().map(|(a, w)| a * (w * t).sin()).sum();
        slow + if (t / DT).round() as i64 % 4 < 2 { 0.7 } else { -0.7 }
    };
    let o = diagnosed(&driven(SAMPLES, torque, effects, 5), INERTIA);
    assert!(named(&o).contains(&"dead_zone"), "{:?}", ranking(&o));
    let found = o.improved.effects.of(Effect::DeadZone)[0];
    assert!((found / width - 1.0).abs() < 0.01 && o.diagnosis.remainder.share < 1e-3, "{found} {:?}", ranking(&o));
}

#[test]
fn two_causes_are_told_where_three_others_leave_nothing_either() {
    // A weight on a hinge nearly follows a spring that rests elsewhere, and a load beside it does the rest.
    let effects =
        with(&[(Effect::DeadZone, 0, 2.5), (Effect::ExternalSpring, 0, 20.0), (Effect::ExternalSpring, 1, 0.8)]);
    for phase in [0.0, 3.0] {
        let sine = |t: f64, j: f64| 3.0 * (3.0 * j * t + phase + 0.4 * j * j).sin();
        let torque = |t: f64| (1..9).map(|j| sine(t, f64::from(j))).sum();
        let o = diagnosed(&driven(512, torque, effects, 3), INERTIA);
        assert_eq!(named(&o), ["dead_zone", "external_spring"], "{:?}", ranking(&o));
    }
}

#[test]
fn a_spring_ten_times_too_stiff_lacks_what_it_pulls_too_much_and_rests_nowhere_else() {
    let (own, wrong) = (40.0, 400.0);
    let with_spring = |k: f64| with(&[(Effect::ExternalSpring, 0, k)]);
    let record = logged(with_spring(own), 1.0, 0.02, |_| 0.0, 3);
    let model = Model::new(parameters(INERTIA), Structure::Rigid, with_spring(wrong));
    let (searched, _) = prepared(&record, &model, Reach::Ruled);
    let problem = Problem::new(&searched.record, &searched.band, model);
    let rows = |bandwidth| problem.rows(&model, bandwidth, None).expect("followed");
    let lacks = |rows: &TorqueResidual| searched.band.torque_share(searched.band.discrepancy(rows), &searched.record);
    let tight = rows(problem.bandwidth([f64::MAX; 2]));
    // Along its own motion, held so loosely, it rests where it asks for the torque that it got.
    let own = |bandwidth| {
        let run = problem.track(&model, bandwidth).expect("followed");
        rms(&searched.band.filtered(&run.torque[0])) / searched.torque_rms
    };
    let bandwidths = [problem.bandwidth([f64::MAX; 2]), problem.loosest(&model, &tight), problem.bandwidth([0.0; 2])];
    let [held, loosest, free] = bandwidths.map(own);
    assert!(loosest > 0.5 * held && free < 0.1 * held, "{held} {loosest} {free}");
    // That is none that the axis took, and what it lacks is told along the one that it did.
    let told = lacks(&rows(problem.bandwidth([0.0; 2])));
    assert!(told > 0.9 * lacks(&tight), "{told} {}", lacks(&tight));
}

#[test]
fn a_torque_that_the_library_has_no_law_for_is_not_named() {
    // Wanders with the square root of the position's absolute value, of no sign of its own in time.
    let o = diagnosed(
        &logged(Settings::default(), 1.0, 0.01, |t| 2.0 * ((0.31 * t * t).sin() * (1.7 * t).sin()).cbrt(), 4),
        INERTIA,
    );
    assert!(
        o.decision.verdict == Verdict::Unexplained || o.diagnosis.causes.iter().all(|c| c.probability < 0.9),
        "{:?}",
        o.diagnosis.causes
    );
}

#[test]
fn a_third_inertia_on_a_spring_is_found_at_its_frequency() {
    let hidden = [(Effect::MotorMode, 0, 0.8), (Effect::MotorMode, 1, 12.8), (Effect::MotorMode, 2, 0.16)];
    let o = diagnosed(&logged(with(&hidden), 1.0, 0.01, |_| 0.0, 5), INERTIA);
    assert_eq!(named(&o), ["flexible_mode"], "{:#?}", ranking(&o));
    let [inertia, stiffness, _] = *o.improved.effects.of(Effect::MotorMode) else { unreachable!() };
    assert!(((stiffness / inertia).sqrt() / 4.0 - 1.0).abs() < 0.02, "{inertia} {stiffness}");
    // The held-out third begins while it swings: that is no torque that the model lacks.
    let ways = o.diagnosis.gap.ways;
    assert!(ways[2].of == ClosureOf::Torque && ways[2].closure > 0.99, "{ways:?}");
}

#[test]
fn a_ripple_faster_than_the_motion_is_found_beyond_its_band() {
    // Up to 50 rad/s, under a motion of 0.9 and 2.3.
    let hidden = [(Effect::TorqueRipple, 0, 0.06), (Effect::TorqueRipple, 1, 30.0), (Effect::TorqueRipple, 2, 0.5)];
    let o = diagnosed(&logged(with(&hidden), 1.0, 1e-9, |_| 0.0, 6), INERTIA);
    assert_eq!(named(&o), ["torque_ripple"], "{:#?}", ranking(&o));
    assert!((o.improved.effects.of(Effect::TorqueRipple)[1] / 30.0 - 1.0).abs() < 1e-3);
}

#[test]
fn a_ripple_is_found_over_any_number_of_turns() {
    // A screw's cogging over forty turns, at 140 rad/s on the average: a thousand periods, six hundred of them in the part that fits see.
    let hidden = [(Effect::TorqueRipple, 0, 2.0), (Effect::TorqueRipple, 1, 24.0), (Effect::TorqueRipple, 2, 0.5)];
    let way = |t: f64| 6.0 * t - 1.5 * (1.1 * t).sin() + 0.1 * ((70.0 * t).sin() + (190.0 * t).sin());
    let o = diagnosed(&led(21_000, way, with(&hidden), 1e-9, |_| 0.0, 6), INERTIA);
    assert_eq!(named(&o), ["torque_ripple"], "{:#?}", ranking(&o));
    assert!((o.improved.effects.of(Effect::TorqueRipple)[1] / 24.0 - 1.0).abs() < 1e-3);
}

#[test]
fn a_small_cause_that_explains_next_to_all_that_a_large_one_leaves_is_named_beside_it() {
    let hidden = [
        (Effect::CoulombMotor, 0, 30.0),
        (Effect::TorqueRipple, 0, 0.8),
        (Effect::TorqueRipple, 1, 11.0),
        (Effect::TorqueRipple, 2, 0.4),
    ];
    let o = diagnosed(&logged(with(&hidden), 1.0, 1e-3, |_| 0.0, 9), INERTIA);
    assert_eq!(named(&o), ["dry_friction", "torque_ripple"], "{:#?}", ranking(&o));
    // A fiftieth of what the friction makes.
    assert!((o.improved.effects.of(Effect::TorqueRipple)[0] / 0.8 - 1.0).abs() < 0.05);
}

/// A motor with a third inertia on a spring, which swings from the record's first sample on where it is `plucked`.
fn with_a_mode(plucked: bool) -> Record {
    let mode = with(&[(Effect::MotorMode, 0, 0.7), (Effect::MotorMode, 1, 0.7 * 4900.0), (Effect::MotorMode, 2, 1.0)]);
    let axis = Axis::new(parameters(INERTIA), Structure::Rigid, mode, Scheme::Exact, DT);
    let mut state = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let acts = |t: f64| 3.0 * (4.0 * t).sin() + 2.0 * (9.0 * t + 1.0).cos() + 2.0 * (23.0 * t).sin() + (60.0 * t).cos();
    let before = if plucked { 140 } else { 0 };
    let (mut torque, mut theta) = (Vec::new(), Vec::new());
    for k in 0..before + 500 {
        let t = DT * f64::from(k);
        // A blow just before the record begins.
        let held = if k < before { if k + 12 > before { 40.0 } else { 0.0 } } else { acts(t) };
        if k >= before {
            torque.push(held);
            theta.push(state.theta1() + noise(&mut rng, 1e-6));
        }
        state = axis.advance(&state, Ramp { start: held, end: held }, t);
    }
    of_one_encoder(DT * f64::from(before), torque, theta)
}

#[test]
fn a_mode_that_swings_when_a_short_record_begins_is_no_sine_beside_it() {
    for plucked in [false, true] {
        let o = diagnosed(&with_a_mode(plucked), INERTIA);
        assert_eq!(named(&o), ["flexible_mode"], "{plucked} {:#?}", ranking(&o));
        let mode = o.improved.effects.of(Effect::MotorMode);
        let frequency = (mode[1] / mode[0]).sqrt();
        assert!((frequency / 70.0 - 1.0).abs() < 0.02, "{plucked} {frequency}");
    }
}

#[test]
fn a_sine_of_a_few_periods_is_no_mode_that_swung_from_the_beginning() {
    // Four periods: inertia, stiffness, damping, and how it swung at first follow any of them.
    let hidden = with(&[(Effect::Disturbance, 0, 0.3), (Effect::Disturbance, 1, 11.0), (Effect::Disturbance, 2, 1.9)]);
    for seed in [5, 7] {
        let o = diagnosed(&logged(hidden, 1.0, 1e-2, |_| 0.0, seed).part(0..180), INERTIA);
        assert!(!named(&o).contains(&"flexible_mode"), "{seed} {:#?}", ranking(&o));
    }
}

#[test]
fn a_log_read_early_is_followed_with_the_torque_to_come() {
    // Read 1.3 samples after its stamp: coasting there is off by half the acceleration times the square of that time.
    let (early, n) = (1.3 * DT, 400);
    let torque = |k: usize| [1.0, -2.0, 0.5, 3.0][k / 7 % 4];
    let axis = |h: f64| Axis::new(parameters(INERTIA), Structure::Rigid, Settings::default(), Scheme::Exact, h);
    let (to_reading, on) = (axis(early - DT), axis(2.0 * DT - early));
    let held = |k: usize| Ramp { start: torque(k), end: torque(k) };
    // A sample is read within the interval after the next one.
    let mut state = axis(DT).advance(&axis(DT).state(0.0, 0.0, 0.0, 0.0, 0.0), held(0), 0.0);
    let mut theta = Vec::new();
    for k in 0..n {
        let read = to_reading.advance(&state, held(k + 1), 0.0);
        theta.push(read.theta1());
        state = on.advance(&read, held(k + 1), 0.0);
    }
    let record = Record { noise: [1e-9; 4], ..of_one_encoder(0.0, (0..n).map(torque).collect(), theta) };
    let lacks = |delay: f64| {
        let latch = with(&[(Effect::Latch, 0, delay)]);
        let model = Model::new(parameters(INERTIA), Structure::Rigid, latch);
        let tracked = track(&model, &record, [2.0; 2], steps_per_sample(&model, &record)).expect("finite");
        tracked.torque[0][50..n - 50].iter().fold(0.0, |m: f64, t| m.max(t.abs()))
    };
    // What is left is the error of the speed at the record's begin, which the feedback takes out.
    assert!(lacks(-early) < 1e-3, "{}", lacks(-early));
    assert!(lacks(-early + 0.1 * DT) > 0.1, "{}", lacks(-early + 0.1 * DT));
}

#[test]
fn a_fit_near_the_noise_goes_on_to_where_the_noise_alone_is_left() {
    let record = with_a_mode(false);
    let model = Model::new(parameters(INERTIA), Structure::Rigid, Settings::default());
    let (searched, _) = prepared(&record, &model, Reach::Whole);
    let problem = Problem::of(&searched.record, &searched.band, model, searched.peak);
    let terms = [(Effect::MotorMode, 0)];
    let multiple = |f: &Fit| searched.band.noise_multiple(&f.rows);
    let mode = with(&[(Effect::MotorMode, 0, 0.7), (Effect::MotorMode, 1, 0.7 * 4900.0), (Effect::MotorMode, 2, 1.0)]);
    let truth = Model { effects: mode, ..model };
    let known = problem.fit(&truth, &terms, [f64::MAX; 2], STEPS).and_then(|f| problem.deepen(&f)).expect("a fit");
    for (off, is_near) in [(1.0, true), (1.001, true), (1.2, false)] {
        let start = Model { parameters: parameters(off * known.model.parameters.i1), ..known.model };
        let mut descent = Descent::new(&problem, &start, &terms, known.discrepancy).expect("a run");
        let before = descent.clone().done();
        assert!(!searched.band.at_floor(&before.rows));
        descent.try_noise_alone().expect("a run");
        let after = descent.done();
        let gain = after.log_likelihood - before.log_likelihood;
        assert_eq!(searched.band.at_floor(&after.rows), is_near, "{off}: {} {}", multiple(&before), multiple(&after));
        assert_eq!(gain > 10.0, is_near, "{off}: {gain}");
    }
}
