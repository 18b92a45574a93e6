//! A record at a lower rate: in a band of frequencies, as if it had been logged in it.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use rustfft::{FftPlanner, num_complex::Complex};

use super::record::Record;
use crate::axis::Hold;
use crate::effects::{ActiveEffects, Effect, Ramp, Settings, TorqueHistory};

/// The largest number up to `n` of factors 2, 3 and 5 alone.
pub fn smooth(n: usize) -> usize {
    (1..=n).rev().find(|&m| is_smooth(m)).unwrap_or(n)
}

fn is_smooth(m: usize) -> bool {
    let without = |mut m: usize, f: usize| {
        while m.is_multiple_of(f) {
            m /= f;
        }
        m
    };
    [2, 3, 5].into_iter().fold(m, without) == 1
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

/// Parts of a sample that a torque is averaged over before it is filtered, at least: sixteen means to a period of the band's end, of what
/// lies beyond them a fifteenth comes into it.
const PARTS: usize = 2;
/// Samples by which a record is mirrored beyond its ends.
const PADDED: usize = 4096;

thread_local! { static PLANNER: RefCell<FftPlanner<f64>> = RefCell::new(FftPlanner::new()); }

/// How a record came to a lower rate.
#[derive(Debug, Clone, PartialEq)]
struct Decimation {
    /// Upper end of the band that is left as it is, Hz.
    limit: f64,
    /// Sampling interval before, s.
    dt: f64,
    /// Every how many samples one is kept.
    every: usize,
    /// Instants of the torque in each of those.
    instants: usize,
}

/// A series at even steps.
struct Series<'a> {
    values: &'a [f64],
    /// Step, s.
    dt: f64,
    beyond: Beyond,
}

impl Decimation {
    /// Samples from one instant of the torque to the next.
    const fn step(&self) -> usize {
        self.every / self.instants
    }

    /// What is left of a frequency in Hz.
    fn low(&self, f: f64) -> f64 {
        let x = (f.abs() / self.limit - 1.3) / 0.9;
        if x <= 0.0 {
            1.0
        } else if x >= 1.0 {
            0.0
        } else {
            0.5 * (1.0 + (PI * x).cos())
        }
    }

    /// The same of a torque, which then runs straight from instant to instant: raised so that within the band it is the one that acted, as
    /// a series of it was `made`.
    fn shaped(&self, f: f64, made: impl Fn(f64) -> Complex<f64>) -> Complex<f64> {
        let low = self.low(f);
        if low == 0.0 {
            return Complex::default();
        }
        made(f) * (low / sinc(f * self.dt * self.step() as f64).powi(2))
    }

    /// Every so manieth value of a series behind a filter. What passes `late` steps late does so with the line that is taken out of it, too.
    fn filtered(&self, series: &Series<'_>, every: usize, late: f64, response: Response<'_>) -> Vec<f64> {
        let &Series { values: y, dt, beyond } = series;
        let n = y.len();
        // Within half of that a tangent of the motion is told: over longer stretches its parabola is none.
        let near = ((0.5 * SETTLING / (self.limit * dt)) as usize).clamp(4, n / 4);
        let padded = (PADDED as f64 * self.dt / dt) as usize;
        let pad = n.min(padded).max(every * 8).min(n - 1);
        let total = smooth_up(n + 2 * pad);
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
        let [forward, inverse] =
            PLANNER.with_borrow_mut(|planner| [planner.plan_fft_forward(total), planner.plan_fft_inverse(total)]);
        forward.process(&mut z);
        for (m, v) in z.iter_mut().enumerate() {
            let f = if 2 * m <= total { m as f64 } else { m as f64 - total as f64 } / (total as f64 * dt);
            *v *= response(f) / total as f64;
        }
        inverse.process(&mut z);
        (0..n).step_by(every).map(|k| z[k + pad].re + line((k + pad) as f64 - late)).collect()
    }

    /// A channel at the lower rate.
    fn channel(&self, values: &[f64], beyond: Beyond) -> Vec<f64> {
        let series = Series { values, dt: self.dt, beyond };
        self.filtered(&series, self.every, 0.0, &|f| Complex::new(self.low(f), 0.0))
    }

