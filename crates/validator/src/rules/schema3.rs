//! The rules of the official XSD of FMI 3.0 (`fmi3ModelDescription.xsd` and its parts) as a table, for [`super::schema`].

use super::super::xml::Element;
use super::finding::Findings;
use super::schema::Type::{
    Bool, BoolList, DateTime, Double, DoubleList, Hex, Int, IntRange, IntRangeList, Keyword, KeywordList, Text,
    Unsigned, UnsignedList, UnsignedLong,
};
use super::schema::{Attr, BASE_UNIT, Children, MANY, Node, leaf, needs_interface, parent, sequence};

static ANNOTATION: Node =
    Node { name: "Annotation", attributes: &[("type", Text, true)], choice: &[], children: Children::Any };
static ANNOTATIONS: Node = parent("Annotations", &[], &[(&ANNOTATION, 1, MANY)]);

/// The attributes of all interfaces; others are let pass, as the schema does.
macro_rules! interface {
    ($node:ident, $name:literal, [$($attr:expr),*]) => {
        static $node: Node = Node {
            name: $name,
            attributes: &[
                ("modelIdentifier", Text, true),
                ("needsExecutionTool", Bool, false),
                ("canBeInstantiatedOnlyOncePerProcess", Bool, false),
                ("canGetAndSetFMUState", Bool, false),
                ("canSerializeFMUState", Bool, false),
                ("providesDirectionalDerivatives", Bool, false),
                ("providesAdjointDerivatives", Bool, false),
                ("providesPerElementDependencies", Bool, false),
                $($attr),*
            ],
            choice: &[],
            children: Children::Open(&[(&ANNOTATIONS, 0, 1)]),
        };
    };
}
interface!(
    MODEL_EXCHANGE,
    "ModelExchange",
    [("needsCompletedIntegratorStep", Bool, false), ("providesEvaluateDiscreteStates", Bool, false)]
);
interface!(
    CO_SIMULATION,
    "CoSimulation",
    [
        ("canHandleVariableCommunicationStepSize", Bool, false),
        ("fixedInternalStepSize", Double, false),
        ("maxOutputDerivativeOrder", Unsigned, false),
        ("recommendedIntermediateInputSmoothness", Int, false),
        ("providesIntermediateUpdate", Bool, false),
        ("mightReturnEarlyFromDoStep", Bool, false),
        ("canReturnEarlyAfterIntermediateUpdate", Bool, false),
        ("hasEventMode", Bool, false),
        ("providesEvaluateDiscreteStates", Bool, false)
    ]
);
interface!(SCHEDULED_EXECUTION, "ScheduledExecution", []);

static DISPLAY_UNIT: Node = parent(
    "DisplayUnit",
    &[("name", Text, true), ("factor", Double, false), ("offset", Double, false), ("inverse", Bool, false)],
    &[(&ANNOTATIONS, 0, 1)],
);
static UNIT: Node =
    parent("Unit", &[("name", Text, true)], &[(&BASE_UNIT, 0, 1), (&DISPLAY_UNIT, 0, MANY), (&ANNOTATIONS, 0, 1)]);
static UNIT_DEFINITIONS: Node = parent("UnitDefinitions", &[], &[(&UNIT, 1, MANY)]);
static CATEGORY: Node =
    parent("Category", &[("name", Text, true), ("description", Text, false)], &[(&ANNOTATIONS, 0, 1)]);
static LOG_CATEGORIES: Node = parent("LogCategories", &[], &[(&CATEGORY, 1, MANY)]);
static DEFAULT_EXPERIMENT: Node = parent(
    "DefaultExperiment",
    &[
        ("startTime", Double, false),
        ("stopTime", Double, false),
        ("tolerance", Double, false),
        ("stepSize", Double, false),
    ],
    &[(&ANNOTATIONS, 0, 1)],
);
const LONG: super::schema::Type = IntRange(i64::MIN as i128, i64::MAX as i128);
static ITEM: Node = parent(
    "Item",
    &[("name", Text, true), ("value", LONG, true), ("description", Text, false)],
    &[(&ANNOTATIONS, 0, 1)],
);

