//! Value references that no variable has, calls without any, and texts (FMI 2.0.4, section 2.1.7).

use super::super::description::{BaseType, Variable};
use super::probe::{Probe, Tested, not_applicable, not_tested};

const TYPES: [BaseType; 4] = [BaseType::Real, BaseType::Integer, BaseType::Boolean, BaseType::String];

pub(in super::super) fn bad_reference_get(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    let mut problems = Vec::new();
    for base in TYPES {
        let r = [p.unused_reference(base)];
        let accepted = match base {
            BaseType::Real => instance.get_real(&r).is_ok(),
            BaseType::Boolean => instance.get_boolean_raw(&r).is_ok(),
            BaseType::String => instance.get_string_raw(&r).is_ok(),
            _ => instance.get_integer(&r).is_ok(),
        };
        if accepted {
            problems
                .push(format!("fmi2Get{base} of the value reference {}, which no variable has, returned fmi2OK", r[0]));
        }
    }
    Ok(problems)
}

pub(in super::super) fn bad_reference_set(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    let mut problems = Vec::new();
    for base in TYPES {
        let r = [p.unused_reference(base)];
        let accepted = match base {
            BaseType::Real => instance.set_real(&r, &[0.0]),
            BaseType::Boolean => instance.set_boolean(&r, &[false]),
            BaseType::String => instance.set_string(&r, &[""]),
            _ => instance.set_integer(&r, &[0]),
        };
        if accepted.is_ok() {
            problems
                .push(format!("fmi2Set{base} of the value reference {}, which no variable has, returned fmi2OK", r[0]));
        }
    }
    Ok(problems)
}

/// An FMU that reads 16 bits of a reference takes it for that of another variable.
pub(in super::super) fn bits(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    if instance.get_real(&[p.unused_reference(BaseType::Real)]).is_ok() {
        return not_tested("unknown value references are accepted");
    }
    let taken =
        |reference: u32| p.d.variables.iter().any(|v| v.base() == BaseType::Real && v.value_reference == reference);
    let reals = || p.d.variables.iter().filter(|v| v.base() == BaseType::Real && v.value_reference < 1 << 16);
    if reals().next().is_none() {
        return not_applicable("there is no Real variable with a value reference below 65536");
    }
    for v in reals().take(20) {
        let beyond = v.value_reference + (1 << 16);
        if !taken(beyond) && instance.get_real(&[beyond]).is_ok() {
            return Ok(vec![format!(
                "fmi2GetReal of the value reference {beyond}, which no variable has, gives \"{}\", whose reference is {}",
                v.name, v.value_reference
            )]);
        }
    }
    Ok(vec![])
}

pub(in super::super) fn empty(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    let failed = instance.empty_calls().into_iter().filter(|(_, status)| !status.is_ok());
    Ok(failed.map(|(name, status)| format!("{name} of no variables at all returned {status}")).collect())
}

/// Texts are texts, and stay what they are until the FMU is called again. Other rules leave alone those that are not.
pub(in super::super) fn string_values(p: &mut Probe) -> Tested {
    let strings: Vec<&Variable> = p.d.variables.iter().filter(|v| v.base() == BaseType::String).collect();
    if strings.is_empty() {
        return not_applicable("there is no String variable");
    }
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    let references: Vec<u32> = strings.iter().map(|v| v.value_reference).collect();
    let values = instance.get_string_raw(&references)?;
    let wrong: Vec<_> = strings.iter().zip(values).filter_map(|(v, value)| Some((v, value.err()?))).collect();
    let problems = wrong.iter().map(|(v, what)| format!("\"{}\" is {what}", v.name)).collect();
    let no_texts = wrong.iter().map(|(v, _)| v.value_reference).collect();
    p.learned.no_texts = no_texts;
    Ok(problems)
}

/// Texts read joint are those read one by one.
pub(in super::super) fn string_buffers(p: &Probe) -> Tested {
    let text = |v: &&Variable| v.base() == BaseType::String && !p.learned.no_texts.contains(&v.value_reference);
    let strings: Vec<&Variable> = p.d.variables.iter().filter(text).take(50).collect();
    if strings.len() < 2 {
        return not_applicable("there are no two String variables");
    }
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 3)?;
    let mut alone = Vec::new();
    for v in &strings {
        alone.append(&mut instance.get_string(&[v.value_reference])?);
    }
    let references: Vec<u32> = strings.iter().map(|v| v.value_reference).collect();
    let joint = instance.get_string(&references)?;
    let wrong = strings.iter().zip(alone).zip(joint).find(|((_, alone), joint)| alone != joint);
    Ok(wrong
        .map(|((v, alone), joint)| format!("\"{}\" reads {joint:?} among other strings, but {alone:?} alone", v.name))
        .into_iter()
        .collect())
}
