//! Year of a job: its document and its weather.

use std::sync::Arc;

use crate::annual::moment::{Convention, moments};
use crate::annual::weather::{Site, Weather};
use crate::document::annual::{AnnualDocument, ScheduleDocument};
use crate::document::limits::{SENSORS_TIMES_RECORDS, TUBES_TIMES_MOMENTS};
use crate::document::sky::LocationDocument;
use crate::document::weather::notes_on;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, MeshSource, ValidJob, Warning};
use crate::scene::{Grid, Scene};

/// Largest difference in degrees of the latitude and the longitude of a document and of its weather file.
const NEAR_DEG: f64 = 0.5;

/// Year of a job.
pub(crate) struct AnnualJob {
    /// Part of the document that asks for it.
    pub document: AnnualDocument,
    /// Weather of the whole file, at the place of the document if it has one.
    pub weather: Arc<Weather>,
    /// Azimuth of the room's +y axis in radians, clockwise from north.
    pub rotation: f64,
}

impl AnnualJob {
    /// Reads the weather of a document with a year, and adds notes on it to the warnings; `None` for a document without one.
    pub fn read(
        document: &ValidJob,
        files: &dyn MeshSource,
        scene: &Scene,
        warnings: &mut Vec<Warning>,
    ) -> Result<Option<Self>, DocumentErrors> {
        let Some(annual) = &document.annual else { return Ok(None) };
        let fault = |pointer: &str, detail: String| FieldError::new(pointer, detail);
        let mut weather = files.weather(&annual.weather).map_err(|detail| fault("/annual/weather", detail))?;
        if let Some(location) = &document.location {
            let site = place(location, &weather.site).map_err(|detail| fault("/location", detail))?;
            weather = Arc::new(Weather { site, ..Weather::clone(&weather) });
        }
        if let ScheduleDocument::Hours(hours) = &annual.schedule {
            let needed = weather.records.len() / weather.records_per_hour.max(1) as usize;
            if hours.occupied.len() != needed {
                let found = hours.occupied.len();
                let detail = format!("must have a value for each of the {needed} hours of the file, but has {found}");
                return Err(fault("/annual/schedule/occupied", detail).into());
            }
        }
        check_size(annual, &weather, scene)?;
        let convention = Convention {
            sun_offset_minutes: annual.sun_offset_minutes.unwrap_or(weather.sun_offset_minutes),
            ..Convention::of(&weather)
        };
        let found = moments(&weather, convention).map_err(|error| fault("/annual/weather", error.to_string()))?;
        warnings.extend(notes_on(&weather, found.dropped));
        Ok(Some(Self { document: annual.clone(), weather, rotation: document.room.rotation_deg.to_radians() }))
    }
}

/// Checks that a year has no more values than memory and time allow.
fn check_size(annual: &AnnualDocument, weather: &Weather, scene: &Scene) -> Result<(), FieldError> {
    let records = weather.records.len();
    let sensors: usize = scene.grids.iter().map(Grid::len).sum();
    let suns = annual.suns_per_hour.div_ceil(weather.records_per_hour.max(1)) as usize;
    for (pointer, things, count, most) in [
        ("/grids", "sensors", sensors, SENSORS_TIMES_RECORDS),
        ("/tubes", "tubes times `suns_per_hour`", scene.tubes.len().saturating_mul(suns), TUBES_TIMES_MOMENTS),
    ] {
        let product = count.saturating_mul(records);
        if product > most {
            let detail = format!(
                "the number of {things} times the {records} records of the year must be <= {most}, but is {product}"
            );
            return Err(FieldError::new(pointer, detail).coded(FieldErrorCode::TooMany));
        }
    }
    Ok(())
}

/// Returns the place of a document, which must be near that of its weather file.
fn place(location: &LocationDocument, site: &Site) -> Result<Site, String> {
    let turn = (location.longitude_deg - site.longitude_deg).rem_euclid(360.0);
    let away = (location.latitude_deg - site.latitude_deg).abs().max(turn.min(360.0 - turn));
    if away > NEAR_DEG {
        return Err(format!(
            "must be within {NEAR_DEG} degrees of the weather file's place, {:.3}, {:.3}; it may be left out",
            site.latitude_deg, site.longitude_deg
        ));
    }
    let LocationDocument { latitude_deg, longitude_deg, elevation_m } = *location;
    Ok(Site { latitude_deg, longitude_deg, elevation_m, ..site.clone() })
}
