//! Light of the tubes of a job by its weather files: what its years have before anything is known of the room.

use std::sync::Arc;

use crate::annual::fluxes::{TubeYear, tube_years};
use crate::annual::light::{Illuminances, LitMoment, by_record, lit};
use crate::annual::response::RecordLight;
use crate::annual::schedule::daylight_hours;
use crate::annual::weather::Weather;
use crate::document::annual::{AnnualDocument, IlluminanceSource};
use crate::engine::annual::{AnnualJob, WeatherYear};
use crate::engine::passes::RenderError;
use crate::engine::prepare::RenderJob;

/// Light of the tubes by a weather file.
pub struct FileLumens {
    /// Moments with light.
    pub(super) lit: Vec<LitMoment>,
    /// Daylight hours of EN 17037: one entry for each record.
    pub(super) daylight: Vec<bool>,
    /// Light of each tube at these moments.
    pub(super) tubes: Vec<TubeYear>,
    /// Light of the tubes by records.
    pub(super) light: RecordLight,
}

impl FileLumens {
    /// Computes the light of the tubes of a job by each of its weather files; none without a year.
    pub fn of_job(job: &RenderJob) -> Result<Vec<Arc<Self>>, RenderError> {
        let Some(annual) = &job.annual else { return Ok(Vec::new()) };
        annual.files.iter().map(|file| Self::new(job, annual, file).map(Arc::new)).collect()
    }

    fn new(job: &RenderJob, annual: &AnnualJob, file: &WeatherYear) -> Result<Self, RenderError> {
        let AnnualJob { document, rotation, .. } = annual;
        let WeatherYear { weather, moments, .. } = file;
        let lit = lit(&weather.records, moments, illuminances(document), *rotation);
        let (diffuse, sines) = by_record(&lit, weather.records.len());
        let mut tubes = tube_years(&job.traceable, &lit, job.seed)
            .map_err(|error| RenderError::Output { file: "annual".to_owned(), reason: error.to_string() })?;
        maintain(document, weather, &lit, &mut tubes);
        let light = RecordLight::new(&lit, &tubes);
        Ok(Self { daylight: daylight_hours(&diffuse, &sines), lit, tubes, light })
    }
}

fn illuminances(document: &AnnualDocument) -> Illuminances {
    match document.illuminance {
        IlluminanceSource::Perez => Illuminances::Perez,
        IlluminanceSource::File => Illuminances::File,
    }
}

/// Multiplies the light of all tubes by the factor of each month.
fn maintain(document: &AnnualDocument, weather: &Weather, lit: &[LitMoment], tubes: &mut [TubeYear]) {
    let Some(factors) = &document.maintenance else { return };
    let factor = |moment: &LitMoment| factors[usize::from(weather.records[moment.record].month) - 1];
    for tube in tubes {
        for (light, moment) in tube.moments.iter_mut().zip(lit) {
            light.sky_lm *= factor(moment);
            light.sun_lm *= factor(moment);
        }
    }
}
