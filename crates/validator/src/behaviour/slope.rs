//! The course of an input whose first derivative is set with `fmi2SetRealInputDerivatives`: with the derivatives u(j) at tc the
//! state equations see at tc + h the input sum over j of u(j) h^j / j! (FMI 2.0.4, section 4.1.2), so value + slope * (t - tc).

use super::super::description::Variable;
use super::super::host::{HostError, Instance};
use super::interpolation::{change, continuous_inputs, effect};
use super::probe::{Probe, Snapshot, Tested, not_applicable, not_tested};
use super::step_size::size_counts;

/// Number of small steps in one.
const PARTS: usize = 8;

/// An input, its value where the tested step begins, and how far it rises over that step.
struct Rise<'a> {
    v: &'a Variable,
    value: f64,
    rise: f64,
}

impl Rise<'_> {
    /// An instance where the tested step begins.
    fn instance(&self, p: &Probe) -> Result<Instance, HostError> {
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, 2)?;
        p.drive(&mut instance, p.time(2))?;
        Ok(instance)
    }

    fn set(&self, instance: &mut Instance, value: f64) -> Result<(), HostError> {
        instance.set_real(&[self.v.value_reference], &[value])
    }

    /// Sets the slope, rise over step size, of an input.
    fn set_slope(&self, p: &Probe, instance: &mut Instance, rise: f64) -> Result<(), HostError> {
        instance.set_input_derivatives(&[self.v.value_reference], &[1], &[rise / p.step])
    }

    /// What is observed at the end of the step, and of one more with the input at its end.
    fn run(&self, p: &Probe, course: Course) -> Result<[Snapshot; 2], HostError> {
        let mut instance = self.instance(p)?;
        let parts = match course {
            Course::Slope => 1,
            Course::Flat(parts) | Course::Stairs(parts) => parts,
        };
        let part = p.step / parts as f64;
        for k in 0..parts {
            let middle = if matches!(course, Course::Stairs(_)) { (k as f64 + 0.5) / parts as f64 } else { 0.0 };
            self.set(&mut instance, self.value + middle * self.rise)?;
            if matches!(course, Course::Slope) {
                self.set_slope(p, &mut instance, self.rise)?;
            }
            instance.do_step(p.time(2) + k as f64 * part, part)?;
        }
        let end = p.observe(&mut instance)?;
        self.set(&mut instance, self.value + self.rise)?;
        if matches!(course, Course::Slope) {
            self.set_slope(p, &mut instance, 0.0)?;
        }
        instance.do_step(p.time(3), p.step)?;
        Ok([end, p.observe(&mut instance)?])
    }

    /// Position of the input at the end of the step as a share of its rise: 1 where it followed the slope, 0 where it was held.
    /// Observed in the variables with direct feedthrough.
    fn at_its_end(&self, p: &Probe) -> Result<Vec<(String, f64)>, HostError> {
        let mut instance = self.instance(p)?;
        self.set(&mut instance, self.value)?;
        self.set_slope(p, &mut instance, self.rise)?;
        instance.do_step(p.time(2), p.step)?;
        let end = p.observe(&mut instance)?;
        self.set(&mut instance, self.value)?;
        let low = p.observe(&mut instance)?;
        self.set(&mut instance, self.value + self.rise)?;
        let high = p.observe(&mut instance)?;
        Ok(self.ratios(p, [&end, &low], [&high, &low], 1e-9))
    }

    /// Change of each variable over the change that is due, 1, where that is larger than `clear` times the value.
    fn ratios(&self, p: &Probe, moved: [&Snapshot; 2], due: [&Snapshot; 2], clear: f64) -> Vec<(String, f64)> {
        let mut ratios = Vec::new();
        for (at, o) in p.observed[0].iter().enumerate() {
            let difference = |pair: [&Snapshot; 2]| pair[0].reals[at] - pair[1].reals[at];
            let (moved, due, size) = (difference(moved), difference(due), due[0].reals[at].abs());
            let known = o.calculated && o.reference != self.v.value_reference;
            if known && due.is_finite() && due.abs() > (clear * size).max(1e-12) {
                ratios.push((o.name.clone(), moved / due));
            }
        }
        ratios
    }
}

