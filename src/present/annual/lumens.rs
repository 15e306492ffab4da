//! Light of the tubes of a job by its weather files: what its years have before anything is known of the room.

use std::sync::Arc;

use crate::annual::fluxes::{TubeYear, tube_years};
use crate::annual::light::{LitMoment, Sources};
use crate::annual::response::RecordLight;
use crate::annual::weather::Record;
use crate::document::annual::AnnualDocument;
use crate::engine::annual::{AnnualJob, WeatherYear};
use crate::engine::prepare::RenderJob;
use crate::traceable::TraceableScene;

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
        let choices = (&annual.document, annual.sources);
        let tubes = lumens((&job.traceable, job.seed), &file.lit, choices, &file.weather.records);
        Self { light: Arc::new(RecordLight::new(&file.lit, &tubes)), tubes }
    }
}

/// Computes the light of every tube of a scene at the moments of records: that of the sources that are simulated, with the maintenance of the
/// document. The seed is that of rays.
pub(super) fn lumens(
    (scene, seed): (&TraceableScene, u64),
    lit: &[LitMoment],
    (document, sources): (&AnnualDocument, Sources),
    records: &[Record],
) -> Vec<TubeYear> {
    let mut tubes = tube_years(scene, &sources.of(lit), seed);
    if !sources.skies {
        // ground in the sun is bright without a sky, but is left out with it
        tubes.iter_mut().flat_map(|tube| &mut tube.moments).for_each(|light| light.sky_lm = 0.0);
    }
    maintain(&mut tubes, document, lit, records);
    tubes
}

/// Multiplies the light of tubes at the moments of records by the maintenance factors of their months.
fn maintain(tubes: &mut [TubeYear], document: &AnnualDocument, lit: &[LitMoment], records: &[Record]) {
    for (light, moment) in tubes.iter_mut().flat_map(|tube| tube.moments.iter_mut().zip(lit)) {
        let factor = document.maintenance_factor(records[moment.record].month);
        light.sky_lm *= factor;
        light.sun_lm *= factor;
    }
}
