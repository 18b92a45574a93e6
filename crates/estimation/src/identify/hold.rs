//! What the torque does between samples, where nobody says: what the record follows better.

use super::joined::Joined;
use super::result::Identification;
use super::run::{Request, identify_joined};
use crate::axis::Hold;
use crate::trace::{Machine, Trace, TraceError};

/// Share of what a held torque leaves up to which a straight one does: of a wrong hold much more is left, of a fine sampling about as
/// much by either.
const HALF: f64 = 0.5;

/// The same identification with a torque that runs straight from sample to sample, and the pieces so, where that leaves half as much of the
/// motion as the held one or less. Not tried where the held one explains the record.
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
    machine.signals.hold = Hold::Linear;
    let mut pieces = pieces.to_vec();
    pieces.iter_mut().for_each(|t| t.hold = Hold::Linear);
    let mut other = identify_joined(Joined::of(&pieces)?, &machine, request, file, progress)?;
    let still = follows(&other);
    if still.is_none_or(|still| still > HALF * left) {
        return Ok(None);
    }
    other.warnings.insert(
        0,
        format!(
            "nothing says what the torque does between two samples: held, the model leaves {left:.2} % of the motion, running straight \
             from one to the next {:.2} %. It is taken as straight; --hold, or hold in [signals] of an axis file, says what it is",
            still.unwrap_or_default()
        ),
    );
    Ok(Some((other, pieces)))
}

/// What the estimates to trust leave of the output that they follow least, per cent; `None` where nothing was simulated.
fn follows(result: &Identification) -> Option<f64> {
    let method = &result.methods[result.recommended.as_ref()?.method];
    method.outputs.iter().map(|o| 100.0 - o.fit_percent).reduce(f64::max)
}

/// The same where it is more than noise.
fn unexplained(result: &Identification) -> Option<f64> {
    let method = &result.methods[result.recommended.as_ref()?.method];
    let explained = method.explains_exactly() || method.outputs.iter().all(|o| o.whiteness.white);
    follows(result).filter(|_| !explained)
}
