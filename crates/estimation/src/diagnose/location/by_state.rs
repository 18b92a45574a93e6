//! The residual against the state: its mean in bins of a speed, an angle, the twist, the torque (restoring-force surface
//! in one variable: Masri & Caughey, J. Appl. Mech. 46, 1979).

use std::f64::consts::TAU;

use super::{CELLS, Side};

/// One bin.
#[derive(Debug, Clone, PartialEq)]
pub struct Bin {
    /// Mean of the variable in the bin.
    pub x: f64,
    /// Mean of the residual.
    pub mean: f64,
    /// Standard deviation of the residual about the mean.
    pub std: f64,
    /// Samples in the bin.
    pub count: usize,
}

/// A residual against one variable.
#[derive(Debug, Clone, PartialEq)]
pub struct StateCurve {
    /// The residual.
    pub residual: Side,
    /// The variable it stands against.
    pub against: StateVariable,
    /// Bins with equally many samples, in the order of the variable.
    pub bins: Vec<Bin>,
    /// Share of the residual's variance about its mean that the curve explains, 0 to 1.
    pub explained: f64,
}

/// A variable of the motion, or the torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StateVariable {
    /// Speed of the motor.
    Omega1,
    /// Angle of the motor within its turn.
    Turn1,
    /// Angle of the motor.
    Theta1,
    /// Torque.
    Torque,
    /// Speed of the table.
    Omega2,
    /// Angle of the table within its turn.
    Turn2,
    /// Angle of the table.
    Theta2,
    /// Twist of the coupling.
    Twist,
    /// Rate of the twist.
    TwistRate,
}

/// The angle within its turn, rad.
#[must_use]
pub fn within_turn(angles: &[f64]) -> Vec<f64> {
    angles.iter().map(|a| a.rem_euclid(TAU)).collect()
}

/// The curve of a residual against a variable; `None` with too few samples or a variable that does not change.
#[must_use]
pub fn curve(residual: Side, r: &[f64], against: StateVariable, x: &[f64]) -> Option<StateCurve> {
    let n = r.len();
    if n < 4 * CELLS {
        return None;
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
    if x[order[n - 1]] <= x[order[0]] {
        return None;
    }
    let total_mean = r.iter().sum::<f64>() / n as f64;
    let total: f64 = r.iter().map(|v| (v - total_mean).powi(2)).sum();
    let mut bins = Vec::with_capacity(CELLS);
    let mut between = 0.0;
    for i in 0..CELLS {
        let members = &order[i * n / CELLS..(i + 1) * n / CELLS];
        let count = members.len();
        let mean = members.iter().map(|k| r[*k]).sum::<f64>() / count as f64;
        let variance = members.iter().map(|k| (r[*k] - mean).powi(2)).sum::<f64>() / count as f64;
        between += count as f64 * (mean - total_mean).powi(2);
        bins.push(Bin {
            x: members.iter().map(|k| x[*k]).sum::<f64>() / count as f64,
            mean,
            std: variance.sqrt(),
            count,
        });
    }
    let explained = if total > 0.0 { between / total } else { 0.0 };
    Some(StateCurve { residual, against, bins, explained })
}

/// What a curve looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Two levels, one for each sign of the variable.
    Step,
    /// A straight line.
    Line,
    /// Odd, neither a step nor a line.
    Odd,
    /// The same on both sides.
    Even,
    /// None of these.
    Other,
}

/// The shape of a curve against a variable that takes both signs.
///
/// Each shape is fitted to the bins (a constant beside it), and the best of step and line wins when it takes 95 % of the
/// curve's variance; else the parity of the curve about zero decides.
#[must_use]
pub fn shape(curve: &StateCurve) -> Shape {
    let bins = &curve.bins;
    let n = bins.len() as f64;
    let scale = bins.iter().fold(0.0_f64, |m, b| m.max(b.x.abs())).max(f64::MIN_POSITIVE);
    let share = |f: &dyn Fn(f64) -> f64| {
        let fx: Vec<f64> = bins.iter().map(|b| f(b.x / scale)).collect();
        let (mf, mr) = (fx.iter().sum::<f64>() / n, bins.iter().map(|b| b.mean).sum::<f64>() / n);
        let (mut ff, mut fr, mut rr) = (0.0, 0.0, 0.0);
        for (f, b) in fx.iter().zip(bins) {
            ff += (f - mf).powi(2);
            fr += (f - mf) * (b.mean - mr);
            rr += (b.mean - mr).powi(2);
        }
        if ff > 0.0 && rr > 0.0 { fr * fr / (ff * rr) } else { 0.0 }
    };
    let (step, line) = (share(&f64::signum), share(&|x| x));
    if step.max(line) > 0.95 {
        return if step > line { Shape::Step } else { Shape::Line };
    }
    let odd = share(&|x| x).max(step).max(share(&|x| x.powi(3)));
    let even = share(&|x| x * x).max(share(&f64::abs));
    if odd > 0.6 && odd > even {
        Shape::Odd
    } else if even > 0.6 {
        Shape::Even
    } else {
        Shape::Other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(f: impl Fn(f64) -> f64) -> StateCurve {
        let x: Vec<f64> = (0..4096).map(|k| 3.0 * (f64::from(k) * 0.7).sin()).collect();
        let r: Vec<f64> = x.iter().map(|x| f(*x)).collect();
        curve(Side::Motor, &r, StateVariable::Omega1, &x).unwrap()
    }

    #[test]
    fn a_curve_explains_what_depends_on_its_variable_and_nothing_else() {
        assert!(of(|x| x.powi(3)).explained > 0.98);
        let x: Vec<f64> = (0..4096).map(|k| (f64::from(k) * 0.7).sin()).collect();
        let r: Vec<f64> = (0..4096).map(|k| (f64::from(k) * 1.9).cos()).collect();
        // 24 bins of a residual that does not depend on x: 23/4095 by chance.
        assert!(curve(Side::Motor, &r, StateVariable::Omega1, &x).unwrap().explained < 0.02);
    }

    #[test]
    fn step_line_odd_and_even_curves_are_named() {
        assert_eq!(shape(&of(|x| 0.3 - x.signum())), Shape::Step);
        assert_eq!(shape(&of(|x| 2.0 * x + 1.0)), Shape::Line);
        assert_eq!(shape(&of(|x| x.powi(5))), Shape::Odd);
        assert_eq!(shape(&of(|x| x * x)), Shape::Even);
    }
}
