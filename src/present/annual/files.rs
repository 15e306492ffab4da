//! Files of a year: its summary, the table of hours, the metrics of sensors, and their illuminances by the hour.

use std::fmt::Write as _;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::annual::eyes::{Eye, RATINGS};
use crate::annual::metrics::Value;
use crate::annual::summary::{Hour, PointYear};

use super::{FileYear, GridOfYear, JobYear};
use crate::document::annual::AnnualDocument;
use crate::document::result::annual::{
    ColumnResult, Conventions, GridYearResult, PointsYearResult, SiteResult, TubeYearResult, YearResult,
};
use crate::document::result::weather_files::AnnualResult;
use crate::engine::annual::source_of;
use crate::output::npy;

impl FileYear {
    /// Returns the summary of the year, with these names of its grids.
    pub(super) fn result(&self, grids: &[&str], document: &AnnualDocument) -> YearResult {
        let AnnualDocument { schedule, daylight_saving, maintenance, .. } = document;
        let hours = 1.0 / f64::from(self.weather.records_per_hour.max(1));
        let grids = grids.iter().zip(&self.year.grids);
        YearResult {
            weather: self.name.clone(),
            site: SiteResult::from(&self.weather.site),
            conventions: Conventions {
                sky: "perez".to_owned(),
                illuminance: source_of(document, &self.weather),
                sun_offset_minutes: self.convention.sun_offset_minutes,
                suns_per_hour: self.convention.suns_per_record(&self.weather) * self.weather.records_per_hour,
                year_of_sun: self.weather.year_of_sun,
                records: self.weather.records.len(),
                lit_records: self.year.hours.len(),
                records_per_hour: self.weather.records_per_hour,
                occupied_hours: hours * self.year.occupied_records as f64,
                schedule: schedule.clone(),
                daylight_saving: *daylight_saving,
                maintenance: maintenance.unwrap_or([1.0; 12]),
            },
            outside: (&self.year.outside).into(),
            tubes: self.year.tubes.iter().map(TubeYearResult::from).collect(),
            grids: grids.map(|(name, year)| GridYearResult::new(name, year, document)).collect(),
        }
    }
}

impl JobYear {
    /// Returns the summary of the years.
    pub fn summary(&self) -> AnnualResult {
        let names: Vec<&str> = self.grids.iter().map(|of| of.grid.name.as_str()).collect();
        AnnualResult::new(self.first.result(&names, &self.document), self.others.clone())
    }

    /// Returns the metrics of the sensors of a grid; `None` if there is no grid of this name.
    pub fn points(&self, name: &str) -> Option<PointsYearResult> {
        let (number, of) = self.grid(name)?;
        let year = &self.first.year.grids[number];
        let sensors = || (0..of.weights.len()).map(|sensor| of.grid.sensor(sensor));
        let points_m = sensors().map(|sensor| sensor.position.to_array()).collect();
        let normals = sensors().map(|sensor| sensor.normal.to_array()).collect();
        let optional = |name: String, value: &dyn Fn(&PointYear) -> Option<Value>| {
            let values = year.points.iter().zip(&of.weights);
            let values: Vec<Option<Value>> =
                values.map(|(point, weight)| if *weight > 0.0 { value(point) } else { None }).collect();
            ColumnResult {
                name,
                values: values.iter().map(|value| value.map(|value| value.value)).collect(),
                standard_errors: values.iter().map(|value| value.map(|value| value.standard_error)).collect(),
            }
        };
        let column = |name: String, value: &dyn Fn(&PointYear) -> Value| optional(name, &|point| Some(value(point)));
        let mut columns = Vec::new();
        for (number, lux) in self.document.thresholds_lux.iter().enumerate() {
            columns.push(column(format!("da_{lux}_percent"), &|point| point.autonomies_percent[number]));
            columns.push(column(format!("cda_{lux}_percent"), &|point| point.continuous_percent[number]));
        }
        let [low, middle, high] = self.document.udi_lux;
        columns.push(column(format!("udi_below_{low}_percent"), &|point| point.useful.below_percent));
        columns.push(column(format!("udi_{low}_{middle}_percent"), &|point| point.useful.supplementary_percent));
        columns.push(column(format!("udi_{middle}_{high}_percent"), &|point| point.useful.autonomous_percent));
        columns.push(column(format!("udi_above_{high}_percent"), &|point| point.useful.above_percent));
        columns.push(column("exposure_klxh".to_owned(), &|point| point.exposure_klxh));
        columns.push(column("mean_lux".to_owned(), &|point| point.mean_lux));
        columns.push(column("median_lux".to_owned(), &|point| point.median_lux));
        columns.push(column("daylight_factor_percent".to_owned(), &|point| point.daylight_factor_percent));
        if year.points.iter().any(|point| point.direct_hours.is_some_and(|hours| hours.value > 0.0)) {
            columns.push(column("direct_sun_hours".to_owned(), &|point| point.direct_hours.unwrap_or_default()));
        }
        if year.points.iter().any(|point| point.glare.is_some()) {
            for (number, limit) in RATINGS.into_iter().enumerate() {
                let above = |point: &PointYear| point.glare.map(|glare| glare.above_percent[number]);
                columns.push(optional(format!("ugr_above_{limit}_percent"), &above));
            }
            columns.push(optional("largest_ugr".to_owned(), &|point| point.glare.map(|glare| glare.largest)));
        }
        let by_tube = year.points.iter().map(|point| point.by_tube_lux.len()).max().unwrap_or(0);
        for tube in 0..by_tube {
            let exact = move |point: &PointYear| Value {
                value: point.by_tube_lux.get(tube).copied().unwrap_or(0.0),
                standard_error: 0.0,
            };
            columns.push(ColumnResult {
                standard_errors: Vec::new(),
                ..column(format!("mean_of_tube_{}_lux", tube + 1), &exact)
            });
        }
        Some(PointsYearResult { name: name.to_owned(), points_m, normals, columns })
    }

