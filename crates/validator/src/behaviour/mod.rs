//! Behavioural rules: each loads the FMU in a process of its own (see [`super::isolation`]) and observes what it does.

pub(super) mod changes;
pub(super) mod delay;
pub(super) mod dependencies;
pub(super) mod effects;
pub(super) mod experiment;
pub(super) mod instances;
pub(super) mod interpolation;
pub(super) mod leaks;
pub(super) mod lifecycle;
mod measure;
mod no_set_prior;
pub(super) mod observed;
pub(super) mod partial;
pub(crate) mod probe;
pub(super) mod references;
pub(super) mod reset;
pub(super) mod rounded;
pub(super) mod settings;
pub(super) mod slope;
pub(super) mod start;
pub(super) mod state;
pub(super) mod step_size;
pub(super) mod steps;
pub(super) mod surroundings;
pub(super) mod symbols;
pub(super) mod three;
pub(super) mod values;

use std::path::PathBuf;
use std::sync::Arc;

use super::description::{BaseType, Description, Initial, Kind, Value, Variable};
use super::host::{HostError, Instance};
pub(crate) use probe::Stop;
use probe::{Learned, Probe, Tested, not_tested};

/// Where a rule finds the extracted FMU.
pub(crate) struct Setup {
    /// The model description.
    pub description: Description,
    /// The extracted FMU.
    pub folder: PathBuf,
    /// The binary.
    pub binary_path: PathBuf,
    /// The working directory of the rule's process.
    pub workplace: PathBuf,
    /// What earlier rules learnt.
    pub learned: Learned,
}

impl Setup {
    /// Loads the FMU.
    pub fn probe(&self) -> Result<Probe, HostError> {
        Probe::new(self.description.clone(), &self.folder, &self.binary_path, false, self.learned.clone())
    }
}

/// How a behavioural rule is tested.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Behaviour {
    /// Before the binary is loaded.
    Raw(fn(&Setup) -> Tested),
    /// On the loaded binary.
    Loaded(fn(&Probe) -> Tested),
    /// On the loaded binary, by calls whose success is tested by another rule: where one fails, this rule is not tested.
    Indirect(fn(&Probe) -> Tested),
    /// On the loaded binary, learning what later rules need.
    Learning(fn(&mut Probe) -> Tested),
}

/// Runs a rule; what was learnt comes with the result.
pub(crate) fn run(behaviour: Behaviour, setup: &Setup) -> (Tested, Learned) {
    let tested = match behaviour {
        Behaviour::Raw(test) => test(setup),
        Behaviour::Loaded(_) | Behaviour::Indirect(_) | Behaviour::Learning(_) => match setup.probe() {
            Err(error) => Err(error.into()),
            Ok(mut probe) => {
                let tested = match behaviour {
                    Behaviour::Loaded(test) | Behaviour::Indirect(test) => test(&probe),
                    Behaviour::Learning(test) => test(&mut probe),
                    Behaviour::Raw(_) => Ok(vec![]),
                };
                let learned = probe.learned.clone();
                // Unloading is a rule of its own.
                std::mem::forget(probe);
                return (tested, learned);
            }
        },
    };
    (tested, setup.learned.clone())
}

impl Probe {
    /// Takes over what was learnt.
    fn learn(&mut self, learned: Learned) {
        let fresh = Self::with(
            self.d.clone(),
            self.folder.clone(),
            self.binary_path.clone(),
            Arc::clone(&self.binary),
            learned,
        );
        *self = fresh;
    }

    /// Whether anything is left to compare.
    fn comparable(&self) -> Result<(), Stop> {
        if self.observed.iter().all(Vec::is_empty) {
            return not_tested("no variable is the same in two equal runs");
        }
        Ok(())
    }
}

/// A number as a variable holds it: one of 32 bits rounds it.
fn clamped(v: &Variable, x: f64) -> f64 {
    if v.cell.is_some_and(|c| c.kind == Kind::Float32) { f64::from(x as f32) } else { x }
}

/// Another value for a Real that the environment sets, within its limits; none when it cannot be chosen.
fn settable_real(p: &Probe, v: &Variable) -> Option<f64> {
    if v.base() != BaseType::Real
        || v.causality != super::description::Causality::Input && v.initial() != Some(Initial::Exact)
    {
        return None;
    }
    let Some(Value::Real(start)) = v.start else { return None };
    let r = p.d.resolved(v);
    let (low, high) = (r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY));
    let step = 0.05 * start.abs().max(if start == 0.0 { 1.0 } else { 0.0 });
    [start + step, start - step, 0.5 * (start + high), 0.5 * (start + low)]
        .into_iter()
        .map(|x| clamped(v, x))
        .find(|x| x.is_finite() && (low..=high).contains(x) && *x != start)
}
