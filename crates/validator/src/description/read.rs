//! From XML elements to the types of a description; values that cannot be understood fall back to their defaults.

use std::str::FromStr;

use super::super::xml::{Element, Position};
use super::{
    BaseType, BaseUnit, Causality, DefaultExperiment, Description, DisplayUnit, Fmi, Interface, ModelStructure,
    SI_BASE, SimpleType, TypeAttributes, Unit, Unknown, Value, Variability, Variable,
};

/// Parses an `xs:boolean`.
#[must_use]
pub fn parse_boolean(text: &str) -> Option<bool> {
    match text.trim() {
        "true" | "1" => Some(true),
        "false" | "0" => Some(false),
        _ => None,
    }
}

/// Parses an `xs:double`.
#[must_use]
pub fn parse_real(text: &str) -> Option<f64> {
    match text.trim() {
        "INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        "NaN" => Some(f64::NAN),
        number if number.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b)) => number.parse().ok(),
        _ => None,
    }
}

/// Parses an `xs:int` or one of its unsigned relatives of XML Schema.
#[must_use]
pub fn parse_integer<T: FromStr>(text: &str) -> Option<T> {
    text.trim().parse().ok()
}

pub(super) fn within<'a>(root: &'a Element, section: &str, item: &'a str) -> impl Iterator<Item = &'a Element> {
    root.child(section).into_iter().flat_map(move |s| s.children_named(item))
}

pub(super) fn text(element: &Element, name: &str) -> Option<String> {
    element.get(name).map(str::to_owned)
}

pub(super) fn real(element: &Element, name: &str) -> Option<f64> {
    element.get(name).and_then(parse_real)
}

pub(super) fn number<T: FromStr>(element: &Element, name: &str) -> Option<T> {
    element.get(name).and_then(parse_integer)
}

pub(super) fn flag(element: &Element, name: &str) -> bool {
    element.get(name).and_then(parse_boolean).unwrap_or(false)
}

pub(super) fn interface(e: &Element) -> Interface {
    Interface {
        model_identifier: text(e, "modelIdentifier").unwrap_or_default(),
        needs_execution_tool: flag(e, "needsExecutionTool"),
        can_handle_variable_step_size: flag(e, "canHandleVariableCommunicationStepSize"),
        can_interpolate_inputs: flag(e, "canInterpolateInputs"),
        max_output_derivative_order: number(e, "maxOutputDerivativeOrder").unwrap_or(0),
        can_run_asynchronuously: flag(e, "canRunAsynchronuously"),
        only_once: flag(e, "canBeInstantiatedOnlyOncePerProcess"),
        no_memory_callbacks: flag(e, "canNotUseMemoryManagementFunctions"),
        can_get_and_set_state: flag(e, "canGetAndSetFMUstate"),
        can_serialize_state: flag(e, "canSerializeFMUstate"),
        provides_directional_derivative: flag(e, "providesDirectionalDerivative"),
        source_files: within(e, "SourceFiles", "File")
            .map(|f| (text(f, "name").unwrap_or_default(), f.position))
            .collect(),
        has_event_mode: false,
        might_return_early: false,
        fixed_step: None,
        untested: Vec::new(),
        position: e.position,
    }
}

/// What both versions write alike: the root's attributes, units, log categories and default experiment; `token` is
/// the version's name of the attribute that binary and XML have in common. The rest is empty.
pub(super) fn head(root: &Element, fmi: Fmi, token: &str) -> Description {
    Description {
        fmi,
        fmi_version: text(root, "fmiVersion").unwrap_or_default(),
        model_name: text(root, "modelName").unwrap_or_default(),
        guid: text(root, token).unwrap_or_default(),
        description: text(root, "description"),
        author: text(root, "author"),
        version: text(root, "version"),
        copyright: text(root, "copyright"),
        license: text(root, "license"),
        generation_tool: text(root, "generationTool"),
        generation_date_and_time: text(root, "generationDateAndTime"),
        structured_names: root.get("variableNamingConvention") == Some("structured"),
        number_of_event_indicators: 0,
        co_simulation: None,
        model_exchange: None,
        units: within(root, "UnitDefinitions", "Unit").map(unit).collect(),
        types: Vec::new(),
        log_categories: log_categories(root),
        default_experiment: root.child("DefaultExperiment").map(|e| DefaultExperiment {
            start_time: real(e, "startTime"),
            stop_time: real(e, "stopTime"),
            tolerance: real(e, "tolerance"),
            step_size: real(e, "stepSize"),
            position: e.position,
        }),
        vendor_tools: Vec::new(),
        variables: Vec::new(),
        structure: ModelStructure::default(),
        clocks: Vec::new(),
    }
}

