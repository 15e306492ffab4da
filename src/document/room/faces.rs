//! Rooms given by their faces: checks that they close a room, and small repairs.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::closed::{CorneredFaces, NotOneSurface, area_vector, crossing};
use super::planes::{Plane, move_into_planes, polygon};
use super::rings::{fault_of_rings, oriented};
use super::surface::SurfaceDocument;
use crate::document::errors::{Checks, FieldErrorCode};
use crate::document::hints;
use crate::document::limits::{COORDINATE_M, CORNERS, FACE_NAME, FACES, HOLES, ROOM_EDGE_M, TOUCHING_M};
use crate::document::schema::shapes::Vector;
use crate::geometry::planar::Polygon;
use crate::scene::{Enclosure, EnclosureFace, FaceKind};

/// Distance of corners, as a fraction of the room's extent, within which they are taken for one.
const SAME_CORNER: f64 = 1e-6;

/// Largest distance of a corner from the plane of its face, as a fraction of the face's extent.
const NOT_PLANAR: f64 = 1e-4;

/// Largest number of places that a fault names.
const MOST_NAMED: usize = 20;

/// Largest number of faces that a repair names.
const MOST_REPAIRED: usize = 8;

/// A face of a room: a planar polygon with holes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceDocument {
    /// Name, unique among the faces, 1..100 characters.
    pub name: String,
    /// Kind of the face.
    pub kind: FaceKindDocument,
    /// Corners in order, x, y and z in metres, at least 3; at most 256 with those of the holes. Counter-clockwise seen from outside the
    /// room; faces that run the other way are turned, and the result says so.
    #[schema(value_type = Vec<Vector>)]
    pub boundary_m: Vec<[f64; 3]>,
    /// Holes in the face, in either sense; their edges belong to other faces, too. At most 64.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<Vec<Vector>>)]
    pub holes_m: Vec<Vec<[f64; 3]>>,
    /// Surface; default: that of the face's name or kind in `surfaces`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceDocument>,
}

/// Kind of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaceKindDocument {
    /// A face below.
    Floor,
    /// A face at the side.
    Wall,
    /// A face overhead, through which tubes can come.
    Ceiling,
}

impl From<FaceKindDocument> for FaceKind {
    fn from(kind: FaceKindDocument) -> Self {
        match kind {
            FaceKindDocument::Floor => Self::Floor,
            FaceKindDocument::Wall => Self::Wall,
            FaceKindDocument::Ceiling => Self::Ceiling,
        }
    }
}

impl FaceDocument {
    /// Returns the boundary and the holes in metres.
    fn rings(&self) -> Vec<Vec<DVec3>> {
        let ring = |corners: &Vec<[f64; 3]>| corners.iter().copied().map(DVec3::from).collect();
        std::iter::once(&self.boundary_m).chain(&self.holes_m).map(ring).collect()
    }

    /// Returns the boundary and the holes seen from above, in metres, the boundary counter-clockwise.
    pub fn rings_from_above(&self) -> Vec<Vec<DVec2>> {
        oriented(self.rings().iter().map(|ring| ring.iter().map(|corner| corner.truncate()).collect()).collect())
    }
}

/// Faces that were checked to close a room.
pub struct ClosedRoom {
    /// The faces in the order of the document, with open surfaces.
    pub enclosure: Enclosure,
    /// A sentence for each repair.
    pub repairs: Vec<String>,
}

