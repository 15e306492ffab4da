//! Rooms of Honeybee models (HBJSON), read as plain JSON: the faces of one room, in metres.

use glam::DVec3;
use serde::Deserialize;
use serde_json::Value;

use super::errors::{Checks, DocumentErrors, FieldError};
use super::read::{fault, json};
use super::room::RoomDocument;
use super::room::closed::CorneredFaces;
use super::room::faces::{FaceDocument, FaceKindDocument};

/// Largest number of names that a message lists.
const MOST_NAMED: usize = 20;

/// Largest part of a room's extent within which corners are merged, whatever the model's tolerance.
const COARSEST: f64 = 1e-3;

/// Number of nanometres in a metre: coordinates are rounded to whole ones, so that 2.7 is written as 2.7.
const NANOMETRES: f64 = 1e9;

/// A room of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct HbjsonRoom {
    /// Faces, which close a room with its lowest corner at z = 0.
    pub faces: Vec<FaceDocument>,
    /// A sentence for everything that was changed or left out.
    pub notes: Vec<String>,
}

/// Fields of a model that are read; all others are passed over.
#[derive(Deserialize)]
struct Model {
    #[serde(default)]
    units: Units,
    #[serde(default)]
    tolerance: Option<f64>,
    #[serde(default)]
    rooms: Option<Vec<ModelRoom>>,
}

/// Unit of the coordinates of a model.
#[derive(Clone, Copy, Default, Deserialize)]
enum Units {
    #[default]
    Meters,
    Millimeters,
    Centimeters,
    Feet,
    Inches,
}

#[derive(Deserialize)]
struct ModelRoom {
    identifier: String,
    #[serde(default)]
    display_name: Option<String>,
    faces: Vec<ModelFace>,
    #[serde(default)]
    indoor_shades: Option<Vec<Value>>,
}

#[derive(Deserialize)]
struct ModelFace {
    identifier: String,
    face_type: FaceType,
    geometry: Face3d,
    #[serde(default)]
    apertures: Option<Vec<Value>>,
    #[serde(default)]
    doors: Option<Vec<Value>>,
}

#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
enum FaceType {
    Wall,
    Floor,
    RoofCeiling,
    AirBoundary,
}

#[derive(Deserialize)]
struct Face3d {
    boundary: Vec<[f64; 3]>,
    #[serde(default)]
    holes: Option<Vec<Vec<[f64; 3]>>>,
}

impl Units {
    /// Converts a length to metres; a division where that is exact.
    fn metres(self, length: f64) -> f64 {
        match self {
            Self::Meters => length,
            Self::Millimeters => length / 1000.0,
            Self::Centimeters => length / 100.0,
            Self::Feet => length * 0.3048,
            Self::Inches => length * 0.0254,
        }
    }
}

impl ModelRoom {
    fn is_named(&self, name: &str) -> bool {
        self.identifier == name || self.display_name.as_deref() == Some(name)
    }
}

/// Reads a room of a model by its identifier or display name; without a name, the only room.
///
/// Errors concern the text of the model, the choice of the room, and, with pointers below `/room/faces`, faces that do not close it.
pub fn read_room(text: &[u8], name: Option<&str>) -> Result<HbjsonRoom, DocumentErrors> {
    let value = json::value(text)?;
    let model: Model = serde_path_to_error::deserialize(value).map_err(|error| {
        let fault = fault::of_error(&error);
        FieldError::new(fault.pointer, fault.message)
    })?;
    let rooms = model.rooms.unwrap_or_default();
    let room = chosen(&rooms, name)?;
    let mut notes = Vec::new();
    let rings = rings_in_metres(room, (model.units, model.tolerance.unwrap_or_default()), &mut notes);
    let faces: Vec<FaceDocument> = room.faces.iter().zip(rings).map(|(face, rings)| document(face, rings)).collect();
    notes.extend(left_out(room));
    let document = RoomDocument::of_faces(faces);
    let mut checks = Checks::default();
    if document.enclosure(&mut checks).is_none() {
        return Err(DocumentErrors(checks.errors));
    }
    notes.extend(document.repairs());
    Ok(HbjsonRoom { faces: document.faces.unwrap_or_default(), notes })
}

