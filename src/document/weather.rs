//! Reports on weather files, as the service and the command line give them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Warning, WarningCode};
use crate::annual::moment::{Convention, Dropped, Moments, moments};
use crate::annual::weather::{self, Record, RepairKind, SunOfFile, Weather, WeatherError};

/// Share of the year's light without sun above which there is a warning.
const MUCH_DROPPED: f64 = 0.005;

/// Kind of a weather file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WeatherFormat {
    /// EnergyPlus weather.
    Epw,
    /// Weather of Radiance.
    Wea,
}

/// Content and faults of a weather file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WeatherReport {
    /// Kind of the file.
    pub format: WeatherFormat,
    /// Name of the place as the file has it.
    pub name: String,
    /// Latitude in degrees, north positive.
    pub latitude_deg: f64,
    /// Longitude in degrees, east positive.
    pub longitude_deg: f64,
    /// Hours by which standard time is ahead of UTC.
    pub utc_offset_hours: f64,
    /// Height above sea level in metres.
    pub elevation_m: f64,
    /// Comments of the file on its origin.
    pub comments: Vec<String>,
    /// Month and day of the first record.
    #[schema(example = "01-01")]
    pub from: String,
    /// Month and day of the last record.
    #[schema(example = "12-31")]
    pub to: String,
    /// Number of records.
    pub records: u64,
    /// Number of records in an hour.
    pub records_per_hour: u32,
    /// Number of records with light while the sun is up.
    pub records_with_light: u64,
    /// Year by which the sun's positions are computed: that of the records, or 2017 (2016 with 29 February) for typical years.
    pub year_of_sun: i32,
    /// First and last day of summer time as the file has them; null without.
    pub daylight_saving: Option<[String; 2]>,
    /// Minutes from the stamp of a record to the moment for which it stands.
    pub sun_offset_minutes: f64,
    /// Test of that moment by the irradiances; null for files without global irradiance, or with few records with sun.
    pub closure: Option<ClosureReport>,
    /// Repaired values by kind.
    pub repairs: Vec<RepairReport>,
    /// Notes on the file.
    pub warnings: Vec<Warning>,
}

/// Test for the moments that records stand for: global irradiance is diffuse irradiance and the direct one on a level plane, with the
/// sun where it was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ClosureReport {
    /// Number of records with sun that were tested.
    pub records: u64,
    /// Minutes from the stamp of a record to the position of the sun that fits best.
    pub best_offset_minutes: f64,
    /// Rms error of the global irradiance at the best offset, W/m2.
    pub rms_at_best_w_m2: f64,
    /// Minutes from the stamp of a record to the middle of its interval.
    pub usual_offset_minutes: f64,
    /// Rms error of the global irradiance with the sun in the middle of the intervals, W/m2.
    pub rms_at_usual_w_m2: f64,
}

/// Kind of a repair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RepairName {
    /// An irradiance between -5 and 0 W/m2 was taken as 0.
    NegativeIrradiance,
    /// A missing direct irradiance was computed from the global and the diffuse one.
    MissingDirect,
    /// A missing diffuse irradiance was computed from the global and the direct one.
    MissingDiffuse,
    /// Direct light on a level plane was left out, because the sun is too low to compute the beam from it.
    LowDirect,
    /// Missing irradiances were copied from the same hour of another day.
    MissingHour,
    /// A missing dew point was taken as 11 degrees Celsius.
    MissingDewPoint,
}

impl From<RepairKind> for RepairName {
    fn from(kind: RepairKind) -> Self {
        match kind {
            RepairKind::NegativeIrradiance => Self::NegativeIrradiance,
            RepairKind::MissingDirect => Self::MissingDirect,
            RepairKind::MissingDiffuse => Self::MissingDiffuse,
            RepairKind::LowDirect => Self::LowDirect,
            RepairKind::MissingHour => Self::MissingHour,
            RepairKind::MissingDewPoint => Self::MissingDewPoint,
        }
    }
}

/// Repairs of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RepairReport {
    /// Kind of the repairs.
    pub kind: RepairName,
    /// Number of repaired values.
    pub count: u64,
    /// Line of the first one in the file.
    pub first_line: u64,
}