/// Builds the room that faces close; `None` after a fault.
pub(super) fn closed_room(faces: &[FaceDocument], checks: &mut Checks) -> Option<ClosedRoom> {
    if !check_fields(faces, checks) {
        return None;
    }
    let given: Vec<Vec<Vec<DVec3>>> = faces.iter().map(FaceDocument::rings).collect();
    let (near, scale) = check_extent(&given, checks)?;
    let mut cornered = CorneredFaces::weld(&given, near);
    for place in &mut cornered.places {
        // the floor's height to the bit
        place.z = if place.z.abs() <= near { 0.0 } else { place.z };
    }
    let mut repairs = Vec::new();
    for (count, what) in [
        (cornered.moved, "lie within a millionth of the room's extent of others: they were merged"),
        (cornered.repeated, "repeat the one before them: they were left out"),
    ] {
        if count > 0 {
            repairs.push(format!("{count} corners of the room's faces {what}"));
        }
    }
    let planes = check_shapes(faces, &cornered, near, checks, &mut repairs)?;
    if !check_repeats(faces, &cornered, checks) {
        return None;
    }
    cornered.split_at_corners(near);
    if !check_edges(faces, &cornered, checks) {
        return None;
    }
    let turns = check_turns(faces, &cornered, checks)?;
    let off_planes = move_into_planes(&mut cornered, &planes);
    let inward = inward(&cornered, &turns, near, checks)?;
    repairs.extend(words_of_turned(faces, &inward));
    let polygons: Vec<Polygon> =
        (0..faces.len()).map(|face| polygon(&cornered, (face, inward[face]), &planes[face], scale)).collect();
    if let Some(([a, b], at)) = crossing(&polygons, near.max(2.0 * off_planes)) {
        let detail = format!("crosses the face `{}` at {}", faces[a].name, place(at));
        checks.refuse(format!("/room/faces/{b}"), detail);
        return None;
    }
    let face = |(face, polygon): (&FaceDocument, Polygon)| EnclosureFace {
        name: face.name.clone(),
        kind: face.kind.into(),
        polygon,
        surface: None,
    };
    let enclosure = Enclosure::of_closed(faces.iter().zip(polygons).map(face).collect());
    Some(ClosedRoom { enclosure, repairs })
}

/// Checks the names, the numbers of corners and their coordinates.
fn check_fields(faces: &[FaceDocument], checks: &mut Checks) -> bool {
    let errors_before = checks.errors.len();
    if faces.len() < *FACES.start() {
        checks.refuse("/room/faces", format!("must have at least {} faces, but has {}", FACES.start(), faces.len()));
        return false;
    }
    if !checks.at_most("/room/faces", faces.len(), &FACES, " faces") {
        return false;
    }
    let mut names: HashMap<&str, usize> = HashMap::new();
    for (number, face) in faces.iter().enumerate() {
        let pointer = format!("/room/faces/{number}");
        if !FACE_NAME.contains(&face.name.chars().count()) {
            let (least, most) = (FACE_NAME.start(), FACE_NAME.end());
            checks.refuse(format!("{pointer}/name"), format!("must have {least}..{most} characters"));
        }
        if let Some(other) = names.insert(&face.name, number) {
            checks.refuse(
                format!("{pointer}/name"),
                format!("must be unique, but /room/faces/{other} has the name `{}`, too", face.name),
            );
        }
        if !checks.at_most(&format!("{pointer}/holes_m"), face.holes_m.len(), &HOLES, " holes") {
            continue;
        }
        let rings = || std::iter::once(&face.boundary_m).chain(&face.holes_m);
        for (ring, corners) in rings().enumerate() {
            let pointer = ring_pointer(number, ring);
            if !CORNERS.contains(&corners.len()) {
                let (least, most) = (CORNERS.start(), CORNERS.end());
                checks.refuse(&pointer, format!("must have {least}..{most} corners, but has {}", corners.len()));
            }
            for (corner, place) in corners.iter().enumerate() {
                checks.numbers(&format!("{pointer}/{corner}"), place, COORDINATE_M);
            }
        }
        let corners: usize = rings().map(Vec::len).sum();
        if corners > *CORNERS.end() && face.boundary_m.len() <= *CORNERS.end() {
            let detail =
                format!("at most {} corners with those of the boundary, but there are {corners}", CORNERS.end());
            checks.refuse_as(FieldErrorCode::TooMany, format!("{pointer}/holes_m"), detail);
        }
    }
    checks.errors.len() == errors_before
}

/// Checks the extent of the room and the height of its lowest corner; returns the distance in m within which corners are taken for one,
/// and the scale of rounding in m.
fn check_extent(faces: &[Vec<Vec<DVec3>>], checks: &mut Checks) -> Option<(f64, f64)> {
    let corners = || faces.iter().flatten().flatten().copied();
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let extent = high - low;
    for (axis, along) in ["x", "y", "z"].into_iter().enumerate() {
        if !ROOM_EDGE_M.contains(extent[axis]) {
            let hint = hints::of_number("/room/faces/extent_m", extent[axis], |meant| ROOM_EDGE_M.contains(meant));
            let detail =
                format!("the room's extent along {along} must be {ROOM_EDGE_M} m, but is {} m{hint}", extent[axis]);
            checks.refuse("/room/faces", detail);
            return None;
        }
    }
    let near = (SAME_CORNER * extent.max_element()).max(TOUCHING_M);
    if low.z.abs() > near {
        let detail = format!(
            "the room's lowest corner must be at z = 0, but is at {low} m: subtract {low} from every z, also of what is in the room",
            low = low.z
        );
        checks.refuse("/room/faces", detail);
        return None;
    }
    Some((near, extent.length().max(low.abs().max(high.abs()).length())))
}

