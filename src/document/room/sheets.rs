//! Mesh objects with coincident faces: every part of a plane is reduced to one sheet, of one object.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::document::errors::Checks;
use crate::geometry::TriangleMesh;
use crate::geometry::coincident::{Overlap, TooMany, overlaps, rounding};
use crate::geometry::facets::pieces;
use crate::geometry::sheets::{Contact, Sheets, Undetermined, apart};
use crate::geometry::welded;
use crate::optics::Surface;
use crate::scene::{Enclosure, EnclosureFace, MeshObject};

/// Reduces coincident triangles of the objects in a room to single sheets. `numbers` are those of the objects in
/// the document, and `overlapping` the triangles of each that may overlap others of the same object, by their indices. Adds a fault where
/// two materials face the same side. Returns which objects have changed.
///
/// Faces of two closed bodies that touch from outside are both kept. An open surface hides what it covers of a closed body, and
/// of closed bodies with flush faces the first one's face is kept.
pub fn one_sheet_each(
    objects: &mut [MeshObject],
    (numbers, overlapping): (&[usize], &[Vec<u32>]),
    enclosure: &Enclosure,
    checks: &mut Checks,
) -> Vec<bool> {
    let mut all = Sheets::default();
    let (mut surfaces, mut owners): (Vec<Surface>, Vec<usize>) = (Vec::new(), Vec::new());
    for (owner, object) in objects.iter().enumerate() {
        all.add(&object.mesh, surfaces.len() as u32);
        owners.resize(all.triangles.len(), owner);
        surfaces.extend(&object.surfaces);
    }
    all.sources = (0..all.triangles.len() as u32).collect();
    let near = rounding(&all.positions, &all.triangles);
    let mut changed = vec![false; objects.len()];
    let told = overlaps_of_objects(&all, (&owners, overlapping), near).map_err(Undetermined::from).and_then(|found| {
        if found.is_empty() {
            return Ok(None);
        }
        let closed = closed(objects, enclosure, near);
        let is_closed = |number: u32| closed[number as usize];
        let meeting = |first: u32, second: u32, turned: bool| match (is_closed(first), is_closed(second)) {
            (true, true) if turned => Contact::Apart,
            (false, false) => Contact::OneSheet,
            _ => Contact::Hidden,
        };
        if found.iter().all(|pair| meeting(pair.triangles[0], pair.triangles[1], pair.turned) == Contact::Apart) {
            return Ok(None);
        }
        for pair in &found {
            let [first, second] = pair.triangles;
            if meeting(first, second, pair.turned) != Contact::Apart {
                pair.triangles.iter().for_each(|number| changed[owners[*number as usize]] = true);
            }
        }
        let is_same = |a: u32, b: u32| surfaces[a as usize] == surfaces[b as usize];
        apart(all.clone(), &found, near, |number| u8::from(is_closed(number)), meeting, is_same).map(Some)
    });
    match told {
        Ok(None) => {}
        Ok(Some(sheets)) => hand_back(objects, &owners, &sheets),
        Err(Undetermined::Contradiction { triangles, at }) => {
            let [one, other] = triangles.map(|number| {
                let owner = owners[number as usize];
                let first = owners.partition_point(|of| *of < owner);
                let mesh = &objects[owner].mesh;
                let name = &mesh.materials[mesh.triangle_materials[number as usize - first] as usize];
                (numbers[owner], name)
            });
            let detail = format!(
                "a polygon of the material {:?} lies on one of /room/objects/{} of the material {:?} that faces the \
                 same side, at {}, so that it is undefined which one is seen: remove one of them; {ONE_SIDE}",
                other.1,
                one.0,
                one.1,
                place(at)
            );
            checks.refuse(format!("/room/objects/{}/mesh", other.0), detail);
        }
        Err(Undetermined::TooMany(reason)) => checks.refuse("/room/objects", reason.to_string()),
    }
    changed
}

/// Returns the pairs of triangles that overlap. Only triangles that may overlap others of their object, and those within the bounds of
/// other objects, are tested.
fn overlaps_of_objects(
    all: &Sheets,
    (owners, overlapping): (&[usize], &[Vec<u32>]),
    near: f64,
) -> Result<Vec<Overlap>, TooMany> {
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| all.positions[corner as usize]);
    let mut bounds: Vec<[DVec3; 2]> = Vec::new();
    for (triangle, owner) in all.triangles.iter().zip(owners) {
        bounds.resize(bounds.len().max(owner + 1), [DVec3::INFINITY, DVec3::NEG_INFINITY]);
        let [low, high] = &mut bounds[*owner];
        for corner in corners(triangle) {
            (*low, *high) = (low.min(corner), high.max(corner));
        }
    }
    let touch = |a: [DVec3; 2], b: [DVec3; 2]| ((a[0] - near).cmple(b[1]) & (b[0] - near).cmple(a[1])).all();
    let others_of = |(one, own): (usize, &[DVec3; 2])| -> Vec<[DVec3; 2]> {
        let others = bounds.iter().enumerate().filter(|(other, _)| *other != one);
        others.map(|(_, other)| *other).filter(|other| touch(*own, *other)).collect()
    };
    let others: Vec<Vec<[DVec3; 2]>> = bounds.iter().enumerate().map(others_of).collect();
    let mut is_asked = vec![false; all.triangles.len()];
    for (owner, own) in overlapping.iter().enumerate() {
        let first = owners.partition_point(|of| *of < owner);
        own.iter().for_each(|number| is_asked[first + *number as usize] = true);
    }
    let meets_another = |number: &u32| {
        let [a, b, c] = corners(&all.triangles[*number as usize]);
        let own = [a.min(b).min(c), a.max(b).max(c)];
        let owner = owners[*number as usize];
        is_asked[*number as usize] || others[owner].iter().any(|other| touch(own, *other))
    };
    let asked: Vec<u32> = (0..all.triangles.len() as u32).filter(meets_another).collect();
    let triangles: Vec<[u32; 3]> = asked.iter().map(|number| all.triangles[*number as usize]).collect();
    let mut found = overlaps(&all.positions, &triangles, near)?;
    found.iter_mut().for_each(|pair| pair.triangles = pair.triangles.map(|place| asked[place as usize]));
    Ok(found)
}

