//! Rooms with furniture, as they are built: documents of the benchmarks.

use glam::DVec3;
use serde_json::{Value, json};

use super::case::Case;
use super::meshes;
use super::scenes::ROOM_M;
use skyduct::geometry::TriangleMesh;

/// Number of squares along an edge of the faces of a chair's boards: 1152 triangles.
const NET: u32 = 4;

/// Number of squares along an edge of the faces, for the chairs that [`one_mesh`] joins.
const NET_OF_MANY: u32 = 12;

/// Kind of the diffusers and sensors of a room with tubes.
#[derive(Clone, Copy)]
pub struct Kind {
    /// True for mixed diffusers, Lambertian in the middle and clear around it, in the sun; else they are Lambertian, under an
    /// overcast sky.
    pub mixed_in_the_sun: bool,
    /// True for averages over cells instead of values at points.
    pub cells: bool,
}

/// Points below Lambertian diffusers.
pub const USUAL: Kind = Kind { mixed_in_the_sun: false, cells: false };

fn tube([x, y]: [f64; 2], diameter: f64, length: f64, kind: Kind) -> Value {
    let diffuser = match kind.mixed_in_the_sun {
        true => json!({ "kind": "mixed", "lambertian_radius_m": 0.3 * diameter, "inner": "lambertian",
                        "lambertian_transmittance": 0.7, "clear_transmittance": 0.88 }),
        false => json!({ "kind": "lambertian", "transmittance": 0.7, "reflectance": 0.2 }),
    };
    json!({
        "centre_m": [x, y], "diameter_m": diameter, "reflectance": 0.98, "segments": [{ "length_m": length }],
        "collector": { "kind": "dome", "transmittance": 0.92 }, "diffuser": diffuser,
    })
}

/// Returns a regular grid of tubes over a floor.
fn tubes([width, depth]: [f64; 2], [columns, rows]: [u32; 2], (diameter, length): (f64, f64), kind: Kind) -> Value {
    let at = |side: f64, k: u32, of: u32| side * (f64::from(k) + 0.5) / f64::from(of);
    let places = (0..columns).flat_map(|i| (0..rows).map(move |j| [at(width, i, columns), at(depth, j, rows)]));
    places.map(|place| tube(place, diameter, length, kind)).collect()
}

/// Returns the document of a room with sensors at a height, about `step` m apart.
fn room(size: [f64; 3], tubes: Value, objects: Vec<Value>, (height, step): (f64, f64), kind: Kind) -> Value {
    let [width, depth, _] = size;
    let cells = [width, depth].map(|side| (side / step).round() as u32);
    let sky = match kind.mixed_in_the_sun {
        true => json!({ "cie_type": 12, "luminous_turbidity": 4.0 }),
        false => json!({ "cie_type": 1 }),
    };
    json!({
        "location": { "latitude_deg": 50.08, "longitude_deg": 14.42 }, "time": "2026-06-21T11:00:00+02:00", "sky": sky,
        "room": {
            "size_m": size, "objects": objects,
            "surfaces": { "floor": { "reflectance": 0.25 }, "walls": { "reflectance": 0.55 }, "ceiling": { "reflectance": 0.8 } },
        },
        "tubes": tubes,
        "grids": [{
            "name": "grid", "height_m": height, "cells": cells,
            "estimate": if kind.cells { "cell_average" } else { "point" },
        }],
    })
}

fn chair_at(x: f64, y: f64, rotation_deg: f64) -> Value {
    json!({
        "kind": "mesh", "mesh": "chair.obj", "unit": "m", "position_m": [x, y, 0.0], "rotation_deg": rotation_deg,
        "surfaces": { "wood": { "reflectance": 0.3 } },
    })
}

/// Returns an office of 20 x 30 m with 40 tubes and 2400 points, empty or with 60 desks and 60 bent chairs.
pub fn office(furnished: bool, kind: Kind) -> Case {
    let (width, depth) = (20.0, 30.0);
    let places = (0..6_u32).flat_map(|i| (0..10_u32).map(move |j| (i, j))).filter(|_| furnished);
    let objects = places.flat_map(|(i, j)| {
        let (x, y) = (width * (f64::from(i) + 0.5) / 6.0, depth * (f64::from(j) + 0.5) / 10.0);
        let desk = json!({ "kind": "box", "size_m": [1.6, 0.8, 0.74], "position_m": [x, y, 0.0], "surface": { "reflectance": 0.4 } });
        [desk, chair_at(x - 0.1, y - 1.1, f64::from((37 * i + 53 * j) % 60) - 30.0)]
    });
    let tubes = tubes([width, depth], [5, 8], (0.53, 1.5), kind);
    Case::with(room([width, depth, 3.0], tubes, objects.collect(), (0.85, 0.5), kind), meshes::bent_chair(NET))
}

/// Returns a corridor of 2 x 40 m with 8 tubes.
pub fn corridor() -> Case {
    let tubes = tubes([2.0, 40.0], [1, 8], (0.35, 1.2), USUAL);
    Case::with(room([2.0, 40.0, 2.7], tubes, Vec::new(), (0.1, 0.5), USUAL), TriangleMesh::default())
}

