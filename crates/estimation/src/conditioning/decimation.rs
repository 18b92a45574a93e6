//! A record at a lower rate: in a band of frequencies, as if it had been logged in it.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use rustfft::{FftPlanner, num_complex::Complex};

use super::record::Record;
use crate::axis::Hold;

/// The largest number up to `n` of factors 2, 3 and 5 alone.
pub fn smooth(n: usize) -> usize {
    (1..=n)
        .rev()
        .find(|&m| {
            let mut m = m;
            for f in [2, 3, 5] {
                while m % f == 0 {
                    m /= f;
                }
            }
            m == 1
        })
        .unwrap_or(n)
}

/// Periods of the band's upper end within which a filtered record shows that it went on otherwise beyond its ends.
const SETTLING: f64 = 0.5;
/// Samples a period of the band's upper end that are kept.
const KEPT: f64 = 8.0;
/// Instants a sample at which the torque is kept: what runs straight between fewer of them has images in it that an axis of unlike
/// inertias answers by more than the noise.
const INSTANTS: [usize; 2] = [4, 5];

/// The rate at which a record is searched.
#[derive(Debug, Clone, Copy)]
pub struct Rate {
    /// The samples' longest distance, s: zero keeps the record's own rate.
    pub longest: f64,
    /// Whether the torque runs straight from sample to sample: an axis that does not swing answers its images by next to nothing.
    pub straight: bool,
}

/// Every how many samples one is kept, and the instants of the torque within: as many of both as there may be.
fn thinning(most: usize, straight: bool) -> (usize, usize) {
    if straight {
        return (most, 1);
    }
    if most <= INSTANTS[1] {
        return (most, most);
    }
    INSTANTS.map(|m| (most / m * m, m)).into_iter().max().unwrap_or((1, 1))
}

/// How a series goes on beyond an end of the record. The torque is mirrored there, and so must be the acceleration: a motion that began
/// otherwise would lack a torque within a filter's length of the end.
#[derive(Debug, Clone, Copy)]
enum Beyond {
    /// A torque: as it came.
    Even,
    /// A position: as it came about its tangent.
    AboutTangent,
    /// A speed: turned about its value.
    Odd,
}

impl Beyond {
    /// Of a channel of a record.
    const fn of(channel: usize) -> Self {
        if channel.is_multiple_of(2) { Self::AboutTangent } else { Self::Odd }
    }

    /// The value so many samples beyond an end, of the one as many before it; the end with its value and its slope outward, a sample.
    fn mirrored(self, inside: f64, [value, slope]: [f64; 2], samples: f64) -> f64 {
        match self {
            Self::Even => inside,
            Self::AboutTangent => inside + 2.0 * slope * samples,
            Self::Odd => 2.0 * value - inside,
        }
    }
}

/// Value and slope outward, a sample, of a series at its first or last sample: of the parabola through so many at that end.
fn tangent(y: &[f64], samples: usize, last: bool) -> [f64; 2] {
    let of = |k: usize| if last { y[y.len() - 1 - k] } else { y[k] };
    let powers = |k: usize| Vector3::new(1.0, k as f64, (k * k) as f64);
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for k in 0..samples {
        normal += powers(k) * powers(k).transpose();
        right += powers(k) * (of(k) - of(0));
    }
    let fit = normal.lu().solve(&right).unwrap_or_default();
    [of(0) + fit[0], -fit[1]]
}

/// What a filter makes of a frequency in Hz.
type Response<'r> = &'r (dyn Fn(f64) -> Complex<f64> + Sync);

