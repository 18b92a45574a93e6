//! Lost samples of a position, interpolated before the identification: each would act as an impact without a torque.
//!
//! As in [`crate::diagnose`], where the threshold is the record's noise floor. Here the noise (standard deviation, in the position's unit) is
//! the median over short blocks of [`noise_level`], which a lost sample raises in its own block only.

use super::joined::Joined;
use super::statistics::noise_level;
use crate::trace::{Signal, bridge};

/// Samples of a block: short enough that most blocks are complete in a record that lost one sample in fifty.
const BLOCK: usize = 16;

/// Interpolates the lost samples of every position of a record, each piece by itself. Gives a warning for each position that has any.
pub(super) fn lost(joined: &mut Joined) -> Vec<String> {
    let positions = [Signal::Theta1, Signal::Theta2, Signal::X2];
    let warnings = positions.into_iter().filter_map(|signal| {
        let count = joined.repair(signal, |y| bridge(y, noise(y)));
        let samples = if count == 1 { "sample" } else { "samples" };
        (count > 0).then(|| {
            format!(
                "{count} {samples} of {} that the log held or disturbed are bridged by what the others expect there; `eixo inspect` says \
                 which",
                signal.name()
            )
        })
    });
    warnings.collect()
}

/// Standard deviation of a position's noise, or of its resolution where that is coarser.
fn noise(y: &[f64]) -> f64 {
    let mut levels: Vec<f64> = y.chunks_exact(BLOCK).map(noise_level).collect();
    if levels.is_empty() {
        return 0.0;
    }
    let middle = levels.len() / 2;
    let usual = *levels.select_nth_unstable_by(middle, f64::total_cmp).1;
    let steps = y.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0);
    // For values with noise the smallest step is close to zero.
    let step = steps.reduce(f64::min).unwrap_or_default();
    usual.max(step / 12.0_f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Hold;
    use crate::numerics::level::noise as white;
    use crate::trace::Trace;

    const NOISE: f64 = 1e-4;

    fn record(position: impl Fn(usize) -> f64) -> Trace {
        let y: Vec<f64> = (0..4096).map(position).collect();
        Trace::new(0.0, 1e-3, Hold::Zoh).with(Signal::Theta1, y).unwrap()
    }

    fn motion(k: usize) -> f64 {
        (0.05 * k as f64).sin()
    }

    #[test]
    fn one_sample_in_fifty_may_be_lost_and_the_noise_is_still_told() {
        let e = white(4096, 1);
        let mut y: Vec<f64> = (0..4096).map(|k| motion(k) + NOISE * e[k]).collect();
        assert!((noise(&y) / NOISE - 1.0).abs() < 0.2, "{}", noise(&y));
        (25..4096).step_by(50).for_each(|k| y[k] = y[k - 1]);
        assert!((noise(&y) / NOISE - 1.0).abs() < 0.5, "{}", noise(&y));
    }

    #[test]
    fn held_samples_are_bridged_in_each_piece_and_counted() {
        let e = white(4096, 2);
        let sound = record(|k| motion(k) + NOISE * e[k]);
        let mut spoilt = sound.clone();
        let mut y = spoilt.get(Signal::Theta1).unwrap().to_vec();
        let held = [700, 1400, 2100, 2500];
        held.iter().for_each(|k| y[*k] = y[*k - 1]);
        spoilt.set(Signal::Theta1, y).unwrap();
        let pieces = [spoilt.slice(0..1500), spoilt.slice(1500..4096)];
        let mut joined = Joined::of(&pieces).unwrap();
        let warnings = lost(&mut joined);
        assert!(warnings.len() == 1 && warnings[0].starts_with("4 samples of theta1"), "{warnings:?}");
        let (repaired, truth) = (joined.samples().get(Signal::Theta1).unwrap(), sound.get(Signal::Theta1).unwrap());
        for k in 0..4096 {
            let off = (repaired[k] - truth[k]).abs();
            assert!(if held.contains(&k) { off < 6.0 * NOISE } else { off == 0.0 }, "{k}: {off:e}");
        }
    }

    #[test]
    fn a_sound_record_a_coarse_one_and_one_without_noise_stay_as_they_are() {
        let e = white(4096, 3);
        let noisy = record(|k| motion(k) + NOISE * e[k]);
        let coarse = record(|k| (motion(k) / 1e-3).round() * 1e-3);
        let exact = record(motion);
        for trace in [&noisy, &coarse, &exact] {
            let mut joined = Joined::one(trace);
            assert_eq!(lost(&mut joined), Vec::<String>::new());
            assert_eq!(joined.samples(), trace);
        }
    }
}
