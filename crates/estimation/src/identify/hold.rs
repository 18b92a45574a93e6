//! Whether the torque is held or linear between samples, where neither the axis file nor the user defines it: by the fit to the record.

use super::joined::Joined;
use super::result::Identification;
use super::run::{Request, identify_joined};
use crate::axis::Hold;
use crate::trace::{Machine, Trace, TraceError};

/// Residual with a linear torque, over that with a held one, up to which the linear one is taken: the wrong assumption leaves a much larger
/// residual, and with fine sampling both leave about the same.
const HALF: f64 = 0.5;

/// The same identification with a torque that is linear between samples, and the pieces with that hold; `None` where the residual is more than
/// half of that with the held torque. Not tried where the held torque explains the record to its noise.
///
/// # Errors
/// As [`identify_joined`].
pub fn straight(
    held: &Identification,
    pieces: &[Trace],
    machine: &Machine,
    request: &Request,
    file: &str,
    progress: &mut dyn FnMut(&str),
) -> Result<Option<(Identification, Vec<Trace>)>, TraceError> {
    let Some(left) = unexplained(held) else { return Ok(None) };
    progress("the torque running straight between samples");
    let mut machine = machine.clone();
    machine.signals.hold = Some(Hold::Linear);
    let mut pieces = pieces.to_vec();
    pieces.iter_mut().for_each(|t| t.hold = Hold::Linear);
    let mut other = identify_joined(Joined::of(&pieces)?, &machine, request, file, progress)?;
    let residual = worst_residual(&other);
    if residual.is_none_or(|residual| residual > HALF * left) {
        return Ok(None);
    }
    other.warnings.insert(
        0,
        format!(
            "nothing says what the torque does between two samples: held, the model leaves {left:.2} % of the motion, running straight \
             from one to the next {:.2} %. It is taken as straight; --hold, or hold in [signals] of an axis file, says what it is",
            residual.unwrap_or_default()
        ),
    );
    Ok(Some((other, pieces)))
}

/// Residual of the recommended estimates at the output with the worst fit, per cent of its standard deviation; `None` where nothing was
/// simulated, or beyond what a number holds.
fn worst_residual(result: &Identification) -> Option<f64> {
    let method = &result.methods[result.recommended.as_ref()?.method];
    // Of sums that overflow the residual is no number: a worse one than any.
    let residual = |fit: f64| if fit.is_finite() { 100.0 - fit } else { f64::INFINITY };
    method.outputs.iter().map(|o| residual(o.fit_percent)).reduce(f64::max).filter(|worst| worst.is_finite())
}

/// [`worst_residual`] where a residual is not white, so more than noise.
fn unexplained(result: &Identification) -> Option<f64> {
    let method = &result.methods[result.recommended.as_ref()?.method];
    let explained = method.explains_exactly() || method.outputs.iter().all(|o| o.whiteness.white);
    worst_residual(result).filter(|_| !explained)
}
