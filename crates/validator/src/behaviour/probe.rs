//! What the behavioural rules share: an FMU under test, how it is driven, and what is observed of it.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};

use super::super::description::{
    BaseType, Causality, Description, Fmi, Initial, Interface, Value, Variability, Variable,
};
use super::super::host::{Binary, HostError, Instance, InstanceOptions, Layout, needs_event_mode, resource_location};

/// Largest number of variables of a type that are observed in addition to the outputs.
const MOST_OBSERVED: usize = 2000;
/// Communication steps of a comparison.
pub(super) const STEPS: usize = 20;

/// What the first rules learn about an FMU for the later ones.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Learned {
    /// Whether the FMU takes varying inputs; constant ones otherwise.
    pub stimulus: bool,
    /// Whether every variable can be read; outputs alone otherwise.
    pub observe_all: bool,
    /// Variables that differ between equal runs, by type and value reference: compared no more.
    pub masked: Vec<(u8, u32)>,
    /// References of Strings that are no texts, which one rule reports: the other rules do not read them.
    pub no_texts: Vec<u32>,
    /// Communication steps that fit into a comparison of a slow FMU, or one that ends early; 0 is not known.
    pub steps: usize,
    /// Wall time of a step, in s.
    pub cost: f64,
    /// Whether inputs that vary end the FMU's process: they are left alone then.
    pub tame: bool,
    /// A communication step that the FMU takes, where it declares none and refused the usual one, in s; 0 where not.
    pub step: f64,
}

/// Why a rule ended without a result.
#[derive(Debug)]
pub(crate) enum Stop {
    /// The FMU has nothing for the rule to test.
    NotApplicable(String),
    /// It could not be tested.
    NotTested(String),
    /// A call failed, which is a finding.
    Host(HostError),
}

impl From<HostError> for Stop {
    fn from(error: HostError) -> Self {
        if matches!(error, HostError::OnlyOnce) {
            return Self::NotApplicable(error.to_string());
        }
        Self::Host(error)
    }
}

/// A rule's findings; empty is a pass.
pub(crate) type Tested = Result<Vec<String>, Stop>;

pub(super) fn not_applicable<T>(why: impl Into<String>) -> Result<T, Stop> {
    Err(Stop::NotApplicable(why.into()))
}

pub(super) fn not_tested<T>(why: impl Into<String>) -> Result<T, Stop> {
    Err(Stop::NotTested(why.into()))
}

/// An observed variable.
#[derive(Debug, Clone)]
pub(crate) struct Observed {
    pub name: String,
    pub reference: u32,
    /// Whether it is computed: an output or a local variable.
    pub calculated: bool,
}

/// Values of the observed variables, by type.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Snapshot {
    pub reals: Vec<f64>,
    pub integers: Vec<i64>,
    pub booleans: Vec<i32>,
    pub strings: Vec<String>,
}

/// The FMU under test.
pub(crate) struct Probe {
    pub d: Description,
    /// There for FMI 3.0.
    pub layout: Option<Arc<Layout>>,
    pub folder: PathBuf,
    pub binary_path: PathBuf,
    pub binary: Arc<Binary>,
    pub start: f64,
    pub stop: Option<f64>,
    pub step: f64,
    pub learned: Learned,
    /// Instances made so far in this process.
    pub instances: AtomicUsize,
    /// Observed variables: Real, Integer and Enumeration, Boolean, String.
    pub(super) observed: [Vec<Observed>; 4],
}

pub(super) fn type_index(base: BaseType) -> usize {
    match base {
        BaseType::Real => 0,
        BaseType::Integer | BaseType::Enumeration => 1,
        BaseType::Boolean => 2,
        BaseType::String => 3,
    }
}

impl Probe {
    pub fn new(
        d: Description,
        folder: &Path,
        binary_path: &Path,
        now: bool,
        learned: Learned,
    ) -> Result<Self, HostError> {
        let binary = Arc::new(Binary::load(binary_path, now)?);
        Ok(Self::with(d, folder.to_owned(), binary_path.to_owned(), binary, learned))
    }

