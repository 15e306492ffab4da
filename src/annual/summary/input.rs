//! Input of a year that is summed up.

use std::collections::BTreeMap;

use crate::fluxes::TubeYear;
use crate::light::LitMoment;
use crate::metrics::dimming::Dimming;
use crate::metrics::schemes::{LEED_DAYS, LEED_HOURS, NBR_MOMENTS};
use crate::sensors::Sensors;
use crate::weather::Record;

/// Choices of what is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Illuminances in lux, > 0, whose daylight autonomy is computed.
    pub thresholds_lux: Vec<f64>,
    /// Bounds in lux of the useful daylight illuminance, rising.
    pub useful_lux: [f64; 3],
    /// Illuminance in lux of the spatial daylight autonomy.
    pub spatial_lux: f64,
    /// Share of the occupied time in percent of the spatial daylight autonomy.
    pub spatial_time_percent: f64,
    /// Electric light that dims.
    pub dimming: Option<Dimming>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            thresholds_lux: vec![100.0, 300.0, 500.0, 750.0],
            useful_lux: [100.0, 300.0, 3000.0],
            spatial_lux: 300.0,
            spatial_time_percent: 50.0,
            dimming: None,
        }
    }
}

/// Year that is summed up.
#[derive(Clone, Copy, Debug)]
pub struct YearInput<'a> {
    /// Records of the weather.
    pub records: &'a [Record],
    /// Number of records in an hour, >= 1.
    pub records_per_hour: u32,
    /// Moments with light.
    pub lit: &'a [LitMoment],
    /// Light of each tube at these moments.
    pub tubes: &'a [TubeYear],
    /// Radius of each tube's opening in m.
    pub radii: &'a [f64],
    /// Occupied records: one entry for each record.
    pub occupied: &'a [bool],
    /// Daylight hours of EN 17037: one entry for each record.
    pub daylight: &'a [bool],
}

/// Grid whose year is summed up.
#[derive(Clone, Copy, Debug)]
pub struct GridInput<'a> {
    /// Its sensors.
    pub sensors: Sensors<'a>,
    /// Area in m2 that each sensor stands for; 0 for sensors inside solids or outside the room.
    pub weights: &'a [f64],
    /// Floor area in m2 that electric light and daylight share.
    pub zone_area_m2: f64,
    /// Number of the sensor that is nearest to the middle of the room.
    pub middle: Option<usize>,
    /// True if all sensors look straight up, as those of criteria and of electric light do.
    pub is_level: bool,
}

/// Sets of records, and what is the same for all points.
pub(super) struct Hours<'a> {
    pub occupied: &'a [bool],
    pub daylight: &'a [bool],
    /// Hours of a record.
    pub each: f64,
    /// Numbers of the records of ABNT NBR 15575; none unless all four are there.
    pub nbr: Vec<usize>,
    /// Numbers of the records beside 9:00 and 15:00 of the clearest day of each equinox; none unless both days are there.
    pub leed: Option<[Vec<usize>; 2]>,
    /// Light of each tube under the CIE standard overcast sky, over its horizontal illuminance, in m2.
    pub overcast_m2: Vec<f64>,
}

impl<'a> Hours<'a> {
    pub fn new(input: &YearInput<'a>) -> Self {
        let each = 1.0 / f64::from(input.records_per_hour.max(1));
        let at = |moment: &(u8, u8, f64)| record_at(input.records, *moment, each);
        let nbr: Option<Vec<usize>> = NBR_MOMENTS.iter().map(at).collect();
        Self {
            occupied: input.occupied,
            daylight: input.daylight,
            each,
            nbr: nbr.unwrap_or_default(),
            leed: leed_records(input.records, each),
            overcast_m2: input.tubes.iter().map(|year| year.overcast_m2).collect(),
        }
    }

    /// Returns the number of hours of the records that count.
    pub fn of(&self, counts: &[bool]) -> f64 {
        self.each * counts.iter().filter(|counts| **counts).count() as f64
    }
}

/// Returns the records whose intervals have, or end at, each of the hours of LEED's option 2, on the clearest day of each equinox: that with most
/// direct normal irradiance.
fn leed_records(records: &[Record], each: f64) -> Option<[Vec<usize>; 2]> {
    let clearest = |[first, last]: [(u8, u8); 2]| {
        let within =
            records.iter().enumerate().filter(|(_, record)| (first..=last).contains(&(record.month, record.day)));
        let mut days = BTreeMap::<(u8, u8), (f64, Vec<usize>)>::new();
        for (number, record) in within {
            let (light, of_day) = days.entry((record.month, record.day)).or_default();
            *light += record.direct_normal_w_m2;
            of_day.push(number);
        }
        days.into_values()
            .filter(|(light, _)| *light > 0.0)
            .max_by(|(a, _), (b, _)| a.total_cmp(b))
            .map(|(_, of_day)| of_day)
    };
    let days: Option<Vec<Vec<usize>>> = LEED_DAYS.into_iter().map(clearest).collect();
    let days = days?.concat();
    let beside = |hour: f64| {
        let is_beside = |number: &usize| (records[*number].middle_hour - hour).abs() <= 0.5 * each + 1e-9;
        days.iter().copied().filter(is_beside).collect::<Vec<_>>()
    };
    Some(LEED_HOURS.map(beside)).filter(|hours| hours.iter().all(|records| !records.is_empty()))
}

/// Returns the record whose interval is nearest to a month, day and hour; `None` if it is not within one.
fn record_at(records: &[Record], (month, day, hour): (u8, u8, f64), each: f64) -> Option<usize> {
    let away = |record: &Record| (record.middle_hour - hour).abs();
    let of_day = records.iter().enumerate().filter(|(_, record)| (record.month, record.day) == (month, day));
    let nearest = of_day.min_by(|(_, a), (_, b)| away(a).total_cmp(&away(b)));
    nearest.filter(|(_, record)| away(record) <= 0.5 * each + 1e-9).map(|(number, _)| number)
}
