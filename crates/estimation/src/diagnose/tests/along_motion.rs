//! What is told along the motion of one run against a simulation of each model.

use super::*;
use crate::trace::numerics::dot;

#[test]
fn what_a_parameter_changes_along_the_motion_is_what_it_changes_in_a_simulation() {
    let mut effects = Settings::default();
    let on: [(Effect, &[f64]); 6] = [
        (Effect::CoulombMotor, &[3.0, 0.4, 0.3, 0.1, 0.0]),
        (Effect::ViscousMotor, &[1.5, 0.0]),
        (Effect::PreslidingMotor, &[2.0, 0.01, 0.0]),
        (Effect::Gravity, &[4.0, 0.5]),
        (Effect::Saturation, &[6.0]),
        (Effect::Delay, &[3e-3]),
    ];
    for (effect, values) in on {
        effects.of_mut(effect)[..values.len()].copy_from_slice(values);
    }
    let record = logged(effects, 1.0, 0.0, |_| 0.0, 5);
    let model = Model::new(parameters(INERTIA), Structure::Rigid, effects);
    let bandwidth = [0.2 / DT; 2];
    let simulated = |m: &Model| track(m, &record, bandwidth, steps_per_sample(m, &record)).expect("a run").torque;
    let own = simulated(&model);
    let (_, trajectory) =
        track_step_by_step(&model, &record, bandwidth, steps_per_sample(&model, &record)).expect("a run");
    for (effect, i) in on.iter().flat_map(|(e, values)| (0..values.len()).map(|i| (*e, i))) {
        let mut other = model;
        let value = &mut other.effects.of_mut(effect)[i];
        *value += 0.02 * value.abs().max(effect.info().parameters[i].nominal);
        let [with, without] = [&other, &model].map(|m| trajectory.resisted(m, &record, [effect]));
        let along = |k: usize| with[0][k] + with[1][k] - without[0][k] - without[1][k];
        // As a hat over some samples sees both: where friction turns they differ by a sample.
        let smooth = |y: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (50..record.len() - 50).step_by(10).map(|k| (k - 20..k + 20).map(y).sum::<f64>() / 40.0).collect()
        };
        let moved = simulated(&other);
        let (a, b) = (smooth(&along), smooth(&|k| moved[0][k] - own[0][k]));
        let (size, alike) = (dot(&a, &b) / dot(&b, &b), dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt());
        assert!((size - 1.0).abs() < 0.05 && alike > 0.99, "{effect:?} {i}: {size} {alike}");
    }
}

/// What is off, in power over what a change of a model makes, where it is told along the motion of a run of the model and not simulated.
fn off_along_the_motion(record: &Record, model: Model, other: &Model) -> f64 {
    let (searched, _) = prepared(record, &model, Reach::Ruled);
    let problem = Problem::of(&searched.record, &searched.band, model, searched.peak);
    let given = problem.given(&model).expect("a run");
    let along = problem.along_the_motion_of(&given);
    let rows = |p: &Problem<'_>| p.rows(other, given.bandwidth, Some(given.discrepancy)).expect("a run").rows;
    let steps = problem.steps();
    let told = rows(&along);
    assert_eq!(problem.steps(), steps, "nothing is simulated");
    let own = rows(&problem);
    let power = |a: &[Vec<C>; 2], b: &[Vec<C>; 2]| -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).norm_sqr()).sum()
    };
    power(&told, &own) / power(&own, &given.rows.rows)
}

#[test]
fn what_another_model_lacks_along_the_motion_of_one_is_what_its_own_simulation_lacks() {
    let effects = with(&[(Effect::CoulombMotor, 0, 3.0), (Effect::ViscousMotor, 0, 1.5)]);
    let record = logged(effects, 1.0, 0.0, |_| 0.0, 5);
    let bare = Model::new(parameters(INERTIA), Structure::Rigid, Settings::default());
    // Inertia, effects, and the share of what changes, in power, that may be off.
    type Values = &'static [(Effect, usize, f64)];
    let others: [(f64, Values, f64); 5] = [
        (1.4, &[], 1e-9),
        (1.0, &[(Effect::ActuatorLag, 0, 0.02)], 1e-4),
        (
            1.2,
            &[
                (Effect::MotorMode, 0, 0.3 * INERTIA),
                (Effect::MotorMode, 1, 300.0 * INERTIA),
                (Effect::MotorMode, 2, INERTIA),
            ],
            1e-4,
        ),
        // A simulation comes to rest at the reversals.
        (0.8, &[(Effect::CoulombMotor, 0, 2.0)], 1e-2),
        (1.1, &[(Effect::PreslidingMotor, 0, 3.0), (Effect::PreslidingMotor, 1, 0.02)], 1e-2),
    ];
    for (i, (inertia, effects, share)) in others.into_iter().enumerate() {
        let other = Model { parameters: parameters(inertia * INERTIA), effects: with(effects), ..bare };
        let off = off_along_the_motion(&record, bare, &other);
        assert!(off <= share, "{i}: {off}");
    }
}

/// A light joint on a slow way to and fro, rad, at times, s, under a torque of its speed and the time, N.m.
fn slow_joint(torque: impl Fn(f64, f64) -> f64) -> Record {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let times = || (0..SAMPLES).map(|k| DT * f64::from(k));
    let theta = times().map(|t| 0.6 * (0.9 * t).sin() + noise(&mut rng, 1e-6)).collect();
    let torque = times().map(|t| torque(0.54 * (0.9 * t).cos(), t)).collect();
    of_one_encoder(0.0, torque, theta)
}

