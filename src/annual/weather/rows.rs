//! Records as files have them, before they are completed, and counts of repairs.

use std::collections::BTreeMap;

use super::record::{Format, Site};
use crate::calendar::Date;

/// Dew point that stands for missing ones, in degrees Celsius, as in gendaylit of Radiance.
pub(super) const USUAL_DEW_POINT_C: f64 = 11.0;

/// Kind of a repair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RepairKind {
    /// An irradiance between -5 and 0 W/m2 was taken as 0.
    NegativeIrradiance,
    /// A missing direct irradiance is the global one without the diffuse one.
    MissingDirect,
    /// A missing diffuse irradiance is the global one without the direct one.
    MissingDiffuse,
    /// Direct light on a level plane, with the sun below 5 degrees, says nothing of the beam and was left out.
    LowDirect,
    /// An hour without irradiances has those of the same hour of the day before (of a day after, if there is none before).
    MissingHour,
    /// A missing dew point was taken as 11 degrees Celsius.
    MissingDewPoint,
}

/// Repairs of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repair {
    /// Kind of the repairs.
    pub kind: RepairKind,
    /// Number of values, or of hours.
    pub count: usize,
    /// Line of the first one.
    pub first_line: usize,
}

/// Counts of repairs.
#[derive(Debug, Default)]
pub(super) struct Repairs(BTreeMap<RepairKind, Repair>);

impl Repairs {
    /// Counts a repair in a line.
    pub fn count(&mut self, kind: RepairKind, line: usize) {
        let repair = self.0.entry(kind).or_insert(Repair { kind, count: 0, first_line: line });
        repair.count += 1;
        repair.first_line = repair.first_line.min(line);
    }

    /// Returns the repairs in the order of their kinds.
    pub fn listed(self) -> Vec<Repair> {
        self.0.into_values().collect()
    }

    /// Returns an irradiance in W/m2, 0 if it is slightly negative, nothing if it is missing.
    pub fn irradiance(&mut self, value: f64, line: usize) -> Option<f64> {
        if value >= 9999.0 || value <= -5.0 {
            return None;
        }
        if value < 0.0 {
            self.count(RepairKind::NegativeIrradiance, line);
        }
        // also -0
        Some(if value > 0.0 { value } else { 0.0 })
    }
}

/// Record as a file has it; what is missing is none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub date: Date,
    /// Middle of the interval in hours, as the file's kind says it.
    pub middle_hour: f64,
    pub global_w_m2: Option<f64>,
    pub direct_normal_w_m2: Option<f64>,
    pub diffuse_w_m2: Option<f64>,
    pub dew_point_c: f64,
    pub illuminances_lux: Option<[f64; 2]>,
}

/// Records of a file with what its header says.
#[derive(Debug)]
pub(super) struct Rows {
    pub format: Format,
    pub site: Site,
    pub comments: Vec<String>,
    pub records_per_hour: u32,
    pub year_of_sun: i32,
    pub first_weekday: u8,
    pub daylight_saving: Option<[Date; 2]>,
    /// Line of the first row; each row has one line.
    pub first_line: usize,
    pub rows: Vec<Row>,
    /// True if the file has direct light on a level plane: to compute the beam from it is then no repair.
    pub direct_is_horizontal: bool,
    /// True if the file has illuminances in place of irradiances.
    pub is_photometric: bool,
    pub repairs: Repairs,
}
