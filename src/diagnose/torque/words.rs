//! What a residual torque looks like, in words.

use super::super::location::{FrequencyPart, Location, Shape, Spread, StateCurve, shape};

/// Share of a residual's variance that something must explain to be told.
const NAMED: f64 = 0.3;
/// Shares that tell nothing apart.
const ALIKE: f64 = 0.05;

/// Where the gap shows, in a sentence.
#[must_use]
pub fn gap_shows(l: &Location) -> String {
    let rms = (l.residual.r1.iter().map(|r| r * r).sum::<f64>() / l.residual.r1.len().max(1) as f64).sqrt();
    format!("With its parameters fitted alone, the model lacks {} rms in torque, {}.", significant(rms), shows(l))
}

/// What the residual torque looks like.
#[must_use]
pub fn shows(l: &Location) -> String {
    let mut parts: Vec<String> = against(&l.by_state).into_iter().chain(foreign(&l.by_frequency)).collect();
    parts.push(
        match l.spread {
            Spread::Throughout => "throughout the record",
            Spread::Grows => "growing over the record",
            Spread::Falls => "falling over the record",
            Spread::Events => "in a few events rather than throughout",
        }
        .to_owned(),
    );
    parts.join(", ")
}

/// What the residual depends on, by the curve that explains most of it.
fn against(curves: &[StateCurve]) -> Option<String> {
    let own = || curves.iter().filter(|c| c.residual == "r1");
    let most = own().map(|c| c.explained).fold(0.0, f64::max);
    let natural = |c: &&StateCurve| {
        let side = ["omega1", "theta1 within the turn", "theta1", "T"];
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
fn foreign(parts: &[FrequencyPart]) -> Option<String> {
    let own = || parts.iter().filter(|p| p.residual == "r1");
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
fn significant(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let digits = 2 - v.abs().log10().floor() as i32;
    if (0..6).contains(&digits) { format!("{v:.*}", digits as usize) } else { format!("{v:.2e}") }
}
