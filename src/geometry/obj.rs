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

#[derive(Debug, thiserror::Error)]
#[error("line {line}: {detail}")]
pub struct ObjError { pub line: usize, pub detail: String }
pub fn parse_obj(_bytes: &[u8]) -> Result<TriangleMesh, ObjError> { unimplemented!() }
