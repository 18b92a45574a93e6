//! What is said of a typed result: a table of results, and what their sentences must and must not hold.

use eixo::diagnose::location::{Appearance, Dependence, OwnFrequency, Shape, Spread, StateVariable};
use eixo::diagnose::{Cause, Confusable, Diagnosis, Hypothesis, RoundingRole, Site, Verdict};
use eixo::effects::{EFFECTS, Effect};
use eixo::report::diagnose::json::value;
use eixo::report::diagnose::{Findings, report, short};
use eixo::report::html;
use eixo::report::terminal::{self, Layout};
use eixo::trace::AxisKind;

use crate::fixture::friction;

/// A field of the file that is a sentence.
fn said(d: &Diagnosis, field: &str) -> String {
    value(d, &[]).pointer(field).and_then(|v| v.as_str()).expect(field).to_owned()
}

/// A diagnosis, changed.
fn with(change: impl FnOnce(&mut Diagnosis)) -> Diagnosis {
    let mut d = friction("x-axis");
    change(&mut d);
    d
}

/// The same with another verdict and no cause.
fn without_cause(verdict: Verdict) -> Diagnosis {
    with(|d| {
        d.verdict = verdict;
        d.causes.clear();
    })
}

#[test]
fn each_verdict_has_its_sentence() {
    let rounding = |role| {
        let mut d = without_cause(Verdict::Unexplained);
        d.rounding.as_mut().expect("the fixture rounds").role = role;
        d
    };
    let nothing_near = with(|d| {
        d.verdict = Verdict::Unexplained;
        d.ranking.retain(|r| r.hypothesis.effects().is_empty());
    });
    let worse = with(|d| {
        d.verdict = Verdict::Unexplained;
        d.causes.clear();
        d.ranking.iter_mut().for_each(|r| r.closure_holdout = -9.0);
    });
    let two = with(|d| {
        let first = d.causes[0].clone();
        d.causes.push(Cause { effect: Effect::ViscousTable, site: Site::Axis, ..first });
    });
    let mut beyond_noise = without_cause(Verdict::NoGap);
    beyond_noise.remainder.noise_multiple = 20.0;
    for (d, holds, lacks) in [
        (friction(""), &["Coulomb", "(coulomb_motor, at the motor)", "99.1 % of the gap"][..], "contradicts"),
        (two, &["at the motor), and ", "(viscous_table, at the axis)", "closes with it"], "contradicts"),
        (with(|d| d.gap.closure = -0.3), &["by the fitted record", "contradicts it"], "%"),
        (with(|d| d.gap.closure = 7.0), &["100.0 %"], "700"),
        (without_cause(Verdict::NoGap), &["No gap", "down to the noise"], "%"),
        (beyond_noise, &["No gap", "no cause stands out in the 0.1 % of the torque"], "down to the noise"),
        (without_cause(Verdict::Parameters), &["Parameters:", "99.1 % of the gap"], "torque constant"),
        (with(|d| d.verdict = Verdict::Parameters), &["Parameters:", "same factor", "torque constant"], "%"),
        (
            without_cause(Verdict::Unexplained),
            &["Unexplained", "The nearest, coulomb_motor, closes 99.1 %"],
            "rounding",
        ),
        (worse, &["Unexplained", "The nearest, coulomb_motor, closes nothing."], "%"),
        (nothing_near, &["Unexplained", "nothing in the library"], "nearest"),
        (rounding(RoundingRole::Noise), &["Unexplained", "The nearest"], "rounding"),
        (rounding(RoundingRole::Withheld), &["Unexplained", "rounding of the readings"], "nearest"),
    ] {
        let sentence = said(&d, "/sentence");
        assert!(holds.iter().all(|part| sentence.contains(part)) && !sentence.contains(lacks), "{sentence}");
        assert!(sentence.ends_with('.') && !sentence.contains("NaN"), "{sentence}");
    }
    assert_eq!(said(&rounding(RoundingRole::Withheld), "/next_experiment"), "Log the positions with a finer step.");
}

