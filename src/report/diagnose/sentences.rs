//! The sentences of a diagnosis: pure functions of the typed result.

use super::naming::{lower, short_title, title, variable};
use super::percent;
use crate::diagnose::location::{Appearance, Location, OwnFrequency, Shape, Spread};
use crate::diagnose::{
    AxisParameter, BaseParameter, Cause, ClosedLoop, ClosureOf, Confusable, Diagnosis, LoopRanked, RoundingRole,
    UNCAUSED, Undecided, Verdict,
};
use crate::effects::{Contrast, Effect};
use crate::report::format::{self, Medium};
use crate::trace::AxisKind;
use crate::trace::machine::NOMINAL_OFF;

/// The verdict in a sentence.
pub fn sentence(d: &Diagnosis) -> String {
    let percent = |v: f64| format!("{:.1} %", 100.0 * v.clamp(-9.99, 1.0));
    let gap = if d.gap.closure_of == ClosureOf::Torque { "the gap in torque" } else { "the gap" };
    match d.verdict {
        Verdict::NoGap if d.remainder.share > UNCAUSED => in_the_noise(d),
        Verdict::NoGap if d.remainder.noise_multiple > REMAINS => format!(
            "No gap: no cause stands out in the {} of the torque that the model as given leaves.",
            percent(d.remainder.share)
        ),
        Verdict::NoGap => "No gap: the model as given explains the record down to the noise.".to_owned(),
        Verdict::Parameters if !d.causes.is_empty() => {
            "Parameters: every nominal parameter is off by the same factor, as from a wrong torque constant.".to_owned()
        }
        Verdict::Parameters if d.gap.closure < 0.0 => {
            "Parameters: the structure is right, its parameters are off by the fitted record; the held-out record contradicts it: the error \
             grows there."
                .to_owned()
        }
        Verdict::Parameters => format!(
            "Parameters: the structure is right, its parameters are off; with them fitted {} of {gap} closes.",
            percent(d.gap.closure)
        ),
        Verdict::Effect => {
            let describe = |c: &Cause| {
                let info = c.effect.info();
                format!("{} ({}, at the {})", info.title, info.id, c.site.as_str())
            };
            let names = d.causes.iter().map(describe).collect::<Vec<_>>().join(", and ");
            let sentence = if d.gap.closure < 0.0 {
                format!("{names}, by the fitted record; the held-out record contradicts it: the error grows there.")
            } else {
                format!("{names}: {} of {gap} on held-out data closes with it.", percent(d.gap.closure))
            };
            [sentence].into_iter().chain(undecided(d)).collect::<Vec<_>>().join(" ")
        }
        Verdict::Unexplained if is_rounding(d) => {
            "Unexplained: what is left is the rounding of the readings, which is not among the effects that may be named."
                .to_owned()
        }
        Verdict::Unexplained => {
            let nearest = d.ranking.iter().find(|r| !r.hypothesis.effects().is_empty());
            let nearest = nearest.map_or_else(String::new, |r| {
                let closed = Some(r.closure_holdout).filter(|c| *c > 0.0).map_or_else(|| "nothing".to_owned(), percent);
                format!(" The nearest, {}, closes {closed}.", r.hypothesis)
            });
            match either(d) {
                Some(pair) => format!("Unexplained: a gap is there, and this record does not tell {pair}.{nearest}"),
                None => format!("Unexplained: a gap is there, and nothing in the library closes it.{nearest}"),
            }
        }
    }
}

/// What acts in addition to the causes named, where the record does not distinguish which of several effects it is, or whether it is one.
pub fn undecided(d: &Diagnosis) -> Option<String> {
    let open = d.undecided.as_ref().filter(|_| d.verdict == Verdict::Effect)?;
    let share = percent(open.share_of_gap);
    Some(match open.effects[..] {
        [_] => format!(
            "Beside that something acts that looks like {}, not clearly enough to be named; {share} of the gap.",
            names_of(open)
        ),
        _ => format!(
            "Beside that acts one of these, and the record does not tell which: {}; {share} of the gap.",
            names_of(open)
        ),
    })
}

