//! How numbers, units and foreign text are written: the only place that decides on digits.

use std::borrow::Cow;

use super::Cell;

/// What the text is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// A page: `2.370×10⁻⁴`, units with their signs.
    Page,
    /// The terminal: `2.370e-4`, which can be copied into another program.
    Terminal,
}

/// A missing value: not a number, without bound, or none.
const NONE: &str = "–";

/// A number with `digits` significant digits; scientific below 1e-3 and from 1e6 on.
#[must_use]
pub fn number(value: f64, digits: usize, medium: Medium) -> String {
    let digits = digits.clamp(1, 17);
    if !value.is_finite() {
        return NONE.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let scientific = format!("{value:.*e}", digits - 1);
    // Rounding may carry into the next decade: the exponent is read from the rounded figure.
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..6).contains(&exponent) {
        let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
        return minus(&format!("{value:.decimals$}"), medium);
    }
    times_ten(mantissa, exponent, medium)
}

/// An estimate and its standard error, which has two significant digits; the estimate is cut at the same place.
#[must_use]
pub fn estimate(value: f64, std: f64, medium: Medium) -> String {
    if !value.is_finite() || !std.is_finite() || std <= 0.0 {
        return number(value, 5, medium);
    }
    let exponent_of = |x: f64| -> i32 {
        let text = format!("{x:.1e}");
        text.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0)
    };
    let common = if value == 0.0 { exponent_of(std) } else { exponent_of(value.abs().max(std)) };
    let last = exponent_of(std) - 1;
    // A standard error beyond the digits that are printed without one is that of rounding, not of the machine.
    if common - last > 7 {
        return number(value, 7, medium);
    }
    if (-2..6).contains(&common) {
        let decimals = usize::try_from(-last).unwrap_or(0);
        return format!("{} ± {std:.decimals$}", minus(&format!("{value:.decimals$}"), medium));
    }
    let scale = 10f64.powi(common);
    let decimals = usize::try_from(common - last).unwrap_or(0);
    // Of a value far below its standard error no digit stands.
    if value.abs() < 0.5 * 10f64.powi(last) {
        return format!("0 ± {}", number(std, 2, medium));
    }
    if medium == Medium::Terminal {
        return format!("{}e{common} ± {}", format_args!("{:.decimals$}", value / scale), number(std, 2, medium));
    }
    let both = format!("{} ± {:.decimals$}", minus(&format!("{:.decimals$}", value / scale), medium), std / scale);
    times_ten(&format!("({both})"), common, medium)
}

/// A share of one in per cent, three significant digits; never rounds up to a full 100 %.
#[must_use]
pub fn percent(share: f64, medium: Medium) -> String {
    let value = 100.0 * share;
    if !value.is_finite() {
        return number(value, 3, medium);
    }
    let size = value.abs();
    let text = match size {
        _ if (99.995..100.0).contains(&size) => if value < 0.0 { "<-99.99" } else { ">99.99" }.to_owned(),
        _ if (99.95..100.0).contains(&size) => format!("{value:.2}"),
        _ if (100.0..1e5).contains(&size) => format!("{value:.0}"),
        _ if (1.0..100.0).contains(&size) => number(value, 3, medium),
        _ => number(value, 2, medium),
    };
    format!("{}{}%", minus(&text, medium), space(medium))
}

/// A whole number, its thousands set apart.
#[must_use]
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::with_capacity(digits.len() * 2);
    for (i, c) in digits.chars().enumerate() {
        if digits.len() > 4 && i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    out
}

/// A value with its unit behind it.
fn with_unit(value: String, unit: &str, medium: Medium) -> String {
    let unit = self::unit(unit, medium);
    if unit.is_empty() { value } else { format!("{value}{}{unit}", space(medium)) }
}

/// A value and its unit stay on one line.
pub(super) fn space(medium: Medium) -> char {
    match medium {
        Medium::Page => '\u{a0}',
        Medium::Terminal => ' ',
    }
}

