//! The scales of a record: what an effect's starts are multiples of, and what bounds it.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::arriving::Arriving;
use super::fit::Fit;
use super::model::Model;
use super::problem::Problem;
use crate::axis::Structure;
use crate::conditioning::Record;
use crate::effects::{Effect, Extent, PERIODS, Scale};
use crate::numerics::level::{self, deviation};

#[derive(Clone)]
pub struct Scales {
    pub torque: f64,
    pub peak: f64,
    pub speed: [f64; 2],
    pub twist: f64,
    pub rotation: [f64; 2],
    pub travel: [[f64; 2]; 2],
    pub dt: f64,
    logged_at: f64,
    pub length: f64,
    pub top: f64,
    pub fastest: [f64; 2],
    /// Largest orders of a torque periodic in the angle of motor and table that are seen, 1/rad.
    pub orders: [f64; 2],
    /// Positions of motor and table, sorted.
    positions: [Vec<f64>; 2],
    /// Twist as measured, sorted; empty where not both sides are.
    twists: Vec<f64>,
    /// Work of the logged torque, J.
    work: f64,
    /// What weights and springs that it held can have given between the record's ends, J: they show in its rms.
    given: f64,
    /// Way of the driven side from sample to sample, rad.
    moved: Arc<[f64]>,
    /// Square of the speed at which the record begins, (rad/s)^2.
    begins: f64,
    /// Way of motor and table to and fro, rad, and reversals; none of a side that is not measured.
    paths: [(f64, f64); 2],
    structure: Structure,
}

/// Least rms of the torque that acts on an axis, over that of the logged one, and least deviation: an amplifier that swallows more than it
/// passes is none, and a limit below most of a torque makes a constant of it, beside which a load explains any motion.
const ACTS: f64 = 0.5;
/// Noises below which a turn of the motion is none.
const TURN: f64 = 6.0;
/// Share of the path on which a torque that goes with the position must be in the band for it to be seen, where that is less than the
/// periods that make a frequency.
const SEEN: f64 = 0.2;

/// Largest order of a torque periodic in the angle, 1/rad, whose frequency is in the band, rad/s, over that part of the path where the axis
/// is slow, and whose period is longer than the noise of a position, rad; of speeds, rad/s, at intervals of `dt`, s.
fn largest_order(speeds: impl Iterator<Item = f64>, dt: f64, band: f64, noise: f64) -> f64 {
    // Slower than the noise makes it in the band the axis stands.
    let mut speeds: Vec<f64> = speeds.map(f64::abs).filter(|v| *v > TURN * noise * band).collect();
    speeds.sort_by(f64::total_cmp);
    let path = speeds.iter().sum::<f64>() * dt;
    let mut covered = 0.0;
    let slow = speeds.into_iter().find(|v| {
        covered += v * dt;
        covered >= SEEN * path || covered * band >= PERIODS * TAU * v
    });
    slow.map_or(0.0, |v| band / v)
}

/// The path of a motion, and its reversals, those below a threshold left out.
fn path(positions: impl Iterator<Item = f64>, threshold: f64) -> (f64, f64) {
    let (mut path, mut reversals) = (0.0, 0.0);
    // Where the motion turned last, how far it has come since, and which way.
    let mut from: Option<f64> = None;
    let (mut farthest, mut towards) = (0.0, 0.0);
    for x in positions {
        let Some(start) = from else {
            (from, farthest) = (Some(x), x);
            continue;
        };
        if towards == 0.0 {
            if (x - start).abs() > threshold {
                (towards, farthest) = ((x - start).signum(), x);
            }
        } else if (x - farthest) * towards > 0.0 {
            farthest = x;
        } else if (farthest - x) * towards > threshold {
            path += (farthest - start).abs();
            reversals += 1.0;
            (from, towards, farthest) = (Some(farthest), -towards, x);
        }
    }
    (path + from.map_or(0.0, |start| (farthest - start).abs()), reversals)
}

/// Whether the torque acts in a model when and as it was logged.
fn is_as_logged(model: &Model) -> bool {
    let (on_time, ahead) = model.on_time();
    ahead == 0.0 && on_time.effects.active().inputs().is_empty()
}

