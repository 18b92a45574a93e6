//! Steps of several sizes: each is integrated to its end, and the results converge (FMI 2.0.4, section 4.2.2).

use super::super::description::{BaseType, Causality, Variability, Variable};
use super::super::host::{HostError, Status};
use super::probe::{Probe, Tested, not_applicable, not_tested};

/// Real variables whose course is compared between step sizes, at most.
const MOST: usize = 500;

fn courses(p: &Probe) -> Vec<(&str, u32)> {
    let masked = |v: &Variable| p.learned.masked.contains(&(0, v.value_reference));
    let kept = |v: &&Variable| {
        v.base() == BaseType::Real
            && v.variability == Variability::Continuous
            && (v.causality == Causality::Output || p.learned.observe_all && v.causality == Causality::Local)
            && !masked(v)
    };
    p.d.variables.iter().filter(kept).take(MOST).map(|v| (v.name.as_str(), v.value_reference)).collect()
}

/// What the inputs do over a course.
#[derive(Clone, Copy, PartialEq)]
enum Inputs {
    /// They keep their start values.
    Constant,
    /// They vary, the same at the same time.
    Varied,
}

/// The course of variables: steps of the sizes given by turns, values after each step.
fn course(
    p: &Probe,
    references: &[u32],
    inputs: Inputs,
    sizes: &[f64],
    count: usize,
) -> Result<Vec<Vec<f64>>, HostError> {
    let mut instance = match inputs {
        Inputs::Constant => {
            let mut instance = p.instantiate()?;
            instance.initialize(p.start, None)?;
            instance
        }
        Inputs::Varied => p.ready()?,
    };
    let mut rows = vec![instance.get_real(references)?];
    let whole: f64 = sizes.iter().sum();
    for k in 0..count {
        let turn = k % sizes.len();
        let passed: f64 = sizes[..turn].iter().sum();
        let time = p.start + ((k / sizes.len()) as f64 * whole + passed) * p.step;
        if inputs == Inputs::Varied {
            p.drive(&mut instance, time)?;
        }
        instance.do_step(time, sizes[turn] * p.step)?;
        rows.push(instance.get_real(references)?);
    }
    Ok(rows)
}

/// As [`course`] with constant inputs, for FMUs that refuse such steps, or end before.
pub(super) fn try_course(
    p: &Probe,
    references: &[u32],
    sizes: &[f64],
    count: usize,
) -> Result<Vec<Vec<f64>>, super::Stop> {
    match course(p, references, Inputs::Constant, sizes, count) {
        Err(HostError::OnlyOnce) => Err(HostError::OnlyOnce.into()),
        Err(error) => not_tested(format!("the FMU does not take these steps: {error}")),
        Ok(rows) => Ok(rows),
    }
}

/// The variables, and their courses at `h` and `h/2`, when both can be run.
pub(super) type Courses<'a> = (Vec<(&'a str, u32)>, Vec<Vec<f64>>, Vec<Vec<f64>>);

pub(super) fn two_sizes(p: &Probe, count: usize) -> Result<Courses<'_>, super::Stop> {
    let variables = courses(p);
    if variables.is_empty() {
        return not_applicable("there is no continuous Real output");
    }
    let references: Vec<u32> = variables.iter().map(|v| v.1).collect();
    // The finest course of the rules on step sizes takes eight times as many steps.
    p.affordable(8 * count)?;
    let whole = try_course(p, &references, &[1.0], count)?;
    match course(p, &references, Inputs::Constant, &[0.5], 2 * count) {
        Ok(half) => Ok((variables, whole, half)),
        Err(HostError::OnlyOnce) => Err(HostError::OnlyOnce.into()),
        Err(error) => not_tested(format!("the FMU refuses half the step size: {error}")),
    }
}

/// Whether every moving variable moves by the call instead of by the time; the name of the first.
fn ignores_size<'a>((variables, whole, half): &Courses<'a>) -> Option<&'a str> {
    let mut first = None;
    for (at, (name, _)) in variables.iter().enumerate() {
        let mut values: Vec<u64> = whole.iter().map(|row| row[at].to_bits()).collect();
        let same = whole.iter().zip(half).all(|(a, b)| a[at].to_bits() == b[at].to_bits());
        values.sort_unstable();
        values.dedup();
        if values.len() >= 4 {
            if !same {
                return None;
            }
            first = first.or(Some(*name));
        }
    }
    first
}

