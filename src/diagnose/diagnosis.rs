//! The diagnosis as plain data: the contract of `diagnosis.json` (schema `eixo.diagnosis/1`).

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::closed_loop::ClosedLoop;
use super::gap::Figures;
use super::verdict::Verdict;
use crate::effects::Effect;

/// Name and version of the format.
pub const SCHEMA: &str = "eixo.diagnosis/1";

/// Everything that `eixo diagnose` found.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// The machine's name.
    pub machine: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict in a sentence.
    pub sentence: String,
    /// Causes, strongest first.
    pub causes: Vec<Cause>,
    /// Every hypothesis tried, best first.
    pub ranking: Vec<Ranked>,
    /// Pairs that the record cannot tell apart, and why.
    pub confusable: Vec<[String; 3]>,
    /// What to measure next.
    pub next_experiment: String,
    /// Where the gap lies.
    #[serde(rename = "where")]
    pub location: Where,
    /// What stays unexplained beside the causes; absent where the record cannot be compared in torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remainder: Option<Remainder>,
    /// How large it is, and how far it shrinks.
    pub gap: GapReport,
    /// The nominal parameters as given and as fitted.
    pub parameters: Map<String, Value>,
    /// What the user should know of the data.
    pub warnings: Vec<String>,
    /// What the drive's loop says, for a record under control whose drive is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_loop: Option<ClosedLoop>,
}

/// A cause.
#[derive(Debug, Clone, Serialize)]
pub struct Cause {
    /// Id of the effect.
    pub id: String,
    /// Its family.
    pub family: String,
    /// Its place.
    pub place: String,
    /// Form of the effect; empty for the plain one.
    pub variant: String,
    /// Posterior probability.
    pub probability: f64,
    /// Share of the gap that comes back without it.
    pub share_of_gap: f64,
    /// Its parameters by name.
    pub parameters: Map<String, Value>,
}

impl Cause {
    /// The one cause of a gap, told by one parameter with its standard error.
    #[must_use]
    pub fn alone(effect: Effect, name: &str, value: f64, std: f64, unit: &str) -> Self {
        let info = effect.info();
        let std = if std.is_finite() { json!(std) } else { Value::Null };
        let mut parameters = Map::new();
        parameters.insert(name.to_owned(), json!({ "value": value, "std": std, "unit": unit }));
        Self {
            id: info.id.to_owned(),
            family: info.family.as_str().to_owned(),
            place: info.place.as_str().to_owned(),
            variant: String::new(),
            probability: 1.0,
            share_of_gap: 1.0,
            parameters,
        }
    }
}

/// How a closure was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ClosureOf {
    /// The model's own run through the whole record from one initial state.
    FreeRun,
    /// Runs of half a thousand samples, their initial states fitted.
    Windows,
}

/// What no cause explains.
#[derive(Debug, Clone, Serialize)]
pub struct Remainder {
    /// Its torque, rms in the band of the motion, N.m.
    pub torque_rms: f64,
    /// The same over the torque's rms.
    pub share: f64,
    /// As a multiple of what the encoders' noise makes.
    pub noise_multiple: f64,
    /// Where it shows.
    pub place: String,
    /// What it looks like.
    pub summary: String,
}

/// A hypothesis in the ranking.
#[derive(Debug, Clone, Serialize)]
pub struct Ranked {
    /// Id of the effect, ids joined by `+`, `parameters` or `no_gap`.
    pub id: String,
    /// Family of its first effect.
    pub family: String,
    /// Place of its first effect.
    pub place: String,
    /// Posterior probability.
    pub probability: f64,
    /// BIC above the best's.
    pub delta_bic: f64,
    /// Squared residual per value, in units of the noise.
    pub chi2: f64,
    /// Closure on held-out data.
    pub closure_holdout: f64,
}

/// Where the gap lies.
#[derive(Debug, Clone, Serialize)]
pub struct Where {
    /// The place.
    pub place: String,
    /// Share of each place.
    pub by_place: Map<String, Value>,
    /// The residual along time.
    pub by_time: Value,
    /// And along frequency.
    pub by_frequency: Value,
    /// And against the state.
    pub by_state: Value,
    /// In words.
    pub summary: String,
}

/// The gap on both records.
#[derive(Debug, Clone, Serialize)]
pub struct GapReport {
    /// On the data the fits saw.
    pub train: Figures,
    /// On data they did not see.
    pub holdout: Figures,
    /// `1 - (after^2 - floor^2)/(before^2 - floor^2)` on held-out data.
    pub closure: f64,
    /// The same from the re-identified model.
    pub closure_of_effect: f64,
    /// 95 % interval of `closure`.
    pub interval: [f64; 2],
    /// What `closure` and the levels are measured on.
    pub closure_of: ClosureOf,
    /// What the held-out data are.
    pub holdout_is: String,
}
