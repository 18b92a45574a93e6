//! The head of the page: the verdict, what it rests on, its figures.

use super::naming::{held_out, lower, short_title, title};
use super::percent;
use super::sentences::{REMAINS, either, in_the_noise, undecided};
use crate::diagnose::{Cause, ClosureOf, Diagnosis, Hypothesis, UNCAUSED, Verdict};
use crate::report::{Cell, Summary, Tone};

/// Error over noise below which a model explains a trace.
const TO_THE_NOISE: f64 = 1.2;

/// The verdict as the page and the terminal open with it.
pub fn verdict(d: &Diagnosis) -> Summary {
    let held = &d.gap.holdout.combined;
    let [low, high] = d.gap.interval;
    let mut figures = vec![
        ("gap closed, held out".to_owned(), Cell::Percent(d.gap.closure)),
        ("95 % interval".to_owned(), Cell::Text(format!("{} to {}", percent(low), percent(high)))),
    ];
    let (tone, sentence, detail) = match d.verdict {
        Verdict::NoGap => {
            figures.clear();
            let (what, of) = measured(d);
            let levels = format!(
                "On held-out data {what} is {} of the {of}, the noise {}.",
                percent(held.before),
                percent(held.noise_floor)
            );
            let sentence = if d.remainder.share > UNCAUSED {
                in_the_noise(d)
            } else if d.remainder.noise_multiple > REMAINS {
                let left = percent(d.remainder.share);
                format!("No gap: no cause stands out in the {left} of the torque that the model leaves.")
            } else {
                "No gap: the model explains this trace to within its noise.".to_owned()
            };
            (Tone::Good, sentence, levels)
        }
        Verdict::Parameters => {
            let sentence = if d.causes.is_empty() {
                "The structure of the model is right, its parameters are not."
            } else {
                "Every parameter of the model is off by the same factor, as from a wrong torque constant."
            };
            (Tone::Finding, sentence.to_owned(), fall(d))
        }
        Verdict::Effect => {
            if let Some(c) = d.causes.first() {
                figures.insert(0, ("probability".to_owned(), Cell::Percent(c.probability)));
            }
            let detail = undecided(d).into_iter().chain([fall(d)]).collect::<Vec<_>>().join(" ");
            (Tone::Finding, left_out(&d.causes), detail)
        }
        Verdict::Unexplained => {
            let at = d.location.site.map_or("at no single place".to_owned(), |s| format!("at the {}", s.as_str()));
            let sentence = match either(d) {
                Some(pair) => format!("There is a gap {at}, and this record does not tell {pair}."),
                None => format!("There is a gap {at}, and none of the known effects explains it."),
            };
            (Tone::Unsure, sentence, format!("{}{}", nearest(d), fall(d)))
        }
    };
    Summary { tone, sentence, detail, figures }
}

/// How the error changes on held-out data.
fn fall(d: &Diagnosis) -> String {
    let held = &d.gap.holdout.combined;
    let (what, of) = measured(d);
    format!(
        "On held-out data ({}) {what} {} from {} of the {of} to {}; the noise alone is {}.",
        held_out(d.gap.holdout_is),
        if held.after > held.before { "rises" } else { "falls" },
        percent(held.before),
        percent(held.after),
        percent(held.noise_floor)
    )
}

/// What the figures of the held-out data are, and what they are a share of.
const fn measured(d: &Diagnosis) -> (&'static str, &'static str) {
    match d.gap.closure_of {
        ClosureOf::FreeRun | ClosureOf::Windows => ("the model's error", "signal"),
        ClosureOf::Torque => ("the torque that the model lacks", "torque"),
    }
}

fn left_out(causes: &[Cause]) -> String {
    let name = |c: &Cause| format!("{} (at the {})", lower(short_title(c.effect.info())), c.site.as_str());
    let named: Vec<String> = causes.iter().map(name).collect();
    match named.as_slice() {
        [one] => format!("The model leaves out one thing: {one}."),
        _ => format!("The model leaves out {} things: {}.", named.len(), named.join("; ")),
    }
}

/// What comes nearest to a gap that is not explained.
fn nearest(d: &Diagnosis) -> String {
    let Some(best) = d.ranking.first().filter(|r| r.hypothesis != Hypothesis::NoGap) else { return String::new() };
    let title = lower(&title(&best.hypothesis));
    let fitted = &d.gap.train.combined;
    if !d.causes.is_empty() && fitted.after < TO_THE_NOISE * fitted.noise_floor {
        format!("The nearest, {title}, explains the fitted trace alone: has the machine changed between the two? ")
    } else {
        let closed = Some(best.closure_holdout).filter(|c| *c > 0.0).map_or_else(|| "nothing".to_owned(), percent);
        format!("The nearest, {title}, closes {closed} of it. ")
    }
}
