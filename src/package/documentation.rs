//! `documentation/index.html` of the FMU: the equations and every variable, from the table and the list of effects.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::units;
use crate::axis::AxisKind;
use crate::effects::{EFFECTS, Effect, Place};
use crate::fmu::description::Fmi;
use crate::variables::{Causality, FIXED, Model, Starts, Type, Variable, at, first_of};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;\
color:#1a1a1a;background:#fff}table{border-collapse:collapse;width:100%;margin:1rem 0}th,td{text-align:left;\
vertical-align:top;padding:.25rem .6rem;border-bottom:1px solid #ccc}td.n{text-align:right;font-variant-numeric:\
tabular-nums;white-space:nowrap}pre{background:#f4f4f4;padding:.8rem;overflow-x:auto}img{max-width:100%}\
@media(prefers-color-scheme:dark){body{color:#e6e6e6;background:#161616}pre{background:#242424}th,td{border-color:#444}\
img{background:#fff}a{color:#8ab4f8}}";

const EQUATIONS: &str = "I1*alpha1 + B*(omega1 - omega2) + K*(theta1 - theta2) = T - f1\n\
I2*alpha2 - B*(omega1 - omega2) - K*(theta1 - theta2) = -f2\n\
x2 = rho*theta2";

const NEWMARK: &str = "theta+ = theta + h*omega + h^2*((1/2 - alpha)*a + alpha*a+)\n\
omega+ = omega + h*((1 - delta)*a + delta*a+)";

const LAW: &str = "w* = kp*(r - theta) + velocity_forward*r'\n\
T  = kv*(w* - omega) + ki*int(w* - omega) + acceleration_forward*inertia*r'',   |T| <= limit";

/// The page for a model of that name.
pub(super) fn page(name: &str, starts: &Starts, fmi: Fmi) -> String {
    let page = page_of_two(name, starts);
    match fmi {
        Fmi::Two => page,
        // There are no input derivatives in FMI 3.0.
        Fmi::Three => page.replace("an FMI 2.0 co-simulation unit", "an FMI 3.0 co-simulation unit").replace(
            ", or runs linearly where its first derivative is set (fmi2SetRealInputDerivatives), for that step",
            "",
        ),
    }
}

fn page_of_two(name: &str, starts: &Starts) -> String {
    let body = match starts.model {
        Model::Axis => axis(name, starts),
        Model::Drive => drive(name, starts),
    };
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (name) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    }
    .into_string()
}

fn drive(name: &str, starts: &Starts) -> Markup {
    html! {
        h1 { (name) }
        p {
            "The drive of a machine tool's axis as an FMI 2.0 co-simulation unit: it reads where the table shall be and where the encoders \
             say that it is, and commands a torque."
        }
        h2 { "Equations" }
        pre { (LAW) }
        p {
            "r = reference/rho is the reference as an angle; r' and r'' are its backward differences over the samples. The integral \
             does not grow while it would drive the limited torque further into its limit."
        }
        h2 { "Steps" }
        p {
            "The drive samples its inputs at the start and after each " code { "sample_time" } ", whatever the communication step. What it \
             computes is put out when the next sample is due, which is the time that a drive needs to compute, and held from there; up to \
             then the torque is zero. Make the communication step the sampling interval, or a whole part of it."
        }
        h2 { "Variables" }
        (table(starts.model.all().enumerate().map(|(i, v)| (v, starts.values[i])), starts.motion))
    }
}

fn axis(name: &str, starts: &Starts) -> Markup {
    html! {
        h1 { (name) }
        p {
            "The drive axis of a machine tool as an FMI 2.0 co-simulation unit: the inertia of motor and screw and \
             the inertia of the table, joined by a spring and a damper, with effects that are all "
            @if starts.values[FIXED.len()..] == Starts::default().values[FIXED.len()..] { "off" } @else { "as set below" }
            " at the start."
        }
        img src="model.png" alt="Motor and screw, coupling with spring and damper, table";
        (equations())
        (stepping())
        h2 { "Variables" }
        (table(FIXED.iter().enumerate().map(|(i, v)| (*v, starts.values[i])), starts.motion))
        h2 { "Effects" }
        p {
            "An effect is on when one of its sizes differs from the value given here as off. All parameters of an \
             effect may be changed between steps."
        }
        @for place in Place::ALL {
            h3 { "At the " (place.as_str()) }
            @for &effect in EFFECTS.iter().filter(|e| e.info().place == place) {
                @let info = effect.info();
                h4 id=(info.id) { code { (info.id) } ": " (info.title) }
                pre { (info.equation) }
                (table((0..info.parameters.len()).map(|j| {
                    let index = first_of(effect) + j;
                    (at(index), starts.values[index])
                }), starts.motion))
                p { small { (info.reference) } }
            }
        }
    }
}

fn equations() -> Markup {
    html! {
        h2 { "Equations" }
        pre { (EQUATIONS) }
        p {
            "f1 and f2 are the torques of the effects on either inertia; an effect of the coupling acts on both, equal and \
             opposite. A rigid axis ("
            code { "structure = rigid" }
            ") has one inertia I1 + I2 and theta2 = theta1. The linear analogue (kg, N, m) is the same model in other units."
        }
    }
}

fn stepping() -> Markup {
    html! {
        h2 { "Steps" }
        p {
            "A communication step of any length is cut into equal internal steps no longer than "
            code { "dt_internal" }
            ". By default each is Newmark's method in acceleration form with alpha = 1/4 and delta = 1/2, which is of second \
             order:"
        }
        pre { (NEWMARK) }
        p {
            "The effects' torques at the end of a step follow from Newton's method; reversals under dry friction and \
             contacts of backlash are located in time. The torque T is held over the communication step, or runs linearly \
             where its first derivative is set (fmi2SetRealInputDerivatives), for that step. When T jumps, the accelerations \
             are evaluated anew before the step. Delays remember the last 255 internal steps ("
            @for (k, effect) in late_readings().enumerate() {
                @if k > 0 { " and " }
                code { (effect.info().id) }
            }
            ": 127); a step that would need more is refused."
        }
    }
}

/// The effects that look back into past readings.
fn late_readings() -> impl Iterator<Item = Effect> {
    EFFECTS.iter().copied().filter(|e| e.info().place == Place::Sensor && e.delay_parameter().is_some())
}

fn table(rows: impl Iterator<Item = (Variable, f64)>, motion: AxisKind) -> Markup {
    html! {
        table {
            thead { tr { th { "Name" } th { "Unit" } th { "Start" } th { "From" } th { "To" } th { "Meaning" } } }
            tbody {
                @for (v, start) in rows {
                    tr {
                        td { code { (v) } }
                        td { (units::of(v.unit, motion)) }
                        td.n { @if v.causality != Causality::Output { (value(&v, start)) } }
                        td.n { @if v.kind == Type::Real { (bound(v.min)) } }
                        td.n { @if v.kind == Type::Real { (bound(v.max)) } }
                        td { (v.doc) @if let Type::Enumeration(kind) = v.kind {
                            @for (name, doc) in kind.items { br; code { (name) } ": " (doc) }
                        } }
                    }
                }
            }
        }
    }
}

fn value(v: &Variable, start: f64) -> String {
    match v.kind {
        Type::Real => format!("{start:?}"),
        Type::Enumeration(kind) => kind.items.get(start as usize - 1).map_or_else(String::new, |i| i.0.to_owned()),
    }
}

fn bound(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| format!("{v:?}"))
}
