//! A record in pieces: gaps, standstill and stretches without drive cut a log, and what is left belongs together.
//!
//! The samples of the pieces stand one after the other; nothing is differenced, filtered or simulated from one into the
//! next. All pieces have one sampling interval and one set of signals.

use std::borrow::Cow;
use std::ops::Range;

use super::statistics::noise_level;
use crate::trace::{Signal, Trace, TraceError};

/// The pieces of a record, one after the other.
#[derive(Debug, Clone)]
pub struct Joined<'a> {
    samples: Cow<'a, Trace>,
    pieces: Vec<Range<usize>>,
    /// Time of each piece's first sample, s.
    starts: Vec<f64>,
}

impl<'a> Joined<'a> {
    /// A record without gaps.
    #[must_use]
    pub fn one(trace: &'a Trace) -> Self {
        let pieces = std::iter::once(0..trace.len()).collect();
        Self { samples: Cow::Borrowed(trace), pieces, starts: vec![trace.start] }
    }

    /// The pieces of a record; signals that not all of them have are left out.
    ///
    /// # Errors
    /// When there is no piece, or none of the signals is common to all.
    pub fn of(pieces: &'a [Trace]) -> Result<Self, TraceError> {
        let Some(first) = pieces.first() else {
            return Err(TraceError::MissingSignal { signal: Signal::T.name(), present: String::new() });
        };
        if pieces.len() == 1 {
            return Ok(Self::one(first));
        }
        let mut samples = Trace::new(first.start, first.dt, first.hold);
        for signal in first.signals() {
            let columns: Option<Vec<&[f64]>> = pieces.iter().map(|p| p.get(signal)).collect();
            if let Some(columns) = columns {
                samples.set(signal, columns.concat())?;
            }
        }
        let mut end = 0;
        let ranges = pieces.iter().map(|p| {
            end += p.len();
            end - p.len()..end
        });
        Ok(Self {
            samples: Cow::Owned(samples),
            pieces: ranges.collect(),
            starts: pieces.iter().map(|p| p.start).collect(),
        })
    }

    /// All samples, one piece after the other: their times are [`Joined::time`]'s and not the trace's own.
    #[must_use]
    pub fn samples(&self) -> &Trace {
        &self.samples
    }

    /// The pieces, as ranges of samples, in order.
    #[must_use]
    pub fn pieces(&self) -> &[Range<usize>] {
        &self.pieces
    }

    /// Time of each piece's first sample, s.
    #[must_use]
    pub fn starts(&self) -> &[f64] {
        &self.starts
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Time of a sample, s.
    #[must_use]
    pub fn time(&self, k: usize) -> f64 {
        let piece = piece_of(&self.pieces, k);
        self.starts[piece] + (k - self.pieces[piece].start) as f64 * self.samples.dt
    }

    /// The sample at a time, s; None between the pieces.
    #[must_use]
    pub fn at(&self, time: f64) -> Option<usize> {
        let number = |piece: &Range<usize>, start: f64| {
            let k = ((time - start) / self.samples.dt).round();
            (k >= 0.0 && k < piece.len() as f64).then_some(piece.start + k as usize)
        };
        self.pieces.iter().zip(&self.starts).find_map(|(piece, start)| number(piece, *start))
    }

    /// The longest piece.
    #[must_use]
    pub fn longest(&self) -> Range<usize> {
        self.pieces.iter().max_by_key(|p| p.len()).cloned().unwrap_or(0..0)
    }

    /// The longest piece as a trace.
    #[must_use]
    pub fn longest_trace(&self) -> Cow<'_, Trace> {
        if self.pieces.len() == 1 {
            return Cow::Borrowed(&self.samples);
        }
        let range = self.longest();
        let mut trace = self.samples.slice(range.clone());
        trace.start = self.time(range.start);
        Cow::Owned(trace)
    }

