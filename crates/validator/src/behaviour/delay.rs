//! Outputs that come a step late: a slave "can receive values for inputs u(tc) and send values of outputs y(tc)" at each
//! communication point (FMI 2.0.4, section 4.1.1), those of that point and not of the one before.

use super::super::description::{BaseType, Causality, Value, Variability, Variable};
use super::super::host::{HostError, Instance};
use super::probe::{Probe, Stop, Tested, not_applicable, not_tested, type_index};
use super::step_size::{by_size, range, two_sizes};
use super::values::get;

pub(in super::super) fn delay(p: &Probe) -> Tested {
    match (continuous(p), discrete(p)) {
        (Ok(continuous), Ok(discrete)) => Ok([continuous, discrete].concat()),
        (Ok(some), Err(_)) | (Err(_), Ok(some)) => Ok(some),
        (Err(stop), Err(_)) => Err(stop),
    }
}

/// Finds outputs that are one step late: their values in steps of h, shifted by one step, are those in steps of h/2, shifted by one of
/// these steps.
fn continuous(p: &Probe) -> Tested {
    let count = 10;
    let courses = two_sizes(p, count)?;
    by_size(p, &courses)?;
    let (variables, whole, half) = courses;
    let mut problems = Vec::new();
    for (at, (name, _)) in variables.iter().enumerate() {
        let scale = range(&half, at);
        // The first step changes nothing yet, of either size.
        if whole[1][at] != whole[0][at] || half[1][at] != half[0][at] || scale <= 1e-9 * whole[0][at].abs() {
            continue;
        }
        let apart = |later: bool| {
            let pairs = (1..count).map(|k| match later {
                false => (whole[k][at], half[2 * k][at]),
                true => (whole[k + 1][at], half[2 * k + 1][at]),
            });
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        if apart(false) > 1e-4 * scale && apart(true) < 0.01 * apart(false) {
            problems.push(format!(
                "\"{name}\" is one step late: it stays {} over the first step, and in steps of {} and {} it differs by one \
                 step's worth each time",
                whole[0][at],
                p.step,
                p.step / 2.0
            ));
        }
    }
    Ok(problems)
}

/// Length of the short step after each communication step, in communication steps: few events fall into it, and of the sample times of a
/// clock with the period of the step one in 64.
const SHORT: f64 = 1.0 / 64.0;

/// Finds discrete outputs that are one step late, which cannot be found by shifting: each step is followed by a short one, over which the
/// inputs stay. An output that is late changes in the short steps alone.
fn discrete(p: &Probe) -> Tested {
    /// Changes that a finding rests on.
    const FEW: usize = 2;
    /// Most outputs that are read.
    const MOST: usize = 100;
    let kept = |v: &&Variable| {
        v.causality == Causality::Output
            && (v.base() != BaseType::Real || v.variability == Variability::Discrete)
            && !p.learned.masked.contains(&(type_index(v.base()) as u8, v.value_reference))
    };
    let outputs: Vec<&Variable> = p.d.variables.iter().filter(kept).take(MOST).collect();
    if outputs.is_empty() {
        return not_applicable("there is no discrete output");
    }
    p.affordable(4 * p.long())?;
    let mut all = vec![Changes::default(); outputs.len()];
    // The second time from half a step later on, so that an event at a communication point of the one is none of the other.
    for first in [0.0, 0.5] {
        count(p, &outputs, first, &mut all)?;
        if !all.iter().any(Changes::late) {
            return Ok(vec![]);
        }
    }
    let late = outputs.iter().zip(&all).filter(|(_, changes)| changes.late() && changes.short >= FEW);
    Ok(late
        .map(|(v, changes)| {
            format!(
                "\"{}\" is one step late: {} times it changes in a step of {}, and never in the steps of {} between them",
                v.name,
                changes.short,
                SHORT * p.step,
                p.step
            )
        })
        .collect())
}

/// How many times an output changes.
#[derive(Debug, Clone, Copy, Default)]
struct Changes {
    /// In communication steps.
    whole: usize,
    /// In the short steps after them.
    short: usize,
}

impl Changes {
    /// Whether it changes in short steps alone.
    fn late(&self) -> bool {
        self.whole == 0 && self.short > 0
    }
}

/// Counts the changes of outputs in a run whose first step is so many steps longer, until each is seen to be in time.
fn count(p: &Probe, outputs: &[&Variable], longer: f64, all: &mut [Changes]) -> Result<(), Stop> {
    let mut instance = p.ready()?;
    let read = |instance: &mut Instance| -> Result<Vec<Value>, HostError> {
        outputs.iter().map(|v| get(instance, v)).collect()
    };
    let mut last = read(&mut instance)?;
    let mut time = p.start;
    for k in 0..p.long() {
        let whole = if k == 0 { (1.0 + longer) * p.step } else { p.step };
        let mut pair = || -> Result<[Vec<Value>; 2], HostError> {
            p.drive(&mut instance, time)?;
            instance.do_step(time, whole)?;
            let end = read(&mut instance)?;
            instance.do_step(time + whole, SHORT * p.step)?;
            Ok([end, read(&mut instance)?])
        };
        let [end, after] = match pair() {
            Ok(values) => values,
            Err(error) if k == 0 => {
                return not_tested(format!("the FMU does not take a 64th of the step size: {error}"));
            }
            // The FMU ends its run here.
            Err(_) => break,
        };
        time += whole + SHORT * p.step;
        for (at, changes) in all.iter_mut().enumerate() {
            changes.whole += usize::from(end[at] != last[at]);
            changes.short += usize::from(after[at] != end[at]);
        }
        last = after;
        if all.iter().all(|changes| changes.whole > 0) {
            break;
        }
    }
    Ok(())
}
