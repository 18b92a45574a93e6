//! `eixo info` of an FMI 3.0 FMU: what its XML says, of whatever type its variables are.

use std::fmt::Write as _;

use serde_json::{Value as Json, json};

use super::info::{self, Platforms, fact, plain};
use crate::fmu::xml::Element;

/// The interfaces of FMI 3.0 (section 2.4.1).
const INTERFACES: [(&str, &str); 3] = [
    ("CoSimulation", "co-simulation"),
    ("ModelExchange", "model exchange"),
    ("ScheduledExecution", "scheduled execution"),
];

/// A variable with the sizes of its dimensions, as the XML gives them.
fn dimensions(variable: &Element, all: &[Element]) -> String {
    let sizes: Vec<String> = variable
        .children_named("Dimension")
        .map(|d| match (d.get("start"), d.get("valueReference")) {
            (Some(size), _) => size.to_owned(),
            (None, Some(reference)) => {
                let named = all.iter().find(|v| v.get("valueReference") == Some(reference));
                named.and_then(|v| v.get("name")).map_or_else(|| format!("#{reference}"), str::to_owned)
            }
            (None, None) => "?".to_owned(),
        })
        .collect();
    if sizes.is_empty() { String::new() } else { format!("[{}]", sizes.join(", ")) }
}

/// Start value: an attribute, or elements for texts and bytes (FMI 3.0, section 2.4.7).
fn start(variable: &Element) -> String {
    match variable.get("start") {
        Some(start) => start.to_owned(),
        None => variable.children_named("Start").filter_map(|s| s.get("value")).collect::<Vec<_>>().join(" "),
    }
}

/// Causality and variability with the standard's defaults: local; continuous for floating-point numbers, else discrete.
fn kinds(variable: &Element) -> (&str, &str) {
    let causality = variable.get("causality").unwrap_or("local");
    let fixed = ["parameter", "calculatedParameter", "structuralParameter"].contains(&causality);
    let usual = match variable.name.as_str() {
        _ if fixed => "fixed",
        "Float32" | "Float64" => "continuous",
        _ => "discrete",
    };
    (causality, variable.get("variability").unwrap_or(usual))
}

fn variables<'a>(root: &'a Element, causality: &[String]) -> (Vec<&'a Element>, &'a [Element]) {
    let all = root.child("ModelVariables").map_or(&[][..], |v| &v.children);
    (all.iter().filter(|v| causality.is_empty() || causality.iter().any(|c| c == kinds(v).0)).collect(), all)
}

/// Capability flags that are set.
fn flags(interface: &Element) -> Vec<String> {
    let set = interface
        .attributes
        .iter()
        .filter(|a| a.name != "modelIdentifier" && !["false", "0"].contains(&a.value.as_str()));
    set.map(|a| if a.value == "true" || a.value == "1" { a.name.clone() } else { format!("{} {}", a.name, a.value) })
        .collect()
}

/// For a person.
pub(super) fn as_text(root: &Element, platforms: &Platforms, causality: &[String], width: u16) -> String {
    let mut out = String::new();
    let mut line = |name: &str, value: Option<&str>| {
        if let Some(value) = value.filter(|v| !v.is_empty()) {
            out.push_str(&fact(name, &plain(value), width));
        }
    };
    line("model", root.get("modelName"));
    line("", root.get("description"));
    line("FMI", root.get("fmiVersion"));
    for (element, name) in INTERFACES {
        if let Some(interface) = root.child(element) {
            line(name, interface.get("modelIdentifier"));
            line("", Some(&flags(interface).join(", ")));
        }
    }
    line("token", root.get("instantiationToken"));
    for name in ["version", "author", "license"] {
        line(name, root.get(name));
    }
    line("tool", root.get("generationTool"));
    line("generated", root.get("generationDateAndTime"));
    if let Some(e) = root.child("DefaultExperiment") {
        let parts: Vec<String> = e.attributes.iter().map(|a| format!("{} {}", a.name, a.value)).collect();
        line("experiment", Some(&parts.join(", ")));
    }
    for (at, (folder, files)) in platforms.iter().enumerate() {
        let files: Vec<String> =
            files.iter().map(|(name, size)| format!("{name} ({} kB)", size.div_ceil(1000))).collect();
        line(if at == 0 { "platforms" } else { "" }, Some(&format!("{folder}: {}", files.join(", "))));
    }
    let (shown, all) = variables(root, causality);
    let _ = writeln!(out, "\n{} of {} variables", shown.len(), all.len());
    let rows = shown.iter().map(|v| {
        let (causality, variability) = kinds(v);
        let type_ = format!("{}{}", v.name, dimensions(v, all));
        let [name, unit, description] = ["name", "unit", "description"].map(|a| v.get(a).unwrap_or(""));
        [name, &type_, causality, variability, &start(v), unit, description].map(plain)
    });
    out + &info::variables(&rows.collect::<Vec<_>>(), width)
}

/// For programs: the attributes as they stand.
pub(super) fn as_json(root: &Element, platforms: &Platforms, causality: &[String]) -> Json {
    let attributes = |e: &Element| -> serde_json::Map<String, Json> {
        e.attributes.iter().map(|a| (a.name.clone(), json!(a.value))).collect()
    };
    let (shown, all) = variables(root, causality);
    let variables: Vec<Json> = shown
        .iter()
        .map(|v| {
            let (causality, variability) = kinds(v);
            let mut entry = attributes(v);
            entry.extend([
                ("type".to_owned(), json!(v.name)),
                ("causality".to_owned(), json!(causality)),
                ("variability".to_owned(), json!(variability)),
                ("start".to_owned(), json!(start(v))),
                ("dimensions".to_owned(), json!(dimensions(v, all))),
            ]);
            Json::Object(entry)
        })
        .collect();
    let interfaces: serde_json::Map<String, Json> = INTERFACES
        .iter()
        .filter_map(|(element, _)| Some(((*element).to_owned(), Json::Object(attributes(root.child(element)?)))))
        .collect();
    json!({
        "schema": "eixo.info/1",
        "model": attributes(root),
        "interfaces": interfaces,
        "defaultExperiment": root.child("DefaultExperiment").map(attributes),
        "platforms": platforms.iter().map(|(folder, files)| json!({
            "platform": folder,
            "files": files.iter().map(|(name, size)| json!({ "name": name, "bytes": size })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "variables": variables,
    })
}
