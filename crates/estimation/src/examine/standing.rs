//! An axis that its friction holds.
//!
//! A motor at rest says of its torque only that it is below breakaway: friction balances any torque up to there, whatever its course.

use super::Input;
use super::finding::{Finding, Severity};
use super::robust::noise;
use super::spectra::Spectra;

/// Blocks that a record is cut into, and the least samples of one: their means have a quarter of the encoder's noise or less.
const BLOCKS: usize = 100;
const LEAST: usize = 16;
/// Standard errors of a difference of two means up to which it is noise: of a hundred pairs one in a hundred and sixty records has one beyond.
const NOISE: f64 = 4.0;
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
    let apart = NOISE * noise(x) * (2.0 / size as f64).sqrt();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let positions: Vec<f64> = x.chunks_exact(size).map(mean).collect();
    let alike = |b: usize| (positions[b + 1] - positions[b]).abs() <= apart;
    let rests = |b: usize| (b == 0 || alike(b - 1)) && (b + 1 == positions.len() || alike(b));
    let middle = mean(torque);
    let power = |b: usize| torque[b * size..(b + 1) * size].iter().map(|t| (t - middle).powi(2)).sum::<f64>();
    let sum = |holds: &dyn Fn(usize) -> bool| (0..positions.len()).filter(|b| holds(*b)).map(power).sum::<f64>();
    sum(&rests) / sum(&|_| true).max(f64::MIN_POSITIVE)
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
