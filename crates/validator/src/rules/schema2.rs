//! The rules of the official XSD of FMI 2.0 (`fmi2ModelDescription.xsd` and its parts) as a table, for [`super::schema`].
//!
//! Where the XSD gives an element no type (`Boolean` and `String` of a `SimpleType`), anything is allowed, as there.

use super::super::xml::Element;
use super::finding::Findings;
use super::id;
use super::schema::Type::{Bool, DateTime, Double, Int, Keyword, KeywordList, Text, Unsigned, UnsignedList};
use super::schema::{BASE_UNIT, Children, MANY, Node, attributes, element, leaf, parent, sequence};

const KINDS: &[&str] = &["dependent", "constant", "fixed", "tunable", "discrete"];

static FILE: Node = leaf("File", &[("name", Text, true)]);
static SOURCE_FILES: Node = parent("SourceFiles", &[], &[(&FILE, 1, MANY)]);
static MODEL_EXCHANGE: Node = parent(
    "ModelExchange",
    &[
        ("modelIdentifier", Text, true),
        ("needsExecutionTool", Bool, false),
        ("completedIntegratorStepNotNeeded", Bool, false),
        ("canBeInstantiatedOnlyOncePerProcess", Bool, false),
        ("canNotUseMemoryManagementFunctions", Bool, false),
        ("canGetAndSetFMUstate", Bool, false),
        ("canSerializeFMUstate", Bool, false),
        ("providesDirectionalDerivative", Bool, false),
    ],
    &[(&SOURCE_FILES, 0, 1)],
);
static CO_SIMULATION: Node = parent(
    "CoSimulation",
    &[
        ("modelIdentifier", Text, true),
        ("needsExecutionTool", Bool, false),
        ("canHandleVariableCommunicationStepSize", Bool, false),
        ("canInterpolateInputs", Bool, false),
        ("maxOutputDerivativeOrder", Unsigned, false),
        ("canRunAsynchronuously", Bool, false),
        ("canBeInstantiatedOnlyOncePerProcess", Bool, false),
        ("canNotUseMemoryManagementFunctions", Bool, false),
        ("canGetAndSetFMUstate", Bool, false),
        ("canSerializeFMUstate", Bool, false),
        ("providesDirectionalDerivative", Bool, false),
    ],
    &[(&SOURCE_FILES, 0, 1)],
);
static DISPLAY_UNIT: Node =
    leaf("DisplayUnit", &[("name", Text, true), ("factor", Double, false), ("offset", Double, false)]);
