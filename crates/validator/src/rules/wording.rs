//! Titles, advice and messages of the rules in the terms of FMI 3.0; the list of rules has them in those of FMI 2.0.

use super::{Id, Rule, id};
use crate::description::Fmi;

/// Functions and attributes by another name, longest first where one begins with another.
const NAMES: [(&str, &str); 27] = [
    ("fmi2GetRealInputDerivatives", "fmi3GetOutputDerivatives"),
    ("fmi2GetRealOutputDerivatives", "fmi3GetOutputDerivatives"),
    ("fmi2SetupExperiment", "fmi3EnterInitializationMode"),
    ("fmi2GetRealStatus", "fmi3DoStep"),
    ("fmi2GetReal", "fmi3GetFloat64"),
    ("fmi2SetReal", "fmi3SetFloat64"),
    ("fmi2GetInteger", "fmi3GetInt32"),
    ("fmi2SetInteger", "fmi3SetInt32"),
    ("fmi2GetFMUstate", "fmi3GetFMUState"),
    ("fmi2SetFMUstate", "fmi3SetFMUState"),
    ("fmi2FreeFMUstate", "fmi3FreeFMUState"),
    ("fmi2SerializedFMUstateSize", "fmi3SerializedFMUStateSize"),
    ("fmi2SerializeFMUstate", "fmi3SerializeFMUState"),
    ("fmi2DeSerializeFMUstate", "fmi3DeserializeFMUState"),
    ("fmi2Instantiate", "fmi3InstantiateCoSimulation"),
    ("fmi2SetXXX", "fmi3Set{VariableType}"),
    ("fmi2GetXXX", "fmi3Get{VariableType}"),
    ("canGetAndSetFMUstate", "canGetAndSetFMUState"),
    ("canSerializeFMUstate", "canSerializeFMUState"),
    ("providesDirectionalDerivative is", "providesDirectionalDerivatives is"),
    ("InitialUnknowns", "InitialUnknown"),
    ("the component", "the instance"),
    ("The component", "The instance"),
    ("fmi2_", "fmi3_"),
    ("a Real ", "a floating-point number "),
    ("Real output", "floating-point output"),
    ("fmi2", "fmi3"),
];

/// A message in the terms of FMI 3.0.
#[must_use]
pub fn in_fmi3(text: &str) -> String {
    NAMES.iter().fold(text.to_owned(), |text, (two, three)| text.replace(two, three))
}

