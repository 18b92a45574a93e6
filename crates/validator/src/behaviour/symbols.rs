//! The functions that a binary exports (FMI 2.0.4, section 2.1; FMI 3.0, section 2.2.1).

use super::super::description::Fmi;
use super::super::host::abi::{CALLS, Call};
use super::probe::{Probe, Tested};

/// Functions that a host needs, whatever the capability flags declare.
const CORE: [Call; 19] = [
    Call::get_types_platform,
    Call::get_version,
    Call::set_debug_logging,
    Call::instantiate,
    Call::free_instance,
    Call::setup_experiment,
    Call::enter_initialization,
    Call::exit_initialization,
    Call::terminate,
    Call::reset,
    Call::get_real,
    Call::get_integer,
    Call::get_boolean,
    Call::get_string,
    Call::set_real,
    Call::set_integer,
    Call::set_boolean,
    Call::set_string,
    Call::do_step,
];

/// The same of FMI 3.0.
const CORE3: [Call; 21] = [
    Call::get_version3,
    Call::set_debug_logging3,
    Call::instantiate3,
    Call::free_instance3,
    Call::enter_initialization3,
    Call::exit_initialization3,
    Call::terminate3,
    Call::reset3,
    Call::get3_float32,
    Call::get3_float64,
    Call::get3_int32,
    Call::get3_int64,
    Call::get3_boolean,
    Call::get3_string,
    Call::set3_float32,
    Call::set3_float64,
    Call::set3_int32,
    Call::set3_int64,
    Call::set3_boolean,
    Call::set3_string,
    Call::do_step3,
];

/// Whether a function is of a version of FMI.
fn is_of(function: &str, fmi: Fmi) -> bool {
    function.starts_with(if fmi == Fmi::Three { "fmi3" } else { "fmi2" })
}

fn needed(p: &Probe) -> Vec<&'static str> {
    let i = p.interface();
    if p.d.fmi == Fmi::Three {
        let mut calls = CORE3.to_vec();
        for (flag, more) in [
            (i.can_get_and_set_state, &[Call::get_state3, Call::set_state3, Call::free_state3][..]),
            (i.can_serialize_state, &[Call::serialized_size3, Call::serialize3, Call::deserialize3]),
            (i.provides_directional_derivative, &[Call::directional_derivative3]),
            (i.max_output_derivative_order > 0, &[Call::get_output_derivatives3]),
            (i.has_event_mode, &[Call::enter_event_mode, Call::enter_step_mode, Call::update_discrete_states]),
        ] {
            if flag {
                calls.extend_from_slice(more);
            }
        }
        return calls.into_iter().map(|c| CALLS[c as usize]).collect();
    }
    let mut calls = CORE.to_vec();
    let mut add = |flag: bool, more: &[Call]| {
        if flag {
            calls.extend_from_slice(more);
        }
    };
    add(i.can_get_and_set_state, &[Call::get_state, Call::set_state, Call::free_state]);
    add(i.can_serialize_state, &[Call::serialized_size, Call::serialize, Call::deserialize]);
    add(i.provides_directional_derivative, &[Call::directional_derivative]);
    add(i.can_interpolate_inputs, &[Call::set_input_derivatives]);
    add(i.max_output_derivative_order > 0, &[Call::get_output_derivatives]);
    add(
        i.can_run_asynchronuously,
        &[Call::cancel_step, Call::get_status, Call::get_real_status, Call::get_boolean_status],
    );
    calls.into_iter().map(|c| CALLS[c as usize]).collect()
}

/// Functions of FMI 3.0 for other interfaces, which importers look up all the same (FMPy 0.3.32 does).
const OTHERS3: [&str; 13] = [
    "fmi3InstantiateModelExchange",
    "fmi3InstantiateScheduledExecution",
    "fmi3EnterContinuousTimeMode",
    "fmi3CompletedIntegratorStep",
    "fmi3SetTime",
    "fmi3SetContinuousStates",
    "fmi3GetContinuousStateDerivatives",
    "fmi3GetEventIndicators",
    "fmi3GetContinuousStates",
    "fmi3GetNominalsOfContinuousStates",
    "fmi3GetNumberOfEventIndicators",
    "fmi3GetNumberOfContinuousStates",
    "fmi3ActivateModelPartition",
];

pub(in super::super) fn symbols(p: &Probe) -> Tested {
    Ok(needed(p).into_iter().filter(|s| !p.binary.exports(s)).map(|s| format!("{s} is not exported")).collect())
}

pub(in super::super) fn all_symbols(p: &Probe) -> Tested {
    let needed = needed(p);
    let others: &[&str] = if p.d.fmi == Fmi::Three { &OTHERS3 } else { &[] };
    let missing: Vec<&str> = CALLS
        .iter()
        .chain(others)
        .filter(|s| is_of(s, p.d.fmi) && !needed.contains(s) && !p.binary.exports(s))
        .copied()
        .collect();
    Ok(if missing.is_empty() { vec![] } else { vec![format!("not exported: {}", missing.join(", "))] })
}
