//! The residual in time: a drift, an event, or throughout.

use super::CELLS;
use crate::numerics::level::rms;

/// One slot.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSlot {
    /// Start of the slot, s.
    pub start: f64,
    /// End of the slot, s.
    pub end: f64,
    /// Rms of the residual torque on the motor, N.m.
    pub r1: f64,
    /// Rms of the residual torque on the table, N.m; absent for a rigid axis.
    pub r2: Option<f64>,
    /// Rms of the unknown input at the place found, in its unit (N.m, or rad for an encoder's error).
    pub at_place: f64,
}

/// How a residual spreads over the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// Alike in every slot.
    Throughout,
    /// Grows from start to end.
    Grows,
    /// Falls from start to end.
    Falls,
    /// In a few slots only.
    Events,
}

/// Rms of the series in slots.
#[must_use]
pub fn by_time(start: f64, dt: f64, r1: &[f64], r2: Option<&[f64]>, at_place: &[f64]) -> Vec<TimeSlot> {
    let n = r1.len();
    let slots = CELLS.min(n);
    (0..slots)
        .map(|i| {
            let range = i * n / slots..(i + 1) * n / slots;
            TimeSlot {
                start: start + range.start as f64 * dt,
                end: start + range.end as f64 * dt,
                r1: rms(&r1[range.clone()]),
                r2: r2.map(|r| rms(&r[range.clone()])),
                at_place: rms(&at_place[range]),
            }
        })
        .collect()
}

/// The spread of the input at the place found, from its slots.
///
/// Events hold half of the energy in a fifth of the slots or fewer; a drift has a rank correlation with time beyond 0.8
/// (chance: one in ten thousand for twenty slots) and doubles at least from the first quarter to the last.
#[must_use]
pub fn spread(slots: &[TimeSlot]) -> Spread {
    let energy: Vec<f64> = slots.iter().map(|s| s.at_place.powi(2)).collect();
    let n = energy.len();
    let quarter = n / 4;
    if quarter > 0 {
        let first: f64 = energy[..quarter].iter().sum();
        let last: f64 = energy[n - quarter..].iter().sum();
        let rank = rank_correlation(&energy);
        // Energy: doubling of the amplitude is a factor of four.
        if rank > 0.8 && last > 4.0 * first {
            return Spread::Grows;
        }
        if rank < -0.8 && first > 4.0 * last {
            return Spread::Falls;
        }
    }
    let mut sorted = energy;
    sorted.sort_by(|a, b| b.total_cmp(a));
    let top: f64 = sorted[..n.div_ceil(5)].iter().sum();
    // Twenty equal slots hold a fifth of the energy in a fifth of the slots.
    if top > 0.8 * sorted.iter().sum::<f64>() { Spread::Events } else { Spread::Throughout }
}

/// Spearman's rank correlation of the values with their order.
fn rank_correlation(values: &[f64]) -> f64 {
    let n = values.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let d: f64 = order.iter().enumerate().map(|(rank, k)| (rank as f64 - *k as f64).powi(2)).sum();
    let n = n as f64;
    1.0 - 6.0 * d / (n * (n * n - 1.0)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spread_of(f: impl Fn(f64) -> f64) -> Spread {
        let r: Vec<f64> = (0..2000).map(|k| f(f64::from(k) / 2000.0) * f64::from(k).sin()).collect();
        spread(&by_time(0.0, 1e-3, &r, None, &r))
    }

    #[test]
    fn a_drift_an_event_and_a_steady_residual_are_told_apart() {
        assert_eq!(spread_of(|_| 1.0), Spread::Throughout);
        assert_eq!(spread_of(|t| 0.1 + t), Spread::Grows);
        assert_eq!(spread_of(|t| (-4.0 * t).exp()), Spread::Falls);
        assert_eq!(spread_of(|t| if (0.42..0.5).contains(&t) { 1.0 } else { 0.05 }), Spread::Events);
    }
}
