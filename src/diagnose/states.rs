//! Motion along a record, from the measured positions: local cubics.
//!
//! Savitzky, Golay, Analytical Chemistry 36(8), 1964: the least-squares cubic over `2*HALF + 1` samples gives position,
//! speed and acceleration at its middle.

use super::fit::{Data, predict};
use super::location::smooth_states;
use super::model::Model;
use super::record::Record;
use super::response::States;
use super::windows::Initial;
use crate::axis::Structure;
use crate::effects::{EFFECTS, Settings};

/// Half width of the fit, samples.
const HALF: i64 = 6;

/// The motion along a record of the model's axis.
///
/// A side without an encoder is taken from the smoother, which knows the axis and allows for unknown torques.
#[must_use]
pub fn along(record: &Record, model: &Model) -> States {
    let mut states = from_positions(record);
    let unseen: Vec<usize> = [0, 2].into_iter().filter(|c| record.channels[*c].is_none()).collect();
    if unseen.is_empty() || model.structure == Structure::Rigid {
        return states;
    }
    let smoothed = smooth_states(record, &model.parameters, model.structure).states;
    let n = record.len();
    for side in unseen {
        for k in 0..n {
            states.motion[k][side..side + 2].copy_from_slice(&smoothed[k][side..side + 2]);
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            let rise = smoothed[b][side + 1] - smoothed[a][side + 1];
            states.acceleration[k][side / 2] = rise / ((b - a) as f64 * record.dt);
        }
    }
    states
}

/// The motion as a fitted model runs through it, free of noise and of what the encoders make of it; samples that no
/// window compares keep what was `measured`.
#[must_use]
pub fn of_model(data: Data<'_>, model: &Model, initial: &[Initial], measured: &States) -> States {
    let mut bare = *model;
    for effect in EFFECTS.iter().filter(|e| e.is_sensor()) {
        bare.effects.of_mut(*effect).copy_from_slice(Settings::default().of(*effect));
    }
    let mut states = measured.clone();
    let run = predict(data, &bare, initial);
    for (_, k, reading) in &run {
        states.motion[*k] = *reading;
    }
    for pair in run.windows(3).filter(|p| p[0].0 == p[2].0) {
        for (side, acceleration) in states.acceleration[pair[1].1].iter_mut().enumerate() {
            *acceleration = (pair[2].2[2 * side + 1] - pair[0].2[2 * side + 1]) / (2.0 * data.record.dt);
        }
    }
    states
}

/// The motion at every sample; a side without an encoder moves as the other.
fn from_positions(record: &Record) -> States {
    let n = record.len();
    let m = HALF;
    let (mut s0, mut s2, mut s4) = (0.0, 0.0, 0.0);
    for j in -m..=m {
        let q = (j * j) as f64;
        s0 += 1.0;
        s2 += q;
        s4 += q * q;
    }
    let mut s6 = 0.0;
    for j in -m..=m {
        s6 += ((j * j) as f64).powi(3);
    }
    let d = s0 * s4 - s2 * s2;
    let e = s2 * s6 - s4 * s4;
    let mut s = States { motion: vec![[0.0; 4]; n], acceleration: vec![[0.0; 2]; n] };
    for k in 0..n {
        let c = (k as i64).clamp(m, n as i64 - 1 - m);
        let off = (k as i64 - c) as f64;
        for side in [0, 2] {
            let pos = record.channels[side].as_ref().or(record.channels[2 - side].as_ref());
            let Some(pos) = pos else { continue };
            let (mut y0, mut y1, mut y2, mut y3) = (0.0, 0.0, 0.0, 0.0);
            let y_ref = pos[c as usize];
            for j in -m..=m {
                let y = pos[(c + j) as usize] - y_ref;
                let jf = j as f64;
                y0 += y;
                y1 += y * jf;
                y2 += y * jf * jf;
                y3 += y * jf * jf * jf;
            }
            let a0 = (s4 * y0 - s2 * y2) / d;
            let a2 = (s0 * y2 - s2 * y0) / d;
            let a1 = (s6 * y1 - s4 * y3) / e;
            let a3 = (s2 * y3 - s4 * y1) / e;
            s.motion[k][side] = y_ref + a0 + off * (a1 + off * (a2 + off * a3));
            s.motion[k][side + 1] = (a1 + off * (2.0 * a2 + 3.0 * off * a3)) / record.dt;
            s.acceleration[k][side / 2] = (2.0 * a2 + 6.0 * off * a3) / record.dt.powi(2);
        }
    }
    s
}
