//! Whether a record is uniformly sampled, and on which grid.
//!
//! The grid is the line `start + k*dt` through the first and the last time stamp. Time stamps off the line by no more
//! than the file's own rounding are uniform; by up to [`Sampling::RESAMPLED`] of an interval they are resampled; a step
//! of 1.5 intervals or more is a gap.

/// The uniform grid of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Time of the first sample, s.
    pub start: f64,
    /// Interval, s.
    pub dt: f64,
    /// Distance of the time stamps from it.
    pub sampling: Sampling,
}

/// Distance of a record's time stamps from its grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sampling {
    /// Uniform up to rounding.
    Uniform,
    /// Off by at most `jitter` intervals: to be resampled.
    Jittered {
        /// Largest distance, in intervals.
        jitter: f64,
    },
}

/// Why a record has no grid. Rows are indices of samples, from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoGrid {
    /// Fewer than three samples.
    TooShort,
    /// `time[row] <= time[row - 1]`.
    NotIncreasing {
        /// The sample.
        row: usize,
    },
    /// Samples missing before `row`.
    Gap {
        /// The first sample after the gap.
        row: usize,
        /// Its length, s.
        gap: f64,
        /// The usual interval, s.
        dt: f64,
    },
    /// Too uneven to resample.
    Jitter {
        /// The worst sample.
        row: usize,
        /// Its distance, in intervals.
        jitter: f64,
        /// The usual interval, s.
        dt: f64,
    },
}

impl Sampling {
    /// Distance from the grid that is still uniform, in intervals.
    pub const UNIFORM: f64 = 1e-3;
    /// Distance from the grid up to which a record is resampled, in intervals.
    pub const RESAMPLED: f64 = 0.3;
}

/// The uniform grid of the time stamps (s).
///
/// # Errors
/// [`NoGrid`]: too short, not increasing, a gap, or too uneven.
pub fn grid(time: &[f64]) -> Result<Grid, NoGrid> {
    let n = time.len();
    if n < 3 {
        return Err(NoGrid::TooShort);
    }
    if let Some(k) = (1..n).find(|k| time[*k] - time[k - 1] <= 0.0) {
        return Err(NoGrid::NotIncreasing { row: k });
    }
    let steps = || time.windows(2).map(|w| w[1] - w[0]);
    let mut sorted: Vec<f64> = steps().collect();
    let middle = sorted.len() / 2;
    let (_, &mut usual, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    if let Some((k, gap)) = steps().enumerate().find(|(_, step)| *step > 1.5 * usual) {
        return Err(NoGrid::Gap { row: k + 1, gap, dt: usual });
    }
    let start = time[0];
    let dt = (time[n - 1] - start) / (n - 1) as f64;
    let (row, worst) = time
        .iter()
        .enumerate()
        .map(|(k, t)| (k, (t - (start + k as f64 * dt)).abs()))
        .fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
    let jitter = worst / dt;
    let rounding = || {
        let mut decimals = Decimals::default();
        time.iter().for_each(|t| decimals.take(*t));
        decimals.rounding()
    };
    let sampling = if jitter <= Sampling::UNIFORM || worst <= rounding() {
        Sampling::Uniform
    } else if jitter <= Sampling::RESAMPLED {
        Sampling::Jittered { jitter }
    } else {
        return Err(NoGrid::Jitter { row, jitter, dt: usual });
    };
    Ok(Grid { start, dt, sampling })
}

/// How far from uniform the time stamps may lie through being written with few decimals: one unit of the last decimal
/// (half for the stamp, half for the ends of the line); zero where they are not multiples of a power of ten.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Decimals {
    /// Whether all stamps so far are multiples of `10^-k`.
    multiples: [bool; 10],
}

impl Default for Decimals {
    fn default() -> Self {
        Self { multiples: [true; 10] }
    }
}

impl Decimals {
    /// Takes one stamp, s.
    pub fn take(&mut self, stamp: f64) {
        let mut scale = 1.0;
        for multiple in &mut self.multiples {
            if *multiple {
                let scaled = stamp * scale;
                *multiple = (scaled - scaled.round()).abs() <= 1e-9 * scaled.abs().max(1.0);
            }
            scale *= 10.0;
        }
    }

    /// The distance, s.
    pub fn rounding(&self) -> f64 {
        let decimals = self.multiples.iter().position(|m| *m);
        decimals.map_or(0.0, |k| 1.0001 / 10_f64.powi(i32::try_from(k).unwrap_or(i32::MAX)))
    }
}

