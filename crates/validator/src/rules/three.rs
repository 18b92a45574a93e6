//! Rules of FMI 3.0 on the variables and the model structure as they stand in the XML, before arrays are taken apart
//! (sections 2.4.7 and 2.4.8).

use std::collections::{HashMap, HashSet};

use super::super::description::Kind;
use super::super::description::three::starts;
use super::super::xml::Element;
use super::finding::Findings;
use super::id;

/// A variable, by its element.
struct Named<'a> {
    element: &'a Element,
    kind: Kind,
    name: &'a str,
    reference: &'a str,
}

/// Checks variables and structure.
pub(super) fn check(root: &Element, findings: &mut Findings) {
    let all = variables(root);
    let by_reference: HashMap<&str, &Named<'_>> = all.iter().map(|v| (v.reference, v)).collect();
    let mut seen: HashMap<&str, &str> = HashMap::new();
    for v in &all {
        if let Some(first) = seen.insert(v.reference, v.name) {
            let message = format!("\"{first}\" and \"{}\" have the value reference {}", v.name, v.reference);
            findings.at(id::REFERENCE_UNIQUE, v.element.position, message);
        }
        dimensions(v, &by_reference, findings);
        declared_type(v, root, findings);
        derivative(v, &by_reference, findings);
    }
    // That there is not more than one is tested for both versions.
    if !all.iter().any(|v| v.element.get("causality") == Some("independent")) {
        let message = "no variable is independent, as the time is; FMI 3.0 asks for exactly one";
        findings.at(
            id::INDEPENDENT_VARIABLE,
            root.child("ModelVariables").map_or(root.position, |v| v.position),
            message,
        );
    }
    structure(root, &by_reference, findings);
}

fn variables(root: &Element) -> Vec<Named<'_>> {
    let all = root.child("ModelVariables").into_iter().flat_map(|v| &v.children);
    all.filter_map(|element| {
        let kind = element.name.parse::<Kind>().ok()?;
        let name = element.get("name").unwrap_or("");
        Some(Named { element, kind, name, reference: element.get("valueReference").unwrap_or("").trim() })
    })
    .collect()
}

fn dimensions(v: &Named<'_>, all: &HashMap<&str, &Named<'_>>, findings: &mut Findings) {
    let mut count = Some(1_u64);
    for d in v.element.children_named("Dimension") {
        let size = match (d.get("start"), d.get("valueReference")) {
            (Some(size), None) => size.trim().parse::<u64>().ok().filter(|n| *n > 0).ok_or("its size is 0".to_owned()),
            (None, Some(reference)) => size_of(all.get(reference.trim()).copied(), reference),
            (Some(_), Some(_)) => Err("it has both a start and a valueReference".to_owned()),
            (None, None) => Err("it has neither a start nor a valueReference".to_owned()),
        };
        match size {
            Ok(size) => count = count.and_then(|n| n.checked_mul(size)),
            Err(why) => {
                findings.at(id::DIMENSION, d.position, format!("a Dimension of \"{}\": {why}", v.name));
                count = None;
            }
        }
    }
    let Some(starts) = starts(v.element, v.kind) else { return };
    if let Some(count) = count
        && starts.len() as u64 != count
        && starts.len() != 1
    {
        let message = format!("\"{}\" has {} elements and {} start values", v.name, count, starts.len());
        findings.at(id::START_COUNT, v.element.position, message);
    }
}

fn size_of(of: Option<&Named<'_>>, reference: &str) -> Result<u64, String> {
    let Some(of) = of else { return Err(format!("no variable has the value reference {reference}")) };
    let structural = of.element.get("causality") == Some("structuralParameter");
    let constant = of.element.get("variability") == Some("constant");
    if of.kind != Kind::UInt64 || !(structural || constant) {
        return Err(format!("\"{}\" is no UInt64 that is a structural parameter or constant", of.name));
    }
    of.element
        .get("start")
        .and_then(|s| s.trim().parse().ok())
        .ok_or_else(|| format!("\"{}\" has no start value that is a size", of.name))
}

/// A declared type is of the variable's own type; that it exists is tested by another rule.
fn declared_type(v: &Named<'_>, root: &Element, findings: &mut Findings) {
    let Some(wanted) = v.element.get("declaredType") else { return };
    let mut types = root.child("TypeDefinitions").into_iter().flat_map(|t| &t.children);
    let Some(found) = types.find(|t| t.get("name") == Some(wanted)) else { return };
    if found.name.strip_suffix("Type") != Some(v.kind.keyword()) {
        let message = format!("\"{}\" is a {}, but its type \"{wanted}\" a {}", v.name, v.kind.keyword(), found.name);
        findings.at(id::TYPE_MISMATCH, v.element.position, message);
    }
}

fn derivative(v: &Named<'_>, all: &HashMap<&str, &Named<'_>>, findings: &mut Findings) {
    let Some(reference) = v.element.get("derivative") else { return };
    let floats = |kind: Kind| matches!(kind, Kind::Float32 | Kind::Float64);
    let why = match all.get(reference.trim()) {
        None => format!("no variable has the value reference {reference}"),
        Some(of) if of.reference == v.reference => "a variable is not its own derivative".to_owned(),
        Some(of) if !floats(of.kind) => format!("\"{}\" is no floating-point number", of.name),
        Some(of) if of.element.get("variability").is_some_and(|w| w != "continuous") => {
            format!("\"{}\" is not continuous", of.name)
        }
        Some(_) => return,
    };
    let message = format!("variable \"{}\" is the derivative of variable {reference}: {why}", v.name);
    findings.at(id::DERIVATIVE_INDEX, v.element.position, message);
}

fn structure(root: &Element, all: &HashMap<&str, &Named<'_>>, findings: &mut Findings) {
    for unknown in root.child("ModelStructure").into_iter().flat_map(|s| &s.children) {
        let reference = unknown.get("valueReference").unwrap_or("").trim();
        let name = all.get(reference).map_or(reference, |v| v.name);
        let who = format!("{}, \"{name}\"", unknown.name);
        let list = |name: &str| unknown.get(name).map(|text| text.split_whitespace().collect::<Vec<_>>());
        let (dependencies, kinds) = (list("dependencies"), list("dependenciesKind"));
        if let Some(kinds) = kinds
            && dependencies.as_ref().map(Vec::len) != Some(kinds.len())
        {
            let count = dependencies
                .as_ref()
                .map_or("no dependencies attribute".into(), |l| format!("{} dependencies", l.len()));
            let message = format!("{who}: {} dependenciesKind for {count}", kinds.len());
            findings.at(id::DEPENDENCIES_KIND, unknown.position, message);
        }
        let mut seen = HashSet::new();
        for dependency in dependencies.into_iter().flatten() {
            let why = match (all.contains_key(dependency), seen.insert(dependency)) {
                (false, _) => "no variable has that value reference",
                (true, false) => "it is listed twice",
                (true, true) => continue,
            };
            findings.at(id::DEPENDENCIES_INDEX, unknown.position, format!("{who}: dependency {dependency}: {why}"));
            break;
        }
    }
}
