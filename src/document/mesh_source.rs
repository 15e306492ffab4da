//! Where the meshes of a document come from.

use std::sync::Arc;

use crate::geometry::TriangleMesh;

/// Source of a document's meshes: uploads by id, or files beside the job file.
pub trait MeshSource {
    /// The mesh in file units, or one sentence (with the line where it can be named) of why there is none.
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String>;

    /// True if nobody waits for the document any more; then preparing it ends soon.
    fn is_cancelled(&self) -> bool {
        false
    }
}
