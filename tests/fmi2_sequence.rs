//! Random call sequences against a model of the FMI 2.0 state machine (section 4.2.4): every call is accepted or refused
//! as the model says, nothing crashes, and a state gone back to has the outputs it had.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::sync::OnceLock;

use eixo::fmu::description::{BaseType, Causality, Fmi};
use eixo::fmu::host::{Fmu, HostError, Instance, StateHandle};
use eixo::fmu::package::Package;
use eixo::variables::{at, find};
use proptest::prelude::*;

const DT: f64 = 5.626e-4;

const OUTPUTS: [u32; 7] = [1, 2, 3, 4, 5, 6, 7];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Instantiated,
    Initialization,
    Step,
    Terminated,
}

/// The calls of a sequence.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Call {
    Setup,
    Enter,
    Exit,
    Step,
    StepElsewhere,
    Terminate,
    Reset,
    Get,
    SetInput(f64),
    SetTunable(f64),
    SetFixed(f64),
    SetStructure,
    SetOutput,
    SetSlope(f64),
    GetSlopes,
    Directional,
    Save,
    Restore(usize),
    Store(usize),
    Cancel,
    LastTime,
}

fn calls() -> impl Strategy<Value = Vec<Call>> {
    let value = -0.05..0.05_f64;
    let call = prop_oneof![
        3 => Just(Call::Setup),
        3 => Just(Call::Enter),
        3 => Just(Call::Exit),
        8 => Just(Call::Step),
        1 => Just(Call::StepElsewhere),
        1 => Just(Call::Terminate),
        1 => Just(Call::Reset),
        2 => Just(Call::Get),
        3 => value.clone().prop_map(Call::SetInput),
        2 => (0.0..0.02_f64).prop_map(Call::SetTunable),
        2 => value.clone().prop_map(Call::SetFixed),
        1 => Just(Call::SetStructure),
        1 => Just(Call::SetOutput),
        1 => value.prop_map(Call::SetSlope),
        1 => Just(Call::GetSlopes),
        1 => Just(Call::Directional),
        2 => Just(Call::Save),
        2 => (0..4_usize).prop_map(Call::Restore),
        1 => (0..4_usize).prop_map(Call::Store),
        1 => Just(Call::Cancel),
        1 => Just(Call::LastTime),
    ];
    prop::collection::vec(call, 1..60)
}

/// What the standard says of an instance.
#[derive(Debug, Clone, Copy)]
struct Model {
    mode: Mode,
    set_up: bool,
    steps: u32,
}

impl Model {
    const NEW: Self = Self { mode: Mode::Instantiated, set_up: false, steps: 0 };

    fn time(&self) -> f64 {
        f64::from(self.steps) * DT
    }

    /// Whether the call is accepted; moves on.
    fn call(&mut self, call: Call) -> bool {
        use Mode::{Initialization, Instantiated, Step, Terminated};
        let mode = self.mode;
        let settable = matches!(mode, Instantiated | Initialization | Step);
        match call {
            Call::Setup => {
                let fine = mode == Instantiated;
                self.set_up |= fine;
                fine
            }
            Call::Enter => {
                let fine = mode == Instantiated && self.set_up;
                if fine {
                    self.mode = Initialization;
                }
                fine
            }
            Call::Exit => {
                let fine = mode == Initialization;
                if fine {
                    self.mode = Step;
                }
                fine
            }
            Call::Step => {
                let fine = mode == Step;
                self.steps += u32::from(fine);
                fine
            }
            Call::Terminate => {
                let fine = mode == Step;
                if fine {
                    self.mode = Terminated;
                }
                fine
            }
            Call::Reset => {
                *self = Self::NEW;
                true
            }
            Call::Get | Call::Directional => mode != Instantiated,
            Call::SetInput(_) | Call::SetTunable(_) | Call::SetSlope(_) => settable,
            Call::SetFixed(_) | Call::SetStructure => matches!(mode, Instantiated | Initialization),
            Call::GetSlopes | Call::LastTime => matches!(mode, Step | Terminated),
            Call::StepElsewhere | Call::SetOutput | Call::Cancel => false,
            Call::Save | Call::Restore(_) | Call::Store(_) => true,
        }
    }
}

fn open(fmi: Fmi) -> Fmu {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("axis.fmu");
    Package { fmi, ..Package::default() }.write(&file).unwrap();
    Fmu::open(&file).unwrap()
}

fn fmu() -> &'static Fmu {
    static FMU: OnceLock<Fmu> = OnceLock::new();
    FMU.get_or_init(|| open(Fmi::Two))
}

/// The same by the ABI of FMI 3.0.
fn fmu3() -> &'static Fmu {
    static FMU: OnceLock<Fmu> = OnceLock::new();
    FMU.get_or_init(|| open(Fmi::Three))
}

fn reference(name: &str) -> u32 {
    at(find(name).unwrap()).reference
}

/// A saved state, the model then, and the outputs then where they could be read.
type Saved = (StateHandle, Model, Option<Vec<f64>>);

