//! `modelDescription.xml` of FMI 3.0 (section 2.4) as a [`Description`].
//!
//! An array is taken apart into its elements, row by row (section 2.2.6.1), each a variable of its own with a name such as
//! `A[2,3]`, so that all that is done with the scalar variables of FMI 2.0 is done with them. A [`Cell`] says where an element
//! comes from. Dimensions that a structural parameter gives are those of its start value. Clocks are no values: they stand
//! apart, and variables that belong to a clock are left out, because they may be read while it ticks only (section 2.2.6.2).

use std::collections::HashMap;

use super::super::xml::{Element, Position};
use super::read::{flag, head, keyword, number, parse_boolean, parse_real, real, text, type_attributes};
use super::{
    BaseType, Causality, DependencyKind, Description, Fmi, Interface, Kind, ModelStructure, SimpleType, TypeAttributes,
    Unknown, Value, Variability, Variable,
};

/// Where a scalar comes from: an element of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// Value reference of the variable.
    pub reference: u32,
    /// Its type.
    pub kind: Kind,
    /// Number of the element, from 0.
    pub at: usize,
    /// Number of elements.
    pub of: usize,
}

/// A clock (section 2.2.8), as declared.
#[derive(Debug, Clone)]
pub struct Clock {
    /// Name.
    pub name: String,
    /// Value reference.
    pub reference: u32,
    /// Direction.
    pub causality: Causality,
    /// `intervalVariability`.
    pub interval: String,
    /// Where.
    pub position: Position,
}

/// Most elements that an FMU's arrays are taken apart into.
const MOST: usize = 1_000_000;

/// The variables of an XML, before arrays are taken apart.
struct Raw<'a> {
    element: &'a Element,
    kind: Kind,
    reference: u32,
    sizes: Vec<usize>,
}

/// Variability, with the standard's defaults (section 2.4.7.4).
pub(in super::super) fn variability(e: &Element, kind: Kind, causality: Causality) -> Variability {
    keyword(e, "variability").unwrap_or(match kind {
        _ if matches!(
            causality,
            Causality::Parameter | Causality::CalculatedParameter | Causality::StructuralParameter
        ) =>
        {
            Variability::Fixed
        }
        Kind::Float32 | Kind::Float64 => Variability::Continuous,
        _ => Variability::Discrete,
    })
}

/// The start values of a variable as texts; none where it has none.
pub(in super::super) fn starts(e: &Element, kind: Kind) -> Option<Vec<String>> {
    match kind {
        Kind::String | Kind::Binary => {
            let texts: Vec<String> = e.children_named("Start").map(|s| text(s, "value").unwrap_or_default()).collect();
            (!texts.is_empty()).then_some(texts)
        }
        _ => e.get("start").map(|list| list.split_whitespace().map(str::to_owned).collect()),
    }
}

fn value(kind: Kind, text: &str) -> Option<Value> {
    Some(match kind.base() {
        // A 32-bit number reads as the 32-bit number that it is.
        BaseType::Real if kind == Kind::Float32 => Value::Real(f64::from(parse_real(text)? as f32)),
        BaseType::Real => Value::Real(parse_real(text)?),
        BaseType::Integer | BaseType::Enumeration => Value::Integer(integer(text)?),
        BaseType::Boolean => Value::Boolean(parse_boolean(text)?),
        BaseType::String if kind == Kind::Binary => Value::String(text.to_ascii_lowercase()),
        BaseType::String => Value::String(text.to_owned()),
    })
}

/// An integer. An unsigned one of 64 bits above the signed range wraps around, as it does in the call of the FMU.
fn integer(text: &str) -> Option<i64> {
    let text = text.trim();
    text.parse().ok().or_else(|| text.parse::<u64>().ok().map(|x| x as i64))
}

/// Sizes of the dimensions; those that a structural parameter gives are its start value.
pub(in super::super) fn sizes(e: &Element, all: &[Element]) -> Vec<usize> {
    e.children_named("Dimension")
        .map(|d| {
            let own: Option<usize> = number(d, "start");
            own.unwrap_or_else(|| {
                let reference = d.get("valueReference");
                let named = all.iter().find(|v| reference.is_some() && v.get("valueReference") == reference);
                named.and_then(|v| number(v, "start")).unwrap_or(0)
            })
        })
        .collect()
}

