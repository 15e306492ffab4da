//! Weather of a file, with its provenance and faults.

use super::closure::Closure;
use super::record::{Format, Record, Site, usual_offset_minutes};
use super::rows::Repair;
use crate::calendar::{Date, day_of_year, days_of_year};

/// Weather of a year or a part of it, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Weather {
    /// Place of the records.
    pub site: Site,
    /// Records in order, without gaps, of whole days.
    pub records: Vec<Record>,
    /// Records in an hour, 1..=60.
    pub records_per_hour: u32,
    /// Year by which the sun's positions are computed.
    pub year_of_sun: i32,
    /// Minutes from the stamp of a record to the moment for which it stands, by kind and tests of the file.
    pub sun_offset_minutes: f64,
    /// Day of the week of the first record, 0 (Monday) to 6.
    pub first_weekday: u8,
    /// First and last day of summer time as the file has them, each a month and a day.
    pub daylight_saving: Option<[Date; 2]>,
    /// Kind, origin and faults of the file.
    pub file: FileReport,
}

/// Kind, origin and faults of a weather file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileReport {
    /// Kind of the file.
    pub format: Format,
    /// True if the file has illuminances, from which its irradiances follow.
    pub is_photometric: bool,
    /// Comments in the file's header: where its numbers come from.
    pub comments: Vec<String>,
    /// Line of the first record, from 1; each record has one line.
    pub first_line: usize,
    /// Test for the moments that the records stand for; none of files without global irradiance, or with few records with sun.
    pub closure: Option<Closure>,
    /// Repaired values by kind.
    pub repairs: Vec<Repair>,
}

impl Weather {
    /// Returns the number of records of a day.
    pub fn records_per_day(&self) -> usize {
        24 * self.records_per_hour as usize
    }

    /// Returns the hours from the beginning of the year to the middle of a record's interval.
    pub fn middle_of_year_hours(&self, record: &Record) -> f64 {
        let day = day_of_year(self.year_of_sun, (record.month, record.day));
        24.0 * f64::from(day.saturating_sub(1)) + record.middle_hour
    }

    /// Returns the time for which a record stands: the middle of its interval as the sun's offset moves it.
    pub fn represented(&self, record: &Record, sun_offset_minutes: f64) -> Represented {
        let later = (sun_offset_minutes - usual_offset_minutes(self.file.format, self.records_per_hour)) / 60.0;
        let hour = record.middle_hour + later;
        let days_later = (hour / 24.0).floor() as i32;
        let day = i32::from(day_of_year(self.year_of_sun, (record.month, record.day))) + days_later;
        let days = i32::from(days_of_year(self.year_of_sun));
        Represented { days_later, day_of_year: ((day - 1).rem_euclid(days) + 1) as u16, hour: hour.rem_euclid(24.0) }
    }
}

/// Time for which a record stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Represented {
    /// Days after that of the record: 0, or 1 or -1 if an offset of the sun moves the time across midnight.
    pub days_later: i32,
    /// Number of the day in its year, from 1; a day before or after the year is that of its other end.
    pub day_of_year: u16,
    /// Hour of standard time, 0..24.
    pub hour: f64,
}
