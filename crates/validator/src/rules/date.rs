//! Dates and times of the XML schema.

/// `xs:dateTime`: `-?YYYY-MM-DDThh:mm:ss(.s+)?(Z|[+-]hh:mm)?` with the ranges of the calendar.
pub(super) fn is_date_time(text: &str) -> bool {
    fn parse(text: &str) -> Option<bool> {
        let text = text.trim();
        let (date, rest) = text.strip_prefix('-').unwrap_or(text).split_once('T')?;
        let mut date = date.split('-');
        let (year, month, day) = (date.next()?, date.next()?, date.next()?);
        let zone = rest.find(['Z', '+', '-']).unwrap_or(rest.len());
        let (time, zone) = rest.split_at(zone);
        let (time, fraction) = time.split_once('.').unwrap_or((time, "0"));
        let mut time = time.split(':');
        let (hour, minute, second) = (time.next()?, time.next()?, time.next()?);
        let two = |text: &str, most: u32| {
            let value: u32 = text.parse().ok()?;
            (text.len() == 2 && text.bytes().all(|b| b.is_ascii_digit()) && value <= most).then_some(value)
        };
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let (hour, minute, second) = (two(hour, 24)?, two(minute, 59)?, two(second, 59)?);
        let year_number: u64 = year.parse().ok()?;
        let multiple = |of: u64| year_number.is_multiple_of(of);
        let leap = multiple(4) && (!multiple(100) || multiple(400));
        let month = two(month, 12)?;
        let last = match month {
            0 => return None,
            2 if leap => 29,
            2 => 28,
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        };
        let zone_good = match zone.split_at_checked(1) {
            None => true,
            Some(("Z", rest)) => rest.is_empty(),
            Some((_, rest)) => {
                let (h, m) = rest.split_once(':')?;
                two(h, 14)? < 14 && two(m, 59).is_some() || rest == "14:00"
            }
        };
        Some(
            year.len() >= 4
                && digits(year)
                && two(day, last)? > 0
                && date.next().is_none()
                && time.next().is_none()
                && digits(fraction)
                && (hour < 24 || minute == 0 && second == 0)
                && zone_good,
        )
    }
    parse(text).unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_follow_the_xml_schema() {
        for good in [
            "2009-12-08T14:33:22Z",
            "2024-02-29T00:00:00",
            "2009-12-08T14:33:22.125Z",
            "2009-12-08T14:33:22+02:00",
            "2009-12-08T24:00:00-14:00",
            "12009-12-08T14:33:22Z",
        ] {
            assert!(is_date_time(good), "{good}");
        }
        for bad in [
            "",
            "2009-12-08",
            "2009-12-08 14:33:22",
            "2009-13-08T14:33:22Z",
            "2023-02-29T00:00:00Z",
            "2009-12-08T25:00:00Z",
            "2009-12-08T14:33Z",
            "09-12-08T14:33:22Z",
            "2009-12-08T14:33:22.Z",
            "2009-12-08T14:33:22+2:00",
            "2009-12-00T14:33:22Z",
            "2009-12-08T14:33:22Zulu",
        ] {
            assert!(!is_date_time(bad), "{bad}");
        }
    }
}