/// Work of the torque that acts in a model along a motion, J, and rms and deviation of that torque, N.m: what comes late, through a lag or cut
/// off did other work than what was logged, where the motion swings as fast as that even of the other sign. `moved`: path from sample to
/// sample, rad.
fn acting(model: &Model, record: &Record, moved: &[f64]) -> (f64, [f64; 2]) {
    let (model, ahead) = model.on_time();
    let per = record.instants();
    let mut arriving = Arriving::new(&model, record, per, ahead, 0);
    let (mut work, mut sum, mut square) = (0.0, 0.0, 0.0);
    for (k, path) in moved.iter().enumerate() {
        for j in 0..per {
            let acts = arriving.over(k, j);
            let mean = 0.5 * (acts.start + acts.end);
            work += mean * path / per as f64;
            sum += mean;
            square += mean * mean;
        }
    }
    let steps = (per * moved.len().max(1)) as f64;
    let [mean, square] = [sum, square].map(|of| of / steps);
    (work, [square, (square - mean * mean).max(0.0)].map(f64::sqrt))
}

impl Scales {
    pub fn new(p: &Problem<'_>, fit: &Fit) -> Option<Self> {
        let bandwidth = p.bandwidth(fit.discrepancy);
        let t = if p.nominal.structure == Structure::Rigid {
            // A light axis is dragged anywhere by the torque that its parameters lack.
            p.free_run(bandwidth)?.0
        } else {
            // Parameters that have gone far may not bear the feedback that their discrepancy asks for.
            p.track(&fit.model, bandwidth).or_else(|| p.track(&fit.model, fit.bandwidth))?
        };
        let n = t.motion.len() as f64;
        let rms = |f: &dyn Fn(&[f64; 4]) -> f64| (t.motion.iter().map(|m| f(m).powi(2)).sum::<f64>() / n).sqrt();
        let side = |i: usize| {
            let mean = t.motion.iter().map(|m| m[i]).sum::<f64>() / n;
            let low = t.motion.iter().map(|m| m[i]).fold(f64::INFINITY, f64::min);
            let high = t.motion.iter().map(|m| m[i]).fold(f64::NEG_INFINITY, f64::max);
            (rms(&|m| m[i] - mean).max(1e-12), [low, high])
        };
        let (r1, t1) = side(0);
        let (r2, t2) = side(2);
        let torque = &p.record.torque;
        let driven = usize::from(p.record.channels[0].is_none() && p.record.channels[1].is_none());
        let moved: Arc<[f64]> = t.motion.windows(2).map(|m| m[1][2 * driven] - m[0][2 * driven]).collect();
        let last = t.motion.len() - 1;
        let (work, _) = acting(&p.nominal, p.record, &moved);
        let shifted = (t.motion[last][2 * driven] - t.motion[0][2 * driven]).abs();
        let peak = p.peak;
        let top = p.band.omega.last().copied().unwrap_or(1.0);
        let noise = [0, 2].map(|i: usize| p.record.channels[i].as_ref().map_or(0.0, |_| p.record.noise[i]));
        // How far a side goes that is not measured no model tells before its frictions are known: a load may lag far behind its motor.
        let is_known = |i: usize| p.nominal.structure == Structure::Rigid || p.record.channels[2 * i].is_some();
        let path_of = |i: usize| path(t.motion.iter().map(|m| m[2 * i]), TURN * noise[i]);
        let paths = [0, 1].map(|i| if is_known(i) { path_of(i) } else { (0.0, 0.0) });
        let speeds = |i: usize| t.motion.iter().map(move |m| m[2 * i + 1]);
        let sorted = |mut x: Vec<f64>| {
            x.sort_by(f64::total_cmp);
            x
        };
        let twists = match [0, 2].map(|c: usize| p.record.channels[c].as_ref()) {
            [Some(motor), Some(table)] => motor.iter().zip(table).map(|(a, b)| a - b).collect(),
            _ => Vec::new(),
        };
        Some(Self {
            torque: deviation(torque),
            peak,
            work,
            given: level::rms(torque) * shifted,
            moved,
            begins: t.motion[0][2 * driven + 1].powi(2),
            paths,
            speed: [rms(&|m| m[1]), rms(&|m| m[3])],
            twist: rms(&|m| m[0] - m[2]).max(1e-15),
            rotation: [r1, r2],
            travel: [t1, t2],
            dt: p.record.dt,
            logged_at: p.record.logged_at(),
            length: n * p.record.dt,
            top,
            orders: [0, 1].map(|i| largest_order(speeds(i), p.record.dt, top, noise[i])),
            fastest: [1, 3].map(|i| t.motion.iter().fold(0.0_f64, |m, s| m.max(s[i].abs()))),
            positions: [0, 2].map(|i: usize| sorted(t.motion.iter().map(|m| m[i]).collect())),
            twists: sorted(twists),
            structure: p.nominal.structure,
        })
    }