    /// Samples `from..to`, with the cuts that are there.
    #[must_use]
    pub fn part(&self, wanted: Range<usize>) -> Joined<'static> {
        let (mut pieces, mut starts) = (Vec::new(), Vec::new());
        for piece in &self.pieces {
            let cut = piece.start.max(wanted.start)..piece.end.min(wanted.end);
            if !cut.is_empty() {
                starts.push(self.time(cut.start));
                pieces.push(cut.start - wanted.start..cut.end - wanted.start);
            }
        }
        let mut samples = self.samples.slice(wanted);
        samples.start = starts.first().copied().unwrap_or(samples.start);
        Joined { samples: Cow::Owned(samples), pieces, starts }
    }

    /// The record without a signal.
    pub fn remove(&mut self, signal: Signal) {
        if self.samples.has(signal) {
            self.samples.to_mut().remove(signal);
        }
    }

    /// Applies `repair` to the samples of each piece of a signal; it returns the number of samples that it changed. Gives their total, 0 without
    /// the signal. The record is copied only if a sample changes.
    pub(super) fn repair(&mut self, signal: Signal, repair: impl Fn(&mut [f64]) -> usize) -> usize {
        let Some(mut values) = self.samples.get(signal).map(<[f64]>::to_vec) else { return 0 };
        let altered = self.pieces.iter().map(|piece| repair(&mut values[piece.clone()])).sum();
        if altered > 0 {
            let set = self.samples.to_mut().set(signal, values);
            debug_assert!(set.is_ok(), "a column as long as the one it replaces");
        }
        altered
    }

    /// Another torque in place of the record's.
    ///
    /// # Errors
    /// When it is not as long as the record.
    pub fn with_torque(&self, torque: Vec<f64>) -> Result<Joined<'static>, TraceError> {
        let mut samples = self.samples.clone().into_owned();
        samples.set(Signal::T, torque)?;
        Ok(Joined { samples: Cow::Owned(samples), pieces: self.pieces.clone(), starts: self.starts.clone() })
    }
}

/// The piece that holds sample `k`.
pub(super) fn piece_of(pieces: &[Range<usize>], k: usize) -> usize {
    if pieces.len() < 2 { 0 } else { pieces.partition_point(|p| p.end <= k).min(pieces.len() - 1) }
}

/// Standard deviation of the white noise on a smooth record in pieces: see [`noise_level`].
pub(super) fn noise_in_pieces(values: &[f64], pieces: &[Range<usize>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for piece in pieces {
        let rows = piece.len().saturating_sub(6) as f64;
        sum += rows * noise_level(&values[piece.clone()]).powi(2);
        count += rows;
    }
    if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Hold;

    fn piece(start: f64, values: std::ops::Range<u32>) -> Trace {
        let column: Vec<f64> = values.map(f64::from).collect();
        Trace::new(start, 0.5, Hold::Zoh)
            .with(Signal::T, column.clone())
            .and_then(|t| t.with(Signal::Theta1, column))
            .unwrap()
    }

    #[test]
    fn pieces_keep_their_times_and_a_part_its_cuts() {
        let pieces = [piece(1.0, 0..4), piece(10.0, 4..10), piece(20.0, 10..12)];
        let joined = Joined::of(&pieces).unwrap();
        assert_eq!((joined.len(), joined.longest()), (12, 4..10));
        assert_eq!([0, 3, 4, 9, 10, 11].map(|k| joined.time(k)), [1.0, 2.5, 10.0, 12.5, 20.0, 20.5]);
        assert_eq!([1.0, 2.5, 3.0, 11.0, 30.0].map(|t| joined.at(t)), [Some(0), Some(3), None, Some(6), None]);
        assert_eq!(joined.longest_trace().start, 10.0);
        let part = joined.part(3..11);
        assert_eq!(part.pieces(), [0..1, 1..7, 7..8]);
        assert_eq!(part.samples().get(Signal::T).unwrap(), [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        assert_eq!([0, 1, 7].map(|k| part.time(k)), [2.5, 10.0, 20.0]);
    }

    #[test]
    fn a_signal_that_a_piece_lacks_is_left_out_and_no_piece_is_an_error() {
        let mut short = piece(9.0, 0..4);
        short.remove(Signal::Theta1);
        let pieces = [piece(1.0, 0..4), short];
        let joined = Joined::of(&pieces).unwrap();
        assert!(joined.samples().has(Signal::T) && !joined.samples().has(Signal::Theta1));
        assert!(Joined::of(&[]).is_err());
    }

    #[test]
    fn the_noise_of_pieces_knows_nothing_of_the_jump_between_them() {
        let smooth = |k: usize| (0.02 * k as f64).sin();
        let values: Vec<f64> = (0..400).map(|k| smooth(k) + if k < 200 { 0.0 } else { 50.0 }).collect();
        assert!(noise_in_pieces(&values, &[0..200, 200..400]) < 1e-9);
        assert!(noise_level(&values) > 1e-2);
    }
}