    /// Returns the table of the records with light: time, sun, sky, lumens of each tube and mean illuminance of each grid.
    pub fn hours_csv(&self) -> String {
        let mut table = "month,day,hour,sun_altitude_deg,sun_azimuth_deg,clearness,brightness,diffuse_horizontal_lux,\
                         direct_normal_lux"
            .to_owned();
        for tube in 1..=self.first.year.tubes.len() {
            let _ = write!(table, ",tube_{tube}_sky_lm,tube_{tube}_sun_lm");
        }
        for of in &self.grids {
            let _ = write!(table, ",{}_mean_lux", of.grid.name);
        }
        let eyes: Vec<(String, Vec<f64>)> = self.grids.iter().flat_map(|of| of.ratings(self)).collect();
        for (name, _) in &eyes {
            let _ = write!(table, ",{name}");
        }
        table.push('\n');
        for (place, hour) in self.first.year.hours.iter().enumerate() {
            self.hour(&mut table, hour);
            for (_, ratings) in &eyes {
                let _ = write!(table, ",{:.2}", ratings[place]);
            }
            table.push('\n');
        }
        table
    }

    fn hour(&self, table: &mut String, hour: &Hour) {
        let record = &self.first.weather.records[hour.record];
        let altitude = libm::asin(hour.sun.z.clamp(-1.0, 1.0)).to_degrees();
        let azimuth = libm::atan2(hour.sun.x, hour.sun.y).to_degrees().rem_euclid(360.0);
        let _ = write!(
            table,
            "{},{},{},{altitude:.4},{azimuth:.4},{:.5},{:.5},{:.1},{:.1}",
            record.month,
            record.day,
            record.middle_hour,
            hour.clearness,
            hour.brightness,
            hour.diffuse_horizontal_lux,
            hour.direct_normal_lux
        );
        for [sky, sun] in &hour.tubes_lm {
            let _ = write!(table, ",{sky:.2},{sun:.2}");
        }
        for lux in &hour.grids_lux {
            let _ = write!(table, ",{lux:.2}");
        }
    }

    /// Returns the illuminances of the sensors of a grid in lux in all records, as an array of NumPy (version 1.0): float32, one row for
    /// each sensor.
    pub fn npy(&self, name: &str) -> Option<Vec<u8>> {
        let (_, of) = self.grid(name)?;
        let (sensors, records) = (of.weights.len(), self.first.weather.records.len());
        Some(npy::encode([sensors, records], (0..sensors).flat_map(|sensor| of.row(sensor, self, records))))
    }

