//! Defects of the binary, by the switch of `fmu.c`.

use super::corpus::{self, DESCRIPTION, Mutant, pack};

pub const DEFECTS: &[(&str, &str)] = &[
    ("UNRESOLVED", "binary-load"),
    ("SYMBOL_MISSING", "binary-symbols"),
    ("SYMBOL_OPTIONAL", "binary-all-symbols"),
    ("PLATFORM", "types-platform"),
    ("VERSION", "version"),
    ("REFUSES", "instantiate"),
    ("INSTANTIATE_CRASH", "instantiate"),
    ("INITIALISE", "initialise"),
    ("UNREADABLE", "variable-readable"),
    ("STEP_FAILS", "simulate"),
    ("STEP_CRASH", "simulate"),
    ("STEP_ABORT", "simulate"),
    ("STEP_EXIT", "simulate"),
    ("STEP_EXIT_ZERO", "simulate"),
    ("STEP_HANG", "simulate"),
    ("STEP_MEMORY", "simulate"),
    ("STEP_STACK", "simulate"),
    ("PENDING", "step-status"),
    ("STATUS_NUMBER", "step-status"),
    ("RANDOM", "determinism"),
    ("UNINITIALISED", "determinism"),
    ("TERMINATE", "terminate"),
    ("FREE_CRASH", "terminate"),
    ("FREE_NULL", "free-null"),
    ("UNLOAD", "unload"),
    ("GUID_ACCEPTED", "guid-check"),
    ("RESOURCES", "resources-missing"),
    ("START_VALUE", "start-values"),
    ("START_STRING", "start-values"),
    ("START_REFUSED", "start-settable"),
    ("SET_GET", "set-get-rounded"),
    ("SET_WRONG", "set-get"),
    ("GET_EFFECT", "get-consistent"),
    ("BOOLEAN", "boolean-values"),
    ("STRING_NULL", "string-values"),
    ("STRING_LATIN", "string-values"),
    ("FIXED_DRIFTS", "unchanging"),
    ("NAN_OUTPUT", "output-finite"),
    ("RANGE", "output-range"),
    ("TUNABLE_REFUSED", "tunable-set"),
    ("FIXED_ACCEPTED", "fixed-set"),
    ("BAD_GET", "bad-reference-get"),
    ("BAD_GET_CRASH", "bad-reference-get"),
    ("BAD_SET", "bad-reference-set"),
    ("EMPTY_CALL", "empty-call"),
    ("RESET_FORGETS", "reset"),
    ("RESET_PARAMETER", "reset"),
    ("RESET_CRASH", "reset"),
    ("STATE_FORGETS", "state-restore"),
    ("STATE_INPUT", "state-restore"),
    ("STATE_SHARED", "state-restore"),
    ("STATE_HANDLE", "state-handles"),
    ("SERIALISE", "state-serialise"),
    ("SERIALISE_POINTER", "state-serialise"),
    ("STEP_IGNORED", "step-size"),
    ("CONVERGENCE", "step-convergence"),
    ("VARIABLE", "step-variable"),
    ("NEGATIVE", "step-negative"),
    ("ZERO", "step-zero"),
    ("WRONG_POINT", "step-wrong-point"),
    ("EARLY", "step-early"),
    ("EARLY_CRASH", "step-early"),
    ("LATE", "step-late"),
    ("INIT_ORDER", "initialisation-order"),
    ("NAN_INPUT", "nan-input"),
    ("NAN_HANG", "nan-input"),
    ("CANCEL", "status-functions"),
    ("TIME", "time-variable"),
    ("DERIVATIVE", "derivative-value"),
    ("INPUT_DERIVATIVE", "input-derivatives"),
    ("OUTPUT_DERIVATIVE", "output-derivatives"),
    ("DIRECTIONAL", "directional-derivative"),
    ("DEPENDENCY", "dependencies-hold"),
    ("GLOBAL", "instances-independent"),
    ("THREADS", "instances-threads"),
    ("HANDOVER", "thread-handover"),
    ("LEAK", "instance-leak"),
    ("LEAK_LARGE", "instance-leak-large"),
    ("NULL_CRASH", "null-component"),
    ("LEAK_FILE", "instance-leak-large"),
    ("LEAK_THREAD", "instance-leak-large"),
    ("STEP_LEAK", "step-leak"),
    ("CALLBACKS", "callbacks-copied"),
    ("NAME_KEPT", "callbacks-copied"),
    ("ALLOCATION", "allocation-failure"),
    ("DEBUG_LOGGING", "debug-logging"),
    ("LOG_CATEGORY", "log-categories"),
    ("DIRECTORY", "side-directory"),
    ("ROUNDING", "side-rounding"),
    ("DENORMALS", "side-rounding"),
    ("STDOUT", "side-stdout"),
    ("SIGNALS", "side-signals"),
    ("ENVIRONMENT", "side-environment"),
    ("LOCALE", "side-locale"),
    ("FILES", "side-files"),
    ("SECOND_FAILS", "instances-repeated"),
    ("SECOND_CRASH", "instances-repeated"),
    ("KEPT", "instances-sequential"),
    ("ORDER", "instances-independent"),
    ("TERMINATED_GET", "terminated"),
    ("TERMINATED_RESET", "reset"),
    ("RESOURCES_PATH", "resources-path"),
    ("START_TIME", "start-time"),
    ("STOP_TIME", "stop-time"),
    ("INPUTS_LOST", "inputs-initial"),
    ("STRING_BUFFER", "string-buffers"),
    ("TUNABLE_IGNORED", "tunable-effect"),
    ("REFERENCE_CUT", "reference-bits"),
    ("STATE_LEAK", "state-leak"),
    ("STATE_LATE", "state-restore"),
    ("STATE_PROMISE", "state-restore"),
    ("RESET_SLOPE", "reset"),
    ("INITIAL_KEPT", "reset"),
    ("OUTPUT_BEHIND", "output-delay"),
    ("SLOPE_IGNORED", "input-derivatives-effect"),
    ("DEPENDENCY_STEP", "dependencies-soon"),
    ("NOT_CONSTANT", "dependencies-constant"),
    ("TIME_HIDDEN", "dependencies-time"),
    ("LOCALE_NUMBERS", "locale-numbers"),
    ("ENUMERATION", "output-range"),
    ("DISK", "simulate"),
    ("FORGES", "simulate"),
];

