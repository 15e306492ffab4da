//! Mesh objects: conversion of their meshes, and checks against their surfaces and the room.

use std::collections::BTreeMap;

use glam::DVec3;

use super::RoomDocument;
use super::instances::{Copies, PlacedObject};
use super::mesh_document::{MeshObjectDocument, Place};
use super::object::ObjectDocument;
use super::openings::cover_no_opening;
use super::plan::PartitionDocument;
use super::sheets::{one_sheet_each, undetermined_words};
use super::surface::SurfaceDocument;
use crate::document::errors::{Checks, FieldError, FieldErrorCode, tidy_m};
use crate::document::file_source::FileSource;
use crate::document::frame::{FileFrame, Up, hint_at_other_axis};
use crate::document::hints;
use crate::document::limits::{MOST_INSTANCES, MOST_TRIANGLES, TOUCHING_M};
use crate::document::read::pointer::escape;
use crate::document::tube::TubeDocument;
use crate::document::tube::opening::PlacedOpening;
use crate::geometry::TriangleMesh;
use crate::geometry::placement::Placement;
use crate::geometry::repeats::without_repeats;
use crate::optics::Surface;
use crate::scene::{Enclosure, Instances, MeshObject};
use crate::traceable::enclosure::TraceableEnclosure;

/// Number of triangles whose memory a material takes in a copy of a mesh.
const MATERIAL_TRIANGLES: usize = 10;

/// Multiple of a room's extent beyond which coordinates of a file are taken for those of a survey.
const FAR: f64 = 100.0;

/// Returns the mesh objects of a room, in its frame, and its partitions after them; after an error some may be missing.
pub(crate) fn mesh_objects(
    room: &RoomDocument,
    tubes: &[TubeDocument],
    enclosure: &Enclosure,
    meshes: &dyn FileSource,
    checks: &mut Checks,
) -> Vec<MeshObject> {
    let mut copies = Copies::default();
    let (mut triangles, mut places) = (0, 0);
    let room_of_rays = enclosure.as_box().is_none().then(|| TraceableEnclosure::new(enclosure));
    let room_of_objects = (enclosure, room_of_rays.as_ref());
    for (index, object) in room.objects.iter().enumerate() {
        let pointer = format!("/room/objects/{index}");
        let ObjectDocument::Mesh(object) = object else { continue };
        let file = match meshes.load(&object.mesh) {
            Ok(file) => file,
            Err(detail) => {
                checks.refuse(format!("{pointer}/mesh"), detail);
                continue;
            }
        };
        let own_places = object.places(&pointer);
        // names of materials take memory in every copy, too
        triangles += own_places.len() * file.triangles.len().max(MATERIAL_TRIANGLES * file.materials.len());
        places += object.instances.as_ref().map_or(0, Vec::len);
        if triangles > MOST_TRIANGLES {
            let detail = format!("the meshes of all objects have more than {MOST_TRIANGLES} triangles together");
            checks.refuse(format!("{pointer}/mesh"), detail);
            break;
        }
        if places > MOST_INSTANCES {
            let detail = format!("all objects may have at most {MOST_INSTANCES} instances together");
            checks.refuse_as(FieldErrorCode::TooMany, format!("{pointer}/instances"), detail);
            break;
        }
        if let Some(object) = placed_object(&pointer, object, (&file, &own_places), room_of_objects, checks) {
            copies.add(index, object);
        }
    }
    let mut changed = vec![false; copies.objects.len()];
    if checks.errors.is_empty() {
        let placed = |(number, tube)| PlacedOpening::of(tube, enclosure).map(|opening| (number, opening));
        let openings: Vec<_> = tubes.iter().enumerate().filter_map(placed).collect();
        cover_no_opening(&openings, &copies.objects, &copies.numbers, checks);
        let of_copies = (&copies.numbers[..], &copies.overlapping[..]);
        changed = one_sheet_each(&mut copies.objects, of_copies, enclosure, checks);
    }
    let mut objects = copies.put_together(&changed);
    objects.extend(room.partitions.iter().filter_map(PartitionDocument::object));
    objects
}

/// The room of objects: its faces, and as rays meet them, unless it is a box.
type RoomOfObjects<'a> = (&'a Enclosure, Option<&'a TraceableEnclosure>);

