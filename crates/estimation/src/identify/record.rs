//! A trace made ready for identification: the torque, the motion of both sides, and what the regressions need of them.

use std::borrow::Cow;
use std::ops::Range;

use super::joined::Joined;
use crate::axis::Hold;
use crate::numerics::spectrum::autocorrelation;
use crate::trace::{Signal, Trace, TraceError};

/// Twist offset, in standard deviations of the twist, from which the encoders' zeros are taken to differ.
pub(super) const DIFFERENT_ZEROS: f64 = 20.0;

/// The record of a two-inertia axis.
#[derive(Debug, Clone)]
pub struct RegressionRecord<'a> {
    /// Torque, N.m.
    pub torque: &'a [f64],
    /// Motor angle, rad.
    pub theta1: &'a [f64],
    /// Table angle, rad, without the difference of the encoders' zeros.
    pub theta2: Cow<'a, [f64]>,
    /// Speeds of motor and table, where both are measured, rad/s.
    pub omega: Option<(&'a [f64], &'a [f64])>,
    /// Interval, s.
    pub dt: f64,
    /// Time of the first sample, s.
    pub start: f64,
    /// What the torque does between samples.
    pub hold: Hold,
    /// What was added to theta2 for the difference of the encoders' zeros, rad: the largest of the pieces'.
    pub zero_offset: f64,
    /// The pieces, each with the time of its first sample, s; none: the record has no gaps.
    pub pieces: Cow<'a, [(Range<usize>, f64)]>,
}

impl<'a> RegressionRecord<'a> {
    /// Takes the signals of a trace; `rho` (m/rad) turns x2 into theta2 where only x2 is measured.
    ///
    /// # Errors
    /// When T, theta1 or both of theta2 and x2 are missing.
    pub fn new(trace: &'a Trace, rho: f64) -> Result<Self, TraceError> {
        Self::in_pieces(trace, std::slice::from_ref(&(0..trace.len())), Cow::Borrowed(&[]), rho)
    }

    /// Takes the signals of a record in pieces, see [`RegressionRecord::new`].
    ///
    /// # Errors
    /// As [`RegressionRecord::new`].
    pub fn of(joined: &'a Joined, rho: f64) -> Result<Self, TraceError> {
        let pieces = match joined.pieces() {
            [_] => Cow::Borrowed(&[][..]),
            many => Cow::Owned(many.iter().cloned().zip(joined.starts().iter().copied()).collect()),
        };
        Self::in_pieces(joined.samples(), joined.pieces(), pieces, rho)
    }

    fn in_pieces(
        trace: &'a Trace,
        ranges: &[Range<usize>],
        pieces: Cow<'a, [(Range<usize>, f64)]>,
        rho: f64,
    ) -> Result<Self, TraceError> {
        let torque = trace.require(Signal::T)?;
        let theta1 = trace.require(Signal::Theta1)?;
        let mut theta2 = match (trace.get(Signal::Theta2), trace.get(Signal::X2)) {
            (Some(theta2), _) => Cow::Borrowed(theta2),
            (None, Some(x2)) if rho != 0.0 => Cow::Owned(x2.iter().map(|x| x / rho).collect()),
            _ => Cow::Borrowed(trace.require(Signal::Theta2)?),
        };
        let n = theta1.len() as f64;
        // A counter that was set between two pieces has its own zero in each; the deviation of the twist is that of all.
        let means: Vec<f64> = ranges
            .iter()
            .map(|r| {
                theta1[r.clone()].iter().zip(&theta2[r.clone()]).map(|(a, b)| a - b).sum::<f64>()
                    / r.len().max(1) as f64
            })
            .collect();
        let squares: f64 = ranges
            .iter()
            .zip(&means)
            .map(|(r, mean)| {
                theta1[r.clone()].iter().zip(&theta2[r.clone()]).map(|(a, b)| (a - b - mean).powi(2)).sum::<f64>()
            })
            .sum();
        let deviation = (squares / n).sqrt();
        let mut zero_offset = 0.0_f64;
        for (range, mean) in ranges.iter().zip(&means) {
            if mean.abs() > DIFFERENT_ZEROS * deviation && deviation > 0.0 {
                theta2.to_mut()[range.clone()].iter_mut().for_each(|v| *v += mean);
                if mean.abs() > zero_offset.abs() {
                    zero_offset = *mean;
                }
            }
        }
        let omega = trace.get(Signal::Omega1).zip(trace.get(Signal::Omega2));
        Ok(Self {
            torque,
            theta1,
            theta2,
            omega,
            dt: trace.dt,
            start: trace.start,
            hold: trace.hold,
            zero_offset,
            pieces,
        })
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.torque.len()
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.torque.is_empty()
    }

