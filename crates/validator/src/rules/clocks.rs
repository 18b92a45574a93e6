//! Clocks of FMI 3.0 as they are declared (section 2.2.8 and the clock attributes of section 2.4.7). What they do when they
//! tick is not tested.

use std::collections::HashMap;

use super::super::xml::Element;
use super::finding::Findings;
use super::id;

/// Checks the clocks, and the variables that name them.
pub(super) fn check(root: &Element, findings: &mut Findings) {
    let all: Vec<&Element> = root.child("ModelVariables").into_iter().flat_map(|v| &v.children).collect();
    let by_reference: HashMap<&str, &Element> =
        all.iter().filter_map(|v| Some((v.get("valueReference")?.trim(), *v))).collect();
    for &v in &all {
        let name = v.get("name").unwrap_or("");
        if v.name == "Clock"
            && let Some(why) = clock(v)
        {
            findings.at(id::CLOCK, v.position, format!("the clock \"{name}\": {why}"));
        }
        for reference in v.get("clocks").unwrap_or("").split_whitespace() {
            let why = match by_reference.get(reference) {
                None => "no variable has that value reference".to_owned(),
                Some(other) if other.name != "Clock" => format!("\"{}\" is no clock", other.get("name").unwrap_or("")),
                Some(_) => continue,
            };
            findings.at(id::CLOCK, v.position, format!("\"{name}\" belongs to the clock {reference}: {why}"));
        }
    }
    let has_clock = all.iter().any(|v| v.name == "Clock");
    if let Some(interface) = root.child("CoSimulation").filter(|_| has_clock)
        && !interface.get("hasEventMode").is_some_and(|flag| flag == "true" || flag == "1")
    {
        let message = "there are clocks, which tick in event mode, but hasEventMode is not true";
        findings.at(id::CLOCK, interface.position, message);
    }
}

/// What does not go together in a clock.
fn clock(v: &Element) -> Option<String> {
    let causality = v.get("causality").unwrap_or("local");
    let interval = v.get("intervalVariability").unwrap_or("");
    let flag = |name: &str| v.get(name).is_some_and(|flag| flag == "true" || flag == "1");
    let number = |name: &str| v.get(name).and_then(|n| n.trim().parse::<f64>().ok());
    if interval != "triggered" && causality != "input" {
        return Some(format!("one of causality {causality} is triggered, not {interval}"));
    }
    let counted = v.get("intervalCounter").is_some() && v.get("resolution").is_some();
    if interval == "constant" && v.get("intervalDecimal").is_none() && !counted {
        return Some("a constant interval is given by intervalDecimal, or intervalCounter and resolution".into());
    }
    if flag("supportsFraction") && v.get("resolution").is_none() {
        return Some("supportsFraction needs a resolution".into());
    }
    if number("intervalDecimal").is_some_and(|interval| interval <= 0.0 || !interval.is_finite()) {
        return Some("its intervalDecimal is not positive".into());
    }
    None
}