    /// Whether every one of these effects of the model is one that the record could show.
    pub fn admit(&self, record: &Record, model: &Model, effects: impl Iterator<Item = Effect>) -> bool {
        let rigid = self.structure == Structure::Rigid;
        let p = &model.parameters;
        let all = p.i1 + p.i2;
        let mut work = self.work;
        if !is_as_logged(model) {
            let (done, [acts, varies]) = acting(model, record, &self.moved);
            if acts < ACTS * level::rms(&record.torque) || varies < ACTS * self.torque {
                return false;
            }
            work = done;
        }
        effects.into_iter().all(|e| {
            let info = e.info();
            let side = info.place.side();
            let extent = Extent {
                torque: self.peak,
                torque_deviation: self.torque,
                positions: &self.positions[side],
                speed: self.speed[side],
                fastest: self.fastest[side],
                order: self.orders[side],
                twist: self.twist,
                twists: &self.twists,
                dt: self.dt,
                logged_at: self.logged_at,
                length: self.length,
                band: self.top,
                inertia: [
                    if rigid {
                        all
                    } else if side == 1 {
                        p.i2
                    } else {
                        p.i1
                    },
                    all,
                ],
                stiffness: if rigid { 0.0 } else { p.k },
                energy: work.max(0.0) + self.given + 0.5 * all * self.begins,
                path: self.paths[side],
            };
            (info.bounds)(model.effects.of(e), &extent)
        })
    }

    /// Whether the motion shows an effect of a model again.
    pub fn repeats(&self, effect: Effect, model: &Model) -> bool {
        let side = effect.info().place.side();
        // How often a side turns that is not measured is not known.
        let (path, reversals) = self.paths[side];
        let reversals = if path == 0.0 { f64::INFINITY } else { reversals };
        effect.repeats(model.effects.of(effect), self.travel_of(side), reversals)
    }

    /// Travel of a side, rad.
    fn travel_of(&self, side: usize) -> f64 {
        let [low, high] = self.travel[side];
        high - low
    }