    /// A torque at the instants.
    fn torque(&self, values: &[f64], hold: Hold) -> Vec<f64> {
        let (dt, beyond) = (self.dt, Beyond::Even);
        let made = |f: f64| match hold {
            Hold::Zoh => Complex::from_polar(sinc(f * dt), -PI * f * dt),
            Hold::Linear => Complex::new(sinc(f * dt).powi(2), 0.0),
        };
        let late = if hold == Hold::Zoh { 0.5 } else { 0.0 };
        self.filtered(&Series { values, dt, beyond }, self.step(), late, &|f| self.shaped(f, made))
    }

    /// A torque at the instants, of which the mean over every sample is known.
    fn torque_of_means(&self, means: &[f64]) -> Vec<f64> {
        let step = self.step();
        // As few as the band needs are filtered.
        let part = (1..=step).rev().find(|part| step.is_multiple_of(*part) && PARTS * part <= self.every).unwrap_or(1);
        let values: Vec<f64> = means.chunks(part).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
        let (dt, beyond) = (self.dt * part as f64, Beyond::Even);
        let made = |f: f64| Complex::from_polar(1.0 / sinc(f * dt), -PI * f * dt);
        self.filtered(&Series { values: &values, dt, beyond }, step / part, 0.5, &|f| self.shaped(f, made))
    }
}

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-9 { 1.0 } else { (PI * x).sin() / (PI * x) }
}

/// The torque of a log behind that of a record at a lower rate. What cuts a torque off does so at the log's rate: peaks that are too short
/// for the lower one, too.
#[derive(Debug)]
pub struct LoggedTorque {
    values: Vec<f64>,
    hold: Hold,
    decimation: Decimation,
    /// What was asked for last, by the effects on the way in and their parameters: most looks change others.
    known: Mutex<VecDeque<Kept>>,
}

/// What effects keep of a torque, by them and their parameters.
type Kept = (Vec<(Effect, Vec<f64>)>, Arc<[f64]>);

/// Looks that are remembered.
const REMEMBERED: usize = 16;

impl PartialEq for LoggedTorque {
    fn eq(&self, other: &Self) -> bool {
        (&self.values, self.hold, &self.decimation) == (&other.values, other.hold, &other.decimation)
    }
}

impl LoggedTorque {
    /// Sampling interval, s.
    pub const fn dt(&self) -> f64 {
        self.decimation.dt
    }

    /// What settings keep of the torque on its way in, N.m, at the instants of the lower rate; `None` where they ask for a torque from
    /// longer ago than is remembered at the log's rate.
    pub fn kept(&self, effects: &Settings) -> Option<Arc<[f64]>> {
        let on = effects.active();
        let asked: Vec<(Effect, Vec<f64>)> = on.inputs().iter().map(|e| (*e, effects.of(*e).to_vec())).collect();
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, kept)) = known().iter().find(|(of, _)| *of == asked) {
            return Some(kept.clone());
        }
        let kept: Arc<[f64]> = self.kept_by(effects, &on)?.into();
        let mut known = known();
        known.truncate(REMEMBERED - 1);
        known.push_front((asked, kept.clone()));
        Some(kept)
    }

    fn kept_by(&self, effects: &Settings, on: &ActiveEffects) -> Option<Vec<f64>> {
        let dt = self.decimation.dt;
        let mut history = TorqueHistory::constant(*self.values.first()?);
        let late = |e: &Effect| e.delay_parameter().map_or(0.0, |i| effects.of(*e)[i]);
        if !history.covers(on.inputs().iter().map(late).sum(), dt) {
            return None;
        }
        let last = self.values.len() - 1;
        let kept = |k: usize| {
            let end = if self.hold == Hold::Zoh { k } else { (k + 1).min(last) };
            let logged = Ramp { start: self.values[k], end: self.values[end] };
            let arrived = effects.transform_input(on, logged, dt, &mut history);
            0.5 * (logged.start + logged.end - arrived.start - arrived.end)
        };
        let means: Vec<f64> = (0..=last).map(kept).collect();
        Some(self.decimation.torque_of_means(&means))
    }
}