const CAUSALITIES: &[&str] =
    &["parameter", "calculatedParameter", "input", "output", "local", "independent", "structuralParameter"];
const VARIABILITIES: &[&str] = &["constant", "fixed", "tunable", "discrete", "continuous"];
const INTERVALS: &[&str] = &["constant", "fixed", "tunable", "changing", "countdown", "triggered"];
const KINDS: &[&str] = &["dependent", "constant", "fixed", "tunable", "discrete"];

static DIMENSION: Node = leaf("Dimension", &[("start", UnsignedLong, false), ("valueReference", Unsigned, false)]);
static START: Node = leaf("Start", &[("value", Text, false)]);
static START_BYTES: Node = leaf("Start", &[("value", Hex, false)]);
static ALIAS: Node = leaf("Alias", &[("name", Text, true), ("description", Text, false)]);
static FLOAT_ALIAS: Node =
    leaf("Alias", &[("name", Text, true), ("description", Text, false), ("displayUnit", Text, false)]);

/// A type definition and a variable of a type, with the attributes of both and of the variable alone.
macro_rules! typed {
    ($type_node:ident $type_name:literal, $node:ident $name:literal, declared $declared:literal,
        both [$($both:expr),*], own [$($own:expr),*], type_children [$($tchild:expr),*], children [$($child:expr),*]) => {
        static $type_node: Node = Node {
            name: $type_name,
            attributes: &[("name", Text, true), ("description", Text, false), $($both),*],
            choice: &[],
            children: Children::Sequence(&[(&ANNOTATIONS, 0, 1), $($tchild),*]),
        };
        static $node: Node = Node {
            name: $name,
            attributes: &[
                ("name", Text, true),
                ("valueReference", Unsigned, true),
                ("description", Text, false),
                ("causality", Keyword(CAUSALITIES), false),
                ("variability", Keyword(VARIABILITIES), false),
                ("canHandleMultipleSetPerTimeInstant", Bool, false),
                ("clocks", UnsignedList, false),
                ("declaredType", Text, $declared),
                $($both,)*
                $($own),*
            ],
            choice: &[],
            children: Children::Sequence(&[(&ANNOTATIONS, 0, 1), $($child),*]),
        };
    };
}

/// The attributes of variables that may be arrays.
const INTERMEDIATE: Attr = ("intermediateUpdate", Bool, false);
const PREVIOUS: Attr = ("previous", Unsigned, false);
const INITIAL: Attr = ("initial", Keyword(&["exact", "approx", "calculated"]), false);
const QUANTITY: Attr = ("quantity", Text, false);

macro_rules! float {
    ($type_node:ident $type_name:literal, $node:ident $name:literal) => {
        typed!($type_node $type_name, $node $name, declared false,
            both [
                QUANTITY,
                ("unit", Text, false),
                ("displayUnit", Text, false),
                ("relativeQuantity", Bool, false),
                ("unbounded", Bool, false),
                ("min", Double, false),
                ("max", Double, false),
                ("nominal", Double, false)
            ],
            own [
                INTERMEDIATE,
                PREVIOUS,
                INITIAL,
                ("start", DoubleList, false),
                ("derivative", Unsigned, false),
                ("reinit", Bool, false)
            ],
            type_children [],
            children [(&DIMENSION, 0, MANY), (&FLOAT_ALIAS, 0, MANY)]);
    };
}
float!(FLOAT32_TYPE "Float32Type", FLOAT32 "Float32");
float!(FLOAT64_TYPE "Float64Type", FLOAT64 "Float64");

