//! Moments of a year for which records of a weather file stand.

use glam::DVec3;

/// Moment for which a record of a weather file stands, while the sun is up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Number of the record in [`Weather::records`](crate::weather::Weather::records).
    pub record: usize,
    /// Part of the record's time for which the moment stands, over all of it: 1 where a record has one moment; the moments of a record with
    /// light add up to 1.
    pub share: f64,
    /// Hours of the day in standard time of the file's zone, 0..24: the middle of the interval, by which schedules know the record.
    pub represented_hour: f64,
    /// Number of the day in its year, from 1.
    pub day_of_year: u16,
    /// Unit vector toward the apparent centre of the sun (refracted), x east, y north, z up, at the middle of the sunlit part of the interval.
    pub sun: DVec3,
}
