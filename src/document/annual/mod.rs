//! A year of daylight in a job document: its weather file, its occupied hours, and the metrics that are computed from it.

pub(super) mod check;
pub mod hours;
mod schedule;
mod weather_names;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::schema::shapes::{MonthlyFactors, Threshold, UsefulLimits};

pub use schedule::{DayOfYear, DaylightSavingDocument, PeriodDocument, ScheduleDocument, Weekday};
pub use weather_names::WeatherNames;

/// Year of daylight by a weather file, in place of `sky` and `time`.
///
/// The grids' own values are those under the CIE standard overcast sky of 10 000 lx, from which daylight factors follow; the year follows
/// from their responses to the tubes and from the lumens of every tube by the hour.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AnnualDocument {
    /// Weather file: id of an upload (`POST /v1/weather`), or, on the command line, path of an EPW or WEA file. Several files, at most 32, have
    /// a year each with the same responses of the room.
    pub weather: WeatherNames,
    /// Part of the year that is computed; default: all records of the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period: Option<PeriodDocument>,
    /// Source of the illuminances of sky and sun.
    #[serde(default)]
    pub illuminance: IlluminanceSource,
    /// Minutes from the stamp of each record (EPW: the end of its interval, WEA: the middle) to the moment that it stands for; default: as
    /// the file's kind and its test say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun_offset_minutes: Option<f64>,
    /// Positions of the sun in an hour, 1..12.
    #[serde(default = "one")]
    #[schema(default = 1)]
    pub suns_per_hour: u32,
    /// Hours in which the room is occupied, to which most metrics refer.
    #[serde(default)]
    pub schedule: ScheduleDocument,
    /// Summer time of the schedule's clock.
    #[serde(default)]
    pub daylight_saving: DaylightSavingDocument,
    /// Illuminances in lux of the daylight autonomies, 1 to 16.
    #[serde(default = "thresholds")]
    #[schema(value_type = Vec<Threshold>)]
    pub thresholds_lux: Vec<f64>,
    /// Ascending limits in lux of the useful daylight illuminances.
    #[serde(default = "udi")]
    #[schema(value_type = UsefulLimits)]
    pub udi_lux: [f64; 3],
    /// Illuminance and share of time of the spatial daylight autonomy.
    #[serde(default)]
    pub sda: SdaDocument,
    /// Electric light that daylight saves; absent: not computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dimming: Option<DimmingDocument>,
    /// Daylight of other openings, such as windows, as another program has computed it for the year; added to that of the tubes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_daylight: Vec<OtherDaylightDocument>,
    /// Factors of the light of all tubes in each month, January first, 0..1, such as for dirt and leaves; default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<MonthlyFactors>)]
    pub maintenance: Option<[f64; 12]>,
}

impl AnnualDocument {
    /// Returns the factor of the light of all tubes in a month, 1 to 12.
    pub fn maintenance_factor(&self, month: u8) -> f64 {
        self.maintenance.map_or(1.0, |factors| factors[usize::from(month) - 1])
    }
}

/// Other daylight of a grid.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct OtherDaylightDocument {
    /// Name of the grid.
    pub grid: String,
    /// Array of NumPy of the illuminances in lux, sensors x records, as `points.NAME.npy` of a year: id of an upload (`POST /v1/arrays`), or, on
    /// the command line, path of the file.
    pub file: String,
}

/// Source of the illuminances of sky and sun.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum IlluminanceSource {
    /// Luminous efficacies of Perez et al. (1990), from the irradiances of the file.
    #[default]
    Perez,
    /// Illuminances of the file.
    File,
}

/// Spatial daylight autonomy: share of the area that reaches an illuminance for a share of the occupied time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SdaDocument {
    /// Illuminance in lux.
    pub threshold_lux: f64,
    /// Share of the occupied time in percent.
    pub time_percent: f64,
}

impl Default for SdaDocument {
    fn default() -> Self {
        Self { threshold_lux: 300.0, time_percent: 50.0 }
    }
}

/// Electric light of one zone that an ideal sensor dims to its set point: an upper estimate of what daylight saves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DimmingDocument {
    /// Illuminance in lux that daylight and electric light give together.
    pub setpoint_lux: f64,
    /// Electric power at full light in W per m2 of the room's floor.
    pub power_w_m2: f64,
    /// Fraction of the power at the least light, 0..1.
    pub minimum_power: f64,
    /// Least fraction of the light, 0..1 and below 1.
    pub minimum_light: f64,
    /// Switches the light off where daylight suffices.
    pub switch_off: bool,
}

impl Default for DimmingDocument {
    fn default() -> Self {
        Self { setpoint_lux: 500.0, power_w_m2: 6.0, minimum_power: 0.1, minimum_light: 0.1, switch_off: false }
    }
}

fn one() -> u32 {
    1
}

fn thresholds() -> Vec<f64> {
    vec![100.0, 300.0, 500.0, 750.0]
}

fn udi() -> [f64; 3] {
    [100.0, 300.0, 3000.0]
}
