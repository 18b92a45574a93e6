//! The parameters of the axis, from measured data or given, and its modal parameters.

use std::fmt;

use crate::scalar::Scalar;

/// The nominal parameters of the axis, SI units (rotary: kg.m2, N.m.s/rad, N.m/rad; linear analogue: kg, N.s/m, N/m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters<S = f64> {
    /// Inertia of motor and screw, kg.m2.
    pub i1: S,
    /// Equivalent inertia of the table, kg.m2; zero is allowed for a rigid axis only.
    pub i2: S,
    /// Damping of the coupling, N.m.s/rad.
    pub b: S,
    /// Stiffness of the coupling, N.m/rad.
    pub k: S,
    /// Lead of the screw per radian, m/rad: `x2 = rho*theta2`.
    pub rho: S,
}

/// One inertia or two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Structure {
    /// Motor and table joined by spring and damper.
    #[default]
    TwoInertia,
    /// One inertia `I1 + I2`: an axis whose flexible mode is out of reach of the record.
    Rigid,
}

/// Whether the axis is described in rotary units (kg.m2, rad, N.m) or by the paper's linear analogue (kg, m, N).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AxisKind {
    /// Inertias in kg.m2, angles in rad, torques in N.m.
    #[default]
    Rotary,
    /// Masses in kg, positions in m, forces in N.
    Linear,
}

impl AxisKind {
    /// The unit on this kind of axis in place of one of the rotary axis: an angle becomes a length, a torque a force, an inertia a mass.
    #[must_use]
    pub fn unit(self, rotary: &'static str) -> &'static str {
        const LINEAR: [(&str, &str); 11] = [
            ("kg.m2", "kg"),
            ("N.m", "N"),
            ("N.m/rad", "N/m"),
            ("N.m.s/rad", "N.s/m"),
            ("N.m.s2/rad2", "N.s2/m2"),
            ("N.m/s", "N/s"),
            ("rad", "m"),
            ("rad/s", "m/s"),
            ("1/rad", "1/m"),
            ("1/rad2", "1/m2"),
            ("N.m.s", "N.s"),
        ];
        match self {
            Self::Rotary => rotary,
            Self::Linear => LINEAR.iter().find(|(from, _)| *from == rotary).map_or(rotary, |(_, to)| to),
        }
    }
}

/// A parameter that the model cannot work with.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterError {
    /// Name of the parameter.
    pub name: &'static str,
    /// The value given.
    pub value: f64,
    /// What it must be.
    pub must_be: &'static str,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "parameter {} is {}: it must be {}", self.name, self.value, self.must_be)
    }
}

impl std::error::Error for ParameterError {}

impl Parameters {
    /// Table 3 of the paper: the reference parameters of the X axis.
    pub const PAPER: Self = Self { i1: 2.37e-4, i2: 6.07e-6, b: 5.4e-4, k: 1.76e-2, rho: 3.18e-4 };

    /// Checks signs and finiteness for the structure.
    ///
    /// # Errors
    /// Names the first parameter that is not finite, or not positive where it must be.
    pub fn check(&self, structure: Structure) -> Result<(), ParameterError> {
        let positive = "finite and greater than zero";
        let not_negative = "finite and not negative";
        let fail = |name, value, must_be| Err(ParameterError { name, value, must_be });
        if !(self.i1.is_finite() && self.i1 > 0.0) {
            return fail("I1", self.i1, positive);
        }
        let flexible = structure == Structure::TwoInertia;
        if !self.i2.is_finite() || self.i2 < 0.0 || (flexible && self.i2 == 0.0) {
            return fail("I2", self.i2, if flexible { positive } else { not_negative });
        }
        if !(self.b.is_finite() && self.b >= 0.0) {
            return fail("B", self.b, not_negative);
        }
        if !(self.k.is_finite() && self.k >= 0.0) {
            return fail("K", self.k, not_negative);
        }
        if !self.rho.is_finite() {
            return fail("rho", self.rho, "finite");
        }
        Ok(())
    }
}

impl<S: Scalar> Parameters<S> {
    /// The same parameters over another scalar, as constants.
    #[must_use]
    pub fn lift(p: &Parameters<f64>) -> Self {
        Self { i1: p.i1.into(), i2: p.i2.into(), b: p.b.into(), k: p.k.into(), rho: p.rho.into() }
    }

    /// Inertia that moves with motor and table, kg.m2: with either of a rigid axis all of it.
    #[must_use]
    pub fn inertias(&self, structure: Structure) -> [S; 2] {
        match structure {
            Structure::Rigid => [self.i1 + self.i2; 2],
            Structure::TwoInertia => [self.i1, self.i2],
        }
    }