/// Chooses a room of a model.
fn chosen<'a>(rooms: &'a [ModelRoom], name: Option<&str>) -> Result<&'a ModelRoom, FieldError> {
    let names = || {
        let names = rooms.iter().take(MOST_NAMED).map(|room| format!("`{}`", room.identifier));
        let others = rooms.len().saturating_sub(MOST_NAMED);
        let more = if others == 0 { String::new() } else { format!(" and {others} more") };
        names.collect::<Vec<_>>().join(", ") + &more
    };
    let named: Vec<&ModelRoom> = rooms.iter().filter(|room| name.is_none_or(|name| room.is_named(name))).collect();
    let detail = match (named.as_slice(), name) {
        ([room], _) => return Ok(room),
        _ if rooms.is_empty() => "the model has no rooms".to_owned(),
        ([], Some(name)) => format!("the model has no room {name:?}; its rooms are {}", names()),
        (_, Some(name)) => format!("the model has several rooms {name:?}: name one by its identifier"),
        (_, None) => format!("the model has {} rooms, name one of them: {}", rooms.len(), names()),
    };
    Err(FieldError::new("/rooms", detail))
}

/// Returns the rings of each face in metres, corners within the model's tolerance merged, the lowest one at z = 0.
fn rings_in_metres(
    room: &ModelRoom,
    (units, tolerance): (Units, f64),
    notes: &mut Vec<String>,
) -> Vec<Vec<Vec<DVec3>>> {
    let corner = |place: &[f64; 3]| DVec3::from(place.map(|length| units.metres(length)));
    let of_face = |face: &ModelFace| -> Vec<Vec<DVec3>> {
        let rings = std::iter::once(&face.geometry.boundary).chain(face.geometry.holes.iter().flatten());
        rings.map(|ring| ring.iter().map(corner).collect()).collect()
    };
    let mut faces: Vec<Vec<Vec<DVec3>>> = room.faces.iter().map(of_face).collect();
    let corners = || faces.iter().flatten().flatten().copied();
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let extent = corners().fold(DVec3::NEG_INFINITY, DVec3::max) - low;
    let near = units.metres(tolerance).min(COARSEST * extent.length());
    if near > 0.0 && near.is_finite() {
        let welded = CorneredFaces::weld(&faces, near);
        if welded.moved > 0 {
            let detail =
                format!("{} corners within the model's tolerance of others ({near:.1e} m) were merged", welded.moved);
            notes.push(detail);
        }
        let place = |corner: &usize| welded.places[*corner];
        let ring = |ring: &Vec<usize>| ring.iter().map(place).collect();
        faces = welded.faces.iter().map(|rings| rings.iter().map(ring).collect()).collect();
    }
    let rounded = |place: DVec3| (place * NANOMETRES).round() / NANOMETRES + DVec3::ZERO;
    let floor = DVec3::new(0.0, 0.0, low.z);
    for place in faces.iter_mut().flatten().flatten() {
        *place = rounded(*place - floor);
    }
    if rounded(floor).z != 0.0 {
        notes.push(format!(
            "the room was moved by {} m along z, so that its lowest point is at z = 0: heights of grids, objects and views of the job are \
             above that point",
            -rounded(floor).z
        ));
    }
    faces
}

/// Returns a face of a document.
fn document(face: &ModelFace, rings: Vec<Vec<DVec3>>) -> FaceDocument {
    let mut rings = rings.into_iter().map(|ring| ring.into_iter().map(|corner| corner.to_array()).collect());
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

/// Returns a sentence for each sort of thing in a room that is not simulated as the model has it.
fn left_out(room: &ModelRoom) -> Vec<String> {
    let mut notes = vec![
        "reflectances of the model are not read: `surfaces` of the job has those of floor, walls and ceiling"
            .to_owned(),
    ];
    let count = |of_face: fn(&ModelFace) -> &Option<Vec<Value>>| -> usize {
        room.faces.iter().filter_map(|face| of_face(face).as_ref()).map(Vec::len).sum()
    };
    let (apertures, doors) = (count(|face| &face.apertures), count(|face| &face.doors));
    if apertures + doors > 0 {
        notes.push(format!("{apertures} apertures and {doors} doors are opaque, with the surfaces of their faces"));
    }
    let is_air = |face: &&ModelFace| face.face_type == FaceType::AirBoundary;
    let air: Vec<String> = room.faces.iter().filter(is_air).map(|face| format!("`{}`", face.identifier)).collect();
    if !air.is_empty() {
        let names = air[..air.len().min(MOST_NAMED)].join(", ");
        notes.push(format!("{} air boundaries are walls: {names}", air.len()));
    }
    let shades = room.indoor_shades.as_ref().map_or(0, Vec::len);
    if shades > 0 {
        notes.push(format!("{shades} shades in the room are left out"));
    }
    notes
}
