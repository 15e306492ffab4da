//! Mesh tubes: conversion of their meshes, and checks against their parts and openings.

use std::sync::Arc;

use glam::DVec3;

use super::MeshTubeDocument;
use super::part::{CollectorPart, PartDocument};
use crate::document::errors::Checks;
use crate::document::file_source::FileSource;
use crate::document::frame::{FileFrame, Up, hint_at_other_axis};
use crate::document::limits::COORDINATE_M;
use crate::document::read::pointer::escape;
use crate::document::room::sheets::undetermined_words;
use crate::geometry::TriangleMesh;
use crate::geometry::coincident::{Overlap, overlaps, rounding};
use crate::geometry::repeats::rounded;
use crate::geometry::sheets::{Contact, Sheets, Undetermined, apart};
use crate::guide::mesh::Part;
use crate::guide::{inner_materials, recognise};
use crate::optics::Diffuser;
use crate::scene::MeshTube;

/// Largest distance of a diffuser from the plane of the ceiling, and of a pipe or collector below it, as a fraction of the
/// opening's diameter.
const PLANE_TOLERANCE: f64 = 1e-3;

/// Returns the tube at `pointer`, scaled to metres, and its closure; `None` after an error.
pub(crate) fn mesh_tube(
    pointer: &str,
    document: &MeshTubeDocument,
    meshes: &dyn FileSource,
    checks: &mut Checks,
) -> Option<(MeshTube, Diffuser)> {
    let in_file_units = match meshes.load(&document.mesh) {
        Ok(mesh) => mesh,
        Err(detail) => {
            checks.refuse(format!("{pointer}/mesh"), detail);
            return None;
        }
    };
    let errors_before = checks.errors.len();
    let upright =
        |up: Up| FileFrame { offset: DVec3::ZERO, metres: document.unit.metres(), up }.upright(&in_file_units);
    let mesh = upright(document.up);
    let parts = parts(pointer, document, &mesh, checks);
    let errors_of_names = checks.errors.len();
    check_extent(pointer, document, &mesh, &parts, checks);
    hint_at_other_axis(&mut checks.errors[errors_of_names..], document.up, |up| {
        let mut trial = Checks::default();
        check_extent(pointer, document, &upright(up), &parts, &mut trial);
        trial.errors.is_empty()
    });
    let closure = document.parts.values().find_map(|part| match part {
        PartDocument::Diffuser(document) => Some(document.diffuser()),
        _ => None,
    });
    if checks.errors.len() > errors_before {
        return None;
    }
    let mesh = match one_sheet_each(&mesh, &parts) {
        Ok(once) => once.unwrap_or(mesh),
        Err(undetermined) => {
            checks.refuse(format!("{pointer}/mesh"), undetermined_words(undetermined, &mesh));
            return None;
        }
    };
    Some({
        let judge = if document.recognise { recognise::recognise } else { recognise::keep_facets };
        let section = judge(&mesh, &parts, 0.5 * document.opening_diameter_m);
        let rotation = document.rotation_deg.to_radians();
        let tube = MeshTube { mesh: Arc::new(mesh), parts, rotation, section };
        (tube, closure.unwrap_or(Diffuser::Open))
    })
}

/// Returns the mesh without coincident triangles, where each triangle has the material of its inner side; `None` if the mesh has
/// no coincident triangles.
///
/// Keeps the pipe if a pipe and a collector coincide.
fn one_sheet_each(mesh: &TriangleMesh, parts: &[Part]) -> Result<Option<TriangleMesh>, Undetermined> {
    let near = rounding(&mesh.positions, &mesh.triangles);
    let part = |number: u32| &parts[mesh.triangle_materials[number as usize] as usize];
    let is_pipe = |number: u32| matches!(part(number), Part::Pipe { .. });
    let is_traced = |number: &u32| *part(*number) != Part::Diffuser;
    let mut found = overlaps(&mesh.positions, &mesh.triangles, near)?;
    found.retain(|pair| pair.triangles.iter().all(is_traced));
    if found.is_empty() {
        return Ok(None);
    }
    for Overlap { triangles: [a, b], .. } in &found {
        // a collector has the same optics from either side
        if !is_pipe(*a) && !is_pipe(*b) && part(*a) != part(*b) {
            let corners = mesh.triangles[*b as usize].map(|corner| mesh.positions[corner as usize]);
            return Err(Undetermined::Contradiction { triangles: [*a, *b], at: corners.iter().sum::<DVec3>() / 3.0 });
        }
    }
    let given = Sheets {
        positions: rounded(&mesh.positions, near),
        triangles: mesh.triangles.clone(),
        sides: (0..mesh.triangles.len()).map(|number| mesh.sides(number)).collect(),
        sources: (0..mesh.triangles.len() as u32).collect(),
    };
    let meeting = |a: u32, b: u32, _| if is_pipe(a) == is_pipe(b) { Contact::OneSheet } else { Contact::Hidden };
    let is_same = |a: u32, b: u32| parts[a as usize] == parts[b as usize];
    let sheets = apart(given, &found, near, |number| u8::from(!is_pipe(number)), meeting, is_same)?;
    let mut sources = sheets.sources;
    sources.dedup();
    let mut once = TriangleMesh {
        positions: sheets.positions,
        triangles: sheets.triangles,
        materials: mesh.materials.clone(),
        dropped: mesh.dropped,
        ..TriangleMesh::default()
    };
    once.set_sides(sheets.sides.into_iter());
    once.dropped.repeated += mesh.triangles.len() - sources.len();
    Ok(Some(inner_materials::of_inner_materials(once, parts)))
}