/// `[2,3]` of element `at` (from 0) of an array; nothing for a scalar.
fn indices(sizes: &[usize], at: usize) -> String {
    let mut left = at;
    let mut parts: Vec<String> = Vec::with_capacity(sizes.len());
    for size in sizes.iter().rev() {
        parts.push((left % size + 1).to_string());
        left /= size;
    }
    parts.reverse();
    if parts.is_empty() { String::new() } else { format!("[{}]", parts.join(",")) }
}

fn attributes(e: &Element, kind: Kind) -> TypeAttributes {
    type_attributes(kind.base(), e, integer)
}

fn interface(e: &Element) -> Interface {
    Interface {
        model_identifier: text(e, "modelIdentifier").unwrap_or_default(),
        needs_execution_tool: flag(e, "needsExecutionTool"),
        can_handle_variable_step_size: flag(e, "canHandleVariableCommunicationStepSize"),
        can_interpolate_inputs: false,
        max_output_derivative_order: number(e, "maxOutputDerivativeOrder").unwrap_or(0),
        can_run_asynchronuously: false,
        only_once: flag(e, "canBeInstantiatedOnlyOncePerProcess"),
        no_memory_callbacks: true,
        can_get_and_set_state: flag(e, "canGetAndSetFMUState"),
        can_serialize_state: flag(e, "canSerializeFMUState"),
        provides_directional_derivative: flag(e, "providesDirectionalDerivatives"),
        source_files: Vec::new(),
        has_event_mode: flag(e, "hasEventMode"),
        might_return_early: flag(e, "mightReturnEarlyFromDoStep"),
        fixed_step: real(e, "fixedInternalStepSize").filter(|h| *h > 0.0 && h.is_finite()),
        untested: [
            ("providesIntermediateUpdate", "intermediate update (4.2.2)"),
            ("canReturnEarlyAfterIntermediateUpdate", "early return on the importer's request (4.2.2)"),
            ("providesAdjointDerivatives", "adjoint derivatives (2.2.11)"),
            ("providesPerElementDependencies", "dependencies of single elements (2.2.10)"),
            ("providesEvaluateDiscreteStates", "fmi3EvaluateDiscreteStates (2.3.5)"),
        ]
        .into_iter()
        .filter(|(name, _)| flag(e, name))
        .map(|(_, what)| what)
        .collect(),
        position: e.position,
    }
}

/// A handle that no variable has, for each element after the first.
struct Handles {
    taken: std::collections::HashSet<u32>,
    next: u32,
}

impl Handles {
    fn take(&mut self) -> u32 {
        while self.taken.contains(&self.next) {
            self.next = self.next.wrapping_add(1);
        }
        self.taken.insert(self.next);
        self.next
    }
}

impl Description {
    /// Reads a description of FMI 3.0; see the module's head.
    pub(super) fn of_three(root: &Element) -> Self {
        let all: &[Element] = root.child("ModelVariables").map_or(&[], |v| &v.children);
        let mut left = MOST;
        let raw: Vec<Raw<'_>> = all
            .iter()
            .filter_map(|element| {
                let kind = element.name.parse().ok()?;
                let sizes = sizes(element, all);
                let count = sizes.iter().try_fold(1_usize, |n, size| n.checked_mul(*size)).filter(|n| *n <= left)?;
                left -= count;
                Some(Raw { element, kind, reference: number(element, "valueReference").unwrap_or(u32::MAX), sizes })
            })
            .collect();
        let clocks = raw.iter().filter(|r| r.kind == Kind::Clock).map(|r| Clock {
            name: text(r.element, "name").unwrap_or_default(),
            reference: r.reference,
            causality: keyword(r.element, "causality").unwrap_or(Causality::Local),
            interval: text(r.element, "intervalVariability").unwrap_or_default(),
            position: r.element.position,
        });
        let clocks: Vec<Clock> = clocks.collect();
        let clocked = |r: &Raw<'_>| r.element.get("clocks").is_some_and(|list| !list.trim().is_empty());
        let mut handles = Handles { taken: raw.iter().map(|r| r.reference).collect(), next: 0xE000_0000 };
        let mut variables = Vec::new();
        // Indices (from 1) of the elements of a value reference.
        let mut elements: HashMap<u32, Vec<u32>> = HashMap::new();
        for r in raw.iter().filter(|r| r.kind != Kind::Clock && !clocked(r)) {
            let first = variables.len();
            expand(r, &mut handles, &mut variables);
            elements.entry(r.reference).or_insert_with(|| {
                let count: usize = r.sizes.iter().product();
                (first..first + count).map(|i| i as u32 + 1).collect()
            });
        }
        // The state of a derivative, element by element.
        for r in &raw {
            let state = r.element.get("derivative").and_then(|d| d.trim().parse::<u32>().ok());
            let Some((own, states)) = elements.get(&r.reference).zip(state.and_then(|s| elements.get(&s))) else {
                continue;
            };
            for (&of, &state) in own.iter().zip(states) {
                variables[of as usize - 1].derivative = Some(state);
            }
        }
        let structure = root.child("ModelStructure");
        let silent: Vec<u32> =
            raw.iter().filter(|r| r.kind == Kind::Clock || clocked(r)).map(|r| r.reference).collect();
        let unknowns = |name: &str| -> Vec<Unknown> {
            let section = structure.into_iter().flat_map(|s| s.children_named(name));
            section.flat_map(|e| unknown(e, &elements, &silent)).collect()
        };
        Self {
            co_simulation: root.child("CoSimulation").map(interface),
            model_exchange: root.child("ModelExchange").map(interface),
            types: types(root),
            structure: ModelStructure {
                outputs: unknowns("Output"),
                derivatives: unknowns("ContinuousStateDerivative"),
                initial_unknowns: unknowns("InitialUnknown"),
                position: structure.map_or(root.position, |s| s.position),
            },
            variables,
            clocks,
            ..head(root, Fmi::Three, "instantiationToken")
        }
    }
}