/// The course of an input over a step.
#[derive(Clone, Copy)]
enum Course {
    /// One step with the derivative set.
    Slope,
    /// So many small steps along the same slope, each with the value at its middle.
    Stairs(usize),
    /// So many small steps with a constant value.
    Flat(usize),
}

/// The first of the ratios, where none of them lies in a range: where some variables follow the input, the others may be
/// computed otherwise.
fn all_outside(ratios: Vec<(String, f64)>, range: std::ops::RangeInclusive<f64>) -> Option<(String, f64)> {
    let all = ratios.iter().all(|(_, ratio)| !range.contains(ratio));
    ratios.into_iter().next().filter(|_| all)
}

pub(in super::super) fn course(p: &Probe) -> Tested {
    /// A ratio outside this range is another slope: another factor, or another sign.
    const FITS: std::ops::RangeInclusive<f64> = 0.6..=1.6;
    /// The range that a solver of low order with few steps may reach; at the least it ignores the slope.
    const LOOSE: std::ops::RangeInclusive<f64> = -0.4..=1.6;
    let inputs = continuous_inputs(p)?;
    size_counts(p)?;
    if !effect(p)?.is_empty() {
        return not_tested("input derivatives have no effect");
    }
    let (mut tested, small_steps) = (false, p.interface().can_handle_variable_step_size);
    for (order, v) in inputs.into_iter().take(10) {
        let Some((value, rise)) = change(p, v, order) else { continue };
        let input = Rise { v, value, rise };
        let slope = format!("a slope of the input \"{}\" set with fmi2SetRealInputDerivatives", v.name);
        if let Ok(ends) = input.at_its_end(p) {
            tested |= !ends.is_empty();
            if let Some((name, share)) = all_outside(ends, LOOSE) {
                return Ok(vec![format!(
                    "at the end of a step with {slope} \"{name}\" is as if that input had gone {share:.2} times as far as its slope leads"
                )]);
            }
        }
        if !small_steps {
            continue;
        }
        let courses = || -> Result<[[Snapshot; 2]; 6], HostError> {
            let all = [Course::Slope, Course::Flat(1), Course::Stairs(PARTS), Course::Flat(PARTS)];
            let [sloped, reference, stairs, flat] = all.map(|course| input.run(p, course));
            let [fewer, fewer_flat] =
                [Course::Stairs(PARTS / 2), Course::Flat(PARTS / 2)].map(|course| input.run(p, course));
            Ok([sloped?, reference?, stairs?, flat?, fewer?, fewer_flat?])
        };
        let Ok([sloped, reference, stairs, flat, fewer, fewer_flat]) = courses() else { continue };
        let clear = 3.0 * p.tolerance();
        let of = |when: usize| input.ratios(p, [&sloped[when], &reference[when]], [&stairs[when], &flat[when]], clear);
        let at_end = of(0);
        tested |= !at_end.is_empty();
        if let Some((name, ratio)) = all_outside(at_end, FITS) {
            return Ok(vec![format!(
                "with {slope} \"{name}\" moves {ratio:.2} times as far as in {PARTS} small steps along that slope"
            )]);
        }
        // One step later the input is the same in all, and its direct feedthrough is the same: the difference has come
        // through the states. An FMU with a step of its own that is longer than the small ones samples the stairs otherwise.
        let seen = input.ratios(p, [&fewer[1], &fewer_flat[1]], [&stairs[1], &flat[1]], clear);
        let fine = seen.iter().all(|(_, ratio)| (0.8..=1.25).contains(ratio));
        if fine && let Some((name, ratio)) = all_outside(of(1), LOOSE) {
            return Ok(vec![format!(
                "one step after one with {slope} \"{name}\" has moved {ratio:.2} times as far as after {PARTS} small steps along that slope"
            )]);
        }
    }
    match (tested, small_steps) {
        (true, _) => Ok(vec![]),
        (false, true) => not_tested("nothing answers to an input within a step"),
        (false, false) => not_applicable("canHandleVariableCommunicationStepSize is false"),
    }
}