    /// Samples that a row spans beyond its first.
    const fn span(&self) -> usize {
        if self.omega.is_some() { 1 } else { 2 }
    }

    /// The regression's rows: none reaches from one piece into the next.
    #[must_use]
    pub fn rows(&self) -> usize {
        match &*self.pieces {
            [] => self.len().saturating_sub(self.span()),
            pieces => pieces.iter().map(|(range, _)| range.len().saturating_sub(self.span())).sum(),
        }
    }

    /// The piece of a row, and the row's number in it.
    #[inline]
    #[must_use]
    pub fn place(&self, row: usize) -> (usize, usize) {
        if self.pieces.is_empty() {
            return (0, row);
        }
        // Each piece has lost as many rows as a row spans.
        let piece = self.pieces.iter().enumerate();
        let piece = piece.take_while(|(k, (range, _))| range.end.saturating_sub((k + 1) * self.span()) <= row).count();
        let piece = piece.min(self.pieces.len() - 1);
        (piece, row + piece * self.span() - self.pieces[piece].0.start)
    }

    /// The rows of the longest piece.
    #[must_use]
    pub fn longest_rows(&self) -> Range<usize> {
        let mut first = 0;
        let mut best = 0..0;
        for (range, _) in self.pieces.iter() {
            let rows = range.len().saturating_sub(self.span());
            if rows > best.len() {
                best = first..first + rows;
            }
            first += rows;
        }
        if self.pieces.is_empty() { 0..self.rows() } else { best }
    }

    /// Time of a regression's row, s.
    #[must_use]
    pub fn time(&self, row: usize) -> f64 {
        let (piece, row) = self.place(row);
        let start = self.pieces.get(piece).map_or(self.start, |(_, start)| *start);
        start + (row as f64 + if self.omega.is_some() { 0.5 } else { 1.0 }) * self.dt
    }

    /// One row of the motion equations, exact for the trapezoidal rule: see [`Row`].
    #[inline]
    #[must_use]
    pub fn row(&self, k: usize) -> Row {
        let (t, x1, x2) = (self.torque, self.theta1, &*self.theta2);
        let d = |k: usize| x1[k] - x2[k];
        let h = self.dt;
        let k = k + self.place(k).0 * self.span();
        if let Some((w1, w2)) = self.omega {
            Row {
                a1: (w1[k + 1] - w1[k]) / h,
                a2: (w2[k + 1] - w2[k]) / h,
                twist: 0.5 * (d(k) + d(k + 1)),
                rate: 0.5 * (w1[k] - w2[k] + w1[k + 1] - w2[k + 1]),
                torque: match self.hold {
                    Hold::Zoh => t[k],
                    Hold::Linear => 0.5 * (t[k] + t[k + 1]),
                },
            }
        } else {
            Row {
                a1: (x1[k + 2] - 2.0 * x1[k + 1] + x1[k]) / (h * h),
                a2: (x2[k + 2] - 2.0 * x2[k + 1] + x2[k]) / (h * h),
                twist: 0.25 * (d(k) + 2.0 * d(k + 1) + d(k + 2)),
                rate: (d(k + 2) - d(k)) / (2.0 * h),
                torque: match self.hold {
                    Hold::Zoh => 0.5 * (t[k] + t[k + 1]),
                    Hold::Linear => 0.25 * (t[k] + 2.0 * t[k + 1] + t[k + 2]),
                },
            }
        }
    }

    /// The name of the equations that [`RegressionRecord::row`] takes.
    #[must_use]
    pub const fn equations(&self) -> &'static str {
        if self.omega.is_some() {
            "midpoint (trapezoidal) equations of positions and speeds"
        } else {
            "3-point equations of positions alone"
        }
    }
}

/// One row of the motion equations between samples:
///
/// ```text
/// torque = I1*a1 + B*rate + K*twist ;  0 = I2*a2 - B*rate - K*twist
/// ```
///
/// With speeds measured the row lies between two samples (`a = D(w)`, `twist = m(d)`, `rate = m(d')`, `torque = m(T)`),
/// with positions alone it spans three. Either is exact on data of the trapezoidal rule (Newmark 1/4, 1/2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Acceleration of the motor, rad/s2.
    pub a1: f64,
    /// Acceleration of the table, rad/s2.
    pub a2: f64,
    /// Twist of the coupling, rad.
    pub twist: f64,
    /// Its rate, rad/s.
    pub rate: f64,
    /// Torque, N.m.
    pub torque: f64,
}

