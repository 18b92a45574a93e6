//! The diagnosis report: each answer says what it means, in words that match its figures.

mod contract;
mod fixture;
mod words;

use eixo::control::LoopErrors;
use eixo::diagnose::{ClosedLoop, Commands, Confusable, Diagnosis, Hypothesis, LoopRanked, Site, Undecided, Verdict};
use eixo::effects::{Effect, Place};
use eixo::report::diagnose::{Findings, json, report, short};
use eixo::report::terminal::{self, Layout};
use eixo::report::{Report, html};
use eixo::trace::AxisKind;
use fixture::{friction, overlay};

fn made(diagnosis: &Diagnosis) -> Report {
    report(&Findings { diagnosis, overlays: &[overlay()], trace: "log.csv", motion: AxisKind::Rotary, warnings: &[] })
}

#[test]
fn an_effect_is_named_with_its_place_its_size_and_what_it_means() {
    let d = friction("x-axis");
    let page = html::page(&made(&d));
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
        "theta1 read in steps of 1.000e-3 rad;",
        "do not tell Coulomb friction of motor and screw from ",
        "the model lacks 0.00400 N·m rms in torque, flat against the sign of omega1 (93 % of its variance)",
    ] {
        assert!(page.contains(needle), "{needle}");
    }
    assert!(!page.contains("NaN"));
    let findings = Findings { diagnosis: &d, overlays: &[], trace: "log.csv", motion: AxisKind::Rotary, warnings: &[] };
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
        let page = html::page(&made(&d));
        assert!(page.contains(sentence), "{sentence}");
        assert!(!page.contains("leaves out"), "{sentence}");
        assert!(!page.contains("with the effect"), "{sentence}");
    }
}

#[test]
fn two_causes_that_explain_a_gap_alike_are_what_the_next_record_is_to_tell_apart() {
    let pair = Confusable { named: Effect::CoulombMotor, other: Effect::LoadMotor, difference: 0.0 };
    let d =
        Diagnosis { verdict: Verdict::Unexplained, causes: Vec::new(), confusable: vec![pair], ..friction("x-axis") };
    let page = html::page(&made(&d));
    for sentence in [
        "this record does not tell Coulomb friction of motor and screw from constant torque on the motor",
        "Change nothing on the machine yet",
        "slow reversals in both directions",
    ] {
        assert!(page.contains(sentence), "{sentence}");
    }
    assert!(!page.contains("none of the known effects"));
}

#[test]
fn one_of_several_effects_that_acts_beside_the_causes_is_told_with_its_share_and_not_named() {
    let open = Undecided { effects: vec![Effect::LoadMotor, Effect::ExternalSpring], share_of_gap: 0.7 };
    let d = Diagnosis { undecided: Some(open), ..friction("x-axis") };
    let page = html::page(&made(&d));
    let told = "the record does not tell which: constant torque on the motor or a spring from the table to the frame";
    assert!(page.contains(told), "{page}");
    assert!(page.contains("Not told: constant torque on the motor or a spring"));
    let file = json::value(&d, &[]);
    assert_eq!(file["causes"].as_array().map(Vec::len), Some(1));
    assert_eq!(file["undecided"]["effects"], serde_json::json!(["load_motor", "external_spring"]));
    assert_eq!(file["undecided"]["share_of_gap"], 0.7);
    assert!(file["sentence"].as_str().is_some_and(|s| s.contains(told)));
}

#[test]
fn a_single_effect_that_is_not_clear_enough_to_be_named_is_told_as_such() {
    let open = Undecided { effects: vec![Effect::TorqueRipple], share_of_gap: 0.04 };
    let d = Diagnosis { undecided: Some(open), ..friction("x-axis") };
    let page = html::page(&made(&d));
    let told = "something acts that looks like torque periodic in the motor's angle, not clearly enough to be named";
    assert!(page.contains(told) && page.contains("Not told: torque periodic"), "{page}");
    assert_eq!(json::value(&d, &[])["causes"].as_array().map(Vec::len), Some(1));
}

#[test]
fn a_rigid_axis_is_drawn_as_one_place() {
    let mut d = friction("stage");
    let [input, axis, sensor] = [Site::At(Place::Input), Site::Axis, Site::At(Place::Sensor)];
    d.causes[0].site = axis;
    d.location.site = Some(axis);
    d.location.shares = vec![(input, 0.0), (axis, 1.0), (sensor, 0.0)];
    let page = html::page(&made(&d));
    assert!(page.contains("axis 100\u{a0}% (the gap is here)"), "the chain's own words");
    assert!(!page.contains("table, guideways") && !page.contains("motor and screw</text>"));
}

#[test]
fn a_hostile_machine_name_stays_text() {
    let page = html::page(&made(&friction("</title><script>alert(1)</script>")));
    assert!(page.matches("<script").count() == 1 && page.contains("&lt;script&gt;"), "the page's own script alone");
}

#[test]
fn the_drives_loop_says_whether_it_agrees() {
    let errors = |command: f64| LoopErrors { command, position: 1e-4 };
    let ranked = |effect: Effect, command: f64| LoopRanked {
        hypothesis: Hypothesis::Effects(vec![effect]),
        errors: errors(command),
        closure: 1.0 - (command / 0.7).powi(2),
    };
    let seen = ClosedLoop {
        before: errors(0.7),
        reidentified: errors(0.6),
        after: errors(0.04),
        closure: 1.0 - (0.04_f64 / 0.7).powi(2),
        ranking: vec![ranked(Effect::CoulombMotor, 0.04), ranked(Effect::Backlash, 0.3)],
        commands: Commands {
            time: vec![0.0, 1.0],
            measured: vec![0.0, 1.0],
            before: vec![0.0; 2],
            after: vec![0.0; 2],
        },
        agrees: true,
    };
    let d = Diagnosis { closed_loop: Some(seen.clone()), ..friction("x-axis") };
    let page = html::page(&made(&d));
    for words in ["In the drive", "The loop agrees", "next comes Play in coupling or nut", "s command: model as given"]
    {
        assert!(page.contains(words), "{words}");
    }
    let ranking = vec![ranked(Effect::Backlash, 0.01), ranked(Effect::CoulombMotor, 0.04)];
    let d = Diagnosis { closed_loop: Some(ClosedLoop { ranking, agrees: false, ..seen }), ..friction("x-axis") };
    let page = html::page(&made(&d));
    assert!(page.contains("The loop does not agree: Play in coupling or nut"), "{page}");
    assert!(!html::page(&made(&friction("x-axis"))).contains("In the drive"));
}
