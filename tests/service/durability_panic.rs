//! A render that panics ends, and tells.

use std::sync::Arc;
use std::sync::mpsc;

use crate::common::{PATIENCE, small_job};
use skyduct::document::MeshSource;
use skyduct::estimate::Estimate;
use skyduct::geometry::TriangleMesh;
use skyduct::job::run::{Observer, PassReport, prepare};

struct NoMeshes;

impl MeshSource for NoMeshes {
    fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
        Err("no meshes here".into())
    }
}

struct Panics;

impl Observer for Panics {
    fn cancelled(&self) -> bool {
        false
    }

    fn pass_done(&self, _: &PassReport, _: &Estimate) {
        panic!("in the middle of a chunk");
    }
}

#[test]
fn a_panic_in_a_chunk_does_not_hang_it() {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let prepared = prepare(small_job().to_string().as_bytes(), &NoMeshes).unwrap();
        let before = prepared.empty_estimate();
        let chunk = std::panic::AssertUnwindSafe(|| prepared.render_chunk(0, &before, 0.0, &Panics));
        sender.send(std::panic::catch_unwind(chunk).is_err()).unwrap();
    });
    assert_eq!(receiver.recv_timeout(PATIENCE), Ok(true), "the panic comes out");
}