/// Returns the object at `pointer` at its places, given with the mesh of its file; `None` after an error.
fn placed_object(
    pointer: &str,
    object: &MeshObjectDocument,
    (file, places): (&TriangleMesh, &[Place]),
    room: RoomOfObjects<'_>,
    checks: &mut Checks,
) -> Option<PlacedObject> {
    let errors_before = checks.errors.len();
    let upright = |up: Up| FileFrame { up, ..object.frame() }.upright(file);
    let mut mesh = upright(object.up);
    let surfaces = surfaces(pointer, object, &mut mesh, checks);
    if mesh.positions.iter().any(|position| !position.is_finite()) {
        checks.refuse(format!("{pointer}/mesh"), format!("{}, coordinates must be finite", object.with_unit()));
        return None;
    }
    let errors_of_names = checks.errors.len();
    let once = |mesh: TriangleMesh, checks: &mut Checks| match without_repeats(&mesh, |a, b| {
        surfaces[a as usize] == surfaces[b as usize]
    }) {
        Ok(once) => Some((once.mesh.unwrap_or(mesh), once.overlapping)),
        Err(undetermined) => {
            checks.refuse(format!("{pointer}/mesh"), undetermined_words(undetermined, &mesh));
            None
        }
    };
    let at = |place: &Place, mesh: TriangleMesh, checks: &mut Checks| {
        let mut mesh = place.put(mesh);
        check_extent(place, object, &mesh, room, checks);
        hint_at_other_axis(&mut checks.errors[errors_of_names..], object.up, |up| {
            let mut trial = Checks::default();
            check_extent(place, object, &place.put(upright(up)), room, &mut trial);
            trial.errors.is_empty()
        });
        if object.offset.is_none() {
            hint_at_offset(&mut checks.errors[errors_of_names..], (file, object.frame()), &mesh, room.0);
        }
        let [low, high] = room.0.bounds();
        for position in &mut mesh.positions {
            // parts that touch a wall up to rounding must not reach behind it
            *position = position.clamp(low, high);
        }
        (checks.errors.len() == errors_before).then_some(mesh)
    };
    let (copies, overlapping, instances) = match &object.instances {
        None => {
            let (mesh, overlapping) = once(at(places.first()?, mesh, checks)?, checks)?;
            (vec![MeshObject::new(mesh, surfaces.clone())], overlapping, None)
        }
        Some(_) => {
            let (mesh, overlapping) = once(mesh, checks)?;
            // rays toward a copy are rounded as coarsely as it is far from its own origin
            let middle = mesh.bounds().map_or(DVec3::ZERO, |(low, high)| low.midpoint(high));
            let mut own = mesh.clone();
            own.positions.iter_mut().for_each(|position| *position -= middle);
            let (mut copies, mut placements) = (Vec::with_capacity(places.len()), Vec::with_capacity(places.len()));
            for place in places {
                copies.push(MeshObject::new(at(place, mesh.clone(), checks)?, surfaces.clone()));
                placements.push(inside(place.placement(middle), &own, room.0));
            }
            (copies, overlapping, Some(Instances { mesh: own, placements }))
        }
    };
    Some(PlacedObject { copies, overlapping, instances })
}

/// Returns the place moved by the rounding by which a copy of `mesh` there reaches behind a wall.
fn inside(mut place: Placement, mesh: &TriangleMesh, enclosure: &Enclosure) -> Placement {
    let [least, most] = enclosure.bounds();
    let corners = || mesh.positions.iter().map(|position| place.point(*position));
    let low = corners().fold(most, DVec3::min);
    let high = corners().fold(least, DVec3::max);
    place.origin += (least - low).max(DVec3::ZERO) - (high - most).max(DVec3::ZERO);
    place
}

