//! The whole diagnosis of one record: search, decision, held-out figures, words.

use serde_json::{Map, Value, json};

use super::decide::{Decision, Verdict, decide};
use super::diagnosis::{Cause, ClosureOf, Diagnosis, GapReport, Ranked, SCHEMA, Where};
use super::evidence::{self, Evidence};
use super::fit::Data;
use super::gap::{self, Gap};
use super::lattice;
use super::location::{Location, locate, without_offset};
use super::model::{BaseParameter, Free, Model};
use super::noise::NoiseEstimate;
use super::record::Record;
use super::search::{Search, Tested};
use super::windows::{Initial, Window, cut};
use super::{lines, states, words};
use crate::axis::{Motion, Structure};
use crate::effects::{Effect, Place};

/// Share of a single record that is held out.
pub(super) const HELD_OUT: f64 = 1.0 / 3.0;

/// Samples of a record that are worked on at most: what a longer one adds to the naming of a cause is time.
const LONGEST: usize = 16_384;

/// Closure in time, from the parameters fitted, that a cause named at the excitation's lines must have: it need not close
/// anything there, but if it more than doubles the squared error it is no cause.
const WORSE: f64 = -1.0;

/// What is diagnosed.
pub struct Case<'a> {
    /// The machine's name.
    pub machine: String,
    /// The nominal model.
    pub nominal: Model,
    /// What its numbers are units of.
    pub motion: Motion,
    /// Record that the fits see.
    pub train: &'a Record,
    /// What is known of its noise.
    pub noise: &'a NoiseEstimate,
    /// Record held out; without it the last third of the one given.
    pub holdout: Option<&'a Record>,
    /// Effects that may be named.
    pub suspects: Vec<Effect>,
}

/// The diagnosis, and the improved model.
pub struct Outcome {
    /// For files and people.
    pub diagnosis: Diagnosis,
    /// The nominal model with its parameters as fitted and the effects found.
    pub improved: Model,
    /// Model as given, re-identified, improved: for plots.
    pub models: [Model; 3],
    /// The decision with its fits.
    pub decision: Decision,
    /// What the report draws.
    pub evidence: Evidence,
    /// A stretch of held-out data for the improved model to be run on.
    pub replay: Replay,
}

/// The first held-out window, and the improved model's state at its beginning.
pub struct Replay {
    /// The stretch.
    pub record: Record,
    /// `[theta1, omega1, theta2, omega2]` at its first sample.
    pub initial: [f64; 4],
}

/// Diagnoses a record.
#[must_use]
pub fn diagnose(case: &Case<'_>, progress: &(dyn Fn(&str) + Sync)) -> Outcome {
    if case.nominal.structure == Structure::Rigid {
        return super::torque::diagnose(case, progress);
    }
    let (all, all_held) = split(case);
    let (record, other) = (&first(&all), &first(&all_held));
    let train = cut(0..record.len());
    let held_windows = cut(0..other.len());
    let data = Data { record, windows: &train };
    let search = Search {
        data,
        nominal: case.nominal,
        coarse: lattice::dominates(case.noise),
        suspects: case.suspects.iter().copied().filter(|e| e.has_windows()).collect(),
        states: states::along(record, &case.nominal),
    };
    progress("the model as given");
    let mut decision = decide(&search, progress);
    progress("held-out data");
    let held = Held { record: other, windows: &held_windows, states: states::along(other, &case.nominal) };
    let fitted = [case.nominal, decision.parameters.fitted.model, decision.chosen.fitted.model];
    let on_held = held.gap(fitted);
    decision.confirm(&on_held);
    progress("lines of the excitation");
    let unexplained = decision.verdict == Verdict::Unexplained;
    let linear = unexplained.then(|| lines::examine(case, &all, &all_held)).flatten().and_then(|found| {
        let models = [fitted[0], fitted[1], *found.improved()];
        let on_held = held.gap(models);
        (on_held.closure_of_effect > WORSE).then_some((found, models, on_held))
    });
    progress("where");
    let located = locate(record, &case.nominal.parameters, case.nominal.structure);
    let (linear, models, on_held) = match linear {
        Some((found, models, on_held)) => (Some(found), models, on_held),
        None => (None, fitted, on_held),
    };
    let on_train = {
        let initial = initial(&search.states, &train);
        let e = models.map(|m| gap::errors(data, &m, &initial).0);
        gap::measure(record, &train, [&e[0], &e[1], &e[2]])
    };
    let mut diagnosis = build(case, &decision, &held, on_train, on_held, &located);
    lattice::judge(case, &decision, &mut diagnosis);
    words::fill(&mut diagnosis, &decision);
    if let Some(linear) = &linear {
        linear.tell(&mut diagnosis, case.motion);
    }
    diagnosis.remainder = super::torque::remainder(record, &models[2]);
    diagnosis.warnings.extend(lines::warnings(case.train, case.noise));
    let evidence = evidence::gather(located, held.record, held.windows, &initial(&held.states, held.windows), &models);
    let replay = held.replay(&models[2]);
    Outcome { diagnosis, improved: models[2], models, decision, evidence, replay }
}

