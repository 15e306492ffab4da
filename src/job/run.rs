//! From a document to results: prepare, render chunks of passes in order, stop, write the results.

use std::ops::Range;

use serde::Serialize;

use crate::document::{DocumentErrors, MeshSource, Warning};
use crate::estimate::{Accuracy, Estimate, StopRule};
use crate::plan::Plan;

/// A job ready to render: immutable, shared by threads.
pub struct Prepared {
    /// The document as understood, all defaults filled in.
    pub document: serde_json::Value,
    pub plan: Plan,
    pub warnings: Vec<Warning>,
    pub stop: StopRule,
    pub name: Option<String>,
}

/// Why a job ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StoppedBy {
    RelativeError,
    MaxPasses,
    MaxSeconds,
    Exact,
    Cancelled,
}

/// One row of the convergence table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, serde::Deserialize, utoipa::ToSchema)]
pub struct PassReport {
    /// Passes done so far, this one included.
    pub passes: u64,
    /// Render seconds of the job so far, earlier chunks included.
    pub seconds: f64,
    pub photons: u64,
    pub rays: u64,
    /// Relative error of the grids at the asked confidence (JOB: "When a job stops"); null before the second pass.
    pub relative_error: Option<f64>,
    /// The same of the views.
    pub view_relative_error: Option<f64>,
    /// Mean illuminance of the first grid.
    pub mean_lux: Option<f64>,
}

/// What the caller of a chunk hears and says while it runs.
pub trait Observer: Sync {
    /// Looked at every few milliseconds; true ends the chunk within one pass, whose partial work is dropped.
    fn cancelled(&self) -> bool;
    /// After every pass; `merged` is everything so far, earlier chunks included.
    fn pass_done(&self, report: &PassReport, merged: &Estimate);
}

/// A rendered range of passes.
pub struct Chunk {
    /// Of these passes alone: merge onto the estimate of all earlier chunks.
    pub estimate: Estimate,
    pub seconds: f64,
    /// The chunk was cut short: cancelled, or out of seconds. The job ends with it.
    pub ended: Option<StoppedBy>,
}

/// A failure that is ours: a non-finite tally, with the pass and the sensor.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    #[error("pass {pass}: {place} is not finite")]
    NotFinite { pass: u64, place: String },
}

/// A file of the results, e.g. `grids/workplane.json`.
pub struct ResultFile {
    pub name: String,
    pub media_type: &'static str,
    pub bytes: Vec<u8>,
}

/// Validates a document (JSON text), loads its meshes, builds the scene and the plan.
pub fn prepare(_document: &[u8], _meshes: &dyn MeshSource) -> Result<Prepared, DocumentErrors> {
    unimplemented!()
}

impl Prepared {
    /// The passes of chunk `index`, fixed by the job alone; `None` past the last.
    pub fn chunk(&self, _index: u64) -> Option<Range<u64>> {
        unimplemented!()
    }

    /// Renders chunk `index` on the current rayon pool; `before` is the merged estimate of all earlier chunks and
    /// `seconds_before` their render time.
    pub fn render_chunk(
        &self,
        _index: u64,
        _before: &Estimate,
        _seconds_before: f64,
        _observer: &dyn Observer,
    ) -> Result<Chunk, RenderError> {
        unimplemented!()
    }

    /// An estimate of no passes.
    pub fn empty_estimate(&self) -> Estimate {
        unimplemented!()
    }

    /// Whether the job is done after chunk `index` with everything merged into `merged`.
    pub fn stop_after(&self, _index: u64, _merged: &Estimate) -> Option<StoppedBy> {
        unimplemented!()
    }

    pub fn accuracy(&self, _merged: &Estimate) -> Accuracy {
        unimplemented!()
    }

    /// `plan` of results and of `POST /v1/plan`.
    pub fn plan_json(&self) -> serde_json::Value {
        unimplemented!()
    }

    /// Summary for the job resource and `result.json`: `accuracy`, `timing`, `tubes`, `energy`, `switches`, grid
    /// statistics; merged into the job's JSON object.
    pub fn summary_json(&self, _merged: &Estimate, _seconds: f64) -> serde_json::Value {
        unimplemented!()
    }

    /// Grids as JSON and CSV, views as EXR, PNG and false-colour PNG.
    pub fn result_files(&self, _merged: &Estimate) -> Result<Vec<ResultFile>, RenderError> {
        unimplemented!()
    }

    /// Tone-mapped progress images of all views: (view name, PNG bytes).
    pub fn preview_images(&self, _merged: &Estimate) -> Vec<(String, Vec<u8>)> {
        unimplemented!()
    }
}

/// An estimate as bytes, bit-exact: little-endian words with a length and a hash.
pub fn encode(_estimate: &Estimate) -> Vec<u8> {
    unimplemented!()
}

/// The estimate of `bytes` for this job; an error names what is wrong with them.
pub fn decode(_prepared: &Prepared, _bytes: &[u8]) -> Result<Estimate, String> {
    unimplemented!()
}

/// Adds a chunk to everything before it; the order of merges fixes the bits.
pub fn merge(_before: &mut Estimate, _chunk: &Estimate) {
    unimplemented!()
}