fn types(root: &Element) -> Vec<SimpleType> {
    let all = root.child("TypeDefinitions").into_iter().flat_map(|t| &t.children);
    all.filter_map(|e| {
        let kind = e.name.strip_suffix("Type")?.parse().ok()?;
        Some(SimpleType {
            name: text(e, "name").unwrap_or_default(),
            attributes: attributes(e, kind),
            position: e.position,
        })
    })
    .collect()
}

/// The elements of a variable, and of its aliases.
fn expand(r: &Raw<'_>, handles: &mut Handles, variables: &mut Vec<Variable>) {
    let e = r.element;
    let count: usize = r.sizes.iter().product();
    let causality: Causality = keyword(e, "causality").unwrap_or(Causality::Local);
    let starts = starts(e, r.kind);
    let name = text(e, "name").unwrap_or_default();
    let first = variables.len();
    for at in 0..count {
        // A single start value is that of all elements.
        let start = starts.as_ref().and_then(|s| if s.len() == 1 { s.first() } else { s.get(at) });
        variables.push(Variable {
            name: name.clone() + &indices(&r.sizes, at),
            value_reference: if at == 0 { r.reference } else { handles.take() },
            description: text(e, "description"),
            causality,
            variability: variability(e, r.kind, causality),
            declared_initial: keyword(e, "initial"),
            can_handle_multiple_set: e.get("canHandleMultipleSetPerTimeInstant").and_then(parse_boolean),
            attributes: attributes(e, r.kind),
            declared_type: text(e, "declaredType"),
            has_start: starts.is_some(),
            start: start.and_then(|s| value(r.kind, s)),
            derivative: None,
            reinit: false,
            cell: Some(Cell { reference: r.reference, kind: r.kind, at, of: count }),
            position: e.position,
        });
    }
    // An alias is another name of the same value (section 2.4.7.3), without a place in the model structure.
    for alias in e.children_named("Alias") {
        let name = text(alias, "name").unwrap_or_default();
        for at in 0..count {
            let mut other = variables[first + at].clone();
            other.name = name.clone() + &indices(&r.sizes, at);
            other.description = text(alias, "description");
            other.attributes.display_unit = text(alias, "displayUnit");
            other.position = alias.position;
            other.causality = Causality::Local;
            other.declared_initial = Some(super::Initial::Calculated);
            (other.start, other.has_start) = (None, false);
            variables.push(other);
        }
    }
}