/// The record that the fits see, and the one that they do not; encoders with zeros of their own are brought together.
fn split(case: &Case<'_>) -> (Record, Record) {
    let whole = without_offset(case.train, &case.nominal.parameters, case.nominal.structure);
    let n = whole.len();
    match case.holdout {
        Some(other) => {
            let other = without_offset(other, &case.nominal.parameters, case.nominal.structure);
            (whole, other)
        }
        None => {
            let split = n - (n as f64 * HELD_OUT) as usize;
            (whole.part(0..split), whole.part(split..n))
        }
    }
}

/// As much of a record as is worked on.
fn first(record: &Record) -> Record {
    record.part(0..record.len().min(LONGEST))
}

fn initial(states: &super::response::States, windows: &[Window]) -> Vec<Initial> {
    windows.iter().map(|w| states.initial(w.begin)).collect()
}

/// Held-out data.
struct Held<'a> {
    record: &'a Record,
    windows: &'a [Window],
    states: super::response::States,
}

impl Held<'_> {
    fn errors(&self, model: &Model) -> Vec<nalgebra::Vector4<f64>> {
        let data = Data { record: self.record, windows: self.windows };
        gap::errors(data, model, &initial(&self.states, self.windows)).0
    }

    fn replay(&self, model: &Model) -> Replay {
        let first = &self.windows[..1];
        let data = Data { record: self.record, windows: first };
        let [theta1, omega1, theta2, omega2, ..] = gap::errors(data, model, &initial(&self.states, first)).1[0];
        let record = self.record.part(first[0].begin..first[0].compared.end);
        Replay { record, initial: [theta1, omega1, theta2, omega2] }
    }

    fn gap(&self, models: [Model; 3]) -> Gap {
        let e = models.map(|m| self.errors(&m));
        gap::measure(self.record, self.windows, [&e[0], &e[1], &e[2]])
    }
}

fn build(
    case: &Case<'_>,
    decision: &Decision,
    held: &Held<'_>,
    train: Gap,
    holdout: Gap,
    located: &Location,
) -> Diagnosis {
    let values = decision.values;
    let best = decision.ranking.first().map_or(0.0, |w| w.bic);
    let before = held.errors(&decision.given.fitted.model);
    let ranking = decision
        .ranking
        .iter()
        .map(|w| {
            let e = held.errors(&w.tested.fitted.model);
            let closure = gap::measure(held.record, held.windows, [&before, &before, &e]).closure;
            let (id, family, place) = name(&w.tested);
            Ranked {
                id,
                family,
                place,
                probability: w.probability,
                delta_bic: w.bic - best,
                chi2: w.tested.fitted.chi2 / values,
                closure_holdout: closure,
            }
        })
        .collect();
    let causes = causes(decision, case.motion);
    let verdict = decision.verdict;
    Diagnosis {
        schema: SCHEMA,
        machine: case.machine.clone(),
        verdict,
        sentence: String::new(),
        location: location(&causes, verdict, located),
        remainder: None,
        causes,
        ranking,
        confusable: Vec::new(),
        next_experiment: String::new(),
        gap: GapReport {
            closure: holdout.closure,
            closure_of_effect: holdout.closure_of_effect,
            interval: holdout.interval,
            closure_of: ClosureOf::Windows,
            train: train.figures,
            holdout: holdout.figures,
            holdout_is: if case.holdout.is_some() { "a second record" } else { "the last third of the record" }
                .to_owned(),
        },
        parameters: parameters(case, decision),
        warnings: warnings(case),
        closed_loop: None,
    }
}

fn warnings(case: &Case<'_>) -> Vec<String> {
    let mut warnings = Vec::new();
    let n = case.train.len();
    let used = if case.holdout.is_some() { n } else { n - (n as f64 * HELD_OUT) as usize };
    if used > LONGEST {
        warnings.push(format!("The record is long: causes were searched in its first {LONGEST} samples."));
    }
    if !(case.train.sees_motor() && case.train.sees_table()) && case.nominal.structure == Structure::TwoInertia {
        warnings.push("One encoder only: which side of the coupling a force acts on is known less well.".to_owned());
    }
    warnings
}

