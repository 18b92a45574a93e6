//! Periodic excitation signals: Schroeder, random-phase and odd multisines.
//!
//! ```text
//! T(k) = sum_i A_i*cos(2*pi*h_i*k/N + phi_i)      k = 0..N, h_i the lines, rms^2 = sum(A_i^2)/2
//! Schroeder, flat:    phi_i = -pi*i*(i - 1)/L
//! Schroeder, general: phi_n = -2*pi*sum_{l<n} (n - l)*p_l,  p_l = A_l^2/sum(A^2)
//! ```
//!
//! Source: M. R. Schroeder, Synthesis of low-peak-factor signals and binary sequences with low autocorrelation, IEEE
//! Trans. Inf. Theory 16 (1970); paper, section 4.2. Odd multisines: R. Pintelon, J. Schoukens, System Identification,
//! 2nd ed. 2012, section 4.3.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Oversampling of the grid that the crest factor is taken on.
const OVERSAMPLING: usize = 8;

/// How the phases are chosen, and which lines carry power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Every line of the band, Schroeder's phases.
    Schroeder,
    /// Every line of the band, uniformly random phases.
    RandomPhase,
    /// The odd lines of the band, random phases, one line in each group of four left out: the even lines and the odd
    /// ones left out are empty, and light up for even and odd nonlinearities.
    Odd,
}

/// One line of a multisine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Harmonic of the period.
    pub harmonic: usize,
    /// Amplitude.
    pub amplitude: f64,
    /// Phase of the cosine, rad.
    pub phase: f64,
}

/// A multisine over a period of N samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Multisine {
    /// Samples of a period.
    pub samples: usize,
    /// The lines, harmonics increasing.
    pub lines: Vec<Line>,
}

/// A multisine that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExcitationError {
    /// No line in the band.
    #[error(
        "no line of the period lies in the band {low} to {high} Hz (the lines are multiples of {resolution} Hz); widen \
         the band or take a longer period"
    )]
    NoLines {
        /// Lower end, Hz.
        low: f64,
        /// Upper end, Hz.
        high: f64,
        /// Distance of two lines, Hz.
        resolution: f64,
    },
    /// The band reaches the Nyquist frequency.
    #[error("harmonic {harmonic} of a period of {samples} samples is not below the Nyquist frequency; at most {most}")]
    BeyondNyquist {
        /// The harmonic.
        harmonic: usize,
        /// Samples of a period.
        samples: usize,
        /// The highest that is possible.
        most: usize,
    },
    /// A number that must be positive.
    #[error("{name} is {value}: it must be finite and greater than zero")]
    NotPositive {
        /// What.
        name: &'static str,
        /// The value.
        value: f64,
    },
}

/// Schroeder's phases for lines of these amplitudes, by the general formula; rad, in (-2*pi, 0].
#[must_use]
pub fn schroeder_phases(amplitudes: &[f64]) -> Vec<f64> {
    let power: f64 = amplitudes.iter().map(|a| a * a).sum();
    // sum_{l<n} (n - l)*p_l is a running sum of the running sum of p.
    let (mut first, mut second) = (0.0, 0.0);
    amplitudes
        .iter()
        .map(|a| {
            let phase = -TAU * (second % 1.0);
            first += a * a / power;
            second += first;
            phase
        })
        .collect()
}

impl Multisine {
    /// A multisine over the harmonics `first..=last` with amplitudes proportional to `harmonic^slope` (0: flat) and the
    /// given rms.
    ///
    /// # Errors
    /// When no line is left, a harmonic is not below the Nyquist frequency, or the rms is not positive.
    pub fn new(
        kind: Kind,
        samples: usize,
        first: usize,
        last: usize,
        rms: f64,
        slope: f64,
        seed: u64,
    ) -> Result<Self, ExcitationError> {
        if !(rms.is_finite() && rms > 0.0) {
            return Err(ExcitationError::NotPositive { name: "rms", value: rms });
        }
        let most = samples.saturating_sub(1) / 2;
        if last > most {
            return Err(ExcitationError::BeyondNyquist { harmonic: last, samples, most });
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut harmonics: Vec<usize> = (first.max(1)..=last).collect();
        if kind == Kind::Odd {
            harmonics.retain(|h| h % 2 == 1);
            let mut kept = Vec::with_capacity(harmonics.len());
            for group in harmonics.chunks(4) {
                // A group too small to spare a line keeps all of them.
                let left_out = if group.len() == 4 { rng.random_range(0..4) } else { usize::MAX };
                kept.extend(group.iter().enumerate().filter(|(i, _)| *i != left_out).map(|(_, h)| *h));
            }
            harmonics = kept;
        }
        if harmonics.is_empty() {
            return Err(ExcitationError::NoLines { low: first as f64, high: last as f64, resolution: 1.0 });
        }
        let shape: Vec<f64> = harmonics.iter().map(|h| (*h as f64 / harmonics[0] as f64).powf(slope)).collect();
        let scale = rms * (2.0 / shape.iter().map(|a| a * a).sum::<f64>()).sqrt();
        let amplitudes: Vec<f64> = shape.iter().map(|a| a * scale).collect();
        let phases = match kind {
            Kind::Schroeder => schroeder_phases(&amplitudes),
            Kind::RandomPhase | Kind::Odd => amplitudes.iter().map(|_| rng.random_range(-PI..PI)).collect(),
        };
        let lines = harmonics
            .into_iter()
            .zip(amplitudes)
            .zip(phases)
            .map(|((harmonic, amplitude), phase)| Line { harmonic, amplitude, phase })
            .collect();
        Ok(Self { samples, lines })
    }

    /// The same over the lines within a band in Hz, for a sampling interval in s.
    ///
    /// # Errors
    /// As [`Multisine::new`], or when no line lies in the band.
    #[allow(clippy::too_many_arguments, reason = "each is one independent property of the signal")]
    pub fn in_band(
        kind: Kind,
        samples: usize,
        dt: f64,
        low: f64,
        high: f64,
        rms: f64,
        slope: f64,
        seed: u64,
    ) -> Result<Self, ExcitationError> {
        if !(dt.is_finite() && dt > 0.0) {
            return Err(ExcitationError::NotPositive { name: "dt", value: dt });
        }
        let resolution = 1.0 / (samples as f64 * dt);
        // A line on the edge of the band, but for rounding, is in it.
        let first = ((low / resolution - 1e-9).ceil().max(1.0)) as usize;
        let last = (high / resolution + 1e-9).floor() as usize;
        if last < first {
            return Err(ExcitationError::NoLines { low, high, resolution });
        }
        Self::new(kind, samples, first, last, rms, slope, seed).map_err(|e| match e {
            ExcitationError::NoLines { .. } => ExcitationError::NoLines { low, high, resolution },
            other => other,
        })
    }

    /// One period, N samples.
    #[must_use]
    pub fn period(&self) -> Vec<f64> {
        self.synthesise(self.samples)
    }

    /// Root of the mean square.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (0.5 * self.lines.iter().map(|l| l.amplitude * l.amplitude).sum::<f64>()).sqrt()
    }

