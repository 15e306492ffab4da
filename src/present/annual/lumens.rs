//! Light of the tubes of a job by its weather files: what its years have before anything is known of the room.

use std::sync::Arc;

use crate::annual::fluxes::{TubeYear, tube_years};
use crate::annual::light::LitMoment;
use crate::annual::response::RecordLight;
use crate::annual::weather::Record;
use crate::document::annual::AnnualDocument;
use crate::engine::annual::{AnnualJob, WeatherYear};
use crate::engine::prepare::RenderJob;

/// Light of the tubes by a weather file.
pub struct FileLumens {
    /// Light of each tube at the moments with light.
    pub(super) tubes: Vec<TubeYear>,
    /// Light of the tubes by records.
    pub(super) light: Arc<RecordLight>,
}

impl FileLumens {
    /// Computes the light of the tubes of a job by each of its weather files; none without a year.
    pub fn of_job(job: &RenderJob) -> Vec<Arc<Self>> {
        let files = job.annual.iter().flat_map(|annual| annual.files.iter().map(move |file| (annual, file)));
        files.map(|(annual, file)| Arc::new(Self::new(job, annual, file))).collect()
    }

    fn new(job: &RenderJob, annual: &AnnualJob, file: &WeatherYear) -> Self {
        let mut tubes = tube_years(&job.traceable, &file.lit, job.seed);
        maintain(&mut tubes, &annual.document, &file.lit, &file.weather.records);
        Self { light: Arc::new(RecordLight::new(&file.lit, &tubes)), tubes }
    }
}

/// Multiplies the light of tubes at the moments of records by the maintenance factors of their months.
pub(super) fn maintain(tubes: &mut [TubeYear], document: &AnnualDocument, lit: &[LitMoment], records: &[Record]) {
    for (light, moment) in tubes.iter_mut().flat_map(|tube| tube.moments.iter_mut().zip(lit)) {
        let factor = document.maintenance_factor(records[moment.record].month);
        light.sky_lm *= factor;
        light.sun_lm *= factor;
    }
}
