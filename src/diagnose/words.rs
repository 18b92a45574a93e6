//! The diagnosis in words: verdict, confusable pairs, the next experiment.

use super::diagnosis::Diagnosis;
use super::torque::{Confusable, Decision};
use super::verdict::Verdict;
use crate::effects::{Effect, Family};

/// Fills in the sentences.
pub fn fill(d: &mut Diagnosis, decision: &Decision) {
    let percent = |v: f64| format!("{:.1} %", 100.0 * v.clamp(-9.99, 1.0));
    d.sentence = match d.verdict {
        Verdict::NoGap => "No gap: the model as given explains the record down to the noise.".to_owned(),
        Verdict::Parameters if !d.causes.is_empty() => {
            "Parameters: every nominal parameter is off by the same factor, as from a wrong torque constant.".to_owned()
        }
        Verdict::Parameters => format!(
            "Parameters: the structure is right, its parameters are off; with them fitted {} of the gap closes.",
            percent(d.gap.closure)
        ),
        Verdict::Effect => {
            let names: Vec<String> = d.causes.iter().map(|c| describe(&c.id, &c.place)).collect();
            let names = names.join(", and ");
            if d.gap.closure < 0.0 {
                format!("{names}, by the fitted record; the held-out record contradicts it: the error grows there.")
            } else {
                format!("{names}: {} of the gap on held-out data closes with it.", percent(d.gap.closure))
            }
        }
        Verdict::Unexplained if only_rounding(d, decision) => {
            "Unexplained: what is left is the rounding of the readings, which is not among the effects that may be named."
                .to_owned()
        }
        Verdict::Unexplained => {
            let nearest = d.ranking.iter().find(|r| r.place != "none").map_or_else(String::new, |r| {
                format!(" The nearest, {}, closes {}.", r.id, percent(r.closure_holdout))
            });
            format!("Unexplained: a gap is there, and nothing in the library closes it.{nearest}")
        }
    };
    for c in &decision.confusable {
        let why = format!("their fits differ by {:.1} in BIC on this record", 2.0 * c.difference);
        d.confusable.push([c.named.info().id.to_owned(), c.other.info().id.to_owned(), why]);
    }
    d.next_experiment = next(d, decision);
}

/// Whether the record is at its floor, and the floor no noise.
fn only_rounding(d: &Diagnosis, decision: &Decision) -> bool {
    d.verdict == Verdict::Unexplained && decision.verdict != Verdict::Unexplained
}

fn describe(id: &str, place: &str) -> String {
    Effect::from_id(id).map_or_else(|_| id.to_owned(), |e| format!("{} ({id}, at the {place})", e.info().title))
}

fn next(d: &Diagnosis, decision: &Decision) -> String {
    let families: Vec<Family> = decision
        .chosen
        .terms
        .iter()
        .take(1)
        .map(|(e, _)| e.info().family)
        .chain(decision.confusable.iter().flat_map(|c| [c.named, c.other]).map(|e| e.info().family))
        .collect();
    let has = |f: Family| families.contains(&f);
    let text = match d.verdict {
        Verdict::NoGap => "None needed: drive the axis harder or over more of its travel to look for smaller effects.",
        Verdict::Parameters => "Put the fitted parameters into axis.toml and diagnose a second record.",
        Verdict::Unexplained if only_rounding(d, decision) => "Log the positions with a finer step.",
        Verdict::Unexplained => {
            "Repeat the record at half and at twice the amplitude with an odd multisine (eixo excite --kind odd): even \
             lines that light up tell asymmetry and offsets, odd ones friction and play; a fixed frequency that stays \
             is an outside disturbance."
        }
        Verdict::Effect if d.confusable.is_empty() => {
            "None needed to name the cause. Confirm it with a record at another amplitude, and re-run with it in axis.toml."
        }
        Verdict::Effect if decision.confusable.iter().any(Confusable::is_of_place) => {
            "Log the encoders on both sides of the coupling: which side a force acts on shows in what the two \
             readings do to each other."
        }
        Verdict::Effect if has(Family::Backlash) || has(Family::NonlinearStiffness) || has(Family::Hysteresis) => {
            "Drive the coupling harder near its resonance, at two amplitudes: play shrinks in relative terms, a cubic \
             spring grows, a loop stays open at any speed."
        }
        Verdict::Effect if has(Family::Delay) || has(Family::ActuatorLag) => {
            "Excite a higher band: a delay's phase grows with frequency, a lag's bends and its gain falls."
        }
        Verdict::Effect if has(Family::DryFriction) || has(Family::LoadTorque) => {
            "Use an odd multisine with slow reversals in both directions: an offset lights up even lines, friction odd ones."
        }
        Verdict::Effect => {
            "Repeat with an odd multisine at two amplitudes (eixo excite --kind odd); the two causes scale differently."
        }
    };
    text.to_owned()
}
