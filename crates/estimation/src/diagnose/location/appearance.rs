//! What a residual torque looks like: the state it depends on, a frequency of its own, its spread over the record.

use super::Side;
use super::by_frequency::{FrequencyPart, PartOf};
use super::by_state::{Shape, StateCurve, StateVariable, shape};
use super::by_time::Spread;

/// A curve or a part of the spectrum is told from this share of the residual on.
const REPORTED: f64 = 0.5;
/// Of two variables that explain alike to within this share, the earlier in the list is told.
const ALIKE: f64 = 0.03;

/// What a residual looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// What it depends on; `None` where no variable of the motion explains half of it.
    pub dependence: Option<Dependence>,
    /// A frequency that holds most of it; `None` without one.
    pub frequency: Option<OwnFrequency>,
    /// How it spreads over the record.
    pub spread: Spread,
}

/// A residual as a function of one variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dependence {
    /// The function's shape.
    pub shape: Shape,
    /// The variable.
    pub against: StateVariable,
    /// Share of the residual's variance that it explains.
    pub explained: f64,
}

/// A frequency that holds most of a residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OwnFrequency {
    /// A harmonic of the motor's turn.
    OfTheTurn {
        /// Periods in a turn.
        order: usize,
        /// Share of the residual's energy.
        share: f64,
    },
    /// One that the excitation does not hold, Hz.
    Foreign(f64),
}

/// The variables that are looked at first: those of the residual's own side of the chain.
const fn own(side: Side) -> [StateVariable; 4] {
    use StateVariable::{Omega1, Omega2, Theta1, Theta2, Torque, Turn1, Turn2, Twist};
    match side {
        Side::Motor => [Omega1, Turn1, Theta1, Torque],
        Side::Table => [Omega2, Turn2, Theta2, Twist],
    }
}

/// What the residual depends on, by the curve that explains most of it.
pub fn dependence(curves: &[StateCurve], side: Side) -> Option<Dependence> {
    let all = || curves.iter().filter(|c| c.residual == side);
    let most = all().map(|c| c.explained).fold(0.0, f64::max);
    let rank = |c: &&StateCurve| own(side).iter().position(|v| *v == c.against).unwrap_or(own(side).len());
    let best = all().filter(|c| c.explained >= most - ALIKE).min_by_key(rank)?;
    (best.explained >= REPORTED).then(|| Dependence {
        shape: shape(best),
        against: best.against,
        explained: best.explained,
    })
}

/// A single frequency that is not the excitation's, or a harmonic of the turn.
pub fn frequency(parts: &[FrequencyPart], side: Side) -> Option<OwnFrequency> {
    let all = || parts.iter().filter(|p| p.residual == side);
    let orders = all().filter_map(|p| match p.of {
        PartOf::Turn(order) => Some((order, p.share)),
        _ => None,
    });
    if let Some((order, share)) = orders.max_by(|a, b| a.1.total_cmp(&b.1))
        && share > REPORTED
    {
        return Some(OwnFrequency::OfTheTurn { order, share });
    }
    let part = all().find(|p| p.of == PartOf::Foreign)?;
    let line = part.peak_rms * part.peak_rms / (part.rms * part.rms).max(f64::MIN_POSITIVE);
    (part.share > REPORTED && line > REPORTED).then_some(OwnFrequency::Foreign(part.peak))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(against: StateVariable, explained: f64) -> StateCurve {
        StateCurve { residual: Side::Motor, against, bins: Vec::new(), explained }
    }

    fn part(of: PartOf, share: f64, peak_rms: f64) -> FrequencyPart {
        FrequencyPart { residual: Side::Motor, of, from: 1.0, to: 2.0, rms: 1.0, share, peak: 1.5, peak_rms }
    }

    #[test]
    fn of_variables_that_explain_alike_the_residuals_own_comes_first() {
        let curves =
            [curve(StateVariable::Twist, 0.91), curve(StateVariable::Omega1, 0.89), curve(StateVariable::Torque, 0.6)];
        let found = dependence(&curves, Side::Motor).unwrap();
        assert_eq!((found.against, found.explained), (StateVariable::Omega1, 0.89));
        assert_eq!(dependence(&curves[2..], Side::Motor).unwrap().against, StateVariable::Torque);
        assert_eq!(dependence(&curves, Side::Table), None, "another residual's curves");
        assert_eq!(dependence(&[curve(StateVariable::Omega1, 0.49)], Side::Motor), None);
    }

    #[test]
    fn a_harmonic_of_the_turn_goes_before_a_foreign_line_and_a_broad_part_is_no_line() {
        let (order, line) = (part(PartOf::Turn(3), 0.7, 0.8), part(PartOf::Foreign, 0.9, 0.9));
        let turn = OwnFrequency::OfTheTurn { order: 3, share: 0.7 };
        assert_eq!(frequency(&[line.clone(), order.clone()], Side::Motor), Some(turn));
        assert_eq!(frequency(std::slice::from_ref(&line), Side::Motor), Some(OwnFrequency::Foreign(1.5)));
        let broad = FrequencyPart { peak_rms: 0.5, ..line };
        assert_eq!(frequency(&[broad], Side::Motor), None);
        assert_eq!(frequency(&[FrequencyPart { share: 0.4, ..order }], Side::Motor), None);
    }
}
