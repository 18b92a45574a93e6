//! Rules on the model structure (FMI 2.0.4, section 2.2.8).

use std::collections::{BTreeSet, HashSet};

use super::super::description::{
    BaseType, Causality, DependencyKind, Description, Fmi, Initial, Unknown, Variability, Variable,
};
use super::finding::Findings;
use super::{Id, id};

/// Checks the model structure.
pub(super) fn check(d: &Description, findings: &mut Findings) {
    let s = &d.structure;
    let mut valid = true;
    for (section, list) in
        [("Outputs", &s.outputs), ("Derivatives", &s.derivatives), ("InitialUnknowns", &s.initial_unknowns)]
    {
        let mut seen = HashSet::new();
        for unknown in list {
            if d.by_index(unknown.index).is_none() {
                let last = d.variables.len();
                let message = match d.fmi {
                    Fmi::Two => format!("{section}: index {} is not from 1 to {last}", unknown.index),
                    Fmi::Three => format!("{section}: no variable has the value reference {}", unknown.reference),
                };
                findings.at(id::STRUCTURE_INDEX, unknown.position, message);
                valid = false;
            } else if !seen.insert(unknown.index) {
                let message = format!("{section}: \"{}\" is listed twice", name(d, unknown.index));
                findings.at(id::STRUCTURE_DUPLICATE, unknown.position, message);
            }
            // By value reference, and in any order, in FMI 3.0: see `three`.
            if d.fmi == Fmi::Two {
                dependencies(d, section, unknown, findings);
            }
        }
    }
    if valid {
        outputs(d, findings);
        derivatives(d, findings);
        initial_unknowns(d, findings);
    }
}

fn name(d: &Description, index: u32) -> &str {
    d.by_index(index).map_or("?", |v| &v.name)
}

fn indices(d: &Description, wanted: impl Fn(&Variable) -> bool) -> BTreeSet<u32> {
    (1..).zip(&d.variables).filter(|(_, v)| wanted(v)).map(|(i, _)| i).collect()
}

/// Reports the difference between what a section lists and what it must.
fn compare(d: &Description, section: &str, rule: Id, list: &[Unknown], must: &BTreeSet<u32>, f: &mut Findings) {
    let listed: BTreeSet<u32> = list.iter().map(|u| u.index).collect();
    let missing: Vec<&str> = must.difference(&listed).map(|&i| name(d, i)).collect();
    if !missing.is_empty() {
        let message = format!("{section} lacks {}", shorten(&missing));
        f.at(rule, list.first().map_or(d.structure.position, |u| u.position), message);
    }
    for unknown in list.iter().filter(|u| !must.contains(&u.index)) {
        f.at(
            rule,
            unknown.position,
            format!("{section} lists \"{}\", which does not belong there", name(d, unknown.index)),
        );
    }
}