/// Returns a hall of 50 x 80 x 12 m with 64 tubes, 4000 points, and 8 racks of 60 m length and 8 m height.
pub fn warehouse() -> Case {
    let rack = |k: u32| {
        json!({ "kind": "box", "size_m": [1.0, 60.0, 8.0], "position_m": [50.0 * (f64::from(k) + 0.5) / 8.0 + 0.017, 40.0, 0.0],
                "surface": { "reflectance": 0.3 } })
    };
    let tubes = tubes([50.0, 80.0], [8, 8], (0.9, 2.0), USUAL);
    Case::with(room([50.0, 80.0, 12.0], tubes, (0..8).map(rack).collect(), (0.0, 1.0), USUAL), TriangleMesh::default())
}

/// Returns a bathroom with glossy tiles, a mirror, a shower box and a cupboard.
pub fn bathroom() -> Case {
    let tiles = json!({ "reflectance": 0.6, "specular": 0.06, "roughness": 0.15 });
    let objects = vec![
        json!({ "kind": "box", "size_m": [1.2, 0.02, 0.9], "position_m": [1.1, 2.985, 1.1],
                "surface": { "reflectance": 0.0, "specular": 0.9 } }),
        json!({ "kind": "box", "size_m": [0.9, 0.9, 2.0], "position_m": [2.0, 0.5, 0.0],
                "surface": { "reflectance": 0.05, "specular": 0.3 } }),
        json!({ "kind": "box", "size_m": [0.6, 0.45, 0.85], "position_m": [1.1, 2.7, 0.0],
                "surface": { "reflectance": 0.7, "specular": 0.05, "roughness": 0.1 } }),
    ];
    let tube = json!([tube([1.0, 1.7], 0.35, 1.1, USUAL)]);
    let mut document = room([2.6, 3.2, 2.5], tube, objects, (0.9, 0.2), USUAL);
    document["room"]["surfaces"]["floor"] = json!({ "reflectance": 0.35, "specular": 0.06, "roughness": 0.2 });
    document["room"]["surfaces"]["walls"] = tiles;
    document["grids"][0]["margin_m"] = json!(0.1);
    Case::with(document, TriangleMesh::default())
}

/// Returns a room of 10 x 12 m with 9 tubes and one mesh of 28 bent chairs: 290 304 triangles.
pub fn one_mesh() -> Case {
    let (width, depth) = (10.0, 12.0);
    let chair = meshes::bent_chair(NET_OF_MANY);
    let mut all = TriangleMesh { materials: chair.materials.clone(), ..TriangleMesh::default() };
    for (i, j) in (0..4_u32).flat_map(|i| (0..7_u32).map(move |j| (i, j))) {
        let at = DVec3::new(width * (f64::from(i) + 0.4) / 4.0, depth * (f64::from(j) + 0.4) / 7.0, 0.003);
        let first = all.positions.len() as u32;
        all.positions.extend(chair.positions.iter().map(|corner| *corner + at));
        all.triangles.extend(chair.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
        all.triangle_materials.extend(&chair.triangle_materials);
    }
    let tubes = tubes([width, depth], [3, 3], (0.53, 1.5), USUAL);
    let objects = vec![json!({
        "kind": "mesh", "mesh": "furniture.obj", "unit": "m", "position_m": [0.0, 0.0, 0.0],
        "surfaces": { "wood": { "reflectance": 0.3 } },
    })];
    Case::with(room([width, depth, 3.0], tubes, objects, (0.85, 0.5), USUAL), all)
}

/// Returns a view of 1280 x 720 pixels of the furnished office.
pub fn view() -> Case {
    let mut case = office(true, USUAL);
    case.document["grids"] = json!([]);
    case.document["views"] = json!([{
        "name": "view", "eye_m": [0.5, 0.5, 1.6], "look_at_m": [12.0, 18.0, 1.0], "vertical_fov_deg": 50, "size_px": [1280, 720],
    }]);
    case
}

/// Adds chairs, bent or of boards, to a room of the size of S1 with boxes.
pub fn with_chairs(mut case: Case, number: u32, bent: bool) -> Case {
    let chair = |k: u32| chair_at(ROOM_M * f64::from(k % 4) / 4.0 + 0.03, ROOM_M * f64::from(k / 4) / 2.0 + 0.3, 0.0);
    if let Some(Value::Array(objects)) = case.document.pointer_mut("/room/objects") {
        objects.extend((0..number).map(chair));
    }
    Case::with(case.document, if bent { meshes::bent_chair(NET) } else { meshes::chair(1) })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::scenes;
    use super::super::settings::Settings;
    use super::*;

    #[test]
    fn rooms_are_jobs() {
        let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference");
        let settings = Settings { quick: true, reference, beside: None };
        let boxes = || scenes::boxes(&settings, 20).unwrap();
        let mixed = Kind { mixed_in_the_sun: true, cells: true };
        let cases = [
            office(true, mixed),
            office(false, USUAL),
            corridor(),
            warehouse(),
            bathroom(),
            view(),
            with_chairs(boxes(), 3, true),
            with_chairs(boxes(), 8, false),
        ];
        for case in cases {
            let prepared = case.clone().to(0.05, 1.0).prepare();
            assert!(prepared.is_ok(), "{}: {}", case.document, prepared.err().unwrap());
        }
    }
}
