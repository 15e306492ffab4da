//! Job documents: those with renders by others' programs, and rooms as users write them.

use serde_json::{Value, json};
use skyduct::document::{JobDocument, to_scene};
use skyduct::scene::Scene;

use super::super::row::{Mirrors, Row, cornell, traced};
use crate::documents::Folder;
use crate::reference;

fn scene(document: &Value) -> Scene {
    to_scene(&JobDocument::parse(document.to_string().as_bytes()).unwrap(), &Folder).unwrap().0
}

/// A reference scene against its grid by an independent light tracer.
fn reference_scene(name: &str, truth: &str, estimate: &str, bound: f64) -> Row {
    let mut document = reference::json(&format!("scenes/{name}.json"));
    document["grids"][0]["estimate"] = estimate.into();
    Row::new(scene(&document)).given(traced(truth), bound)
}

pub fn s1_points() -> Row {
    reference_scene("S1", "S1.exact.point", "point", 0.0)
}

pub fn s1_cells() -> Row {
    reference_scene("S1", "S1.exact.cell_average", "cell_average", 0.0)
}

pub fn s2_points() -> Row {
    reference_scene("S2", "S2.exact.point", "point", 0.0)
}

pub fn s2_cells() -> Row {
    reference_scene("S2", "S2.exact.cell_average", "cell_average", 0.0)
}

/// The reference's tube has 96 facets that leave its area as it is: light meets them 1 / cos(pi / 96) times as often as the
/// cylinder, and loses 2 % each of at most 20 times.
fn facets() -> f64 {
    0.02 * 20.0 * (1.0 / (std::f64::consts::PI / 96.0).cos() - 1.0)
}

pub fn s3_points() -> Row {
    reference_scene("S3", "S3.mesh.point", "point", facets())
}

pub fn s3_cells() -> Row {
    reference_scene("S3", "S3.mesh.cell_average", "cell_average", facets())
}

pub fn s3_mesh_points() -> Row {
    // rays among facets take a time of their own
    reference_scene("S3_mesh", "S3.mesh.point", "point", 0.0).work(0.25)
}

pub fn s3_mesh_cells() -> Row {
    reference_scene("S3_mesh", "S3.mesh.cell_average", "cell_average", 0.0).work(0.25)
}

/// The Cornell box against means over blocks by a public path tracer and light tracer, which differ by 0.13 %.
pub fn cornell_box() -> Row {
    let mut document = reference::json("scenes/S4.json");
    document["views"][0]["size_px"] = json!([64, 64]);
    Row::new(scene(&document)).given(cornell(8), 0.0013)
}

