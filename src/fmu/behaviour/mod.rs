//! Behavioural rules: each loads the FMU in a process of its own (see [`super::isolation`]) and looks what it does.

mod dependencies;
mod effects;
mod experiment;
mod instances;
mod interpolation;
mod leaks;
mod lifecycle;
mod measure;
mod partial;
pub(crate) mod probe;
mod references;
mod state;
mod steps;
mod surroundings;
mod three;
mod values;

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
#[derive(Clone, Copy)]
pub(crate) enum Behaviour {
    /// Before the binary is loaded.
    Raw(fn(&Setup) -> Tested),
    /// On the loaded binary.
    Loaded(fn(&Probe) -> Tested),
    /// On the loaded binary, learning what later rules need.
    Learning(fn(&mut Probe) -> Tested),
}

/// Runs a rule; what was learnt comes with the result.
pub(crate) fn run(behaviour: Behaviour, setup: &Setup) -> (Tested, Learned) {
    let tested = match behaviour {
        Behaviour::Raw(test) => test(setup),
        Behaviour::Loaded(_) | Behaviour::Learning(_) => match setup.probe() {
            Err(error) => Err(error.into()),
            Ok(mut probe) => {
                let tested = match behaviour {
                    Behaviour::Loaded(test) => test(&probe),
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

/// Rules that need calls whose success is another rule's: where one fails, they are not tested.
const INDIRECT: [&str; 10] = [
    "set-get-rounded",
    "tunable-effect",
    "input-derivatives-effect",
    "output-delay",
    "state-leak",
    "dependencies-soon",
    "dependencies-initial",
    "dependencies-constant",
    "dependencies-time",
    "early-return",
];

/// Whether a call that fails is another rule's finding.
pub(crate) fn is_indirect(id: &str) -> bool {
    INDIRECT.contains(&id)
}

/// The function of a behavioural rule.
pub(crate) fn behaviour(id: &str) -> Option<Behaviour> {
    use Behaviour::{Learning, Loaded, Raw};
    Some(match id {
        "binary-load" => Raw(lifecycle::load),
        "binary-symbols" => Loaded(lifecycle::symbols),
        "binary-all-symbols" => Loaded(lifecycle::all_symbols),
        "types-platform" => Loaded(lifecycle::types_platform),
        "version" => Loaded(lifecycle::version),
        "instantiate" => Loaded(lifecycle::instantiate),
        "initialise" => Loaded(lifecycle::initialise),
        "step-status" => Loaded(lifecycle::step_status),
        "variable-readable" => Loaded(values::readable),
        "simulate" => Learning(experiment::simulate),
        "determinism" => Learning(lifecycle::determinism),
        "terminate" => Loaded(lifecycle::terminate),
        "free-null" => Loaded(lifecycle::free_null),
        "unload" => Raw(lifecycle::unload),
        "guid-check" => Loaded(lifecycle::guid),
        "resources-missing" => Loaded(lifecycle::resources),
        "start-values" => Loaded(values::start_values),
        "start-settable" => Loaded(values::start_settable),
        "set-get" => Loaded(values::set_get),
        "get-consistent" => Loaded(values::get_consistent),
        "boolean-values" => Loaded(values::boolean_values),
        "string-values" => Loaded(references::string_values),
        "unchanging" => Loaded(values::unchanging),
        "output-finite" => Loaded(values::finite),
        "output-range" => Loaded(values::range),
        "tunable-set" => Loaded(values::tunable_set),
        "fixed-set" => Loaded(values::fixed_set),
        "bad-reference-get" => Loaded(references::bad_reference_get),
        "bad-reference-set" => Loaded(references::bad_reference_set),
        "empty-call" => Loaded(references::empty),
        "reset" => Loaded(lifecycle::reset),
        "state-restore" => Loaded(state::restore),
        "state-handles" => Loaded(state::handles),
        "state-serialise" => Loaded(state::serialise),
        "step-size" => Loaded(steps::ignored),
        "step-convergence" => Loaded(steps::convergence),
        "step-variable" => Loaded(steps::variable),
        "step-negative" => Loaded(steps::negative),
        "step-zero" => Loaded(steps::zero),
        "step-wrong-point" => Loaded(steps::wrong_point),
        "step-early" => Loaded(steps::early),
        "step-late" => Loaded(steps::late),
        "initialisation-order" => Loaded(steps::initialisation_order),
        "nan-input" => Loaded(steps::nan_input),
        "status-functions" => Loaded(steps::status_functions),
        "time-variable" => Loaded(steps::time),
        "derivative-value" => Loaded(steps::derivative),
        "input-derivatives" => Loaded(interpolation::input_derivatives),
        "output-derivatives" => Loaded(interpolation::output_derivatives),
        "directional-derivative" => Loaded(partial::directional),
        "dependencies-hold" => Loaded(dependencies::outputs),
        "instances-independent" => Loaded(instances::independent),
        "instances-threads" => Loaded(instances::threads),
        "thread-handover" => Loaded(instances::handover),
        "instance-leak" => Loaded(leaks::instance_leak),
        "instance-leak-large" => Loaded(leaks::instance_leak_large),
        "null-component" => Loaded(lifecycle::null_component),
        "step-leak" => Loaded(leaks::step_leak),
        "callbacks-copied" => Loaded(effects::callbacks),
        "allocation-failure" => Loaded(effects::allocation),
        "debug-logging" => Loaded(effects::debug_logging),
        "log-categories" => Loaded(effects::log_categories),
        "instances-repeated" => Learning(instances::repeated),
        "instances-sequential" => Loaded(instances::sequential),
        "start-time" => Loaded(experiment::start_time),
        "stop-time" => Loaded(experiment::stop_time),
        "inputs-initial" => Loaded(experiment::inputs_initial),
        "terminated" => Loaded(experiment::terminated),
        "set-get-rounded" => Loaded(values::set_get_rounded),
        "tunable-effect" => Loaded(values::tunable_effect),
        "reference-bits" => Loaded(references::bits),
        "string-buffers" => Loaded(references::string_buffers),
        "state-leak" => Loaded(leaks::state_leak),
        "output-delay" => Loaded(steps::delay),
        "input-derivatives-effect" => Loaded(interpolation::effect),
        "dependencies-soon" => Loaded(dependencies::outputs_soon),
        "dependencies-initial" => Loaded(dependencies::initial),
        "dependencies-constant" => Loaded(dependencies::kinds),
        "dependencies-time" => Loaded(dependencies::time),
        "resources-path" => Raw(surroundings::resources),
        "locale-numbers" => Raw(surroundings::locale),
        "side-directory" => Raw(effects::directory),
        "side-rounding" => Raw(effects::rounding),
        "side-stdout" => Raw(effects::stdout),
        "side-signals" => Raw(effects::signals),
        "side-environment" => Raw(effects::environment),
        "side-locale" => Raw(effects::locale),
        "side-files" => Raw(effects::files),
        "step-report" => Loaded(three::report),
        "early-return" => Loaded(three::early_return),
        "event-mode" => Loaded(three::event_mode),
        "configuration-mode" => Loaded(three::configuration_mode),
        "array-count" => Loaded(three::array_count),
        _ => return None,
    })
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
fn held(v: &Variable, x: f64) -> f64 {
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
        .map(|x| held(v, x))
        .find(|x| x.is_finite() && (low..=high).contains(x) && *x != start)
}