macro_rules! integer {
    ($type_node:ident $type_name:literal, $node:ident $name:literal, $native:ty) => {
        typed!($type_node $type_name, $node $name, declared false,
            both [
                QUANTITY,
                ("min", IntRange(<$native>::MIN as i128, <$native>::MAX as i128), false),
                ("max", IntRange(<$native>::MIN as i128, <$native>::MAX as i128), false)
            ],
            own [
                INTERMEDIATE,
                PREVIOUS,
                INITIAL,
                ("start", IntRangeList(<$native>::MIN as i128, <$native>::MAX as i128), false)
            ],
            type_children [],
            children [(&DIMENSION, 0, MANY), (&ALIAS, 0, MANY)]);
    };
}
integer!(INT8_TYPE "Int8Type", INT8 "Int8", i8);
integer!(UINT8_TYPE "UInt8Type", UINT8 "UInt8", u8);
integer!(INT16_TYPE "Int16Type", INT16 "Int16", i16);
integer!(UINT16_TYPE "UInt16Type", UINT16 "UInt16", u16);
integer!(INT32_TYPE "Int32Type", INT32 "Int32", i32);
integer!(UINT32_TYPE "UInt32Type", UINT32 "UInt32", u32);
integer!(INT64_TYPE "Int64Type", INT64 "Int64", i64);
integer!(UINT64_TYPE "UInt64Type", UINT64 "UInt64", u64);
typed!(BOOLEAN_TYPE "BooleanType", BOOLEAN "Boolean", declared false,
    both [],
    own [INTERMEDIATE, PREVIOUS, INITIAL, ("start", BoolList, false)],
    type_children [],
    children [(&DIMENSION, 0, MANY), (&ALIAS, 0, MANY)]);
typed!(STRING_TYPE "StringType", STRING "String", declared false,
    both [],
    own [INTERMEDIATE, PREVIOUS, INITIAL],
    type_children [],
    children [(&DIMENSION, 0, MANY), (&START, 0, MANY), (&ALIAS, 0, MANY)]);
typed!(BINARY_TYPE "BinaryType", BINARY "Binary", declared false,
    both [("mimeType", Text, false), ("maxSize", UnsignedLong, false)],
    own [INTERMEDIATE, PREVIOUS, INITIAL],
    type_children [],
    children [(&DIMENSION, 0, MANY), (&START_BYTES, 0, MANY), (&ALIAS, 0, MANY)]);
typed!(ENUMERATION_TYPE "EnumerationType", ENUMERATION "Enumeration", declared true,
    both [QUANTITY, ("min", LONG, false), ("max", LONG, false)],
    own [INTERMEDIATE, PREVIOUS, INITIAL, ("start", IntRangeList(i64::MIN as i128, i64::MAX as i128), false)],
    type_children [(&ITEM, 1, MANY)],
    children [(&DIMENSION, 0, MANY), (&ALIAS, 0, MANY)]);
typed!(CLOCK_TYPE "ClockType", CLOCK "Clock", declared false,
    both [
        ("canBeDeactivated", Bool, false),
        ("priority", Unsigned, false),
        ("intervalVariability", Keyword(INTERVALS), true),
        ("intervalDecimal", Double, false),
        ("shiftDecimal", Double, false),
        ("supportsFraction", Bool, false),
        ("resolution", UnsignedLong, false),
        ("intervalCounter", UnsignedLong, false),
        ("shiftCounter", UnsignedLong, false)
    ],
    own [],
    type_children [],
    children [(&ALIAS, 0, MANY)]);