/// An entry of the model structure, for each element of its variable; none for clocks and what belongs to them.
fn unknown(e: &Element, elements: &HashMap<u32, Vec<u32>>, silent: &[u32]) -> Vec<Unknown> {
    let list = |name: &str| e.get(name).map(|text| text.split_whitespace().collect::<Vec<_>>());
    let kinds: Option<Vec<DependencyKind>> =
        list("dependenciesKind").map(|l| l.iter().filter_map(|k| k.parse().ok()).collect());
    let (mut dependencies, mut each) = (None, None);
    if let Some(references) = list("dependencies") {
        let (mut indices, mut repeated) = (Vec::new(), Vec::new());
        for (at, reference) in references.iter().enumerate() {
            let Some(found) = reference.parse().ok().and_then(|r: u32| elements.get(&r)) else { continue };
            indices.extend_from_slice(found);
            if let Some(kind) = kinds.as_ref().and_then(|k| k.get(at)) {
                repeated.extend(found.iter().map(|_| *kind));
            }
        }
        dependencies = Some(indices);
        each = kinds.map(|_| repeated);
    }
    let reference: u32 = number(e, "valueReference").unwrap_or(u32::MAX);
    let make = |index: u32| Unknown {
        index,
        reference,
        dependencies: dependencies.clone(),
        kinds: each.clone(),
        position: e.position,
    };
    match elements.get(&reference) {
        Some(indices) => indices.iter().map(|&i| make(i)).collect(),
        None if silent.contains(&reference) => Vec::new(),
        None => vec![make(0)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(variables: &str, structure: &str) -> Description {
        let xml = format!(
            "<fmiModelDescription fmiVersion=\"3.0\" modelName=\"m\" instantiationToken=\"t\"><CoSimulation \
             modelIdentifier=\"m\"/><ModelVariables>{variables}</ModelVariables><ModelStructure>{structure}\
             </ModelStructure></fmiModelDescription>"
        );
        Description::parse(xml.as_bytes()).unwrap()
    }

    #[test]
    fn an_array_is_taken_apart_row_by_row() {
        let d = read(
            "<UInt64 name=\"n\" valueReference=\"1\" causality=\"structuralParameter\" start=\"3\"/>\
             <Float64 name=\"A\" valueReference=\"7\" causality=\"parameter\" start=\"1 2 3 4 5 6\">\
             <Dimension start=\"2\"/><Dimension valueReference=\"1\"/></Float64>\
             <Float32 name=\"v\" valueReference=\"8\" causality=\"input\" start=\"0.1\"><Dimension start=\"2\"/></Float32>",
            "",
        );
        let names: Vec<&str> = d.variables.iter().map(|v| v.name.as_str()).collect();
        assert_eq!(names, ["n", "A[1,1]", "A[1,2]", "A[1,3]", "A[2,1]", "A[2,2]", "A[2,3]", "v[1]", "v[2]"]);
        assert_eq!(d.variables[4].start, Some(Value::Real(4.0)));
        assert_eq!(d.variables[4].cell, Some(Cell { reference: 7, kind: Kind::Float64, at: 3, of: 6 }));
        // One start value for all, of 32 bits.
        assert_eq!(d.variables[8].start, Some(Value::Real(f64::from(0.1_f32))));
        let handles: std::collections::HashSet<u32> = d.variables.iter().map(|v| v.value_reference).collect();
        assert_eq!(handles.len(), 9);
    }

    #[test]
    fn the_model_structure_is_told_by_elements_and_clocks_stand_apart() {
        let d = read(
            "<Float64 name=\"x\" valueReference=\"1\" causality=\"output\"><Dimension start=\"2\"/></Float64>\
             <Float64 name=\"dx\" valueReference=\"2\" derivative=\"1\"><Dimension start=\"2\"/></Float64>\
             <Clock name=\"c\" valueReference=\"3\" causality=\"output\" intervalVariability=\"triggered\"/>\
             <Int32 name=\"k\" valueReference=\"4\" causality=\"output\" clocks=\"3\"/>\
             <UInt64 name=\"u\" valueReference=\"5\" causality=\"input\" start=\"18446744073709551615\"/>",
            "<Output valueReference=\"1\" dependencies=\"5 3\" dependenciesKind=\"dependent constant\"/>\
             <Output valueReference=\"3\"/><Output valueReference=\"4\"/>\
             <ContinuousStateDerivative valueReference=\"2\" dependencies=\"1\" dependenciesKind=\"fixed\"/>\
             <InitialUnknown valueReference=\"99\"/>",
        );
        assert_eq!(d.clocks.len(), 1);
        assert!(d.variable("k").is_none());
        let outputs: Vec<u32> = d.structure.outputs.iter().map(|u| u.index).collect();
        assert_eq!(outputs, [1, 2]);
        assert_eq!(d.structure.outputs[0].dependencies, Some(vec![5]));
        assert_eq!(d.structure.derivatives[1].dependencies, Some(vec![1, 2]));
        assert_eq!(d.structure.derivatives[1].kinds.as_ref().unwrap().len(), 2);
        assert_eq!(d.variables[3].derivative, Some(2));
        assert_eq!(d.structure.initial_unknowns[0].index, 0);
        // The bits of 2^64 - 1.
        assert_eq!(d.variables[4].start, Some(Value::Integer(-1)));
    }
}
