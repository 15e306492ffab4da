//! OBJ files (the only user of tobj).

use glam::DVec3;

/// Triangles with material names; coordinates in metres after [`TriangleMesh::scaled`], in file units before.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    pub positions: Vec<DVec3>,
    /// Corner indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `materials`, one per triangle.
    pub triangle_materials: Vec<u32>,
    /// Material names in order of first use; faces without one have the name "".
    pub materials: Vec<String>,
}

impl TriangleMesh {
    /// The mesh with every coordinate multiplied by `factor`, e.g. metres per file unit.
    pub fn scaled(&self, factor: f64) -> Self {
        let positions = self
            .positions
            .iter()
            .map(|position| *position * factor)
            .collect();
        Self {
            positions,
            ..self.clone()
        }
    }

    /// Lowest and highest corner of the bounding box of all triangles; `None` without triangles.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut corners = self
            .triangles
            .iter()
            .flatten()
            .filter_map(|index| self.positions.get(*index as usize));
        let first = *corners.next()?;
        Some(corners.fold((first, first), |(low, high), corner| {
            (low.min(*corner), high.max(*corner))
        }))
    }
}
