//! The findings in a sentence.

use super::by_state::{Shape, shape};
use super::by_time::Spread;
use super::places::{PlaceEvidence, SURE};
use super::{FrequencyPart, Residual, StateCurve};
use crate::axis::Structure;
use crate::diagnose::{CHANNELS, Record};
use crate::effects::Place;

/// A curve or a part of the spectrum is named from this share of the residual on.
const NAMED: f64 = 0.5;
/// A residual whose mean is this share of its rms is a constant: nine tenths of its energy.
const CONSTANT: f64 = 0.95;
/// Of two variables that explain alike to within this share, the earlier in the list is named.
const ALIKE: f64 = 0.03;

/// What the sentence is made of.
pub(super) struct Findings<'a> {
    pub place: Option<Place>,
    pub weak: Option<&'a str>,
    pub coarse: &'a [Option<f64>; 4],
    pub spread: Spread,
    pub residual: &'a Residual,
    pub frequency: &'a [FrequencyPart],
    pub state: &'a [StateCurve],
}

/// Why a place is weak: what the record or the structure cannot tell apart.
pub(super) fn weakness(
    record: &Record,
    structure: Structure,
    by_place: &[PlaceEvidence],
    place: Option<Place>,
) -> Option<String> {
    let mut reasons = Vec::new();
    if structure == Structure::Rigid {
        reasons.push("a rigid axis has one place for all torques".to_string());
    } else if !(record.sees_motor() && record.sees_table()) {
        let seen = if record.sees_motor() { "motor" } else { "table" };
        reasons.push(format!(
            "only the {seen} is measured: torques on motor, coupling and table differ by what the spring lets through alone"
        ));
    }
    let mut others: Vec<&PlaceEvidence> = by_place.iter().filter(|e| e.place != place).collect();
    others.sort_by(|a, b| b.share.total_cmp(&a.share));
    if let (Some(own), Some(second)) = (by_place.iter().find(|e| e.place == place), others.first())
        && own.share < SURE
    {
        let name = second.place.map_or("nowhere", Place::as_str);
        reasons.push(format!("{name} is nearly as likely ({:.0} % of the evidence)", 100.0 * second.share));
    }
    (!reasons.is_empty()).then(|| reasons.join("; "))
}

/// The sentence.
pub(super) fn summary(f: &Findings<'_>) -> String {
    let mut text = match f.place {
        Some(place) => located(f, place),
        None => {
            "No unknown torque and no encoder error is needed: parameters and initial state explain the record down \
                 to its noise."
                .to_string()
        }
    };
    if let Some((name, step)) = CHANNELS.iter().zip(f.coarse).find_map(|(n, s)| s.map(|s| (n, s))) {
        text.push_str(&format!(" {name} counts in steps of {}, which make most of its noise.", significant(step)));
    }
    text
}

fn located(f: &Findings<'_>, place: Place) -> String {
    let (name, unit, acts) = match place {
        Place::Input => ("r1", "N.m", "between the command and the motor"),
        Place::Motor => ("r1", "N.m", "on the motor"),
        Place::Coupling => ("coupling", "N.m", "in the coupling, equal and opposite on both sides"),
        Place::Table => ("r2", "N.m", "on the table"),
        Place::Sensor => ("sensor", "rad", "in the table's encoder, not in the motion"),
    };
    let mut text = format!("The gap lies {acts} ({} {unit} rms)", significant(super::plant::rms(&f.residual.at_place)));
    let mean = f.residual.at_place.iter().sum::<f64>() / f.residual.at_place.len().max(1) as f64;
    let constant = mean.abs() > CONSTANT * super::plant::rms(&f.residual.at_place);
    if constant {
        text.push_str(&format!(", nearly constant at {} {unit}", significant(mean)));
    } else if let Some(curve) = against(f.state, name) {
        text.push_str(", ");
        text.push_str(&curve);
    }
    if let Some(part) = foreign(f.frequency, name) {
        text.push_str(", ");
        text.push_str(&part);
    }
    text.push_str(&format!(", {}.", over_time(f.spread)));
    if let Some(weak) = f.weak {
        text.push_str(" The place is weak: ");
        text.push_str(weak);
        text.push('.');
    }
    text
}

/// How a residual spreads over the record.
pub fn over_time(spread: Spread) -> &'static str {
    match spread {
        Spread::Throughout => "throughout the record",
        Spread::Grows => "growing over the record",
        Spread::Falls => "falling over the record",
        Spread::Events => "in a few events rather than throughout",
    }
}

/// What the residual depends on, by the curve that explains most of it.
pub fn against(curves: &[StateCurve], residual: &str) -> Option<String> {
    let own = || curves.iter().filter(|c| c.residual == residual);
    let most = own().map(|c| c.explained).fold(0.0, f64::max);
    // The residual's own side of the chain comes first.
    let natural = |c: &&StateCurve| {
        let side = match residual {
            "r1" => ["omega1", "theta1 within the turn", "theta1", "T"],
            "coupling" => ["twist", "twist rate", "omega1", "T"],
            _ => ["omega2", "theta2 within the turn", "theta2", "twist"],
        };
        side.iter().position(|s| *s == c.against).unwrap_or(side.len())
    };
    let best = own().filter(|c| c.explained >= most - ALIKE).min_by_key(natural)?;
    if best.explained < NAMED {
        return None;
    }
    let form = match shape(best) {
        Shape::Step => format!("flat against the sign of {}", best.against),
        Shape::Line => format!("linear in {}", best.against),
        Shape::Odd => format!("an odd function of {}", best.against),
        Shape::Even => format!("an even function of {}", best.against),
        Shape::Other => format!("a function of {}", best.against),
    };
    Some(format!("{form} ({:.0} % of its variance)", 100.0 * best.explained))
}

/// A single frequency that is not the excitation's, or a harmonic of the turn.
pub fn foreign(parts: &[FrequencyPart], residual: &str) -> Option<String> {
    let own = || parts.iter().filter(|p| p.residual == residual);
    if let Some(order) = own().filter(|p| p.kind.starts_with("turn_order_")).max_by(|a, b| a.share.total_cmp(&b.share))
        && order.share > NAMED
    {
        let n = order.kind.trim_start_matches("turn_order_");
        return Some(format!("{n} times per turn of the motor ({:.0} % of its energy)", 100.0 * order.share));
    }
    let part = own().find(|p| p.kind == "foreign")?;
    let line = part.peak_rms * part.peak_rms / (part.rms * part.rms).max(f64::MIN_POSITIVE);
    (part.share > NAMED && line > NAMED)
        .then(|| format!("mostly at {} Hz, which the excitation does not hold", significant(part.peak)))
}

/// Three significant digits.
pub fn significant(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let digits = 2 - v.abs().log10().floor() as i32;
    if (0..6).contains(&digits) { format!("{v:.*}", digits as usize) } else { format!("{v:.2e}") }
}
