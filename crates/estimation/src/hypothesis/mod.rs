//! A hypothesis, a set of effects beside the axis' own parameters, fitted to a record; and its evidence.
//!
//! One likelihood ([`likelihood`]) with the sensors' noise and the model's own discrepancy in it: of the torque that a model lacks to
//! follow the record ([`tracking`]; [`arriving`] is the torque that drives it), in the band of its motion ([`band`]). [`problem`] is a
//! record so compared, [`columns`] how what a model lacks changes with each free value and [`secant`] how those are kept from step to step, [`descent`] the way to the likeliest of them and
//! [`fit`] where it ends; [`evidence`] how well the
//! record speaks for that, [`scatter`] how well it knows the parameters and [`determined`] which of them it does not, [`scales`] what of an
//! effect it could show, [`candidate`] what one would change and [`starts`] where a fit with one more begins, [`subsets`] where one with several at once does; on a rigid axis such fits are compared along the motion of one
//! run ([`inverse_dynamics`]), and one that went another way than the axis did along the motion as measured ([`measured`]). Which hypotheses are compared, and what is concluded from them, is [`crate::diagnose`]'s.

mod arriving;
pub(crate) mod band;
mod candidate;
mod columns;
pub(crate) mod descent;
pub(crate) mod determined;
pub(crate) mod discrepancy;
pub(crate) mod evidence;
pub(crate) mod fit;
pub(crate) mod hidden;
mod inverse_dynamics;
pub(crate) mod likelihood;
mod measured;
pub(crate) mod model;
mod parameters;
pub(crate) mod problem;
pub(crate) mod scales;
pub(crate) mod scatter;
mod secant;
mod series;
pub(crate) mod starts;
mod subsets;
pub(crate) mod tracking;
mod trajectory;

use std::fmt;

use crate::effects::Effect;
pub use fit::Fit;
pub use model::{BaseParameter, Model};

/// What a record is explained by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Hypothesis {
    /// The model as given.
    NoGap,
    /// Its parameters, fitted.
    Parameters,
    /// Effects beside them, in the order they were found.
    Effects(Vec<Effect>),
}

impl Hypothesis {
    /// Its effects.
    #[must_use]
    pub fn effects(&self) -> &[Effect] {
        match self {
            Self::Effects(effects) => effects,
            Self::NoGap | Self::Parameters => &[],
        }
    }
}

/// The name in files: ids joined by `+`, `parameters` or `no_gap`.
impl fmt::Display for Hypothesis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoGap => f.write_str("no_gap"),
            Self::Parameters => f.write_str("parameters"),
            Self::Effects(effects) => {
                let ids: Vec<&str> = effects.iter().map(|e| e.info().id).collect();
                f.write_str(&ids.join("+"))
            }
        }
    }
}