static UNIT: Node = parent("Unit", &[("name", Text, true)], &[(&BASE_UNIT, 0, 1), (&DISPLAY_UNIT, 0, MANY)]);
static UNIT_DEFINITIONS: Node = parent("UnitDefinitions", &[], &[(&UNIT, 1, MANY)]);
static ITEM: Node = leaf("Item", &[("name", Text, true), ("value", Int, true), ("description", Text, false)]);
static TYPE_REAL: Node = leaf(
    "Real",
    &[
        ("quantity", Text, false),
        ("unit", Text, false),
        ("displayUnit", Text, false),
        ("relativeQuantity", Bool, false),
        ("min", Double, false),
        ("max", Double, false),
        ("nominal", Double, false),
        ("unbounded", Bool, false),
    ],
);
static TYPE_INTEGER: Node = leaf("Integer", &[("quantity", Text, false), ("min", Int, false), ("max", Int, false)]);
static TYPE_BOOLEAN: Node = Node { name: "Boolean", attributes: &[], choice: &[], children: Children::Any };
static TYPE_STRING: Node = Node { name: "String", attributes: &[], choice: &[], children: Children::Any };
static TYPE_ENUMERATION: Node = parent("Enumeration", &[("quantity", Text, false)], &[(&ITEM, 1, MANY)]);
static SIMPLE_TYPE: Node = Node {
    name: "SimpleType",
    attributes: &[("name", Text, true), ("description", Text, false)],
    choice: &[&TYPE_REAL, &TYPE_INTEGER, &TYPE_BOOLEAN, &TYPE_STRING, &TYPE_ENUMERATION],
    children: Children::Sequence(&[]),
};
static TYPE_DEFINITIONS: Node = parent("TypeDefinitions", &[], &[(&SIMPLE_TYPE, 1, MANY)]);
static CATEGORY: Node = leaf("Category", &[("name", Text, true), ("description", Text, false)]);
static LOG_CATEGORIES: Node = parent("LogCategories", &[], &[(&CATEGORY, 1, MANY)]);
static DEFAULT_EXPERIMENT: Node = leaf(
    "DefaultExperiment",
    &[
        ("startTime", Double, false),
        ("stopTime", Double, false),
        ("tolerance", Double, false),
        ("stepSize", Double, false),
    ],
);
static TOOL: Node = Node { name: "Tool", attributes: &[("name", Text, true)], choice: &[], children: Children::Any };
static VENDOR_ANNOTATIONS: Node = parent("VendorAnnotations", &[], &[(&TOOL, 1, MANY)]);
static ANNOTATIONS: Node = parent("Annotations", &[], &[(&TOOL, 1, MANY)]);
static REAL: Node = leaf(
    "Real",
    &[
        ("declaredType", Text, false),
        ("quantity", Text, false),
        ("unit", Text, false),
        ("displayUnit", Text, false),
        ("relativeQuantity", Bool, false),
        ("min", Double, false),
        ("max", Double, false),
        ("nominal", Double, false),
        ("unbounded", Bool, false),
        ("start", Double, false),
        ("derivative", Unsigned, false),
        ("reinit", Bool, false),
    ],
);
static INTEGER: Node = leaf(
    "Integer",
    &[
        ("declaredType", Text, false),
        ("quantity", Text, false),
        ("min", Int, false),
        ("max", Int, false),
        ("start", Int, false),
    ],
);
static BOOLEAN: Node = leaf("Boolean", &[("declaredType", Text, false), ("start", Bool, false)]);
static STRING: Node = leaf("String", &[("declaredType", Text, false), ("start", Text, false)]);
static ENUMERATION: Node = leaf(
    "Enumeration",
    &[
        ("declaredType", Text, true),
        ("quantity", Text, false),
        ("min", Int, false),
        ("max", Int, false),
        ("start", Int, false),
    ],
);
static SCALAR_VARIABLE: Node = Node {
    name: "ScalarVariable",
    attributes: &[
        ("name", Text, true),
        ("valueReference", Unsigned, true),
        ("description", Text, false),
        ("causality", Keyword(&["parameter", "calculatedParameter", "input", "output", "local", "independent"]), false),
        ("variability", Keyword(&["constant", "fixed", "tunable", "discrete", "continuous"]), false),
        ("initial", Keyword(&["exact", "approx", "calculated"]), false),
        ("canHandleMultipleSetPerTimeInstant", Bool, false),
    ],
    choice: &[&REAL, &INTEGER, &BOOLEAN, &STRING, &ENUMERATION],
    children: Children::Sequence(&[(&ANNOTATIONS, 0, 1)]),
};
static MODEL_VARIABLES: Node = parent("ModelVariables", &[], &[(&SCALAR_VARIABLE, 1, MANY)]);
static UNKNOWN: Node = leaf(
    "Unknown",
    &[
        ("index", Unsigned, true),
        ("dependencies", UnsignedList, false),
        ("dependenciesKind", KeywordList(KINDS), false),
    ],
);
static OUTPUTS: Node = parent("Outputs", &[], &[(&UNKNOWN, 1, MANY)]);
static DERIVATIVES: Node = parent("Derivatives", &[], &[(&UNKNOWN, 1, MANY)]);
static INITIAL_UNKNOWNS: Node = parent("InitialUnknowns", &[], &[(&UNKNOWN, 1, MANY)]);
static MODEL_STRUCTURE: Node =
    parent("ModelStructure", &[], &[(&OUTPUTS, 0, 1), (&DERIVATIVES, 0, 1), (&INITIAL_UNKNOWNS, 0, 1)]);

/// `ModelExchange` and `CoSimulation` come in either order; their number is rule `interface-missing`'s.
static ROOT: Node = parent(
    "fmiModelDescription",
    &[
        ("fmiVersion", Text, false), // rule fmi-version
        ("modelName", Text, true),
        ("guid", Text, true),
        ("description", Text, false),
        ("author", Text, false),
        ("version", Text, false),
        ("copyright", Text, false),
        ("license", Text, false),
        ("generationTool", Text, false),
        ("generationDateAndTime", DateTime, false),
        ("variableNamingConvention", Keyword(&["flat", "structured"]), false),
        ("numberOfEventIndicators", Unsigned, false),
    ],
    &[
        (&UNIT_DEFINITIONS, 0, 1),
        (&TYPE_DEFINITIONS, 0, 1),
        (&LOG_CATEGORIES, 0, 1),
        (&DEFAULT_EXPERIMENT, 0, 1),
        (&VENDOR_ANNOTATIONS, 0, 1),
        (&MODEL_VARIABLES, 1, 1),
        (&MODEL_STRUCTURE, 1, 1),
    ],
);

/// Checks the tree against the table.
pub(super) fn check(root: &Element, findings: &mut Findings) {
    attributes(root, &ROOT, findings);
    let mut interfaces = 0;
    for child in &root.children {
        match child.name.as_str() {
            "ModelExchange" => element(child, &MODEL_EXCHANGE, findings),
            "CoSimulation" => element(child, &CO_SIMULATION, findings),
            _ => break,
        }
        interfaces += 1;
    }
    if interfaces == 0 {
        let message = "neither a ModelExchange nor a CoSimulation element comes first";
        findings.at(id::INTERFACE_MISSING, root.position, message);
    }
    for name in ["ModelExchange", "CoSimulation"] {
        if let Some(second) = root.children_named(name).nth(1) {
            findings.at(id::SCHEMA_ELEMENT, second.position, format!("a second {name} element"));
        }
    }
    sequence(root, &root.children[interfaces..], &ROOT, findings);
}
