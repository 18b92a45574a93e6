//! The harness: any co-simulation FMU of FMI 2.0 or 3.0 driven by sampled inputs, its outputs recorded.
//!
//! Row `k` of the record is the communication point `start + k*step`, after the inputs of that instant have been set:
//! input and acceleration of a row then belong together. ([`Rows::StepEnd`] records before, as other importers do.)

mod inputs;
mod values;

use super::description::{BaseType, Causality, Description, Fmi};
use super::host::{Fmu, HostError, Instance, InstanceOptions, Layout, Status, needs_event_mode};
use crate::trace::{Hold, Motion, Signal, Trace, TraceError, number};

pub use inputs::Inputs;
use values::{Ports, Which, apply};
pub use values::{Setting, parse_setting};

/// Most rows that a run records.
const MAX_ROWS: f64 = 1e9;

/// Why a run could not be made, or ended early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// The FMU cannot be used.
    #[error(transparent)]
    Host(#[from] HostError),
    /// The input file cannot be used.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The input file has no time.
    #[error("{file}: no column named time; the columns are: {present}")]
    NoTime {
        /// The file.
        file: String,
        /// Its columns.
        present: String,
    },
    /// No column of the input file is an input of the FMU.
    #[error("{file}: no column is an input of the FMU; the columns are: {present}; the inputs are: {wanted}{near}")]
    NoInput {
        /// The file.
        file: String,
        /// Its columns.
        present: String,
        /// The FMU's inputs.
        wanted: String,
        /// A near miss.
        near: String,
    },
    /// A part of the inputs that is none.
    #[error(
        "{left:.0} samples of the input lie from {from} s to {to} s at the steps asked for; give other --from, --to or --resample"
    )]
    Part {
        /// From when, s.
        from: f64,
        /// Until when, s.
        to: f64,
        /// Samples there.
        left: f64,
    },
    /// No column of the reference results is a variable of the FMU.
    #[error("{file}: no column is a variable of the FMU; the columns are: {present}; the outputs are: {wanted}")]
    NoReference {
        /// The file.
        file: String,
        /// Its columns.
        present: String,
        /// The FMU's outputs.
        wanted: String,
    },
    /// A unit that is not the FMU's.
    #[error("{file}: column {column} is in [{unit}], but the FMU takes it in {wanted}: convert the column")]
    Unit {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// The FMU's unit.
        wanted: String,
    },
    /// No such variable.
    #[error("the FMU has no {what} named {name:?}{near}")]
    Unknown {
        /// What was looked for.
        what: &'static str,
        /// The name given.
        name: String,
        /// A near miss.
        near: String,
    },
    /// A value that its variable cannot take.
    #[error("{name} = {value}: {why}")]
    Value {
        /// The variable.
        name: String,
        /// The value given.
        value: String,
        /// What it must be.
        why: String,
    },
    /// No step size to be found.
    #[error(
        "neither the input nor the FMU's default experiment gives a step: the input's times are not uniform, or there is \
         no input; give --step"
    )]
    NoStep,
    /// No end to be found.
    #[error("neither the input nor the FMU's default experiment gives an end: give --stop")]
    NoStop,
    /// An experiment that cannot be run.
    #[error("from {} s to {} s in steps of {} s: {why}", number(*start), number(*stop), number(*step))]
    Experiment {
        /// Start, s.
        start: f64,
        /// End, s.
        stop: f64,
        /// Step, s.
        step: f64,
        /// What is wrong.
        why: &'static str,
    },
    /// The FMU refused to go on.
    #[error("the FMU stopped at {time} s: {what}{}", log_text(.log))]
    Stopped {
        /// Communication point, s.
        time: f64,
        /// What it printed.
        what: String,
        /// Its last log messages.
        log: Vec<String>,
    },
    /// Event mode or early return with an FMU that has none.
    #[error("{option}: {why}")]
    NotOffered {
        /// What was asked for.
        option: &'static str,
        /// Why it cannot be.
        why: &'static str,
    },
    /// What became of the child process that ran the FMU.
    #[error("{0}")]
    Child(String),
}

fn log_text(log: &[String]) -> String {
    if log.is_empty() { String::new() } else { format!("; its log: {}", log.join("; ")) }
}

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

/// What was recorded: the inputs, then the outputs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SimulationResult {
    /// Communication points, s.
    pub time: Vec<f64>,
    /// Communication step, s.
    pub step: f64,
    /// Each column.
    pub columns: Vec<Column>,
    /// What the user should know, in sentences.
    pub notes: Vec<String>,
}

/// A column of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name of the variable.
    pub name: String,
    /// Its unit, where it has one.
    pub unit: Option<String>,
    /// One value a row.
    pub values: Vec<f64>,
    /// Whether it is an input.
    pub input: bool,
}

impl SimulationResult {
    /// The values of a variable.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// The columns that are signals of the axis, as a trace.
    ///
    /// # Errors
    /// Never, as long as all columns have one length.
    pub fn trace(&self, hold: Hold) -> Result<Trace, TraceError> {
        let start = self.time.first().copied().unwrap_or(0.0);
        let mut trace = Trace::new(start, self.step, hold);
        for column in &self.columns {
            if let Some(signal) = Signal::from_name(&column.name) {
                trace.set(signal, column.values.clone())?;
            }
        }
        Ok(trace)
    }

    /// Whether the columns are those of a linear axis.
    #[must_use]
    pub fn motion(&self) -> Motion {
        let linear = |c: &Column| c.name == "T" && c.unit.as_deref() == Some("N");
        if self.columns.iter().any(linear) { Motion::Linear } else { Motion::Rotary }
    }

    /// Headers and values of all columns with the time, for a CSV file.
    #[must_use]
    pub fn table(&self) -> Vec<(String, &[f64])> {
        let mut table = vec![("time [s]".to_owned(), self.time.as_slice())];
        for c in &self.columns {
            let name = inputs::column_name(&c.name);
            let header = match &c.unit {
                Some(unit) => format!("{name} [{unit}]"),
                None => name,
            };
            table.push((header, &c.values));
        }
        table
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