#[test]
fn every_effect_is_told_with_its_name_its_place_and_what_it_means_on_a_machine() {
    for &effect in EFFECTS {
        let info = effect.info();
        let d = with(|d| {
            let site = Site::At(info.place);
            d.causes = vec![Cause { effect, site, parameters: Vec::new(), ..d.causes[0].clone() }];
        });
        let sentence = said(&d, "/sentence");
        for part in [info.title, info.id, info.place.as_str()] {
            assert!(sentence.contains(part), "{part}: {sentence}");
        }
        let page = html::page(&report(&Findings {
            diagnosis: &d,
            overlays: &[],
            trace: "",
            motion: AxisKind::Rotary,
            warnings: &[],
        }));
        assert!(page.contains("On a machine: "), "{}", info.id);
    }
}

#[test]
fn the_next_experiment_is_the_one_that_tells_the_rivals_apart() {
    for (chosen, named, other, says) in [
        (Effect::ViscousMotor, Effect::ViscousMotor, Effect::ViscousTable, "both sides of the coupling"),
        (Effect::Backlash, Effect::Backlash, Effect::CubicStiffness, "near its resonance"),
        (Effect::Delay, Effect::Delay, Effect::ActuatorLag, "a higher band"),
        (Effect::LoadMotor, Effect::LoadMotor, Effect::CoulombMotor, "slow reversals"),
        (Effect::Gravity, Effect::Gravity, Effect::ExternalSpring, "scale differently"),
        // What was found first decides, too.
        (Effect::Delay, Effect::Gravity, Effect::ExternalSpring, "a higher band"),
    ] {
        let d = with(|d| {
            d.chosen = Hypothesis::Effects(vec![chosen]);
            d.confusable = vec![Confusable { named, other, difference: 1.04 }];
        });
        assert!(said(&d, "/next_experiment").contains(says), "{named:?} {other:?}");
        assert_eq!(said(&d, "/confusable/0/2"), "their fits differ by 2.1 in BIC on this record");
    }
    let sure = with(|d| d.confusable.clear());
    assert!(said(&sure, "/next_experiment").starts_with("None needed"));
    assert!(said(&without_cause(Verdict::Parameters), "/next_experiment").contains("axis.toml"));
    assert!(said(&without_cause(Verdict::Unexplained), "/next_experiment").contains("half and at twice"));
}

#[test]
fn a_residual_is_told_by_what_it_depends_on_its_frequency_and_its_spread() {
    let looks = |dependence, frequency, spread| {
        said(&with(|d| d.remainder.looks = Appearance { dependence, frequency, spread }), "/remainder/summary")
    };
    let depends = |shape, against| Some(Dependence { shape, against, explained: 0.876 });
    for (shape, says) in [
        (Shape::Step, "flat against the sign of twist (88 % of its variance)"),
        (Shape::Line, "linear in twist"),
        (Shape::Odd, "an odd function of twist"),
        (Shape::Even, "an even function of twist"),
        (Shape::Other, "a function of twist"),
    ] {
        assert!(looks(depends(shape, StateVariable::Twist), None, Spread::Throughout).starts_with(says), "{says}");
    }
    for (frequency, says) in [
        (OwnFrequency::OfTheTurn { order: 4, share: 0.61 }, "4 times per turn of the motor (61 % of its energy)"),
        (OwnFrequency::Foreign(31.415), "mostly at 31.4 Hz, which the excitation does not hold"),
    ] {
        assert_eq!(looks(None, Some(frequency), Spread::Grows), format!("{says}, growing over the record"));
    }
    let in_order = looks(depends(Shape::Line, StateVariable::Torque), Some(OwnFrequency::Foreign(2.0)), Spread::Events);
    assert_eq!(
        in_order,
        "linear in T (88 % of its variance), mostly at 2.00 Hz, which the excitation does not hold, in a few events \
         rather than throughout"
    );
    for (rms, says) in [(0.0, " 0 rms"), (4.0004e-3, " 0.00400 rms"), (123.4, " 123 rms"), (1.2e-9, " 1.20e-9 rms")] {
        let summary = said(&with(|d| d.location.shown.rms = rms), "/where/summary");
        assert!(summary.contains(says), "{summary}");
    }
}

