//! Rules on units and type definitions (FMI 2.0.4, sections 2.2.2 and 2.2.3).

use std::collections::{HashMap, HashSet};

use super::super::description::{BaseType, Description, Fmi, TypeAttributes};
use super::super::xml::Position;
use super::finding::Findings;
use super::id;

/// Checks units, display units, and type definitions with their uses.
pub(super) fn check(d: &Description, findings: &mut Findings) {
    definitions(d, findings);
    known_factors(d, findings);
    types(d, findings);
    let units: HashMap<&str, HashSet<&str>> =
        d.units.iter().map(|u| (u.name.as_str(), u.display.iter().map(|x| x.name.as_str()).collect())).collect();
    for t in &d.types {
        use_of_unit(&units, &format!("type \"{}\"", t.name), &t.attributes, &t.attributes, findings);
    }
    for v in &d.variables {
        let who = format!("variable \"{}\"", v.name);
        use_of_unit(&units, &who, &v.attributes, &d.resolved(v), findings);
        let Some(name) = &v.declared_type else { continue };
        match d.type_of(v) {
            None => {
                let kind = if d.fmi == Fmi::Three { "type" } else { "SimpleType" };
                findings.at(id::TYPE_UNDECLARED, v.attributes.position, format!("{who}: no {kind} \"{name}\""));
            }
            // By its name in FMI 3.0: see `three`.
            Some(t) if d.fmi == Fmi::Two && t.attributes.base != v.base() => {
                let message =
                    format!("{who} is of type {}, its declared type \"{name}\" of {}", v.base(), t.attributes.base);
                findings.at(id::TYPE_MISMATCH, v.attributes.position, message);
            }
            Some(_) => {}
        }
    }
}

fn duplicates<'a>(names: impl Iterator<Item = (&'a str, Position)>) -> Vec<(&'a str, Position)> {
    let mut seen = HashSet::new();
    names.filter(|(name, _)| !seen.insert(*name)).collect()
}

fn definitions(d: &Description, findings: &mut Findings) {
    for (name, position) in duplicates(d.units.iter().map(|u| (u.name.as_str(), u.position))) {
        findings.at(id::UNIT_UNIQUE, position, format!("a second unit \"{name}\""));
    }
    for u in &d.units {
        for (name, position) in duplicates(u.display.iter().map(|x| (x.name.as_str(), x.position))) {
            findings.at(id::UNIT_UNIQUE, position, format!("unit \"{}\": a second display unit \"{name}\"", u.name));
        }
        if u.base.is_some_and(|b| b.factor == 0.0 || !b.factor.is_finite() || !b.offset.is_finite()) {
            let message = format!("unit \"{}\": the factor or offset cannot be inverted", u.name);
            findings.at(id::UNIT_CONVERSION, u.position, message);
        }
        for x in u.display.iter().filter(|x| x.factor == 0.0 || !x.factor.is_finite() || !x.offset.is_finite()) {
            let message = format!("display unit \"{}\": the factor or offset cannot be inverted", x.name);
            findings.at(id::UNIT_CONVERSION, x.position, message);
        }
    }
}

/// Names of units that mean one thing, with their factor to the unit of the SI without a prefix (The International System of
/// Units, 9th edition, tables 4, 7 and 8; a revolution a minute is 2 pi rad in 60 s).
const KNOWN: [(&str, f64); 19] = [
    ("um", 1e-6),
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("km", 1e3),
    ("ms", 1e-3),
    ("min", 60.0),
    ("h", 3600.0),
    ("deg", std::f64::consts::PI / 180.0),
    ("mN", 1e-3),
    ("kN", 1e3),
    ("kW", 1e3),
    ("MW", 1e6),
    ("mbar", 1e2),
    ("kPa", 1e3),
    ("bar", 1e5),
    ("MPa", 1e6),
    ("km/h", 1.0 / 3.6),
    ("rpm", std::f64::consts::PI / 30.0),
    ("rev/min", std::f64::consts::PI / 30.0),
];

/// Factors that contradict the unit's name: "unit_value * factor + offset" gives the value in base units and in the display
/// unit (section 2.2.2). Printed factors are rounded.
fn known_factors(d: &Description, findings: &mut Findings) {
    let known = |name: &str| KNOWN.iter().find(|k| k.0 == name).map(|k| k.1);
    let apart = |a: f64, b: f64| (a - b).abs() > 0.01 * b.abs();
    for u in &d.units {
        // Without base units nobody converts, and a name may mean anything.
        let Some(base) = u.base.filter(|b| b.exponents.iter().any(|e| *e != 0)) else { continue };
        if let Some(factor) = known(&u.name).filter(|factor| apart(base.factor, *factor)) {
            let message = format!("unit \"{}\": the factor to base units is {}, not {factor}", u.name, base.factor);
            findings.at(id::UNIT_KNOWN, u.position, message);
            continue;
        }
        for x in u.display.iter().filter(|x| x.factor != 0.0) {
            let Some(factor) = known(&x.name).map(|factor| base.factor / factor) else { continue };
            if apart(x.factor, factor) {
                let message = format!(
                    "display unit \"{}\" of \"{}\": the factor is {}, not {factor} (the display value is the value times it)",
                    x.name, u.name, x.factor
                );
                findings.at(id::UNIT_KNOWN, x.position, message);
            }
        }
    }
}

fn types(d: &Description, findings: &mut Findings) {
    for (name, position) in duplicates(d.types.iter().map(|t| (t.name.as_str(), t.position))) {
        findings.at(id::TYPE_UNIQUE, position, format!("a second type \"{name}\""));
    }
    let variables: HashSet<&str> = d.variables.iter().map(|v| v.name.as_str()).collect();
    for t in d.types.iter().filter(|t| variables.contains(t.name.as_str())) {
        let message = format!("the type \"{}\" has the name of a variable", t.name);
        findings.at(id::TYPE_UNIQUE, t.position, message);
    }
    for t in d.types.iter().filter(|t| t.attributes.base == BaseType::Enumeration) {
        let mut values = HashSet::new();
        let mut names = HashSet::new();
        for (name, value, position) in &t.attributes.items {
            if !values.insert(*value) || !names.insert(name.as_str()) {
                let message = format!("type \"{}\": a second item named \"{name}\" or of value {value}", t.name);
                findings.at(id::ENUMERATION_ITEMS, *position, message);
            }
        }
    }
}

/// `own` are the variable's attributes, `resolved` the same completed by those of its type definition.
fn use_of_unit(
    units: &HashMap<&str, HashSet<&str>>,
    who: &str,
    own: &TypeAttributes,
    resolved: &TypeAttributes,
    findings: &mut Findings,
) {
    if let Some(unit) = &own.unit
        && !units.contains_key(unit.as_str())
    {
        findings.at(id::UNIT_UNDECLARED, own.position, format!("{who}: no Unit \"{unit}\" in UnitDefinitions"));
        return;
    }
    let Some(display) = &own.display_unit else { return };
    let message = match &resolved.unit {
        None => format!("{who} has a displayUnit \"{display}\" but no unit"),
        Some(unit) => match units.get(unit.as_str()) {
            // A unit may be its own display unit.
            Some(known) if !known.contains(display.as_str()) && unit != display => {
                format!("{who}: unit \"{unit}\" defines no DisplayUnit \"{display}\"")
            }
            _ => return,
        },
    };
    findings.at(id::DISPLAY_UNIT, own.position, message);
}