/// The effects of which one acts.
pub fn names_of(open: &Undecided) -> String {
    open.effects.iter().map(|e| lower(short_title(e.info()))).collect::<Vec<_>>().join(" or ")
}

/// Two causes of unlike families that explain the gap of an unexplained record alike.
pub fn either(d: &Diagnosis) -> Option<String> {
    if d.verdict != Verdict::Unexplained {
        return None;
    }
    d.confusable.iter().find(|c| c.named.info().family != c.other.info().family).map(distinguished)
}

/// Which effects could not be distinguished.
fn distinguished(c: &Confusable) -> String {
    let name = |e: Effect| lower(short_title(e.info()));
    format!("{} from {}", name(c.named), name(c.other))
}

/// No gap of a record whose noise makes more torque than the model leaves.
pub fn in_the_noise(d: &Diagnosis) -> String {
    format!(
        "No gap that this record could show: what the model leaves, {:.1} % of the torque, is no more than what the encoders' noise makes.",
        100.0 * d.remainder.share
    )
}

/// Whether all that is left is rounding, and that may not be named.
fn is_rounding(d: &Diagnosis) -> bool {
    d.rounding.as_ref().is_some_and(|r| r.role == RoundingRole::Withheld)
}

/// What to measure next.
pub fn next_experiment(d: &Diagnosis) -> &'static str {
    let named = d.chosen.effects().iter().take(1).copied();
    let all = named.chain(d.confusable.iter().flat_map(|c| [c.named, c.other]));
    let contrasts: Vec<Contrast> = all.filter_map(|e| e.info().family.contrast()).collect();
    let has = |c: Contrast| contrasts.contains(&c);
    match d.verdict {
        Verdict::NoGap => "None needed: drive the axis harder or over more of its travel to look for smaller effects.",
        Verdict::Parameters => "Put the fitted parameters into axis.toml and diagnose a second record.",
        Verdict::Unexplained if is_rounding(d) => "Log the positions with a finer step.",
        Verdict::Unexplained if either(d).is_none() => {
            "Repeat the record at half and at twice the amplitude with an odd multisine (eixo excite --kind odd): even \
             lines that light up tell asymmetry and offsets, odd ones friction and play; a fixed frequency that stays \
             is an outside disturbance."
        }
        Verdict::Effect if d.confusable.is_empty() => {
            "None needed to name the cause. Confirm it with a record at another amplitude, and re-run with it in axis.toml."
        }
        _ if d.confusable.iter().any(Confusable::is_of_place) => {
            "Log the encoders on both sides of the coupling: which side a force acts on shows in what the two \
             readings do to each other."
        }
        _ if has(Contrast::Twist) => {
            "Drive the coupling harder near its resonance, at two amplitudes: play shrinks in relative terms, a cubic \
             spring grows, a loop stays open at any speed."
        }
        _ if has(Contrast::Phase) => {
            "Excite a higher band: a delay's phase grows with frequency, a lag's bends and its gain falls."
        }
        _ if has(Contrast::Reversals) => {
            "Use an odd multisine with slow reversals in both directions: an offset lights up even lines, friction odd ones."
        }
        _ => {
            "Repeat with an odd multisine at two amplitudes (eixo excite --kind odd); the two causes scale differently."
        }
    }
}

/// Why two effects cannot be distinguished.
pub fn alike(c: &Confusable) -> String {
    format!("their fits differ by {:.1} in BIC on this record", 2.0 * c.difference)
}

/// What the user should know of the data, of a motion that is known.
pub fn warnings(d: &Diagnosis, motion: Option<AxisKind>) -> Vec<String> {
    let unit = motion.map_or_else(String::new, |m| format!(" {}", m.unit("rad")));
    let rounding = d.rounding.iter().map(|r| {
        let channels = r.channels.join(" and ");
        format!("{channels} read in steps of {:.3e}{unit}; the noise floor holds their rounding.", r.step)
    });
    let cut_short = d.cut_short.then(|| {
        "The search for causes ended at its limit of work: not every one of them was exchanged for every other. Diagnose a shorter \
         part (--from, --to) to have all of it."
            .to_owned()
    });
    let given = d.motion_is_given.then(|| {
        "With the torque taken as it was logged no model of this axis follows the motion: what is told is of the torque that the \
         measured motion takes. An effect of an encoder, a dead zone, a torque limit and a friction that changes are not looked \
         for so."
            .to_owned()
    });
    rounding.chain(run_off(d)).chain(cut_short).chain(given).collect()
}