pub fn mutants() -> Vec<Mutant> {
    let mutant = |&(defect, rule): &(&'static str, &'static str)| {
        Mutant::new(defect, rule, move || pack(&corpus::running(DESCRIPTION, defect)))
    };
    // A sound binary with a description that does not fit it.
    let understated = Mutant::new("initial dependencies understated", "dependencies-initial", || {
        let text = corpus::description(&[(
            "<InitialUnknowns>\n      <Unknown index=\"4\" dependencies=\"3\"/>\n      <Unknown index=\"5\"/>",
            "<InitialUnknowns>\n      <Unknown index=\"4\" dependencies=\"3\"/>\n      <Unknown index=\"5\" dependencies=\"3\"/>",
        )]);
        pack(&corpus::running(&text, "NONE"))
    });
    DEFECTS.iter().map(mutant).chain([understated]).collect()
}

#[test]
fn every_defect_of_the_c_source_is_in_the_list() {
    let source = include_str!("../corpus/fmu.c");
    let list = source.split("enum {").nth(1).unwrap().split('}').next().unwrap();
    let switches: Vec<&str> =
        list.split(',').map(str::trim).filter(|name| !["NONE", "DAEMON", "LOG_FOREIGN"].contains(name)).collect();
    assert_eq!(switches.len(), DEFECTS.len());
    for switch in switches {
        assert!(DEFECTS.iter().any(|(defect, _)| *defect == switch), "{switch}");
    }
}
