//! Jobs from documents, as the command line and the service run them.

use crate::schema;
use std::sync::Arc;

use skyduct::document::{JobDocument, MeshSource};
use skyduct::estimate::Estimate;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::job::run::{Observer, PassReport, Prepared, StoppedBy, merge, prepare_document};

/// Meshes beside the reference scenes.
pub struct Folder;

impl MeshSource for Folder {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let bytes =
            std::fs::read(super::reference::folder().join("scenes").join(id)).map_err(|error| error.to_string())?;
        parse_obj(&bytes, ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

pub struct Quiet;

impl Observer for Quiet {
    fn cancelled(&self) -> bool {
        false
    }
    fn pass_done(&self, _: &PassReport, _: &Estimate) {}
}

/// A reference scene, changed by `edit`.
pub fn prepare(scene: &str, edit: impl FnOnce(&mut serde_json::Value)) -> Prepared {
    let mut document = super::reference::json(&format!("scenes/{scene}.json"));
    // standard error 0.5 %: the stop rule counts 1.96 of them
    document["stop"] = serde_json::json!({ "relative_error": 0.0098, "max_seconds": 300 });
    edit(&mut document);
    assert_eq!(schema::faults(&document), [""; 0]);
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    prepare_document(&document, &Folder).unwrap()
}

pub fn render(prepared: &Prepared) -> Estimate {
    let mut merged = prepared.empty_estimate();
    for index in 0.. {
        let chunk = prepared.render_chunk(index, &merged, 0.0, &Quiet).unwrap();
        assert_eq!(chunk.ended, None);
        merge(&mut merged, &chunk.estimate);
        if let Some(reason) = prepared.stop_after(index, &merged) {
            assert_eq!(reason, StoppedBy::RelativeError);
            break;
        }
    }
    println!("{} passes, {} photons, {} rays", merged.passes, merged.photons, merged.rays);
    merged
}