    pub(super) fn with(
        mut d: Description,
        folder: PathBuf,
        binary_path: PathBuf,
        binary: Arc<Binary>,
        learned: Learned,
    ) -> Self {
        for v in &mut d.variables {
            if v.base() == BaseType::String && learned.no_texts.contains(&v.value_reference) {
                (v.causality, v.variability) = (Causality::Local, Variability::Discrete);
                (v.declared_initial, v.start) = (None, None);
            }
        }
        let e = d.default_experiment.unwrap_or_default();
        let start = e.start_time.unwrap_or(0.0);
        let stop = e.stop_time.filter(|&stop| stop > start);
        let step = e.step_size.filter(|&h| h > 0.0).or(Some(learned.step).filter(|&h| h > 0.0));
        let step = step.or_else(|| stop.map(|stop| (stop - start) / 500.0)).unwrap_or(0.01);
        let fixed = d.co_simulation.as_ref().and_then(|i| i.fixed_step);
        let step = if e.step_size.is_none() && learned.step <= 0.0 { fixed.unwrap_or(step) } else { step };
        let mut probe = Self {
            layout: Layout::of(&d),
            observed: Default::default(),
            instances: AtomicUsize::new(0),
            folder,
            binary_path,
            d,
            binary,
            start,
            stop,
            step,
            learned,
        };
        probe.choose_observed();
        probe
    }

    pub fn interface(&self) -> &Interface {
        self.d.co_simulation.as_ref().expect("only co-simulation FMUs are probed")
    }

    fn choose_observed(&mut self) {
        let no_texts = self.learned.no_texts.iter().map(|&r| (type_index(BaseType::String) as u8, r));
        let masked: HashSet<(u8, u32)> = self.learned.masked.iter().copied().chain(no_texts).collect();
        let mut seen = HashSet::new();
        let mut chosen: [Vec<Observed>; 4] = Default::default();
        for outputs in [true, false] {
            for v in &self.d.variables {
                let index = type_index(v.base());
                let wanted = (v.causality == Causality::Output) == outputs && (outputs || self.learned.observe_all);
                if wanted
                    && (outputs || chosen[index].len() < MOST_OBSERVED)
                    && !masked.contains(&(index as u8, v.value_reference))
                    && seen.insert((index, v.value_reference))
                {
                    let calculated = matches!(v.causality, Causality::Output | Causality::Local);
                    chosen[index].push(Observed { name: v.name.clone(), reference: v.value_reference, calculated });
                }
            }
        }
        self.observed = chosen;
    }

    pub fn options(&self) -> InstanceOptions {
        InstanceOptions {
            name: "instance".into(),
            guid: self.d.guid.clone(),
            resources: resource_location(&self.folder, self.d.fmi),
            layout: self.layout.clone(),
            event_mode: needs_event_mode(&self.d),
            ..InstanceOptions::default()
        }
    }

    pub fn instantiate(&self) -> Result<Instance, HostError> {
        if self.instances.fetch_add(1, Ordering::Relaxed) > 0 && self.interface().only_once {
            return Err(HostError::OnlyOnce);
        }
        Instance::new(Arc::clone(&self.binary), None, &self.options())
    }

    /// An instance in initialisation mode, its inputs driven.
    pub fn initializing(&self) -> Result<Instance, HostError> {
        let mut instance = self.instantiate()?;
        self.enter(&mut instance)?;
        Ok(instance)
    }

    pub fn enter(&self, instance: &mut Instance) -> Result<(), HostError> {
        // No stop time: comparisons may run past the default experiment.
        instance.setup_experiment(None, self.start, None)?;
        instance.enter_initialization()?;
        self.drive(instance, self.start)
    }

    /// An instance ready to step.
    pub fn ready(&self) -> Result<Instance, HostError> {
        let mut instance = self.initializing()?;
        instance.exit_initialization()?;
        Ok(instance)
    }

    pub fn time(&self, k: usize) -> f64 {
        self.start + k as f64 * self.step
    }

    pub fn steps(&self) -> usize {
        if self.learned.steps == 0 { STEPS } else { self.learned.steps.min(STEPS) }
    }

    /// Stops a rule that would take too long on a slow FMU.
    pub fn affordable(&self, steps: usize) -> Result<(), Stop> {
        let seconds = self.learned.cost * steps as f64;
        if seconds > 3.0 { not_tested(format!("{steps} steps would take {seconds:.0} s")) } else { Ok(()) }
    }

    pub fn inputs(&self) -> impl Iterator<Item = &Variable> {
        self.d.variables.iter().filter(|v| v.causality == Causality::Input)
    }

    /// Value of a Real input at a time: a sine around the start value, within min and max.
    pub fn input(&self, v: &Variable, order: usize, time: f64) -> f64 {
        let start = match v.start {
            Some(Value::Real(x)) if x.is_finite() => x,
            _ => 0.0,
        };
        let r = self.d.resolved(v);
        let scale = r.nominal.filter(|n| n.is_finite() && *n > 0.0).unwrap_or(1.0).max(start.abs());
        let (low, high) = (r.min.unwrap_or(f64::NEG_INFINITY), r.max.unwrap_or(f64::INFINITY));
        let room = (high - low).min(scale);
        let phase = 0.7 + 1.3 * order as f64;
        let turns = (time - self.start) / (STEPS as f64 * self.step);
        let value = start + 0.1 * room * (std::f64::consts::TAU * 1.7 * turns + phase).sin();
        super::clamped(v, value.clamp(low.min(high), high))
    }

