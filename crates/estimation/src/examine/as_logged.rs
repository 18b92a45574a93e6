//! The record as logged against another reading of its columns: the encoders exchanged, the torque at another time.
//!
//! ```text
//! T = I1*a1 + B*d' + K*d + c*v1 + F*sign(v1) + k*x1 + g*sin(x1) + h*cos(x1) + b      I1, B, K, c, F >= 0
//! ```
//!
//! with the twist `d = x1 - x2`, rad (m), where the table is measured, and the sine and cosine of a weight's torque where the angle turns far
//! enough. The tests by spectra know of no weight and of no load: where these and friction are nearly all of the torque, as at slow triangles, a
//! wrong order of the encoders or a late torque brings them nearer to the equations that they have. Another reading is believed where it leaves
//! much less of the torque than the columns as they are, both with all that acts on a motor.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::Input;
use super::least::non_negative;
use super::motion::{Direction, acceleration, speed};
use super::rigid::{MAX_RESIDUAL, SAMPLES, SIGNIFICANTLY_WORSE, turns_a_weight};
use super::smoothing::{smoothed, widths};
use crate::identify::lsq::triangularise;

/// Whether the columns as logged explain most of the torque with a smoothing, and those of `other` with none much more of it than they do. A
/// wide smoothing leaves of the motion what any reading explains, so that each width is compared with itself. Where even as much friction and
/// load as there may be explains less, the question is open: false.
fn explains_as_well_as(input: &Input<'_>, other: &Input<'_>) -> bool {
    let (logged, other) = (unexplained_at_widths(input), unexplained_at_widths(other));
    let most = |share: &f64| *share < MAX_RESIDUAL;
    let better = |(logged, other): (&f64, &f64)| most(other) && *logged > SIGNIFICANTLY_WORSE * other;
    logged.iter().any(most) && !logged.iter().zip(&other).any(better)
}

/// Whether the record explains its torque about as well as with the two encoders exchanged.
pub(super) fn explains_as_well_as_exchanged(input: &Input<'_>) -> bool {
    explains_as_well_as(input, &Input { theta1: input.theta2, theta2: input.theta1, ..*input })
}

/// Whether the record explains its torque about as well as with a motion that comes `late` samples behind it (before it, where negative).
pub(super) fn explains_as_well_as_late(input: &Input<'_>, late: i32) -> bool {
    let by = late.unsigned_abs() as usize;
    let n = input.len();
    if by >= n {
        return false;
    }
    let (first, last) = (0..n - by, by..n);
    let (torque, motion) = if late > 0 { (first, last) } else { (last, first) };
    let shifted = Input {
        torque: input.torque.map(|v| &v[torque]),
        theta1: input.theta1.map(|v| &v[motion.clone()]),
        theta2: input.theta2.map(|v| &v[motion]),
        ..*input
    };
    explains_as_well_as(input, &shifted)
}

/// Shares of the torque's variance that the equation leaves with the smoothings of all widths, the narrowest first; all of it with one that
/// does not determine the coefficients.
fn unexplained_at_widths(input: &Input<'_>) -> Vec<f64> {
    let (x, table) = input.theta1.map_or((input.theta2, None), |x| (Some(x), input.theta2));
    let (Some(torque), Some(x)) = (input.torque, x) else { return Vec::new() };
    let widths: Vec<usize> = widths(x.len()).collect();
    let shares = widths.into_par_iter().map(|width| {
        let [t, x] = [torque, x].map(|v| smoothed(v, width));
        let table = table.map(|y| smoothed(y, width));
        unexplained(input, &t, &x, table.as_deref()).unwrap_or(1.0)
    });
    shares.collect()
}

/// The share for smoothed columns.
fn unexplained(input: &Input<'_>, t: &[f64], x: &[f64], table: Option<&[f64]>) -> Option<f64> {
    let dt = input.dt;
    let direction = Direction::of_angle(x, dt);
    let middle = x[x.len() / 2];
    let rows: Vec<usize> = (1..x.len() - 1).step_by((x.len() / SAMPLES).max(1)).collect();
    // Coefficients of either sign are taken out of the torque and of the columns whose coefficients have one.
    let either = if turns_a_weight(input, x) { 4 } else { 2 };
    let positive = if table.is_some() { 5 } else { 3 };
    let triangle = triangularise(rows.len(), either, 1 + positive, |i, out| {
        let k = rows[i];
        let v = speed(x, k, dt);
        let [twist, twisting] = table.map_or([0.0; 2], |y| [x[k] - y[k], v - speed(y, k, dt)]);
        let of_position = [1.0, x[k] - middle, x[k].sin(), x[k].cos()];
        let of_motion = [acceleration(x, k, dt), v, direction.at(v), twist, twisting];
        out[..either].copy_from_slice(&of_position[..either]);
        out[either] = t[k];
        out[either + 1..].copy_from_slice(&of_motion[..positive]);
    });
    let left = triangle.solve().ok()?.residual;
    let mean = rows.iter().map(|k| t[*k]).sum::<f64>() / rows.len() as f64;
    let total: f64 = rows.iter().map(|k| (t[*k] - mean).powi(2)).sum();
    let share = (left[(0, 0)] - explained_by_positive(&left)) / total;
    share.is_finite().then_some(share)
}

/// What coefficients of at least zero explain of the first of some columns by the others, from the columns' products.
fn explained_by_positive(products: &DMatrix<f64>) -> f64 {
    let p = products.nrows() - 1;
    let size: Vec<f64> = (1..=p).map(|i| products[(i, i)].sqrt().max(f64::MIN_POSITIVE)).collect();
    let gram: Vec<Vec<f64>> =
        (0..p).map(|i| (0..p).map(|k| products[(i + 1, k + 1)] / size[i] / size[k]).collect()).collect();
    let right: Vec<f64> = (0..p).map(|i| products[(i + 1, 0)] / size[i]).collect();
    non_negative(&gram, &right).1
}