static TYPE_DEFINITIONS: Node = Node {
    name: "TypeDefinitions",
    attributes: &[],
    choice: &[],
    children: Children::Mixed(&[
        &FLOAT32_TYPE,
        &FLOAT64_TYPE,
        &INT8_TYPE,
        &UINT8_TYPE,
        &INT16_TYPE,
        &UINT16_TYPE,
        &INT32_TYPE,
        &UINT32_TYPE,
        &INT64_TYPE,
        &UINT64_TYPE,
        &BOOLEAN_TYPE,
        &STRING_TYPE,
        &BINARY_TYPE,
        &ENUMERATION_TYPE,
        &CLOCK_TYPE,
    ]),
};
static MODEL_VARIABLES: Node = Node {
    name: "ModelVariables",
    attributes: &[],
    choice: &[],
    children: Children::Mixed(&[
        &FLOAT32,
        &FLOAT64,
        &INT8,
        &UINT8,
        &INT16,
        &UINT16,
        &INT32,
        &UINT32,
        &INT64,
        &UINT64,
        &BOOLEAN,
        &STRING,
        &BINARY,
        &ENUMERATION,
        &CLOCK,
    ]),
};

macro_rules! unknown {
    ($($node:ident $name:literal),*) => {$(
        static $node: Node = parent(
            $name,
            &[
                ("valueReference", Unsigned, true),
                ("dependencies", UnsignedList, false),
                ("dependenciesKind", KeywordList(KINDS), false),
            ],
            &[(&ANNOTATIONS, 0, 1)],
        );
    )*};
}
unknown!(
    OUTPUT "Output",
    DERIVATIVE "ContinuousStateDerivative",
    CLOCKED_STATE "ClockedState",
    INITIAL_UNKNOWN "InitialUnknown",
    EVENT_INDICATOR "EventIndicator"
);
static MODEL_STRUCTURE: Node = parent(
    "ModelStructure",
    &[],
    &[
        (&OUTPUT, 0, MANY),
        (&DERIVATIVE, 0, MANY),
        (&CLOCKED_STATE, 0, MANY),
        (&INITIAL_UNKNOWN, 0, MANY),
        (&EVENT_INDICATOR, 0, MANY),
    ],
);

/// The interfaces come first, in this order; that there is one is rule `interface-missing`'s.
static ROOT: Node = parent(
    "fmiModelDescription",
    &[
        ("fmiVersion", Text, false), // rule fmi-version
        ("modelName", Text, true),
        ("instantiationToken", Text, true),
        ("description", Text, false),
        ("author", Text, false),
        ("version", Text, false),
        ("copyright", Text, false),
        ("license", Text, false),
        ("generationTool", Text, false),
        ("generationDateAndTime", DateTime, false),
        ("variableNamingConvention", Keyword(&["flat", "structured"]), false),
    ],
    &[
        (&MODEL_EXCHANGE, 0, 1),
        (&CO_SIMULATION, 0, 1),
        (&SCHEDULED_EXECUTION, 0, 1),
        (&UNIT_DEFINITIONS, 0, 1),
        (&TYPE_DEFINITIONS, 0, 1),
        (&LOG_CATEGORIES, 0, 1),
        (&DEFAULT_EXPERIMENT, 0, 1),
        (&MODEL_VARIABLES, 1, 1),
        (&MODEL_STRUCTURE, 1, 1),
        (&ANNOTATIONS, 0, 1),
    ],
);

/// Checks the tree against the table.
pub(super) fn check(root: &Element, findings: &mut Findings) {
    super::schema::attributes(root, &ROOT, findings);
    needs_interface(root, &[&MODEL_EXCHANGE, &CO_SIMULATION, &SCHEDULED_EXECUTION], findings);
    sequence(root, &root.children, &ROOT, findings);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Kind;

    #[test]
    fn every_type_has_a_variable_and_a_definition() {
        let names = |node: &Node| -> Vec<&str> {
            let Children::Mixed(nodes) = node.children else { panic!("{}", node.name) };
            nodes.iter().map(|n| n.name).collect()
        };
        for kind in Kind::ALL {
            assert!(names(&MODEL_VARIABLES).contains(&kind.keyword()), "{kind:?}");
            assert!(names(&TYPE_DEFINITIONS).contains(&format!("{}Type", kind.keyword()).as_str()), "{kind:?}");
        }
    }
}
