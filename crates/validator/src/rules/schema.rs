//! The rules of the official XSD (`fmi2ModelDescription.xsd` and its parts) as a table, with places.
//!
//! Where the XSD gives an element no type (`Boolean` and `String` of a `SimpleType`), anything goes, as there.

use super::super::description::{parse_boolean, parse_integer, parse_real};
use super::super::xml::Element;
use super::finding::Findings;
use super::id;

/// Type of an attribute.
#[derive(Debug, Clone, Copy)]
pub(super) enum Type {
    /// `xs:string` or `xs:normalizedString`.
    Text,
    Bool,
    Int,
    Unsigned,
    Double,
    DateTime,
    Keyword(&'static [&'static str]),
    UnsignedList,
    KeywordList(&'static [&'static str]),
    /// An integer from one to another, both included.
    IntRange(i128, i128),
    /// `xs:unsignedLong`.
    UnsignedLong,
    /// Numbers, for the elements of an array.
    DoubleList,
    IntRangeList(i128, i128),
    BoolList,
    /// `xs:hexBinary`.
    Hex,
}

/// An attribute: name, type, whether it is required.
pub(super) type Attr = (&'static str, Type, bool);

/// How children follow each other.
#[derive(Debug, Clone, Copy)]
pub(super) enum Children {
    /// In this order: name, smallest number, largest number.
    Sequence(&'static [(&'static Node, usize, usize)]),
    /// As a sequence, and the element may have attributes of others.
    Open(&'static [(&'static Node, usize, usize)]),
    /// One or more of these, in any order.
    Mixed(&'static [&'static Node]),
    /// Anything.
    Any,
}

/// An element.
#[derive(Debug)]
pub(super) struct Node {
    pub name: &'static str,
    pub attributes: &'static [Attr],
    /// One of these must be the first child.
    pub choice: &'static [&'static Node],
    pub children: Children,
}

pub(super) const MANY: usize = usize::MAX;
const KINDS: &[&str] = &["dependent", "constant", "fixed", "tunable", "discrete"];
use Type::{
    Bool, BoolList, DateTime, Double, DoubleList, Hex, Int, IntRange, IntRangeList, Keyword, KeywordList, Text,
    Unsigned, UnsignedList, UnsignedLong,
};

pub(super) const fn leaf(name: &'static str, attributes: &'static [Attr]) -> Node {
    Node { name, attributes, choice: &[], children: Children::Sequence(&[]) }
}

