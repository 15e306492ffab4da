//! Mesh objects: conversion of their meshes, and checks against their surfaces and the room.

use std::collections::BTreeMap;

use glam::DVec3;

use super::RoomDocument;
use super::object::{MeshObjectDocument, ObjectDocument};
use super::openings::cover_no_opening;
use super::plan::PartitionDocument;
use super::sheets::{one_sheet_each, undetermined_words};
use super::surface::SurfaceDocument;
use crate::document::errors::Checks;
use crate::document::file_source::FileSource;
use crate::document::frame::{Up, hint_at_other_axis, upright};
use crate::document::hints;
use crate::document::limits::{MOST_TRIANGLES, TOUCHING_M};
use crate::document::read::pointer::escape;
use crate::document::tube::TubeDocument;
use crate::document::tube::opening::PlacedOpening;
use crate::geometry::TriangleMesh;
use crate::geometry::repeats::without_repeats;
use crate::geometry::turn::unit_vector;
use crate::optics::Surface;
use crate::scene::{Enclosure, MeshObject};
use crate::traceable::enclosure::TraceableEnclosure;

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
    let MeshObjectDocument { mesh: id, unit, up, position_m, rotation_deg, surfaces: by_name } = object;
    let in_file_units = match meshes.load(id) {
        Ok(mesh) => mesh,
        Err(detail) => {
            checks.refuse(format!("{pointer}/mesh"), detail);
            return None;
        }
    };
    let errors_before = checks.errors.len();
    let place = |up: Up| {
        let mut mesh = upright(&in_file_units, *unit, up);
        let turn = unit_vector(-rotation_deg.to_radians());
        for position in &mut mesh.positions {
            *position = turn.rotate(position.truncate()).extend(position.z) + DVec3::from(*position_m);
        }
        mesh
    };
    let mut mesh = place(*up);
    let surfaces = surfaces(pointer, by_name, &mesh, checks);
    let errors_of_names = checks.errors.len();
    check_extent(pointer, object, &mesh, enclosure, checks);
    hint_at_other_axis(&mut checks.errors[errors_of_names..], *up, |up| {
        let mut trial = Checks::default();
        check_extent(pointer, object, &place(up), enclosure, &mut trial);
        trial.errors.is_empty()
    });
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

/// Returns the surface of each material of the mesh; adds a fault for each material or surface whose name has no counterpart.
fn surfaces(
    pointer: &str,
    by_name: &BTreeMap<String, SurfaceDocument>,
    mesh: &TriangleMesh,
    checks: &mut Checks,
) -> Vec<Surface> {
    let names = || mesh.materials.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    for name in by_name.keys().filter(|name| !mesh.materials.contains(name)) {
        let detail = format!("the mesh has no material of this name; its materials are {}", names());
        checks.refuse(format!("{pointer}/surfaces/{}", escape(name)), detail);
    }
    let mut surfaces = Vec::with_capacity(mesh.materials.len());
    for name in &mesh.materials {
        match by_name.get(name).and_then(SurfaceDocument::surface) {
            Some(surface) => surfaces.push(surface),
            None => {
                let detail = format!("needs a surface for the mesh's material {name:?}; its materials are {}", names());
                checks.refuse(format!("{pointer}/surfaces"), detail);
            }
        }
    }
    surfaces
}

fn check_extent(
    pointer: &str,
    object: &MeshObjectDocument,
    mesh: &TriangleMesh,
    enclosure: &Enclosure,
    checks: &mut Checks,
) {
    let unit = format!("with the unit `{}`", object.unit);
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
