//! Times of the calendar and of the day as numbers.

/// A time of the calendar as seconds since 2000, which leave a double a tenth of a microsecond; a time of the day alone as seconds
/// since midnight.
///
/// Forms: ISO 8601, extended and basic (`2026-03-01T12:00:00.125Z`, `20260301T120000.125`), `2026/03/01 12:00:00`, the day first
/// behind points (`01.03.2026 12:00:00,125`), the month first behind slashes (`03/01/2026 12:00:00 PM`) but where it would be beyond
/// the twelfth. A comma may stand for the point of the seconds.
pub(super) fn stamp(text: &[u8]) -> Option<f64> {
    // Nearly every other text is ruled out by its length alone.
    if !(7..=40).contains(&text.len()) || !text[0].is_ascii_digit() {
        return None;
    }
    let text = std::str::from_utf8(text).ok()?;
    let (text, noon) = half_of_day(text);
    let (date, clock) = match text.split_once(['T', ' ']) {
        Some((date, clock)) => (Some(date), clock.trim_start()),
        None => (None, text),
    };
    let (clock, zone) = match clock.strip_suffix('Z') {
        Some(clock) => (clock, 0.0),
        None => match clock.rfind(['+', '-']) {
            Some(k) => {
                let (hours, minutes) = clock[k + 1..].split_once(':').unwrap_or((&clock[k + 1..], "0"));
                let size = hours.parse::<f64>().ok()? * 3600.0 + minutes.parse::<f64>().ok()? * 60.0;
                (&clock[..k], if clock[k..].starts_with('-') { -size } else { size })
            }
            None => (clock, 0.0),
        },
    };
    let (h, m, s) = of_the_clock(clock, date.is_some())?;
    let h = match noon {
        None => h,
        Some(_) if !(1.0..13.0).contains(&h) => return None,
        Some(after) => h % 12.0 + if after { 12.0 } else { 0.0 },
    };
    let seconds = h * 3600.0 + m * 60.0 + s;
    let Some(date) = date else { return Some(seconds) };
    Some(day_of(date)? as f64 * 86_400.0 + seconds - zone)
}

/// The text without AM or PM at its end, and whether it is after noon.
fn half_of_day(text: &str) -> (&str, Option<bool>) {
    let end = text.len().saturating_sub(2);
    let of = |mark: &str| text.get(end..).is_some_and(|t| t.eq_ignore_ascii_case(mark));
    if of("am") || of("pm") { (text[..end].trim_end(), Some(of("pm"))) } else { (text, None) }
}

/// Hours, minutes and seconds; without colons only behind a date.
fn of_the_clock(clock: &str, dated: bool) -> Option<(f64, f64, f64)> {
    let number = |text: &str, most: f64| {
        let plain = text.starts_with(|c: char| c.is_ascii_digit());
        text.replace(',', ".").parse::<f64>().ok().filter(|v| plain && (0.0..most).contains(v))
    };
    if !clock.contains(':') {
        let basic = dated && clock.len() >= 6 && clock.as_bytes()[..6].iter().all(u8::is_ascii_digit);
        return basic
            .then(|| Some((number(&clock[..2], 24.0)?, number(&clock[2..4], 60.0)?, number(&clock[4..], 61.0)?)))?;
    }
    let mut parts = clock.splitn(3, ':');
    Some((number(parts.next()?, 24.0)?, number(parts.next()?, 60.0)?, number(parts.next()?, 61.0)?))
}

/// Days from 2000-01-01 to a date.
fn day_of(date: &str) -> Option<i64> {
    let number = |text: &str| text.parse::<i64>().ok().filter(|_| text.bytes().all(|c| c.is_ascii_digit()));
    let (y, month, d) = if date.len() == 8 && date.bytes().all(|c| c.is_ascii_digit()) {
        (number(&date[..4])?, number(&date[4..6])?, number(&date[6..])?)
    } else {
        let separator = date.chars().find(|c| "-/.".contains(*c))?;
        let mut parts = date.split(separator);
        let (a, b, c) = (parts.next()?, parts.next()?, parts.next()?);
        if parts.next().is_some() {
            return None;
        }
        let year = |text: &str| number(text).map(|y| if text.len() == 2 { 2000 + y } else { y });
        match (a.len() == 4, separator) {
            (true, _) => (number(a)?, number(b)?, number(c)?),
            // Of two numbers that may both be a month the first is one where slashes stand.
            (false, '/') if number(a)? <= 12 => (year(c)?, number(a)?, number(b)?),
            (false, _) => (year(c)?, number(b)?, number(a)?),
        }
    };
    if !(1600..4000).contains(&y) || !(1..=12).contains(&month) || !(1..=31).contains(&d) {
        return None;
    }
    // Days of the civil calendar (H. Hinnant, chrono-compatible low-level date algorithms), counted from 2000-01-01.
    let (y, month) = if month <= 2 { (y - 1, month + 9) } else { (y, month - 3) };
    let era = y.div_euclid(400);
    let day =
        era * 146_097 + (y - era * 400) * 365 + (y - era * 400) / 4 - (y - era * 400) / 100 + (153 * month + 2) / 5 + d
            - 1;
    Some(day - 730_425)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_the_calendar_and_of_the_day_are_seconds() {
        // Python: datetime.fromisoformat("2026-03-01T12:00:00.125+00:00").timestamp() - 946684800
        for text in [
            "2026-03-01T12:00:00.125Z",
            "2026-03-01 13:00:00.125+01:00",
            "20260301T120000.125",
            "2026/03/01 12:00:00.125",
            "01.03.2026 12:00:00,125",
            "1.3.26 12:00:00.125",
            "03/01/2026 12:00:00.125 PM",
            "3/1/2026 12:00:00.125pm",
        ] {
            assert_eq!(stamp(text.as_bytes()), Some(825_681_600.125), "{text}");
        }
        assert_eq!(stamp(b"2000-01-01T00:00:00"), Some(0.0));
        // The thirteenth month is a day.
        assert_eq!(stamp(b"13/01/2000 12:00:00 AM"), Some(12.0 * 86_400.0));
        assert_eq!(stamp(b"01:02:03,5"), Some(3723.5));
        assert_eq!(stamp(b"1:02:03 PM"), Some(13.0 * 3600.0 + 123.0));
        for text in [
            "2026-13-01T00:00:00",
            "25:00:00",
            "13:00:00 PM",
            "10.0.0.1",
            "12:30",
            "2026-03-01",
            "31.13.2026 00:00:00",
            "1.2.3.4 00:00:00",
        ] {
            assert_eq!(stamp(text.as_bytes()), None, "{text}");
        }
    }
}
