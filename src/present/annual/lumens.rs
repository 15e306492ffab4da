//! Light of the tubes of a job by its weather files: what its years have before anything is known of the room.

use std::sync::Arc;

use crate::annual::fluxes::{TubeYear, tube_years};
use crate::annual::response::RecordLight;
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
        for tube in &mut tubes {
            for (light, moment) in tube.moments.iter_mut().zip(&file.lit) {
                let factor = annual.factor(file, moment);
                light.sky_lm *= factor;
                light.sun_lm *= factor;
            }
        }
        Self { light: Arc::new(RecordLight::new(&file.lit, &tubes)), tubes }
    }
}
