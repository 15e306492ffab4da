//! Objects given as triangle meshes.

use crate::geometry::TriangleMesh;
use crate::optics::Surface;

/// A mesh that stands in the room: opaque, with a surface on either side, flat between its edges.
#[derive(Clone, Debug)]
pub struct MeshObject {
    /// Triangles in metres in the room frame, inside the room.
    pub mesh: TriangleMesh,
    /// Surfaces, one per material of the mesh, in the mesh's order.
    pub surfaces: Vec<Surface>,
}
