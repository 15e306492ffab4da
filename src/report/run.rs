//! Jobs of reports, run in this process.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::Value;

use super::ReportError;
use crate::document::{DocumentErrors, JobDocument, MeshSource, to_scene};
use crate::estimate::Estimate;
use crate::geometry::TriangleMesh;
use crate::geometry::obj::{ObjLimits, parse_obj};
use crate::job::run::{Observer, PassReport, Prepared, merge, prepare_document};
use crate::plan::{self, Effects};
use crate::scene::Scene;
use crate::traceable::TraceableScene;

/// Meshes beside the documents.
struct Folder(PathBuf);

impl MeshSource for Folder {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let bytes = std::fs::read(self.0.join(id)).map_err(|error| error.to_string())?;
        parse_obj(&bytes, ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// Hears of every pass; the passes of one job come one after the other.
struct Listener<F>(Mutex<F>);

impl<F: FnMut(&Estimate) + Send> Observer for Listener<F> {
    fn cancelled(&self) -> bool {
        false
    }

    fn pass_done(&self, _: &PassReport, merged: &Estimate) {
        // a listener that has panicked has ended the report
        self.0.lock().unwrap_or_else(PoisonError::into_inner)(merged);
    }
}

/// A document ready to render; `meshes`: the folder of its mesh files.
pub fn prepare(document: &Value, meshes: &Path) -> Result<Prepared, DocumentErrors> {
    prepare_document(&JobDocument::parse(document.to_string().as_bytes())?, &Folder(meshes.to_owned()))
}

/// A document rendered until it stops.
pub fn render(document: &Value, meshes: &Path) -> Result<(Prepared, Estimate), ReportError> {
    let prepared = prepare(document, meshes)?;
    let mut merged = prepared.empty_estimate();
    let mut seconds = 0.0;
    let quiet = Listener(Mutex::new(|_: &Estimate| {}));
    for index in 0.. {
        let chunk = prepared.render_chunk(index, &merged, seconds, &quiet)?;
        merge(&mut merged, &chunk.estimate);
        seconds += chunk.seconds;
        let Some(stopped_by) = chunk.ended.or_else(|| prepared.stop_after(index, &merged)) else { continue };
        if let Some(reason) = prepared.no_results(stopped_by, &merged) {
            return Err(ReportError::Case(reason));
        }
        break;
    }
    Ok((prepared, merged))
}

/// All `max_passes` of a job, however accurate it is and whatever the time: the result is the same on every machine.
/// Renders a job to its end; `hear` gets the merged estimate after each pass.
pub fn render_all(prepared: &Prepared, hear: impl FnMut(&Estimate) + Send) -> Result<Estimate, ReportError> {
    let mut merged = prepared.empty_estimate();
    let listener = Listener(Mutex::new(hear));
    for index in 0.. {
        if prepared.chunk(index).is_none() {
            break;
        }
        // no seconds so far: each chunk has all of `max_seconds`
        let chunk = prepared.render_chunk(index, &merged, 0.0, &listener)?;
        merge(&mut merged, &chunk.estimate);
        if chunk.ended.is_some() {
            return Err(ReportError::Case("a job of the report ran out of time".to_owned()));
        }
    }
    Ok(merged)
}

/// A document's scene compiled for tracing, with everything that the plan leaves of it.
pub fn compile(document: &Value, meshes: &Path) -> Result<(Scene, TraceableScene), ReportError> {
    let document = JobDocument::parse(document.to_string().as_bytes())?;
    let (scene, ..) = to_scene(&document, &Folder(meshes.to_owned()))?;
    let effects = Effects::of(&scene, &document.effect_requests());
    let kernel = plan::compile(&scene, &effects).map_err(|error| ReportError::Case(error.error.to_string()))?;
    Ok((scene, kernel))
}
