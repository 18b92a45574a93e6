//! When a trace was recorded: the date (and time) in its file's name, or in its folder's.
//!
//! The time of the last change of the file is no help: a copy has another.

use std::path::Path;

/// A date from a file's name.
#[derive(Debug, Clone, PartialEq)]
pub struct When {
    /// As ISO 8601 writes it: `2026-01-31` or `2026-01-31T08:30:00`.
    pub text: String,
    /// Days since 1970-01-01.
    pub days: f64,
}

impl When {
    /// From a path: the file's name first, then its folder's.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let name = |p: &Path| p.file_name().map(|n| n.to_string_lossy().into_owned());
        let own = name(path).and_then(|n| Self::parse(&n));
        own.or_else(|| path.parent().and_then(name).and_then(|n| Self::parse(&n)))
    }

    /// The first date in a text: `20260131`, `2026-01-31` or `2026_01_31`, with `083000`, `08-30-00` or `08:30` behind it.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let bytes = text.as_bytes();
        (0..bytes.len())
            .filter(|k| *k == 0 || !bytes[k - 1].is_ascii_digit())
            .find_map(|k| date(&bytes[k..]).map(|(y, m, d, rest)| Self::new(y, m, d, time(rest))))
    }

    fn new(y: i64, m: i64, d: i64, time: Option<(i64, i64, i64)>) -> Self {
        // Days from civil (H. Hinnant, chrono-compatible low-level date algorithms, 2013).
        let year = if m <= 2 { y - 1 } else { y };
        let era = year.div_euclid(400);
        let of_era = year - era * 400;
        let of_year = (153 * ((m + 9) % 12) + 2) / 5 + d - 1;
        let days = era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468;
        let mut text = format!("{y:04}-{m:02}-{d:02}");
        let mut share = 0.0;
        if let Some((hour, minute, second)) = time {
            text.push_str(&format!("T{hour:02}:{minute:02}:{second:02}"));
            share = (hour * 3600 + minute * 60 + second) as f64 / 86_400.0;
        }
        Self { text, days: days as f64 + share }
    }
}

/// A number of exactly so many digits at the start.
fn digits(bytes: &[u8], count: usize) -> Option<(i64, &[u8])> {
    let (own, rest) = bytes.split_at_checked(count)?;
    own.iter().all(u8::is_ascii_digit).then(|| (own.iter().fold(0, |n, c| 10 * n + i64::from(c - b'0')), rest))
}

/// What stands behind a separator, and the separator.
fn behind<'a>(bytes: &'a [u8], separators: &[u8]) -> Option<(u8, &'a [u8])> {
    let (first, rest) = bytes.split_first()?;
    separators.contains(first).then_some((*first, rest))
}

fn date(bytes: &[u8]) -> Option<(i64, i64, i64, &[u8])> {
    let (y, rest) = digits(bytes, 4)?;
    let (m, d, rest) = match behind(rest, b"-_.") {
        Some((separator, rest)) => {
            let (m, rest) = digits(rest, 2)?;
            let (_, rest) = behind(rest, &[separator])?;
            let (d, rest) = digits(rest, 2)?;
            (m, d, rest)
        }
        None => {
            let (m, rest) = digits(rest, 2)?;
            let (d, rest) = digits(rest, 2)?;
            (m, d, rest)
        }
    };
    let leap = y % 4 == 0 && (y % 100 != 0 || y % 400 == 0);
    let last = match m {
        2 => 28 + i64::from(leap),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    };
    let ends = rest.first().is_none_or(|c| !c.is_ascii_digit());
    ((1970..2200).contains(&y) && (1..=12).contains(&m) && (1..=last).contains(&d) && ends).then_some((y, m, d, rest))
}

fn time(rest: &[u8]) -> Option<(i64, i64, i64)> {
    let (_, rest) = behind(rest, b"T t_-")?;
    let (hour, rest) = digits(rest, 2)?;
    let (separated, rest) = behind(rest, b":-_.h").map_or((false, rest), |(_, rest)| (true, rest));
    let (minute, rest) = digits(rest, 2)?;
    let rest = if separated { behind(rest, b":-_.m").map_or(&[][..], |(_, rest)| rest) } else { rest };
    let second = digits(rest, 2).map_or(0, |(second, _)| second);
    (hour < 24 && minute < 60 && second < 60).then_some((hour, minute, second))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_found_in_the_names_that_loggers_write() {
        for (name, text) in [
            ("x-axis_20260131_083015.csv", "2026-01-31T08:30:15"),
            ("2026-01-31T08:30.csv", "2026-01-31T08:30:00"),
            ("log 2026_01_31 08-30-15.parquet", "2026-01-31T08:30:15"),
            ("2024-02-29.mat", "2024-02-29"),
            ("run7_20260131.csv", "2026-01-31"),
        ] {
            assert_eq!(When::parse(name).map(|w| w.text).as_deref(), Some(text), "{name}");
        }
        for name in ["run7.csv", "2026-02-30.csv", "123456789.csv", "20261301.csv", "axis_2026.csv", "2026-01_31.csv"] {
            assert_eq!(When::parse(name), None, "{name}");
        }
    }

    #[test]
    fn days_count_from_1970() {
        assert_eq!(When::parse("1970-01-01").unwrap().days, 0.0);
        assert_eq!(When::parse("2000-03-01T12:00").unwrap().days, 11_017.5);
        assert_eq!(When::parse("2026-11-21").unwrap().days, 20_778.0);
    }
}