/// The record at the lower rate that its band needs; its torque then runs straight from instant to instant, raised so that within
/// the band it is the one that acted.
pub fn decimate(record: &Record, limit: f64, rate: Rate) -> Record {
    let (every, instants) =
        thinning(((1.0 / (KEPT * limit)).min(rate.longest) / record.dt).floor() as usize, rate.straight);
    let n = record.len();
    if every < 2 || n < 64 {
        return record.clone();
    }
    let dt = record.dt;
    let slow = dt * every as f64;
    let step = every / instants;
    let pad = n.min(4096).max(every * 8).min(n - 1);
    let total = smooth_up(n + 2 * pad);
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(total), planner.plan_fft_inverse(total));
    // Within half of that a tangent of the motion is told: over longer stretches its parabola is none.
    let near = ((0.5 * SETTLING / (limit * dt)) as usize).clamp(4, n / 4);
    // What passes `late` samples late does so with the line that is taken out of it, too.
    let filter = |y: &[f64], beyond: Beyond, every: usize, late: f64, response: Response<'_>| -> Vec<f64> {
        let ends = [tangent(y, near, false), tangent(y, near, true)];
        let at = |i: isize| -> f64 {
            let last = n as isize - 1;
            if i < 0 {
                beyond.mirrored(y[(-i).min(last) as usize], ends[0], -i as f64)
            } else if i > last {
                beyond.mirrored(y[(2 * last - i).max(0) as usize], ends[1], (i - last) as f64)
            } else {
                y[i as usize]
            }
        };
        // A straight line through the ends keeps the circle closed.
        let (first, end) = (at(-(pad as isize)), at((total - pad) as isize - 1));
        let line = |at: f64| first + (end - first) * at / (total as f64 - 1.0);
        let mut z: Vec<Complex<f64>> =
            (0..total).map(|k| Complex::new(at(k as isize - pad as isize) - line(k as f64), 0.0)).collect();
        forward.process(&mut z);
        for (m, v) in z.iter_mut().enumerate() {
            let f = if 2 * m <= total { m as f64 } else { m as f64 - total as f64 } / (total as f64 * dt);
            *v *= response(f) / total as f64;
        }
        inverse.process(&mut z);
        (0..n).step_by(every).map(|k| z[k + pad].re + line((k + pad) as f64 - late)).collect()
    };
    let low = |f: f64| {
        let x = (f.abs() / limit - 1.3) / 0.9;
        if x <= 0.0 {
            1.0
        } else if x >= 1.0 {
            0.0
        } else {
            0.5 * (1.0 + (std::f64::consts::PI * x).cos())
        }
    };
    let sinc =
        |x: f64| if x.abs() < 1e-9 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) };
    let zoh = record.hold == Hold::Zoh;
    let shape = |f: f64| {
        if low(f) == 0.0 {
            return Complex::default();
        }
        let held = if zoh {
            Complex::from_polar(sinc(f * dt), -std::f64::consts::PI * f * dt)
        } else {
            Complex::new(sinc(f * dt).powi(2), 0.0)
        };
        held * (low(f) / sinc(f * dt * step as f64).powi(2))
    };
    // As long as it may be, a record is filtered on all cores.
    let passed = |c: usize| {
        record.channels[c].as_ref().map(|y| filter(y, Beyond::of(c), every, 0.0, &|f| Complex::new(low(f), 0.0)))
    };
    let mut channels = [const { None }; 4];
    let (fine, ()) = rayon::join(
        || filter(&record.torque, Beyond::Even, step, if zoh { 0.5 } else { 0.0 }, &shape),
        || channels.par_iter_mut().enumerate().for_each(|(c, channel)| *channel = passed(c)),
    );
    let torque: Vec<f64> = fine.iter().copied().step_by(instants).collect();
    let mut between = fine;
    between.resize(torque.len() * instants, between.last().copied().unwrap_or_default());
    let noise = record.noise.map(|s| s / (every as f64).sqrt());
    let common_noise = record.common_noise / every as f64;
    let idle = record.idle.iter().map(|r| r.start / every..r.end / every).collect();
    let between = Some((instants, between));
    let out = Record {
        start: record.start,
        dt: slow,
        hold: Hold::Linear,
        torque,
        between,
        channels,
        noise,
        corner: record.corner,
        common_noise,
        settling: SETTLING / limit,
        idle,
    };
    let m = smooth(out.len());
    out.part(0..m)
}

fn smooth_up(n: usize) -> usize {
    (n..).find(|&m| smooth(m) == m).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_number_has_factors_two_three_and_five_alone() {
        assert_eq!([1, 7, 2187, 2245, 8192].map(smooth), [1, 6, 2187, 2187, 8192]);
        assert!((1..400).all(|n| smooth_up(n) >= n && smooth(smooth_up(n)) == smooth_up(n)));
    }

    #[test]
    fn as_many_samples_are_left_out_as_the_torque_has_instants_for() {
        let coupled = [1, 3, 5, 6, 10, 15, 16].map(|most| thinning(most, false));
        assert_eq!(coupled, [(1, 1), (3, 3), (5, 5), (5, 5), (10, 5), (15, 5), (16, 4)]);
        assert_eq!(thinning(11, true), (11, 1));
    }

    #[test]
    fn a_motion_within_the_band_is_the_same_at_the_lower_rate() {
        let n = 6000;
        let position = |k: usize| (0.01 * k as f64).sin() + 1e-3 * k as f64;
        let record = Record {
            start: 0.0,
            dt: 1e-3,
            hold: Hold::Linear,
            torque: (0..n).map(|k| (0.01 * k as f64).cos()).collect(),
            between: None,
            channels: [Some((0..n).map(position).collect()), None, None, None],
            noise: [1e-6; 4],
            corner: [0.0; 2],
            common_noise: 0.0,
            settling: 0.0,
            idle: Vec::new(),
        };
        // 10 rad/s are 1.6 Hz.
        let slow = decimate(&record, 4.0, Rate { longest: f64::INFINITY, straight: false });
        let every = (slow.dt / record.dt).round() as usize;
        assert!(every > 10, "{every}");
        let y = slow.channels[0].as_ref().expect("a position");
        let far = y.len() / 4..y.len() * 3 / 4;
        for k in far {
            assert!((y[k] - position(k * every)).abs() < 1e-5, "{k} {} {}", y[k], position(k * every));
        }
    }
}
