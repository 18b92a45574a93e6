//! What an unknown torque follows: the command, or the motion where it acts.
//!
//! An error of the input and a torque on the motor enter at the same place of the linear axis; they differ in what they
//! follow. Two dictionaries, of the command alone (delays, lags, clipping) and of the motor's own motion (speed, its
//! sign, the turn, the way since a reversal), each take what they can of the unknown torque, by least squares on the
//! whitened innovations; what they leave stays a random walk. The likelier dictionary, each coefficient paid for by
//! BIC, says which it is. Places that the walk alone hardly tells apart are weighed in the same way.

use nalgebra::{DMatrix, DVector};

use super::fit::{Fitted, Setting};
use super::kalman;
use super::plant::{Port, rms};
use crate::diagnose::Record;

/// Rounds of least squares and search for the walk.
const ROUNDS: usize = 4;

/// A hypothesis after a dictionary took its part.
#[derive(Debug, Clone)]
pub struct Followed {
    /// The fit that remains.
    pub fitted: Fitted,
    /// Words of the dictionary that are paid for.
    pub words: usize,
}

/// Torques that follow the command, each `n` values, rms near that of the command.
#[must_use]
pub fn of_the_command(torque: &[f64]) -> Vec<Vec<f64>> {
    let n = torque.len();
    let at = |k: usize, lag: usize| torque[k.saturating_sub(lag)];
    let mut words: Vec<Vec<f64>> =
        (0..=8).chain([10, 12, 16]).map(|lag| (0..n).map(|k| at(k, lag)).collect()).collect();
    for samples in [2.0, 4.0, 8.0, 16.0, 32.0, 64.0] {
        let keep = (-1.0_f64 / samples).exp();
        let mut y = torque.first().copied().unwrap_or(0.0);
        words.push(
            torque
                .iter()
                .map(|t| {
                    y = keep * y + (1.0 - keep) * t;
                    y
                })
                .collect(),
        );
    }
    let mut sizes: Vec<f64> = torque.iter().map(|t| t.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    for share in [0.3, 0.5, 0.65, 0.8, 0.9, 0.97] {
        let level = sizes[((n - 1) as f64 * share) as usize];
        words.push(torque.iter().map(|t| t.signum() * (t.abs() - level).max(0.0)).collect());
    }
    words
}

/// Torques that follow the motion at a place, rms near `scale`: of an inertia its own, of the coupling the twist's.
#[must_use]
pub fn of_the_motion(states: &[[f64; 4]], port: Port, scale: f64) -> Vec<Vec<f64>> {
    let n = states.len();
    let own = |i: usize| -> Vec<f64> {
        let of = |s: &[f64; 4]| match port {
            Port::Table => s[2 + i],
            Port::Coupling => s[i] - s[2 + i],
            _ => s[i],
        };
        states.iter().map(of).collect()
    };
    let (angle, speed) = (own(0), own(1));
    let fast = rms(&speed).max(f64::MIN_POSITIVE);
    let mut words: Vec<Vec<f64>> = Vec::new();
    let mut push = |f: &dyn Fn(usize) -> f64| words.push((0..n).map(|k| scale * f(k)).collect());
    push(&|_| 1.0);
    push(&|k| k as f64 / n as f64);
    push(&|k| speed[k] / fast);
    push(&|k| (speed[k] / fast).abs());
    push(&|k| speed[k] * speed[k].abs() / (fast * fast));
    for width in [0.003, 0.01, 0.03, 0.1, 0.3, 1.0] {
        push(&|k| (speed[k] / (width * fast)).tanh());
    }
    push(&|k| (k as f64 / n as f64) * (speed[k] / (0.01 * fast)).tanh());
    push(&|k| (k as f64 / n as f64) * speed[k] / fast);
    if port == Port::Coupling {
        // A characteristic of the spring: cubic, and with levels it takes effect from; and one that changes with time.
        let wide = rms(&angle).max(f64::MIN_POSITIVE);
        push(&|k| (angle[k] / wide).powi(3));
        push(&|k| (k as f64 / n as f64) * angle[k] / wide);
        for level in [0.1, 0.3, 0.6, 1.0, 1.5, 2.0] {
            push(&|k| (angle[k] / wide - level).max(0.0) - (-angle[k] / wide - level).max(0.0));
        }
    } else {
        for order in 1..=6 {
            let h = f64::from(order);
            push(&|k| (h * angle[k]).sin());
            push(&|k| (h * angle[k]).cos());
        }
    }
    // Stop operators: the way since a reversal, up to a limit (Prandtl's model of presliding).
    let travel = angle.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>() / n.max(1) as f64;
    for samples in [3.0, 10.0, 30.0, 100.0] {
        let limit = samples * travel.max(f64::MIN_POSITIVE);
        let mut z: f64 = 0.0;
        let mut before = angle.first().copied().unwrap_or(0.0);
        let stop: Vec<f64> = angle
            .iter()
            .map(|a| {
                z = (z + a - before).clamp(-limit, limit);
                before = *a;
                z / limit
            })
            .collect();
        push(&|k| stop[k]);
    }
    words
}

/// The hypothesis with the part that a dictionary explains taken out of its unknown torque; the dictionary's torques
/// act where the hypothesis has its port, or, when `commanded`, along with the command.
#[must_use]
pub fn follow(setting: &Setting<'_>, start: &Fitted, words: &[Vec<f64>], commanded: bool) -> Followed {
    let mut best = Followed { fitted: start.clone(), words: 0 };
    let mut explained = vec![0.0; setting.record.len()];
    let mut record: Record = setting.record.clone();
    for _ in 0..ROUNDS {
        let now = &best.fitted;
        let here = Setting { record: &record, known: (!commanded).then(|| explained.clone()), ..setting.clone() };
        let track = here.track::<5>(now);
        let base = track.whitened();
        let mut columns: Vec<Vec<f64>> = words.iter().map(|w| track.answer(w, commanded)).collect();
        let (moves, priors) = here.directions::<5>(now, &track, &base);
        columns.extend(moves);
        let Some(x) = least_squares(&columns, &base, words.len(), &priors) else { break };
        let mut next = here.stepped(now, &x.as_slice()[words.len()..]);
        let mut more = explained.clone();
        for (word, c) in words.iter().zip(x.iter()) {
            for (t, w) in more.iter_mut().zip(word) {
                *t += c * w;
            }
        }
        let changed = if commanded {
            let torque = setting.record.torque.iter().zip(&more).map(|(t, m)| t + m).collect();
            Record { torque, ..record.clone() }
        } else {
            record.clone()
        };
        let there = Setting { record: &changed, known: (!commanded).then(|| more.clone()), ..setting.clone() };
        there.settle(&mut next);
        let gained = next.log_likelihood - now.log_likelihood;
        if gained <= 0.0 {
            break;
        }
        best = Followed { fitted: next, words: words.len() };
        (record, explained) = (changed, more);
        if gained < 1.0 {
            break;
        }
    }
    best
}

/// `min |base + columns*x|^2` with a unit prior on the first `words` and the given ones on the rest, as
/// `(value, standard deviation)` of what is moved.
fn least_squares(columns: &[Vec<f64>], base: &[f64], words: usize, priors: &[(f64, f64)]) -> Option<DVector<f64>> {
    let m = columns.len();
    let mut normal = DMatrix::<f64>::zeros(m, m);
    let mut right = DVector::<f64>::zeros(m);
    for a in 0..m {
        for b in 0..=a {
            let dot = kalman::dot(&columns[a], &columns[b]);
            normal[(a, b)] = dot;
            normal[(b, a)] = dot;
        }
        right[a] = -kalman::dot(&columns[a], base);
        let (value, std) = if a < words { (0.0, 1.0) } else { priors[a - words] };
        normal[(a, a)] += std.powi(-2);
        right[a] -= value * std.powi(-2);
    }
    normal.cholesky().map(|c| c.solve(&right))
}
