//! A prepared job together with what is made of it for its results.

use std::ops::Deref;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::annual::{FileLumens, JobYear};
use super::subject::Subject;
use super::tube_performance::TubePerformance;
use crate::annual::metrics::Value;
use crate::document::result::{GridResult, MeshesResult};
use crate::document::{DocumentErrors, FileSource, ValidJob};
use crate::engine::passes::RenderError;
use crate::engine::prepare::{self, RenderJob};
use crate::predict::predictions::Predictions;
use crate::scene::TubeShape;

/// Job that is ready to render and to be presented: immutable, shared by threads.
pub struct Prepared {
    job: RenderJob,
    /// Times that each method would take, where a pilot was requested.
    pub(super) predictions: Option<Predictions>,
    /// Description of the job for its figures, made on first use.
    pub(super) subject: OnceLock<Arc<Subject>>,
    /// Years of the job, computed when they are asked for.
    years: Mutex<Years>,
    /// Performance of each tube by itself, for its reports, computed on first use.
    pub(super) performances: Vec<OnceLock<Arc<TubePerformance>>>,
}

/// Years of a job after this number of passes, and the light of its tubes, which is the same after all of them.
#[derive(Default)]
struct Years {
    lumens: Vec<Arc<FileLumens>>,
    after: Option<(u64, Arc<JobYear>)>,
}

/// Validates a document (JSON text), loads its meshes, builds the scene and the plan.
pub fn prepare(document: &[u8], meshes: &dyn FileSource) -> Result<Prepared, DocumentErrors> {
    Ok(Prepared::new(prepare::prepare(document, meshes)?))
}

/// Prepares a parsed document: builds and plans its scene, and refuses requests that the plan cannot meet.
pub fn prepare_document(document: &ValidJob, meshes: &dyn FileSource) -> Result<Prepared, DocumentErrors> {
    Ok(Prepared::new(prepare::prepare_document(document, meshes)?))
}

impl Prepared {
    fn new(job: RenderJob) -> Self {
        let performances = job.scene.tubes.iter().map(|_| OnceLock::new()).collect();
        Self { job, predictions: None, subject: OnceLock::new(), years: Mutex::default(), performances }
    }

    /// Returns the description of the job that figures print.
    pub fn subject(&self) -> &Arc<Subject> {
        self.subject.get_or_init(|| {
            let subject = Subject::new(&self.document, &self.plan_json()).with_meshes(self.meshes());
            Arc::new(subject.foretold(self.predictions.clone()))
        })
    }

    /// Returns the meshes of objects and tubes, where the document has some.
    fn meshes(&self) -> Option<MeshesResult> {
        let objects = self.document["room"]["objects"].as_array().into_iter().flatten().enumerate();
        let numbers = objects.filter(|(_, object)| object["mesh"].is_string()).map(|(number, _)| number);
        let numbers: Vec<usize> = numbers.collect();
        let has_tubes = self.scene.tubes.iter().any(|tube| matches!(tube.shape, TubeShape::Mesh(_)));
        (has_tubes || !numbers.is_empty()).then(|| MeshesResult::new(&self.scene, &numbers))
    }

    /// Returns the year of the job after a number of passes, whose grids `results` returns, each with its values at all moments; `None` for a job
    /// without a year, and before the first pass.
    pub(super) fn year(
        &self,
        passes: u64,
        results: impl FnOnce() -> Result<Vec<(GridResult, Vec<Value>)>, RenderError>,
    ) -> Result<Option<Arc<JobYear>>, RenderError> {
        // several readers of one estimate wait for the one that computes it; where they are threads of one pool, it must be computed before
        let mut kept = self.years.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of_passes, year)) = &kept.after
            && *of_passes == passes
        {
            return Ok(Some(year.clone()));
        }
        if kept.lumens.is_empty() {
            kept.lumens = FileLumens::of_job(self);
        }
        let year = JobYear::of(self, &kept.lumens, results()?).map(Arc::new);
        kept.after = year.clone().map(|year| (passes, year));
        Ok(year)
    }

    /// True if the job has a year, which is computed from its passes.
    pub fn has_year(&self) -> bool {
        self.annual.is_some()
    }

    /// Keeps the predictions of a pilot, for the job's results and for the figure of its convergence.
    pub fn foretell(&mut self, predictions: Predictions) {
        self.subject = OnceLock::new();
        self.predictions = Some(predictions);
    }
}

impl Deref for Prepared {
    type Target = RenderJob;

    fn deref(&self) -> &RenderJob {
        &self.job
    }
}