    /// Sets the inputs for a time.
    pub fn drive(&self, instance: &mut Instance, time: f64) -> Result<(), HostError> {
        if !self.learned.stimulus {
            return Ok(());
        }
        let (mut references, mut values) = (Vec::new(), Vec::new());
        for (order, v) in self.inputs().enumerate() {
            match v.base() {
                BaseType::Real => {
                    references.push(v.value_reference);
                    values.push(self.input(v, order, time));
                }
                BaseType::Boolean => {
                    let turns = (time - self.start) / (5.0 * self.step);
                    instance
                        .set_boolean(&[v.value_reference], &[(turns + order as f64 * 0.3).rem_euclid(2.0) >= 1.0])?;
                }
                _ => {}
            }
        }
        if references.is_empty() { Ok(()) } else { instance.set_real(&references, &values) }
    }

    pub fn observe(&self, instance: &mut Instance) -> Result<Snapshot, HostError> {
        let references = |index: usize| -> Vec<u32> { self.observed[index].iter().map(|o| o.reference).collect() };
        let [reals, integers, booleans, strings] = [0, 1, 2, 3].map(references);
        Ok(Snapshot {
            reals: if reals.is_empty() { vec![] } else { instance.get_real(&reals)? },
            integers: if integers.is_empty() { vec![] } else { instance.get_integer(&integers)? },
            booleans: if booleans.is_empty() { vec![] } else { instance.get_boolean_raw(&booleans)? },
            strings: if strings.is_empty() { vec![] } else { instance.get_string(&strings)? },
        })
    }

    /// Drives, steps and observes from step `from` to step `to`; the snapshot after each step.
    pub fn run(&self, instance: &mut Instance, from: usize, to: usize) -> Result<Vec<Snapshot>, HostError> {
        (from..to)
            .map(|k| {
                self.drive(instance, self.time(k))?;
                instance.do_step(self.time(k), self.step)?;
                self.observe(instance)
            })
            .collect()
    }

    /// The first difference between two snapshots, bit for bit (NaN equals NaN), as a sentence.
    pub fn difference(&self, a: &Snapshot, b: &Snapshot) -> Option<String> {
        let same = |x: f64, y: f64| x == y || x.is_nan() && y.is_nan();
        let describe = |name: &str, a: String, b: String| Some(format!("\"{name}\" is {a} instead of {b}"));
        for ((o, &x), &y) in self.observed[0].iter().zip(&a.reals).zip(&b.reals) {
            if !same(x, y) {
                return describe(&o.name, y.to_string(), x.to_string());
            }
        }
        for ((o, x), y) in self.observed[1].iter().zip(&a.integers).zip(&b.integers) {
            if x != y {
                return describe(&o.name, y.to_string(), x.to_string());
            }
        }
        for ((o, x), y) in self.observed[2].iter().zip(&a.booleans).zip(&b.booleans) {
            if x != y {
                return describe(&o.name, y.to_string(), x.to_string());
            }
        }
        for ((o, x), y) in self.observed[3].iter().zip(&a.strings).zip(&b.strings) {
            if x != y {
                return describe(&o.name, format!("{y:?}"), format!("{x:?}"));
            }
        }
        None
    }

    /// The first difference between two records, with its time.
    pub fn difference_of_runs(&self, a: &[Snapshot], b: &[Snapshot], from: usize) -> Option<String> {
        a.iter().zip(b).enumerate().find_map(|(k, (x, y))| {
            self.difference(x, y).map(|what| format!("{what} at t = {}", self.time(from + k + 1)))
        })
    }

    /// How closely two runs of the same model agree whose solver may choose its steps anew: the default experiment's
    /// tolerance (FMI 2.0.4, section 2.2.5), relative; a usual one where the FMU declares none.
    pub fn tolerance(&self) -> f64 {
        let declared = self.d.default_experiment.and_then(|e| e.tolerance).filter(|t| *t > 0.0);
        declared.map_or(1e-6, |t| t.clamp(1e-12, 1e-3))
    }

