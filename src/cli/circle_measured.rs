//! `eixo circle --measured`: what a measured circular test shows.

use std::f64::consts::TAU;
use std::path::PathBuf;

use anyhow::Context;

use super::circle::{Findings as Simulated, Test};
use crate::circle::check_radius;
use crate::circle::measured::{Given, Measured, read};
use crate::circle::roundness::{Roundness, bidirectional};
use crate::circle::trace::{Analysis, Axis, Kind, analyse, hysteresis};
use crate::effects::{EFFECTS, Length};
use crate::report::ballbar::{Findings, Norm};
use crate::trace::Machine;

/// Reads and analyses the test; with axes, beside what their model draws.
///
/// # Errors
/// When a file is no circular test or has too few points.
pub(super) fn findings(
    files: &[PathBuf],
    given: &Given,
    test: &Test,
    axes: Option<&[Machine; 2]>,
) -> anyhow::Result<Findings> {
    let measured = read(files, given)?;
    check_radius(measured.radius).context("the measured circle")?;
    let too_few = || anyhow::anyhow!("the turns have too few points to tell the deviations apart; sample faster");
    let analysis = analyse(&measured.turns, measured.radius, measured.feed).ok_or_else(too_few)?;
    let norm = norm(&measured).ok_or_else(|| anyhow::anyhow!("the points are no circle"))?;
    let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let mut found = Findings {
        name: names.join(" and "),
        as_parameters: axes.map_or_else(Vec::new, |axes| as_parameters(&analysis, axes)),
        measured,
        norm,
        analysis,
        model: None,
    };
    if let Some(axes) = axes {
        let same = Test {
            radius: Some(found.measured.radius),
            feed: found.measured.feed.map(|f| 60.0 * f).or(test.feed),
            ..*test
        };
        let Simulated { analysis, .. } = super::circle::findings(axes, None, &same)?;
        found.model = analysis;
    }
    Ok(found)
}

fn norm(m: &Measured) -> Option<Norm> {
    let paths: Vec<_> = m.turns.iter().map(|t| t.path(m.radius)).collect();
    let each: Option<Vec<Roundness>> = paths.iter().map(|p| Roundness::of(p, m.radius)).collect();
    let each = each?;
    let both = match <[_; 2]>::try_from(paths) {
        Ok(two) => Some(bidirectional(&two)?),
        Err(_) => None,
    };
    let h = if let [one, other] = m.turns.as_slice() { hysteresis(one, other) } else { None };
    Some(Norm {
        clockwise: m.turns.iter().map(|t| t.clockwise).collect(),
        deviation: each.iter().map(|r| r.deviation).collect(),
        radial: each.iter().map(|r| (r.largest, r.smallest)).collect(),
        both,
        hysteresis: h,
        mean: m.turns.iter().map(|t| t.deviation.iter().sum::<f64>() / t.deviation.len() as f64).sum::<f64>()
            / m.turns.len() as f64,
    })
}

/// The effect and its parameter that the table shows as such a length.
fn setting(of: fn(Length) -> Option<usize>) -> Option<(&'static str, &'static str)> {
    EFFECTS.iter().map(|e| (e.info(), e.length())).find_map(|(info, length)| {
        let parameter = of(length?)?;
        Some((info.id, info.parameters[parameter].name))
    })
}

/// What the sizes are as parameters of the effects of a model whose screw is known.
fn as_parameters(a: &Analysis, [x, y]: &[Machine; 2]) -> Vec<String> {
    let of = |axis: Axis| if axis == Axis::X { x.parameters.rho } else { y.parameters.rho };
    let clear = a.effects.iter().filter(|e| e.contribution > 0.0 && e.size.abs() > 3.0 * e.error.unwrap_or(0.0));
    clear.filter_map(|e| match e.kind {
        Kind::Backlash(axis) if e.size > 0.0 => {
            let (effect, parameter) = setting(|l| if let Length::HalfPlay(p) = l { Some(p) } else { None })?;
            Some(format!(
                "The {} of {:.2} um is [effects.{effect}] {parameter} = {:.4e} (half of it over the {:.4e} m/rad of {}).",
                e.kind.name(),
                1e6 * e.size,
                0.5 * e.size / of(axis),
                of(axis),
                axis.name()
            ))
        }
        Kind::Cyclic(axis) => {
            let pitch = e.pitch?;
            let (effect, parameter) = setting(|l| if let Length::Periods(p) = l { Some(p) } else { None })?;
            Some(format!(
                "The {} every {:.3} mm is {:.4} to the turn of the motor: {parameter} = {:.4} of [effects.{effect}] where a torque \
                 makes it.",
                e.kind.name(),
                1e3 * pitch,
                TAU * of(axis) / pitch,
                TAU * of(axis) / pitch
            ))
        }
        _ => None,
    })
    .collect()
}
