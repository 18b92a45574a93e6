//! A linear cause found at the lines, put into the diagnosis.

use serde_json::{Map, Value, json};

use super::Found;
use super::data::place;
use super::fit::Hypothesis;
use crate::axis::Motion;
use crate::diagnose::decide::Verdict;
use crate::diagnose::diagnosis::{Cause, Diagnosis, Ranked};
use crate::diagnose::model::{BaseParameter, Free};
use crate::effects::{Effect, Family, Place};

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share.clamp(-9.99, 1.0))
}

fn finite(v: f64) -> Value {
    if v.is_finite() { json!(v) } else { Value::Null }
}

impl Found {
    /// Turns a diagnosis that abstained into one that names the linear part; the figures of the gap in time stay.
    pub fn tell(&self, d: &mut Diagnosis, motion: Motion) {
        d.verdict = Verdict::Effect;
        d.causes = self.causes(motion);
        d.ranking = self.ranking();
        d.parameters = self.parameters(d, motion);
        d.confusable = self.confusable();
        self.locate(d);
        self.words(d);
    }

    fn causes(&self, motion: Motion) -> Vec<Cause> {
        let h = &self.choice.chosen;
        let mut causes: Vec<Cause> = h
            .effects
            .iter()
            .zip(&self.choice.shares)
            .map(|(&effect, &share)| {
                let info = effect.info();
                let mut parameters = Map::new();
                for (c, std) in h.coordinates.iter().zip(&h.std) {
                    if let Free::Effect(e, i) = c.free
                        && e == effect
                    {
                        let p = &info.parameters[i];
                        let value =
                            json!({ "value": c.value(&h.model), "std": finite(*std), "unit": motion.unit(p.unit) });
                        parameters.insert(p.name.to_owned(), value);
                    }
                }
                let with = |w: &&(Hypothesis, f64, f64)| w.0.effects.contains(&effect);
                Cause {
                    id: info.id.to_owned(),
                    family: info.family.as_str().to_owned(),
                    place: info.place.as_str().to_owned(),
                    variant: info.variants[0].name.to_owned(),
                    probability: self.choice.ranking.iter().filter(with).map(|w| w.2).sum::<f64>().min(1.0),
                    share_of_gap: share,
                    parameters,
                }
            })
            .collect();
        causes.sort_by(|a, b| b.share_of_gap.total_cmp(&a.share_of_gap));
        causes
    }

    fn ranking(&self) -> Vec<Ranked> {
        let best = self.choice.ranking.first().map_or(0.0, |w| w.1);
        let given = &self.choice.given.model;
        let describe = |h: &Hypothesis| match h.effects.as_slice() {
            [] if h.coordinates.is_empty() => ("no_gap".to_owned(), "none".to_owned(), "none".to_owned()),
            [] => ("parameters".to_owned(), "parameters".to_owned(), "none".to_owned()),
            [first, ..] => {
                let ids: Vec<&str> = h.effects.iter().map(|e| e.info().id).collect();
                (ids.join("+"), first.info().family.as_str().to_owned(), place(*first).as_str().to_owned())
            }
        };
        let ranked = |(h, bic, probability): &(Hypothesis, f64, f64)| {
            let (id, family, place) = describe(h);
            Ranked {
                id,
                family,
                place,
                probability: *probability,
                delta_bic: bic - best,
                chi2: self.lines.chi2(&h.model),
                closure_holdout: self.closes(given, &h.model),
            }
        };
        self.choice.ranking.iter().map(ranked).collect()
    }

    fn parameters(&self, d: &Diagnosis, motion: Motion) -> Map<String, Value> {
        let h = &self.choice.chosen;
        let row = |p: &BaseParameter| {
            let at = h.coordinates.iter().position(|c| c.free == Free::Base(*p));
            let value = json!({
                "nominal": p.value(&self.choice.given.model.parameters),
                "reidentified": d.parameters.get(p.name()).and_then(|p| p.get("reidentified")).cloned(),
                "fitted": p.value(&h.model.parameters),
                "std": at.map_or(Value::Null, |i| finite(h.std[i])),
                "unit": motion.unit(p.unit()),
            });
            (p.name().to_owned(), value)
        };
        BaseParameter::of(h.model.structure).iter().map(row).collect()
    }

