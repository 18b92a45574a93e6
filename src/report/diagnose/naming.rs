//! Hypotheses, effects and signals as people call them.

use crate::diagnose::location::{Side, StateVariable};
use crate::diagnose::{ClosureOf, Diagnosis, HeldOut, Hypothesis, Verdict};
use crate::effects::EffectInfo;

/// A hypothesis in words.
pub fn title(hypothesis: &Hypothesis) -> String {
    match hypothesis {
        Hypothesis::NoGap => "nothing: the model as it is".to_owned(),
        Hypothesis::Parameters => "parameters only".to_owned(),
        // A title has an "and" of its own.
        Hypothesis::Effects(effects) => {
            let mut titles = effects.iter().map(|e| short_title(e.info()));
            let first = titles.next().unwrap_or_default().to_owned();
            titles.fold(first, |all, title| format!("{all} + {}", lower(title)))
        }
    }
}

/// The title up to its first colon or comma.
pub fn short_title(info: &EffectInfo) -> &'static str {
    info.title.split([':', ',']).next().unwrap_or(info.title)
}

/// The same within a sentence.
pub fn lower(text: &str) -> String {
    let mut chars = text.chars();
    let first_word_is_a_name = text.starts_with("Coulomb");
    match chars.next() {
        Some(c) if !first_word_is_a_name => c.to_lowercase().chain(chars).collect(),
        _ => text.to_owned(),
    }
}

/// What the model at its best is called.
pub fn improved(d: &Diagnosis) -> &'static str {
    match (d.verdict, d.causes.len()) {
        (Verdict::Effect, 2..) => "with the effects",
        (Verdict::Effect, _) => "with the effect",
        (Verdict::Unexplained, 2..) => "with the nearest effects",
        (Verdict::Unexplained, _) => "with the nearest effect",
        (Verdict::Parameters | Verdict::NoGap, _) => "re-identified",
    }
}

/// What the held-out data are.
pub const fn held_out(what: HeldOut) -> &'static str {
    match what {
        HeldOut::SecondRecord => "a second record",
        HeldOut::LastThird => "the last third of the record",
    }
}

/// A way of measuring the gap, as the head of a column.
pub const fn way(of: ClosureOf) -> &'static str {
    match of {
        ClosureOf::FreeRun => "free run",
        ClosureOf::Windows => "windows",
        ClosureOf::Torque => "torque",
    }
}

/// Unit of a residual torque on a rotary axis.
pub const RESIDUAL: &str = "N.m";

/// A variable of the motion, and its unit on a rotary axis.
pub const fn variable(v: StateVariable) -> (&'static str, &'static str) {
    match v {
        StateVariable::Omega1 => ("omega1", "rad/s"),
        StateVariable::Turn1 => ("theta1 within the turn", "rad"),
        StateVariable::Theta1 => ("theta1", "rad"),
        StateVariable::Torque => ("T", "N.m"),
        StateVariable::Omega2 => ("omega2", "rad/s"),
        StateVariable::Turn2 => ("theta2 within the turn", "rad"),
        StateVariable::Theta2 => ("theta2", "rad"),
        StateVariable::Twist => ("twist", "rad"),
        StateVariable::TwistRate => ("twist rate", "rad/s"),
    }
}

/// A residual torque.
pub const fn residual(side: Side) -> &'static str {
    match side {
        Side::Motor => "residual torque on the motor",
        Side::Table => "residual torque on the table",
    }
}
