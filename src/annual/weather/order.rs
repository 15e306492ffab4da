//! Order of records: whole days that follow each other.

use super::line::WeatherError;
use crate::calendar::{Date, follows};

/// Records that were read so far, in order.
#[derive(Debug)]
pub(super) struct Order {
    per_hour: usize,
    first: Option<Date>,
    /// Date of the last record, and its place in the day.
    last: Option<(Date, usize)>,
    days: usize,
    leap_day: bool,
}

impl Order {
    pub fn new(per_hour: u32) -> Self {
        Self { per_hour: per_hour as usize, first: None, last: None, days: 0, leap_day: false }
    }

    /// Takes a record of a date in an hour, 0..24, and returns its place in the hour, from 0.
    pub fn take(&mut self, line: usize, date: Date, hour: usize) -> Result<usize, WeatherError> {
        let per_day = 24 * self.per_hour;
        let same_day = self.last.filter(|(last, place)| *last == date && place + 1 < per_day);
        let place = same_day.map_or(0, |(_, place)| place + 1);
        let next_day = match self.last {
            Some((last, last_place)) => last_place + 1 == per_day && follows(last, date),
            None => true,
        };
        if place / self.per_hour != hour || (same_day.is_none() && !next_day) {
            return Err(self.out_of_order(line, date, hour));
        }
        if same_day.is_none() {
            self.days += 1;
            self.leap_day |= date == (2, 29);
            if self.days > self.most_days() {
                return Err(WeatherError::of_line(line, "the records must be those of one year at most"));
            }
        }
        self.first = self.first.or(Some(date));
        self.last = Some((date, place));
        Ok(place % self.per_hour)
    }

    fn most_days(&self) -> usize {
        365 + usize::from(self.leap_day)
    }

    fn out_of_order(&self, line: usize, (month, day): Date, hour: usize) -> WeatherError {
        let before = self.last.map_or_else(
            || "the first record must be the first of a day".to_owned(),
            |((month, day), place)| {
                format!(
                    "must come right after the record before, of {month}/{day} in hour {}",
                    place / self.per_hour + 1
                )
            },
        );
        WeatherError::of_line(line, format!("{before}, but is of {month}/{day} in hour {}", hour + 1))
    }

    /// Refuses records that end within a day; returns the first and the last day, or nothing if they are those of a whole year.
    pub fn ended(&self, line: usize) -> Result<Option<[Date; 2]>, WeatherError> {
        let (Some(first), Some((last, place))) = (self.first, self.last) else {
            return Err(WeatherError::of_line(line, "there are no records"));
        };
        if place + 1 != 24 * self.per_hour {
            return Err(WeatherError::of_line(line, "the last day must have all of its records"));
        }
        Ok((self.days != self.most_days()).then_some([first, last]))
    }

    /// True if 29 February is one of the days.
    pub fn has_leap_day(&self) -> bool {
        self.leap_day
    }
}