/// Samples of a period of a signal, where it repeats at least twice: the lag of the highest peak of its normalised
/// autocorrelation, if that is above 0.9 and no multiple of a shorter one.
#[must_use]
pub fn period(values: &[f64]) -> Option<usize> {
    let n = values.len();
    if n < 64 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n as f64;
    let centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
    let products = autocorrelation(&centred, n / 2 + 1);
    // Normalised by the energy of the two overlapping parts.
    let mut energy = vec![0.0; n + 1];
    for (k, v) in values.iter().enumerate() {
        energy[k + 1] = energy[k] + (v - mean).powi(2);
    }
    let correlation = |lag: usize| {
        let both = (energy[n - lag] * (energy[n] - energy[lag])).sqrt();
        if both > 0.0 { products[lag] / both } else { 0.0 }
    };
    // Behind the first zero, so that the peak at lag zero is not taken.
    let first = (1..n / 2).find(|lag| correlation(*lag) < 0.0)?;
    let best = (first..=n / 2).map(correlation).fold(0.0, f64::max);
    if best < 0.9 {
        return None;
    }
    (first..=n / 2).find(|lag| {
        let c = correlation(*lag);
        c > 0.98 * best && c >= correlation(lag - 1) && (*lag == n / 2 || c >= correlation(lag + 1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::excitation::{Kind, Multisine};

    #[test]
    fn the_period_of_a_repeated_multisine_is_found_and_of_a_single_one_not() {
        let one = Multisine::new(Kind::Schroeder, 500, 3, 60, 1.0, 0.0, 0).unwrap().period();
        let three: Vec<f64> = one.iter().cycle().take(1730).copied().collect();
        assert_eq!(period(&three), Some(500));
        assert_eq!(period(&one), None);
    }

    #[test]
    fn no_row_reaches_from_one_piece_into_the_next() {
        // A ramp in every piece: any difference across a gap would show as an acceleration.
        let piece = |start: f64, n: u32, zero: f64| {
            let ramp: Vec<f64> = (0..n).map(|k| zero + f64::from(k)).collect();
            let twisted: Vec<f64> = ramp.iter().enumerate().map(|(k, v)| v - zero + 1e-3 * (k as f64).cos()).collect();
            Trace::new(start, 1.0, Hold::Zoh)
                .with(Signal::T, ramp.iter().map(|_| start).collect())
                .and_then(|t| t.with(Signal::Theta1, ramp))
                .and_then(|t| t.with(Signal::Theta2, twisted))
                .unwrap()
        };
        let pieces = [piece(0.0, 20, 5.0), piece(100.0, 3, -700.0), piece(200.0, 30, 0.0)];
        let joined = Joined::of(&pieces).unwrap();
        let record = RegressionRecord::of(&joined, 1.0).unwrap();
        assert_eq!(record.rows(), 18 + 1 + 28);
        assert_eq!([0, 17, 18, 19, 46].map(|k| record.place(k)), [(0, 0), (0, 17), (1, 0), (2, 0), (2, 27)]);
        assert_eq!([0, 17, 18, 19].map(|k| record.time(k)), [1.0, 18.0, 101.0, 201.0]);
        for k in 0..record.rows() {
            let r = record.row(k);
            assert!(r.a1.abs() < 1e-9 && r.a2.abs() < 5e-3 && r.twist.abs() < 5e-3, "{k}: {r:?}");
            assert_eq!(r.torque, [0.0, 100.0, 200.0][record.place(k).0]);
        }
        assert_eq!(record.zero_offset, record.theta2[20] - pieces[1].get(Signal::Theta2).unwrap()[0]);
    }

    #[test]
    fn different_zeros_of_the_encoders_are_brought_together() {
        let angle: Vec<f64> = (0..100).map(|k| (f64::from(k) * 0.1).sin()).collect();
        let other: Vec<f64> = angle.iter().enumerate().map(|(k, v)| v - 6.5 + 1e-3 * (k as f64).cos()).collect();
        let trace = Trace::new(0.0, 1e-3, Hold::Zoh)
            .with(Signal::T, angle.clone())
            .and_then(|t| t.with(Signal::Theta1, angle))
            .and_then(|t| t.with(Signal::Theta2, other))
            .unwrap();
        let record = RegressionRecord::new(&trace, 1.0).unwrap();
        assert!((record.zero_offset - 6.5).abs() < 1e-3);
        assert!((record.theta1[7] - record.theta2[7]).abs() < 2e-3);
    }
}