    /// The value that is a fraction of a scale.
    pub fn value(&self, effect: Effect, scale: Scale, f: f64) -> f64 {
        let side = effect.info().place.side();
        match scale {
            Scale::One | Scale::Order | Scale::Frequency => f,
            Scale::Speed => f * self.speed[side],
            Scale::Twist => f * self.twist,
            Scale::Torque => f * self.peak,
            Scale::Rotation => f * self.rotation[side],
            Scale::Sample => f * self.dt,
            Scale::Travel => self.travel[1][usize::from(f > 0.0)] - f * self.travel_of(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Hold, Parameters};
    use crate::effects::Settings;

    #[test]
    fn a_torque_periodic_in_the_angle_is_seen_while_it_is_in_the_band_over_a_fifth_of_the_path_or_three_periods() {
        // From rest at an acceleration a the path below a speed v is v^2/(2 a): a fifth of it below the root of a fifth of the last speed,
        // and B/v*v^2/(2 a) = 3*2 pi of the largest order in a band up to B at v = 12 pi*a/B.
        let (dt, a) = (1e-3, 2.0);
        let speeds = |n: i32| (0..=n).map(move |k| a * dt * f64::from(k));
        for (n, band, order) in
            [(1000, 10.0, 10.0 / (2.0 * 0.2_f64.sqrt())), (5000, 40.0, 40.0 / (12.0 * std::f64::consts::PI * a / 40.0))]
        {
            let found = largest_order(speeds(n), dt, band, 0.0);
            assert!((found / order - 1.0).abs() < 5e-3, "{found} {order}");
        }
        // No period is shorter than six times 2 pi of the noise, however much is covered at less speed.
        let [quiet, noisy] = [0.0, 1e-3].map(|noise| largest_order(speeds(5000), dt, 400.0, noise));
        assert!(quiet > 1e3 && noisy < 1.0 / (TURN * 1e-3), "{quiet} {noisy}");
        assert_eq!(largest_order([2.0, -2.0, 2.0].into_iter(), dt, 10.0, 0.0), 5.0);
        assert_eq!(largest_order([1e-3, 0.0].into_iter(), dt, 10.0, 1.0), 0.0);
        assert_eq!(largest_order(std::iter::empty(), dt, 10.0, 0.0), 0.0);
    }

    #[test]
    fn a_torque_that_comes_late_works_as_much_as_its_phase_at_the_motion_says() {
        // T = cos(w (t - delay)) along theta' = cos(w t): a mean power of cos(w delay)/2.
        let (n, dt, w) = (20_000, 1e-3, 25.0);
        let torque = (0..=n).map(|k| (w * dt * f64::from(k)).cos()).collect();
        let record = Record::new(dt, Hold::Linear, torque, [const { None }; 4]);
        let angle = |k: i32| (w * dt * f64::from(k)).sin() / w;
        let moved: Vec<f64> = (0..n).map(|k| angle(k + 1) - angle(k)).collect();
        let mut model = Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default());
        assert!(is_as_logged(&model));
        for delay in [0.0, 0.021, 0.05, 0.09] {
            model.effects.of_mut(Effect::Delay)[0] = delay;
            let (work, [rms, deviation]) = acting(&model, &record, &moved);
            let power = work / (f64::from(n) * dt);
            assert!((power - 0.5 * (w * delay).cos()).abs() < 5e-3, "{delay} {power}");
            assert!([rms, deviation].iter().all(|of| (of - 0.5_f64.sqrt()).abs() < 5e-3), "{delay} {rms} {deviation}");
        }
        assert!(!is_as_logged(&model));
    }

    #[test]
    fn a_limit_below_all_of_a_torque_makes_a_constant_of_it_and_a_dead_zone_takes_what_it_swallows() {
        // T = 2 + cos(w t): the limit 1 lets a constant act; of cos(w t) a zone of cos(pi/6) passes a twentieth of the rms.
        let (n, dt, w) = (20_000, 1e-3, 25.0);
        let acts = |offset: f64, effect: Effect, value: f64| {
            let torque = (0..=n).map(|k| offset + (w * dt * f64::from(k)).cos()).collect();
            let record = Record::new(dt, Hold::Linear, torque, [const { None }; 4]);
            let mut model = Model::new(Parameters::PAPER, Structure::TwoInertia, Settings::default());
            model.effects.of_mut(effect)[0] = value;
            acting(&model, &record, &vec![0.0; n as usize]).1
        };
        let [rms, deviation] = acts(2.0, Effect::Saturation, 1.0);
        assert!((rms - 1.0).abs() < 1e-9 && deviation < 1e-6, "{rms} {deviation}");
        let zone = (std::f64::consts::PI / 6.0).cos();
        let [rms, _] = acts(0.0, Effect::DeadZone, zone);
        // The mean square of cos x - cos a over |x| < a, twice a period: (a + 2 a cos^2 a - 3 sin a cos a)/pi.
        let a = std::f64::consts::PI / 6.0;
        let square = (a + 2.0 * a * zone * zone - 3.0 * a.sin() * zone) / std::f64::consts::PI;
        assert!((rms - square.sqrt()).abs() < 1e-4, "{rms} {}", square.sqrt());
        assert!(rms < ACTS * 0.5_f64.sqrt());
    }
}
