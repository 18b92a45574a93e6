//! The diagnosis report over simulated axes: each answer says what it means, in words that match its figures.

use std::sync::Arc;

use eixo::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate};
use eixo::effects::{Effect, Place, Settings};
use eixo::identify::excitation::{Kind, Multisine};
use eixo::report::diagnose::{Answer, Cause, Findings, Hypothesis, Levels, Overlay, Picture, report, short};
use eixo::report::terminal::{self, Layout};
use eixo::report::{Shape, html};

const N: usize = 8192;
const DT: f64 = 5.626e-4;
const NOISE: f64 = 1e-3;

fn noise(k: usize) -> f64 {
    let u = |c: f64| (k as f64 * c).fract() - 0.5;
    NOISE * 2.0 * (u(0.754_877_666_246_693) + u(0.569_840_290_998_053) + u(0.387_298_334_620_741_7))
}

fn theta1(torque: &[f64], effects: &Settings) -> Arc<[f64]> {
    let options = SimulateOptions { start: 0.0, dt: DT, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 1 };
    let run = simulate(&Parameters::PAPER, Structure::TwoInertia, effects, [0.0; 4], torque, &options);
    run.readings.iter().map(|r| r.theta1).collect()
}

/// Friction at the motor, hidden from the nominal model.
fn friction() -> Findings {
    let torque: Vec<f64> = {
        let sine = Multisine::new(Kind::Schroeder, N / 4, 1, 100, 0.03, 0.0, 1).expect("a multisine");
        let period = sine.period();
        (0..N).map(|k| period[k % period.len()]).collect()
    };
    let mut with = Settings::default();
    with.of_mut(Effect::CoulombMotor)[0] = 4e-3;
    let time: Arc<[f64]> = (0..N).map(|k| k as f64 * DT).collect();
    let after = theta1(&torque, &with);
    let before = theta1(&torque, &Settings::default());
    let measured: Arc<[f64]> = after.iter().enumerate().map(|(k, v)| v + noise(k)).collect();
    let speed: Arc<[f64]> = after.windows(2).map(|w| (w[1] - w[0]) / DT).collect();
    let residual: Arc<[f64]> = speed.iter().enumerate().map(|(k, w)| 4e-3 * w.signum() + 2e-1 * noise(k)).collect();
    let left: Arc<[f64]> = (0..speed.len()).map(|k| 2e-1 * noise(k + 7)).collect();
    let f: Arc<[f64]> = (1..200).map(|k| f64::from(k) * 0.87).collect();
    let hypothesis = |id: &str, place: &str, probability, delta_bic, chi2, closure| Hypothesis {
        id: id.into(),
        family: String::new(),
        place: place.into(),
        probability,
        delta_bic,
        chi2,
        closure,
    };
    Findings {
        machine: "x-axis".into(),
        trace: "train.csv, held out: holdout.csv (8192 samples at 1.78 kHz)".into(),
        answer: Answer::Effect,
        causes: vec![Cause {
            id: "coulomb_motor".into(),
            probability: 0.9991,
            share: 0.97,
            parameters: vec![
                ("level".into(), 4.003e-3, 1.3e-5, "N.m".into()),
                ("asymmetry".into(), 0.01, 0.012, "1".into()),
            ],
        }],
        ranking: vec![
            hypothesis("coulomb_motor", "motor", 0.9991, 0.0, 1.004, 0.991),
            hypothesis("presliding_motor", "motor", 8e-4, 14.2, 1.006, 0.9905),
            hypothesis("coulomb_table", "table", 1e-30, 1432.0, 3.2, 0.62),
            hypothesis("torque_ripple", "motor", 0.0, 41_322.0, 17.0, 0.21),
            hypothesis("parameters", "", 0.0, 60_322.0, 25.0, 0.11),
            hypothesis("no_gap", "", 0.0, 160_322.0, 145.0, 0.0),
        ],
        confusable: vec![(
            "coulomb_motor".into(),
            "presliding_motor".into(),
            "the motor never moves less than the bristle's reach.".into(),
        )],
        next_experiment:
            "a slow sine of 0.5 Hz at 0.01 N.m shows presliding: eixo excite --kind sine --frequency 0.5 --rms 0.01"
                .into(),
        place: Some(Place::Motor),
        by_place: vec![
            (Place::Input, 0.004),
            (Place::Motor, 0.913),
            (Place::Coupling, 0.051),
            (Place::Table, 0.03),
            (Place::Sensor, 0.002),
        ],
        where_summary: "The residual torque acts on the motor, throughout the record, with the sign of its speed."
            .into(),
        train: Levels { before: 0.182, reidentified: 0.094, after: 0.0081, floor: 0.008 },
        holdout: Levels { before: 0.184, reidentified: 0.097, after: 0.0084, floor: 0.008 },
        closure: 0.991,
        closure_of_effect: 0.979,
        interval: Some((0.988, 0.993)),
        parameters: vec![
            ("I1".into(), "kg.m2".into(), 2.3e-4, 2.3701e-4, 1.2e-7),
            ("K".into(), "N.m/rad".into(), 0.018, 0.01763, 2e-4),
        ],
        overlays: vec![Overlay {
            signal: "theta1".into(),
            unit: "rad".into(),
            time,
            measured,
            before,
            after,
            noise: NOISE,
        }],
        residual: vec![
            Picture {
                title: "Residual torque at the motor against its speed".into(),
                caption: "A step at standstill: dry friction.".into(),
                x: ("omega1".into(), "rad/s".into()),
                y: ("residual torque".into(), "N.m".into()),
                log: (false, false),
                shape: Shape::Points,
                before: (speed.clone(), residual.clone()),
                after: (speed, left),
            },
            Picture {
                title: "Residual torque over frequency".into(),
                caption: String::new(),
                x: ("frequency".into(), "Hz".into()),
                y: ("amplitude".into(), "N.m".into()),
                log: (true, true),
                shape: Shape::Line,
                before: (f.clone(), f.iter().enumerate().map(|(k, f)| 1e-3 / f * (1.3 + noise(k) / NOISE)).collect()),
                after: (f.clone(), f.iter().enumerate().map(|(k, _)| 1e-5 * (3.0 + noise(k) / NOISE)).collect()),
            },
        ],
        warnings: vec!["One encoder only: places behind the coupling are seen through the model.".into()],
    }
}

#[test]
fn an_effect_is_named_with_its_place_its_size_and_what_it_means() {
    let page = html::page(&report(&friction()));
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/diagnose.html"), &page)
        .expect("the tests' folder can be written");
    for needle in [
        "The model leaves out one thing: Coulomb friction of motor and screw (at the motor).",
        "99.1\u{a0}%",
        "the gap is here",
        "quadrant glitches",
    ] {
        assert!(page.contains(needle), "{needle}");
    }
    assert!(page.len() < 500_000, "{} bytes", page.len());
    let text = terminal::blocks(&short(&friction()), Layout::default());
    println!("{text}");
    assert!(text.contains("coulomb_motor.level") && text.contains("4.003e-3 ± 1.3e-5 N.m"));
}

#[test]
fn the_other_answers_claim_no_cause() {
    for (answer, sentence) in [
        (Answer::NoGap, "No gap: the model explains this trace to within its noise."),
        (Answer::Parameters, "The structure of the model is right, its parameters are not."),
        (Answer::Unexplained, "There is a gap at the motor, and none of the known effects explains it."),
    ] {
        let page = html::page(&report(&Findings { answer, causes: Vec::new(), ..friction() }));
        assert!(page.contains(sentence), "{sentence}");
        assert!(!page.contains("leaves out"), "{sentence}");
    }
}
