//! Header of EPW files (EnergyPlus 2024, data dictionary).

use super::line::{Field, Line, WeatherError};
use super::record::Site;
use crate::calendar::{self, Date, date_of, days_of_month, is_leap, month_named, weekday_named};

/// Keyword of the header's last line.
const LAST: &str = "DATA PERIODS";

const CITY: Field = Field { number: 2, name: "city" };
const LATITUDE: Field = Field { number: 7, name: "latitude" };
const LONGITUDE: Field = Field { number: 8, name: "longitude" };
const TIME_ZONE: Field = Field { number: 9, name: "time zone" };
const ELEVATION: Field = Field { number: 10, name: "elevation" };
const SAVING: [Field; 2] =
    [Field { number: 3, name: "start of summer time" }, Field { number: 4, name: "end of summer time" }];
const PERIODS: Field = Field { number: 2, name: "number of data periods" };
const RECORDS_PER_HOUR: Field = Field { number: 3, name: "records per hour" };
const WEEKDAY: Field = Field { number: 5, name: "day of the week of the first day" };
const ENDS: [Field; 2] = [Field { number: 6, name: "first day" }, Field { number: 7, name: "last day" }];

/// Header of a file.
#[derive(Debug)]
pub(super) struct Header<'a> {
    pub site: Site,
    pub comments: Vec<String>,
    pub records_per_hour: u32,
    pub first_weekday: Option<u8>,
    /// First and last day of the records.
    pub period: Option<[Date; 2]>,
    /// Line of days when summer time begins and ends.
    saving: Option<Line<'a>>,
    /// Line of the first record.
    pub first_line: usize,
}

/// Reads the lines up to the first record.
pub(super) fn read<'a>(lines: &mut impl Iterator<Item = (usize, &'a str)>) -> Result<Header<'a>, WeatherError> {
    let (mut site, mut comments, mut saving) = (None, Vec::new(), None);
    let mut reached = 1;
    for (number, text) in lines {
        let line = Line::quoted(number, text);
        reached = number;
        let keyword = line.fields.first().map(|keyword| keyword.to_ascii_uppercase()).unwrap_or_default();
        if site.is_none() {
            if keyword != "LOCATION" {
                return Err(WeatherError::of_line(number, "an EPW file must begin with LOCATION"));
            }
            site = Some(read_site(&line)?);
        } else if keyword.starts_with("COMMENTS") {
            let text = line.fields[1..].join(",");
            // spreadsheets make all lines as long as the records
            let text = text.trim_end_matches(',');
            comments.extend((!text.is_empty()).then(|| printable(text)));
        } else if keyword.starts_with("HOLIDAYS") {
            saving = Some(line);
        } else if keyword == LAST
            && let Some(site) = site
        {
            return read_periods(
                &line,
                Header {
                    site,
                    comments,
                    records_per_hour: 1,
                    first_weekday: weekday_named(line.text(WEEKDAY)),
                    period: None,
                    saving,
                    first_line: number + 1,
                },
            );
        } else if keyword.starts_with(|c: char| c.is_ascii_digit()) {
            break;
        }
    }
    Err(WeatherError::of_line(reached, format!("{LAST} must stand before the records")))
}

fn read_site(line: &Line) -> Result<Site, WeatherError> {
    Ok(Site {
        name: printable(line.text(CITY)),
        latitude_deg: line.within(LATITUDE, -90.0..=90.0)?,
        longitude_deg: line.within(LONGITUDE, -180.0..=180.0)?,
        utc_offset_hours: line.within(TIME_ZONE, -12.0..=14.0)?,
        elevation_m: line.within(ELEVATION, -500.0..=9000.0)?,
    })
}

/// Returns a text without characters that steer a terminal.
pub(super) fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

