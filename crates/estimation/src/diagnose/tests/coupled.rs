//! Two inertias: an encoder on each side, or on the motor alone.

use super::*;

/// Two inertias that a controller of gains for position and speed, 1/s2 and 1/s, moves along a way, the motor's encoder alone read `n` times.
fn of_the_motor(
    parameters: Parameters,
    effects: Settings,
    (n, dt): (u32, f64),
    [position, speed]: [f64; 2],
    wanted: impl Fn(f64) -> f64,
    seed: u64,
) -> Record {
    let axis = Axis::new(parameters, Structure::TwoInertia, effects, Scheme::Exact, dt);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut state = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut torque, mut theta) = (Vec::new(), Vec::new());
    for k in 0..n {
        let t = f64::from(k) * dt;
        theta.push(state.theta1() + noise(&mut rng, 1e-6));
        let acts = (parameters.i1 + parameters.i2) * (position * (wanted(t) - state.theta1()) - speed * state.omega1());
        torque.push(acts);
        state = axis.advance(&state, Ramp { start: acts, end: acts }, t);
    }
    Record { dt, ..of_one_encoder(0.0, torque, theta) }
}

/// A soft belt that a slow controller moves on and on.
fn of_a_belt(belt: Parameters, seed: u64) -> Record {
    let way = |t: f64| 2.0 * t - 1.8 * (0.9 * t).sin() + 0.2 * (7.0 * t).sin();
    of_the_motor(belt, Settings::default(), (3000, DT), [100.0, 14.0], way, seed)
}

const BELT: Parameters = Parameters { i1: 1.26e-3, i2: 9.3e-4, b: 5.8e-4, k: 1.52, rho: 1.0 };

#[test]
fn an_encoder_on_the_motor_alone_tells_a_coupling_that_is_not_the_nominal_one() {
    for (seed, nominal) in
        [Parameters { i1: 1.13e-3, b: 6.8e-4, k: 1.91, ..BELT }, Parameters { i1: 1.4e-3, i2: 1.1e-3, k: 1.0, ..BELT }]
            .into_iter()
            .enumerate()
    {
        let o = diagnosed_as(&of_a_belt(BELT, seed as u64), Structure::TwoInertia, nominal);
        let p = &o.models[1].parameters;
        assert_eq!(o.decision.verdict, Verdict::Parameters, "{seed}: {:?}", named(&o));
        assert!(
            (p.k / BELT.k).ln().abs() < 0.03 && (p.i2 / BELT.i2).ln().abs() < 0.03,
            "{seed}: {p:?} {}",
            o.diagnosis.remainder.noise_multiple
        );
    }
}

/// What an axis without any effect lacks of a record of it, its parameters the true ones: its mean square in the noise's.
fn of_the_truth(record: &Record, model: &Model, reach: Reach) -> f64 {
    let (p, own) = prepared(record, model, reach);
    assert!(own.is_none());
    let given = Problem::of(&p.record, &p.band, *model, p.peak).given(model).expect("runs");
    p.band.noise_multiple(&given.rows).powi(2)
}

#[test]
fn an_axis_as_it_is_lacks_nothing_but_the_noise_of_its_encoder() {
    // The record begins and ends in the midst of a motion, the torque at one end is not the one at the other.
    let way = |t: f64| 0.5 * (1.1 * t).sin() + 0.2 * (2.3 * t).sin() + 0.02 * t * t;
    let rigid = |seed| {
        let record = led(SAMPLES, way, Settings::default(), 0.0, |_| 0.0, seed).part(400..5900);
        of_the_truth(&record, &Model::new(parameters(INERTIA), Structure::Rigid, Settings::default()), Reach::Ruled)
    };
    let coupled = |seed| {
        let model = Model::new(BELT, Structure::TwoInertia, Settings::default());
        of_the_truth(&of_a_belt(BELT, seed).part(300..3000), &model, Reach::Shown)
    };
    // In the mean of as many records as there are, of some thirty values each: one, and not a half or two.
    for (name, of) in [("rigid", &rigid as &dyn Fn(u64) -> f64), ("coupled", &coupled)] {
        let found: Vec<f64> = (0..8).map(of).collect();
        let mean = found.iter().sum::<f64>() / 8.0;
        assert!((0.5..2.0).contains(&mean), "{name}: {found:?}");
    }
}

