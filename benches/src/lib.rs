//! Scenes for the benchmarks of kernels: those of `tests/reference/scenes`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failure ends the benchmark")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use skyduct::document::{JobDocument, FileSource, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::plan::{self, Effects};
use skyduct::scene::Scene;
use skyduct::traceable::TraceableScene;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/reference/scenes")
}

struct Folder;

impl FileSource for Folder {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        Ok(Arc::new(mesh(id)))
    }
}

/// A mesh beside the scenes.
pub fn mesh(file: &str) -> TriangleMesh {
    parse_obj(&std::fs::read(folder().join(file)).unwrap(), ObjLimits::default()).unwrap()
}

/// Corners of a mesh's triangles.
pub fn corners(mesh: &TriangleMesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|corners| corners.map(|corner| mesh.positions[corner as usize])).collect()
}

/// A scene, and the same as rays need it.
pub fn scene(name: &str) -> (Scene, TraceableScene) {
    let text = std::fs::read(folder().join(format!("{name}.json"))).unwrap();
    let document = JobDocument::parse(&text).unwrap();
    let (scene, ..) = to_scene(&document, &Folder).unwrap();
    let effects = Effects::of(&scene, &document.effect_requests());
    let traceable = plan::compile(&scene, &effects).unwrap();
    (scene, traceable)
}
