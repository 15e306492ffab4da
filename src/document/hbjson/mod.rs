//! Rooms of Honeybee models (HBJSON), read as plain JSON: the faces of one room, in metres. A document may have a model in its room, or the
//! id or the file of one.

mod corners;
mod model;

use serde::de::{Deserializer, IgnoredAny};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use utoipa::ToSchema;

use super::errors::{Checks, DocumentErrors, FieldError};
use super::file_source::FileSource;
use super::read::{fault, json};
use super::room::faces::FaceDocument;
use model::{FaceType, Model, ModelFace, ModelRoom};

/// Largest number of names that a message lists.
const MOST_NAMED: usize = 20;

/// Largest number of rooms that a report lists.
const MOST_ROOMS: usize = 1000;

/// Longest name of a room in a report, in bytes.
const LONGEST_NAME: usize = 256;

/// Longest message about the text of a model, in characters.
const LONGEST_MESSAGE: usize = 300;

/// A room of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct HbjsonRoom {
    /// Number of the room in its model.
    number: usize,
    /// Faces, which close a room with its lowest corner at z = 0.
    pub faces: Vec<FaceDocument>,
    /// A sentence for everything that was changed or left out.
    pub notes: Vec<String>,
}

/// Rooms of a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ModelReport {
    /// Number of rooms.
    pub room_count: u64,
    /// The first rooms, at most 1000.
    pub rooms: Vec<RoomReport>,
}

/// A room of a model in short.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RoomReport {
    /// Identifier, which a job document may name.
    pub identifier: String,
    /// Name for people; a job document may name it, too.
    pub display_name: Option<String>,
    /// Number of faces.
    pub faces: u64,
}

impl HbjsonRoom {
    /// Returns the pointer to what a document gives for one to a face of the room that was read; other pointers stay.
    pub(super) fn pointer(&self, pointer: &str) -> String {
        match in_model(self.number, pointer) {
            in_model if in_model == pointer => in_model,
            in_model => format!("{MODEL}{in_model}"),
        }
    }
}

/// Reads a room of the text of a model by its identifier or display name; without a name, the only room.
///
/// Errors concern the text of the model, the choice of the room (`/rooms`), and its faces; their pointers are those of the model.
pub fn read_room(text: &[u8], name: Option<&str>) -> Result<HbjsonRoom, DocumentErrors> {
    room_of(of_text(text)?, name)
}

/// Reads a model, and lists its rooms.
pub fn read_report(text: &[u8]) -> Result<ModelReport, FieldError> {
    let rooms = of_text(text)?.rooms.unwrap_or_default();
    if rooms.is_empty() {
        return Err(FieldError::new("/rooms", "a model must be an object with at least one room"));
    }
    if let Some(number) = rooms.iter().position(|room| room.identifier.len() > LONGEST_NAME) {
        let detail = format!("must have at most {LONGEST_NAME} bytes");
        return Err(FieldError::new(format!("/rooms/{number}/identifier"), detail));
    }
    let report = |room: &ModelRoom| RoomReport {
        identifier: room.identifier.clone(),
        display_name: room.display_name.clone().filter(|name| name.len() <= LONGEST_NAME),
        faces: room.faces.len() as u64,
    };
    Ok(ModelReport { room_count: rooms.len() as u64, rooms: rooms.iter().take(MOST_ROOMS).map(report).collect() })
}

/// Reads the text of a model; fields that are not used take no memory.
fn of_text(text: &[u8]) -> Result<Model, FieldError> {
    let text = json::text(text)?;
    let mut source = serde_json::Deserializer::from_str(&text);
    let model = of_source(&mut source)?;
    source.end().map_err(|error| FieldError::new("", error.to_string()))?;
    Ok(model)
}

fn of_source<'de>(source: impl Deserializer<'de, Error = serde_json::Error>) -> Result<Model, FieldError> {
    serde_path_to_error::deserialize(source).map_err(|error| {
        let is_of_text = error.inner().is_syntax() || error.inner().is_eof();
        let mut fault = fault::of_error(&error);
        // messages may hold a value of the model
        fault.message = fault.message.chars().take(LONGEST_MESSAGE).collect();
        FieldError::new(if is_of_text { String::new() } else { fault.pointer }, fault.message)
    })
}

/// Reads a room of a model as [`read_room`] does.
fn room_of(model: Model, name: Option<&str>) -> Result<HbjsonRoom, DocumentErrors> {
    let rooms = model.rooms.unwrap_or_default();
    let number = chosen(&rooms, name)?;
    let room = &rooms[number];
    let tolerance = model.tolerance.unwrap_or_default();
    if tolerance < 0.0 {
        return Err(FieldError::new("/tolerance", format!("must be >= 0, but is {tolerance}")).into());
    }
    let (document, mut notes) = corners::document_of(room, (model.units, tolerance));
    notes.extend(left_out(room));
    let mut checks = Checks::default();
    if document.enclosure(&mut checks).is_none() {
        checks.errors.iter_mut().for_each(|error| error.pointer = in_model(number, &error.pointer));
        return Err(DocumentErrors(checks.errors));
    }
    notes.extend(document.repairs());
    Ok(HbjsonRoom { number, faces: document.faces.unwrap_or_default(), notes })
}