    fn confusable(&self) -> Vec<[String; 3]> {
        let words = |(named, other, delta, closed): &(Effect, Effect, f64, f64)| {
            let why = format!(
                "at the excited lines {} closes {} of the gap and {} {}; their fits differ by {delta:.1} in BIC, and what \
                 either leaves is the model's own error",
                named.info().id,
                percent(self.choice.closure),
                other.info().id,
                percent(*closed)
            );
            [named.info().id.to_owned(), other.info().id.to_owned(), why]
        };
        self.choice.alike.iter().map(words).collect()
    }

    fn locate(&self, d: &mut Diagnosis) {
        let first = d.causes.first().map_or_else(|| "none".to_owned(), |c| c.place.clone());
        for place in Place::ALL {
            let share: f64 = d.causes.iter().filter(|c| c.place == place.as_str()).map(|c| c.share_of_gap).sum();
            d.location.by_place.insert(place.as_str().to_owned(), json!(share));
        }
        if d.location.place != first {
            d.location.summary.push_str(&format!(
                " The unknown-input smoother alone, which sees drift and friction too, puts it at the {}; the linear part \
                 of it lies at the {first}.",
                d.location.place
            ));
        }
        d.location.place = first;
    }

    fn words(&self, d: &mut Diagnosis) {
        let [low, high] = self.lines.band();
        let (base, chosen) = (self.choice.base.model, *self.improved());
        let names: Vec<String> = d.causes.iter().map(named).collect();
        let held = match &self.held {
            Some(h) => format!("{} on {} held-out periods", percent(self.closes(&base, &chosen)), h.periods),
            None => "there are not enough held-out periods to check it".to_owned(),
        };
        let levels = &d.gap.holdout.combined;
        d.sentence = format!(
            "{}: closes {} of the linear part of the gap, the {} lines of the excitation from {low:.4} to {high:.4} Hz \
             ({held}). A remainder stays: the relative error of the response there falls from {} to {}, largest near {:.4} \
             Hz; and what does not repeat with the excitation (drift, friction) is not named: in time the model's error on \
             held-out data goes from {} of the signal to {}.",
            names.join(", and "),
            percent(self.choice.closure),
            self.lines.len(),
            percent(self.lines.relative_error(&base)),
            percent(self.lines.relative_error(&chosen)),
            self.lines.worst(&chosen),
            percent(levels.before),
            percent(levels.after),
        );
        d.warnings.push(format!(
            "Nothing explains this record in time down to its noise: the cause is named by the response at the lines of \
             the excitation, where it closes {} of the re-identified model's gap; the ranking holds for these lines.",
            percent(self.choice.closure)
        ));
        let families: Vec<Family> = self.choice.chosen.effects.iter().map(|e| e.info().family).collect();
        let mut next = Vec::new();
        if families.iter().any(|f| matches!(f, Family::Delay | Family::ActuatorLag)) {
            next.push(
                "Log the drive's measured current beside its command and diagnose with it as the torque: the lag must be \
                 gone; and excite a higher band, where a delay's phase goes on falling and a lag's bends.",
            );
        }
        if families.contains(&Family::FlexibleMode) {
            next.push(
                "Describe the axis with one inertia more (structure = \"two_inertia\", where it is rigid now) and an \
                 encoder on the far side, and diagnose again.",
            );
        }
        if families.contains(&Family::Sensor) {
            next.push("Latch both encoders by one clock, and diagnose again.");
        }
        next.push(
            "Repeat at half the amplitude: what stays at the lines then is linear, what changes is friction or play.",
        );
        d.next_experiment = next.join(" ");
    }
}

/// A cause with its numbers.
fn named(cause: &Cause) -> String {
    let title = Effect::from_id(&cause.id).map_or("", |e| e.info().title);
    let numbers: Vec<String> = cause
        .parameters
        .iter()
        .map(|(name, p)| {
            let of = |key: &str| p.get(key).and_then(Value::as_f64).unwrap_or(f64::NAN);
            let unit = p.get("unit").and_then(Value::as_str).unwrap_or_default();
            format!("{name} {:.3e} ± {:.1e} {unit}", of("value"), of("std"))
        })
        .collect();
    format!("{title} ({}, at the {}; {})", cause.id, cause.place, numbers.join(", "))
}
