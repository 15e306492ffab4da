//! Jobs from documents, as the command line and the service run them.

use crate::schema;
use std::sync::Arc;

use skyduct::document::{JobDocument, MeshSource, ValidJob, to_scene};
use skyduct::estimate::Estimate;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::integrator::method::Refusal;
use skyduct::job::cancel::Stop;
use skyduct::job::chunk::Chunk;
use skyduct::job::prepare::{Prepared, prepare_document};
use skyduct::job::progress::StoppedBy;
use skyduct::job::spent::Spent;
use skyduct::plan::{self, Effects, Methods};

/// Meshes beside the reference scenes.
pub struct Folder;

impl MeshSource for Folder {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        Beside("scenes").load(id)
    }
}

/// Meshes in a folder of `tests/reference`.
pub struct Beside(pub &'static str);

impl MeshSource for Beside {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let bytes =
            std::fs::read(super::reference::folder().join(self.0).join(id)).map_err(|error| error.to_string())?;
        parse_obj(&bytes, ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// Renders one chunk after `before`.
pub fn render_chunk(prepared: &Prepared, index: u64, before: &Estimate) -> Chunk {
    prepared.render_chunk(index, before, Spent::NOTHING, &Stop::default(), &mut |_, _| {}).unwrap()
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

/// Reason why the method of a document refuses it, if it does.
pub fn refusal(document: &ValidJob) -> Option<Refusal> {
    let (scene, ..) = to_scene(document, &Folder).unwrap();
    let effects = Effects::of(&scene, &document.effect_requests());
    let traceable = Arc::new(plan::compile(&scene, &effects).unwrap());
    Methods::choose(&scene, &traceable, &document.method.request()).err()
}

pub fn render(prepared: &Prepared) -> Estimate {
    let mut merged = prepared.empty_estimate();
    for index in 0.. {
        let chunk = render_chunk(prepared, index, &merged);
        assert_eq!(chunk.ended, None);
        merged.merge(&chunk.estimate);
        if let Some(reason) = prepared.stop_after(index, &merged) {
            assert_eq!(reason, StoppedBy::RelativeError);
            break;
        }
    }
    println!("{} passes, {} photons, {} rays", merged.passes, merged.photons, merged.rays);
    merged
}
