//! Mesh objects as they are checked: every copy of a mesh in the frame of the room. Copies that coincide with nothing are then kept once.

use crate::geometry::TriangleMesh;
use crate::geometry::sheets::Sheets;
use crate::optics::Surface;
use crate::scene::{Instances, MeshObject};

/// A mesh object of a document.
pub struct PlacedObject {
    /// Copies in the frame of the room.
    pub copies: Vec<MeshObject>,
    /// Triangles of the mesh that may overlap others of it, by their indices.
    pub overlapping: Vec<u32>,
    /// Mesh and places of the copies; `None` for an object that stands once.
    pub instances: Option<Instances>,
}

/// Copies of all mesh objects of a room, one after the other.
#[derive(Default)]
pub struct Copies {
    /// Copies in the frame of the room.
    pub objects: Vec<MeshObject>,
    /// Number of the object of each copy in the document.
    pub numbers: Vec<usize>,
    /// Triangles of each copy that may overlap others of it, by their indices.
    pub overlapping: Vec<Vec<u32>>,
    /// Instances of each object.
    instances: Vec<Option<Instances>>,
}

impl Copies {
    /// Adds the object with this number in the document.
    pub fn add(&mut self, number: usize, object: PlacedObject) {
        let PlacedObject { copies, overlapping, instances } = object;
        self.numbers.extend(copies.iter().map(|_| number));
        self.overlapping.extend(copies.iter().map(|_| overlapping.clone()));
        self.objects.extend(copies);
        self.instances.push(instances);
    }

    /// Returns one object for each of the document; copies that were `changed` are its own mesh, and others share theirs.
    pub fn put_together(self, changed: &[bool]) -> Vec<MeshObject> {
        let mut copies = self.objects.into_iter().zip(changed);
        let object = |instances: Option<Instances>| {
            let Some(mut instances) = instances else { return copies.next().map(|(object, _)| object) };
            let own: Vec<(MeshObject, &bool)> = copies.by_ref().take(instances.placements.len()).collect();
            let is_changed: Vec<bool> = own.iter().map(|(_, changed)| **changed).collect();
            let mut kept = is_changed.iter();
            instances.placements.retain(|_| !kept.next().is_some_and(|changed| *changed));
            let materials = instances.mesh.materials.len();
            // surfaces of other objects may have been added to those of a copy
            let surfaces: Vec<Surface> = own.first()?.0.surfaces.iter().take(materials).copied().collect();
            let changed = own.into_iter().filter(|(_, changed)| **changed).map(|(object, _)| object);
            let (mesh, surfaces) = joined(&instances.mesh, surfaces, changed);
            Some(MeshObject { mesh, surfaces, instances: Some(instances).filter(|of| !of.placements.is_empty()) })
        };
        self.instances.into_iter().filter_map(object).collect()
    }
}

/// Joins changed copies of a mesh; their surfaces follow those of the mesh.
fn joined(
    of: &TriangleMesh,
    mut surfaces: Vec<Surface>,
    copies: impl Iterator<Item = MeshObject>,
) -> (TriangleMesh, Vec<Surface>) {
    let (mut sheets, mut materials) = (Sheets::default(), of.materials.clone());
    for copy in copies {
        sheets.add(&copy.mesh, surfaces.len() as u32);
        surfaces.extend(copy.surfaces);
        materials.extend(copy.mesh.materials);
    }
    let Sheets { positions, triangles, sides, .. } = sheets;
    let mut mesh = TriangleMesh { positions, triangles, materials, dropped: of.dropped, ..TriangleMesh::default() };
    mesh.set_sides(sides.into_iter());
    (mesh, surfaces)
}
