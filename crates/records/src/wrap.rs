//! Counters of limited width.

use super::error::TraceError;
use super::load::{Column, scale};
use super::signal::{AxisKind, Quantity, Signal};
use super::table::Table;

/// Bits of the counters of positions that are known: converters of resolvers have 10, encoders up to 31.
const BITS: std::ops::RangeInclusive<u32> = 10..=32;
/// Of other columns: words of a bus.
const WORDS: [u32; 2] = [16, 32];

/// Unwraps the values of a counter of limited width, in place, and gives the warning; `None` where the column is no counter. A counter
/// holds whole numbers within its range, from zero on or about zero, and jumps by nearly that range; an angle within one turn jumps by
/// nearly one turn.
///
/// # Errors
/// As [`scale`].
pub(super) fn unwrap(
    values: &mut [f64],
    table: &Table,
    column: &Column,
    signal: Signal,
    motion: AxisKind,
) -> Result<Option<String>, TraceError> {
    let (_, factor) = scale(table, column, signal.name(), signal.quantity(motion))?;
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let raw = |v: f64| (v - column.offset) / factor;
    let whole = |v: &f64| (raw(*v) - raw(*v).round()).abs() <= 1e-6;
    let position = matches!(signal.quantity(motion), Quantity::Angle | Quantity::Length);
    let turn = signal.quantity(motion) == Quantity::Angle;
    let mut widths: Vec<(f64, String)> = Vec::new();
    if values.iter().take(4096).all(whole) {
        let (least, most) = (raw(low).min(raw(high)), raw(low).max(raw(high)));
        for bits in BITS.filter(|b| position || WORDS.contains(b)) {
            let width = f64::from(bits).exp2();
            let within = |from: f64| least > from - 0.5 && most < from + width - 0.5;
            if within(0.0) || within(-0.5 * width) {
                widths.push((width * factor.abs(), format!("a counter of {bits} bits")));
            }
        }
    }
    if turn {
        widths.push((std::f64::consts::TAU * column.scale.abs(), "an angle within one turn".to_owned()));
    }
    for (width, name) in widths {
        let jumps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).filter(|d| d.abs() > 0.5 * width).collect();
        // A counter that overflows stays within its range, is near both ends of it, and jumps by nearly all of it.
        let wraps = high - low <= 1.001 * width
            && high - low > 0.8 * width
            && !jumps.is_empty()
            && jumps.iter().all(|d| d.abs() > 0.8 * width)
            && (position || name.starts_with("a counter"));
        if !wraps {
            continue;
        }
        let mut turns = 0.0;
        let mut before = values[0];
        for v in values.iter_mut() {
            let step = *v - before;
            before = *v;
            if step.abs() > 0.5 * width {
                turns -= step.signum();
            }
            *v += turns * width;
        }
        // Where it began is not known: the record is kept near zero for a signal that is no position.
        if !position && values[0] > 0.5 * width {
            values.iter_mut().for_each(|v| *v -= width);
        }
        return Ok(Some(format!(
            "{}: column {} starts anew {} times ({name}); it was unwrapped",
            table.file,
            column.column,
            jumps.len()
        )));
    }
    Ok(None)
}
