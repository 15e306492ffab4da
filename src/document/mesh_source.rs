//! Source of the meshes that a document names.

use std::sync::Arc;

use crate::geometry::TriangleMesh;

/// Source of a document's meshes: uploads by id, or files beside the job file.
pub trait MeshSource {
    /// Returns the mesh in the units of its file. The error is one sentence that says why there is none, with the line of the
    /// file where possible.
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String>;

    /// True if the document's preparation was cancelled, so that it should end soon.
    fn is_cancelled(&self) -> bool {
        false
    }
}
