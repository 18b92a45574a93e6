//! The harness: any co-simulation FMU of FMI 2.0 or 3.0 driven by sampled inputs, its outputs recorded.
//!
//! Row `k` of the record is the communication point `start + k*step`, after the inputs of that instant have been set:
//! input and acceleration of a row then belong together. ([`Rows::StepEnd`] records before, as other importers do.)

mod error;
mod inputs;
mod result;
mod values;

use super::description::{BaseType, Causality, Description, Fmi};
use super::host::{Fmu, HostError, Instance, InstanceOptions, Layout, Status, needs_event_mode};
use crate::trace::Hold;

pub use error::SimulateError;
pub use inputs::Inputs;
pub use result::{Column, SimulationResult};
use values::{Ports, Which, apply};
pub use values::{Setting, parse_setting};

/// Most rows that a run records.
const MAX_ROWS: f64 = 1e9;

/// What a row of the record holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Rows {
    /// The outputs after the inputs of that instant have been set.
    #[default]
    InputsSet,
    /// The outputs as the step before left them, as most importers record them.
    StepEnd,
}

/// How an FMU is run.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Options {
    /// Start, s; by default the first sample of the input, else the default experiment's.
    pub start: Option<f64>,
    /// End, s; by default the last sample of the input, else the default experiment's.
    pub stop: Option<f64>,
    /// Communication step, s; by default the input's sampling interval, else the default experiment's step.
    pub step: Option<f64>,
    /// What the inputs do between samples.
    #[serde(with = "hold")]
    pub hold: Hold,
    /// Values set before initialisation.
    pub settings: Vec<Setting>,
    /// Outputs to record; all where empty.
    pub outputs: Vec<String>,
    /// What a row holds.
    pub rows: Rows,
    /// FMI 3.0: handle events in event mode; always with an FMU that has clocks.
    pub event_mode: bool,
    /// FMI 3.0: let steps return early, and go on from there to the communication point.
    pub early_return: bool,
}

/// How [`Hold`], which knows of no files, is written down.
mod hold {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::Hold;

    pub fn serialize<S: Serializer>(hold: &Hold, to: S) -> Result<S::Ok, S::Error> {
        (*hold == Hold::Linear).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Hold, D::Error> {
        bool::deserialize(from).map(|linear| if linear { Hold::Linear } else { Hold::Zoh })
    }
}

/// Communication points of a run.
struct Experiment {
    start: f64,
    step: f64,
    count: usize,
}

impl Experiment {
    fn new(description: &Description, inputs: &Inputs, options: &Options) -> Result<Self, SimulateError> {
        let default = description.default_experiment.unwrap_or_default();
        let start = options.start.or(inputs.time.first().copied()).or(default.start_time).unwrap_or(0.0);
        let stop = options.stop.or(inputs.time.last().copied()).or(default.stop_time).ok_or(SimulateError::NoStop)?;
        // An FMU of FMI 3.0 may declare its internal step.
        let own = || default.step_size.or(description.co_simulation.as_ref().and_then(|i| i.fixed_step));
        let step = options.step.or(inputs.dt).or_else(|| own().filter(|_| inputs.time.is_empty()));
        let step = step.ok_or(SimulateError::NoStep)?;
        let fail = |why| Err(SimulateError::Experiment { start, stop, step, why });
        if !(start.is_finite() && stop.is_finite() && step.is_finite()) {
            return fail("times must be finite numbers");
        }
        if step <= 0.0 || stop <= start {
            return fail("the step must be greater than zero, and the end after the start");
        }
        let steps = (stop - start) / step;
        if steps > MAX_ROWS {
            return fail("that is more rows than a record can hold: give a longer --step or an earlier --stop");
        }
        // The end is end_time up to rounding; a last part of a step is left out.
        Ok(Self { start, step, count: (steps * (1.0 + 1e-12) + 1e-6).floor() as usize })
    }