/// Returns the pointer into a model for one to a face of its room `number` in a document; other pointers stay.
fn in_model(number: usize, pointer: &str) -> String {
    match pointer.strip_prefix("/room/faces") {
        Some(of_faces) => {
            let of_faces = of_faces.replace("/boundary_m", "/geometry/boundary").replace("/holes_m", "/geometry/holes");
            format!("/rooms/{number}/faces{}", of_faces.replace("/name", "/identifier"))
        }
        None => pointer.to_owned(),
    }
}

/// Field of a document with a model, or with the name of its file.
const MODEL: &str = "/room/hbjson";

/// Replaces the model in the room of a document by the faces of the room that it names, and returns what was read; `None` without a model, or
/// after a fault, when a large box replaces the room. A model that is named is one of `files`.
pub(super) fn expand(document: &mut Value, files: Option<&dyn FileSource>, checks: &mut Checks) -> Option<HbjsonRoom> {
    let room = document.pointer_mut("/room")?.as_object_mut()?;
    let model = room.remove("hbjson").filter(|model| !model.is_null())?;
    match room_of_document(room, &model, files) {
        Ok(read) => {
            room.insert("faces".to_owned(), json!(read.faces));
            Some(read)
        }
        Err(DocumentErrors(errors)) => {
            checks.errors.extend(errors);
            let others: Map<String, Value> = std::mem::take(room);
            room.extend(others.into_iter().filter(|(name, _)| !SHAPES.contains(&name.as_str()) && name != "surfaces"));
            room.insert("size_m".to_owned(), json!([1000, 1000, 1000]));
            None
        }
    }
}

/// Fields of a room that give its shape in other ways than a model.
const SHAPES: [&str; 4] = ["size_m", "plan", "ceiling", "faces"];

/// Reads the room that a document names; its name is removed.
fn room_of_document(
    room: &mut Map<String, Value>,
    model: &Value,
    files: Option<&dyn FileSource>,
) -> Result<HbjsonRoom, DocumentErrors> {
    let name = match room.remove("identifier") {
        None | Some(Value::Null) => None,
        Some(Value::String(name)) => Some(name),
        Some(_) => return Err(FieldError::new("/room/identifier", "invalid type, expected a string").into()),
    };
    if let Some(other) = SHAPES.into_iter().find(|name| room.get(*name).is_some_and(|value| !value.is_null())) {
        return Err(FieldError::new(MODEL, format!("must be left out if there is a `{other}`")).into());
    }
    let in_document = |error: FieldError| match error.pointer.as_str() {
        "/rooms" => FieldError { pointer: "/room/identifier".to_owned(), ..error },
        pointer => FieldError { pointer: format!("{MODEL}{pointer}"), ..error },
    };
    let of_document = |DocumentErrors(errors)| DocumentErrors(errors.into_iter().map(in_document).collect());
    let model = match (model, files) {
        (Value::Object(_), _) => of_source(model),
        (Value::String(name), Some(files)) => {
            of_text(&files.model(name).map_err(|detail| FieldError::new(MODEL, detail))?)
        }
        _ => {
            return Err(
                FieldError::new(MODEL, "must be a model, which is an object, or the id or the file of one").into()
            );
        }
    };
    let model = model.map_err(|error| FieldError { pointer: format!("{MODEL}{}", error.pointer), ..error })?;
    room_of(model, name.as_deref()).map_err(of_document)
}

/// Chooses a room of a model.
fn chosen(rooms: &[ModelRoom], name: Option<&str>) -> Result<usize, FieldError> {
    let names = || {
        let names = rooms.iter().take(MOST_NAMED).map(|room| format!("`{}`", room.identifier));
        let others = rooms.len().saturating_sub(MOST_NAMED);
        let more = if others == 0 { String::new() } else { format!(" and {others} more") };
        names.collect::<Vec<_>>().join(", ") + &more
    };
    let is_meant = |number: &usize| name.is_none_or(|name| rooms[*number].is_named(name));
    let named: Vec<usize> = (0..rooms.len()).filter(is_meant).collect();
    let detail = match (named.as_slice(), name) {
        ([number], _) => return Ok(*number),
        _ if rooms.is_empty() => "the model has no rooms".to_owned(),
        ([], Some(name)) => format!("the model has no room {name:?}; its rooms are {}", names()),
        (_, Some(name)) => format!("the model has several rooms {name:?}: name one by its identifier"),
        (_, None) => format!("the model has {} rooms, name one of them: {}", rooms.len(), names()),
    };
    Err(FieldError::new("/rooms", detail))
}

/// Returns a sentence for each sort of thing in a room that is not simulated as the model has it.
fn left_out(room: &ModelRoom) -> Vec<String> {
    let mut notes = vec![
        "reflectances of the model are not read: `surfaces` of the job has those of floor, walls and ceiling"
            .to_owned(),
    ];
    let count = |of_face: fn(&ModelFace) -> &Option<Vec<IgnoredAny>>| -> usize {
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