/// A moving variable that stands still in the same calls whatever their size, and these calls, from 1: an FMU with a fixed step of
/// its own stands still by the time, so in other calls where they are shorter. With inputs that vary, for an FMU may be at rest
/// with its start values. Nothing where it does not run so.
fn skips_calls<'a>(p: &Probe, variables: &[(&'a str, u32)]) -> Option<(&'a str, Vec<usize>)> {
    const CALLS: usize = 10;
    /// Of the calls that stand still, and of those that do not.
    const FEW: usize = 3;
    let references: Vec<u32> = variables.iter().map(|v| v.1).collect();
    let driven = |size: f64| course(p, &references, Inputs::Varied, &[size], CALLS).ok();
    let (whole, half) = (driven(1.0)?, driven(0.5)?);
    variables.iter().enumerate().find_map(|(at, (name, _))| {
        let still = |rows: &[Vec<f64>]| -> Vec<usize> {
            (1..=CALLS).filter(|&k| rows[k][at].to_bits() == rows[k - 1][at].to_bits()).collect()
        };
        let (one, other) = (still(&whole), still(&half));
        // Not a rest at one end, but a standstill between moves.
        let between = one.windows(2).filter(|pair| pair[1] > pair[0] + 1).count() + 1;
        (one == other && between >= FEW && CALLS - one.len() >= FEW).then_some((*name, one))
    })
}

/// The message for an FMU that ignores the step size; none where it does not.
fn other_size(p: &Probe, courses: &Courses<'_>) -> Option<String> {
    let (h, half) = (p.step, p.step / 2.0);
    if let Some(name) = ignores_size(courses) {
        return Some(format!(
            "fmi2DoStep ignores communicationStepSize: \"{name}\" takes the same values in steps of {half} as in steps of {h}"
        ));
    }
    skips_calls(p, &courses.0).map(|(name, still)| {
        format!(
            "fmi2DoStep does not integrate to the end of each step: \"{name}\" stands still in the calls {still:?} and moves in the others, in steps of {h} and of {half} alike"
        )
    })
}

/// Stops a rule that makes no sense when the step size is not honoured.
pub(super) fn by_size(p: &Probe, courses: &Courses<'_>) -> Result<(), super::Stop> {
    if other_size(p, courses).is_some() { not_tested("the step size is not honoured") } else { Ok(()) }
}

/// See [`by_size`].
pub(super) fn size_counts(p: &Probe) -> Result<(), super::Stop> {
    two_sizes(p, 10).map_or(Ok(()), |courses| by_size(p, &courses))
}

/// "The slave must integrate until time instant tc(i+1) = tc(i) + hc(i)" (fmi2DoStep, section 4.2.2).
pub(in super::super) fn honoured(p: &Probe) -> Tested {
    Ok(other_size(p, &two_sizes(p, 10)?).into_iter().collect())
}

pub(in super::super) fn convergence(p: &Probe) -> Tested {
    let count = 8;
    let courses = two_sizes(p, count)?;
    by_size(p, &courses)?;
    let (variables, whole, half) = courses;
    let references: Vec<u32> = variables.iter().map(|v| v.1).collect();
    let quarter = try_course(p, &references, &[0.25], 4 * count)?;
    let eighth = try_course(p, &references, &[0.125], 8 * count)?;
    let mut problems = Vec::new();
    for (at, (name, _)) in variables.iter().enumerate() {
        let ends = [&whole, &half, &quarter, &eighth].map(|rows| rows[rows.len() - 1][at]);
        let errors = [ends[1] - ends[0], ends[2] - ends[1], ends[3] - ends[2]].map(f64::abs);
        // A rate of any order halves the difference at least; a jump that happens at other steps does not count twice.
        let stuck = errors[1] > 0.9 * errors[0] && errors[2] > 0.9 * errors[1];
        if stuck && errors[2] > 0.02 * range(&eighth, at).max(f64::MIN_POSITIVE) && errors[2] > 1e-12 {
            problems.push(format!(
                "\"{name}\" does not converge as the step shrinks: at t = {} it is {}, {}, {}, {} for steps of {}, 1/2, 1/4 and 1/8 of it",
                p.time(count), ends[0], ends[1], ends[2], ends[3], p.step
            ));
        }
    }
    Ok(problems)
}