fn perform(i: &mut Instance, call: Call, model: &Model, saved: &mut Vec<Saved>, to: &mut Option<Model>) -> bool {
    match call {
        Call::Setup => i.setup_experiment(None, 0.0, None).is_ok(),
        Call::Enter => i.enter_initialization().is_ok(),
        Call::Exit => i.exit_initialization().is_ok(),
        Call::Step => i.do_step(model.time(), DT).is_ok(),
        Call::StepElsewhere => i.do_step(model.time() + 0.5 * DT, DT).is_ok(),
        Call::Terminate => i.terminate().is_ok(),
        Call::Reset => i.reset().is_ok(),
        Call::Get => i.get_real(&OUTPUTS).is_ok_and(|y| y.iter().all(|v| v.is_finite())),
        Call::SetInput(value) => i.set_real(&[0], &[value]).is_ok(),
        Call::SetTunable(value) => i.set_real(&[reference("coulomb_motor.level")], &[value]).is_ok(),
        Call::SetFixed(value) => i.set_real(&[reference("theta1_0")], &[value]).is_ok(),
        Call::SetStructure => i.set_integer(&[reference("structure")], &[1]).is_ok(),
        Call::SetOutput => i.set_real(&[1], &[0.0]).is_ok(),
        Call::SetSlope(value) => i.set_input_derivatives(&[0], &[1], &[value]).is_ok(),
        Call::GetSlopes => i.get_output_derivatives(&OUTPUTS, &[1; 7]).is_ok(),
        Call::Directional => i.directional_derivative(&OUTPUTS, &[0], &[1.0]).is_ok(),
        Call::Save => {
            let outputs = i.get_real(&OUTPUTS).ok();
            i.get_state().map(|state| saved.push((state, *model, outputs))).is_ok()
        }
        Call::Restore(which) => {
            let Some((state, then, outputs)) = saved.get(which) else { return true };
            let done = i.set_state(state).is_ok();
            *to = Some(*then);
            done && i.get_real(&OUTPUTS).ok() == *outputs
        }
        Call::Store(which) => {
            let Some((state, then, outputs)) = saved.get(which) else { return true };
            let bytes = i.serialize_state(state).unwrap();
            let copy = i.deserialize_state(&bytes).unwrap();
            let done = i.set_state(&copy).is_ok() && i.free_state(copy).is_ok();
            *to = Some(*then);
            done && i.get_real(&OUTPUTS).ok() == *outputs
        }
        Call::Cancel => i.cancel_step().is_ok(),
        Call::LastTime => i.last_successful_time().is_ok_and(|t| (t - model.time()).abs() < 1e-9),
    }
}

/// Values as no axis has them, but as an importer may set them.
fn extreme() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(1e308),
        Just(-1e308),
        Just(f64::MAX),
        Just(1e-308),
        Just(0.0),
        Just(1e-6),
        Just(1e150),
        -1e3..1e3_f64,
        (-300.0..300.0_f64).prop_map(|e| 10_f64.powf(e)),
    ]
}

/// Sequences: EIXO_FUZZ_RUNS makes it as many as that.
fn many() -> u32 {
    std::env::var("EIXO_FUZZ_RUNS").ok().and_then(|n| n.parse().ok()).unwrap_or(1500)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: many(), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_value_that_is_not_finite_comes_with_ok(
        sets in prop::collection::vec((any::<prop::sample::Index>(), extreme()), 0..6),
        inputs in prop::collection::vec((extreme(), extreme()), 1..8),
        step in prop_oneof![Just(DT), Just(1e-9), Just(1.0), 1e-6..1e-2_f64],
        three in any::<bool>(),
    ) {
        // By either ABI; the variables have the same value references.
        let mut i = if three { fmu3() } else { fmu() }.instantiate("axis").unwrap();
        let settable: Vec<u32> = fmu()
            .description
            .variables
            .iter()
            .filter(|v| v.causality == Causality::Parameter && v.base() == BaseType::Real)
            .map(|v| v.value_reference)
            .collect();
        for (index, value) in sets {
            let _ = i.set_real(&[*index.get(&settable)], &[value]);
        }
        let finite = |values: Result<Vec<f64>, HostError>| values.is_err() || values.is_ok_and(|v| v.iter().all(|x| x.is_finite()));
        let all = |i: &mut Instance| {
            // One by one: one value that is refused hides no other.
            let values = (0..8).all(|r| finite(i.get_real(&[r])));
            let slopes = OUTPUTS.iter().all(|&r| finite(i.get_output_derivatives(&[r], &[1])));
            let partial = OUTPUTS.iter().all(|&r| finite(i.directional_derivative(&[r], &[0], &[1.0])));
            values && slopes && partial
        };
        let _ = i.setup_experiment(None, 0.0, None);
        let _ = i.enter_initialization();
        prop_assert!(all(&mut i), "in initialisation mode");
        if i.exit_initialization().is_ok() {
            let mut time = 0.0;
            for (torque, slope) in inputs {
                let _ = i.set_real(&[0], &[torque]);
                let _ = i.set_input_derivatives(&[0], &[1], &[slope]);
                if i.do_step(time, step).is_err() {
                    break;
                }
                time += step;
                prop_assert!(all(&mut i), "at {time}");
            }
        }
        prop_assert!(all(&mut i), "at the end");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_call_is_accepted_or_refused_as_the_state_machine_says(calls in calls()) {
        let mut instance = fmu().instantiate("axis").unwrap();
        let mut model = Model::NEW;
        let mut saved = Vec::new();
        for (k, &call) in calls.iter().enumerate() {
            let before = model;
            let expected = model.call(call);
            let mut to = None;
            let accepted = perform(&mut instance, call, &before, &mut saved, &mut to);
            prop_assert_eq!(accepted, expected, "call {} of {:?}, {:?}", k, &calls, before);
            if let Some(then) = to {
                model = then;
            }
        }
    }
}