    fn time(&self, k: usize) -> f64 {
        self.start + k as f64 * self.step
    }
}

/// Checks what can be checked before an FMU runs: the communication points and the names of inputs and outputs.
///
/// # Errors
/// See [`SimulateError`].
pub(crate) fn check(description: &Description, inputs: &Inputs, options: &Options) -> Result<(), SimulateError> {
    Experiment::new(description, inputs, options)?;
    let interface = description.co_simulation.as_ref();
    let offers = |flag: bool| description.fmi == Fmi::Three && flag;
    if options.event_mode && !offers(interface.is_some_and(|i| i.has_event_mode)) {
        return Err(SimulateError::NotOffered {
            option: "event mode",
            why: "the FMU has none (hasEventMode, FMI 3.0)",
        });
    }
    if options.early_return && !offers(true) {
        return Err(SimulateError::NotOffered { option: "early return", why: "only FMUs of FMI 3.0 have it" });
    }
    Ports::find(description, inputs, &options.outputs).map(|_| ())
}

/// Runs an FMU from start to end, in this process: see [`super::contained::simulate`] for one whose maker you do not know.
///
/// # Errors
/// See [`SimulateError`].
pub fn simulate(fmu: &Fmu, inputs: &Inputs, options: &Options) -> Result<SimulationResult, SimulateError> {
    let experiment = Experiment::new(&fmu.description, inputs, options)?;
    let ports = Ports::find(&fmu.description, inputs, &options.outputs)?;
    let instance_options = InstanceOptions {
        name: fmu.description.model_name.clone(),
        guid: fmu.description.guid.clone(),
        resources: fmu.resources(),
        layout: Layout::of(&fmu.description),
        event_mode: options.event_mode || needs_event_mode(&fmu.description),
        early_return: options.early_return,
        ..InstanceOptions::default()
    };
    let mut instance = fmu.instantiate_with(&instance_options)?;
    let mut now = experiment.start;
    let done = run(fmu, &mut instance, &experiment, &ports, inputs, options, &mut now);
    done.map_err(|error| {
        let log = instance.take_log();
        let skip = log.len().saturating_sub(3);
        let messages = log.into_iter().skip(skip).map(|m| m.message).collect();
        match error {
            SimulateError::Host(error) => SimulateError::Stopped { time: now, what: error.to_string(), log: messages },
            other => other,
        }
    })
}

/// The run itself; `now` is left at the communication point end_time.
fn run(
    fmu: &Fmu,
    instance: &mut Instance,
    experiment: &Experiment,
    ports: &Ports,
    inputs: &Inputs,
    options: &Options,
    now: &mut f64,
) -> Result<SimulationResult, SimulateError> {
    for setting in &options.settings {
        apply(instance, &fmu.description, setting)?;
    }
    let (start, step, hold) = (experiment.start, experiment.step, options.hold);
    let event_mode = options.event_mode || needs_event_mode(&fmu.description);
    let interpolates = fmu.interface().can_interpolate_inputs && hold == Hold::Linear;
    instance.setup_experiment(None, start, Some(experiment.time(experiment.count)))?;
    instance.enter_initialization()?;
    ports.set(instance, inputs, start, step, hold, Which::All)?;
    instance.exit_initialization()?;
    let mut record = ports.record(fmu, inputs, experiment.count + 1);
    record.step = step;
    record.notes.clone_from(&inputs.notes);
    let mut discrete = ports.discrete(inputs, start, step, hold);
    for k in 0..=experiment.count {
        let time = experiment.time(k);
        *now = time;
        if options.rows == Rows::StepEnd {
            ports.read(instance, &mut record)?;
        }
        if event_mode {
            let now = ports.discrete(inputs, time, step, hold);
            if now != discrete {
                instance.handle_events(|i| ports.set(i, inputs, time, step, hold, Which::All))?;
                discrete = now;
            }
        }
        let which = match () {
            () if event_mode => Which::Continuous,
            () if interpolates && k < experiment.count => Which::Sloped,
            () => Which::All,
        };
        ports.set(instance, inputs, time, step, hold, which)?;
        if options.rows == Rows::InputsSet {
            ports.read(instance, &mut record)?;
        }
        record.time.push(time);
        ports.note_inputs(inputs, time, step, hold, &mut record);
        if k == experiment.count {
            break;
        }
        let status = match fmu.description.fmi {
            Fmi::Two => instance.do_step_status(time, step, true)?,
            Fmi::Three => step3(instance, time, step, event_mode)?,
        };
        match status {
            status if status.is_ok() => {}
            Status::Discard if instance.terminated().unwrap_or(false) => {
                record.notes.push(format!("the FMU ended the simulation of itself after {time} s"));
                return Ok(record);
            }
            status => {
                let function = if fmu.description.fmi == Fmi::Three { "fmi3DoStep" } else { "fmi2DoStep" };
                return Err(HostError::Status { function, status }.into());
            }
        }
    }
    // What has been recorded is kept, whatever status the FMU returns at the end.
    if let Err(error) = instance.terminate() {
        record.notes.push(format!("after the last step {error}"));
    }
    Ok(record)
}

/// Most parts of a step that returns early, before it is taken for one that makes no progress.
const MOST_PARTS: usize = 100_000;

/// A step of FMI 3.0 to the next communication point: events are handled where event mode is used, and a step that
/// returned early is gone on with (section 4.2.1).
fn step3(instance: &mut Instance, time: f64, step: f64, event_mode: bool) -> Result<Status, HostError> {
    let (mut from, end) = (time, time + step);
    for _ in 0..MOST_PARTS {
        let status = instance.do_step_status(from, if from == time { step } else { end - from }, true)?;
        if !status.is_ok() {
            return Ok(status);
        }
        let result = instance.step_result();
        if result.event && event_mode {
            instance.handle_events(|_| Ok(()))?;
            if instance.step_result().terminate {
                return Ok(Status::Discard);
            }
        }
        // What is left below rounding is nothing.
        if !result.early || result.time.is_nan() || result.time >= end - 1e-9 * step {
            return Ok(status);
        }
        from = result.time;
    }
    Err(HostError::Events(MOST_PARTS))
}

/// Whether a variable's values can be recorded as numbers.
fn numeric(base: BaseType) -> bool {
    base != BaseType::String
}

/// Whether a variable is recorded when no outputs are named.
fn is_output(causality: Causality) -> bool {
    causality == Causality::Output
}
