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
        let mut by_plane: HashMap<Plane, Vec<[DVec3; 3]>> = HashMap::new();
        for (tube, opening) in openings {
            let lying = by_plane.entry(Plane::of(opening)).or_insert_with(|| in_plane(&object.mesh, opening));
            refuse(lying, *number, (*tube, opening), checks);
        }
    }
}

/// Adds a fault for each box that covers an opening or stands around a part of one.
pub fn boxes_cover_no_opening(room: &RoomDocument, openings: &[(usize, PlacedOpening)], checks: &mut Checks) {
    for (number, object) in room.objects.iter().enumerate() {
        let ObjectDocument::Box(object) = object else { continue };
        let (bottom, top) = (object.position_m[2], object.position_m[2] + object.size_m[2]);
        let footprint = object.footprint();
        for (tube, opening) in openings {
            let height_m = opening.height_m();
            let hair = HAIR * height_m;
            if opening.frame.is_level() {
                if bottom < height_m - hair && top >= height_m - hair {
                    let [a, b, c, d] = footprint.map(|corner| corner.extend(height_m));
                    refuse(&[[a, b, c], [a, c, d]], number, (*tube, opening), checks);
                }
                continue;
            }
            // its top or a side may lie in the plane of the opening
            let sides = (0..4).map(|k| [footprint[k], footprint[(k + 1) % 4]]);
            let sides = sides.map(|[a, b]| [a.extend(bottom), b.extend(bottom), b.extend(top), a.extend(top)]);
            let sides = sides.chain([footprint.map(|corner| corner.extend(top))]);
            let lies = |side: &[DVec3; 4]| side.iter().all(|corner| opening.frame.depth(*corner).abs() <= hair);
            let lying: Vec<_> = sides.filter(lies).flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
            refuse(&lying, number, (*tube, opening), checks);
        }
    }
}

/// Adds a fault for each luminaire in the plane of an opening that covers a part of it; luminaires are given with their numbers.
pub fn luminaires_cover_no_opening(
    luminaires: &[(usize, Sheet)],
    openings: &[(usize, PlacedOpening)],
    checks: &mut Checks,
) {
    for (number, sheet) in luminaires {
        let corners = sheet.corners();
        for (tube, opening) in openings {
            let lies = corners.iter().all(|corner| opening.frame.depth(*corner).abs() <= TOUCHING_M);
            // a strip along the rim, as narrow as the tolerance, may be covered
            let least = 4.0 * TOUCHING_M * opening.shape.outer_radius();
            if lies && opening.area_below(&corners) > least {
                checks.refuse(
                    format!("/room/luminaires/{number}"),
                    format!("must not cover the opening of /tubes/{tube}"),
                );
            }
        }
    }
}

/// Plane that several openings share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Plane {
    /// Level plane at a height with these bits.
    Level(u64),
    /// Plane of the face with this number.
    OfFace(usize),
}

impl Plane {
    fn of(opening: &PlacedOpening) -> Self {
        match opening.frame.is_level() {
            true => Self::Level(opening.height_m().to_bits()),
            false => Self::OfFace(opening.face),
        }
    }
}

/// Returns the triangles of a mesh that lie in the plane of an opening.
fn in_plane(mesh: &TriangleMesh, opening: &PlacedOpening) -> Vec<[DVec3; 3]> {
    let corners = mesh.triangles.iter().map(|triangle| triangle.map(|corner| mesh.positions[corner as usize]));
    let hair = HAIR * opening.height_m();
    let lies = |corners: &[DVec3; 3]| corners.iter().all(|corner| opening.frame.depth(*corner).abs() <= hair);
    corners.filter(lies).collect()
}

fn refuse(lying: &[[DVec3; 3]], number: usize, (tube, opening): (usize, &PlacedOpening), checks: &mut Checks) {
    let area = |corners: &[DVec3; 3]| {
        let [a, b, c] = corners.map(|corner| opening.away(corner));
        let nearest = DVec2::ZERO.clamp(a.min(b).min(c), a.max(b).max(c));
        // most triangles are far from most openings
        match nearest.length() < opening.shape.outer_radius() {
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