fn read_periods<'a>(line: &Line, header: Header<'a>) -> Result<Header<'a>, WeatherError> {
    if line.whole(PERIODS, 0..=u8::MAX)? != 1 {
        return Err(line.error(PERIODS, "must be 1: files of several periods are not supported"));
    }
    let records_per_hour = line.whole(RECORDS_PER_HOUR, 1..=60)?;
    if 60 % records_per_hour != 0 {
        return Err(
            line.error(RECORDS_PER_HOUR, format!("must divide an hour's 60 minutes, but is {records_per_hour}"))
        );
    }
    let ends = ENDS.map(|field| fixed_day(line.text(field)));
    let period = if let [Some(first), Some(last)] = ends { Some([first, last]) } else { None };
    Ok(Header { records_per_hour: records_per_hour.into(), period, ..header })
}

impl Header<'_> {
    /// Returns the days when summer time begins and ends, in a year whose first record is of a date and a day of the week.
    pub fn daylight_saving(&self, year: i32, first: (Date, u8)) -> Result<Option<[Date; 2]>, WeatherError> {
        let Some(line) = &self.saving else { return Ok(None) };
        let texts = SAVING.map(|field| line.text(field));
        if texts.iter().any(|text| matches!(*text, "" | "0")) {
            return Ok(None);
        }
        let day = |field| {
            changing_day(line.text(field), year, first).ok_or_else(|| {
                line.error(
                    field,
                    "must be 0, a date (3/14 or 14 Mar), a day of the year, or such as 2nd Sunday in March",
                )
            })
        };
        Ok(Some([day(SAVING[0])?, day(SAVING[1])?]))
    }
}

/// Returns the date of `3/14`, perhaps with a year behind, `14 Mar` or `Mar 14`.
fn fixed_day(text: &str) -> Option<Date> {
    let words: Vec<&str> = text.split(['/', ' ']).filter(|word| !word.is_empty()).collect();
    let [first, second, ..] = words.as_slice() else { return None };
    let number = |word: &str| word.parse::<u8>().ok();
    let date = match (month_named(first), month_named(second)) {
        (Some(month), None) => (month, number(second)?),
        (None, Some(month)) => (month, number(first)?),
        _ => (number(first)?, number(second)?),
    };
    (1..=days_of_month(date.0, true)).contains(&date.1).then_some(date)
}

/// Returns a date by [`fixed_day`], by its number in the year, or of `2nd Sunday in March` and `Last Sunday in October`.
fn changing_day(text: &str, year: i32, (first, first_weekday): (Date, u8)) -> Option<Date> {
    if let Some(date) = fixed_day(text) {
        return Some(date);
    }
    let words: Vec<&str> = text.split_whitespace().collect();
    match words.as_slice() {
        [day] => {
            let day: u16 = day.parse().ok()?;
            (1..=calendar::days_of_year(year)).contains(&day).then(|| date_of(year, day.into()).1)
        }
        [which, weekday, .., month] => {
            let (weekday, month) = (weekday_named(weekday)?, month_named(month)?);
            let number = |date| i32::from(calendar::day_of_year(year, date));
            let is_weekday = |day: &u8| {
                let days = number((month, *day)) - number(first);
                (i32::from(first_weekday) + days).rem_euclid(7) == i32::from(weekday)
            };
            let mut days = (1..=days_of_month(month, is_leap(year))).filter(is_weekday);
            let place = match which.to_ascii_lowercase().as_str() {
                "last" => return days.next_back().map(|day| (month, day)),
                which => which.trim_end_matches(char::is_alphabetic).parse::<usize>().ok()?,
            };
            days.nth(place.checked_sub(1)?).map(|day| (month, day))
        }
        [..] => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_of_summer_time_have_many_forms() {
        // the year 2017 began with a Sunday
        let day = |text| changing_day(text, 2017, ((1, 1), 6));
        for (text, date) in [
            (" 3/12", (3, 12)),
            ("12 Mar", (3, 12)),
            ("March 12", (3, 12)),
            ("2nd Sunday in March", (3, 12)),
            ("Last Sunday in October", (10, 29)),
            ("Last Sun in Dec", (12, 31)),
            ("1st Monday in Feb", (2, 6)),
            ("71", (3, 12)),
        ] {
            assert_eq!(day(text), Some(date), "{text}");
        }
        for text in ["3/32", "6th Sunday in March", "0th Sunday in March", "Sunday", "366", "13/1", "x y z", "0/1"] {
            assert_eq!(day(text), None, "{text}");
        }
    }
}
