//! Jobs of the report, run in this process.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;

use super::ValidationError;
use crate::document::{JobDocument, MeshSource};
use crate::estimate::Estimate;
use crate::geometry::TriangleMesh;
use crate::geometry::obj::{ObjLimits, parse_obj};
use crate::job::run::{Observer, PassReport, Prepared, merge, prepare_document};

/// Meshes beside the reference scenes.
struct Folder(PathBuf);

impl MeshSource for Folder {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let bytes = std::fs::read(self.0.join(id)).map_err(|error| error.to_string())?;
        parse_obj(&bytes, ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

struct Quiet;

impl Observer for Quiet {
    fn cancelled(&self) -> bool {
        false
    }

    fn pass_done(&self, _: &PassReport, _: &Estimate) {}
}

/// A document rendered until it stops.
pub fn render(document: &Value, meshes: &Path) -> Result<(Prepared, Estimate), ValidationError> {
    let document = JobDocument::parse(document.to_string().as_bytes())?;
    let prepared = prepare_document(&document, &Folder(meshes.to_owned()))?;
    let mut merged = prepared.empty_estimate();
    let mut seconds = 0.0;
    for index in 0.. {
        let chunk = prepared.render_chunk(index, &merged, seconds, &Quiet)?;
        merge(&mut merged, &chunk.estimate);
        seconds += chunk.seconds;
        if chunk.ended.or_else(|| prepared.stop_after(index, &merged)).is_some() {
            break;
        }
    }
    Ok((prepared, merged))
}