/// Reads a weather file and reports on it.
pub fn read_weather(bytes: &[u8]) -> Result<(Weather, WeatherReport), WeatherError> {
    let weather = weather::read(bytes)?;
    let moments = moments(&weather, Convention::of(&weather)).map_err(|error| WeatherError {
        line: weather.file.first_line,
        field: None,
        detail: error.to_string(),
    })?;
    let report = WeatherReport::new(&weather, &moments);
    Ok((weather, report))
}

impl WeatherReport {
    fn new(weather: &Weather, moments: &Moments) -> Self {
        let day = |month: u8, day: u8| format!("{month:02}-{day:02}");
        let of_record =
            |record: Option<&weather::Record>| record.map(|record| day(record.month, record.day)).unwrap_or_default();
        let site = &weather.site;
        let closure = weather.file.closure.map(|closure| ClosureReport {
            records: closure.records as u64,
            best_offset_minutes: closure.best_offset_minutes,
            rms_at_best_w_m2: closure.rms_at_best_w_m2,
            usual_offset_minutes: closure.usual_offset_minutes,
            rms_at_usual_w_m2: closure.rms_at_usual_w_m2,
        });
        let repair = |repair: &weather::Repair| RepairReport {
            kind: repair.kind.into(),
            count: repair.count as u64,
            first_line: repair.first_line as u64,
        };
        Self {
            format: match weather.file.format {
                weather::Format::Epw => WeatherFormat::Epw,
                weather::Format::Wea => WeatherFormat::Wea,
            },
            name: site.name.clone(),
            latitude_deg: site.latitude_deg,
            longitude_deg: site.longitude_deg,
            utc_offset_hours: site.utc_offset_hours,
            elevation_m: site.elevation_m,
            comments: weather.file.comments.clone(),
            from: of_record(weather.records.first()),
            to: of_record(weather.records.last()),
            records: weather.records.len() as u64,
            records_per_hour: weather.records_per_hour,
            records_with_light: moments.moments.len() as u64,
            year_of_sun: weather.year_of_sun,
            daylight_saving: weather.daylight_saving.map(|days| days.map(|(month, of_month)| day(month, of_month))),
            sun_offset_minutes: weather.sun_offset_minutes,
            closure,
            repairs: weather.file.repairs.iter().map(repair).collect(),
            warnings: notes_on(weather, moments.dropped),
        }
    }
}

/// Returns notes on a weather file, of which some light may have been dropped.
pub(crate) fn notes_on(weather: &Weather, dropped: Dropped) -> Vec<Warning> {
    let hours = weather.file.repairs.iter().find(|repair| repair.kind == RepairKind::MissingHour);
    let missing = hours.map(|repair| Warning {
        code: WarningCode::WeatherHoursMissing,
        detail: format!(
            "{} records have no irradiances, first in line {}; they have those of the same hour of another day",
            repair.count, repair.first_line
        ),
    });
    let closure = weather.file.closure.filter(|closure| closure.sun == SunOfFile::Doubtful);
    let offset = closure.map(|closure| Warning {
        code: WarningCode::WeatherSunOffset,
        detail: format!(
            "the irradiances fit a sun at {} min from the stamps of the records (rms error {:.1} W/m2) better than that of the middle \
             of their intervals at {} min ({:.1} W/m2), which is used",
            closure.best_offset_minutes,
            closure.rms_at_best_w_m2,
            closure.usual_offset_minutes,
            closure.rms_at_usual_w_m2
        ),
    });
    let line = dropped.first_record.map_or(0, |record| weather.file.first_line + record);
    let without_sun = (dropped.share_of_light > MUCH_DROPPED).then(|| Warning {
        code: WarningCode::WeatherLightWithoutSun,
        detail: format!(
            "{} records have light while the sun is down, first in line {line}: {:.1} % of all irradiances, which are left out",
            dropped.records,
            100.0 * dropped.share_of_light
        ),
    });
    let dark = (!weather.records.iter().any(Record::has_light)).then(|| Warning {
        code: WarningCode::WeatherWithoutLight,
        detail: "no record has an irradiance above 0: the whole year is dark".to_owned(),
    });
    [missing, offset, without_sun, dark].into_iter().flatten().collect()
}