/// Range of a variable over a course.
pub(super) fn range(rows: &[Vec<f64>], at: usize) -> f64 {
    let low = rows.iter().map(|row| row[at]).fold(f64::INFINITY, f64::min);
    let high = rows.iter().map(|row| row[at]).fold(f64::NEG_INFINITY, f64::max);
    high - low
}

/// Whether steps of half and of twice the size both fail, where those of the size do not; the message then. One of the two
/// may fail where the FMU has a fixed step of its own, or ends.
fn takes_one_size(p: &Probe) -> Result<Option<String>, HostError> {
    let fails = |size: f64| -> Result<Option<Status>, HostError> {
        let mut instance = p.instantiate()?;
        instance.initialize(p.start, None)?;
        let mut time = p.start;
        for step in [p.step, size * p.step] {
            let status = instance.do_step_status(time, step, true)?;
            time += step;
            if matches!(status, Status::Error | Status::Fatal) {
                return Ok(Some(status));
            }
        }
        Ok(None)
    };
    if fails(1.0)?.is_some() {
        return Ok(None);
    }
    let (Some(status), Some(_)) = (fails(0.5)?, fails(2.0)?) else { return Ok(None) };
    Ok(Some(format!(
        "canHandleVariableCommunicationStepSize is true, but after a step of {} s one of half and one of twice that return {status}",
        p.step
    )))
}

/// Communication points that an importer gets by adding step after step are off by their rounding; so is the last one from
/// the stop time.
pub(in super::super) fn rounding(p: &Probe) -> Tested {
    let n = p.long();
    let stop = p.time(n);
    // Some units in the last place, as adding step after step leaves them.
    let off = |time: f64| time + 4.0 * f64::EPSILON * time.abs().max(p.step);
    let attempt = |rounded: bool| -> Result<Option<(usize, f64, Status)>, HostError> {
        let mut instance = p.instantiate()?;
        instance.initialize(p.start, Some(stop))?;
        for k in 0..n {
            let exact = p.time(k);
            let (at, step) = if rounded && (k % 2 == 1 || k + 1 == n) {
                (off(exact), p.step)
            } else {
                (exact, p.step.min(stop - exact))
            };
            let status = instance.do_step_status(at, step, true)?;
            if !status.is_ok() {
                return Ok(Some((k, at, status)));
            }
        }
        Ok(None)
    };
    if attempt(false)?.is_some() {
        return not_tested("the FMU does not run to its end in equal steps");
    }
    Ok(attempt(true)?
        .map(|(k, at, status)| {
            let exact = p.time(k);
            format!(
                "fmi2DoStep from t = {at} by {} returned {status}; from t = {exact}, which is that but for rounding, it does not (the stop time is {stop})",
                p.step
            )
        })
        .into_iter()
        .collect())
}

pub(in super::super) fn variable(p: &Probe) -> Tested {
    if !p.interface().can_handle_variable_step_size {
        return not_applicable("canHandleVariableCommunicationStepSize is false");
    }
    if let Some(message) = takes_one_size(p)? {
        return Ok(vec![message]);
    }
    let count = 8;
    let courses = two_sizes(p, count)?;
    by_size(p, &courses)?;
    let (variables, whole, half) = courses;
    let references: Vec<u32> = variables.iter().map(|v| v.1).collect();
    let quarter = try_course(p, &references, &[0.25], 4 * count)?;
    let mixed = course(p, &references, Inputs::Constant, &[1.0, 0.5, 0.25, 0.25, 2.0, 0.75, 1.25, 2.0], 8)?;
    let mut problems = Vec::new();
    for (at, (name, _)) in variables.iter().enumerate() {
        let ends = [&whole, &half, &quarter, &mixed].map(|rows| rows[rows.len() - 1][at]);
        let scatter = (ends[0] - ends[1]).abs().max((ends[1] - ends[2]).abs());
        let allowed = 20.0 * scatter + 0.01 * range(&quarter, at) + 1e-9 * ends[1].abs();
        if (ends[3] - ends[1]).abs() > allowed {
            problems.push(format!(
                "\"{name}\" is {} at t = {} after steps of varying size, but {} after equal ones",
                ends[3],
                p.time(count),
                ends[1]
            ));
        }
    }
    Ok(problems)
}
