//! Rules on the variables (FMI 2.0.4, section 2.2.7).

use std::collections::{HashMap, HashSet};

use super::super::description::{
    BaseType, Causality, Description, Fmi, Initial, Value, Variability, Variable, default_initial,
};
use super::finding::Findings;
use super::id;
use super::names;

/// Checks the variables.
pub(super) fn check(d: &Description, findings: &mut Findings) {
    unique_names(d, findings);
    let mut independent = 0;
    for v in &d.variables {
        let allowed = table(d.fmi, v, findings);
        if allowed {
            starts(v, findings);
        }
        ranges(d, v, findings);
        derivative(d, v, findings);
        if v.causality == Causality::Independent {
            independent += 1;
            if independent > 1 || v.base() != BaseType::Real {
                let message = format!("variable \"{}\": at most one variable is independent, and it is a Real", v.name);
                findings.at(id::INDEPENDENT_VARIABLE, v.position, message);
            }
        }
    }
    // In FMI 3.0 a second name is declared as one.
    if d.fmi == Fmi::Two {
        aliases(d, findings);
    }
}

fn unique_names(d: &Description, findings: &mut Findings) {
    let mut seen: HashMap<&str, &Variable> = HashMap::new();
    for v in &d.variables {
        if let Some(first) = seen.get(v.name.as_str()) {
            let message = format!("the variable name \"{}\" is already taken at {}", v.name, first.position);
            findings.at(id::VARIABLE_NAME_UNIQUE, v.position, message);
        } else {
            seen.insert(&v.name, v);
        }
        if v.name.trim().is_empty() {
            findings.at(id::VARIABLE_NAME, v.position, "a variable has no name");
        } else if d.structured_names && !names::is_structured(&v.name) {
            let message = format!("\"{}\" is not a name of the structured naming convention", v.name);
            findings.at(id::VARIABLE_NAME, v.position, message);
        }
    }
}

/// The table of causality, variability and initial. Whether the combination is allowed.
fn table(fmi: Fmi, v: &Variable, findings: &mut Findings) -> bool {
    use {Causality as C, Variability as V};
    let (causality, variability) = (v.causality, v.variability);
    if variability == V::Continuous && v.base() != BaseType::Real {
        let (name, base) = (&v.name, v.base());
        let message = match fmi {
            Fmi::Two => format!(
                "variable \"{name}\" is of type {base} and cannot be continuous, the default; declare its variability"
            ),
            Fmi::Three => format!("variable \"{name}\" is no floating-point number and cannot be continuous"),
        };
        findings.at(id::VARIABILITY_TYPE, v.position, message);
        return false;
    }
    let good = match causality {
        C::Parameter | C::CalculatedParameter | C::StructuralParameter => {
            matches!(variability, V::Fixed | V::Tunable)
        }
        C::Input => matches!(variability, V::Discrete | V::Continuous),
        C::Output => matches!(variability, V::Constant | V::Discrete | V::Continuous),
        C::Local => true,
        C::Independent => variability == V::Continuous,
    };
    if !good {
        let message = format!("variable \"{}\": {causality} and {variability} do not go together", v.name);
        findings.at(id::CAUSALITY_VARIABILITY, v.position, message);
        return false;
    }
    let Some(initial) = v.declared_initial else { return true };
    let allowed: &[Initial] = match default_initial(causality, variability) {
        None if fmi == Fmi::Three && causality == C::Input => &[Initial::Exact],
        None => &[],
        Some(Initial::Exact) => &[Initial::Exact],
        Some(_) if matches!(variability, V::Fixed | V::Tunable) => &[Initial::Calculated, Initial::Approx],
        Some(_) => &[Initial::Calculated, Initial::Exact, Initial::Approx],
    };
    if allowed.contains(&initial) {
        return true;
    }
    let may = match allowed {
        [] => "initial must not be given".to_owned(),
        _ => format!("initial may be {}", allowed.iter().map(|i| i.keyword()).collect::<Vec<_>>().join(" or ")),
    };
    let message = format!("variable \"{}\": initial=\"{initial}\" with {causality} and {variability}: {may}", v.name);
    findings.at(id::INITIAL, v.position, message);
    false
}

fn starts(v: &Variable, findings: &mut Findings) {
    let initial = v.initial();
    let needed = matches!(initial, Some(Initial::Exact | Initial::Approx)) || v.causality == Causality::Input;
    if needed && !v.has_start {
        let why = match initial {
            Some(initial) if v.causality != Causality::Input => format!("its initial is {initial}"),
            _ => "it is an input".to_owned(),
        };
        let message = format!("variable \"{}\" has no start value, which it needs because {why}", v.name);
        findings.at(id::START_MISSING, v.position, message);
    }
    if v.has_start && (initial == Some(Initial::Calculated) || v.causality == Causality::Independent) {
        let why = if v.causality == Causality::Independent { "it is independent" } else { "its initial is calculated" };
        let message = format!("variable \"{}\" has a start value, which it must not because {why}", v.name);
        findings.at(id::START_FORBIDDEN, v.attributes.position, message);
    }
}

