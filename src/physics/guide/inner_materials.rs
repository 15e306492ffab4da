//! Tubes whose walls have different materials on both sides: light meets the inner one.

use super::inner_side;
use super::mesh::Part;
use crate::geometry::bvh::TriangleBvh;
use crate::geometry::{TriangleMesh, welded};

/// Returns the mesh of a tube with one material per triangle: that of its inner side, if the sides differ.
pub fn of_inner_materials(mut mesh: TriangleMesh, parts: &[Part]) -> TriangleMesh {
    if mesh.back_materials.is_empty() {
        return mesh;
    }
    let is_in = |number: usize| parts[mesh.triangle_materials[number] as usize] != Part::Diffuser;
    let traced: Vec<usize> = (0..mesh.triangles.len()).filter(|number| is_in(*number)).collect();
    let triangles: Vec<[u32; 3]> = traced.iter().map(|number| mesh.triangles[*number]).collect();
    let is_mirror = |place: usize| matches!(parts[mesh.triangle_materials[traced[place]] as usize], Part::Pipe { .. });
    let places = welded::places(&mesh.positions);
    let mirrors = (0..triangles.len()).filter(|place| is_mirror(*place));
    let sides =
        welded::sides(mirrors.map(|place| (place as u32, triangles[place].map(|corner| places[corner as usize]))));
    let signs = inner_side::inward(&sides, is_mirror, &TriangleBvh::of_mesh(mesh.positions.clone(), triangles.clone()));
    for (number, sign) in traced.into_iter().zip(signs) {
        if sign < 0 {
            mesh.triangle_materials[number] = mesh.back_materials[number];
        }
    }
    mesh.back_materials.clear();
    mesh
}
