//! Good documents, changed in places, and what becomes of bad ones.

use std::sync::Arc;

use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, FieldError, FieldErrorCode, FileSource, to_scene};
use skyduct::geometry::TriangleMesh;

/// The thesis' room with every field that the engine can do.
pub fn base() -> Value {
    json!({
        "name": "base",
        "sky": {
            "cie_type": 12,
            "sun_position": { "altitude_deg": 35, "azimuth_deg": 225 },
            "zenith_luminance_cd_m2": 5000,
            "direct_normal_illuminance_lux": 0
        },
        "room": {
            "size_m": [2.032, 2.032, 2.032],
            "rotation_deg": 0,
            "surfaces": {
                "floor": { "reflectance": 0.2 },
                "walls": { "reflectance": 0.5 },
                "ceiling": { "reflectance": 0.7 }
            },
            "objects": [
                { "kind": "box", "size_m": [0.6, 0.6, 0.75], "position_m": [0.5, 0.5, 0], "rotation_deg": 0,
                  "surface": { "reflectance": 0.5 } }
            ]
        },
        "tubes": [{
            "centre_m": [1.016, 1.016],
            "diameter_m": 0.254,
            "reflectance": 0.98,
            "segments": [{ "length_m": 1.0 }, { "length_m": 0.5, "tilt_deg": 45, "azimuth_deg": 90 }],
            "collector": { "kind": "dome", "transmittance": 0.92 },
            "diffuser": { "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.0 }
        }],
        "grids": [{ "name": "workplane", "height_m": 0.85, "cells": [9, 9], "margin_m": 0.0, "estimate": "point" }],
        "views": [{ "name": "room", "eye_m": [1.9, 0.1, 1.6], "look_at_m": [1.0, 1.2, 0.8], "up": [0, 0, 1],
                    "vertical_fov_deg": 60, "size_px": [512, 512] }],
        "method": { "kind": "sppm", "photons_per_pass": 100000, "initial_radius_m": 0.00762, "alpha": 0.8 },
        "stop": { "relative_error": 0.02, "confidence": 0.95, "max_passes": 4096, "max_seconds": 600 },
        "effects": { "glossy": "off" },
        "seed": 0
    })
}

/// A straight four-sided pipe of 0.2 m x 0.2 m and 1 m with a cover and a diffuser.
pub struct SquarePipe;

impl FileSource for SquarePipe {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        if id != "pipe" {
            return Err(format!("no mesh has the id {id:?}"));
        }
        let corner = |k: usize| [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]][k % 4];
        let at = |k: usize, z: f64| glam::DVec3::new(corner(k)[0], corner(k)[1], z);
        let positions = (0..4).map(|k| at(k, 0.0)).chain((0..4).map(|k| at(k, 1.0))).collect();
        let mut triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let mut triangle_materials = vec![0, 0, 1, 1];
        for k in 0..4u32 {
            let next = (k + 1) % 4;
            triangles.extend([[k, next, next + 4], [k, next + 4, k + 4]]);
            triangle_materials.extend([2, 2]);
        }
        let materials = ["diffuser", "cover", "a/b"].map(str::to_owned).to_vec();
        Ok(Arc::new(TriangleMesh { positions, triangles, triangle_materials, materials, ..TriangleMesh::default() }))
    }
}

/// A tube of that pipe.
pub fn mesh_tube() -> Value {
    json!({
        "mesh": "pipe", "unit": "m", "centre_m": [1.016, 1.016], "opening_diameter_m": 0.254, "rotation_deg": 0,
        "parts": {
            "cover": { "role": "collector", "transmittance": 0.92, "reflectance": 0.05 },
            "a/b": { "role": "pipe", "reflectance": 0.98 },
            "diffuser": { "role": "diffuser", "kind": "lambertian", "transmittance": 0.6 }
        }
    })
}

/// Sets the value at `pointer`, whose parent must exist; `null` removes it.
pub fn with(mut document: Value, pointer: &str, value: Value) -> Value {
    let (parent, token) = pointer.rsplit_once('/').unwrap();
    let key = token.replace("~1", "/").replace("~0", "~");
    match document.pointer_mut(parent).unwrap_or_else(|| panic!("no {parent}")) {
        Value::Object(object) if value.is_null() => drop(object.remove(&key)),
        Value::Object(object) => drop(object.insert(key, value)),
        Value::Array(array) if key == "-" => array.push(value),
        Value::Array(array) => array[key.parse::<usize>().unwrap()] = value,
        _ => panic!("{parent} holds no fields"),
    }
    document
}

/// What is wrong with `document`, its meshes included.
pub fn errors(document: &Value) -> DocumentErrors {
    parse(document).and_then(|document| to_scene(&document, &SquarePipe)).map(drop).expect_err("a bad document")
}

/// The one error of `document`, which is at `pointer` and of this kind.
#[track_caller]
pub fn refused(document: &Value, pointer: &str, code: FieldErrorCode) -> FieldError {
    let mut errors = errors(document).0;
    assert_eq!(errors.len(), 1, "{errors:?}");
    let error = errors.remove(0);
    assert_eq!((error.pointer.as_str(), error.code), (pointer, code), "{error}");
    error
}
