//! Objects given as triangle meshes.

use glam::DVec3;

use crate::geometry::TriangleMesh;
use crate::geometry::placement::Placement;
use crate::optics::Surface;

/// A mesh that stands in the room: opaque, with a surface on either side, flat between its edges.
#[derive(Clone, Debug)]
pub struct MeshObject {
    /// Triangles in metres in the room frame, inside the room; none if the object consists of instances alone.
    pub mesh: TriangleMesh,
    /// Surfaces, one per material of the mesh, in the mesh's order.
    pub surfaces: Vec<Surface>,
    /// Copies of another mesh of these materials, which belong to the object, too.
    pub instances: Option<Instances>,
}

/// Copies of one mesh, which is kept once.
#[derive(Clone, Debug)]
pub struct Instances {
    /// Triangles in metres in the mesh's own frame.
    pub mesh: TriangleMesh,
    /// Places of the copies.
    pub placements: Vec<Placement>,
}

impl MeshObject {
    /// Creates an object that stands once.
    pub fn new(mesh: TriangleMesh, surfaces: Vec<Surface>) -> Self {
        Self { mesh, surfaces, instances: None }
    }

    /// Lists the meshes of the object, each with its places; `None` stands for the room frame.
    fn parts(&self) -> impl Iterator<Item = (&TriangleMesh, Option<&Placement>)> {
        let instances = self.instances.iter();
        let copies = instances.flat_map(|of| of.placements.iter().map(|placement| (&of.mesh, Some(placement))));
        std::iter::once((&self.mesh, None)).chain(copies)
    }

    /// Lists the meshes as they stand in the room, one after the other.
    pub fn in_room(&self) -> impl Iterator<Item = TriangleMesh> {
        self.parts().map(|(mesh, placement)| placement.map_or_else(|| mesh.clone(), |placement| placement.copy(mesh)))
    }

    /// Lists the corners of all triangles as they stand in the room, in m, with the materials of front and back.
    pub fn triangles(&self) -> impl Iterator<Item = ([DVec3; 3], [u32; 2])> {
        self.parts().flat_map(|(mesh, placement)| {
            (0..mesh.triangles.len()).map(move |number| {
                let corner = |corner: u32| {
                    let position = mesh.positions[corner as usize];
                    placement.map_or(position, |placement| placement.point(position))
                };
                (mesh.triangles[number].map(corner), mesh.sides(number))
            })
        })
    }

    /// Returns the number of triangles in memory.
    pub fn kept_triangles(&self) -> usize {
        self.mesh.triangles.len() + self.instances.as_ref().map_or(0, |of| of.mesh.triangles.len())
    }

    /// Returns the number of triangles of the copies.
    pub fn copied_triangles(&self) -> usize {
        self.instances.as_ref().map_or(0, |of| of.mesh.triangles.len() * of.placements.len())
    }
}