/// The text of a cell.
#[must_use]
pub fn cell(cell: &Cell, medium: Medium) -> String {
    match cell {
        Cell::Empty => String::new(),
        Cell::Text(text) => prose(text, medium).into_owned(),
        Cell::Link(text, _) => text.clone(),
        Cell::Number(value, digits, unit) => with_unit(number(*value, *digits, medium), unit, medium),
        Cell::Count(value) => count(*value),
        Cell::Estimate(value, std, unit) => with_unit(estimate(*value, *std, medium), unit, medium),
        Cell::Percent(share) => percent(*share, medium),
        // A share with a bar is compared by length: how small a small one is does not matter.
        Cell::Bar(share) if (f64::MIN_POSITIVE..1e-4).contains(share) => format!("<0.01{}%", space(medium)),
        Cell::Bar(share) => percent(*share, medium),
    }
}

/// A unit as it is printed: `kg.m2` becomes `kg·m²`, the unit `1` nothing. The terminal keeps the ASCII form.
#[must_use]
pub fn unit(unit: &str, medium: Medium) -> String {
    if unit == "1" {
        return String::new();
    }
    if medium == Medium::Terminal {
        return unit.to_owned();
    }
    let mut out = String::with_capacity(unit.len() + 4);
    let mut letter_before = false;
    for c in unit.chars() {
        match c {
            '.' | '*' => out.push('·'),
            '2' if letter_before => out.push('²'),
            '3' if letter_before => out.push('³'),
            '^' => {}
            _ => out.push(c),
        }
        letter_before = c.is_alphabetic() || (c == '^' && letter_before);
    }
    out
}

/// Symbols that units in sentences are made of.
const SYMBOLS: [&str; 17] =
    ["N", "mN", "kN", "kg", "g", "m", "mm", "um", "s", "ms", "rad", "deg", "A", "V", "%", "Hz", "counts"];

/// Whether a word is a unit made of several: `N.m`, `kg.m2`, `A.s/rad`.
fn is_compound(word: &str) -> bool {
    let symbol = |part: &str| SYMBOLS.contains(&part.trim_end_matches(['2', '3']));
    word.contains('.') && word.split(['.', '/']).all(symbol)
}

/// A sentence with its units as the medium writes them; what stands in quotes or backticks is a file's or a command's, and stays.
#[must_use]
pub fn prose(text: &str, medium: Medium) -> Cow<'_, str> {
    if medium == Medium::Terminal || !text.contains('.') {
        return Cow::Borrowed(text);
    }
    let of_a_word = |c: char| c.is_alphanumeric() || "._/%-".contains(c);
    let mut out = String::with_capacity(text.len() + 8);
    let mut quoted = None;
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let end = rest.find(|c| !of_a_word(c)).unwrap_or(rest.len()).max(first.len_utf8());
        let (word, next) = rest.split_at(end);
        let (stem, stops) = word.split_at(word.trim_end_matches('.').len());
        if quoted.is_none() && is_compound(stem) {
            out.push_str(&unit(stem, medium));
            out.push_str(stops);
        } else {
            out.push_str(word);
        }
        if matches!(first, '"' | '`') {
            quoted = if quoted == Some(first) { None } else { quoted.or(Some(first)) };
        }
        rest = next;
    }
    Cow::Owned(out)
}

/// Text from outside with nothing in it that steers a terminal or the direction of a page: control characters and
/// bidirectional overrides become the replacement character. Line ends stay.
#[must_use]
pub fn printable(text: &str) -> Cow<'_, str> {
    let steers = |c: char| {
        (c.is_control() && c != '\n')
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
            || matches!(c, '\u{fffe}' | '\u{ffff}')
    };
    if text.contains(steers) {
        Cow::Owned(text.chars().map(|c| if steers(c) { char::REPLACEMENT_CHARACTER } else { c }).collect())
    } else {
        Cow::Borrowed(text)
    }
}

/// `10⁻⁴`.
#[must_use]
pub fn power_of_ten(exponent: i32) -> String {
    format!("10{}", superscript(exponent))
}

fn times_ten(mantissa: &str, exponent: i32, medium: Medium) -> String {
    match medium {
        Medium::Page => format!("{}×{}", minus(mantissa, medium), power_of_ten(exponent)),
        Medium::Terminal => format!("{mantissa}e{exponent}"),
    }
}

fn superscript(value: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    value.to_string().chars().map(|c| c.to_digit(10).map_or('⁻', |d| DIGITS[d as usize])).collect()
}

/// The page's minus sign is as wide as a digit.
fn minus(text: &str, medium: Medium) -> String {
    match medium {
        Medium::Page => text.replace('-', "−"),
        Medium::Terminal => text.to_owned(),
    }
}