/// That the inertia that fits is far from the nominal one, whatever else was found.
fn run_off(d: &Diagnosis) -> Option<String> {
    let inertia = |of: &dyn Fn(&AxisParameter) -> f64| -> f64 {
        d.parameters.iter().filter(|p| matches!(p.parameter, BaseParameter::I1 | BaseParameter::I2)).map(of).sum()
    };
    let ratio = inertia(&|p| p.fitted.value) / inertia(&|p| p.nominal);
    (!(1.0 / NOMINAL_OFF..NOMINAL_OFF).contains(&ratio) && ratio.is_finite()).then(|| {
        format!(
            "The inertia that fits this record is {} times the nominal one: check the units and signs of the log, its torque constant and \
             [parameters] of the axis file before anything else.",
            significant(ratio)
        )
    })
}

/// Where the gap shows, of a motion that is known.
pub fn gap_shows(l: &Location, motion: Option<AxisKind>) -> String {
    let unit = motion.map_or_else(String::new, |m| format!(" {}", m.unit("N.m")));
    format!(
        "With its parameters fitted alone, the model lacks {}{unit} rms in torque, {}.",
        significant(l.rms),
        looks(&l.looks)
    )
}

/// What a residual looks like.
pub fn looks(a: &Appearance) -> String {
    let dependence = a.dependence.map(|d| {
        let of = variable(d.against).0;
        let form = match d.shape {
            Shape::Step => format!("flat against the sign of {of}"),
            Shape::Line => format!("linear in {of}"),
            Shape::Odd => format!("an odd function of {of}"),
            Shape::Even => format!("an even function of {of}"),
            Shape::Other => format!("a function of {of}"),
        };
        format!("{form} ({:.0} % of its variance)", 100.0 * d.explained)
    });
    let frequency = a.frequency.map(|f| match f {
        OwnFrequency::OfTheTurn { order, share } => {
            format!("{order} times per turn of the motor ({:.0} % of its energy)", 100.0 * share)
        }
        OwnFrequency::Foreign(hertz) => {
            format!("mostly at {} Hz, which the excitation does not hold", significant(hertz))
        }
    });
    let spread = match a.spread {
        Spread::Throughout => "throughout the record",
        Spread::Grows => "growing over the record",
        Spread::Falls => "falling over the record",
        Spread::Events => "in a few events rather than throughout",
    };
    dependence.into_iter().chain(frequency).chain([spread.to_owned()]).collect::<Vec<_>>().join(", ")
}

/// Three significant digits.
fn significant(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let digits = 2 - v.abs().log10().floor() as i32;
    if (0..6).contains(&digits) { format!("{v:.*}", digits as usize) } else { format!("{v:.2e}") }
}

/// Multiple of the noise from which a remainder is worth a sentence.
pub const REMAINS: f64 = 1.5;

/// What no cause explains, in a sentence; none where it is little.
pub fn remainder(d: &Diagnosis, motion: AxisKind) -> Option<String> {
    let r = Some(&d.remainder).filter(|r| r.noise_multiple > REMAINS)?;
    let opening = if d.causes.is_empty() { "No cause explains" } else { "Beside that no cause explains" };
    Some(format!(
        "{opening} {} {} rms of torque at the {} ({} of the torque, {} times what the encoders' noise makes): {}.",
        format::number(r.torque_rms, 3, Medium::Page),
        motion.unit("N.m"),
        r.site.as_str(),
        percent(r.share),
        if r.noise_multiple < 1000.0 {
            format::number(r.noise_multiple, 2, Medium::Page)
        } else {
            "more than a thousand".to_owned()
        },
        looks(&r.looks)
    ))
}

