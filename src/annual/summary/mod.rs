//! Results of a year: from lit moments, lumens of tubes and responses to all metrics, monthly sums and the table of hours.

mod grid;
mod point;
mod tube;

use glam::DVec3;

use crate::fluxes::TubeYear;
use crate::light::LitMoment;
use crate::metrics::dimming::Dimming;
use crate::metrics::schemes::NBR_MOMENTS;
use crate::response::{RecordLight, Responses};
use crate::weather::{Record, Weather};

pub use grid::{GridYear, row_lux};
pub use point::PointYear;
pub use tube::{Outside, TubeSummary};

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
    /// Weather.
    pub weather: &'a Weather,
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
    /// Responses of its sensors to all tubes.
    pub responses: &'a Responses,
    /// Area in m2 that each sensor stands for; 0 for sensors inside solids or outside the room.
    pub weights: &'a [f64],
    /// Floor area in m2 that electric light and daylight share.
    pub zone_area_m2: f64,
    /// Number of the sensor that is nearest to the middle of the room.
    pub middle: Option<usize>,
}

/// Table of hours: a record with light.
#[derive(Clone, Debug, PartialEq)]
pub struct Hour {
    /// Number of the record.
    pub record: usize,
    /// Unit vector toward the sun, x east, y north, at the middle one of the record's moments.
    pub sun: DVec3,
    /// Clearness and brightness of the sky at that moment.
    pub clearness: f64,
    /// Brightness of the sky at that moment.
    pub brightness: f64,
    /// Diffuse horizontal illuminance in lux, the mean over the record.
    pub diffuse_horizontal_lux: f64,
    /// Direct normal illuminance in lux, the mean over the record.
    pub direct_normal_lux: f64,
    /// Light of sky and sun in lm through each tube into the room.
    pub tubes_lm: Vec<[f64; 2]>,
    /// Mean illuminance in lux of each grid.
    pub grids_lux: Vec<f64>,
}

/// Results of a year.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Year {
    /// Light outside.
    pub outside: Outside,
    /// Light of each tube.
    pub tubes: Vec<TubeSummary>,
    /// Metrics of each grid.
    pub grids: Vec<GridYear>,
    /// Records with light.
    pub hours: Vec<Hour>,
    /// Number of occupied records.
    pub occupied_records: usize,
}

/// Sets of records, and what is the same for all points.
struct Hours<'a> {
    occupied: &'a [bool],
    daylight: &'a [bool],
    /// Hours of a record.
    each: f64,
    /// Numbers of the records of ABNT NBR 15575; none unless all four are there.
    nbr: Vec<usize>,
    /// Light of each tube under the CIE standard overcast sky, over its horizontal illuminance, in m2.
    overcast_m2: Vec<f64>,
}

impl Hours<'_> {
    /// Returns the number of hours of the records that count.
    fn of(&self, counts: &[bool]) -> f64 {
        self.each * counts.iter().filter(|counts| **counts).count() as f64
    }
}

/// Computes all results of a year.
pub fn year(input: &YearInput, grids: &[GridInput], options: &Options) -> Year {
    let YearInput { weather, lit, tubes, radii, occupied, daylight } = *input;
    let light = RecordLight::new(lit, tubes);
    let each = 1.0 / f64::from(weather.records_per_hour.max(1));
    let nbr: Vec<usize> = NBR_MOMENTS.iter().filter_map(|moment| record_at(&weather.records, *moment, each)).collect();
    let nbr = if nbr.len() == NBR_MOMENTS.len() { nbr } else { Vec::new() };
    let overcast_m2 = tubes.iter().map(|year| year.overcast_m2).collect();
    let hours = Hours { occupied, daylight, each, nbr, overcast_m2 };
    let outside = Outside::new(lit, &hours, light.records.len());
    let summary = |(number, (year, radius)): (usize, (&TubeYear, &f64))| {
        TubeSummary::new((number, year, *radius), lit, &light, weather, &hours, &outside)
    };
    let grids: Vec<GridYear> =
        grids.iter().map(|grid| GridYear::new(grid, &light, &hours, options, &outside)).collect();
    Year {
        outside,
        tubes: tubes.iter().zip(radii).enumerate().map(summary).collect(),
        hours: table(lit, tubes, &grids),
        grids,
        occupied_records: occupied.iter().filter(|occupied| **occupied).count(),
    }
}

/// Returns the record whose interval is nearest to a month, day and hour; `None` if none is within half an hour.
fn record_at(records: &[Record], (month, day, hour): (u8, u8, f64), each: f64) -> Option<usize> {
    let away = |record: &Record| (record.middle_hour - hour).abs();
    let of_day = records.iter().enumerate().filter(|(_, record)| (record.month, record.day) == (month, day));
    let nearest = of_day.min_by(|(_, a), (_, b)| away(a).total_cmp(&away(b)));
    nearest.filter(|(_, record)| away(record) <= 0.5 * each + 1e-9).map(|(number, _)| number)
}

/// Makes the table of hours from the moments of each record.
fn table(lit: &[LitMoment], tubes: &[TubeYear], grids: &[GridYear]) -> Vec<Hour> {
    let mut hours = Vec::new();
    let mut first = 0;
    for moments in lit.chunk_by(|a, b| a.record == b.record) {
        let middle = &moments[moments.len() / 2];
        let mean = |of: &dyn Fn(usize) -> f64| -> f64 {
            moments.iter().enumerate().map(|(number, moment)| moment.share * of(number)).sum()
        };
        let of_tube = |year: &TubeYear| {
            let lights = &year.moments[first..first + moments.len()];
            [mean(&|number| lights[number].sky_lm), mean(&|number| lights[number].sun_lm)]
        };
        hours.push(Hour {
            record: middle.record,
            sun: middle.compass_sun,
            clearness: middle.clearness,
            brightness: middle.brightness,
            diffuse_horizontal_lux: mean(&|number| moments[number].diffuse_horizontal_lux),
            direct_normal_lux: mean(&|number| moments[number].direct_normal_lux),
            tubes_lm: tubes.iter().map(of_tube).collect(),
            grids_lux: grids.iter().map(|grid| grid.mean_by_record_lux[hours.len()]).collect(),
        });
        first += moments.len();
    }
    hours
}
