//! Outlines of meshes as plans and sections show them.

use glam::{DVec2, DVec3};

use crate::document::result::{MeshPartResult, MeshRole, MeshesResult};
use crate::geometry::facets::pieces;

/// Largest number of outlines of a figure; of more the largest are drawn.
const MOST: usize = 400;

/// Pieces of the objects that are meshes, by their corners in m; a piece consists of triangles joined by corners.
pub fn object_pieces(meshes: &MeshesResult) -> Vec<Vec<DVec3>> {
    let of_part = |part: &MeshPartResult| {
        let numbers = pieces(part.corners_m.len(), &part.triangles);
        let count = numbers.iter().max().map_or(0, |last| *last as usize + 1);
        let mut corners: Vec<Vec<DVec3>> = vec![Vec::new(); count];
        for (number, triangle) in numbers.iter().zip(&part.triangles) {
            corners[*number as usize].extend(triangle.map(|corner| place(part, corner)));
        }
        corners
    };
    let mut all: Vec<Vec<DVec3>> = parts(meshes, true).flat_map(of_part).collect();
    if all.len() > MOST {
        let extent = |piece: &Vec<DVec3>| {
            let ends = piece.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), corner| {
                (low.min(*corner), high.max(*corner))
            });
            (ends.1 - ends.0).length()
        };
        all.sort_by(|a, b| extent(b).total_cmp(&extent(a)));
        all.truncate(MOST);
    }
    all
}

/// Finds the edges in which a plane cuts the meshes of objects, or those of tubes: where the product with the unit vector `across` is `at`.
pub fn cuts(meshes: &MeshesResult, objects: bool, across: DVec3, at: f64) -> Vec<[DVec3; 2]> {
    let of_triangle = |corners: [DVec3; 3]| {
        let heights = corners.map(|corner| corner.dot(across) - at);
        let sides = (0..3).filter_map(|k| {
            let (from, to) = (heights[k], heights[(k + 1) % 3]);
            ((from > 0.0) != (to > 0.0)).then(|| corners[k].lerp(corners[(k + 1) % 3], from / (from - to)))
        });
        let ends: Vec<DVec3> = sides.collect();
        <[DVec3; 2]>::try_from(ends).ok()
    };
    let all = parts(meshes, objects)
        .flat_map(|part| part.triangles.iter().map(move |triangle| triangle.map(|corner| place(part, corner))));
    all.filter_map(of_triangle).collect()
}

/// Returns the convex hull of points, counter-clockwise (Andrew 1979).
pub fn hull(points: impl IntoIterator<Item = DVec2>) -> Vec<DVec2> {
    let mut points: Vec<DVec2> = points.into_iter().collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let half = |ordered: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in ordered {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    [half(&mut points.iter().copied()), half(&mut points.iter().rev().copied())].concat()
}

fn parts(meshes: &MeshesResult, objects: bool) -> impl Iterator<Item = &MeshPartResult> {
    let all = meshes.meshes.iter().flat_map(|mesh| &mesh.parts);
    all.filter(move |part| (part.role == MeshRole::Object) == objects)
}

fn place(part: &MeshPartResult, corner: u32) -> DVec3 {
    part.corners_m[corner as usize].map(f64::from).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::result::MeshResult;

    /// Two tetrahedra side by side.
    fn meshes() -> MeshesResult {
        let corners = |x: f32| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0], [x, 0.0, 1.0]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let part = MeshPartResult {
            role: MeshRole::Object,
            reflectance: Some([0.5; 3]),
            back_reflectance: None,
            corners_m: [corners(0.0), corners(2.0)].concat(),
            triangles: [faces, faces.map(|face| face.map(|corner| corner + 4))].concat(),
        };
        let mesh = MeshResult { pointer: "/room/objects/0".to_owned(), parts: vec![part] };
        MeshesResult { triangles: 8, cell_m: None, meshes: vec![mesh] }
    }

    #[test]
    fn pieces_have_outlines_and_a_plane_cuts_them() {
        let pieces = object_pieces(&meshes());
        assert_eq!(pieces.len(), 2);
        let outline = hull(pieces[1].iter().map(|corner| corner.truncate()));
        assert_eq!(outline, [(2.0, 0.0), (3.0, 0.0), (2.0, 1.0)].map(DVec2::from));
        // a triangle with legs of 0.75 in each of both, of three sides
        let edges = cuts(&meshes(), true, DVec3::Y, 0.25);
        assert_eq!(edges.len(), 6);
        let around: f64 = edges.iter().map(|[a, b]| a.distance(*b)).sum();
        assert!((around - 2.0 * 0.75 * (2.0 + 2.0f64.sqrt())).abs() < 1e-9, "{around}");
        assert!(cuts(&meshes(), false, DVec3::Y, 0.25).is_empty() && cuts(&meshes(), true, DVec3::Y, 1.5).is_empty());
    }

    #[test]
    fn a_hull_has_no_corner_on_its_sides() {
        let grid = (0..9).map(|k| DVec2::new(f64::from(k % 3), f64::from(k / 3)));
        assert_eq!(hull(grid), [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(DVec2::from));
    }
}