/// Values at the `samples` times of a grid, from `values` at the stamps `time` (s), which may be anywhere. A smooth signal is interpolated
/// by the cubic through the four samples around each time (Lagrange). A `held` one keeps the value of the last stamp; where the interval
/// of the grid is wider than those of the stamps, it is its mean over the interval, so that the impulse of a torque is kept.
#[must_use]
pub fn resample_far(time: &[f64], values: &[f64], grid: &Grid, samples: usize, held: bool) -> Vec<f64> {
    let n = time.len();
    let mut below = 0;
    let logged = (time[n - 1] - time[0]) / (n - 1).max(1) as f64;
    if held && grid.dt > 1.5 * logged {
        return (0..samples)
            .map(|k| mean_of_held(time, values, grid.start + k as f64 * grid.dt, grid.dt, &mut below))
            .collect();
    }
    (0..samples)
        .map(|k| {
            let t = grid.start + k as f64 * grid.dt;
            while below + 1 < n && time[below + 1] <= t {
                below += 1;
            }
            if held {
                return values[below];
            }
            let first = below.saturating_sub(1).min(n.saturating_sub(4));
            lagrange(time, values, first..(first + 4).min(n), t)
        })
        .collect()
}

/// Mean over `t..t + dt` of a signal that keeps the value of its last stamp; `below` is where the last call ended.
fn mean_of_held(time: &[f64], values: &[f64], t: f64, dt: f64, below: &mut usize) -> f64 {
    let (mut from, end) = (t, t + dt);
    let mut sum = 0.0;
    while from < end {
        while *below + 1 < time.len() && time[*below + 1] <= from {
            *below += 1;
        }
        let until = time.get(*below + 1).map_or(end, |next| next.min(end));
        sum += values[*below] * (until - from);
        from = until;
    }
    sum / dt
}

/// The polynomial through the points of a range, at time `t`.
fn lagrange(time: &[f64], values: &[f64], points: std::ops::Range<usize>, t: f64) -> f64 {
    let mut sum = 0.0;
    for i in points.clone() {
        let mut weight = 1.0;
        for j in points.clone() {
            if i != j {
                weight *= (t - time[j]) / (time[i] - time[j]);
            }
        }
        sum += weight * values[i];
    }
    sum
}

/// Values of a smooth signal on the grid, by the cubic through the four samples around each grid time (Lagrange).
///
/// `time` and `values` have the same length, at least four; the time stamps lie within half an interval of the grid.
#[must_use]
pub fn resample(time: &[f64], values: &[f64], grid: &Grid) -> Vec<f64> {
    let n = time.len();
    (0..n)
        .map(|k| {
            let t = grid.start + k as f64 * grid.dt;
            let below = if time[k] <= t { k } else { k.saturating_sub(1) };
            let first = below.saturating_sub(1).min(n.saturating_sub(4));
            lagrange(time, values, first..(first + 4).min(n), t)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_written_with_few_decimals_is_still_uniform() {
        let dt = 5.626e-4;
        let time: Vec<f64> = (0..500).map(|k| (f64::from(k) * dt * 1e5).round() / 1e5).collect();
        let found = grid(&time).unwrap();
        assert_eq!(found.sampling, Sampling::Uniform);
        assert!((found.dt - dt).abs() < 1e-7);
    }

    #[test]
    fn a_gap_names_the_sample_after_it() {
        let mut time: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.01).collect();
        time.drain(40..43);
        match grid(&time) {
            Err(NoGrid::Gap { row, gap, .. }) => {
                assert_eq!(row, 40);
                assert!((gap - 0.04).abs() < 1e-12);
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn time_that_stands_still_is_refused() {
        assert_eq!(grid(&[0.0, 1.0, 1.0, 2.0]), Err(NoGrid::NotIncreasing { row: 2 }));
    }

    #[test]
    fn a_held_signal_on_a_wider_grid_keeps_its_impulse() {
        let time: Vec<f64> = (0..41).map(|k| 0.25 * f64::from(k)).collect();
        let values: Vec<f64> = (0..41).map(|k| f64::from(k * k % 7)).collect();
        let grid = Grid { start: 0.0, dt: 1.0, sampling: Sampling::Jittered { jitter: 0.5 } };
        for (k, mean) in resample_far(&time, &values, &grid, 10, true).into_iter().enumerate() {
            assert!((mean - values[4 * k..4 * k + 4].iter().sum::<f64>() / 4.0).abs() < 1e-12, "{k}");
        }
    }

    #[test]
    fn a_cubic_is_resampled_exactly() {
        let time: Vec<f64> = (0..50).map(|k| f64::from(k) + 0.2 * f64::from(k * 7 % 5 - 2) / 2.0).collect();
        let mut time = time;
        (time[0], time[49]) = (0.0, 49.0);
        let cubic = |t: f64| 1.0 - t + 0.3 * t * t - 0.01 * t * t * t;
        let values: Vec<f64> = time.iter().map(|t| cubic(*t)).collect();
        let found = grid(&time).unwrap();
        assert!(matches!(found.sampling, Sampling::Jittered { .. }), "{found:?}");
        for (k, value) in resample(&time, &values, &found).into_iter().enumerate() {
            assert!((value - cubic(k as f64)).abs() < 1e-9, "{k}");
        }
    }
}
