//! Check that objects cover no opening: a surface in the plane of the ceiling over an opening would coincide with it, and light
//! would both pass and be blocked there.

use glam::{DVec2, DVec3};

use super::RoomDocument;
use super::object::{BoxDocument, ObjectDocument};
use crate::document::errors::Checks;
use crate::document::tube::{Opening, TubeDocument};
use crate::geometry::TriangleMesh;
use crate::geometry::disc::disc_polygon_area;
use crate::geometry::turn::rotation;
use crate::scene::MeshObject;

/// Distance from the ceiling, as a fraction of its height, within which an object counts as lying in its plane.
const HAIR: f64 = 1e-6;

/// Fraction of an opening that may be covered, for rounding.
const UNCOVERED: f64 = 1e-6;

/// Adds a fault for each mesh in the plane of the ceiling over an opening; `numbers` are those of `objects` in the document.
pub fn cover_no_opening(
    room: &RoomDocument,
    tubes: &[TubeDocument],
    objects: &[MeshObject],
    numbers: &[usize],
    checks: &mut Checks,
) {
    for (object, number) in objects.iter().zip(numbers) {
        let lying = in_ceiling(&object.mesh, room.size_m[2]);
        refuse(&lying, *number, tubes, checks);
    }
}

/// Adds a fault for each box whose top lies in the plane of the ceiling over an opening.
pub fn boxes_cover_no_opening(room: &RoomDocument, tubes: &[TubeDocument], checks: &mut Checks) {
    let ceiling = room.size_m[2];
    for (number, object) in room.objects.iter().enumerate() {
        let ObjectDocument::Box(BoxDocument { size_m, position_m, rotation_deg, .. }) = object else { continue };
        if position_m[2] + size_m[2] < ceiling * (1.0 - HAIR) {
            continue;
        }
        let (half, middle) = (0.5 * DVec2::new(size_m[0], size_m[1]), DVec2::new(position_m[0], position_m[1]));
        let back = rotation(rotation_deg.to_radians()).transpose();
        let corner = |x: f64, y: f64| middle + back * (half * DVec2::new(x, y));
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        refuse(&[[a, b, c], [a, c, d]], number, tubes, checks);
    }
}

/// Returns the triangles of a mesh that lie in the plane of the ceiling, projected onto it.
fn in_ceiling(mesh: &TriangleMesh, ceiling: f64) -> Vec<[DVec2; 3]> {
    let corners = mesh.triangles.iter().map(|triangle| triangle.map(|corner| mesh.positions[corner as usize]));
    let lies = |corners: &[DVec3; 3]| corners.iter().all(|corner| corner.z >= ceiling * (1.0 - HAIR));
    corners.filter(lies).map(|corners| corners.map(DVec3::truncate)).collect()
}

fn refuse(lying: &[[DVec2; 3]], number: usize, tubes: &[TubeDocument], checks: &mut Checks) {
    for (tube, document) in tubes.iter().enumerate() {
        let Opening { centre, diameter_m, .. } = document.opening();
        let radius = 0.5 * diameter_m;
        let area = |corners: &[DVec2; 3]| disc_polygon_area(centre, radius, corners).abs();
        let share = lying.iter().map(area).sum::<f64>() / (std::f64::consts::PI * radius * radius);
        if share > UNCOVERED {
            let detail = format!(
                "covers the opening of /tubes/{tube}, or a part of it, in the plane of the ceiling: leave the opening \
                 free, or let the object end below the ceiling"
            );
            checks.refuse(format!("/room/objects/{number}"), detail);
        }
    }
}
