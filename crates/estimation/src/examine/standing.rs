//! An axis that its friction holds.
//!
//! A motor at rest says of its torque only that it is below breakaway: friction balances any torque up to there, whatever its course.

use super::Input;
use super::finding::{Finding, Severity};
use super::robust::noise;
use super::spectra::Spectra;
use super::usable::mean;
use crate::numerics::level::deviation;

/// Blocks that a record is cut into, and the least samples of one: their means have a quarter of the encoder's noise or less.
const BLOCKS: usize = 100;
const LEAST: usize = 16;
/// Standard errors of a difference of two means up to which it is noise: of a hundred pairs one in a hundred and sixty records has one beyond.
pub(super) const NOISE: f64 = 4.0;
/// Segments of the spectra of torque and table.
const SEGMENTS: usize = 8;

/// Share of the torque's power, about its mean, in the blocks in which the motor rests within its encoder's noise; 0 without an encoder on
/// the motor, and where the table follows the torque, which it does not unless the motor turns.
pub(super) fn held_share(input: &Input<'_>) -> f64 {
    let (Some(torque), Some(x)) = (input.torque, input.theta1) else { return 0.0 };
    let n = x.len();
    let size = (n / BLOCKS).max(LEAST);
    if n < 2 * size || table_follows(input) {
        return 0.0;
    }
    let positions = Positions::of(x, size);
    let middle = mean(torque);
    let power = |b: usize| torque[b * size..(b + 1) * size].iter().map(|t| (t - middle).powi(2)).sum::<f64>();
    let sum = |holds: &dyn Fn(usize) -> bool| (0..positions.means.len()).filter(|b| holds(*b)).map(power).sum::<f64>();
    sum(&|b| positions.rests(b)) / sum(&|_| true).max(f64::MIN_POSITIVE)
}

/// The positions of an encoder in blocks, rad (m).
struct Positions {
    means: Vec<f64>,
    /// Difference of two means up to which it is noise.
    apart: f64,
}

impl Positions {
    /// In blocks of `size` samples.
    fn of(x: &[f64], size: usize) -> Self {
        let apart = NOISE * noise(x) * (2.0 / size as f64).sqrt();
        Self { means: x.chunks_exact(size).map(mean).collect(), apart }
    }

    /// Way from a block to the next one; zero within the noise.
    fn way(&self, b: usize) -> f64 {
        Some(self.means[b + 1] - self.means[b]).filter(|way| way.abs() > self.apart).unwrap_or(0.0)
    }

    /// Whether it stands from the block before to the one after.
    fn rests(&self, b: usize) -> bool {
        (b == 0 || self.way(b - 1) == 0.0) && (b + 1 == self.means.len() || self.way(b) == 0.0)
    }
}

/// Whether the table is one that its own friction holds: it stands for most of the record, and goes on where the coupling pulls it and hardest,
/// to the side to which the twist is off its mean at rest by more than its standard deviation there, on the average over the way. Another
/// axis' table, or one logged at another time, goes to either side under any twist; and so do noise and drift of a broken encoder. The twist is
/// one of angles that need not count from one zero.
pub(super) fn friction_holds_table(input: &Input<'_>) -> bool {
    let (Some(x), Some(y)) = (input.theta1, input.theta2) else { return false };
    let size = (y.len() / BLOCKS).max(LEAST);
    let (motor, table) = (Positions::of(x, size), Positions::of(y, size));
    let twist = |b: usize| 0.5 * (motor.means[b] + motor.means[b + 1] - table.means[b] - table.means[b + 1]);
    let pairs = 0..table.means.len().saturating_sub(1);
    let (moves, rests): (Vec<usize>, Vec<usize>) = pairs.partition(|b| table.way(*b) != 0.0);
    if moves.is_empty() || rests.len() <= moves.len() {
        return false;
    }
    let at_rest: Vec<f64> = rests.into_iter().map(twist).collect();
    let middle = mean(&at_rest);
    let travel: f64 = moves.iter().map(|b| table.way(*b).abs()).sum();
    let pulled: f64 = moves.iter().map(|b| table.way(*b) * (twist(*b) - middle)).sum();
    pulled > travel * deviation(&at_rest)
}

/// Whether the table is coherent with the torque at the lines that hold most of the torque's power.
fn table_follows(input: &Input<'_>) -> bool {
    let (Some(torque), Some(table)) = (input.torque, input.theta2) else { return false };
    let s = Spectra::new(&[torque, table], (table.len() / SEGMENTS).max(2 * LEAST) / 2 * 2, input.dt);
    let sum = |of: &dyn Fn(usize) -> f64| (0..s.lines).map(|f| s.power(0, f) * of(f)).sum::<f64>();
    sum(&|f| s.coherence(0, 1, f)) > s.by_chance() * sum(&|_| 1.0)
}

/// The finding that friction holds so large a share of the torque's power.
pub(super) fn finding(held: f64) -> Finding {
    Finding::new(
        "standing",
        Severity::Warn,
        "T",
        format!(
            "For {:.0} % of the torque's power the motor stands within the noise of its encoder: friction holds it.",
            100.0 * held
        ),
        "A torque below breakaway tells of friction alone, and only that it is larger; inertia and coupling do not show.",
        "Record a motion: a torque above breakaway, in both directions.",
    )
}