/// Returns the part of each material of the mesh; adds a fault for each material or part whose name has no counterpart.
fn parts(pointer: &str, document: &MeshTubeDocument, mesh: &TriangleMesh, checks: &mut Checks) -> Vec<Part> {
    let names = || mesh.materials.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    for name in document.parts.keys().filter(|name| !mesh.materials.contains(name)) {
        let detail = format!("the mesh has no material of this name; its materials are {}", names());
        checks.refuse(format!("{pointer}/parts/{}", escape(name)), detail);
    }
    let mut parts = Vec::with_capacity(mesh.materials.len());
    for name in &mesh.materials {
        let part = match document.parts.get(name) {
            Some(PartDocument::Collector(CollectorPart { transmittance, reflectance })) => {
                Part::Collector { transmittance: transmittance.rgb(), reflectance: reflectance.rgb() }
            }
            Some(PartDocument::Pipe(part)) => Part::Pipe { reflectance: part.reflectance.mirror() },
            Some(PartDocument::Diffuser(_)) => Part::Diffuser,
            None => {
                let detail = format!("needs a part for the mesh's material {name:?}; its materials are {}", names());
                checks.refuse(format!("{pointer}/parts"), detail);
                continue;
            }
        };
        parts.push(part);
    }
    parts
}

fn check_extent(pointer: &str, document: &MeshTubeDocument, mesh: &TriangleMesh, parts: &[Part], checks: &mut Checks) {
    let unit = format!("with the unit `{}`", document.unit);
    if mesh.positions.iter().flat_map(|p| p.to_array()).any(|coordinate| !COORDINATE_M.contains(coordinate)) {
        // such coordinates cannot be metres
        checks.refuse(format!("{pointer}/mesh"), format!("{unit}, coordinates must be {COORDINATE_M} m"));
        return;
    }
    let tolerance = PLANE_TOLERANCE * document.opening_diameter_m;
    let Some((lowest, highest)) = mesh.bounds() else {
        checks.refuse(format!("{pointer}/mesh"), "the mesh is empty");
        return;
    };
    if lowest.truncate().max_element() > 0.0 || highest.truncate().min_element() < 0.0 {
        let detail = format!(
            "{unit}, the mesh's origin must be the centre of the opening, but the mesh lies beside it, from ({}, {}) m \
             to ({}, {}) m: move the mesh",
            lowest.x, lowest.y, highest.x, highest.y
        );
        checks.refuse(format!("{pointer}/mesh"), detail);
    }
    if highest.z <= tolerance {
        let detail = format!("{unit}, the mesh must reach above z = 0, but ends at z = {} m", highest.z);
        checks.refuse(format!("{pointer}/mesh"), detail);
    }
    for (material, part) in parts.iter().enumerate() {
        let corners = || {
            let of_part = mesh.triangles.iter().zip(&mesh.triangle_materials);
            of_part
                .filter(move |(_, owner)| **owner as usize == material)
                .flat_map(|(triangle, _)| triangle.iter().map(|corner| mesh.positions[*corner as usize].z))
        };
        let name = &mesh.materials[material];
        let part_pointer = format!("{pointer}/parts/{}", escape(name));
        match part {
            Part::Diffuser => {
                let farthest = corners().fold(0.0, |farthest: f64, z| farthest.max(z.abs()));
                if farthest > tolerance {
                    let what = format!("{unit}, a diffuser {farthest} m away from the plane z = 0 of the ceiling");
                    checks.not_supported(part_pointer, what);
                }
            }
            Part::Pipe { .. } | Part::Collector { .. } => {
                let lowest = corners().fold(f64::INFINITY, f64::min);
                if lowest < -tolerance {
                    let detail = format!(
                        "{unit}, no part may hang below the ceiling z = 0, but this one reaches down to z = {lowest} m"
                    );
                    checks.refuse(part_pointer, detail);
                }
            }
        }
    }
}
