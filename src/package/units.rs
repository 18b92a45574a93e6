//! Units of the model description: their SI base units, display units, and the linear analogue of a rotary unit.

use std::borrow::Cow;
use std::io;

use quick_xml::Writer;

use crate::axis::AxisKind;

/// A unit with another scale for people: `displayed = factor*value`.
pub(super) struct Display {
    pub name: &'static str,
    pub factor: f64,
}

/// The display unit of a unit, where one is of use.
pub(super) fn display(unit: &str) -> Option<Display> {
    use std::f64::consts::PI;
    let (name, factor) = match unit {
        "rad" => ("deg", 180.0 / PI),
        "rad/s" => ("rev/min", 30.0 / PI),
        "rad/s2" => ("deg/s2", 180.0 / PI),
        "m" => ("mm", 1e3),
        "m/s" => ("mm/s", 1e3),
        "m/rad" => ("mm/rev", 2e3 * PI),
        "s" => ("ms", 1e3),
        "N.m" => ("mN.m", 1e3),
        "kg.m2" => ("kg.cm2", 1e4),
        "kg" => ("g", 1e3),
        _ => return None,
    };
    Some(Display { name, factor })
}

/// The unit of a variable: as in the table, or its analogue on a linear axis (kg, N, m for kg.m2, N.m, rad).
///
/// Every torque is a force times a metre per radian and every inertia a mass times its square, so each `rad` becomes a
/// metre and each metre or its square that goes with them goes away.
pub(super) fn of(unit: &'static str, motion: AxisKind) -> Cow<'static, str> {
    match (motion, unit) {
        (AxisKind::Rotary, _) => unit.into(),
        (AxisKind::Linear, "m/rad") => "1".into(),
        (AxisKind::Linear, _) => unit.replace("kg.m2", "kg").replace("N.m", "N").replace("rad", "m").into(),
    }
}

/// Exponents of kg, m, s and rad of a unit such as `N.m.s2/rad2`; none where it cannot be read.
pub(super) fn base(unit: &str) -> Option<[i32; 4]> {
    let mut sum = [0; 4];
    for (part, sign) in unit.split('/').zip([1, -1]) {
        for token in part.split('.') {
            let letters = token.trim_end_matches(|c: char| c.is_ascii_digit());
            let exponent = sign * if letters.len() < token.len() { token[letters.len()..].parse().ok()? } else { 1 };
            let one = match letters {
                // The token "1", which stands for no unit.
                "" => [0, 0, 0, 0],
                "kg" => [1, 0, 0, 0],
                "m" => [0, 1, 0, 0],
                "s" => [0, 0, 1, 0],
                "rad" => [0, 0, 0, 1],
                "N" => [1, 1, -2, 0],
                "Hz" => [0, 0, -1, 0],
                _ => return None,
            };
            for (total, e) in sum.iter_mut().zip(one) {
                *total += exponent * e;
            }
        }
    }
    Some(sum)
}

/// The base unit of a unit as an element.
pub(super) fn base_element(xml: &mut Writer<Vec<u8>>, element: &str, unit: &str) -> io::Result<()> {
    let mut base = xml.create_element(element);
    for (symbol, exponent) in ["kg", "m", "s", "rad"].into_iter().zip(self::base(unit).unwrap_or_default()) {
        if exponent != 0 {
            base = base.with_attribute((symbol, exponent.to_string().as_str()));
        }
    }
    base.write_empty()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variables::all;

    #[test]
    fn every_unit_of_the_table_has_base_units_and_its_linear_analogue_no_radian() {
        for v in all().filter(|v| !v.unit.is_empty()) {
            assert!(base(v.unit).is_some(), "{v} {}", v.unit);
            let linear = base(&of(v.unit, AxisKind::Linear)).unwrap();
            assert_eq!(linear[3], 0, "{v} {}", v.unit);
        }
        for (rotary, linear) in [
            ("kg.m2", "kg"),
            ("N.m.s/rad", "N.s/m"),
            ("N.m.s2/rad2", "N.s2/m2"),
            ("rad/s2", "m/s2"),
            ("1/rad", "1/m"),
            ("m/rad", "1"),
            ("Hz", "Hz"),
        ] {
            assert_eq!(of(rotary, AxisKind::Linear), linear);
            assert_eq!(of(rotary, AxisKind::Rotary), rotary);
        }
        assert_eq!(base("N.m.s2/rad2"), Some([1, 2, 0, -2]));
        assert_eq!(base("1"), Some([0; 4]));
        assert_eq!(base("furlong"), None);
    }
}