/// Id, family and place of a hypothesis.
fn name(t: &Tested) -> (String, String, String) {
    match t.effects.first() {
        None if t.freedom == 0 => ("no_gap".to_owned(), "none".to_owned(), "none".to_owned()),
        None => ("parameters".to_owned(), "parameters".to_owned(), "none".to_owned()),
        Some((e, _)) => (t.ids().join("+"), e.info().family.as_str().to_owned(), e.info().place.as_str().to_owned()),
    }
}

fn causes(decision: &Decision, motion: Motion) -> Vec<Cause> {
    if decision.verdict == Verdict::Parameters {
        let Some((gain, std)) = decision.torque_gain() else { return Vec::new() };
        let info = Effect::TorqueGain.info();
        let mut parameters = Map::new();
        parameters.insert("gain".to_owned(), json!({ "value": gain, "std": std, "unit": "1" }));
        return vec![Cause {
            id: info.id.to_owned(),
            family: info.family.as_str().to_owned(),
            place: info.place.as_str().to_owned(),
            variant: String::new(),
            probability: 1.0,
            share_of_gap: 1.0,
            parameters,
        }];
    }
    let chosen = &decision.chosen;
    let fitted = &chosen.fitted;
    let mut causes: Vec<Cause> = chosen
        .effects
        .iter()
        .zip(&decision.shares)
        .map(|((effect, variant), share)| {
            let info = effect.info();
            let mut parameters = Map::new();
            for (i, p) in info.parameters.iter().enumerate() {
                let free = fitted.coordinates.iter().position(|c| c.free == Free::Effect(*effect, i));
                if let Some(at) = free {
                    let value = fitted.model.effects.of(*effect)[i];
                    parameters.insert(
                        p.name.to_owned(),
                        json!({ "value": value, "std": finite(fitted.std[at]), "unit": motion.unit(p.unit) }),
                    );
                }
            }
            Cause {
                id: info.id.to_owned(),
                family: info.family.as_str().to_owned(),
                place: info.place.as_str().to_owned(),
                variant: info.variants[*variant].name.to_owned(),
                probability: decision
                    .ranking
                    .iter()
                    .filter(|w| w.tested.effects.iter().any(|(e, _)| e == effect))
                    .map(|w| w.probability)
                    .sum::<f64>()
                    .min(1.0),
                share_of_gap: *share,
                parameters,
            }
        })
        .collect();
    causes.sort_by(|a, b| b.share_of_gap.total_cmp(&a.share_of_gap));
    causes
}

fn finite(v: f64) -> Value {
    if v.is_finite() { json!(v) } else { Value::Null }
}

/// Where the gap lies: the causes' own places, beside what the smoother says without knowing any cause.
fn location(causes: &[Cause], verdict: Verdict, located: &Location) -> Where {
    let mut by_place = Map::new();
    for place in Place::ALL {
        let named: f64 = causes.iter().filter(|c| c.place == place.as_str()).map(|c| c.share_of_gap).sum();
        let seen = located.by_place.iter().find(|e| e.place == Some(place)).map_or(0.0, |e| e.share);
        by_place.insert(place.as_str().to_owned(), json!(if causes.is_empty() { seen } else { named }));
    }
    let smoother = located.place.map_or("none", Place::as_str);
    let place = match (causes.first(), verdict) {
        (Some(c), Verdict::Effect | Verdict::Parameters) => c.place.clone(),
        (_, Verdict::Unexplained) => smoother.to_owned(),
        _ => "none".to_owned(),
    };
    let mut summary = located.summary.clone();
    if verdict == Verdict::Effect && located.place.is_some() && place != smoother {
        summary.push_str(&format!(
            " The unknown-input smoother alone puts it at the {smoother}, the fitted cause at the {place}: the fit, which \
             explains the record better, decides."
        ));
    }
    Where {
        place,
        by_place,
        by_time: json!(located.by_time),
        by_frequency: json!(located.by_frequency),
        by_state: json!(located.by_state),
        summary,
    }
}

fn parameters(case: &Case<'_>, decision: &Decision) -> Map<String, Value> {
    let fitted = &decision.chosen.fitted;
    BaseParameter::of(case.nominal.structure)
        .iter()
        .map(|p| {
            let at = fitted.coordinates.iter().position(|c| c.free == Free::Base(*p));
            let value = json!({
                "nominal": p.value(&case.nominal.parameters),
                "reidentified": p.value(&decision.parameters.fitted.model.parameters),
                "fitted": p.value(&fitted.model.parameters),
                "std": at.map_or(Value::Null, |i| finite(fitted.std[i])),
                "unit": case.motion.unit(p.unit()),
            });
            (p.name().to_owned(), value)
        })
        .collect()
}
