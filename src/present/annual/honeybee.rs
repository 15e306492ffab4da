//! Illuminances by the hour in the folder that the post-processing of Honeybee reads.
//!
//! The light of tubes needs no schedule of blinds, so that it is that of its group of static apertures. Sensors without a value are dark there.

use serde_json::json;

use super::JobYear;
use crate::annual::weather::Record;
use crate::output::npy;
use crate::present::outputs::STATIC_APERTURES;

impl JobYear {
    /// Describes the grids: names, numbers of sensors, and the groups that light them.
    pub fn honeybee_grids(&self) -> serde_json::Value {
        let grid = |of: &super::GridOfYear| {
            let (name, count) = (&of.grid.name, of.weights.len());
            json!({ "name": name, "identifier": name, "full_id": name, "count": count, "group": "",
                    "light_path": [[STATIC_APERTURES]] })
        };
        self.grids.iter().map(grid).collect()
    }

    /// Describes the records: their number in an hour, and the hours of the year at which they begin.
    pub fn honeybee_study(&self) -> serde_json::Value {
        let hours: Vec<f64> = self.first.weather.records.iter().map(|record| self.hour_of_year(record)).collect();
        json!({ "timestep": self.first.weather.records_per_hour, "study_hours": hours })
    }

    /// Lists the hours of the year at which the records with light begin, a line for each.
    pub fn honeybee_hours(&self) -> String {
        let begins = |record: &usize| format!("{}\n", self.hour_of_year(&self.first.weather.records[*record]));
        self.first.light.records.iter().map(begins).collect()
    }

    /// Returns the illuminances of the sensors of a grid in lux in the records with light, as an array of NumPy.
    pub fn honeybee_lux(&self, name: &str) -> Option<Vec<u8>> {
        let (_, of) = self.grid(name)?;
        let (sensors, lit) = (of.weights.len(), &self.first.light.records);
        let row = |sensor: usize| {
            let row = of.row(sensor, self, self.first.weather.records.len());
            lit.iter().map(move |record| if row[*record].is_finite() { row[*record] } else { 0.0 })
        };
        Some(npy::encode([sensors, lit.len()], (0..sensors).flat_map(row)))
    }

    fn hour_of_year(&self, record: &Record) -> f64 {
        let weather = &self.first.weather;
        weather.middle_of_year_hours(record) - 0.5 / f64::from(weather.records_per_hour.max(1))
    }
}
