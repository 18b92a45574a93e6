//! Rules on the root element, the interfaces, the default experiment and the lists other than that of the variables.

use std::collections::HashSet;

use super::super::description::{Description, Fmi, Interface};
use super::super::xml::{Element, Position};
use super::finding::Findings;
use super::names::is_c_identifier;
use super::{Id, id};

/// The version of FMI, where it is one with rules of its own.
pub(super) fn foreign(root: &Element) -> Option<&str> {
    let version = root.get("fmiVersion").filter(|_| root.name == "fmiModelDescription")?;
    (!version.trim().starts_with('2') && Fmi::of(version).is_none()).then_some(version)
}

/// Checks the root and its version; whether the rest is worth reading.
pub(super) fn root(root: &Element, findings: &mut Findings) -> bool {
    if root.name != "fmiModelDescription" {
        let message = format!("the root element is {}, not fmiModelDescription", root.name);
        findings.at(id::SCHEMA_ELEMENT, root.position, message);
        return false;
    }
    match root.get("fmiVersion") {
        Some("2.0") => true,
        Some(three) if Fmi::of(three) == Some(Fmi::Three) => {
            if !is_version_3(three) {
                let message = format!("fmiVersion is \"{three}\"; it is \"3.0\" for every FMI 3.0.x");
                findings.at(id::FMI_VERSION, root.position_of("fmiVersion"), message);
            }
            true
        }
        other => {
            let message = match other {
                Some(other) => format!("fmiVersion is \"{other}\"; it is \"2.0\" for every FMI 2.0.x"),
                None => "fmiVersion is missing; it is \"2.0\" for every FMI 2.0.x".into(),
            };
            findings.at(id::FMI_VERSION, root.position_of("fmiVersion"), message);
            true
        }
    }
}

/// Checks the attributes of the root element.
pub(super) fn check(d: &Description, root: &Element, findings: &mut Findings) {
    if d.guid.trim().is_empty() {
        let name = if d.fmi == Fmi::Three { "instantiationToken" } else { "guid" };
        let message = format!("the {name} is empty, so that it ties no binary to this file");
        findings.at(id::GUID, root.position_of(name), message);
    }
    if d.model_name.trim().is_empty() {
        findings.at(id::MODEL_NAME, root.position_of("modelName"), "the modelName is empty");
    }
    for (name, interface) in [("ModelExchange", &d.model_exchange), ("CoSimulation", &d.co_simulation)] {
        if let Some(interface) = interface {
            check_interface(name, interface, findings);
        }
    }
    experiment(d, findings);
    unique(id::LOG_CATEGORY, "log category", d.log_categories.iter().map(|c| (c.0.as_str(), c.2)), findings);
    if d.fmi == Fmi::Three {
        return;
    }
    let tools = root.child("VendorAnnotations");
    let tools =
        tools.into_iter().flat_map(|v| v.children_named("Tool")).map(|t| (t.get("name").unwrap_or(""), t.position));
    unique(id::VENDOR_TOOL, "vendor annotation of tool", tools, findings);
}

/// The pattern of the schema: `3[.](0|[1-9][0-9]*)([.](0|[1-9][0-9]*))?(-.+)?`.
fn is_version_3(text: &str) -> bool {
    let number = |part: &str| {
        !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit()) && (part == "0" || !part.starts_with('0'))
    };
    let (numbers, label) = text.split_once('-').map_or((text, None), |(numbers, label)| (numbers, Some(label)));
    let parts: Vec<&str> = numbers.split('.').collect();
    (2..=3).contains(&parts.len())
        && parts[0] == "3"
        && parts[1..].iter().all(|p| number(p))
        && label.is_none_or(|l| !l.is_empty())
}

fn unique<'a>(rule: Id, what: &str, names: impl Iterator<Item = (&'a str, Position)>, findings: &mut Findings) {
    let mut seen = HashSet::new();
    for (name, position) in names {
        if !seen.insert(name) {
            findings.at(rule, position, format!("a second {what} \"{name}\""));
        }
    }
}

fn check_interface(name: &str, interface: &Interface, findings: &mut Findings) {
    if !is_c_identifier(&interface.model_identifier) {
        let message = format!("{name}: modelIdentifier \"{}\" is no identifier of C", interface.model_identifier);
        findings.at(id::MODEL_IDENTIFIER, interface.position, message);
    }
    if interface.can_serialize_state && !interface.can_get_and_set_state {
        let message = format!("{name}: canSerializeFMUstate without canGetAndSetFMUstate");
        findings.at(id::CAPABILITY_SERIALIZE, interface.position, message);
    }
}

fn experiment(d: &Description, findings: &mut Findings) {
    let Some(e) = &d.default_experiment else { return };
    let mut complain = |message: String| findings.at(id::DEFAULT_EXPERIMENT, e.position, message);
    let start = e.start_time.unwrap_or(0.0);
    for (name, value) in
        [("startTime", e.start_time), ("stopTime", e.stop_time), ("tolerance", e.tolerance), ("stepSize", e.step_size)]
    {
        if value.is_some_and(|v| !v.is_finite()) {
            complain(format!("{name} is not finite"));
            return;
        }
    }
    if let Some(stop) = e.stop_time
        && stop <= start
    {
        complain(format!("stopTime {stop} is not after startTime {start}"));
    }
    if e.tolerance.is_some_and(|t| t <= 0.0) {
        complain(format!("tolerance {} is not positive", e.tolerance.unwrap_or(0.0)));
    }
    if let Some(step) = e.step_size {
        if step <= 0.0 {
            complain(format!("stepSize {step} is not positive"));
        } else if let Some(stop) = e.stop_time
            && stop > start
            && step > (stop - start) * (1.0 + 1e-9)
        {
            complain(format!("stepSize {step} is longer than the whole experiment"));
        }
    }
}
