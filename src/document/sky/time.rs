//! Parsing of times in RFC 3339.

use std::str::FromStr;

use jiff::civil::DateTime;

use crate::sky::sun::UtcInstant;

/// Parses a time in RFC 3339 with an offset, with or without seconds, to an instant in UTC. Years outside 0..9999 have a sign and
/// six digits.
///
/// A leap second is taken as the second before it. The error is a sentence for the user.
pub fn instant(time: &str) -> Result<UtcInstant, String> {
    let shape = "must be RFC 3339 with an offset, such as 2011-09-15T15:00:00+02:00";
    match rfc_3339_shape(time) {
        Shape::Complete => {}
        Shape::NoOffset => {
            return Err(format!("{shape}: the offset is missing (Z or +hh:mm), without it {time:?} is ambiguous"));
        }
        Shape::Other => return Err(format!("{shape}, but is {time:?}")),
    }
    let timestamp = jiff::Timestamp::from_str(time).map_err(|error| format!("{shape}: {error}"))?;
    let civil = jiff::tz::Offset::UTC.to_datetime(timestamp);
    let field = |value: i8| u32::try_from(value).unwrap_or(0);
    Ok(UtcInstant {
        year: i32::from(civil.year()),
        month: field(civil.month()),
        day: field(civil.day()),
        hour: field(civil.hour()),
        minute: field(civil.minute()),
        second: f64::from(civil.second()) + 1e-9 * f64::from(civil.subsec_nanosecond()),
    })
}

/// Returns the number of the day in its year, from 1, of a time in RFC 3339 with an offset, in UTC; `None` for other texts.
pub fn day_of_year(time: &str) -> Option<u16> {
    let timestamp = jiff::Timestamp::from_str(time).ok()?;
    u16::try_from(jiff::tz::Offset::UTC.to_datetime(timestamp).date().day_of_year()).ok()
}

/// Returns month, day and hour that a clock shows at a time in RFC 3339 with an offset; `None` for other texts.
pub fn clock(time: &str) -> Option<(u8, u8, f64)> {
    let begin = time.find(['T', 't'])? + 1;
    let offset = time.get(begin..)?.find(['Z', 'z', '+', '-'])?;
    let civil = DateTime::from_str(time.get(..begin + offset)?).ok()?;
    let hour = f64::from(civil.hour()) + f64::from(civil.minute()) / 60.0 + f64::from(civil.second()) / 3600.0;
    Some((u8::try_from(civil.month()).ok()?, u8::try_from(civil.day()).ok()?, hour))
}

/// Parses a local date and time in RFC 3339 without an offset, with or without seconds. The error is a sentence for the user.
pub fn local(time: &str) -> Result<DateTime, String> {
    let shape = "must be a local date and time, such as 2011-09-15T15:00";
    match rfc_3339_shape(time) {
        Shape::NoOffset => DateTime::from_str(time).map_err(|error| format!("{shape}: {error}")),
        Shape::Complete => Err(format!("{shape}, without an offset, but is {time:?}")),
        Shape::Other => Err(format!("{shape}, but is {time:?}")),
    }
}

enum Shape {
    Complete,
    NoOffset,
    Other,
}

/// Returns whether a text is a time in RFC 3339, with or without an offset. It is stricter than the parser, which accepts names
/// of time zones and other orders; only seconds may be absent, which can only mean the full minute.
fn rfc_3339_shape(time: &str) -> Shape {
    let matches = |text: &str, pattern: &str| {
        text.len() == pattern.len()
            && text
                .bytes()
                .zip(pattern.bytes())
                .all(|(c, p)| if p == b'0' { c.is_ascii_digit() } else { c.eq_ignore_ascii_case(&p) })
    };
    let unsigned = match time.strip_prefix(['+', '-']) {
        // a year of six digits: the first two are taken off with the sign
        Some(rest) => match rest.split_at_checked(2) {
            Some((century, rest)) if century.bytes().all(|c| c.is_ascii_digit()) => rest,
            _ => return Shape::Other,
        },
        None => time,
    };
    let patterns = ["0000-00-00T00:00:00", "0000-00-00T00:00"];
    let begins = |pattern: &&str| unsigned.get(..pattern.len()).is_some_and(|begun| matches(begun, pattern));
    let Some(pattern) = patterns.into_iter().find(begins) else {
        return Shape::Other;
    };
    let mut rest = &unsigned[pattern.len()..];
    if let Some(fraction) = rest.strip_prefix('.').filter(|_| pattern == patterns[0]) {
        rest = fraction.trim_start_matches(|c: char| c.is_ascii_digit());
        if rest.len() == fraction.len() {
            return Shape::Other;
        }
    }
    match rest {
        "" => Shape::NoOffset,
        "Z" | "z" => Shape::Complete,
        offset if matches(offset, "+00:00") || matches(offset, "-00:00") => Shape::Complete,
        _ => Shape::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_and_utc_are_the_same_instant() {
        let here = instant("2011-09-15T15:00:00+02:00").unwrap();
        assert_eq!(here, instant("2011-09-15T13:00:00Z").unwrap());
        assert_eq!((here.year, here.month, here.day, here.hour), (2011, 9, 15, 13));
        // the full minute
        for time in ["2011-09-15T15:00+02:00", "2011-09-15T13:00Z", "2011-09-15T13:00:00.0Z", "+002011-09-15t13:00z"] {
            assert_eq!(instant(time), Ok(here), "{time}");
        }
    }

    #[test]
    fn refuses_what_is_not_an_instant() {
        for time in ["2011-09-15T15:00:00", "2011-09-15T15:00"] {
            assert!(instant(time).unwrap_err().contains("offset is missing"));
        }
        for time in [
            "",
            "2011-02-30T12:00:00Z",
            "2011-09-15",
            "2011-09-15T15:00:00[Europe/Copenhagen]",
            "2011-09-15T15:00:00+02:00[Europe/Copenhagen]",
            "2011-09-15T15+02:00",
            "2011-09-15T15:00.5Z",
            "2011-09-15T15:0Z",
            "2011-09-15T25:00:00Z",
            "2011-09-15T15:00:00.Z",
            "2011-09-15T15:00:00+25:99",
            "20110915T150000Z",
            "ää11-09-15T15:00:00Z",
            "+é011-09-15T15:00:00Z",
        ] {
            assert!(instant(time).is_err(), "{time:?}");
        }
        // refused or taken as the second before it, never a panic
        let _ = instant("2016-12-31T23:59:60Z");
    }

    #[test]
    fn years_of_six_digits() {
        assert_eq!(instant("-001999-06-01T12:00:00Z").unwrap().year, -1999);
        assert_eq!(instant("+006001-06-01T12:00:00Z").unwrap().year, 6001);
    }
}