#[test]
fn a_remainder_is_told_where_it_is_more_than_noise_in_the_units_of_the_axis() {
    let text = |d: &Diagnosis, motion| {
        let blocks = short(&Findings { diagnosis: d, overlays: &[], trace: "", motion, warnings: &[] });
        terminal::blocks(&blocks, Layout::default()).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let large = |d: &mut Diagnosis| d.remainder.noise_multiple = 20.0;
    let quiet = text(&friction(""), AxisKind::Rotary);
    assert!(!quiet.contains("o cause explains"), "{quiet}");
    let beside = text(&with(large), AxisKind::Linear);
    assert!(beside.contains("Beside that no cause explains") && beside.contains(" N rms of torque"), "{beside}");
    let mut none = without_cause(Verdict::NoGap);
    large(&mut none);
    let none = text(&none, AxisKind::Rotary);
    assert!(none.contains("No cause explains") && none.contains(" N.m rms"), "{none}");
    assert!(none.contains("no cause stands out in the 0.1"), "{none}");
}

#[test]
fn what_is_to_be_known_of_the_record_stands_in_the_file_and_on_the_page() {
    let d = friction("x-axis");
    let known = ["[time_jitter] One step in ten between time stamps is off.".to_owned()];
    let told = value(&d, &known);
    assert_eq!(told["warnings"][0], known[0]);
    let own = value(&d, &[]);
    let own = own["warnings"].as_array().expect("warnings");
    assert_eq!(told["warnings"].as_array().expect("warnings")[1..], own[..]);
    let of = |warnings| Findings { diagnosis: &d, overlays: &[], trace: "", motion: AxisKind::Rotary, warnings };
    assert!(html::page(&report(&of(&known))).contains(&known[0]));
    assert!(!html::page(&report(&of(&[]))).contains(&known[0]));
}

#[test]
fn the_step_that_tells_rivals_apart_names_them() {
    let rivals = vec![Confusable { named: Effect::ViscousMotor, other: Effect::ViscousTable, difference: 1.04 }];
    let page = |d: &Diagnosis| {
        html::page(&report(&Findings {
            diagnosis: d,
            overlays: &[],
            trace: "",
            motion: AxisKind::Rotary,
            warnings: &[],
        }))
    };
    let names = "do not tell: viscous friction of motor and screw or viscous friction of table and guideways.";
    assert!(page(&with(|d| d.confusable = rivals)).contains(names));
    assert!(!page(&with(|d| d.confusable.clear())).contains("do not tell"));
}

#[test]
fn a_linear_axis_is_drawn_in_metres_and_newtons() {
    let d = friction("x-axis");
    let page =
        |motion| html::page(&report(&Findings { diagnosis: &d, overlays: &[], trace: "", motion, warnings: &[] }));
    let head = |against: &str| format!("Against {against}");
    assert!(page(AxisKind::Rotary).contains(&head("omega1")), "the fixture has no curve against omega1");
    assert!(page(AxisKind::Rotary).contains("omega1 [rad/s]"));
    assert!(page(AxisKind::Linear).contains("omega1 [m/s]") && !page(AxisKind::Linear).contains("omega1 [rad/s]"));
}

#[test]
fn that_the_motion_was_given_or_the_search_cut_short_is_told_in_one_line_of_words() {
    let given = Diagnosis { motion_is_given: true, ..friction("x-axis") };
    let short = Diagnosis { cut_short: true, ..friction("x-axis") };
    for (d, words) in
        [(given, "of the torque that the measured motion takes"), (short, "Diagnose a shorter part (--from")]
    {
        let told = value(&d, &[]);
        let last = told["warnings"].as_array().and_then(|w| w.last()?.as_str()).expect("a warning");
        assert!(last.contains(words) && !last.contains("  "), "{last}");
    }
}
