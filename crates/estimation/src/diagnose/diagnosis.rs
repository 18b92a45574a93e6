//! The diagnosis as typed data. Its sentences, pages and files are made of it in the program's `report`.

use super::closed_loop::ClosedLoop;
use super::location::{Appearance, Location};
use super::verdict::Verdict;
use super::weighing::Confusable;
use crate::axis::{AxisKind, Structure};
use crate::effects::{Effect, Place};
use crate::hypothesis::{BaseParameter, Hypothesis};

/// Where something acts, as far as an axis' structure tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Site {
    /// A place of the chain.
    At(Place),
    /// The one inertia of a rigid axis: motor, coupling and table together.
    Axis,
}

impl Site {
    /// Where an effect of a place shows.
    #[must_use]
    pub const fn of(place: Place, structure: Structure) -> Self {
        match (place, structure) {
            (Place::Motor | Place::Coupling | Place::Table, Structure::Rigid) => Self::Axis,
            _ => Self::At(place),
        }
    }

    /// All that a structure has, in the order of the chain.
    #[must_use]
    pub const fn all(structure: Structure) -> &'static [Self] {
        match structure {
            Structure::Rigid => &[Self::At(Place::Input), Self::Axis, Self::At(Place::Sensor)],
            Structure::TwoInertia => &[
                Self::At(Place::Input),
                Self::At(Place::Motor),
                Self::At(Place::Coupling),
                Self::At(Place::Table),
                Self::At(Place::Sensor),
            ],
        }
    }

    /// Its name in files.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::At(place) => place.as_str(),
            Self::Axis => "axis",
        }
    }
}

/// A value with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error, where the record gives one.
    pub std: Option<f64>,
    /// Unit of both.
    pub unit: &'static str,
}

/// Everything that a diagnosis found.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// The machine's name.
    pub machine: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The hypothesis of largest evidence.
    pub chosen: Hypothesis,
    /// Causes, strongest first.
    pub causes: Vec<Cause>,
    /// Every hypothesis tried, best first.
    pub ranking: Vec<Ranked>,
    /// Effects that the record cannot tell from named ones.
    pub confusable: Vec<Confusable>,
    /// What acts beside the causes, where the record does not tell which of several effects it is.
    pub undecided: Option<Undecided>,
    /// Where the gap lies.
    pub location: Where,
    /// What stays unexplained beside the causes.
    pub remainder: Remainder,
    /// How large it is, and how far it shrinks.
    pub gap: GapReport,
    /// The nominal parameters as given and as fitted.
    pub parameters: Vec<AxisParameter>,
    /// The steps in which the readings come; `None` where they are fine, or the model knows of them.
    pub rounding: Option<Rounding>,
    /// Whether the search for causes ended at its limit of work.
    pub cut_short: bool,
    /// Whether the motion was taken as given, and not the torque.
    pub motion_is_given: bool,
    /// What the drive's loop says, for a record under control whose drive is known.
    pub closed_loop: Option<ClosedLoop>,
}

/// One of several effects, of which the record does not tell which; or a single one, where it is not likely enough to be named, and without
/// it those that are named would be lost.
#[derive(Debug, Clone, PartialEq)]
pub struct Undecided {
    /// The effects, the one in the improved model first.
    pub effects: Vec<Effect>,
    /// Share of the gap that comes back without it.
    pub share_of_gap: f64,
}

/// A cause.
#[derive(Debug, Clone)]
pub struct Cause {
    /// The effect.
    pub effect: Effect,
    /// Where it acts.
    pub site: Site,
    /// Form of the effect; empty for the plain one.
    pub variant: &'static str,
    /// Posterior probability.
    pub probability: f64,
    /// Share of the gap that comes back without it.
    pub share_of_gap: f64,
    /// Its free parameters: which of the effect's, and its value.
    pub parameters: Vec<(usize, Estimate)>,
}

