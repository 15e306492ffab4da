//! Mesh objects: conversion of their meshes, and checks against their surfaces and the room.

use std::collections::BTreeMap;

use glam::DVec3;

use super::RoomDocument;
use super::object::{MeshObjectDocument, ObjectDocument};
use super::openings::cover_no_opening;
use super::sheets::{one_sheet_each, untold_words};
use super::surface::SurfaceDocument;
use crate::document::errors::Checks;
use crate::document::frame::{Up, hint_at_other_axis, upright};
use crate::document::hints;
use crate::document::limits::{MOST_TRIANGLES, TOUCHING_M};
use crate::document::mesh_source::MeshSource;
use crate::document::read::pointer::escape;
use crate::document::tube::TubeDocument;
use crate::geometry::TriangleMesh;
use crate::geometry::repeats::without_repeats;
use crate::geometry::turn::unit_vector;
use crate::optics::Surface;
use crate::scene::MeshObject;

/// Returns the mesh objects of a room, in its frame; after an error some may be missing.
pub(crate) fn mesh_objects(
    room: &RoomDocument,
    tubes: &[TubeDocument],
    meshes: &dyn MeshSource,
    checks: &mut Checks,
) -> Vec<MeshObject> {
    let (mut objects, mut numbers, mut on_themselves) = (Vec::new(), Vec::new(), Vec::new());
    let mut triangles = 0;
    for (index, object) in room.objects.iter().enumerate() {
        let pointer = format!("/room/objects/{index}");
        let ObjectDocument::Mesh(object) = object else { continue };
        let Some((object, lies_on_itself)) = mesh_object(&pointer, object, room.size_m, meshes, checks) else {
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
        cover_no_opening(room, tubes, &objects, &numbers, checks);
        one_sheet_each(&mut objects, (&numbers, &on_themselves), DVec3::from(room.size_m), checks);
    }
    objects
}

/// Returns the object at `pointer` in the frame of a room of `size_m`, and whether parts of its mesh lie on others; `None` after
/// an error.
fn mesh_object(
    pointer: &str,
    object: &MeshObjectDocument,
    size_m: [f64; 3],
    meshes: &dyn MeshSource,
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
    check_extent(pointer, object, &mesh, size_m, checks);
    hint_at_other_axis(&mut checks.errors[errors_of_names..], *up, |up| {
        let mut trial = Checks::default();
        check_extent(pointer, object, &place(up), size_m, &mut trial);
        trial.errors.is_empty()
    });
    if checks.errors.len() > errors_before {
        return None;
    }
    for position in &mut mesh.positions {
        // parts that touch a wall up to rounding must not reach behind it
        *position = position.clamp(DVec3::ZERO, DVec3::from(size_m));
    }
    let lies_on_itself = match without_repeats(&mesh, |a, b| surfaces[a as usize] == surfaces[b as usize]) {
        Ok(once) => {
            mesh = once.mesh.unwrap_or(mesh);
            once.lies_on_itself
        }
        Err(untold) => {
            checks.refuse(format!("{pointer}/mesh"), untold_words(untold, &mesh));
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
    size_m: [f64; 3],
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
    for (axis, size) in size_m.into_iter().enumerate() {
        let position = object.position_m[axis];
        // coordinates far from the origin are rounded more coarsely
        let slack = TOUCHING_M.max(8.0 * f64::EPSILON * position.abs());
        if low[axis] < -slack || high[axis] > size + slack {
            let pointer = format!("{pointer}/position_m/{axis}");
            let fits = |meant: f64| low[axis] - position + meant >= 0.0 && high[axis] - position + meant <= size;
            let hint = hints::of_number(&pointer, position, fits);
            let detail = format!(
                "{unit}, the mesh must be inside the room (0..{size} m), but reaches from {} m to {} m{hint}",
                low[axis], high[axis]
            );
            checks.refuse(pointer, detail);
        }
    }
}