    /// Returns the illuminances of the sensors of a grid in lux in the records with light, as Radiance writes them: a line for each
    /// sensor, without a header.
    pub fn ill(&self, name: &str) -> Option<String> {
        let (_, of) = self.grid(name)?;
        let line = |sensor: usize| {
            let row = of.row(sensor, self, self.first.weather.records.len());
            let mut line = String::new();
            for (place, hour) in self.first.year.hours.iter().enumerate() {
                let _ = write!(line, "{}{:.2}", if place > 0 { "\t" } else { "" }, row[hour.record]);
            }
            line.push('\n');
            line
        };
        Some((0..of.weights.len()).into_par_iter().map(line).collect())
    }

    /// Returns the fractions of the electric power of each grid in all records, 0 where it is not occupied; `None` without electric light.
    pub fn lighting_csv(&self) -> Option<String> {
        let dimming = self.dimming.as_ref()?;
        let mut table = "month,day,hour".to_owned();
        for of in &self.grids {
            let _ = write!(table, ",{}_power_fraction", of.grid.name);
        }
        table.push('\n');
        let FileYear { weather, light, occupied, year, .. } = &self.first;
        for (number, (record, occupied)) in weather.records.iter().zip(occupied).enumerate() {
            let _ = write!(table, "{},{},{}", record.month, record.day, record.middle_hour);
            let lit = light.records.binary_search(&number).ok();
            for grid in &year.grids {
                let lux = lit.map_or(0.0, |lit| grid.mean_by_record_lux[lit]);
                let _ = write!(table, ",{:.4}", if *occupied { dimming.power_fraction(lux) } else { 0.0 });
            }
            table.push('\n');
        }
        Some(table)
    }

    pub(super) fn grid(&self, name: &str) -> Option<(usize, &GridOfYear)> {
        self.grids.iter().enumerate().find(|(_, of)| of.grid.name == name)
    }
}

/// Largest number of eyes of a grid whose ratings are in the table of hours.
const MOST_EYES: usize = 16;

impl GridOfYear {
    /// Returns the unified glare ratings of the first eyes in the records with light, each with the name of its column.
    fn ratings(&self, year: &JobYear) -> Vec<(String, Vec<f64>)> {
        let sensors = self.sensors(0, year.first.weather.records.len());
        if self.other.is_some() {
            return Vec::new();
        }
        let eyes = self.eyes.iter().enumerate().filter_map(|(sensor, eye)| Some((sensor, eye.as_ref()?)));
        let ratings = |(sensor, eye): (usize, &Eye)| {
            let lux = sensors.row(sensor, &year.first.light).lux;
            (format!("{}_{}_ugr", self.grid.name, sensor + 1), eye.ratings(&lux, &year.first.light))
        };
        eyes.take(MOST_EYES).map(ratings).collect()
    }

    /// Returns the illuminances of a sensor in all records; not-a-number for a sensor without a value.
    pub(super) fn row(&self, sensor: usize, year: &JobYear, records: usize) -> Vec<f32> {
        match self.weights[sensor] > 0.0 {
            true => self.sensors(0, records).row_lux(sensor, &year.first.light),
            false => vec![f32::NAN; records],
        }
    }
}

impl PointsYearResult {
    /// Returns the metrics as a table, a row for each sensor.
    pub fn csv(&self) -> String {
        let mut table = "x_m,y_m,z_m,normal_x,normal_y,normal_z".to_owned();
        for column in &self.columns {
            let _ = write!(table, ",{}", column.name);
            if !column.standard_errors.is_empty() {
                let _ = write!(table, ",{}_standard_error", column.name);
            }
        }
        table.push('\n');
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.5}"));
        for (sensor, ([x, y, z], [u, v, w])) in self.points_m.iter().zip(&self.normals).enumerate() {
            let _ = write!(table, "{x},{y},{z},{u},{v},{w}");
            for column in &self.columns {
                let _ = write!(table, ",{}", number(column.values[sensor]));
                if let Some(error) = column.standard_errors.get(sensor) {
                    let _ = write!(table, ",{}", number(*error));
                }
            }
            table.push('\n');
        }
        table
    }
}