fn log_categories(root: &Element) -> Vec<(String, Option<String>, Position)> {
    within(root, "LogCategories", "Category")
        .map(|e| (text(e, "name").unwrap_or_default(), text(e, "description"), e.position))
        .collect()
}

fn unit(e: &Element) -> Unit {
    let base = e.child("BaseUnit").map(|b| BaseUnit {
        exponents: SI_BASE.map(|name| number(b, name).unwrap_or(0)),
        factor: real(b, "factor").unwrap_or(1.0),
        offset: real(b, "offset").unwrap_or(0.0),
    });
    let display = e.children_named("DisplayUnit").map(|d| DisplayUnit {
        name: text(d, "name").unwrap_or_default(),
        factor: real(d, "factor").unwrap_or(1.0),
        offset: real(d, "offset").unwrap_or(0.0),
        position: d.position,
    });
    Unit { name: text(e, "name").unwrap_or_default(), base, display: display.collect(), position: e.position }
}

pub(super) fn type_element(e: &Element) -> Option<(BaseType, &Element)> {
    e.children.iter().find_map(|child| Some((child.name.parse().ok()?, child)))
}

/// The attributes of a type; `integer` reads the values of an enumeration's items, which the versions write differently.
pub(super) fn type_attributes(base: BaseType, e: &Element, integer: fn(&str) -> Option<i64>) -> TypeAttributes {
    TypeAttributes {
        base,
        quantity: text(e, "quantity"),
        unit: text(e, "unit"),
        display_unit: text(e, "displayUnit"),
        relative_quantity: flag(e, "relativeQuantity"),
        min: real(e, "min"),
        max: real(e, "max"),
        nominal: real(e, "nominal"),
        items: e
            .children_named("Item")
            .map(|i| (text(i, "name").unwrap_or_default(), i.get("value").and_then(integer).unwrap_or(0), i.position))
            .collect(),
        position: e.position,
    }
}

pub(super) fn simple_type(e: &Element) -> Option<SimpleType> {
    let (base, inner) = type_element(e)?;
    let attributes = type_attributes(base, inner, parse_integer);
    Some(SimpleType { name: text(e, "name").unwrap_or_default(), attributes, position: e.position })
}

pub(super) fn variable(e: &Element) -> Variable {
    let (base, inner) = type_element(e).unwrap_or((BaseType::Real, e));
    let start = inner.get("start").and_then(|start| match base {
        BaseType::Real => parse_real(start).map(Value::Real),
        BaseType::Integer | BaseType::Enumeration => parse_integer::<i32>(start).map(|i| Value::Integer(i.into())),
        BaseType::Boolean => parse_boolean(start).map(Value::Boolean),
        BaseType::String => Some(Value::String(start.to_owned())),
    });
    Variable {
        name: text(e, "name").unwrap_or_default(),
        value_reference: number(e, "valueReference").unwrap_or(u32::MAX),
        description: text(e, "description"),
        causality: keyword(e, "causality").unwrap_or(Causality::Local),
        variability: keyword(e, "variability").unwrap_or(Variability::Continuous),
        declared_initial: keyword(e, "initial"),
        can_handle_multiple_set: e.get("canHandleMultipleSetPerTimeInstant").and_then(parse_boolean),
        attributes: type_attributes(base, inner, parse_integer),
        declared_type: text(inner, "declaredType"),
        has_start: inner.get("start").is_some(),
        start,
        derivative: number(inner, "derivative"),
        reinit: flag(inner, "reinit"),
        cell: None,
        position: e.position,
    }
}

pub(super) fn keyword<T: FromStr>(e: &Element, name: &str) -> Option<T> {
    e.get(name).and_then(|text| text.parse().ok())
}

pub(super) fn unknown(e: &Element) -> Unknown {
    let list = |name: &str| e.get(name).map(|text| text.split_whitespace().collect::<Vec<_>>());
    let index = number(e, "index").unwrap_or(0);
    Unknown {
        index,
        reference: index,
        dependencies: list("dependencies").map(|l| l.iter().filter_map(|i| i.parse().ok()).collect()),
        kinds: list("dependenciesKind").map(|l| l.iter().filter_map(|k| k.parse().ok()).collect()),
        position: e.position,
    }
}