#[test]
fn a_coupling_that_one_encoder_hardly_shows_is_as_likely_as_it_is() {
    // Below its resonance the motor shows I1 + I2 and I2^2/K: along that valley no stiffness may be told as far likelier than the true one.
    for seed in 0..4 {
        let record = of_a_belt(Parameters { k: 20.0, ..BELT }, seed).part(300..3000);
        let model = Model::new(Parameters { k: 20.0, ..BELT }, Structure::TwoInertia, Settings::default());
        let (p, _) = prepared(&record, &model, Reach::Shown);
        let problem = Problem::of(&p.record, &p.band, model, p.peak);
        let of = |f: &Fit| f.log_likelihood + f.log_prior;
        let truth = of(&problem.given(&model).expect("runs"));
        for fit in [1.06, 1.0 / 1.06].iter().flat_map(|r| problem.held_stiffnesses(*r, [f64::MAX; 2])) {
            let gained = of(&fit) - truth;
            assert!(gained < 5.0, "{seed}: {} {gained}", fit.model.parameters.k);
        }
    }
}

/// A search on a record of an axis with what it begins with.
fn searched<T>(record: &Record, nominal: Parameters, look: impl Fn(&mut Search<'_>) -> T) -> T {
    let nominal = Model::new(nominal, Structure::TwoInertia, Settings::default());
    let case = Case {
        machine: "axis".to_owned(),
        nominal,
        motion: AxisKind::Rotary,
        train: record,
        noise: &estimate_noise(&record.torque, &[0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref()), None),
        holdout: None,
        suspects: EFFECTS.to_vec(),
    };
    let (searched, _) = prepared(record, &nominal, Reach::Shown);
    let suspects =
        EFFECTS.iter().copied().filter(|e| e.may_be_named(Structure::TwoInertia, AxisKind::Rotary)).collect();
    look(&mut searched.search(&case, suspects, &Work::default(), &|_| ()))
}

/// Tones under which the paper's axis turns to and fro.
fn tones(t: f64) -> f64 {
    [(2.1, 0.3), (9.7, 4.1), (31.1, 5.3), (61.0, 1.1)].iter().map(|(w, p)| 0.05 * (w * t + p).sin()).sum()
}

#[test]
fn a_friction_and_a_delay_are_found_whose_parameters_run_off_before_both_are_there() {
    let paper = Parameters::PAPER;
    let mut record = moved(paper, with(&[(Effect::CoulombMotor, 0, 0.03)]), &tones, 0);
    // The drive's torque comes three samples after its command.
    record.torque = (0..record.torque.len()).map(|k| tones((k as f64 + 3.0) * record.dt)).collect();
    let o = diagnosed_as(&record, Structure::TwoInertia, paper);
    assert_eq!(named(&o), ["delay", "dry_friction"], "{:?}", o.diagnosis.causes);
    let found = &o.improved;
    assert!((found.effects.of(Effect::Delay)[0] / (3.0 * record.dt) - 1.0).abs() < 0.02);
    assert!((found.effects.of(Effect::CoulombMotor)[0] / 0.03 - 1.0).abs() < 0.02);
    assert!((found.parameters.i1 / paper.i1 - 1.0).abs() < 0.02);
}

#[test]
fn what_does_a_part_of_what_a_machine_has_is_no_cause_where_the_library_lacks_that() {
    // Of a dry friction under a few tones a viscous one is found in its place: of what the axis lacks a quarter is left.
    for level in [0.01, 0.02] {
        let record = moved(Parameters::PAPER, with(&[(Effect::CoulombMotor, 0, level)]), &tones, 0);
        let told = |families: &[Family]| {
            diagnosed_without(families, &record, Structure::TwoInertia, Parameters::PAPER).diagnosis
        };
        let [whole, lacking] = [told(&[]), told(&[Family::DryFriction])];
        assert_eq!(lacking.verdict, Verdict::Unexplained, "{level}: {:?}", lacking.causes);
        assert_eq!(whole.verdict, Verdict::Effect, "{level}");
        assert!(whole.causes[0].probability > 0.9, "{level}: {:?}", whole.causes);
    }
}

#[test]
fn friction_of_both_sides_beside_a_viscous_one_is_found_at_once() {
    let (motor, table, viscous) = (0.012, 0.016, 4e-4);
    let effects =
        with(&[(Effect::CoulombMotor, 0, motor), (Effect::CoulombTable, 0, table), (Effect::ViscousTable, 0, viscous)]);
    let fit = searched(&moved(Parameters::PAPER, effects, &tones, 0), Parameters::PAPER, |search| search.only_begun());
    for (effect, size) in
        [(Effect::CoulombMotor, motor), (Effect::CoulombTable, table), (Effect::ViscousTable, viscous)]
    {
        // Coulomb friction that gives way a little is the same.
        let is_like = |e: &Effect| (e.info().family, e.info().place) == (effect.info().family, effect.info().place);
        let found = fit.effects().into_iter().find(is_like).expect("found");
        let own = fit.model.effects.of(found);
        assert!((own[0] / size - 1.0).abs() < 0.1, "{found:?} {own:?} in {:?}", fit.terms);
    }
}

/// An open-loop record of two inertias under a few tones, the table's encoder read `late` half samples late.
fn of_two_inertias(parameters: Parameters, effects: Settings, amplitude: f64, late: usize) -> Record {
    let acts = |t: f64| {
        let tones = [(2.1, 0.3), (5.3, 1.7), (9.7, 4.1), (17.3, 2.9), (31.1, 5.3)];
        amplitude * tones.iter().map(|(w, p)| (w * t + p).sin()).sum::<f64>()
    };
    moved(parameters, effects, &acts, late)
}

/// Samples of an axis, and their interval, s.
const SAMPLED: (i32, f64) = (3000, 2e-3);

/// The same under a torque over time, which is held from sample to sample.
fn moved(parameters: Parameters, effects: Settings, acts: &dyn Fn(f64) -> f64, late: usize) -> Record {
    let (n, dt) = SAMPLED;
    // Fine enough for all that the effects do.
    let fine = 16;
    let h = dt / f64::from(fine);
    let axis = Axis::new(parameters, Structure::TwoInertia, effects, Scheme::Exact, h);
    let mut state = axis.state(0.0, 0.0, 0.0, 0.0, 0.0);
    let late = late * fine as usize / 2;
    let mut past = vec![0.0; late + 1];
    let (mut torque, mut motor, mut table) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..fine * n {
        let t = h * f64::from(k);
        past.push(state.theta2());
        if k % fine == 0 {
            torque.push(acts(t));
            motor.push(state.theta1());
            table.push(past[past.len() - 1 - late]);
        }
        let held = acts(t - h * f64::from(k % fine));
        state = axis.advance(&state, Ramp { start: held, end: held }, t);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for theta in motor.iter_mut().chain(&mut table) {
        *theta += noise(&mut rng, 1e-5);
    }
    Record { noise: [1e-5; 4], ..Record::new(dt, Hold::Zoh, torque, [Some(motor), None, Some(table), None]) }
}

#[test]
fn a_model_that_reads_the_table_late_lacks_the_noise_alone_however_tightly_it_is_held_to_the_record() {
    let late = 7;
    let record = of_two_inertias(BELT, Settings::default(), 0.01, late);
    let delay = 0.5 * late as f64 * record.dt;
    let model = Model::new(BELT, Structure::TwoInertia, with(&[(Effect::SensorDelay, 0, delay)]));
    let (p, _) = prepared(&record, &model, Reach::Shown);
    let problem = Problem::of(&p.record, &p.band, model, p.peak);
    let lacks = |held: f64| {
        let rows = problem.rows(&model, [held / record.dt; 2], None).expect("a run");
        p.band.noise_multiple(&rows).powi(2)
    };
    let loosely = lacks(0.002);
    assert!((0.7..1.4).contains(&loosely), "{loosely}");
    for held in [0.02, 0.1, 0.15] {
        let tightly = lacks(held);
        assert!((tightly / loosely - 1.0).abs() < 0.02, "{held}: {tightly} for {loosely}");
    }
}

#[test]
fn of_an_axis_that_swings_too_fast_to_be_held_to_the_stiffness_is_found_from_afar() {
    let (n, dt) = SAMPLED;
    // A fifth of a turn a sample, hardly damped; from half of its stiffness the nearest hollow is an eighth off.
    let wn = 1.25 / dt;
    let p = Parameters::PAPER;
    let k = wn * wn * p.i1 * p.i2 / (p.i1 + p.i2);
    let fast = Parameters { k, b: 0.006 * k / wn, ..p };
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let torque: Vec<f64> = (0..n).map(|_| noise(&mut rng, 20.0 * p.i1 / dt)).collect();
    let record = moved(fast, Settings::default(), &|t| torque[((t / dt).round() as usize).min(torque.len() - 1)], 0);
    let o = diagnosed_as(&record, Structure::TwoInertia, Parameters { k: 0.5 * k, ..fast });
    assert_eq!(o.decision.verdict, Verdict::Parameters, "{:#?}", ranking(&o));
    let found = o.improved.parameters.k;
    assert!((found / k - 1.0).abs() < 1e-3, "{found} {k}");
}

#[test]
fn a_late_encoder_of_a_light_table_is_no_softer_coupling() {
    // The twist is little more than the table's speed times the delay: free, the stiffness takes that and leaves the delay nothing.
    let light = Parameters { i1: 2.4e-4, i2: 6e-6, b: 5e-4, k: 0.018, rho: 1.0 };
    let friction = with(&[(Effect::CoulombMotor, 0, 2e-3)]);
    let o = diagnosed_as(&of_two_inertias(light, friction, 8e-3, 3), Structure::TwoInertia, light);
    assert_eq!(named(&o), ["dry_friction", "sensor"], "{:#?}", ranking(&o));
    let delay = o.improved.effects.of(Effect::SensorDelay)[0];
    assert!((delay / 3e-3 - 1.0).abs() < 0.05, "{delay}");
}

#[test]
fn a_model_that_reads_late_follows_at_a_bandwidth_at_which_it_is_stable() {
    let (_, dt) = SAMPLED;
    // A quarter of a radian a sample, hardly damped, the table read three samples late.
    let wn = 0.25 / dt;
    let p = Parameters::PAPER;
    let k = wn * wn * p.i1 * p.i2 / (p.i1 + p.i2);
    let swings = Parameters { k, b: 0.02 * k / wn, ..p };
    let record = of_two_inertias(swings, Settings::default(), 0.02, 6);
    let nominal = Model::new(swings, Structure::TwoInertia, Settings::default());
    let late = Model { effects: with(&[(Effect::SensorDelay, 0, 3.0 * dt)]), ..nominal };
    let (searched, _) = prepared(&record, &nominal, Reach::Shown);
    let problem = Problem::of(&searched.record, &searched.band, nominal, searched.peak);
    let tight = problem.bandwidth([f64::MAX; 2]);
    // Held as tightly as one that reads in time the loop swings up.
    let left = |rows: &TorqueResidual| searched.band.noise_multiple(rows);
    assert!(problem.rows(&late, tight, None).is_none_or(|rows| left(&rows) > 100.0));
    let at = problem.along(&late, tight).expect("a bandwidth");
    assert!(at.bandwidth[0] < tight[0] && left(&at.rows) < 1.5, "{:?} {}", at.bandwidth, left(&at.rows));
}

#[test]
fn samples_taken_late_hide_neither_the_coupling_nor_the_friction_on_its_sides() {
    let stiff = Parameters { i1: 0.03, i2: 1.5e-3, b: 0.11, k: 1100.0, rho: 1.0 };
    let friction = with(&[(Effect::CoulombMotor, 0, 4.0), (Effect::CoulombTable, 0, 4.0)]);
    let mut record = of_two_inertias(stiff, friction, 20.0, 0);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let [Some(motor), _, Some(table), _] = &mut record.channels else { unreachable!() };
    for k in (1..motor.len()).rev() {
        let late = noise(&mut rng, 0.05);
        motor[k] -= late * (motor[k] - motor[k - 1]);
        table[k] -= late * (table[k] - table[k - 1]);
    }
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let read = estimate_noise(&record.torque, &channels, None);
    // A thousand times what the encoders have of their own.
    assert!(read.std[0] > 1e-2, "{read:?}");
    (record.noise, record.common_noise) = (read.std, read.common);
    record.corner = read.corner.map(|c| c / record.dt);
    let o = diagnosed_as(&record, Structure::TwoInertia, Parameters { k: 1500.0, ..stiff });
    let mut effects: Vec<Effect> = o.decision.chosen.terms.iter().map(|t| t.0).collect();
    effects.sort_unstable();
    assert_eq!(effects, [Effect::CoulombMotor, Effect::CoulombTable], "{:#?}", ranking(&o));
    let k = o.improved.parameters.k;
    assert!((k / stiff.k - 1.0).abs() < 0.01, "{k}");
}

#[test]
fn noise_of_1_over_f_on_an_axis_that_hardly_moves_is_no_gap() {
    let paper = Parameters::PAPER;
    let mut record = of_two_inertias(paper, Settings::default(), 2e-3, 0);
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for c in [0, 2] {
        // Octaves of a random walk that forgets: their sum falls with the frequency.
        let mut octaves = [0.0; 8];
        for y in record.channels[c].iter_mut().flatten() {
            for (i, octave) in octaves.iter_mut().enumerate() {
                let forgets = 0.5_f64.powi(i as i32);
                *octave += forgets.sqrt() * noise(&mut rng, 1e-3) - forgets * *octave;
            }
            *y += octaves.iter().sum::<f64>();
        }
    }
    let channels = [0, 1, 2, 3].map(|c: usize| record.channels[c].as_deref());
    let read = estimate_noise(&record.torque, &channels, None);
    (record.noise, record.common_noise) = (read.std, read.common);
    record.corner = read.corner.map(|c| c / record.dt);
    let o = diagnosed_as(&record, Structure::TwoInertia, paper);
    assert!(matches!(o.decision.verdict, Verdict::NoGap | Verdict::Parameters), "{:?}", o.decision.verdict);
    // What is left is the noise, of its colour.
    let left = o.diagnosis.remainder.noise_multiple;
    assert!((0.8..1.3).contains(&left), "{left}");
}

#[test]
fn of_two_large_causes_both_are_found() {
    let hidden = [
        (Effect::ExternalSpring, 0, 0.02),
        (Effect::ExternalSpring, 1, -1.0),
        (Effect::TorqueRipple, 0, 0.05),
        (Effect::TorqueRipple, 1, 4.0),
        (Effect::TorqueRipple, 2, 0.6),
    ];
    let paper = Parameters::PAPER;
    let o = diagnosed_as(&of_two_inertias(paper, with(&hidden), 0.05, 0), Structure::TwoInertia, paper);
    assert_eq!(named(&o), ["external_spring", "torque_ripple"], "{:#?}", ranking(&o));
}

#[test]
fn inertias_whose_sum_alone_slow_motion_shows_are_told_apart_by_the_little_that_it_shows_of_each() {
    let screw = Parameters { i1: 1.63e-3, i2: 9.4e-4, b: 0.038, k: 449.0, rho: 1.0 };
    let nominal = Parameters { i1: 0.72 * screw.i1, i2: 1.1 * screw.i2, k: 0.87 * screw.k, ..screw };
    let o = diagnosed_as(&of_two_inertias(screw, Settings::default(), 0.7, 0), Structure::TwoInertia, nominal);
    assert_eq!(o.decision.verdict, Verdict::Parameters, "{:#?}", ranking(&o));
    let found = o.models[1].parameters;
    let off = [found.i1 / screw.i1, found.i2 / screw.i2, found.k / screw.k].map(|r| (r - 1.0).abs());
    assert!(off.iter().all(|o| *o < 0.03), "{off:?}");
    // The mean of some 150 squares is 1 within two of its standard deviations, sqrt(2/150).
    assert!(o.diagnosis.remainder.noise_multiple.powi(2) < 1.23, "{:?}", o.diagnosis.remainder);
}

#[test]
fn the_common_factor_of_all_at_the_table_is_found_beside_its_friction() {
    // The table's equation knows no torque but by this factor, and itself a hundred times better than the motor's knows the factor.
    let screw = Parameters { i1: 1.63e-3, i2: 9.4e-4, b: 0.038, k: 449.0, rho: 1.0 };
    let nominal = Parameters { i2: 0.8 * screw.i2, b: 0.8 * screw.b, k: 0.8 * screw.k, ..screw };
    let friction = with(&[(Effect::CoulombTable, 0, 0.15), (Effect::ViscousMotor, 0, 0.01)]);
    let o = diagnosed_as(&of_two_inertias(screw, friction, 0.7, 0), Structure::TwoInertia, nominal);
    assert_eq!(named(&o), ["dry_friction", "viscous_friction"], "{:#?}", ranking(&o));
    let found = o.improved.parameters;
    let level = o.improved.effects.of(Effect::CoulombTable)[0] / 0.15;
    let off = [found.i2 / screw.i2, found.k / screw.k, level].map(|r| (r - 1.0).abs());
    assert!(off.iter().all(|o| *o < 3e-3), "{off:?}");
}

#[test]
fn a_friction_of_a_side_that_is_not_measured_may_take_what_its_own_motion_lets_it() {
    let effects = with(&[(Effect::QuadraticDrag, 0, 1e-4)]);
    let both = of_two_inertias(BELT, effects, 0.01, 0);
    let [_, _, table, _] = both.channels.clone();
    for (channel, is_bounded) in [(table, true), (None, false)] {
        let [motor, ..] = both.channels.clone();
        let record = Record { channels: [motor, None, channel, None], ..both.clone() };
        let model = Model::new(BELT, Structure::TwoInertia, Settings::default());
        let (searched, _) = prepared(&record, &model, Reach::Shown);
        let problem = Problem::of(&searched.record, &searched.band, model, searched.peak);
        let given = problem.given(&model).expect("a run");
        let scales = Scales::new(&problem, &given).expect("a run");
        // At a thousand times its size more than the torque ever brought would be gone along the way of a table that is seen to go it.
        let [own, thousandfold] = [1e-4, 0.1].map(|coefficient| {
            let drag = with(&[(Effect::QuadraticDrag, 0, coefficient)]);
            let dragged = Model::new(BELT, Structure::TwoInertia, drag);
            scales.admit(&record, &dragged, std::iter::once(Effect::QuadraticDrag))
        });
        assert!(own && thousandfold != is_bounded, "{is_bounded}");
    }
}

const SCREW: Parameters = Parameters { i1: 1.3446e-3, i2: 4.45e-4, b: 3.66e-2, k: 225.0, rho: 1.0 };

/// A ball screw whose motor has a friction.
fn of_a_screw() -> Record {
    let friction = with(&[(Effect::CoulombMotor, 0, 0.1926), (Effect::CoulombMotor, 3, 0.256)]);
    let way = |t: f64| 4.0 * (1.0 - (5.1 * t).cos()) + 1.3 * (14.0 * t).sin() + 0.03 * (70.0 * t).sin();
    of_the_motor(SCREW, friction, (5600, 3.6e-4), [3600.0, 84.0], way, 3)
}

#[test]
fn what_leaves_less_than_the_band_has_of_the_torque_is_told_at_the_records_own_rate() {
    // At the band's rate the likeliest model lacks next to none of the torque, and hundreds of noises: there the stiffness is known to 5 %, at
    // the log's own rate a hundred times as well.
    let o = diagnosed_as(&of_a_screw(), Structure::TwoInertia, Parameters { i2: 4.33e-4, k: 219.0, ..SCREW });
    let (chosen, k) = (&o.decision.chosen, o.models[2].parameters.k);
    assert_eq!(chosen.effects(), [Effect::CoulombMotor], "{:?}", ranking(&o));
    assert!(
        (k / SCREW.k).ln().abs() < 4e-3 && o.diagnosis.remainder.noise_multiple < 1.5,
        "{k} {:?}",
        o.diagnosis.remainder
    );
}

#[test]
fn of_accounts_of_one_length_that_leave_next_to_nothing_the_likelier_is_told_and_no_longer_one() {
    searched(&of_a_screw(), SCREW, |search| {
        let fitted = |terms: &[Term]| {
            let mut start = search.problem.nominal;
            start.effects.of_mut(terms[0].0).copy_from_slice(&[0.19, 0.0, 1.0, 0.25, 0.0]);
            search.problem.fit(&start, terms, [f64::MAX; 2], STEPS).expect("runs")
        };
        let [table, motor] = [Effect::CoulombTable, Effect::CoulombMotor].map(|e| fitted(&[(e, 1)]));
        assert!(search.is_negligible(&table) && !search.at_floor(&table));
        let longer = Fit {
            log_likelihood: motor.log_likelihood + 1e3,
            ..fitted(&[(Effect::CoulombMotor, 1), (Effect::LoadMotor, 0)])
        };
        let mut pool = Pool::default();
        pool.extend([table.clone(), longer]);
        assert!(search.better_in_pool(&table, &pool).is_none());
        pool.push(motor.clone());
        assert_eq!(search.better_in_pool(&table, &pool).expect("likelier").terms, motor.terms);
        assert!(search.better_in_pool(&motor, &pool).is_none());
    });
}

#[test]
fn a_mode_of_the_table_is_found_beside_a_sine_and_a_load() {
    let mode = [(Effect::FlexibleMode, 0, 3e-6), (Effect::FlexibleMode, 1, 3.3e-3), (Effect::FlexibleMode, 2, 1.2e-5)];
    let sine = [(Effect::Disturbance, 0, 0.022), (Effect::Disturbance, 1, 5.03), (Effect::Disturbance, 2, -2.5)];
    let effects = with(&[&mode[..], &sine, &[(Effect::LoadMotor, 0, 0.06)]].concat());
    let sweep = |t: f64| {
        let tone = |j: i32| 0.015 * (4.3 * f64::from(j) * t + 0.16 * f64::from(j * j)).sin();
        0.06 + (1..20).map(tone).sum::<f64>()
    };
    let o = diagnosed_as(&moved(Parameters::PAPER, effects, &sweep, 0), Structure::TwoInertia, Parameters::PAPER);
    assert_eq!(named(&o), ["disturbance", "flexible_mode", "load_torque"], "{:#?}", ranking(&o));
}

#[test]
fn an_error_of_the_tables_scale_is_found_at_its_order() {
    // Of the motor's side hardly anything is off.
    let swept = |t: f64| 0.02 * (3.0 * t + 0.9 * t * t).sin() + 0.012 * (29.0 * t).sin() + 0.006 * (83.0 * t).cos();
    let mut record = moved(Parameters::PAPER, Settings::default(), &swept, 0);
    let table = record.channels[2].as_mut().expect("measured");
    table.iter_mut().for_each(|theta| *theta += 4e-4 * (7.0 * *theta + 1.0).sin());
    let o = diagnosed_as(&record, Structure::TwoInertia, Parameters::PAPER);
    assert_eq!(o.decision.chosen.effects(), [Effect::LeadError], "{:#?}", ranking(&o));
    let found = o.improved.effects.of(Effect::LeadError);
    assert!((found[1] / 4e-4 - 1.0).abs() < 0.1 && (found[2] / 7.0 - 1.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn what_is_less_than_drives_are_true_to_is_told_where_one_effect_leaves_the_noise_alone() {
    let mut record = of_two_inertias(Parameters::PAPER, Settings::default(), 0.05, 0);
    record.channels[2].as_mut().expect("measured").iter_mut().for_each(|theta| *theta *= 1.0 + 6e-7);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    record.channels.iter_mut().flatten().flatten().for_each(|theta| *theta += noise(&mut rng, 1e-4));
    record.noise = [1e-4; 4];
    searched(&record, Parameters::PAPER, |search| {
        let given = search.problem.given(&search.problem.nominal).expect("runs");
        assert!(search.is_negligible(&given) && !search.at_floor(&given), "{}", search.left(&given));
    });
    let o = diagnosed_as(&record, Structure::TwoInertia, Parameters::PAPER);
    assert_eq!(o.decision.chosen.effects(), [Effect::LeadError], "{:#?}", ranking(&o));
}