    /// The same without derivatives.
    #[must_use]
    pub fn primal(&self) -> Parameters<f64> {
        Parameters { i1: self.i1.re(), i2: self.i2.re(), b: self.b.re(), k: self.k.re(), rho: self.rho.re() }
    }

    /// `1/I1 + 1/I2`: the inverse of the inertia that the twist sees.
    pub fn twist_mobility(&self) -> S {
        S::from(1.0) / self.i1 + S::from(1.0) / self.i2
    }

    /// Modal parameters (paper, 4.3.5 and eq. 11).
    ///
    /// `wn = sqrt(K*(1/I1 + 1/I2))`, `zeta = (B/2)*sqrt((1/I1 + 1/I2)/K)`, `wd = wn*sqrt(1 - zeta^2)`, the last zero
    /// where the mode is overdamped.
    pub fn modal(&self) -> Modal<S> {
        let mobility = self.twist_mobility();
        let wn = (self.k * mobility).sqrt();
        let zeta = self.b * 0.5 * (mobility / self.k).sqrt();
        let under = S::from(1.0) - zeta.squared();
        let wd = if under.re() > 0.0 { wn * under.sqrt() } else { S::default() };
        Modal { wn, zeta, wd }
    }
}

/// Modal parameters of the coupling's mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modal<S = f64> {
    /// Natural frequency, rad/s.
    pub wn: S,
    /// Damping ratio.
    pub zeta: S,
    /// Damped natural frequency, rad/s; zero where overdamped.
    pub wd: S,
}

/// What was measured on the axis with scale and ruler (paper, Table 2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhysicalData {
    /// Mass of the screw, kg.
    pub mf: f64,
    /// Radius of the screw, m.
    pub rf: f64,
    /// Mass of the rotor, kg.
    pub mr: f64,
    /// Radius of the rotor, m.
    pub rr: f64,
    /// Mass of the table, kg.
    pub mm: f64,
    /// Lead of the screw per radian, m/rad.
    pub rho: f64,
    /// Efficiency of the screw.
    pub eta: f64,
}

impl PhysicalData {
    /// Table 2 of the paper.
    pub const PAPER: Self = Self { mf: 0.58, rf: 8.0e-3, mr: 0.58, rr: 27.5e-3, mm: 30.0, rho: 3.18e-4, eta: 0.5 };

    /// `I1 = Mf*Rf^2/2 + Mr*Rr^2/2` (paper, eq. 3), kg.m2.
    #[must_use]
    pub fn i1(&self) -> f64 {
        0.5 * (self.mf * self.rf * self.rf + self.mr * self.rr * self.rr)
    }

    /// `psi = rho/eta`, m/rad: torque per force through the screw.
    #[must_use]
    pub fn psi(&self) -> f64 {
        self.rho / self.eta
    }

    /// `I2 = Mm*rho*psi` (paper, eq. 4), kg.m2.
    #[must_use]
    pub fn i2(&self) -> f64 {
        self.mm * self.rho * self.psi()
    }
}

#[cfg(test)]
mod tests {
    use super::{Parameters, PhysicalData, Structure};

    #[test]
    fn the_papers_physical_data_give_its_inertias() {
        let d = PhysicalData::PAPER;
        // Eq. 3 by hand: 0.58*(8e-3^2 + 27.5e-3^2)/2; the paper truncates to 2.37e-4.
        assert!((d.i1() - 2.378_725e-4).abs() < 1e-12);
        assert!((d.psi() - 6.36e-4).abs() < 1e-18);
        assert!((d.i2() - 6.07e-6).abs() < 5e-9);
    }

    #[test]
    fn the_papers_modal_parameters_follow_from_table_3() {
        let m = Parameters::PAPER.modal();
        assert!((m.wn - 54.5323).abs() < 1e-4);
        assert!((m.wd - 29.8757).abs() < 1e-4);
        assert!((m.zeta - 0.836_574).abs() < 1e-6);
    }

    #[test]
    fn a_parameter_out_of_reach_is_named() {
        let p = Parameters { i2: 0.0, ..Parameters::PAPER };
        assert_eq!(p.check(Structure::TwoInertia).expect_err("I2 = 0 has no flexible mode").name, "I2");
        assert!(p.check(Structure::Rigid).is_ok());
        assert_eq!(Parameters { k: f64::NAN, ..p }.check(Structure::Rigid).expect_err("NaN").name, "K");
    }
}