/// Checks that each face is a plane polygon, its holes within its boundary, and returns their planes.
fn check_shapes(
    faces: &[FaceDocument],
    cornered: &CorneredFaces,
    near: f64,
    checks: &mut Checks,
    repairs: &mut Vec<String>,
) -> Option<Vec<Plane>> {
    let mut planes = Vec::with_capacity(faces.len());
    let mut bent = Vec::new();
    for (number, rings) in cornered.faces.iter().enumerate() {
        if let Some(ring) = rings.iter().position(|ring| ring.len() < 3) {
            let detail = format!("has fewer than 3 corners that are {near:.3e} m apart");
            checks.refuse(ring_pointer(number, ring), detail);
            continue;
        }
        let corners = || rings.iter().flatten().map(|corner| cornered.places[*corner]);
        let extent = corners().fold(DVec3::NEG_INFINITY, DVec3::max) - corners().fold(DVec3::INFINITY, DVec3::min);
        let area = area_vector(&cornered.places, &rings[0]);
        if area.length() <= near * extent.length() {
            checks
                .refuse(ring_pointer(number, 0), "the corners lie on a line, or the edges cross: the face has no area");
            continue;
        }
        let plane = Plane::fit(corners, area, near);
        let distance = corners().map(|corner| plane.height(corner).abs()).fold(0.0, f64::max);
        if distance > near.max(NOT_PLANAR * extent.length()) {
            let detail = format!(
                "a corner is {distance:.6} m from the face's plane, but at most {NOT_PLANAR} of the face's extent of {:.4} m is \
                 allowed: divide the face into planar ones",
                extent.length()
            );
            checks.refuse(ring_pointer(number, 0), detail);
            continue;
        }
        if distance > near {
            bent.push(format!("`{}` ({distance:.1e} m)", faces[number].name));
        }
        if let Some((ring, detail)) = fault_in_plane(rings, &cornered.places, plane.normal, near) {
            checks.refuse(ring_pointer(number, ring), detail);
            continue;
        }
        planes.push(plane);
    }
    if !bent.is_empty() {
        let detail = format!("corners of {} were moved into the planes of their faces", listed(&bent, MOST_REPAIRED));
        repairs.push(detail);
    }
    (planes.len() == faces.len()).then_some(planes)
}

/// Finds a fault of the rings of a face in its plane: the ring and a sentence.
fn fault_in_plane(rings: &[Vec<usize>], places: &[DVec3], normal: DVec3, near: f64) -> Option<(usize, String)> {
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let origin = places[rings[0][0]];
    let flat = |corner: &usize| DVec2::new(u.dot(places[*corner] - origin), v.dot(places[*corner] - origin));
    let flat: Vec<Vec<DVec2>> = rings.iter().map(|ring| ring.iter().map(flat).collect()).collect();
    let (ring, fault) = fault_of_rings(&flat, near)?;
    let in_space = |at: DVec2| {
        let at = origin + u * at.x + v * at.y;
        format!("({:.6}, {:.6}, {:.6})", at.x, at.y, at.z)
    };
    Some((ring, fault.words("face", near, in_space)))
}

/// Checks that no two faces have the same corners.
fn check_repeats(faces: &[FaceDocument], cornered: &CorneredFaces, checks: &mut Checks) -> bool {
    let errors_before = checks.errors.len();
    let mut known: HashMap<Vec<usize>, usize> = HashMap::new();
    for (number, rings) in cornered.faces.iter().enumerate() {
        let mut corners = rings[0].clone();
        corners.sort_unstable();
        if let Some(other) = known.insert(corners, number) {
            let detail = format!("has the same corners as the face `{}`: leave one of them out", faces[other].name);
            checks.refuse(format!("/room/faces/{number}"), detail);
        }
    }
    checks.errors.len() == errors_before
}

