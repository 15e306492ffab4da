//! Check that objects cover no opening: a surface in the plane of an opening would coincide with it, and light would both pass and be
//! blocked there.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::RoomDocument;
use super::luminaire::Sheet;
use super::object::ObjectDocument;
use crate::document::errors::Checks;
use crate::document::limits::TOUCHING_M;
use crate::document::tube::opening::PlacedOpening;
use crate::geometry::TriangleMesh;
use crate::scene::MeshObject;

/// Distance from an opening, as a fraction of its height, within which an object counts as lying in its plane.
const HAIR: f64 = 1e-6;

/// Fraction of an opening that may be covered, for rounding.
const UNCOVERED: f64 = 1e-6;

/// Adds a fault for each mesh in the plane of an opening that covers it; `numbers` are those of `objects` in the document.
pub fn cover_no_opening(
    openings: &[(usize, PlacedOpening)],
    objects: &[MeshObject],
    numbers: &[usize],
    checks: &mut Checks,
) {
    for (object, number) in objects.iter().zip(numbers) {
        let mut by_height: HashMap<u64, Vec<[DVec2; 3]>> = HashMap::new();
        for (tube, opening) in openings {
            let at = || in_plane(&object.mesh, opening.height_m);
            let lying = by_height.entry(opening.height_m.to_bits()).or_insert_with(at);
            refuse(lying, *number, (*tube, opening), checks);
        }
    }
}

/// Adds a fault for each box that covers an opening or stands around a part of one.
pub fn boxes_cover_no_opening(room: &RoomDocument, openings: &[(usize, PlacedOpening)], checks: &mut Checks) {
    for (number, object) in room.objects.iter().enumerate() {
        let ObjectDocument::Box(object) = object else { continue };
        let (bottom, top) = (object.position_m[2], object.position_m[2] + object.size_m[2]);
        let [a, b, c, d] = object.footprint();
        for (tube, opening) in openings {
            let hair = HAIR * opening.height_m;
            if bottom < opening.height_m - hair && top >= opening.height_m - hair {
                refuse(&[[a, b, c], [a, c, d]], number, (*tube, opening), checks);
            }
        }
    }
}

/// Adds a fault for each level luminaire at the height of an opening that covers a part of it; luminaires are given with their numbers.
pub fn luminaires_cover_no_opening(
    luminaires: &[(usize, Sheet)],
    openings: &[(usize, PlacedOpening)],
    checks: &mut Checks,
) {
    for (number, sheet) in luminaires {
        let corners = sheet.corners();
        for (tube, opening) in openings {
            let lies = corners.iter().all(|corner| (corner.z - opening.height_m).abs() <= TOUCHING_M);
            // a strip along the rim, as narrow as the tolerance, may be covered
            let least = 4.0 * TOUCHING_M * opening.shape.outer_radius();
            if lies && opening.area_below(&corners.map(DVec3::truncate)) > least {
                checks.refuse(
                    format!("/room/luminaires/{number}"),
                    format!("must not cover the opening of /tubes/{tube}"),
                );
            }
        }
    }
}

/// Returns the triangles of a mesh that lie in a level plane, projected onto it.
fn in_plane(mesh: &TriangleMesh, height: f64) -> Vec<[DVec2; 3]> {
    let corners = mesh.triangles.iter().map(|triangle| triangle.map(|corner| mesh.positions[corner as usize]));
    let lies = |corners: &[DVec3; 3]| corners.iter().all(|corner| (corner.z - height).abs() <= HAIR * height);
    corners.filter(lies).map(|corners| corners.map(DVec3::truncate)).collect()
}

fn refuse(lying: &[[DVec2; 3]], number: usize, (tube, opening): (usize, &PlacedOpening), checks: &mut Checks) {
    let area = |corners: &[DVec2; 3]| {
        let [a, b, c] = *corners;
        let nearest = opening.centre.clamp(a.min(b).min(c), a.max(b).max(c));
        // most triangles are far from most openings
        match nearest.distance(opening.centre) < opening.shape.outer_radius() {
            true => opening.area_below(corners),
            false => 0.0,
        }
    };
    let share = lying.iter().map(area).sum::<f64>() / opening.shape.area_m2();
    if share > UNCOVERED {
        let detail = format!(
            "covers the opening of /tubes/{tube}, or a part of it, in its plane: leave the opening free, or let the \
             object end below it"
        );
        checks.refuse(format!("/room/objects/{number}"), detail);
    }
}
