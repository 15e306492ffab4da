//! Checks of the room and of the objects and luminaires in it.

use super::RoomDocument;
use super::luminaire::{Sheet, check_luminaire, check_place, overlap, reaches_into};
use super::object::ObjectDocument;
use super::surface::{Owner, check_surface};
use crate::document::errors::{Checks, FieldErrorCode};
use crate::document::hints;
use crate::document::limits::{LUMINAIRES, OBJECTS, PARTITIONS, TURN_DEG};
use crate::document::read::pointer::escape;
use crate::scene::Enclosure;
use crate::traceable::enclosure::TraceableEnclosure;

/// A room that was checked, against which the other parts of a document are.
pub(crate) struct CheckedRoom {
    /// Faces of the room; `None` after a fault of theirs.
    pub enclosure: Option<Enclosure>,
    /// Luminaires that lie in the room, with their numbers in the document.
    pub luminaires: Vec<(usize, Sheet)>,
}

/// Adds the faults of the room, and returns what is left of it. Nothing is compared with the shape of a room unless it `is_own`.
pub(crate) fn check_room(room: &RoomDocument, is_own: bool, checks: &mut Checks) -> CheckedRoom {
    let enclosure = room.enclosure(checks).filter(|_| is_own);
    checks.number("/room/rotation_deg", room.rotation_deg, TURN_DEG);
    check_surfaces(room, enclosure.as_ref(), checks);
    if checks.at_most("/room/partitions", room.partitions.len(), &PARTITIONS, " partitions") {
        for (index, partition) in room.partitions.iter().enumerate() {
            partition.check(&format!("/room/partitions/{index}"), enclosure.as_ref(), checks);
        }
    }
    if checks.at_most("/room/objects", room.objects.len(), &OBJECTS, " objects") {
        for (index, object) in room.objects.iter().enumerate() {
            object.check(&format!("/room/objects/{index}"), enclosure.as_ref(), checks);
        }
    }
    let luminaires = check_luminaires(room, enclosure.as_ref(), checks);
    CheckedRoom { enclosure, luminaires }
}

/// Checks the surfaces, and that each single one is of a face of the room.
fn check_surfaces(room: &RoomDocument, enclosure: Option<&Enclosure>, checks: &mut Checks) {
    let surfaces = &room.surfaces;
    for (name, surface) in [("floor", &surfaces.floor), ("walls", &surfaces.walls), ("ceiling", &surfaces.ceiling)] {
        check_surface(&format!("/room/surfaces/{name}"), surface, Owner::Room, checks);
    }
    for (name, surface) in &surfaces.single {
        let pointer = format!("/room/surfaces/{}", escape(name));
        let is_known = match enclosure {
            Some(enclosure) => enclosure.faces().iter().any(|face| face.name == *name),
            // the faces of a room that was refused are not known
            None => room.faces.is_some() || SINGLE.iter().any(|prefix| name.starts_with(prefix)),
        };
        match is_known {
            true => check_surface(&pointer, surface, Owner::Room, checks),
            false => checks.refuse_as(FieldErrorCode::UnknownField, pointer, no_such_face(name, enclosure)),
        }
    }
    for (number, face) in room.faces.iter().flatten().enumerate() {
        let Some(surface) = &face.surface else { continue };
        let pointer = format!("/room/faces/{number}/surface");
        if surfaces.single.contains_key(&face.name) {
            checks.refuse(&pointer, "must be left out: `surfaces` has a surface for the face of this name");
        }
        check_surface(&pointer, surface, Owner::Room, checks);
    }
}

/// Beginnings of the names of single faces of boxes and plans.
const SINGLE: [&str; 2] = ["wall_", "ceiling_"];

/// Returns a sentence about a name in `surfaces` that no face has.
fn no_such_face(name: &str, enclosure: Option<&Enclosure>) -> String {
    let faces = enclosure.map(Enclosure::faces).unwrap_or_default();
    let kinds = ["floor", "walls", "ceiling"];
    let single = || faces.iter().map(|face| face.name.as_str()).filter(|name| !kinds.contains(name));
    let hint = hints::did_you_mean(name, kinds.into_iter().chain(single()));
    let hint = hint.map_or(String::new(), |meant| format!("; did you mean `{meant}`?"));
    let some: Vec<String> = single().map(|name| format!("`{name}`")).take(8).collect();
    let others = if some.len() < 8 { "" } else { ", .." };
    format!(
        "the room has no face of this name; surfaces are of kinds (`floor`, `walls`, `ceiling`) or of single faces ({}{others}){hint}",
        some.join(", ")
    )
}

fn check_luminaires(room: &RoomDocument, enclosure: Option<&Enclosure>, checks: &mut Checks) -> Vec<(usize, Sheet)> {
    if !checks.at_most("/room/luminaires", room.luminaires.len(), &LUMINAIRES, " luminaires") {
        return Vec::new();
    }
    let enclosure = enclosure.filter(|_| !room.luminaires.is_empty());
    let enclosure = enclosure.map(|enclosure| (enclosure, TraceableEnclosure::new(enclosure)));
    // luminaires outside the room are kept, because others may overlap them
    let mut sheets: Vec<(usize, Sheet)> = Vec::new();
    let mut in_room = Vec::new();
    for (index, luminaire) in room.luminaires.iter().enumerate() {
        let pointer = format!("/room/luminaires/{index}");
        let Some(sheet) = check_luminaire(&pointer, luminaire, checks) else { continue };
        if let Some((enclosure, traceable)) = &enclosure
            && check_place(&pointer, &sheet, (enclosure, traceable), checks)
        {
            for (number, object) in room.objects.iter().enumerate() {
                if let ObjectDocument::Box(object) = object
                    && reaches_into(&sheet, object)
                {
                    let detail = format!("must neither reach into nor emit into /room/objects/{number}");
                    checks.refuse(pointer.clone(), detail);
                }
            }
            if let Some((other, _)) = sheets.iter().find(|(_, other)| overlap(&sheet, other)) {
                checks.refuse(
                    pointer.clone(),
                    format!("must not overlap /room/luminaires/{other}, which lies in the same plane"),
                );
            }
            in_room.push((index, sheet.clone()));
        }
        sheets.push((index, sheet));
    }
    in_room
}
