//! What is known of an effect without running it.

use super::extent::Extent;
use super::family::Family;

/// Odds, times its own, of an effect that the motion does not show again ([`super::Effect::repeats`]); those of the pull of a cover, a hose, a
/// cable.
pub const ONCE: f64 = 0.02;

/// The place in the chain where an effect acts.
///
/// ```text
/// command --> [input] --> T --> [motor: I1] == [coupling: K, B] == [table: I2] --> [sensor] --> trace
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Place {
    /// Between the command and the torque on the motor.
    Input,
    /// On the motor's inertia.
    Motor,
    /// Between the two inertias, equal and opposite.
    Coupling,
    /// On the table's inertia.
    Table,
    /// Between the motion and the log.
    Sensor,
}

impl Place {
    /// All places, in the order of the chain.
    pub const ALL: [Self; 5] = [Self::Input, Self::Motor, Self::Coupling, Self::Table, Self::Sensor];

    /// The name used in files.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Motor => "motor",
            Self::Coupling => "coupling",
            Self::Table => "table",
            Self::Sensor => "sensor",
        }
    }

    /// The side whose motion an effect goes with that acts here: 1, the table's, for what acts on it or misreads it; 0 for any other.
    #[must_use]
    pub const fn side(self) -> usize {
        matches!(self, Self::Table | Self::Sensor) as usize
    }
}

/// Whether a parameter makes the effect, or shapes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The effect is on when any of its sizes differs from its off value.
    Size,
    /// Means nothing while the effect is off.
    Shape,
}

/// Where a fit of the parameter starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// The torque is proportional to it: linear regression gives the start.
    Linear,
    /// The phase of a periodic torque whose amplitude is the parameter before: linear regression gives both.
    Phase,
    /// The torque is proportional to it times the first size, besides the size's own torque: linear regression gives both.
    Share,
    /// Each of these multiples of the scale is tried.
    Grid(Scale, &'static [f64]),
    /// Inertia, stiffness or damping of a mode: the spectra of motion and residual give all three together.
    Mode,
    /// Its off value; a variant that frees it starts from there.
    Off,
}

/// What a start is a multiple of, taken from the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// The plain number.
    One,
    /// Root mean square speed at the effect's place.
    Speed,
    /// Root mean square twist.
    Twist,
    /// Largest torque.
    Torque,
    /// Root mean square rotation about the mean at the effect's place.
    Rotation,
    /// The sampling interval.
    Sample,
    /// Periods per radian, as far as the travel and the sampling let them be seen.
    Order,
    /// Frequencies in Hz, as the record lets them be seen.
    Frequency,
    /// The travel: a share of it below the upper end, or (negative) above the lower end; 0.5 is its middle.
    Travel,
}

/// A form of an effect that is fitted as one hypothesis: which parameters are free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variant {
    /// Name, for people; empty for the plain form.
    pub name: &'static str,
    /// Indices of the free parameters.
    pub free: &'static [usize],
}

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterInfo {
    /// Name, unique in its effect; the FMU's name is `effect.parameter`.
    pub name: &'static str,
    /// Unit of the rotary axis.
    pub unit: &'static str,
    /// Size or shape.
    pub role: Role,
    /// The start value: for a size, the value that means the effect is off.
    pub off: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// A typical magnitude.
    pub nominal: f64,
    /// Where a fit starts.
    pub start: Start,
    /// One sentence.
    pub doc: &'static str,
}

impl EffectInfo {
    /// Whether a form frees all that another one does, and more.
    #[must_use]
    pub fn frees_more(&self, form: usize, than: usize) -> bool {
        form != than && self.variants[than].free.iter().all(|i| self.variants[form].free.contains(i))
    }

    /// Whether a form frees all that an earlier one does, and more: it says two things at once.
    #[must_use]
    pub fn is_richer(&self, form: usize) -> bool {
        (0..form).any(|plain| self.frees_more(form, plain))
    }
}

impl ParameterInfo {
    /// A size whose off value is zero.
    #[must_use]
    pub const fn size(name: &'static str, unit: &'static str, min: f64, max: f64, doc: &'static str) -> Self {
        Self { name, unit, role: Role::Size, off: 0.0, min, max, nominal: 1.0, start: Start::Linear, doc }
    }

    /// A shape with its start value.
    #[must_use]
    pub const fn shape(
        name: &'static str,
        unit: &'static str,
        start: f64,
        min: f64,
        max: f64,
        doc: &'static str,
    ) -> Self {
        Self { name, unit, role: Role::Shape, off: start, min, max, nominal: 1.0, start: Start::Off, doc }
    }

    /// Whether a torque is proportional to it: a torque itself, or one per angle, speed or acceleration.
    #[must_use]
    pub fn is_torque(&self) -> bool {
        self.unit.starts_with("N.m") || self.unit.starts_with("kg.m2")
    }

    /// The same with another start of the fit.
    #[must_use]
    pub const fn start(self, start: Start) -> Self {
        Self { start, ..self }
    }

    /// The same with another typical magnitude.
    #[must_use]
    pub const fn nominal(self, nominal: f64) -> Self {
        Self { nominal, ..self }
    }
}

/// What an effect is.
#[derive(Debug, Clone, Copy)]
pub struct EffectInfo {
    /// Name used in files and on the command line.
    pub id: &'static str,
    /// Where it acts.
    pub place: Place,
    /// Its kind.
    pub family: Family,
    /// One sentence for people.
    pub title: &'static str,
    /// Its equation, as text.
    pub equation: &'static str,
    /// What it leaves in the residual torques of the nominal model, `r1 = I1*alpha1 + B*(omega1 - omega2) +
    /// K*(theta1 - theta2) - T` and `r2 = I2*alpha2 - B*(omega1 - omega2) - K*(theta1 - theta2)`.
    pub signature: &'static str,
    /// Literature.
    pub reference: &'static str,
    /// Its parameters.
    pub parameters: &'static [ParameterInfo],
    /// Number of internal states (force effects).
    pub memory: usize,
    /// Whether a diagnosis may name it. Not so: what another verdict covers, and what is known from the log's resolution.
    pub named: bool,
    /// Whether it belongs to the textbook's friction model, which the regression of a rigid axis estimates and whose combinations a
    /// diagnosis always compares.
    pub textbook: bool,
    /// Prior odds that it is the cause, relative to the other effects of the list.
    pub odds: f64,
    /// Whether parameters are physically possible on a record of this extent.
    pub bounds: fn(&[f64], &Extent<'_>) -> bool,
    /// Its parameters at a size that shows on the paper's axis: what every effect is tested with.
    pub example: &'static [f64],
    /// The forms a diagnosis fits, the simplest first.
    pub variants: &'static [Variant],
}
