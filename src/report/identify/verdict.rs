//! The head of the page: whether the axis is identified, and by what.

use super::estimates::value;
use super::recommended;
use crate::identify::identifiability::LEAST_FIT;
use crate::identify::result::Identification;
use crate::report::format::{self, Medium};
use crate::report::{Summary, Tone};

pub fn verdict(found: &Identification) -> Summary {
    let Some(best) = recommended(found).filter(|m| !m.parameters.is_empty()) else {
        return Summary {
            tone: Tone::Unsure,
            sentence: "No method could identify the axis from this trace.".to_owned(),
            detail: failures(found),
            figures: Vec::new(),
        };
    };
    let worst = best.outputs.iter().min_by(|a, b| a.fit_percent.total_cmp(&b.fit_percent));
    let sentence = match worst {
        Some(o) if best.outputs.len() == 1 => {
            format!(
                "{} identifies the axis: its simulation follows {} to {}.",
                best.title,
                o.signal.name(),
                fit_percent(o.fit_percent)
            )
        }
        Some(o) => format!(
            "{} identifies the axis: its simulation follows every output to {}{} ({} the least).",
            best.title,
            fit_percent(o.fit_percent),
            // ">99.99 %" says by itself that it is a bound.
            if fit_percent(o.fit_percent).starts_with('>') { "" } else { " or better" },
            o.signal.name()
        ),
        None => format!("{} identifies the axis.", best.title),
    };
    let identifiability = &found.identifiability;
    let tone = if identifiability.identified { Tone::Neutral } else { Tone::Unsure };
    let poor = worst.filter(|o| o.fit_percent < LEAST_FIT);
    let sentence = match poor {
        _ if identifiability.identified => sentence,
        Some(o) if o.fit_percent > 0.0 => format!(
            "The model does not follow the machine: with the estimates of {} its simulation follows {} to {} only.",
            best.title,
            o.signal.name(),
            fit_percent(o.fit_percent)
        ),
        Some(o) => format!(
            "The model does not follow the machine: with the estimates of {} its simulation is further from {} than its mean.",
            best.title,
            o.signal.name()
        ),
        None => format!("{} does not identify the axis from this record.", best.title),
    };
    let known = best.modal.iter().chain(best.parameters.iter()).filter(|e| e.is_determined());
    let figures = if identifiability.identified {
        known.take(4).map(|e| (e.name.to_owned(), value(e, e.unit))).collect()
    } else {
        Vec::new()
    };
    let detail = if identifiability.identified {
        found.recommended.as_ref().map_or_else(String::new, |r| sentence_of(&r.why))
    } else {
        let mut sentences = identifiability.doubts.clone();
        sentences.push(identifiability.advice.clone());
        sentences.retain(|w| !w.is_empty());
        sentences.join(" ")
    };
    Summary { tone, sentence, detail, figures }
}

/// Why no method has an estimate, each reason once, behind the methods that it holds for.
fn failures(found: &Identification) -> String {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for (m, why) in found.methods.iter().filter_map(|m| Some((m, m.failure.as_deref()?))) {
        match reasons.iter_mut().find(|(reason, _)| *reason == why) {
            Some((_, methods)) => methods.push(&m.title),
            None => reasons.push((why, vec![&m.title])),
        }
    }
    let sentences: Vec<String> =
        reasons.iter().map(|(why, methods)| sentence_of(&format!("{}: {why}", methods.join(", ")))).collect();
    sentences.join(" ")
}

/// A remark as a sentence: capital letter, full stop.
fn sentence_of(text: &str) -> String {
    let stop = if text.ends_with(['.', '!', '?']) { "" } else { "." };
    format::capital(text) + stop
}

fn fit_percent(fit: f64) -> String {
    format::percent(fit / 100.0, Medium::Page)
}
