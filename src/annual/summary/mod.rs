//! Results of a year: from lit moments, lumens of tubes and responses to all metrics, monthly sums and the table of hours.

mod grid;
mod input;
mod outside;
mod point;
mod tube;

use glam::DVec3;

use crate::fluxes::TubeYear;
use crate::light::LitMoment;
use crate::response::RecordLight;
use input::Hours;

pub use grid::GridYear;
pub use input::{GridInput, Options, YearInput};
pub use outside::Outside;
pub use point::PointYear;
pub use tube::TubeSummary;

/// Row of the table of hours: a record with light.
#[derive(Clone, Debug, PartialEq)]
pub struct Hour {
    /// Number of the record.
    pub record: usize,
    /// Unit vector toward the sun, x east, y north, at the middle one of the record's moments.
    pub sun: DVec3,
    /// Clearness of the sky at that moment.
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

/// Computes all results of a year; `light` is that of its tubes by records.
pub fn year(input: &YearInput, light: &RecordLight, grids: &[GridInput], options: &Options) -> Year {
    let YearInput { records, lit, tubes, radii, occupied, .. } = *input;
    let hours = Hours::new(input);
    let outside = Outside::new(lit, &hours);
    let summary = |(number, (year, radius)): (usize, (&TubeYear, &f64))| {
        TubeSummary::new((number, year, *radius), lit, light, records, &hours, &outside)
    };
    let grids: Vec<GridYear> = grids.iter().map(|grid| GridYear::new(grid, light, &hours, options, &outside)).collect();
    Year {
        outside,
        tubes: tubes.iter().zip(radii).enumerate().map(summary).collect(),
        hours: table(lit, tubes, &grids),
        grids,
        occupied_records: occupied.iter().filter(|occupied| **occupied).count(),
    }
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