fn ranges(d: &Description, v: &Variable, findings: &mut Findings) {
    let r = d.resolved(v);
    if let Some(name) = [("min", r.min), ("max", r.max)].iter().find(|(_, x)| x.is_some_and(f64::is_nan)).map(|x| x.0) {
        let message = format!("variable \"{}\": {name} is NaN, which bounds nothing", v.name);
        findings.at(id::MIN_MAX, v.attributes.position, message);
        return;
    }
    if let (Some(min), Some(max)) = (r.min, r.max)
        && min > max
    {
        let message = format!("variable \"{}\": min={min} is above max={max}", v.name);
        findings.at(id::MIN_MAX, v.attributes.position, message);
        return;
    }
    if r.nominal.is_some_and(|n| n.is_nan() || n <= 0.0) {
        let message = format!("variable \"{}\": nominal={} is not a magnitude", v.name, r.nominal.unwrap_or(0.0));
        findings.at(id::NOMINAL, v.attributes.position, message);
    }
    let start = match v.start {
        Some(Value::Real(x)) => x,
        Some(Value::Integer(i)) => i as f64,
        _ => return,
    };
    let low = r.min.is_some_and(|min| start < min);
    let high = r.max.is_some_and(|max| start > max);
    if low || high {
        let end = |x: Option<f64>| x.map_or("open".to_owned(), |x| x.to_string());
        let message = format!("variable \"{}\": start={start} outside min={}, max={}", v.name, end(r.min), end(r.max));
        findings.at(id::START_RANGE, v.attributes.position, message);
    } else if v.base() == BaseType::Enumeration && !r.items.is_empty() && !r.items.iter().any(|i| i.1 as f64 == start) {
        let message = format!("variable \"{}\": start={start} is no item of its enumeration", v.name);
        findings.at(id::START_RANGE, v.attributes.position, message);
    }
}

fn derivative(d: &Description, v: &Variable, findings: &mut Findings) {
    if v.reinit && d.model_exchange.is_none() {
        let message = format!("variable \"{}\": reinit is for model exchange alone", v.name);
        findings.at(id::REINIT, v.attributes.position, message);
    }
    let Some(index) = v.derivative else { return };
    let message = match d.by_index(index) {
        None => format!("the index runs from 1 to {}", d.variables.len()),
        Some(of) if of.base() != BaseType::Real => format!("\"{}\" is no Real", of.name),
        Some(of) if of.variability != Variability::Continuous => format!("\"{}\" is not continuous", of.name),
        Some(of) if of.name == v.name => "a variable is not its own derivative".to_owned(),
        Some(_) => return,
    };
    let message = format!("variable \"{}\" is the derivative of variable {index}: {message}", v.name);
    findings.at(id::DERIVATIVE_INDEX, v.attributes.position, message);
}

/// The unit of a variable as a comparable text.
fn unit_key(d: &Description, v: &Variable) -> Option<String> {
    let unit = d.resolved(v).unit?;
    let base = d.units.iter().find(|u| u.name == unit).and_then(|u| u.base);
    Some(base.map_or(unit, |b| format!("{:?}", b.exponents)))
}

fn aliases(d: &Description, findings: &mut Findings) {
    let class = |v: &Variable| match v.base() {
        BaseType::Enumeration => BaseType::Integer,
        other => other,
    };
    let mut order = Vec::new();
    let mut sets: HashMap<(BaseType, u32), Vec<&Variable>> = HashMap::new();
    for v in &d.variables {
        let key = (class(v), v.value_reference);
        let set = sets.entry(key).or_default();
        set.push(v);
        if set.len() == 2 {
            order.push(key);
        }
    }
    for set in order.iter().map(|key| &sets[key]) {
        let first = set[0];
        let constant = |v: &Variable| v.variability == Variability::Constant;
        let settable = |v: &&&Variable| matches!(v.causality, Causality::Input | Causality::Parameter) || v.has_start;
        if set.iter().any(|v| constant(v) != constant(first)) {
            let message = format!(
                "\"{}\" and \"{}\" have one value reference, but only one of them is constant",
                first.name,
                set.iter().find(|v| constant(v) != constant(first)).map_or("", |v| &v.name)
            );
            findings.at(id::ALIAS, set[1].position, message);
        } else if constant(first) {
            if let Some(other) = set.iter().find(|v| v.start != first.start) {
                let message = format!(
                    "the constants \"{}\" and \"{}\" have one value reference, but different start values",
                    first.name, other.name
                );
                findings.at(id::ALIAS, other.position, message);
            }
        } else if let Some(second) = set.iter().filter(settable).nth(1) {
            let other = set.iter().find(settable).map_or("", |v| &v.name);
            let message = format!(
                "\"{other}\" and \"{}\" have one value reference, and both have a start value or can be set",
                second.name
            );
            findings.at(id::ALIAS, second.position, message);
        }
        let units: HashSet<Option<String>> = set.iter().map(|v| unit_key(d, v)).collect();
        if units.len() > 1 {
            let names: Vec<&str> = set.iter().map(|v| v.name.as_str()).collect();
            let names = names.join(", ");
            // One missing unit is only untidy; two units that cannot be converted contradict each other.
            if units.iter().flatten().count() > 1 {
                findings.at(
                    id::ALIAS_UNIT,
                    set[1].position,
                    format!("{names} have one value reference, but not one unit"),
                );
            } else {
                let message = format!("{names} have one value reference, but only some of them have a unit");
                findings.at(id::ALIAS_UNIT_MISSING, set[1].position, message);
            }
        }
    }
}