/// Checks that every edge is that of two faces.
fn check_edges(faces: &[FaceDocument], cornered: &CorneredFaces, checks: &mut Checks) -> bool {
    let ends = |[a, b]: [usize; 2]| format!("from {} to {}", place(cornered.places[a]), place(cornered.places[b]));
    let named = |number: &usize| format!("`{}`", faces[*number].name);
    let open = cornered.open_edges().into_iter();
    let open: Vec<String> = open.map(|(face, side)| format!("{} of {}", ends(side), named(&face))).collect();
    let crowded = cornered.crowded_edges().into_iter();
    let crowded: Vec<String> = crowded
        .map(|(side, faces)| format!("{} of {}", ends(side), faces.iter().map(named).collect::<Vec<_>>().join(", ")))
        .collect();
    if !open.is_empty() {
        let detail = format!("the faces leave the room open at {} edges: {}", open.len(), listed(&open, MOST_NAMED));
        checks.refuse("/room/faces", detail);
    }
    if !crowded.is_empty() {
        let detail = format!("more than two faces meet at {} edges: {}", crowded.len(), listed(&crowded, MOST_NAMED));
        checks.refuse("/room/faces", detail);
    }
    open.is_empty() && crowded.is_empty()
}

/// Checks that the faces are one surface, and returns those to turn so that all run the way of the first.
fn check_turns(faces: &[FaceDocument], cornered: &CorneredFaces, checks: &mut Checks) -> Option<Vec<bool>> {
    let detail = match cornered.turns() {
        Ok(turns) => return Some(turns),
        Err(NotOneSurface::Apart(firsts)) => {
            let names: Vec<String> = firsts.iter().map(|face| format!("`{}`", faces[*face].name)).collect();
            format!(
                "the faces are {} closed surfaces that share no edge, but a room has one; a face of each: {}",
                names.len(),
                listed(&names, MOST_NAMED)
            )
        }
        Err(NotOneSurface::Twisted(face)) => {
            format!("the face `{}` has no side that is inside: the faces close up in a twist", faces[face].name)
        }
    };
    checks.refuse("/room/faces", detail);
    None
}

/// Finds the faces that run counter-clockwise seen from inside as they are given; `None` if they enclose no volume.
fn inward(cornered: &CorneredFaces, turns: &[bool], near: f64, checks: &mut Checks) -> Option<Vec<bool>> {
    let from = cornered.places[0];
    let (mut volume, mut surface) = (0.0, 0.0);
    for (rings, turned) in cornered.faces.iter().zip(turns) {
        let area: DVec3 = rings.iter().map(|ring| area_vector(&cornered.places, ring)).sum();
        let outward = area.dot(cornered.places[rings[0][0]] - from) / 3.0;
        volume += if *turned { -outward } else { outward };
        surface += area.length();
    }
    if volume.abs() <= near * surface {
        checks.refuse("/room/faces", "the faces enclose no volume");
        return None;
    }
    Some(turns.iter().map(|turned| *turned == (volume > 0.0)).collect())
}

/// Returns a sentence about the faces that were given counter-clockwise seen from inside, if there are any.
fn words_of_turned(faces: &[FaceDocument], inward: &[bool]) -> Option<String> {
    let turned = faces.iter().zip(inward).filter(|(_, inward)| **inward);
    let turned: Vec<String> = turned.map(|(face, _)| format!("`{}`", face.name)).collect();
    match turned.len() {
        0 => None,
        all if all == faces.len() => Some(
            "the faces of the room run clockwise seen from outside: the room was inside out, and was turned".to_owned(),
        ),
        some => {
            let names = listed(&turned, MOST_REPAIRED);
            Some(format!("{some} faces run clockwise seen from outside, unlike the others, and were turned: {names}"))
        }
    }
}

/// Returns the pointer to a ring of a face, by its number from the boundary, 0.
fn ring_pointer(face: usize, ring: usize) -> String {
    match ring.checked_sub(1) {
        None => format!("/room/faces/{face}/boundary_m"),
        Some(hole) => format!("/room/faces/{face}/holes_m/{hole}"),
    }
}

/// Writes a place as a document does, without negative zeros.
fn place(place: DVec3) -> String {
    let [x, y, z] = (place + DVec3::ZERO).to_array();
    format!("({x}, {y}, {z})")
}

/// Lists the first `most` texts and the number of others.
fn listed(texts: &[String], most: usize) -> String {
    let shown = texts[..texts.len().min(most)].join("; ");
    match texts.len().saturating_sub(most) {
        0 => shown,
        others => format!("{shown}; and {others} more"),
    }
}