/// The record at the lower rate that its band needs; its torque then runs straight from instant to instant, raised so that within
/// the band it is the one that acted.
pub fn decimate(record: &Record, limit: f64, rate: Rate) -> Record {
    let (every, instants) =
        thinning(((1.0 / (KEPT * limit)).min(rate.longest) / record.dt).floor() as usize, rate.straight);
    let n = record.len();
    if every < 2 || n < 64 {
        return record.clone();
    }
    let decimation = Decimation { limit, dt: record.dt, every, instants };
    // As long as it may be, a record is filtered on all cores.
    let passed = |c: usize| record.channels[c].as_ref().map(|y| decimation.channel(y, Beyond::of(c)));
    let mut channels = [const { None }; 4];
    let (fine, ()) = rayon::join(
        || decimation.torque(&record.torque, record.hold),
        || channels.par_iter_mut().enumerate().for_each(|(c, channel)| *channel = passed(c)),
    );
    let torque: Vec<f64> = fine.iter().copied().step_by(instants).collect();
    let mut between = fine;
    between.resize(torque.len() * instants, between.last().copied().unwrap_or_default());
    let noise = record.noise.map(|s| s / (every as f64).sqrt());
    let common_noise = record.common_noise / every as f64;
    let idle = record.idle.iter().map(|r| r.start / every..r.end / every).collect();
    let logged = LoggedTorque { values: record.torque.clone(), hold: record.hold, decimation, known: Mutex::default() };
    let out = Record {
        start: record.start,
        dt: record.dt * every as f64,
        hold: Hold::Linear,
        torque,
        between: Some((instants, between)),
        logged: Some((logged.into(), 0)),
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
    (n..).find(|&m| is_smooth(m)).unwrap_or(n)
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

    fn record(hold: Hold, torque: Vec<f64>, position: Option<Vec<f64>>) -> Record {
        Record { noise: [1e-6; 4], ..Record::new(1e-3, hold, torque, [position, None, None, None]) }
    }

    #[test]
    fn a_motion_within_the_band_is_the_same_at_the_lower_rate() {
        let n = 6000;
        let position = |k: usize| (0.01 * k as f64).sin() + 1e-3 * k as f64;
        let torque = (0..n).map(|k| (0.01 * k as f64).cos()).collect();
        let record = record(Hold::Linear, torque, Some((0..n).map(position).collect()));
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

    #[test]
    fn what_bends_a_torque_bends_it_at_the_rate_of_the_log() {
        // A slow sine with a dither that changes its sign every other sample: no lower rate has any of that.
        let n = 6000;
        let torque = |k: usize| 2.0 * (0.01 * k as f64).sin() + if k % 4 < 2 { 0.8 } else { -0.8 };
        let mut effects = Settings::default();
        let (width, limit) = (0.5, 2.2);
        effects.of_mut(Effect::DeadZone)[0] = width;
        effects.of_mut(Effect::Saturation)[0] = limit;
        let bent = |t: f64| {
            let t = t.clamp(-limit, limit);
            t - t.clamp(-width, width)
        };
        for straight in [false, true] {
            let at = |torque: Vec<f64>| {
                let rate = Rate { longest: f64::INFINITY, straight };
                decimate(&record(Hold::Zoh, torque, None), 4.0, rate)
            };
            let logged = at((0..n).map(torque).collect());
            let through = logged.through(&effects).expect("bent");
            let expected = at((0..n).map(|k| bent(torque(k))).collect());
            let rms = |a: &[f64], b: &[f64]| {
                let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
                (square / a.len() as f64).sqrt()
            };
            let error = rms(&through.torque, &expected.torque);
            let slow: Vec<f64> = logged.torque.iter().map(|t| bent(*t)).collect();
            assert!(error < 1e-3 && rms(&slow, &expected.torque) > 0.1, "{error}");
            // A part of it goes through as that part of the whole does.
            let part = logged.part(20..40).through(&effects).expect("bent");
            assert_eq!(part.torque, through.torque[20..40]);
            assert!(logged.through(&Settings::default()).is_none());
        }
    }
}
