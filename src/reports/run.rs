//! Jobs of reports, run in this process.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;

use super::page::ReportError;
use skyduct::document::{DocumentErrors, FileSource, JobDocument, to_scene};
use skyduct::engine::cancel::Stop;
use skyduct::estimate::Estimate;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::plan::{self, Effects};
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::scene::Scene;
use skyduct::traceable::TraceableScene;

/// Source of meshes that are files in a folder.
pub struct Folder(pub PathBuf);

impl FileSource for Folder {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let bytes = std::fs::read(self.0.join(id)).map_err(|error| error.to_string())?;
        parse_obj(&bytes, ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// Prepares a document for rendering; `meshes`: the folder of its mesh files.
pub fn prepare(document: &Value, meshes: &Path) -> Result<Prepared, DocumentErrors> {
    prepare_document(&JobDocument::parse(document.to_string().as_bytes())?, &Folder(meshes.to_owned()))
}

/// Renders a document until it stops; an error if it has no results.
pub fn render(document: &Value, meshes: &Path) -> Result<(Prepared, Estimate), ReportError> {
    let prepared = prepare(document, meshes)?;
    let rendered = prepared.render(&Stop::default(), &mut |_, _| {})?;
    match prepared.no_results(rendered.stopped_by, &rendered.estimate) {
        Some(reason) => Err(ReportError::Case(reason)),
        None => Ok((prepared, rendered.estimate)),
    }
}

/// Renders all `max_passes` of a job, regardless of accuracy and time, so that the result is the same on every machine. `hear`
/// is called with the merged estimate after each pass.
pub fn render_all(prepared: &Prepared, mut hear: impl FnMut(&Estimate)) -> Result<Estimate, ReportError> {
    Ok(prepared.render_all_passes(&mut |_, so_far| hear(so_far.estimate))?)
}

/// Compiles a document's scene for tracing, with the effects that the plan leaves in it.
pub fn compile(document: &Value, meshes: &Path) -> Result<(Scene, TraceableScene), ReportError> {
    let document = JobDocument::parse(document.to_string().as_bytes())?;
    let (scene, ..) = to_scene(&document, &Folder(meshes.to_owned()))?;
    let effects = Effects::of(&scene, &document.effect_requests());
    let traceable = plan::compile(&scene, &effects).map_err(|error| ReportError::Case(error.error.to_string()))?;
    Ok((scene, traceable))
}