    /// Largest absolute value over the rms, on a grid eight times as fine as the samples.
    #[must_use]
    pub fn crest_factor(&self) -> f64 {
        let fine = self.synthesise(OVERSAMPLING * self.samples);
        fine.into_iter().fold(0.0, |peak: f64, v| peak.max(v.abs())) / self.rms()
    }

    fn synthesise(&self, points: usize) -> Vec<f64> {
        let mut spectrum = vec![Complex::new(0.0, 0.0); points];
        for line in &self.lines {
            let half = Complex::from_polar(0.5 * line.amplitude, line.phase);
            spectrum[line.harmonic] += half;
            spectrum[points - line.harmonic] += half.conj();
        }
        FftPlanner::new().plan_fft_inverse(points).process(&mut spectrum);
        spectrum.into_iter().map(|c| c.re).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schroeder(lines: usize) -> Multisine {
        Multisine::new(Kind::Schroeder, 2048, 1, lines, 0.03, 0.0, 0).unwrap()
    }

    #[test]
    fn the_crest_factors_of_flat_schroeder_signals_are_those_measured_independently() {
        for (lines, crest) in [(10, 1.916), (50, 1.721), (100, 1.676)] {
            let found = schroeder(lines).crest_factor();
            assert!((found - crest).abs() < 5e-4, "{lines}: {found}");
        }
    }

    #[test]
    fn the_general_formula_gives_the_flat_one_for_equal_amplitudes() {
        let phases = schroeder_phases(&[0.7; 100]);
        for (i, phase) in phases.iter().enumerate() {
            let n = i as f64 + 1.0;
            let turns = (phase + PI * n * (n - 1.0) / 100.0) / TAU;
            assert!((turns - turns.round()).abs() < 1e-9, "{i}");
        }
    }

    #[test]
    fn the_period_is_the_sum_of_its_cosines_and_has_the_rms_asked_for() {
        let signal = Multisine::new(Kind::RandomPhase, 300, 3, 40, 2.5, -0.5, 7).unwrap();
        let period = signal.period();
        for (k, value) in period.iter().enumerate() {
            let direct: f64 = signal
                .lines
                .iter()
                .map(|l| l.amplitude * (TAU * (l.harmonic * k) as f64 / 300.0 + l.phase).cos())
                .sum();
            assert!((value - direct).abs() < 1e-11, "{k}");
        }
        let rms = (period.iter().map(|v| v * v).sum::<f64>() / 300.0).sqrt();
        assert!((rms - 2.5).abs() < 1e-12 && (signal.rms() - 2.5).abs() < 1e-12);
        assert!((signal.lines[37].amplitude / signal.lines[0].amplitude - (40.0f64 / 3.0).powf(-0.5)).abs() < 1e-12);
    }

    #[test]
    fn an_odd_multisine_leaves_the_even_lines_and_one_odd_line_in_four_empty() {
        let signal = Multisine::new(Kind::Odd, 1024, 1, 80, 1.0, 0.0, 3).unwrap();
        assert!(signal.lines.iter().all(|l| l.harmonic % 2 == 1));
        assert_eq!(signal.lines.len(), 30);
        assert_ne!(signal, Multisine::new(Kind::Odd, 1024, 1, 80, 1.0, 0.0, 4).unwrap());
        assert_eq!(signal, Multisine::new(Kind::Odd, 1024, 1, 80, 1.0, 0.0, 3).unwrap());
        let period = signal.period();
        assert!((0..512).all(|k| (period[k] + period[k + 512]).abs() < 1e-12), "half-wave symmetry");
    }

    #[test]
    fn a_band_without_a_line_or_beyond_nyquist_is_refused() {
        let make = |low, high| Multisine::in_band(Kind::Schroeder, 1000, 1e-3, low, high, 1.0, 0.0, 0);
        assert!(matches!(make(1.2, 1.8), Err(ExcitationError::NoLines { .. })));
        assert!(matches!(make(1.0, 500.0), Err(ExcitationError::BeyondNyquist { most: 499, .. })));
        assert_eq!(make(1.0, 100.0).unwrap().lines.len(), 100);
    }
}
