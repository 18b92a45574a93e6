//! The diagnosis report: each answer says what it means, in words that match its figures.

use eixo::diagnose::location::{Bin, FrequencyPart, Residual, Spread, StateCurve, TimeSlot};
use eixo::diagnose::{
    Cause, ClosedLoop, ClosureOf, Commands, Diagnosis, Evidence, Figures, GapReport, Levels, Location, LoopErrors,
    LoopRanked, Overlay, Ranked, SCHEMA, Verdict, Where,
};
use eixo::effects::Place;
use eixo::report::diagnose::{Findings, report, short};
use eixo::report::terminal::{self, Layout};
use eixo::report::{Report, html};
use eixo::trace::Motion;
use serde_json::{Map, Value, json};

fn map(value: Value) -> Map<String, Value> {
    value.as_object().cloned().unwrap_or_default()
}

fn figures(before: f64, reidentified: f64, after: f64) -> Figures {
    Figures {
        combined: Levels { before, reidentified, after, noise_floor: 0.008 },
        signals: Map::new(),
        multiples: [before / 0.008, reidentified / 0.008, after / 0.008],
    }
}

/// Friction at the motor, hidden from the nominal model.
fn friction(machine: &str) -> Diagnosis {
    let ranked = |id: &str, place: &str, probability, delta_bic, chi2, closure_holdout| Ranked {
        id: id.into(),
        family: "dry_friction".into(),
        place: place.into(),
        probability,
        delta_bic,
        chi2,
        closure_holdout,
    };
    Diagnosis {
        schema: SCHEMA,
        machine: machine.into(),
        verdict: Verdict::Effect,
        sentence: String::new(),
        causes: vec![Cause {
            id: "coulomb_motor".into(),
            family: "dry_friction".into(),
            place: "motor".into(),
            variant: String::new(),
            probability: 0.9991,
            share_of_gap: 0.97,
            parameters: map(json!({ "level": { "value": 4.003e-3, "std": 1.3e-5, "unit": "N.m" } })),
        }],
        ranking: vec![
            ranked("coulomb_motor", "motor", 0.9991, 0.0, 1.004, 0.991),
            ranked("presliding_motor", "motor", 8e-4, 14.2, 1.006, 0.9905),
            ranked("torque_ripple+backlash", "motor", 0.0, 41_322.0, 17.0, 0.21),
            ranked("no_gap", "none", 0.0, 160_322.0, 145.0, 0.0),
        ],
        confusable: vec![[
            "coulomb_motor".into(),
            "presliding_motor".into(),
            "their fits differ by 14.2 in BIC.".into(),
        ]],
        next_experiment: "Use an odd multisine.".into(),
        location: Where {
            place: "motor".into(),
            by_place: map(json!({ "input": 0.004, "motor": 0.913, "coupling": 0.051, "table": 0.03, "sensor": 0.002 })),
            by_time: json!([]),
            by_frequency: json!([]),
            by_state: json!([]),
            summary: format!("The residual torque of {machine} acts on the motor."),
        },
        remainder: None,
        gap: GapReport {
            closure_of: ClosureOf::Windows,
            train: figures(0.182, 0.094, 0.0081),
            holdout: figures(0.184, 0.097, 0.0084),
            closure: 0.991,
            closure_of_effect: 0.979,
            interval: [0.988, 0.993],
            holdout_is: "a second record".into(),
        },
        parameters: map(
            json!({ "I1": { "nominal": 2.3e-4, "reidentified": 2.5e-4, "fitted": 2.3701e-4, "std": 1.2e-7 } }),
        ),
        warnings: vec!["One encoder only.".into()],
        closed_loop: None,
    }
}

fn evidence() -> Evidence {
    let x: Vec<f64> = (0..400).map(|k| f64::from(k) * 1e-3).collect();
    let wave = |gain: f64| -> Vec<f64> {
        x.iter().enumerate().map(|(k, t)| if k == 200 { f64::NAN } else { gain * (20.0 * t).sin() }).collect()
    };
    let slot = |k: f64| TimeSlot { start: k, end: k + 1.0, r1: 4e-3, r2: Some(1e-5), at_place: 4e-3 };
    let part = |kind: &str, share| FrequencyPart {
        residual: "r1",
        kind: kind.into(),
        from: 1.0,
        to: 2.0,
        rms: 1e-3,
        share,
        peak: 1.5,
        peak_rms: 1e-3,
    };
    Evidence {
        located: Location {
            place: Some(Place::Motor),
            spread: Spread::Throughout,
            by_time: (0..8).map(|k| slot(f64::from(k))).collect(),
            by_frequency: vec![part("odd_lines", 0.8), part("turn_order_6", 0.1), part("mean", 1e-4)],
            by_state: vec![StateCurve {
                residual: "r1",
                unit: "N.m",
                against: "omega1",
                against_unit: "rad/s",
                bins: (-5..5)
                    .map(|k| Bin { x: f64::from(k), mean: -4e-3 * f64::from(k).signum(), std: 2e-4, count: 100 })
                    .collect(),
                explained: 0.93,
            }],
            summary: String::new(),
            residual: Residual::default(),
        },
        held: vec![Overlay {
            channel: "theta1",
            measured: wave(1.0),
            before: wave(0.8),
            after: wave(1.0),
            noise: 1e-3,
            time: x.clone(),
        }],
    }
}

