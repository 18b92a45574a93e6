//! The findings in a sentence.

use super::by_state::{Shape, shape};
use super::by_time::Spread;
use super::{FrequencyPart, StateCurve};

/// A curve or a part of the spectrum is named from this share of the residual on.
const NAMED: f64 = 0.5;
/// Of two variables that explain alike to within this share, the earlier in the list is named.
const ALIKE: f64 = 0.03;

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
