//! The deviations that a circular test can show: their names, measures and sizes.

use super::shapes::Axis;

/// What deviates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Lost motion of an axis.
    Backlash(Axis),
    /// Short peaks behind the reversals of an axis.
    Spikes(Axis),
    /// X and Y are not at right angles.
    Squareness,
    /// An ellipse at 45 degrees of which one direction alone is known.
    Diagonal,
    /// X and Y have unlike scales.
    Scaling,
    /// X and Y are unlike in time.
    Servo,
    /// A sine of the position.
    Cyclic(Axis),
    /// Play across a guide.
    Lateral(Axis),
    /// A bent guide.
    Straightness(Axis),
    /// Jerks while an axis creeps.
    StickSlip(Axis),
    /// A sine of the time.
    Vibration,
    /// What none of these explains.
    Remainder,
}

impl Kind {
    /// Its name in files.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Self::Backlash(Axis::X) => "backlash_x",
            Self::Backlash(Axis::Y) => "backlash_y",
            Self::Spikes(Axis::X) => "reversal_spikes_x",
            Self::Spikes(Axis::Y) => "reversal_spikes_y",
            Self::Squareness => "squareness",
            Self::Diagonal => "diagonal_ellipse",
            Self::Scaling => "scaling_mismatch",
            Self::Servo => "servo_mismatch",
            Self::Cyclic(Axis::X) => "cyclic_error_x",
            Self::Cyclic(Axis::Y) => "cyclic_error_y",
            Self::Lateral(Axis::X) => "lateral_play_x",
            Self::Lateral(Axis::Y) => "lateral_play_y",
            Self::Straightness(Axis::X) => "straightness_x",
            Self::Straightness(Axis::Y) => "straightness_y",
            Self::StickSlip(Axis::X) => "stick_slip_x",
            Self::StickSlip(Axis::Y) => "stick_slip_y",
            Self::Vibration => "vibration",
            Self::Remainder => "remainder",
        }
    }

    /// Its name for X and Y together; none where it is of no one axis.
    #[must_use]
    pub const fn of_both(self) -> Option<&'static str> {
        match self {
            Self::Backlash(_) => Some("backlash of X and Y"),
            Self::Spikes(_) => Some("reversal spikes of X and Y"),
            Self::Cyclic(_) => Some("cyclic errors of X and Y"),
            Self::Lateral(_) => Some("lateral play of X and Y"),
            Self::Straightness(_) => Some("straightness of X and Y"),
            _ => None,
        }
    }

    /// Its name in words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Backlash(Axis::X) => "backlash X",
            Self::Backlash(Axis::Y) => "backlash Y",
            Self::Spikes(Axis::X) => "reversal spikes X",
            Self::Spikes(Axis::Y) => "reversal spikes Y",
            Self::Squareness => "squareness",
            Self::Diagonal => "squareness or servo mismatch",
            Self::Scaling => "scaling mismatch",
            Self::Servo => "servo mismatch",
            Self::Cyclic(Axis::X) => "cyclic error X",
            Self::Cyclic(Axis::Y) => "cyclic error Y",
            Self::Lateral(Axis::X) => "lateral play X",
            Self::Lateral(Axis::Y) => "lateral play Y",
            Self::Straightness(Axis::X) => "straightness X",
            Self::Straightness(Axis::Y) => "straightness Y",
            Self::StickSlip(Axis::X) => "stick-slip X",
            Self::StickSlip(Axis::Y) => "stick-slip Y",
            Self::Vibration => "vibration",
            Self::Remainder => "not explained",
        }
    }

    /// What its size is.
    #[must_use]
    pub const fn measure(self) -> Measure {
        match self {
            Self::Backlash(_) | Self::Lateral(_) => Measure::Play,
            Self::Spikes(_) => Measure::Height,
            Self::Squareness | Self::Scaling => Measure::Ratio,
            Self::Diagonal | Self::Servo | Self::Cyclic(_) | Self::Vibration => Measure::Amplitude,
            Self::Straightness(_) => Measure::Bow,
            Self::StickSlip(_) | Self::Remainder => Measure::Rms,
        }
    }
}

/// What a size is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// A whole play, m.
    Play,
    /// A height above the levels before and behind, m, outward positive.
    Height,
    /// An angle or a difference of lengths, m/m.
    Ratio,
    /// An amplitude, m.
    Amplitude,
    /// The height of a bow over the diameter, m.
    Bow,
    /// A root of the mean square, m.
    Rms,
}

impl Measure {
    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Play => "play",
            Self::Height => "largest height",
            Self::Ratio => "per metre",
            Self::Amplitude => "amplitude",
            Self::Bow => "bow",
            Self::Rms => "rms",
        }
    }

    /// The unit that it is shown in, of which a metre (or metre per metre) has a million.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Ratio => "um/m",
            _ => "um",
        }
    }
}

impl Effect {
    /// The key of the ranking: the contribution alone, or half of the contribution together with the same on the other axis, m.
    #[must_use]
    pub fn weight(&self) -> f64 {
        self.pair.map_or(self.contribution, |both| self.contribution.max(0.5 * both))
    }
}

/// One deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// What it is.
    pub kind: Kind,
    /// Its size in the SI unit of its measure. A play is positive where the table stays behind; an angle is positive where
    /// +X and +Y enclose more than 90 degrees; a scaling or servo mismatch where X is longer or later.
    pub size: f64,
    /// Standard error of the size, where it comes from the fit.
    pub error: Option<f64>,
    /// The circularity without it, m.
    pub without: f64,
    /// What it takes of the circularity, m: negative where it hides another.
    pub contribution: f64,
    /// What it takes together with the same on the other axis, m: where X and Y are alike, one alone takes next to nothing,
    /// as the other still holds the ring open.
    pub pair: Option<f64>,
    /// The play at the positive and at the negative end, m.
    pub ends: Option<[f64; 2]>,
    /// Heights at +X, +Y, -X, -Y of each turn, m.
    pub heights: Vec<[f64; 4]>,
    /// Length of a cycle along the axis, m.
    pub pitch: Option<f64>,
    /// Cycles to the turn.
    pub per_turn: Option<f64>,
    /// Frequency, Hz, where the feed is known.
    pub frequency: Option<f64>,
    /// How much later X is than Y, s, where the feed is known.
    pub late: Option<f64>,
}