fn made(diagnosis: &Diagnosis, evidence: &Evidence) -> Report {
    report(&Findings { diagnosis, evidence: Some(evidence), trace: "log.csv", motion: Motion::Rotary })
}

#[test]
fn an_effect_is_named_with_its_place_its_size_and_what_it_means() {
    let (d, e) = (friction("x-axis"), evidence());
    let page = html::page(&made(&d, &e));
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/diagnose.html"), &page)
        .expect("the tests' folder can be written");
    for needle in [
        "The model leaves out one thing: Coulomb friction of motor and screw (at the motor).",
        "99.1\u{a0}%",
        "the gap is here",
        "quadrant glitches",
        "odd lines that were not excited",
        "order 6 of the turn",
        "Explains 93 % of the residual",
        "theta1 on held-out data",
    ] {
        assert!(page.contains(needle), "{needle}");
    }
    assert!(!page.contains("NaN"));
    let findings = Findings { diagnosis: &d, evidence: None, trace: "log.csv", motion: Motion::Rotary };
    let text = terminal::blocks(&short(&findings), Layout::default());
    assert!(text.contains("coulomb_motor.level") && text.contains("4.003e-3 ± 1.3e-5 N.m"), "{text}");
    assert!(text.lines().all(|l| l.chars().count() <= 100), "{text}");
}

#[test]
fn the_other_answers_claim_no_cause() {
    for (verdict, sentence) in [
        (Verdict::NoGap, "No gap: the model explains this trace to within its noise."),
        (Verdict::Parameters, "The structure of the model is right, its parameters are not."),
        (Verdict::Unexplained, "There is a gap at the motor, and none of the known effects explains it."),
    ] {
        let d = Diagnosis { verdict, causes: Vec::new(), ..friction("x-axis") };
        let page = html::page(&made(&d, &evidence()));
        assert!(page.contains(sentence), "{sentence}");
        assert!(!page.contains("leaves out"), "{sentence}");
        assert!(!page.contains("with the effect"), "{sentence}");
    }
}

#[test]
fn a_hostile_machine_name_stays_text() {
    let page = html::page(&made(&friction("</title><script>alert(1)</script>"), &evidence()));
    assert!(page.matches("<script").count() == 1 && page.contains("&lt;script&gt;"), "the page's own script alone");
}

#[test]
fn the_drives_loop_says_whether_it_agrees() {
    let errors = |command: f64| LoopErrors { command, position: 1e-4 };
    let ranked = |id: &str, command: f64| LoopRanked {
        id: id.into(),
        errors: errors(command),
        closure: 1.0 - (command / 0.7).powi(2),
    };
    let seen = ClosedLoop {
        before: errors(0.7),
        reidentified: errors(0.6),
        after: errors(0.04),
        closure: 1.0 - (0.04_f64 / 0.7).powi(2),
        ranking: vec![ranked("coulomb_motor", 0.04), ranked("backlash", 0.3)],
        commands: Commands {
            time: vec![0.0, 1.0],
            measured: vec![0.0, 1.0],
            before: vec![0.0; 2],
            after: vec![0.0; 2],
        },
        agrees: true,
    };
    let d = Diagnosis { closed_loop: Some(seen.clone()), ..friction("x-axis") };
    let page = html::page(&made(&d, &evidence()));
    for words in ["In the drive", "The loop agrees", "next comes Play in coupling or nut", "s command: model as given"]
    {
        assert!(page.contains(words), "{words}");
    }
    let ranking = vec![ranked("backlash", 0.01), ranked("coulomb_motor", 0.04)];
    let d = Diagnosis { closed_loop: Some(ClosedLoop { ranking, agrees: false, ..seen }), ..friction("x-axis") };
    let page = html::page(&made(&d, &evidence()));
    assert!(page.contains("The loop does not agree: Play in coupling or nut"), "{page}");
    assert!(!html::page(&made(&friction("x-axis"), &evidence())).contains("In the drive"));
}