fn shorten(names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(8).map(|n| format!("\"{n}\"")).collect();
    match names.len().saturating_sub(8) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

fn outputs(d: &Description, findings: &mut Findings) {
    let must = indices(d, |v| v.causality == Causality::Output);
    compare(d, "Outputs", id::STRUCTURE_OUTPUTS, &d.structure.outputs, &must, findings);
}

fn derivatives(d: &Description, findings: &mut Findings) {
    let have = indices(d, |v| v.derivative.is_some());
    for unknown in d.structure.derivatives.iter().filter(|u| !have.contains(&u.index)) {
        let message = format!("Derivatives lists \"{}\", which has no derivative attribute", name(d, unknown.index));
        findings.at(id::STRUCTURE_DERIVATIVES, unknown.position, message);
    }
}

fn initial_unknowns(d: &Description, findings: &mut Findings) {
    let list = &d.structure.initial_unknowns;
    let open = |v: &Variable| matches!(v.initial(), Some(Initial::Approx | Initial::Calculated));
    let mut must =
        indices(d, |v| v.causality == Causality::CalculatedParameter || v.causality == Causality::Output && open(v));
    for unknown in &d.structure.derivatives {
        let state = d.by_index(unknown.index).and_then(|v| v.derivative);
        for index in [Some(unknown.index), state].into_iter().flatten() {
            if d.by_index(index).is_some_and(open) {
                must.insert(index);
            }
        }
    }
    // An alias of a listed variable is the same unknown.
    let key = |i: &u32| d.by_index(*i).map(|v| (v.base(), v.value_reference));
    let listed: HashSet<_> = list.iter().map(|u| key(&u.index)).collect();
    let present: HashSet<u32> = list.iter().map(|u| u.index).collect();
    let output = |i: &u32| d.by_index(*i).is_some_and(|v| v.causality == Causality::Output);
    must.retain(|i| present.contains(i) || output(i) || !listed.contains(&key(i)));
    if list.is_empty() && !must.is_empty() {
        let names: Vec<&str> = must.iter().map(|&i| name(d, i)).collect();
        let message = format!("there are no InitialUnknowns; {} belong there", shorten(&names));
        findings.at(id::STRUCTURE_INITIAL_UNKNOWNS_ABSENT, d.structure.position, message);
        return;
    }
    compare(d, "InitialUnknowns", id::STRUCTURE_INITIAL_UNKNOWNS, list, &must, findings);
    if let Some(pair) = list.windows(2).find(|pair| d.fmi == Fmi::Two && pair[0].index > pair[1].index) {
        let message = format!(
            "InitialUnknowns: \"{}\" (index {}) comes after \"{}\" (index {}); they go by index",
            name(d, pair[1].index),
            pair[1].index,
            name(d, pair[0].index),
            pair[0].index
        );
        findings.at(id::STRUCTURE_ORDER, pair[1].position, message);
    }
}

fn dependencies(d: &Description, section: &str, unknown: &Unknown, findings: &mut Findings) {
    let who = format!("{section}, \"{}\"", name(d, unknown.index));
    if let Some(kinds) = &unknown.kinds {
        let count = unknown.dependencies.as_ref().map(Vec::len);
        if count != Some(kinds.len()) {
            let count = count.map_or("no dependencies attribute".into(), |n| format!("{n} dependencies"));
            let message = format!("{who}: {} dependenciesKind for {count}", kinds.len());
            findings.at(id::DEPENDENCIES_KIND, unknown.position, message);
        } else {
            kind_of_type(d, section, unknown, kinds, &who, findings);
        }
    }
    let Some(list) = &unknown.dependencies else { return };
    let mut seen = HashSet::new();
    for &index in list {
        let Some(known) = d.by_index(index) else {
            let message = format!("{who}: dependency {index} is not from 1 to {}", d.variables.len());
            findings.at(id::DEPENDENCIES_INDEX, unknown.position, message);
            return;
        };
        if !seen.insert(index) {
            findings.at(id::DEPENDENCIES_INDEX, unknown.position, format!("{who}: dependency {index} is listed twice"));
            return;
        }
        if !is_known(d, section, known) {
            let message = format!("{who}: \"{}\" is {} and no known of this section", known.name, known.causality);
            findings.at(id::DEPENDENCIES_KNOWN, unknown.position, message);
        }
    }
    if let Some(pair) = list.windows(2).find(|pair| pair[0] > pair[1]) {
        let message = format!("{who}: dependency {} comes after {}; they go by index", pair[1], pair[0]);
        findings.at(id::DEPENDENCIES_ORDER, unknown.position, message);
    }
}

fn kind_of_type(
    d: &Description,
    section: &str,
    unknown: &Unknown,
    kinds: &[DependencyKind],
    who: &str,
    f: &mut Findings,
) {
    let real = |v: Option<&Variable>| v.is_some_and(|v| v.base() == BaseType::Real);
    for (kind, &known) in kinds.iter().zip(unknown.dependencies.iter().flatten()) {
        if *kind == DependencyKind::Dependent || d.by_index(known).is_none() {
            continue;
        }
        let message = if section == "InitialUnknowns" && *kind != DependencyKind::Constant {
            format!("{who}: the kind {kind} is not for InitialUnknowns")
        } else if !real(d.by_index(unknown.index)) || !real(d.by_index(known)) {
            format!("{who}: the kind {kind} is for Real variables")
        } else {
            continue;
        };
        f.at(id::DEPENDENCIES_KIND_REAL, unknown.position, message);
    }
}

/// Whether a variable may be among the dependencies of a section.
fn is_known(d: &Description, section: &str, known: &Variable) -> bool {
    match known.causality {
        Causality::Input | Causality::Independent => true,
        _ if known.variability == Variability::Constant => false,
        _ if section == "InitialUnknowns" => known.initial() == Some(Initial::Exact),
        Causality::Parameter | Causality::CalculatedParameter | Causality::StructuralParameter => false,
        // States are known where they are exposed by valid entries; else any variable may be a state.
        _ => {
            let state = |u: &Unknown| d.by_index(d.by_index(u.index)?.derivative?);
            let states: Vec<Option<&Variable>> = d.structure.derivatives.iter().map(state).collect();
            let valid = |x: &Option<&Variable>| {
                x.is_some_and(|x| x.base() == BaseType::Real && x.variability == Variability::Continuous)
            };
            let listed = |x: &&Variable| x.name == known.name || x.value_reference == known.value_reference;
            states.is_empty() || !states.iter().all(valid) || states.iter().flatten().any(listed)
        }
    }
}