    /// As [`Probe::difference_of_runs`], leaving out what a solver's tolerance explains. It bounds the
    /// local error of a step; over a run some tens of it add up.
    pub fn difference_beyond_tolerance(&self, a: &[Snapshot], b: &[Snapshot], from: usize) -> Option<String> {
        const OVER_A_RUN: f64 = 30.0;
        self.difference_of_runs(a, b, from)?;
        let allowed = OVER_A_RUN * self.tolerance();
        let range = |i: usize| {
            let values = || a.iter().map(|s| s.reals[i]).filter(|v| v.is_finite());
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let ranges: Vec<f64> = (0..self.observed[0].len()).map(range).collect();
        let close = |(x, y): (f64, f64), range: f64| {
            x == y || x.is_nan() && y.is_nan() || (x - y).abs() <= allowed * x.abs().max(y.abs()).max(range)
        };
        let mut rounded = false;
        let mut jumps = 0;
        for (k, (x, y)) in a.iter().zip(b).enumerate() {
            let pairs = || x.reals.iter().copied().zip(y.reals.iter().copied());
            rounded |= pairs().any(|(x, y)| x != y);
            if let Some(i) = pairs().zip(&ranges).position(|(pair, range)| !close(pair, *range)) {
                let (name, time) = (&self.observed[0][i].name, self.time(from + k + 1));
                return Some(format!("\"{name}\" is {} instead of {} at t = {time}", y.reals[i], x.reals[i]));
            }
            let discrete = |s: &Snapshot| Snapshot { reals: x.reals.clone(), ..s.clone() };
            if let Some(what) = self.difference(&discrete(x), &discrete(y)) {
                // An event may fall on the other side of a communication point, but not for long.
                jumps += 1;
                if !rounded || jumps > 2 {
                    return Some(format!("{what} at t = {}", self.time(from + k + 1)));
                }
            }
        }
        None
    }

    /// Whether an output or local variable, except `without`, responds to what is different in the second run: differs by more than rounding.
    pub fn responds(&self, a: &[Snapshot], b: &[Snapshot], without: &[u32]) -> bool {
        a.iter().zip(b).any(|(x, y)| {
            let real = |((o, x), y): ((&Observed, &f64), &f64)| {
                o.calculated && !without.contains(&o.reference) && (x - y).abs() > 1e-12 * x.abs().max(y.abs())
            };
            let whole = |((o, x), y): ((&Observed, &i64), &i64)| o.calculated && x != y;
            let flag = |((o, x), y): ((&Observed, &i32), &i32)| o.calculated && x != y;
            self.observed[0].iter().zip(&x.reals).zip(&y.reals).any(real)
                || self.observed[1].iter().zip(&x.integers).zip(&y.integers).any(whole)
                || self.observed[2].iter().zip(&x.booleans).zip(&y.booleans).any(flag)
        })
    }

    /// Steps to the end of the default experiment, as many as fit into a fifth of a second.
    pub fn long(&self) -> usize {
        let whole = self.stop.map_or(100.0, |stop| (stop - self.start) / self.step * (1.0 + 1e-9));
        let affordable = 0.2 / self.learned.cost.max(1e-7);
        (whole.min(affordable).min(2000.0) as usize).max(self.steps())
    }

    /// Every type and value reference that differs between two records.
    pub fn differing(&self, a: &[Snapshot], b: &[Snapshot]) -> Vec<(u8, u32)> {
        let mut found = HashSet::new();
        for (x, y) in a.iter().zip(b) {
            let mut note = |index: usize, differs: &mut dyn FnMut(usize) -> bool| {
                for (at, o) in self.observed[index].iter().enumerate() {
                    if differs(at) {
                        found.insert((index as u8, o.reference));
                    }
                }
            };
            note(0, &mut |i| x.reals[i].to_bits() != y.reals[i].to_bits() && x.reals[i] != y.reals[i]);
            note(1, &mut |i| x.integers[i] != y.integers[i]);
            note(2, &mut |i| x.booleans[i] != y.booleans[i]);
            note(3, &mut |i| x.strings[i] != y.strings[i]);
        }
        let mut found: Vec<_> = found.into_iter().collect();
        found.sort_unstable();
        found
    }

    /// A value reference that no variable of a type uses, or none when all are taken.
    pub fn unused_reference(&self, base: BaseType) -> u32 {
        let used: HashSet<u32> = self
            .d
            .variables
            .iter()
            .filter(|v| self.d.fmi == Fmi::Three || type_index(v.base()) == type_index(base))
            .map(|v| v.value_reference)
            .collect();
        [4_242_424_242, 987_654_321, u32::MAX]
            .into_iter()
            .find(|r| !used.contains(r))
            .unwrap_or_else(|| (0..=u32::MAX).rev().find(|r| !used.contains(r)).unwrap_or(0))
    }
}

/// Whether the environment may set a variable before initialisation.
pub(super) fn settable(v: &Variable) -> bool {
    v.variability != Variability::Constant
        && v.causality != Causality::StructuralParameter
        && (v.causality == Causality::Input || matches!(v.initial(), Some(Initial::Exact | Initial::Approx)))
}
