//! The variables that do not come from the list of effects.

use super::{Causality, Enumeration, Type, Variability, Variable};
use crate::axis::Parameters;

const STRUCTURE: Enumeration = Enumeration {
    name: "Structure",
    doc: "Number of inertias",
    items: &[
        ("two_inertia", "Motor and table joined by spring and damper (paper, eq. 2)"),
        ("rigid", "One inertia I1 + I2: theta2 = theta1"),
    ],
};

const SCHEME: Enumeration = Enumeration {
    name: "Scheme",
    doc: "Integration of the linear part over an internal step",
    items: &[
        ("newmark", "Newmark's method in acceleration form (paper, appendix 1)"),
        ("exact", "Exact response to a torque linear over the step (matrix exponential)"),
    ],
};

/// The internal step of the paper's simulation, s (Table 1).
const DT: f64 = 5.626e-4;
/// Smallest inertia, and other values that must be greater than zero.
const POSITIVE: f64 = 1e-12;

/// A real parameter without bounds, start value or description yet.
pub(super) const BLANK: Variable = Variable {
    reference: 0,
    group: "",
    name: "",
    kind: Type::Real,
    causality: Causality::Parameter,
    variability: Variability::Tunable,
    unit: "",
    min: None,
    max: None,
    nominal: 1.0,
    start: None,
    doc: "",
};

/// An output that varies continuously.
pub(super) const fn output(name: &'static str, unit: &'static str, nominal: f64, doc: &'static str) -> Variable {
    Variable { name, unit, nominal, doc, causality: Causality::Output, variability: Variability::Continuous, ..BLANK }
}

const fn parameter(name: &'static str, unit: &'static str, start: f64, min: f64, doc: &'static str) -> Variable {
    Variable { name, unit, start: Some(start), min: Some(min), nominal: start, doc, ..BLANK }
}

/// A start value of the motion.
const fn start(name: &'static str, unit: &'static str, doc: &'static str) -> Variable {
    Variable { name, unit, start: Some(0.0), variability: Variability::Fixed, doc, ..BLANK }
}

const fn choice(name: &'static str, kind: &'static Enumeration, doc: &'static str) -> Variable {
    Variable {
        name,
        kind: Type::Enumeration(kind),
        start: Some(1.0),
        min: Some(1.0),
        max: Some(kind.items.len() as f64),
        variability: Variability::Fixed,
        doc,
        ..BLANK
    }
}

const fn weight(name: &'static str, start: f64, doc: &'static str) -> Variable {
    Variable {
        group: "newmark",
        name,
        unit: "1",
        start: Some(start),
        min: Some(0.0),
        max: Some(1.0),
        variability: Variability::Fixed,
        doc,
        ..BLANK
    }
}

const PAPER: Parameters = Parameters::PAPER;

slots! {
    Slot in FIXED:
    Torque = Variable {
        name: "T",
        unit: "N.m",
        nominal: 1e-2,
        start: Some(0.0),
        causality: Causality::Input,
        variability: Variability::Continuous,
        doc: "Torque command: held over the communication step, or linear where its derivative is set",
        ..BLANK
    };
    Theta1 = output("theta1", "rad", 1.0, "Angle of motor and screw, as its encoder reads it");
    Omega1 = output("omega1", "rad/s", 10.0, "Speed of motor and screw");
    Alpha1 = output("alpha1", "rad/s2", 100.0, "Acceleration of motor and screw, under the torque of now");
    Theta2 = output("theta2", "rad", 1.0, "Angle of the table side, as its encoder reads it");
    Omega2 = output("omega2", "rad/s", 10.0, "Speed of the table side");
    Alpha2 = output("alpha2", "rad/s2", 100.0, "Acceleration of the table side");
    X2 = output("x2", "m", 1e-3, "Position of the table: rho*theta2");
    I1 = parameter("I1", "kg.m2", PAPER.i1, POSITIVE, "Inertia of motor and screw");
    I2 = parameter("I2", "kg.m2", PAPER.i2, 0.0, "Equivalent inertia of the table; zero for a rigid axis only");
    B = parameter("B", "N.m.s/rad", PAPER.b, 0.0, "Damping of the coupling");
    K = parameter("K", "N.m/rad", PAPER.k, 0.0, "Stiffness of the coupling");
    Rho = Variable { min: None, ..parameter("rho", "m/rad", PAPER.rho, 0.0, "Lead of the screw per radian") };
    Structure = choice("structure", &STRUCTURE, "One inertia or two");
    Scheme = choice("scheme", &SCHEME, "How the linear part is integrated");
    NewmarkAlpha = weight("alpha", 0.25, "Newmark's alpha: weight of the new acceleration in the position");
    NewmarkDelta = weight("delta", 0.5, "Newmark's delta: weight of the new acceleration in the velocity; second order at 1/2 only");
    DtInternal = Variable {
        max: Some(1e3),
        ..parameter(
            "dt_internal",
            "s",
            DT,
            // At this, a communication step of one second is about a second of work; nothing on an axis is as fast.
            1e-6,
            "Longest internal step: a communication step is cut into equal steps no longer than this",
        )
    };
    Theta1Start = start("theta1_0", "rad", "Angle of the motor at the start");
    Omega1Start = start("omega1_0", "rad/s", "Speed of the motor at the start");
    Theta2Start = start("theta2_0", "rad", "Angle of the table side at the start; a rigid axis starts from theta1_0");
    Omega2Start = start("omega2_0", "rad/s", "Speed of the table side at the start; a rigid axis starts from omega1_0");
}