/// Rule for the side that a polygon faces, appended to errors about coincident polygons of two materials.
const ONE_SIDE: &str = "a polygon faces the side from which its corners run counter-clockwise";

/// Returns the reason, as a sentence, why a mesh with contradictory polygons is refused.
pub fn undetermined_words(undetermined: Undetermined, mesh: &TriangleMesh) -> String {
    match undetermined {
        Undetermined::TooMany(reason) => reason.to_string(),
        Undetermined::Contradiction { triangles, at } => {
            let [one, other] =
                triangles.map(|number| &mesh.materials[mesh.triangle_materials[number as usize] as usize]);
            format!(
                "polygons of the materials {one:?} and {other:?} lie on each other and face the same side, at {}, so \
                 that it is undefined which one is seen: remove one of them; {ONE_SIDE}",
                place(at)
            )
        }
    }
}

fn place(DVec3 { x, y, z }: DVec3) -> String {
    format!("({x:.4}, {y:.4}, {z:.4}) m")
}

/// Returns for each triangle of all objects whether it belongs to a closed body, where an even number of triangles meets at every
/// edge that does not lie in a face of the room.
fn closed(objects: &[MeshObject], enclosure: &Enclosure, near: f64) -> Vec<bool> {
    let mut closed = Vec::new();
    for MeshObject { mesh, .. } in objects {
        let places = welded::places(&mesh.positions);
        let triangles: Vec<[u32; 3]> =
            mesh.triangles.iter().map(|triangle| triangle.map(|corner| places[corner as usize])).collect();
        let mut at = vec![DVec3::ZERO; mesh.positions.len()];
        places.iter().zip(&mesh.positions).for_each(|(place, position)| at[*place as usize] = *position);
        let piece = pieces(mesh.positions.len(), &triangles);
        let mut is_open: BTreeMap<u32, bool> = BTreeMap::new();
        for edge in welded::sides((0..).zip(triangles.iter().copied())).chunk_by(|a, b| a.edge == b.edge) {
            let Some(first) = edge.first() else { continue };
            let ends = first.edge.map(|end| at[end as usize]);
            let on = |face: &EnclosureFace| ends.iter().all(|end| face.polygon.distance(*end) <= near);
            let on_face = || enclosure.faces().iter().any(on);
            *is_open.entry(piece[first.triangle as usize]).or_default() |= edge.len() % 2 == 1 && !on_face();
        }
        closed.extend(piece.iter().map(|piece| !is_open[piece]));
    }
    closed
}

/// Replaces the triangles of each object by its triangles of `sheets`; `owners` are the objects of the triangles before the
/// reduction.
fn hand_back(objects: &mut [MeshObject], owners: &[usize], sheets: &Sheets) {
    let kinds: Vec<(usize, u32)> = objects
        .iter()
        .enumerate()
        .flat_map(|(owner, object)| (0..object.surfaces.len() as u32).map(move |kind| (owner, kind)))
        .collect();
    let surfaces: Vec<Surface> = objects.iter().flat_map(|object| object.surfaces.iter().copied()).collect();
    for (owner, object) in objects.iter_mut().enumerate() {
        let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
        let mesh = &mut object.mesh;
        mesh.positions.clear();
        mesh.triangles.clear();
        let mut sides = Vec::new();
        let own = |number: &usize| owners[sheets.sources[*number] as usize] == owner;
        for number in (0..sheets.triangles.len()).filter(own) {
            mesh.triangles.push(sheets.triangles[number].map(|corner| {
                *numbers.entry(corner).or_insert_with(|| {
                    mesh.positions.push(sheets.positions[corner as usize]);
                    mesh.positions.len() as u32 - 1
                })
            }));
            sides.push(sheets.sides[number].map(|kind| {
                let (of, own_kind) = kinds[kind as usize];
                if of == owner {
                    return own_kind;
                }
                // the other side belongs to another object
                let surface = surfaces[kind as usize];
                let known = object.surfaces.iter().position(|own| *own == surface);
                known.unwrap_or_else(|| {
                    object.surfaces.push(surface);
                    mesh.materials.push(String::new());
                    object.surfaces.len() - 1
                }) as u32
            }));
        }
        mesh.set_sides(sides.into_iter());
    }
}