/// Rules that require something else in FMI 3.0: title and advice; empty where the text of 2.0 holds.
const OWN: [(Id, &str, &str); 27] = [
    (id::FMI_VERSION, "fmiVersion is 3.0", "Write fmiVersion=\"3.0\", for 3.0.1 and later too."),
    (
        id::INTERFACE_MISSING,
        "There is a ModelExchange, CoSimulation or ScheduledExecution element",
        "Put one of them first in the file.",
    ),
    (id::SCHEMA_ATTRIBUTE, "", "Correct the spelling, or move tool data to Annotations."),
    (
        id::GUID,
        "The instantiationToken is not empty",
        "Generate a token (or a hash of the file) at export and compile it into the binary.",
    ),
    (id::TYPE_UNDECLARED, "", "Add the type to TypeDefinitions."),
    (id::TYPE_MISMATCH, "", "Let a Float64 have a Float64Type, and so on."),
    (
        id::VARIABILITY_TYPE,
        "Only a floating-point number is continuous",
        "Declare variability=\"discrete\", the default (or fixed, tunable, constant).",
    ),
    (id::CAUSALITY_VARIABILITY, "", "See the table of combinations in section 2.4.7.4."),
    (id::INITIAL, "", "Leave initial out to get the default, or see the table in section 2.4.7.4."),
    (
        id::INDEPENDENT_VARIABLE,
        "Exactly one variable is independent, and it is a floating-point number",
        "Keep the one that stands for time, or add it.",
    ),
    (
        id::DERIVATIVE_INDEX,
        "derivative names another continuous floating-point variable",
        "Give the valueReference of the state.",
    ),
    (
        id::STRUCTURE_INDEX,
        "Value references of the model structure are those of variables",
        "Entries of the model structure name variables by valueReference.",
    ),
    (
        id::STRUCTURE_OUTPUTS,
        "There is an Output for each variable of causality output, and for no other",
        "Add or remove the Output.",
    ),
    (
        id::STRUCTURE_DERIVATIVES,
        "ContinuousStateDerivative lists derivatives",
        "Add the derivative attribute to the variable, or remove the entry.",
    ),
    (
        id::DEPENDENCIES_INDEX,
        "Dependencies are value references of variables, each once",
        "Name variables by valueReference.",
    ),
    (id::DEPENDENCIES_KIND, "", "Give as many kinds as dependencies."),
    (id::BINARY_MISSING, "", "Add binaries/<platform tuple>/<modelIdentifier>.<so|dll|dylib>, or sources/."),
    (id::BINARY_FOLDER, "", "Use platform tuples: x86_64-windows, x86_64-linux, aarch64-darwin and so on."),
    (id::VERSION, "fmi3GetVersion gives \"3.0\"", "Return fmi3Version of the standard header, for 3.0.x too."),
    (
        id::STEP_STATUS,
        "fmi3DoStep returns a status of the standard",
        "Return fmi3OK, Warning, Discard, Error or Fatal.",
    ),
    (
        id::GUID_CHECK,
        "A wrong instantiationToken is refused",
        "Compare the token in fmi3InstantiateCoSimulation and return null; it guards against a binary and an XML of different versions.",
    ),
    (
        id::INSTANTIATE,
        "",
        "See the FMU's message; the token compiled in must be the instantiationToken of modelDescription.xml.",
    ),
    (id::RESOURCES_PATH, "", "resourcePath is a path, not a URI: open files below it as it stands, in UTF-8."),
    (id::START_TIME, "", "Take startTime of fmi3EnterInitializationMode for the initial time."),
    (id::BOOLEAN_VALUES, "Booleans are fmi3False (0) or fmi3True (1)", ""),
    (id::SIDE_DIRECTORY, "", "Open files by the path of resourcePath instead."),
    (id::OUTPUT_DERIVATIVES, "", "Implement fmi3GetOutputDerivatives or set maxOutputDerivativeOrder to 0."),
];

/// A text of a rule in the terms of a version: in FMI 3.0 its `own`, where there is one, else that of 2.0 with the names of
/// 3.0.
fn for_version(fmi: Fmi, two: &str, own: Option<&str>) -> String {
    match fmi {
        Fmi::Two => two.to_owned(),
        Fmi::Three => own.filter(|own| !own.is_empty()).map_or_else(|| in_fmi3(two), str::to_owned),
    }
}

fn own(rule: &Rule) -> Option<&'static (Id, &'static str, &'static str)> {
    OWN.iter().find(|(id, ..)| rule.is(*id))
}

pub(super) fn title(rule: &Rule, fmi: Fmi) -> String {
    for_version(fmi, rule.title, own(rule).map(|(_, title, _)| *title))
}

pub(super) fn advice(rule: &Rule, fmi: Fmi) -> String {
    for_version(fmi, rule.advice, own(rule).map(|(.., advice)| *advice))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_entry_is_of_a_rule_of_fmi_3_and_no_rule_of_it_speaks_of_fmi_2() {
        for (id, ..) in OWN {
            let rule = super::super::rule(id.text()).unwrap();
            assert!(rule.section(Fmi::Three).is_some(), "{}", id.text());
        }
        for rule in super::super::of(Fmi::Three) {
            let text = format!("{} {}", rule.title(Fmi::Three), rule.advice(Fmi::Three));
            for old in
                ["fmi2", "GUID", "guid", "ScalarVariable", "SimpleType", "fmuResourceLocation", "2.2.", "URI (RFC"]
            {
                assert!(!text.contains(old), "{}: {text}", rule.id);
            }
        }
    }

    #[test]
    fn every_section_is_a_number() {
        for rule in super::super::RULES {
            let valid = |s: &str| s == "-" || s.split('.').all(|n| n.parse::<u32>().is_ok());
            assert!(rule.sections.iter().all(|s| valid(s)) && rule.sections != ["-", "-"], "{}", rule.id);
        }
    }
}
