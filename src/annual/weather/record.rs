//! Site and records of weather.

/// Place of a weather file.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// Name of the place as the file has it.
    pub name: String,
    /// Latitude in degrees, north positive, -90..=90.
    pub latitude_deg: f64,
    /// Longitude in degrees, east positive, -180..=180.
    pub longitude_deg: f64,
    /// Hours by which standard time is ahead of UTC, -12..=14, also halves and quarters.
    pub utc_offset_hours: f64,
    /// Height above sea level in metres.
    pub elevation_m: f64,
}

/// Record of a weather file: means over one interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Month, 1..=12.
    pub month: u8,
    /// Day of the month, from 1.
    pub day: u8,
    /// Middle of the interval in hours of standard time, 0..24, as the file's kind says it, before any offset of the sun.
    pub middle_hour: f64,
    /// Direct normal irradiance in W/m2, >= 0.
    pub direct_normal_w_m2: f64,
    /// Diffuse horizontal irradiance in W/m2, >= 0.
    pub diffuse_horizontal_w_m2: f64,
    /// Dew point in degrees Celsius.
    pub dew_point_c: f64,
    /// Direct normal and diffuse horizontal illuminance in lux as the file has them.
    pub illuminances_lux: Option<[f64; 2]>,
}

impl Record {
    /// True if the record has any light.
    pub fn has_light(&self) -> bool {
        self.direct_normal_w_m2 + self.diffuse_horizontal_w_m2 > 0.0
    }
}

/// Kind of a weather file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// EnergyPlus weather: a record's stamp is the end of its interval.
    Epw,
    /// Weather of Radiance: a record's stamp is the middle of its interval.
    Wea,
}

/// Returns the minutes from the stamp of a record to the middle of its interval, which a kind of files is defined by.
pub(super) fn usual_offset_minutes(format: Format, records_per_hour: u32) -> f64 {
    match format {
        Format::Epw => -30.0 / f64::from(records_per_hour),
        Format::Wea => 0.0,
    }
}
