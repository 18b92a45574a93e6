//! Units in the brackets of a column's header, `theta1 [deg]`, and their factor to SI.

use std::f64::consts::{PI, TAU};

use super::signal::Quantity;

/// A unit that a trace file may use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// As it is written, without spaces; `.` for a product, `2` for a square.
    pub symbol: &'static str,
    /// What it measures.
    pub quantity: Quantity,
    /// SI value of one of it.
    pub factor: f64,
}

const fn unit(symbol: &'static str, quantity: Quantity, factor: f64) -> Unit {
    Unit { symbol, quantity, factor }
}

const DEG: f64 = PI / 180.0;
/// Standard gravity, m/s2 (CGPM 1901).
const G: f64 = 9.806_65;
/// Inch, m, and pound-force, N (international yard and pound agreement, 1959).
const INCH: f64 = 0.0254;
const LBF: f64 = 0.453_592_37 * G;

/// Every unit that is understood, SI first in each quantity.
pub const UNITS: &[Unit] = &[
    unit("s", Quantity::Time, 1.0),
    unit("ms", Quantity::Time, 1e-3),
    unit("us", Quantity::Time, 1e-6),
    unit("ns", Quantity::Time, 1e-9),
    unit("min", Quantity::Time, 60.0),
    unit("N.m", Quantity::Torque, 1.0),
    unit("Nm", Quantity::Torque, 1.0),
    unit("mN.m", Quantity::Torque, 1e-3),
    unit("mNm", Quantity::Torque, 1e-3),
    unit("N.cm", Quantity::Torque, 1e-2),
    unit("Ncm", Quantity::Torque, 1e-2),
    unit("kN.m", Quantity::Torque, 1e3),
    unit("kNm", Quantity::Torque, 1e3),
    unit("lbf.in", Quantity::Torque, LBF * INCH),
    unit("lb.in", Quantity::Torque, LBF * INCH),
    unit("in.lb", Quantity::Torque, LBF * INCH),
    unit("lbf.ft", Quantity::Torque, LBF * 12.0 * INCH),
    unit("lb.ft", Quantity::Torque, LBF * 12.0 * INCH),
    unit("ft.lb", Quantity::Torque, LBF * 12.0 * INCH),
    unit("ozf.in", Quantity::Torque, LBF * INCH / 16.0),
    unit("oz.in", Quantity::Torque, LBF * INCH / 16.0),
    unit("kgf.cm", Quantity::Torque, G * 1e-2),
    unit("kgf.m", Quantity::Torque, G),
    unit("N", Quantity::Force, 1.0),
    unit("daN", Quantity::Force, 10.0),
    unit("lbf", Quantity::Force, LBF),
    unit("mN", Quantity::Force, 1e-3),
    unit("kN", Quantity::Force, 1e3),
    unit("rad", Quantity::Angle, 1.0),
    unit("mrad", Quantity::Angle, 1e-3),
    unit("urad", Quantity::Angle, 1e-6),
    unit("deg", Quantity::Angle, DEG),
    unit("°", Quantity::Angle, DEG),
    unit("arcmin", Quantity::Angle, DEG / 60.0),
    unit("arcsec", Quantity::Angle, DEG / 3600.0),
    unit("rev", Quantity::Angle, TAU),
    unit("turn", Quantity::Angle, TAU),
    unit("m", Quantity::Length, 1.0),
    unit("cm", Quantity::Length, 1e-2),
    unit("mm", Quantity::Length, 1e-3),
    unit("inch", Quantity::Length, INCH),
    unit("um", Quantity::Length, 1e-6),
    unit("nm", Quantity::Length, 1e-9),
    unit("rad/s", Quantity::AngularVelocity, 1.0),
    unit("mrad/s", Quantity::AngularVelocity, 1e-3),
    unit("deg/s", Quantity::AngularVelocity, DEG),
    unit("°/s", Quantity::AngularVelocity, DEG),
    unit("rpm", Quantity::AngularVelocity, TAU / 60.0),
    unit("1/min", Quantity::AngularVelocity, TAU / 60.0),
    unit("rev/min", Quantity::AngularVelocity, TAU / 60.0),
    unit("rev/s", Quantity::AngularVelocity, TAU),
    unit("m/s", Quantity::Velocity, 1.0),
    unit("cm/s", Quantity::Velocity, 1e-2),
    unit("mm/s", Quantity::Velocity, 1e-3),
    unit("um/s", Quantity::Velocity, 1e-6),
    unit("m/min", Quantity::Velocity, 1.0 / 60.0),
    unit("mm/min", Quantity::Velocity, 1e-3 / 60.0),
    unit("rad/s2", Quantity::AngularAcceleration, 1.0),
    unit("deg/s2", Quantity::AngularAcceleration, DEG),
    unit("rev/s2", Quantity::AngularAcceleration, TAU),
    unit("m/s2", Quantity::Acceleration, 1.0),
    unit("mm/s2", Quantity::Acceleration, 1e-3),
    unit("g", Quantity::Acceleration, G),
    unit("A", Quantity::Drive, 1.0),
    unit("mA", Quantity::Drive, 1e-3),
    unit("V", Quantity::Drive, 1.0),
    unit("mV", Quantity::Drive, 1e-3),
    unit("%", Quantity::Drive, 1.0),
];

impl Unit {
    /// The unit that `text` names. Spaces, `*` or `·` for a product, `^2` or `²` for a square and both signs for micro
    /// are understood.
    #[must_use]
    pub fn parse(text: &str) -> Option<&'static Self> {
        let mut plain = String::with_capacity(text.len());
        for c in text.chars() {
            match c {
                c if c.is_whitespace() => {}
                '*' | '·' | '⋅' => plain.push('.'),
                '^' => {}
                '²' => plain.push('2'),
                'µ' | 'μ' => plain.push('u'),
                c => plain.push(c),
            }
        }
        let plain = plain.replace("/s/s", "/s2");
        let exact = |plain: &str| UNITS.iter().find(|u| u.symbol == plain);
        // A hyphen is a product, too: oz-in.
        exact(&plain).or_else(|| exact(&plain.replace('-', ".")).filter(|u| u.quantity == Quantity::Torque))
    }

    /// The units of a quantity, for a message.
    #[must_use]
    pub fn of(quantity: Quantity) -> String {
        UNITS.iter().filter(|u| u.quantity == quantity).map(|u| u.symbol).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_spellings_of_a_unit_are_one_unit() {
        for text in ["N.m", "N*m", "N·m", "N m", "Nm"] {
            let unit = Unit::parse(text).unwrap();
            assert_eq!((unit.quantity, unit.factor), (Quantity::Torque, 1.0), "{text}");
        }
        for text in ["rad/s^2", "rad/s²", "rad/s2", "rad/s/s"] {
            assert_eq!(Unit::parse(text).unwrap().symbol, "rad/s2", "{text}");
        }
        assert_eq!(Unit::parse("µm").unwrap().factor, 1e-6);
        assert_eq!(Unit::parse("parsec"), None);
    }

    #[test]
    fn a_turn_a_minute_is_two_pi_over_sixty_radians_a_second() {
        assert!((Unit::parse("rpm").unwrap().factor - 0.104_719_755_119_659_77).abs() < 1e-16);
        assert!((360.0 * Unit::parse("deg").unwrap().factor - TAU).abs() < 1e-15);
    }
}
