//! Times of the calendar and of the day as numbers.

/// A time of the calendar (ISO 8601, `2026-03-01T12:00:00.125Z`) as seconds since 2000, which leave a double a tenth of a
/// microsecond; a time of the day alone as seconds since midnight.
pub(super) fn stamp(text: &[u8]) -> Option<f64> {
    // The length alone tells nearly every other text.
    if !(8..=40).contains(&text.len()) || !text[0].is_ascii_digit() {
        return None;
    }
    let text = std::str::from_utf8(text).ok()?;
    let (date, clock) = match text.split_once(['T', ' ']) {
        Some((date, clock)) => (Some(date), clock),
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
    let mut parts = clock.splitn(3, ':');
    let mut next = |most: f64| parts.next()?.replace(',', ".").parse::<f64>().ok().filter(|v| (0.0..most).contains(v));
    let (h, m, s) = (next(24.0)?, next(60.0)?, next(61.0)?);
    let seconds = h * 3600.0 + m * 60.0 + s;
    let Some(date) = date else { return Some(seconds) };
    let mut parts = date.splitn(3, '-').map(|p| p.parse::<i64>().ok());
    let (y, month, d) = (parts.next()??, parts.next()??, parts.next()??);
    if !(1600..4000).contains(&y) || !(1..=12).contains(&month) || !(1..=31).contains(&d) {
        return None;
    }
    // Days of the civil calendar (H. Hinnant, chrono-compatible low-level date algorithms), counted from 2000-01-01.
    let (y, month) = if month <= 2 { (y - 1, month + 9) } else { (y, month - 3) };
    let era = y.div_euclid(400);
    let day =
        era * 146_097 + (y - era * 400) * 365 + (y - era * 400) / 4 - (y - era * 400) / 100 + (153 * month + 2) / 5 + d
            - 1;
    let from_2000 = day - 730_425;
    Some(from_2000 as f64 * 86_400.0 + seconds - zone)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_the_calendar_and_of_the_day_are_seconds() {
        // Python: datetime.fromisoformat("2026-03-01T12:00:00.125+00:00").timestamp() - 946684800
        assert_eq!(stamp(b"2026-03-01T12:00:00.125Z"), Some(825_681_600.125));
        assert_eq!(stamp(b"2026-03-01 13:00:00.125+01:00"), Some(825_681_600.125));
        assert_eq!(stamp(b"2000-01-01T00:00:00"), Some(0.0));
        assert_eq!(stamp(b"01:02:03,5"), Some(3723.5));
        for text in ["2026-13-01T00:00:00", "25:00:00", "10.0.0.1", "12:30", "2026-03-01"] {
            assert_eq!(stamp(text.as_bytes()), None, "{text}");
        }
    }
}
