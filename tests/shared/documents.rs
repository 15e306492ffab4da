//! Jobs from documents, as the command line and the service run them.

use crate::schema;
use std::sync::Arc;

use skyduct::annual::weather::{self, Weather};
use skyduct::document::{FileSource, JobDocument, ValidJob, to_scene};
use skyduct::engine::cancel::Stop;
use skyduct::engine::passes::Rendered;
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::estimate::Estimate;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::integrator::method::Refusal;
use skyduct::plan::{self, Effects, Methods};
use skyduct::present::prepared::{Prepared, prepare_document};

/// Meshes beside the reference scenes.
pub struct Folder;

impl FileSource for Folder {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        Beside("scenes").load(id)
    }

    fn weather(&self, id: &str) -> Result<Arc<Weather>, String> {
        let file = id.strip_prefix("half:").unwrap_or(id);
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(file);
        let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
        let mut weather = weather::read(&bytes).map_err(|error| error.to_string())?;
        if file != id {
            for record in &mut weather.records {
                record.direct_normal_w_m2 *= 0.5;
                record.diffuse_horizontal_w_m2 *= 0.5;
            }
        }
        Ok(Arc::new(weather))
    }
}

/// Meshes in a folder of `tests/reference`.
pub struct Beside(pub &'static str);

impl FileSource for Beside {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let bytes =
            std::fs::read(super::reference::folder().join(self.0).join(id)).map_err(|error| error.to_string())?;
        parse_obj(&bytes, ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// Adds a pass to an estimate, and returns what ends the job with it, if anything does.
pub fn add_pass(prepared: &Prepared, estimate: &mut Estimate) -> Option<StoppedBy> {
    prepared.render_pass(estimate, &mut Spent::NOTHING.clone(), &Stop::default(), &mut |_, _| {}).unwrap()
}

/// The first `count` passes, or all if the job has fewer.
pub fn first_passes(prepared: &Prepared, count: u64) -> Estimate {
    let mut estimate = prepared.empty_estimate();
    while estimate.passes < count && add_pass(prepared, &mut estimate).is_none() {}
    estimate
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
    let Rendered { estimate, stopped_by, .. } = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap();
    assert_eq!(stopped_by, StoppedBy::RelativeError);
    println!("{} passes, {} photons, {} rays", estimate.passes, estimate.photons, estimate.rays);
    estimate
}