/// Why the gap is measured as it is; none where the strictest measure could be used.
pub fn why_this_way(d: &Diagnosis) -> Option<String> {
    let off = |of: ClosureOf| percent(d.gap.ways.iter().find(|w| w.of == of).map_or(f64::NAN, |w| w.levels.after));
    match d.gap.closure_of {
        ClosureOf::FreeRun => None,
        ClosureOf::Windows => Some(format!(
            "The model's free run does not follow the whole held-out record (it is off by {} of the signal): a small error adds up to a \
             large one. The closure is therefore that of windows, each run from a state fitted to it.",
            off(ClosureOf::FreeRun)
        )),
        ClosureOf::Torque => Some(format!(
            "The model's run does not follow the held-out record, neither freely (off by {} of the signal) nor in windows ({}): a small \
             torque adds up to a large position. The closure is therefore that of the torque that the model lacks when it is held to the \
             measured motion.",
            off(ClosureOf::FreeRun),
            off(ClosureOf::Windows)
        )),
    }
}

/// What the effects close beyond new parameters; none where no effect is named.
pub fn beyond_parameters(d: &Diagnosis) -> Option<String> {
    let measured = d.verdict == Verdict::Effect && d.gap.closure_of_effect.is_finite();
    measured.then(|| {
        format!(
            "Counted from the model whose parameters alone were fitted again, {} {} of what was left.",
            if d.causes.len() > 1 { "the effects close" } else { "the effect closes" },
            percent(d.gap.closure_of_effect)
        )
    })
}

/// The warning about two effects that are not distinguished.
pub fn not_distinguished(c: &Confusable) -> String {
    format!("These data do not tell {}: {}", distinguished(c), alike(c))
}

/// Whether the drive's loop agrees with the diagnosis.
pub fn in_the_loop(l: &ClosedLoop) -> String {
    let next: Option<&LoopRanked> = l.ranking.iter().find(|r| r.closure < l.closure && r.errors != l.after);
    match (l.agrees, l.ranking.first()) {
        (false, Some(best)) => format!(
            "The loop does not agree: {} closes {} of the command's gap, this {}.",
            title(&best.hypothesis),
            percent(best.closure),
            percent(l.closure)
        ),
        _ => format!(
            "The loop agrees: this closes {} of the command's gap, and nothing that was tried closes more{}.",
            percent(l.closure),
            next.map_or_else(String::new, |o| {
                format!("; next comes {} with {}", title(&o.hypothesis), percent(o.closure))
            })
        ),
    }
}

/// What to do next, in order.
pub fn steps(d: &Diagnosis) -> Vec<String> {
    let steps = [match d.verdict {
        Verdict::NoGap => {
            "Use the model as it is. A gap that this excitation does not show may still be there: repeat with the amplitudes and speeds of the real work."
        }
        Verdict::Parameters => "Put the re-identified parameters into the model.",
        Verdict::Effect if d.causes.len() > 1 => {
            "Put the effects into the model: the table above has their parameters for [effects] of axis.toml."
        }
        Verdict::Effect => {
            "Put the effect into the model: the table above has its parameters for [effects] of axis.toml."
        }
        Verdict::Unexplained if either(d).is_some() => "Change nothing on the machine yet: the next record is to tell.",
        Verdict::Unexplained => {
            "Look at the machine at the place marked; compare the pictures of the residual with what moves there."
        }
    }];
    steps.into_iter().map(str::to_owned).chain(how_to_distinguish(d)).chain([next_experiment(d).to_owned()]).collect()
}

/// Which causes the next experiment has to distinguish; none where all are distinguished.
fn how_to_distinguish(d: &Diagnosis) -> Option<String> {
    let name = |e: Effect| lower(short_title(e.info()));
    let pairs: Vec<String> = d.confusable.iter().map(|c| format!("{} or {}", name(c.named), name(c.other))).collect();
    (!pairs.is_empty() && (d.verdict == Verdict::Effect || either(d).is_some())).then(|| {
        format!(
            "Before you change the machine, find out which it is, for these data do not tell: {}.",
            pairs.join("; ")
        )
    })
}