#[test]
fn the_motion_as_measured_is_known_of_a_light_axis_whose_torque_is_not() {
    let record = slow_joint(|_, t| 3.0 * (1.7 * t + 1.0).sin());
    let model = Model::new(parameters(0.02), Structure::Rigid, Settings::default());
    let (searched, _) = prepared(&record, &model, Reach::Ruled);
    let problem = Problem::of(&searched.record, &searched.band, model, searched.peak);
    let given = problem.given(&model).expect("a run");
    let off = |problem: &Problem<'_>| {
        let motion = problem.motion_of(&given).expect("a motion");
        let theta = searched.record.channels[0].as_ref().expect("measured");
        motion.iter().zip(theta).skip(theta.len() / 10).map(|(m, y)| (m[0] - y).abs()).fold(0.0, f64::max)
    };
    // The axis as given is dragged after it by a torque that it does not know of.
    let (own, measured) = (off(&problem), off(&problem.along_the_measured_motion()));
    assert!(own > 0.1 && measured < 0.02, "{own} {measured}");
    // Where it is given no look beside a fit goes along that one's motion.
    let band = searched.band.with_motion_given();
    let problem = Problem::of(&searched.record, &band, model, searched.peak).along_what_is_given();
    let beside = off(&problem.along_the_motion_of(&given));
    assert!(beside < 0.02, "{beside}");
}

#[test]
fn a_friction_that_holds_the_model_leaves_the_torque_of_the_motion_and_one_that_slides_does_not() {
    let coulomb =
        |level: f64| Model::new(parameters(0.02), Structure::Rigid, with(&[(Effect::CoulombMotor, 0, level)]));
    let foreign = slow_joint(|_, t| 3.0 * (1.7 * t + 1.0).sin());
    let own = slow_joint(|v, _| 3.0 * v.signum());
    for (record, level, leaves) in [(&foreign, 3.5, 0.9..2.0), (&own, 3.0, 0.0..0.1)] {
        let (searched, _) = prepared(record, &coulomb(0.0), Reach::Ruled);
        let problem = searched.problem(coulomb(0.0));
        let (model, bandwidth) = (coulomb(level), problem.bandwidth([0.0; 2]));
        // Along its own motion it lacks little either way.
        let run = problem.track(&model, bandwidth).expect("a run");
        let own = rms(&searched.band.filtered(&run.torque[0])) / searched.torque_rms;
        assert!(own < 0.25, "{own}");
        let at = problem.along(&model, bandwidth).expect("a run");
        let left = searched.band.torque_share(at.s, &searched.record);
        assert!(leaves.contains(&left), "{level}: {left}");
    }
}

#[test]
fn what_a_light_joint_may_have_is_told_by_where_it_was_and_not_by_where_its_torque_would_have_taken_it() {
    // Half a turn to and fro under a friction that is nearly all of its torque.
    let way = |t: f64| 1.5 * (0.9 * t).sin();
    let times = || (0..SAMPLES).map(|k| DT * f64::from(k));
    let theta = times().map(way).collect();
    let torque = times().map(|t| 3.0 * (1.35 * (0.9 * t).cos()).signum()).collect();
    let record = of_one_encoder(0.0, torque, theta);
    let model = Model::new(parameters(0.002), Structure::Rigid, Settings::default());
    let (searched, _) = prepared(&record, &model, Reach::Ruled);
    let problem = Problem::of(&searched.record, &searched.band, model, searched.peak);
    let alone = problem.given(&model).expect("a run");
    let scales = Scales::new(&problem, &alone).expect("a run");
    let admits = |effect: Effect, size: f64| {
        let model = Model::new(parameters(0.002), Structure::Rigid, with(&[(effect, 0, size)]));
        scales.admit(&searched.record, &model, std::iter::once(effect))
    };
    assert!(admits(Effect::Gravity, 2.0) && !admits(Effect::Unbalance, 2.0));
    assert!(admits(Effect::CoulombMotor, 3.0) && !admits(Effect::CoulombMotor, 5.0));
}

#[test]
fn a_limit_that_swallows_more_of_what_a_torque_varies_by_than_it_passes_is_none() {
    // A weight of 10 N.m and a friction of 3 either way: of 13 and 7 a limit of 8 makes 8 and 7, one of 11.5 leaves three quarters.
    let times = || (0..SAMPLES).map(|k| DT * f64::from(k));
    let theta = times().map(|t| 1.5 * (0.9 * t).sin()).collect();
    let torque = times().map(|t| 10.0 + 3.0 * (0.9 * t).cos().signum()).collect();
    let record = of_one_encoder(0.0, torque, theta);
    let model = Model::new(parameters(0.002), Structure::Rigid, Settings::default());
    let (searched, _) = prepared(&record, &model, Reach::Ruled);
    let problem = searched.problem(model);
    let scales = Scales::new(&problem, &problem.given(&model).expect("a run")).expect("a run");
    let admits = |limit: f64| {
        let model = Model::new(parameters(0.002), Structure::Rigid, with(&[(Effect::Saturation, 0, limit)]));
        scales.admit(&searched.record, &model, std::iter::once(Effect::Saturation))
    };
    assert!(!admits(8.0) && admits(11.5));
}