/// Returns the surface of each material of the mesh, to which those of backs are added; adds a fault for each material or surface whose name
/// has no counterpart.
fn surfaces(pointer: &str, object: &MeshObjectDocument, mesh: &mut TriangleMesh, checks: &mut Checks) -> Vec<Surface> {
    let names = mesh.materials.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    for (field, by_name) in [("surfaces", &object.surfaces), ("back_surfaces", &object.back_surfaces)] {
        for name in by_name.keys().filter(|name| !mesh.materials.contains(name)) {
            let detail = format!("the mesh has no material of this name; its materials are {names}");
            checks.refuse(format!("{pointer}/{field}/{}", escape(name)), detail);
        }
    }
    let surface = |by_name: &BTreeMap<String, SurfaceDocument>, name: &String| by_name.get(name)?.surface();
    let mut surfaces = Vec::with_capacity(mesh.materials.len());
    for name in &mesh.materials {
        match surface(&object.surfaces, name) {
            Some(surface) => surfaces.push(surface),
            None => {
                let detail = format!("needs a surface for the mesh's material {name:?}; its materials are {names}");
                checks.refuse(format!("{pointer}/surfaces"), detail);
            }
        }
    }
    if surfaces.len() < mesh.materials.len() {
        return surfaces;
    }
    let mut backs: Vec<u32> = (0..mesh.materials.len() as u32).collect();
    for (back, name) in backs.iter_mut().zip(mesh.materials.clone()) {
        if let Some(surface) = surface(&object.back_surfaces, &name).filter(|found| *found != surfaces[*back as usize])
        {
            *back = surfaces.len() as u32;
            surfaces.push(surface);
            mesh.materials.push(name);
        }
    }
    let fronts = std::mem::take(&mut mesh.triangle_materials);
    mesh.set_sides(fronts.into_iter().map(|front| [front, backs[front as usize]]));
    surfaces
}

/// Appends to `errors` about the place of a mesh whose file has coordinates far beyond the room that an `offset` would bring it there.
fn hint_at_offset(
    errors: &mut [FieldError],
    (file, frame): (&TriangleMesh, FileFrame),
    placed: &TriangleMesh,
    enclosure: &Enclosure,
) {
    let (Some((least, most)), Some((low, high))) = (file.bounds(), placed.bounds()) else { return };
    let extent = enclosure.extent();
    let is_far = least.abs().min(most.abs()).max_element() * frame.metres > FAR * extent.max_element();
    if is_far && (high - low).cmple(extent).all() {
        let hint = format!(
            "; with `\"offset\": [{}, {}, {}]`, the least corner of its file, its coordinates would begin at its `position_m`",
            least.x, least.y, least.z
        );
        errors.iter_mut().for_each(|error| error.detail += &hint);
    }
}

/// Adds a fault for each axis along which a mesh at its place reaches out of the room, or for its first corner outside.
fn check_extent(
    place: &Place,
    object: &MeshObjectDocument,
    mesh: &TriangleMesh,
    (enclosure, room): RoomOfObjects<'_>,
    checks: &mut Checks,
) {
    let (unit, pointer) = (object.with_unit(), &place.pointer);
    let Some((low, high)) = mesh.bounds() else {
        checks.refuse(format!("{pointer}/mesh"), "the mesh is empty");
        return;
    };
    let [least, most] = enclosure.bounds();
    let errors_before = checks.errors.len();
    // coordinates far from the origin are rounded more coarsely
    let slack = place.position_m.map(|position| TOUCHING_M.max(8.0 * f64::EPSILON * position.abs()));
    for axis in 0..3 {
        let (least, most) = (least[axis], most[axis]);
        let (position, slack) = (place.position_m[axis], slack[axis]);
        if low[axis] < least - slack || high[axis] > most + slack {
            let pointer = format!("{pointer}/position_m/{axis}");
            let fits = |meant: f64| low[axis] - position + meant >= least && high[axis] - position + meant <= most;
            let hint = hints::of_number(&pointer, position, fits);
            let detail = format!(
                "{unit}, the mesh must be inside the room ({least}..{most} m), but reaches from {} m to {} m{hint}",
                tidy_m(low[axis]),
                tidy_m(high[axis])
            );
            checks.refuse(pointer, detail);
        }
    }
    let Some(room) = room.filter(|_| checks.errors.len() == errors_before) else { return };
    let is_inside = |position: DVec3| {
        let beside =
            |axis: usize| [-slack[axis], slack[axis]].map(|slack| position + DVec3::AXES[axis] * (2.0 * slack));
        room.contains(position) || (0..3).flat_map(beside).any(|position| room.contains(position))
    };
    let outside: Vec<&DVec3> = mesh.positions.iter().filter(|position| !is_inside(**position)).collect();
    if let Some(first) = outside.first() {
        let detail = format!(
            "{unit}, the mesh must be inside the room, but {} of its {} corners are outside, the first at ({:.4}, {:.4}, \
             {:.4}) m",
            outside.len(),
            mesh.positions.len(),
            first.x,
            first.y,
            first.z
        );
        checks.refuse(format!("{pointer}/position_m"), detail);
    }
}
