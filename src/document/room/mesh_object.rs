//! Mesh objects: conversion of their meshes, and checks against their surfaces and the room.

use std::collections::BTreeMap;

use glam::DVec3;

use super::RoomDocument;
use super::mesh_document::MeshObjectDocument;
use super::object::ObjectDocument;
use super::openings::cover_no_opening;
use super::plan::PartitionDocument;
use super::sheets::{one_sheet_each, undetermined_words};
use super::surface::SurfaceDocument;
use crate::document::errors::{Checks, FieldError};
use crate::document::file_source::FileSource;
use crate::document::frame::{FileFrame, Up, hint_at_other_axis};
use crate::document::hints;
use crate::document::limits::{MOST_TRIANGLES, TOUCHING_M};
use crate::document::read::pointer::escape;
use crate::document::tube::TubeDocument;
use crate::document::tube::opening::PlacedOpening;
use crate::geometry::TriangleMesh;
use crate::geometry::repeats::without_repeats;
use crate::optics::Surface;
use crate::scene::{Enclosure, MeshObject};
use crate::traceable::enclosure::TraceableEnclosure;

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
    let (mut objects, mut numbers, mut on_themselves) = (Vec::new(), Vec::new(), Vec::new());
    let mut triangles = 0;
    for (index, object) in room.objects.iter().enumerate() {
        let pointer = format!("/room/objects/{index}");
        let ObjectDocument::Mesh(object) = object else { continue };
        let Some((object, lies_on_itself)) = mesh_object(&pointer, object, enclosure, meshes, checks) else {
            continue;
        };
        triangles += object.mesh.triangles.len();
        if triangles > MOST_TRIANGLES {
            let detail = format!("the meshes of all objects have more than {MOST_TRIANGLES} triangles together");
            checks.refuse(format!("{pointer}/mesh"), detail);
            break;
        }
        numbers.push(index);
        objects.push(object);
        on_themselves.push(lies_on_itself);
    }
    if checks.errors.is_empty() {
        let placed = |(number, tube)| PlacedOpening::of(tube, enclosure).map(|opening| (number, opening));
        let openings: Vec<_> = tubes.iter().enumerate().filter_map(placed).collect();
        cover_no_opening(&openings, &objects, &numbers, checks);
        one_sheet_each(&mut objects, (&numbers, &on_themselves), enclosure, checks);
    }
    objects.extend(room.partitions.iter().filter_map(PartitionDocument::object));
    objects
}

/// Returns the object at `pointer` in the frame of a room, and whether parts of its mesh lie on others; `None` after an error.
fn mesh_object(
    pointer: &str,
    object: &MeshObjectDocument,
    enclosure: &Enclosure,
    meshes: &dyn FileSource,
    checks: &mut Checks,
) -> Option<(MeshObject, bool)> {
    let in_file_units = match meshes.load(&object.mesh) {
        Ok(mesh) => mesh,
        Err(detail) => {
            checks.refuse(format!("{pointer}/mesh"), detail);
            return None;
        }
    };
    let errors_before = checks.errors.len();
    let position_m = DVec3::from(object.position_m);
    let place = |up: Up| {
        let mut mesh = FileFrame { up, ..object.frame() }.upright(&in_file_units);
        for position in &mut mesh.positions {
            *position = object.rotation_deg.turned(*position) + position_m;
        }
        mesh
    };
    let mut mesh = place(object.up);
    let surfaces = surfaces(pointer, object, &mut mesh, checks);
    let errors_of_names = checks.errors.len();
    check_extent(pointer, object, &mesh, enclosure, checks);
    hint_at_other_axis(&mut checks.errors[errors_of_names..], object.up, |up| {
        let mut trial = Checks::default();
        check_extent(pointer, object, &place(up), enclosure, &mut trial);
        trial.errors.is_empty()
    });
    if object.offset.is_none() {
        hint_at_offset(&mut checks.errors[errors_of_names..], (&in_file_units, object.frame()), &mesh, enclosure);
    }
    if checks.errors.len() > errors_before {
        return None;
    }
    let [low, high] = enclosure.bounds();
    for position in &mut mesh.positions {
        // parts that touch a wall up to rounding must not reach behind it
        *position = position.clamp(low, high);
    }
    let lies_on_itself = match without_repeats(&mesh, |a, b| surfaces[a as usize] == surfaces[b as usize]) {
        Ok(once) => {
            mesh = once.mesh.unwrap_or(mesh);
            once.lies_on_itself
        }
        Err(undetermined) => {
            checks.refuse(format!("{pointer}/mesh"), undetermined_words(undetermined, &mesh));
            return None;
        }
    };
    Some((MeshObject { mesh, surfaces }, lies_on_itself))
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

fn check_extent(
    pointer: &str,
    object: &MeshObjectDocument,
    mesh: &TriangleMesh,
    enclosure: &Enclosure,
    checks: &mut Checks,
) {
    let unit = object.with_unit();
    if mesh.positions.iter().any(|position| !position.is_finite()) {
        checks.refuse(format!("{pointer}/mesh"), format!("{unit}, coordinates must be finite"));
        return;
    }
    let Some((low, high)) = mesh.bounds() else {
        checks.refuse(format!("{pointer}/mesh"), "the mesh is empty");
        return;
    };
    let [least, most] = enclosure.bounds();
    let errors_before = checks.errors.len();
    for axis in 0..3 {
        let (least, most) = (least[axis], most[axis]);
        let position = object.position_m[axis];
        // coordinates far from the origin are rounded more coarsely
        let slack = TOUCHING_M.max(8.0 * f64::EPSILON * position.abs());
        if low[axis] < least - slack || high[axis] > most + slack {
            let pointer = format!("{pointer}/position_m/{axis}");
            let fits = |meant: f64| low[axis] - position + meant >= least && high[axis] - position + meant <= most;
            let hint = hints::of_number(&pointer, position, fits);
            let detail = format!(
                "{unit}, the mesh must be inside the room ({least}..{most} m), but reaches from {} m to {} m{hint}",
                low[axis], high[axis]
            );
            checks.refuse(pointer, detail);
        }
    }
    if checks.errors.len() > errors_before || enclosure.as_box().is_some() {
        return;
    }
    let traceable = TraceableEnclosure::new(enclosure);
    let outside: Vec<&DVec3> = mesh.positions.iter().filter(|position| !traceable.contains(**position)).collect();
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
