//! Small jobs, from the text of a document to the estimate.

use std::sync::Arc;

use serde_json::{Value, json};
use skyduct::document::{FileSource, JobDocument, WarningCode, to_scene};
use skyduct::engine::cancel::Stop;
use skyduct::engine::progress::StoppedBy;
use skyduct::estimate::Estimate;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::scene::Daylight;

/// One OBJ file, under every id.
pub struct Obj(pub String);

impl FileSource for Obj {
    fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
        parse_obj(self.0.as_bytes(), ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// A cube of 2.032 m with nine points on its floor, under a straight tube with a Lambertian diffuser; four small passes.
pub fn cube() -> Value {
    json!({
        "sky": { "cie_type": 12, "sun_position": { "altitude_deg": 35, "azimuth_deg": 225 } },
        "room": {
            "size_m": [2.032, 2.032, 2.032],
            "surfaces": { "floor": { "reflectance": 0.2 }, "walls": { "reflectance": 0.5 },
                          "ceiling": { "reflectance": 0.7 } }
        },
        "tubes": [{
            "centre_m": [1.016, 1.016], "diameter_m": 0.254, "reflectance": 0.98,
            "segments": [{ "length_m": 1.0 }], "collector": { "kind": "open" },
            "diffuser": { "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.2 }
        }],
        "grids": [{ "name": "floor", "height_m": 0, "cells": [3, 3] }],
        "method": { "kind": "light_tracing", "photons_per_pass": 1024 },
        "stop": { "relative_error": 1e-9, "max_passes": 4 }
    })
}

/// A document ready to render, with `obj` for all its meshes.
pub fn prepared_with(document: &Value, obj: &str) -> Prepared {
    let parsed = JobDocument::parse(document.to_string().as_bytes()).unwrap_or_else(|errors| panic!("{errors}"));
    prepare_document(&parsed, &Obj(obj.to_owned())).unwrap_or_else(|errors| panic!("{errors}"))
}

pub fn prepared(document: &Value) -> Prepared {
    prepared_with(document, "")
}

/// Renders a job to its end; every value of it is finite.
pub fn rendered(prepared: &Prepared) -> (Estimate, StoppedBy) {
    let rendered = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap();
    assert_eq!(rendered.estimate.first_not_finite(), None);
    (rendered.estimate, rendered.stopped_by)
}

/// Illuminances of the first grid in lux.
pub fn lux(estimate: &Estimate) -> Vec<f64> {
    (0..estimate.grids[0].sensors.len()).map(|sensor| estimate.grids[0].illuminance_lux(sensor)).collect()
}

/// Daylight of a document, the codes of its warnings and its provenance as JSON.
pub fn daylight(document: &Value) -> (Daylight, Vec<WarningCode>, Value) {
    let parsed = JobDocument::parse(document.to_string().as_bytes()).unwrap_or_else(|errors| panic!("{errors}"));
    let (scene, warnings, provenance) = to_scene(&parsed, &Obj(String::new())).unwrap();
    let codes = warnings.iter().map(|warning| warning.code).collect();
    (scene.daylight.unwrap(), codes, serde_json::to_value(provenance).unwrap())
}

/// A document at a place and time instead of a given position of the sun.
pub fn located(mut document: Value, latitude_deg: f64, longitude_deg: f64, time: &str) -> Value {
    document["sky"].as_object_mut().unwrap().remove("sun_position");
    document["location"] = json!({ "latitude_deg": latitude_deg, "longitude_deg": longitude_deg });
    document["time"] = json!(time);
    document
}
