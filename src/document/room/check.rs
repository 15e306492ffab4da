//! Checks of the room and of the objects and luminaires in it.

use super::RoomDocument;
use super::luminaire::{Sheet, check_luminaire, check_place, overlap, reaches_into};
use super::object::ObjectDocument;
use super::surface::{Owner, check_surface};
use crate::document::errors::Checks;
use crate::document::limits::{LUMINAIRES, OBJECTS, ROOM_EDGE_M, TURN_DEG};

/// Adds the faults of the room, and returns the luminaires that lie in it, with their numbers in the document.
pub(crate) fn check_room(room: &RoomDocument, checks: &mut Checks) -> Vec<(usize, Sheet)> {
    checks.numbers("/room/size_m", &room.size_m, ROOM_EDGE_M);
    checks.number("/room/rotation_deg", room.rotation_deg, TURN_DEG);
    let surfaces = &room.surfaces;
    let faces = [
        ("floor", Some(&surfaces.floor)),
        ("walls", Some(&surfaces.walls)),
        ("wall_north", surfaces.wall_north.as_ref()),
        ("wall_east", surfaces.wall_east.as_ref()),
        ("wall_south", surfaces.wall_south.as_ref()),
        ("wall_west", surfaces.wall_west.as_ref()),
        ("ceiling", Some(&surfaces.ceiling)),
    ];
    for (name, surface) in faces {
        if let Some(surface) = surface {
            check_surface(&format!("/room/surfaces/{name}"), surface, Owner::Room, checks);
        }
    }
    if checks.at_most("/room/objects", room.objects.len(), &OBJECTS, " objects") {
        for (index, object) in room.objects.iter().enumerate() {
            object.check(&format!("/room/objects/{index}"), room.valid_size_m(), checks);
        }
    }
    check_luminaires(room, checks)
}

fn check_luminaires(room: &RoomDocument, checks: &mut Checks) -> Vec<(usize, Sheet)> {
    if !checks.at_most("/room/luminaires", room.luminaires.len(), &LUMINAIRES, " luminaires") {
        return Vec::new();
    }
    // luminaires outside the room are kept, because others may overlap them
    let mut sheets: Vec<(usize, Sheet)> = Vec::new();
    let mut in_room = Vec::new();
    for (index, luminaire) in room.luminaires.iter().enumerate() {
        let pointer = format!("/room/luminaires/{index}");
        let Some(sheet) = check_luminaire(&pointer, luminaire, checks) else { continue };
        if let Some(size) = room.valid_size_m()
            && check_place(&pointer, &sheet, size, checks)
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