/// The text with a capital letter at its head.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use Medium::{Page, Terminal};

    #[test]
    fn numbers_carry_the_asked_digits_and_no_more() {
        let cases = [
            (2.37e-4, 4, "2.370e-4"),
            (-0.0176, 3, "-0.0176"),
            (54.5323, 4, "54.53"),
            (999.96, 4, "1000"),
            (9.9996e-4, 4, "0.001000"),
            (123_456.0, 4, "123456"),
            (1.5e6, 2, "1.5e6"),
            (0.0, 4, "0"),
            (f64::NAN, 4, "–"),
            (f64::INFINITY, 4, "–"),
            (f64::NEG_INFINITY, 4, "–"),
        ];
        for (value, digits, expected) in cases {
            assert_eq!(number(value, digits, Terminal), expected);
        }
        assert_eq!(number(-2.37e-4, 3, Page), "−2.37×10⁻⁴");
    }

    #[test]
    fn an_estimate_is_cut_where_its_standard_error_ends() {
        let cases = [
            (2.3701e-4, 1.2e-7, "2.3701e-4 ± 1.2e-7"),
            (2.0401e-3, 1.3e-5, "2.040e-3 ± 1.3e-5"),
            (54.532, 0.031, "54.532 ± 0.031"),
            (0.0, 0.5, "0.00 ± 0.50"),
            (3.0, 250.0, "3 ± 250"),
            (1e3, 1.7e7, "0 ± 1.7e7"),
            (0.0, 2e-9, "0 ± 2.0e-9"),
            (1.0, 0.0996, "1.00 ± 0.10"),
            (1.0, f64::NAN, "1.0000"),
            (1.0, 0.0, "1.0000"),
            (1.0, 1e-30, "1.000000"),
            (54.532259, 2.1e-5, "54.532259 ± 0.000021"),
            (54.532259, 2.1e-6, "54.53226"),
        ];
        for (value, std, expected) in cases {
            assert_eq!(estimate(value, std, Terminal), expected);
        }
    }

    #[test]
    fn a_percentage_never_rounds_up_to_the_whole() {
        let cases = [
            (0.982, "98.2 %"),
            (0.99996, ">99.99 %"),
            (0.9997, "99.97 %"),
            (1.0, "100 %"),
            (0.5, "50.0 %"),
            (0.0432, "4.32 %"),
            (6.22e-11, "6.2e-9 %"),
            (-0.123, "-12.3 %"),
            (0.0, "0 %"),
        ];
        for (share, expected) in cases {
            assert_eq!(percent(share, Terminal), expected);
        }
    }

    #[test]
    fn units_are_typeset_on_the_page_and_plain_on_the_terminal() {
        assert_eq!(unit("kg.m2", Page), "kg·m²");
        assert_eq!(unit("N.m.s/rad", Page), "N·m·s/rad");
        assert_eq!(unit("rad/s^2", Page), "rad/s²");
        assert_eq!(unit("kg.m2", Terminal), "kg.m2");
    }

    #[test]
    fn units_in_sentences_are_typeset_on_the_page_and_nothing_else_is() {
        let sentence =
            "The model lacks 0.004 N.m rms, 2.5 kg.m2 and (0.1 A.s2/rad). See load.m, end_stop.k, README.md, m.2.";
        let typeset =
            "The model lacks 0.004 N·m rms, 2.5 kg·m² and (0.1 A·s²/rad). See load.m, end_stop.k, README.md, m.2.";
        assert_eq!(prose(sentence, Page), typeset);
        assert_eq!(prose(sentence, Terminal), sentence);
        assert_eq!(prose("in N.m.", Page), "in N·m.");
        for kept in ["unit = \"N.m\"", "`T = 1 N.m`", "N/m", "0.5 s", ""] {
            assert_eq!(prose(kept, Page), kept);
        }
    }

    #[test]
    fn counts_set_their_thousands_apart() {
        assert_eq!(count(2048), "2048");
        assert_eq!(count(1_000_000), "1\u{202f}000\u{202f}000");
    }

    #[test]
    fn foreign_text_cannot_steer_the_terminal_or_turn_the_page_around() {
        assert_eq!(printable("\u{1b}[2Jx\u{202e}y\0"), "\u{fffd}[2Jx\u{fffd}y\u{fffd}");
        assert!(matches!(printable("θ₁ [rad]\n"), Cow::Borrowed(_)));
    }
}
