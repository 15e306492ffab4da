//! Days of the Gregorian calendar, numbered within their year; days of the week count from 0, Monday.

/// Days before each month of a year without 29 February.
const DAYS_BEFORE: [u16; 12] = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];

/// Names of months in English, as weather files have them, by their first three letters.
const MONTHS: [&str; 12] = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];

/// Names of days of the week in English by their first three letters, from Monday.
const WEEKDAYS: [&str; 7] = ["mon", "tue", "wed", "thu", "fri", "sat", "sun"];

/// Month, 1..=12, and day of the month, from 1.
pub(crate) type Date = (u8, u8);

pub(crate) fn is_leap(year: i32) -> bool {
    year % 4 == 0 && (year % 100 != 0 || year % 400 == 0)
}

pub(crate) fn days_of_year(year: i32) -> u16 {
    if is_leap(year) { 366 } else { 365 }
}

/// Returns the year by which the sun of a typical year is computed, whose months are of several years.
pub(crate) fn typical_year(leap_day: bool) -> i32 {
    if leap_day { 2016 } else { 2017 }
}

/// Returns the length of a month in days, 0 for a month that is not one.
pub(crate) fn days_of_month(month: u8, leap: bool) -> u8 {
    match month {
        2 if leap => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => 0,
    }
}

/// Returns the number of a day in its year, from 1.
pub(crate) fn day_of_year(year: i32, (month, day): Date) -> u16 {
    let before = DAYS_BEFORE[usize::from(month.clamp(1, 12)) - 1];
    before + u16::from(month > 2 && is_leap(year)) + u16::from(day)
}

/// Returns year and date of a day by its number, which may also be one of the year before or after.
pub(crate) fn date_of(year: i32, day: i32) -> (i32, Date) {
    let days = i32::from(days_of_year(year));
    if day < 1 {
        return date_of(year - 1, day + i32::from(days_of_year(year - 1)));
    }
    if day > days {
        return date_of(year + 1, day - days);
    }
    let before = |month: u8| i32::from(day_of_year(year, (month, 0)));
    let month = (1..=12).rev().find(|month| before(*month) < day).unwrap_or(1);
    (year, (month, (day - before(month)) as u8))
}

/// Returns the day of the week of a date after the year 0.
pub(crate) fn weekday(year: i32, date: Date) -> u8 {
    let before = year - 1;
    let days = 365 * before + before / 4 - before / 100 + before / 400 + i32::from(day_of_year(year, date));
    // 1 January of the year 1 was a Monday
    (days - 1).rem_euclid(7) as u8
}

/// True if a date can be the day after another one, in a year of either length.
pub(crate) fn follows((month, day): Date, next: Date) -> bool {
    let after = if month == 12 { 1 } else { month + 1 };
    let ends = day == days_of_month(month, true) || (month, day) == (2, 28);
    next == (month, day + 1) && next.1 <= days_of_month(month, true) || (ends && next == (after, 1))
}

/// Returns the month that a word names, by its first three letters.
pub(crate) fn month_named(word: &str) -> Option<u8> {
    named(&MONTHS, word).map(|place| place + 1)
}

/// Returns the day of the week that a word names, by its first three letters.
pub(crate) fn weekday_named(word: &str) -> Option<u8> {
    named(&WEEKDAYS, word)
}

fn named(names: &[&str], word: &str) -> Option<u8> {
    let start = word.get(..3)?.to_ascii_lowercase();
    names.iter().position(|name| *name == start).map(|place| place as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_has_one_number_and_one_date() {
        for year in [1900, 2000, 2016, 2017] {
            for day in 1..=i32::from(days_of_year(year)) {
                let (same, date) = date_of(year, day);
                assert_eq!((same, i32::from(day_of_year(year, date))), (year, day));
                let (_, next) = date_of(year, day + 1);
                assert!(follows(date, next), "{date:?} {next:?}");
                assert_eq!(weekday(year, next) == (weekday(year, date) + 1) % 7, next != (1, 1));
            }
        }
        assert_eq!(date_of(2017, 0), (2016, (12, 31)));
        assert_eq!(date_of(2016, 367), (2017, (1, 1)));
        assert_eq!(day_of_year(2016, (12, 31)), 366);
    }

    #[test]
    fn days_of_the_week_are_those_of_the_calendar() {
        assert_eq!(weekday(2017, (1, 1)), 6);
        assert_eq!(weekday(2000, (2, 29)), 1);
        assert_eq!(weekday_named("Wednesday"), Some(2));
        assert_eq!((weekday_named("Holiday"), month_named("Sept"), month_named("é€")), (None, Some(9), None));
    }

    #[test]
    fn no_other_day_follows() {
        for (date, next) in
            [((2, 27), (3, 1)), ((4, 30), (4, 31)), ((4, 29), (5, 1)), ((1, 1), (1, 1)), ((2, 29), (2, 30))]
        {
            assert!(!follows(date, next), "{date:?} {next:?}");
        }
    }
}