impl Cause {
    /// The one cause of a gap, told by one parameter with its standard error.
    #[must_use]
    pub fn sole(effect: Effect, parameter: usize, value: f64, std: f64, motion: AxisKind) -> Self {
        let info = effect.info();
        let unit = info.parameters[parameter].unit_on(motion);
        let estimate = Estimate { value, std: Some(std).filter(|s| s.is_finite()), unit };
        Self {
            effect,
            site: Site::At(info.place),
            variant: "",
            probability: 1.0,
            share_of_gap: 1.0,
            parameters: vec![(parameter, estimate)],
        }
    }

    /// Its parameters by name.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &Estimate)> {
        let all = self.effect.info().parameters;
        self.parameters.iter().map(|(p, estimate)| (all[*p].name, estimate))
    }
}

/// A parameter of the axis.
#[derive(Debug, Clone, Copy)]
pub struct AxisParameter {
    /// Which.
    pub parameter: BaseParameter,
    /// As given.
    pub nominal: f64,
    /// Fitted without any effect.
    pub reidentified: f64,
    /// Fitted beside the effects of the chosen hypothesis.
    pub fitted: Estimate,
}

/// How a closure was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClosureOf {
    /// The model's own run through the whole record from one initial state.
    FreeRun,
    /// Runs of half a thousand samples, their initial states fitted.
    Windows,
    /// The torque that the model lacks, held to the measured motion.
    Torque,
}

/// The held-out gap by one way of measuring it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// The way.
    pub of: ClosureOf,
    /// Errors of the three models.
    pub levels: Levels,
    /// `1 - (after^2 - floor^2)/(before^2 - floor^2)`.
    pub closure: f64,
    /// The same from the re-identified model.
    pub closure_of_effect: f64,
    /// 95 % interval of `closure`.
    pub interval: [f64; 2],
}

/// What the fits do not see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeldOut {
    /// A record of its own.
    SecondRecord,
    /// The end of the one given.
    LastThird,
}

/// What no cause explains.
#[derive(Debug, Clone)]
pub struct Remainder {
    /// Its torque, rms in the band of the motion, N.m.
    pub torque_rms: f64,
    /// The same over the torque's rms.
    pub share: f64,
    /// As a multiple of what the encoders' noise makes.
    pub noise_multiple: f64,
    /// Where it shows.
    pub site: Site,
    /// What it looks like.
    pub looks: Appearance,
}

/// A hypothesis in the ranking.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// The hypothesis.
    pub hypothesis: Hypothesis,
    /// Where its first effect acts.
    pub site: Option<Site>,
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
#[derive(Debug, Clone)]
pub struct Where {
    /// The site; `None` where nothing but the parameters is needed.
    pub site: Option<Site>,
    /// Share of each site.
    pub shares: Vec<(Site, f64)>,
    /// The torque that the model lacks with its parameters fitted alone.
    pub shown: Location,
}

/// The gap on both records.
#[derive(Debug, Clone)]
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
    /// What `closure` and the levels are measured on: the first way, in the order of `ways`, by which the best model follows the record.
    pub closure_of: ClosureOf,
    /// The held-out gap by every way: free run, windows, torque.
    pub ways: [Way; 3],
    /// What the held-out data are.
    pub holdout_is: HeldOut,
}

/// rms errors over the rms of the signal; `noise_floor` likewise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// The model as given.
    pub before: f64,
    /// Its parameters fitted.
    pub reidentified: f64,
    /// With the effect.
    pub after: f64,
    /// Noise of the encoders.
    pub noise_floor: f64,
}

/// Levels combined over the signals and of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// All signals, each in units of its rms.
    pub combined: Levels,
    /// Each signal, see [`CHANNELS`](super::CHANNELS).
    pub signals: Vec<(&'static str, Levels)>,
    /// The same errors as multiples of the noise floor: before, re-identified, after.
    pub multiples: [f64; 3],
}

/// Readings that come in steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounding {
    /// The largest step, in the unit of its channel.
    pub step: f64,
    /// The channels that have one, see [`CHANNELS`](super::CHANNELS).
    pub channels: Vec<&'static str>,
    /// What it has to do with the verdict.
    pub role: RoundingRole,
}

/// What rounding has to do with a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RoundingRole {
    /// A part of the noise.
    Noise,
    /// The cause: it makes the better part of the noise, and nothing else is left.
    Cause,
    /// It would be the cause, and may not be named.
    Withheld,
}
