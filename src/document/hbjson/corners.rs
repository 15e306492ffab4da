//! Corners of a model's faces: converted to metres, merged and moved into the planes of their faces within the model's tolerance.

use glam::DVec3;

use super::model::{FaceType, Holes, ModelFace, ModelRoom, Ring, Units};
use crate::document::errors::Checks;
use crate::document::room::RoomDocument;
use crate::document::room::closed::CorneredFaces;
use crate::document::room::faces::{FaceDocument, FaceKindDocument};
use crate::document::room::planes::straightened;

/// Largest fraction of a room's extent within which corners are merged, also if the model's tolerance is larger.
const COARSEST: f64 = 1e-3;

/// Number of nanometres in a metre: coordinates are rounded to whole ones, so that 2.7 is written as 2.7.
const NANOMETRES: f64 = 1e9;

/// Largest coordinate in metres at which corners are merged; larger ones are refused.
const FARTHEST_M: f64 = 1e6;

/// Returns the faces of a room in metres, its lowest corner at z = 0, with a sentence for each change: corners within the model's tolerance of
/// each other are merged, and those within it of the planes of their faces moved into these, unless the room is open then.
pub(super) fn document_of(room: &ModelRoom, (units, tolerance): (Units, f64)) -> (RoomDocument, Vec<String>) {
    let given = rings_in_metres(room, units);
    let corners = || given.iter().flatten().flatten().copied();
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let extent = corners().fold(DVec3::NEG_INFINITY, DVec3::max) - low;
    let mut notes = Vec::new();
    if rounded(low.z) != 0.0 {
        notes.push(format!(
            "the room was moved by {} m along z, so that its lowest point is at z = 0: heights of grids, objects and views of the job are \
             above that point",
            -rounded(low.z)
        ));
    }
    let document = |faces: Vec<Vec<Vec<DVec3>>>| {
        let low_m = faces.iter().flatten().flatten().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
        let faces = room.faces.iter().zip(faces).map(|(face, rings)| document(face, rings, low_m));
        RoomDocument::of_faces(faces.collect())
    };
    let near = units.metres(tolerance).min(COARSEST * extent.length());
    // what is nearer is rounded away, and cells of so many coordinates have numbers
    let is_bounded = corners().all(|corner| corner.abs().max_element() <= FARTHEST_M);
    if near < 1.0 / NANOMETRES || !is_bounded {
        return (document(given), notes);
    }
    let welded = CorneredFaces::weld(&given, near);
    if welded.moved > 0 {
        let detail =
            format!("{} corners within the model's tolerance of others ({near:.1e} m) were merged", welded.moved);
        notes.push(detail);
    }
    if let Some((straight, moved_m)) = straightened(&welded, near)
        && moved_m >= 1.0 / NANOMETRES
    {
        let document = document(straight.rings());
        if document.enclosure(&mut Checks::default()).is_some() {
            notes.push(format!("corners were moved by up to {moved_m:.1e} m into the planes of their faces"));
            return (document, notes);
        }
    }
    (document(welded.rings()), notes)
}

/// Returns the rings of each face in metres.
fn rings_in_metres(room: &ModelRoom, units: Units) -> Vec<Vec<Vec<DVec3>>> {
    let corner = |place: &[f64; 3]| DVec3::from(place.map(|length| units.metres(length)));
    let of_face = |face: &ModelFace| -> Vec<Vec<DVec3>> {
        let holes = face.geometry.holes.iter().flat_map(|Holes(holes)| holes);
        let rings = std::iter::once(&face.geometry.boundary).chain(holes);
        rings.map(|Ring(corners)| corners.iter().map(corner).collect()).collect()
    };
    room.faces.iter().map(of_face).collect()
}

/// Rounds a length in metres to whole nanometres.
fn rounded(length: f64) -> f64 {
    (length * NANOMETRES).round() / NANOMETRES + 0.0
}

/// Returns a face of a document, lowered by `low_m` m.
fn document(face: &ModelFace, rings: Vec<Vec<DVec3>>, low_m: f64) -> FaceDocument {
    let corner = |DVec3 { x, y, z }| [x, y, z - low_m].map(rounded);
    let mut rings = rings.into_iter().map(|ring| ring.into_iter().map(corner).collect());
    FaceDocument {
        name: face.identifier.clone(),
        kind: match face.face_type {
            FaceType::Wall | FaceType::AirBoundary => FaceKindDocument::Wall,
            FaceType::Floor => FaceKindDocument::Floor,
            FaceType::RoofCeiling => FaceKindDocument::Ceiling,
        },
        boundary_m: rings.next().unwrap_or_default(),
        holes_m: rings.collect(),
        surface: None,
    }
}
