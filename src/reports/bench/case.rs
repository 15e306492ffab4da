//! Jobs of benchmarks: documents with their meshes, and the cost of one run.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};

use super::measure::{Quartiles, Repeats, processor_seconds};
use crate::page::ReportError;
use crate::run::Folder;
use skyduct::document::{FileSource, JobDocument};
use skyduct::engine::cancel::Stop;
use skyduct::estimate::Estimate;
use skyduct::geometry::TriangleMesh;
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::statistics::interval::{two_sided_normal_quantile, two_sided_student_quantile};

/// Confidence of all jobs.
const CONFIDENCE: f64 = 0.95;

/// Limit of passes that no job of a benchmark reaches.
const NO_LIMIT: u64 = 1_000_000_000;

/// Document with its meshes.
#[derive(Clone)]
pub struct Case {
    pub document: Value,
    pub meshes: Arc<dyn FileSource + Send + Sync>,
}

/// Source of one mesh in memory, for any name.
struct Made(Arc<TriangleMesh>);

impl FileSource for Made {
    fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
        Ok(self.0.clone())
    }
}

/// Cost and result of one run.
pub struct Run {
    /// Processor seconds from the document to the first pass: meshes are read, the scene is built and planned.
    pub set_up: f64,
    /// Processor seconds of the passes.
    pub passes: f64,
    pub estimate: Estimate,
    /// Relative standard error that the job reports, as the root mean square over the sensors or blocks; NaN where it reports
    /// none.
    pub told: f64,
    /// True if the job ended because it was as accurate as requested, or exact.
    pub met: bool,
}

impl Case {
    /// Creates a case whose meshes are files in a folder.
    pub fn beside(document: Value, folder: &Path) -> Self {
        Self { document, meshes: Arc::new(Folder(folder.to_owned())) }
    }

    /// Creates a case with one mesh in memory, which may be empty if the document has none.
    pub fn with(document: Value, mesh: TriangleMesh) -> Self {
        Self { document, meshes: Arc::new(Made(Arc::new(mesh))) }
    }

    /// Returns the case with a stop rule: a relative standard error of its outputs, or `seconds`.
    pub fn to(mut self, standard_error: f64, seconds: f64) -> Self {
        let error = (standard_error * two_sided_normal_quantile(CONFIDENCE)).min(1.0);
        self.document["stop"] = json!({
            "relative_error": error, "view_relative_error": error, "confidence": CONFIDENCE,
            "max_passes": NO_LIMIT, "max_seconds": seconds,
        });
        self
    }

    /// Returns the case with a number of passes, however accurate, within `seconds`.
    pub fn passes(mut self, passes: u64, seconds: f64) -> Self {
        self.document["stop"] = json!({
            "relative_error": 1e-9, "view_relative_error": 1e-9, "confidence": CONFIDENCE,
            "max_passes": passes, "max_seconds": seconds,
        });
        self
    }

    /// Returns the case with another seed.
    pub fn seed(&self, seed: u64) -> Self {
        let mut other = self.clone();
        other.document["seed"] = seed.into();
        other
    }

    pub fn prepare(&self) -> Result<Prepared, ReportError> {
        let document = JobDocument::parse(self.document.to_string().as_bytes())?;
        Ok(prepare_document(&document, self.meshes.as_ref())?)
    }

    /// Renders the case on the current pool.
    pub fn run(&self) -> Result<Run, ReportError> {
        let (prepared, set_up) = processor_seconds(|| self.prepare().inspect(|prepared| prepared.make_ready()));
        Run::of(&prepared?, set_up)
    }

    /// Renders the case repeatedly, with the seeds 0, 1, 2 and so on.
    pub fn runs(&self, repeats: Repeats) -> Result<Vec<Run>, ReportError> {
        repeats.run(|seed| self.seed(seed).run())
    }
}

impl Run {
    /// Renders a prepared job on the current pool.
    pub fn of(prepared: &Prepared, set_up: f64) -> Result<Self, ReportError> {
        let rendered = prepared.render(&Stop::default(), &mut |_, _| {})?;
        if let Some(reason) = prepared.no_results(rendered.stopped_by, &rendered.estimate) {
            return Err(ReportError::Case(reason));
        }
        let accuracy = prepared.accuracy(&rendered.estimate);
        let passes = rendered.estimate.passes;
        let t = match passes {
            0 | 1 => two_sided_normal_quantile(CONFIDENCE),
            passes => {
                let degrees = accuracy.degrees_of_grids.unwrap_or(passes as f64 - 1.0);
                two_sided_student_quantile(CONFIDENCE, degrees)
            }
        };
        Ok(Self {
            set_up,
            passes: rendered.spent.cpu_seconds.unwrap_or(rendered.spent.seconds),
            told: accuracy.grids.or(accuracy.views).map_or(f64::NAN, |error| error / t),
            met: rendered.stopped_by.is_as_asked(),
            estimate: rendered.estimate,
        })
    }
}

/// Returns the quartiles of the processor seconds of the passes of some runs.
pub fn passes(runs: &[Run]) -> Quartiles {
    Quartiles::of(runs.iter().map(|run| run.passes))
}

/// Returns the quartiles of the processor seconds before the passes of some runs.
pub fn set_up(runs: &[Run]) -> Quartiles {
    Quartiles::of(runs.iter().map(|run| run.set_up))
}

/// True if each of the runs became as accurate as requested.
pub fn all_met(runs: &[Run]) -> bool {
    runs.iter().all(|run| run.met)
}
