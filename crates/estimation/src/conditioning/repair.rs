//! Samples that a log lost, bridged in a record.

use super::record::Record;
use crate::trace::bridge;

/// The record with its lost samples bridged, and how many there were.
#[must_use]
pub fn bridged(record: &Record) -> (Record, usize) {
    let mut out = record.clone();
    let mut count = 0;
    for c in [0, 2] {
        let noise = record.noise[c];
        count += out.channels[c].as_mut().map_or(0, |y| bridge(y, noise));
    }
    (out, count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Hold;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const NOISE: f64 = 1e-5;

    fn record(position: &dyn Fn(usize) -> f64) -> Record {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let y = (0..4096)
            .map(|k| {
                let e: f64 = StandardNormal.sample(&mut rng);
                position(k) + NOISE * e
            })
            .collect();
        let plain = Record::new(1e-3, Hold::Zoh, vec![0.0; 4096], [Some(y), None, None, None]);
        Record { noise: [NOISE, 0.0, 0.0, 0.0], ..plain }
    }

    fn motion(k: usize) -> f64 {
        (0.05 * k as f64).sin()
    }

    #[test]
    fn spikes_and_held_samples_are_bridged_and_nothing_else() {
        let sound = record(&motion);
        assert_eq!(bridged(&sound), (sound.clone(), 0));
        let mut spoilt = sound.clone();
        let y = spoilt.channels[0].as_mut().expect("a position");
        for k in [500, 507, 2000] {
            y[k] += 30.0 * NOISE;
        }
        y[3001] = y[3000];
        y[3005] = y[3004];
        // Twice in a row, where the axis is fast.
        (y[3501], y[3502]) = (y[3500], y[3500]);
        // Two that hide each other.
        y[2501] = y[2500];
        (y[3101], y[3103]) = (y[3100], y[3102]);
        y[3304] = y[3303];
        y[3307] = y[3306];
        let (repaired, count) = bridged(&spoilt);
        assert_eq!(count, 12);
        let (a, b) = (repaired.channels[0].as_ref().expect("there"), sound.channels[0].as_ref().expect("there"));
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 5.0 * NOISE));
    }

    #[test]
    fn a_held_sample_is_bridged_where_the_axis_goes_faster_than_usual() {
        // Slow but for a stretch in which neighbours on a cubic disagree by many times the noise.
        let stretch = |k: usize| (-((k as f64 - 2000.0) / 30.0).powi(2)).exp() * (0.15 * (k as f64 - 2000.0)).sin();
        let sound = record(&|k| motion(k) + stretch(k));
        let mut spoilt = sound.clone();
        let y = spoilt.channels[0].as_mut().expect("a position");
        y[2001] = y[2000];
        let (repaired, count) = bridged(&spoilt);
        assert_eq!(count, 1);
        let at = |r: &Record| r.channels[0].as_ref().expect("there")[2001];
        assert!((at(&repaired) - at(&sound)).abs() < 0.02 * (at(&spoilt) - at(&sound)).abs());
    }

    #[test]
    fn a_blow_is_no_spike() {
        // A speed that turns round within a sample, as at an end stop.
        for kink in [2e-4, 2e-3, 2e-2] {
            let impact = record(&|k| kink * (k as f64 - 1777.3).abs());
            assert_eq!(bridged(&impact).1, 0, "{kink}");
        }
    }

    #[test]
    fn a_motion_that_is_faster_than_a_cubic_is_no_spike() {
        // Lines up to a third of the sampling rate.
        let lines = |k: usize| {
            (1..=60).map(|l| (0.035 * f64::from(l) * k as f64 + f64::from(l * l)).sin() / f64::from(l)).sum::<f64>()
        };
        assert_eq!(bridged(&record(&lines)).1, 0);
        // Six hundred lines of one size up to three tenths of it, their phases scattered by the golden angle.
        let random = |k: usize| {
            let phase = |l: i32| 2.399_963 * f64::from(l * l % 6007);
            (1..=600).map(|l| (0.003 * f64::from(l) * k as f64 + phase(l)).sin()).sum::<f64>() / 600.0_f64.sqrt()
        };
        assert_eq!(bridged(&record(&random)).1, 0);
    }

    #[test]
    fn steps_of_a_coarse_encoder_are_no_spikes() {
        let step = 1e-3;
        let mut coarse = record(&|k| (motion(k) / step).round() * step);
        coarse.noise[0] = step / 12.0_f64.sqrt();
        assert_eq!(bridged(&coarse).1, 0);
    }
}