/// A room of 3 x 2.5 x 2.4 m under a clear sky, with a tube and a sun of 40 klx.
fn room() -> Value {
    json!({
        "sky": {
            "cie_type": 12, "sun_position": { "altitude_deg": 50, "azimuth_deg": 200 },
            "zenith_luminance_cd_m2": 4000, "direct_normal_illuminance_lux": 40000
        },
        "room": { "size_m": [3.0, 2.5, 2.4], "surfaces": {
            "floor": { "reflectance": 0.3 }, "walls": { "reflectance": 0.5 }, "ceiling": { "reflectance": 0.7 }
        } },
        "tubes": [{
            "centre_m": [1.2, 1.3], "diameter_m": 0.3, "reflectance": 0.97, "segments": [{ "length_m": 0.8 }],
            "collector": { "kind": "dome", "transmittance": 0.9 },
            "diffuser": { "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.3 }
        }],
        "grids": [{ "name": "grid", "height_m": 0.8, "cells": [4, 4], "margin_m": 0.05, "estimate": "point" }]
    })
}

pub fn glossy_walls() -> Row {
    let mut document = room();
    document["room"]["surfaces"]["walls"] = json!({ "reflectance": 0.2, "specular": 0.5, "roughness": 0.3 });
    Row::new(scene(&document))
}

/// A mirror that stands in the sun: photons alone find what it shows.
pub fn mirror_in_the_sun() -> Row {
    let mut document = room();
    document["room"]["objects"] = json!([{
        "kind": "box", "size_m": [0.8, 0.1, 1.6], "position_m": [1.5, 2.2, 0], "rotation_deg": 15,
        "surface": { "reflectance": 0.05, "specular": 0.85 }
    }]);
    document["grids"][0]["estimate"] = "cell_average".into();
    Row::new(scene(&document)).stored(&["light_tracing", "photon_mapping"]).mirrors(Mirrors::LeftOut)
}

pub fn furniture() -> Row {
    let mut document = room();
    document["room"]["objects"] = json!([
        { "kind": "box", "size_m": [1.2, 0.7, 0.75], "position_m": [0.9, 0.8, 0], "rotation_deg": 20,
          "surface": { "reflectance": 0.6 } },
        { "kind": "box", "size_m": [0.5, 0.4, 1.9], "position_m": [2.5, 2.1, 0], "rotation_deg": 0,
          "surface": { "reflectance": 0.4 } },
        { "kind": "mesh", "mesh": "block.obj", "unit": "cm", "position_m": [2.2, 0.6, 0], "rotation_deg": 30,
          "surfaces": { "side": { "reflectance": 0.5 }, "top": { "reflectance": 0.3 } } }
    ]);
    document["grids"][0]["estimate"] = "cell_average".into();
    Row::new(scene(&document))
}

pub fn two_tubes() -> Row {
    let mut document = room();
    let mut second = document["tubes"][0].clone();
    second["centre_m"] = json!([2.3, 0.8]);
    second["segments"] = json!([{ "length_m": 0.4 }, { "length_m": 0.5, "tilt_deg": 40, "azimuth_deg": 120 }]);
    document["tubes"].as_array_mut().unwrap().push(second);
    Row::new(scene(&document))
}

pub fn measured_diffuser() -> Row {
    let mut document = room();
    document["tubes"][0]["diffuser"] = json!({
        "kind": "measured", "incidence_deg": [0, 30, 60, 90], "exit_deg": [0, 30, 60, 90],
        "btdf_per_sr": [[0.6, 0.2, 0.05, 0.0], [0.4, 0.25, 0.05, 0.0], [0.15, 0.15, 0.1, 0.05], [0.03, 0.03, 0.03, 0.03]]
    });
    Row::new(scene(&document))
}

/// The block of `images::mesh_block_*` or a box of the same shape, under a panel, with a view of all.
fn block(object: &Value, height_m: f64, estimate: &str) -> Scene {
    scene(&json!({
        "room": {
            "size_m": [3.0, 2.5, 2.2],
            "objects": [object],
            "luminaires": [{ "kind": "rectangle", "corner_m": [1.2, 0.9, 2.1], "edge_u_m": [0, 0.5, 0],
                             "edge_v_m": [0.6, 0, 0], "luminance_cd_m2": 3000 }]
        },
        "grids": [{ "name": "floor", "height_m": height_m, "cells": [6, 5], "estimate": estimate }],
        "views": [{ "name": "room", "eye_m": [0.2, 0.2, 1.9], "look_at_m": [1.5, 1.3, 0.2], "up": [0, 0, 1],
                    "vertical_fov_deg": 60, "size_px": [48, 40] }]
    }))
}

/// The same block as 12 triangles, of which two are a hair brighter, as a cuboid of one surface would be traced as a box, and as a box, in this
/// order, with a grid and a view.
pub fn mesh_and_box(height_m: f64, estimate: &str) -> [Scene; 2] {
    let [grey, brighter] = [0.6, 0.6 + 1e-9].map(|reflectance| json!({ "reflectance": reflectance }));
    let mesh = json!({ "kind": "mesh", "mesh": "block.obj", "unit": "cm", "position_m": [1.2, 1.2, 0],
                       "rotation_deg": 25, "surfaces": { "side": grey, "top": brighter } });
    let block_of_box = json!({ "kind": "box", "size_m": [0.6, 0.4, 0.5], "position_m": [1.2, 1.2, 0],
                               "rotation_deg": 25, "surface": grey });
    [mesh, block_of_box].map(|object| block(&object, height_m, estimate))
}
