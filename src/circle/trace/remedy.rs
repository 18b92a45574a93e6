//! What to do about a deviation: on the machine, and in its control.
//!
//! Names of parameters: Siemens SINUMERIK 840D sl (machine data), Heidenhain iTNC 530 and TNC 426/430 (MP numbers; newer
//! controls name them in words), Fanuc Series 16i/18i/21i, 0i, 30i (parameter numbers). Where a control has no one
//! parameter for it, the text is what to look for.

use super::deviation::Kind;

/// What to do about a deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Remedy {
    /// The part of the machine to look at first.
    pub mechanics: &'static str,
    /// What its control can do about it, in words.
    pub control: &'static str,
    /// The parameter of a Siemens control.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub siemens: Option<&'static str>,
    /// The parameter of a Heidenhain control.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heidenhain: Option<&'static str>,
    /// The parameter of a Fanuc control.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fanuc: Option<&'static str>,
}

const fn of(mechanics: &'static str, control: &'static str) -> Remedy {
    Remedy { mechanics, control, siemens: None, heidenhain: None, fanuc: None }
}

/// What to do about a deviation of this kind.
#[must_use]
pub const fn remedy(kind: Kind) -> Remedy {
    match kind {
        Kind::Backlash(_) => Remedy {
            siemens: Some("MD32450 BACKLASH"),
            heidenhain: Some("MP710 (motor encoder), MP750 (scale)"),
            fanuc: Some("1851 (cutting feed), 1852 (rapid)"),
            ..of(
                "preload of the screw's nut and of its fixed bearing, coupling, end play of the screw; a negative play is an \
                 over-compensation",
                "backlash compensation of the axis, by the play found here in addition to what is set",
            )
        },
        Kind::Spikes(_) => Remedy {
            siemens: Some("MD32500 FRICT_COMP_ENABLE, MD32520 FRICT_COMP_CONST_MAX"),
            heidenhain: Some("MP711 to MP716, compensation of reversal spikes"),
            fanuc: Some("2003#5 (backlash acceleration on), 2048 (its amount)"),
            ..of(
                "friction of guides, wipers and nut: lubrication, preload, gibs",
                "friction (quadrant error) compensation; a stiffer velocity loop. An inward spike is an over-compensation",
            )
        },
        Kind::Squareness => Remedy {
            siemens: Some("sag and angularity compensation: MD32710 CEC_ENABLE and its table"),
            ..of(
                "alignment of the guides of X and Y to one another, levelling of the bed",
                "squareness or cross-axis compensation, by the angle found here",
            )
        },
        Kind::Diagonal => of(
            "measure the other direction too: what keeps its sign is squareness, what turns with the direction is the drives",
            "nothing before that is known",
        ),
        Kind::Scaling => Remedy {
            siemens: Some("leadscrew error compensation: MD32700 ENC_COMP_ENABLE and its table"),
            heidenhain: Some("MP720 (linear axis error), chosen by MP730"),
            fanuc: Some("3620 to 3624 and the pitch error table"),
            ..of(
                "warm or worn screw, stretched screw, scale at another temperature than the table; at one feed alone, a \
                 difference of the drives' gains looks the same: repeat at a tenth of the feed",
                "linear or pitch error compensation of the axis that is off",
            )
        },
        Kind::Servo => Remedy {
            siemens: Some(
                "MD32200 POSCTRL_GAIN alike on both; MD32900 DYN_MATCH_ENABLE, MD32910 DYN_MATCH_TIME on the faster",
            ),
            heidenhain: Some("MP1510 (feedforward) or MP1810 (lag): kv alike on both"),
            fanuc: Some("1825 (position gain) alike on both"),
            ..of(
                "an axis that is harder to move, a soft drive train, a loop that was tuned alone",
                "the same position gain, feed-forward and filters on both axes; the faster axis is slowed to match",
            )
        },
        Kind::Cyclic(_) => Remedy {
            siemens: Some("MD32700 ENC_COMP_ENABLE, with points far closer than the pitch"),
            ..of(
                "by its pitch: the lead of the screw is the screw or its bearings, the belt's or the gear's tooth is that drive, \
                 a motor's pole pair is its cogging, a signal period is the scale or encoder",
                "pitch error compensation where its points are close enough; cogging compensation of the drive for a motor's torque",
            )
        },
        Kind::Lateral(_) => of(
            "play across the guide of the axis: gibs, carriages, their preload and mounting",
            "no parameter corrects it",
        ),
        Kind::Straightness(_) => Remedy {
            siemens: Some("sag compensation: MD32710 CEC_ENABLE and its table"),
            ..of(
                "the guide of the axis is bent: levelling, mounting of the rail, the table's weight at its ends; a scale error \
                 that grows with the square of the other axis' position looks the same",
                "straightness (cross-axis) compensation",
            )
        },
        Kind::StickSlip(_) => of(
            "friction that falls as the speed rises: lubrication, worn guide coating, too tight a gib",
            "a stiffer velocity loop with its integral; friction compensation does not cure it",
        ),
        Kind::Vibration => of(
            "a source of that frequency: spindle, pump, fan, a neighbouring machine, or a resonance of the axis",
            "a notch (current set-point filter) at that frequency where it is a resonance; a lower velocity gain",
        ),
        Kind::Remainder => {
            of("several turns, at two feeds: what repeats is the machine, what does not is the measurement", "nothing")
        }
    }
}