pub(super) const fn parent(
    name: &'static str,
    attributes: &'static [Attr],
    children: &'static [(&'static Node, usize, usize)],
) -> Node {
    Node { name, attributes, choice: &[], children: Children::Sequence(children) }
}

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
pub(super) static BASE_UNIT: Node = leaf(
    "BaseUnit",
    &[
        ("kg", Int, false),
        ("m", Int, false),
        ("s", Int, false),
        ("A", Int, false),
        ("K", Int, false),
        ("mol", Int, false),
        ("cd", Int, false),
        ("rad", Int, false),
        ("factor", Double, false),
        ("offset", Double, false),
    ],
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

fn element(e: &Element, node: &Node, findings: &mut Findings) {
    if matches!(node.children, Children::Any) {
        // Required attributes still count; what else is there does not.
        required(e, node, findings);
        return;
    }
    attributes(e, node, findings);
    if e.has_text {
        findings.at(
            id::SCHEMA_ELEMENT,
            e.position,
            format!("the element {} holds text, which has no place there", e.name),
        );
    }
    let mut children = e.children.as_slice();
    if !node.choice.is_empty() {
        let names: Vec<&str> = node.choice.iter().map(|n| n.name).collect();
        let first = children.first().and_then(|c| Some((c, node.choice.iter().find(|n| n.name == c.name)?)));
        let Some((child, node)) = first else {
            let message = format!("the element {} must begin with one of {}", e.name, names.join(", "));
            findings.at(id::SCHEMA_ELEMENT, e.position, message);
            return;
        };
        element(child, node, findings);
        children = &children[1..];
    }
    sequence(e, children, node, findings);
}

/// That one of the interfaces is there.
pub(super) fn needs_interface(root: &Element, interfaces: &[&Node], findings: &mut Findings) {
    if !root.children.iter().any(|c| interfaces.iter().any(|node| node.name == c.name)) {
        let names: Vec<&str> = interfaces.iter().map(|node| node.name).collect();
        let message = format!("there is none of the elements {}", names.join(", "));
        findings.at(id::INTERFACE_MISSING, root.position, message);
    }
}

fn mixed(e: &Element, nodes: &[&Node], findings: &mut Findings) {
    for child in &e.children {
        match nodes.iter().find(|n| n.name == child.name) {
            Some(node) => element(child, node, findings),
            None => {
                findings.at(id::SCHEMA_ELEMENT, child.position, format!("{} has no place in {}", child.name, e.name));
            }
        }
    }
    if e.children.is_empty() {
        findings.at(id::SCHEMA_ELEMENT, e.position, format!("{} has no elements", e.name));
    }
}

pub(super) fn sequence(e: &Element, children: &[Element], node: &Node, findings: &mut Findings) {
    if let Children::Mixed(nodes) = node.children {
        return mixed(e, nodes, findings);
    }
    let (Children::Sequence(expected) | Children::Open(expected)) = node.children else { return };
    let mut counts = vec![0_usize; expected.len()];
    let mut current = 0;
    for child in children {
        let Some(index) = expected.iter().position(|(n, ..)| n.name == child.name) else {
            // The two interfaces are counted by the caller when they are out of place.
            findings.at(id::SCHEMA_ELEMENT, child.position, format!("{} has no place in {}", child.name, e.name));
            continue;
        };
        if index < current {
            let before = expected[current].0.name;
            findings.at(id::SCHEMA_ELEMENT, child.position, format!("{} must come before {before}", child.name));
        }
        current = current.max(index);
        counts[index] += 1;
        if counts[index] > expected[index].2 {
            findings.at(id::SCHEMA_ELEMENT, child.position, format!("a second {} element in {}", child.name, e.name));
        }
        element(child, expected[index].0, findings);
    }
    for ((node, least, _), count) in expected.iter().zip(counts) {
        if count < *least {
            findings.at(id::SCHEMA_ELEMENT, e.position, format!("{} has no {} element", e.name, node.name));
        }
    }
}

fn required(e: &Element, node: &Node, findings: &mut Findings) {
    for (name, _, required) in node.attributes {
        if *required && e.get(name).is_none() {
            findings.at(id::SCHEMA_REQUIRED, e.position, format!("{} has no {name} attribute", describe(e)));
        }
    }
}

/// The element with its name attribute, where it has one.
fn describe(e: &Element) -> String {
    match e.get("name") {
        Some(name) => format!("{} \"{name}\"", e.name),
        None => e.name.clone(),
    }
}

pub(super) fn attributes(e: &Element, node: &Node, findings: &mut Findings) {
    required(e, node, findings);
    for attribute in &e.attributes {
        let name = attribute.name.as_str();
        // Namespace declarations and attributes of other namespaces (xsi:schemaLocation) are XML's, not FMI's.
        if name == "xmlns" || name.contains(':') {
            continue;
        }
        let Some((_, kind, _)) = node.attributes.iter().find(|(n, ..)| *n == name) else {
            if matches!(node.children, Children::Open(_)) {
                continue;
            }
            findings.at(
                id::SCHEMA_ATTRIBUTE,
                attribute.position,
                format!("{} has an attribute {name}, which the schema does not define there", describe(e)),
            );
            continue;
        };
        if let Err(expected) = fits(&attribute.value, *kind) {
            let rule = if matches!(kind, DateTime) { id::DATE_TIME } else { id::SCHEMA_VALUE };
            let message = format!("{}: {name}=\"{}\" is not {expected}", describe(e), attribute.value);
            findings.at(rule, attribute.position, message);
        }
    }
}

fn fits(value: &str, kind: Type) -> Result<(), String> {
    let (good, expected) = match kind {
        Text => (true, String::new()),
        Bool => (parse_boolean(value).is_some(), "a boolean (true, false, 1 or 0)".into()),
        Int => (parse_integer::<i32>(value).is_some(), "a 32-bit integer".into()),
        Unsigned => (parse_integer::<u32>(value).is_some(), "an unsigned 32-bit integer".into()),
        Double => (parse_real(value).is_some(), "a number".into()),
        DateTime => (is_date_time(value), "a date and time such as 2009-12-08T14:33:22Z".into()),
        Keyword(keywords) => (keywords.contains(&value), format!("one of {}", keywords.join(", "))),
        UnsignedList => {
            (value.split_whitespace().all(|v| v.parse::<u32>().is_ok()), "a list of unsigned integers".into())
        }
        IntRange(low, high) => (is_integer(value, low, high), format!("a whole number from {low} to {high}")),
        UnsignedLong => (value.trim().parse::<u64>().is_ok(), "an unsigned 64-bit integer".into()),
        DoubleList => (value.split_whitespace().all(|v| parse_real(v).is_some()), "a list of numbers".into()),
        IntRangeList(low, high) => (
            value.split_whitespace().all(|v| is_integer(v, low, high)),
            format!("a list of whole numbers from {low} to {high}"),
        ),
        BoolList => (value.split_whitespace().all(|v| parse_boolean(v).is_some()), "a list of booleans".into()),
        Hex => (
            value.len().is_multiple_of(2) && value.bytes().all(|b| b.is_ascii_hexdigit()),
            "an even number of hexadecimal digits".into(),
        ),
        KeywordList(keywords) => {
            (value.split_whitespace().all(|v| keywords.contains(&v)), format!("a list of {}", keywords.join(", ")))
        }
    };
    if good { Ok(()) } else { Err(expected) }
}

fn is_integer(text: &str, low: i128, high: i128) -> bool {
    text.trim().parse::<i128>().is_ok_and(|value| (low..=high).contains(&value))
}

/// `xs:dateTime`: `-?YYYY-MM-DDThh:mm:ss(.s+)?(Z|[+-]hh:mm)?` with the ranges of the calendar.
fn is_date_time(text: &str) -> bool {
    fn parse(text: &str) -> Option<bool> {
        let text = text.trim();
        let (date, rest) = text.strip_prefix('-').unwrap_or(text).split_once('T')?;
        let mut date = date.split('-');
        let (year, month, day) = (date.next()?, date.next()?, date.next()?);
        let zone = rest.find(['Z', '+', '-']).unwrap_or(rest.len());
        let (time, zone) = rest.split_at(zone);
        let (time, fraction) = time.split_once('.').unwrap_or((time, "0"));
        let mut time = time.split(':');
        let (hour, minute, second) = (time.next()?, time.next()?, time.next()?);
        let two = |text: &str, most: u32| {
            let value: u32 = text.parse().ok()?;
            (text.len() == 2 && text.bytes().all(|b| b.is_ascii_digit()) && value <= most).then_some(value)
        };
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let (hour, minute, second) = (two(hour, 24)?, two(minute, 59)?, two(second, 59)?);
        let year_number: u64 = year.parse().ok()?;
        let multiple = |of: u64| year_number.is_multiple_of(of);
        let leap = multiple(4) && (!multiple(100) || multiple(400));
        let month = two(month, 12)?;
        let last = match month {
            0 => return None,
            2 if leap => 29,
            2 => 28,
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        };
        let zone_good = match zone.split_at_checked(1) {
            None => true,
            Some(("Z", rest)) => rest.is_empty(),
            Some((_, rest)) => {
                let (h, m) = rest.split_once(':')?;
                two(h, 14)? < 14 && two(m, 59).is_some() || rest == "14:00"
            }
        };
        Some(
            year.len() >= 4
                && digits(year)
                && two(day, last)? > 0
                && date.next().is_none()
                && time.next().is_none()
                && digits(fraction)
                && (hour < 24 || minute == 0 && second == 0)
                && zone_good,
        )
    }
    parse(text).unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_follow_the_xml_schema() {
        for good in [
            "2009-12-08T14:33:22Z",
            "2024-02-29T00:00:00",
            "2009-12-08T14:33:22.125Z",
            "2009-12-08T14:33:22+02:00",
            "2009-12-08T24:00:00-14:00",
            "12009-12-08T14:33:22Z",
        ] {
            assert!(is_date_time(good), "{good}");
        }
        for bad in [
            "",
            "2009-12-08",
            "2009-12-08 14:33:22",
            "2009-13-08T14:33:22Z",
            "2023-02-29T00:00:00Z",
            "2009-12-08T25:00:00Z",
            "2009-12-08T14:33Z",
            "09-12-08T14:33:22Z",
            "2009-12-08T14:33:22.Z",
            "2009-12-08T14:33:22+2:00",
            "2009-12-00T14:33:22Z",
            "2009-12-08T14:33:22Zulu",
        ] {
            assert!(!is_date_time(bad), "{bad}");
        }
    }
}
