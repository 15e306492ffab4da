//! Scenes of the thesis as job documents.

use serde_json::{Value, json};

use super::printed;
use super::settings::Settings;
use crate::page::ReportError;

/// Side of the room, 80 inches, in metres.
pub const ROOM_M: f64 = 80.0 * printed::INCH_M;

/// Radius of the pipe, 5 inches, in metres.
pub const PIPE_RADIUS_M: f64 = 5.0 * printed::INCH_M;

/// Reflectance of the ceiling of the room without colours.
pub const CEILING_REFLECTANCE: f64 = 0.7;

/// Fixed points of each pixel in PPM (the thesis has one): the fewest from which the error of choosing them can be estimated.
pub const POINTS_PER_PIXEL: u32 = 2;

const CORNELL_BOX: &str = include_str!("../../../examples/cornell_box.json");
const HOLIGILM: &str = include_str!("../../../examples/holigilm_thesis.json");

/// Returns a document with a fixed number of passes; its relative errors are for solvers, which have no passes.
pub fn passes(mut document: Value, passes: u64) -> Value {
    document["stop"] = json!({
        "relative_error": 1e-4, "view_relative_error": 1e-4, "max_passes": passes, "max_seconds": 1e9,
    });
    document
}

/// Returns the Cornell box of `examples/cornell_box.json` (section 6.1).
pub fn cornell_box(settings: &Settings) -> Result<Value, ReportError> {
    let mut document = example("cornell_box.json", CORNELL_BOX)?;
    document["views"][0]["size_px"] = json!([settings.size_px, settings.size_px]);
    Ok(document)
}

/// Returns a Cornell box of 80 inches without blocks, lit by the pipe alone, open toward the eye (figures 6.7 and 6.8).
pub fn pipe_box(settings: &Settings) -> Result<Value, ReportError> {
    let cornell = example("cornell_box.json", CORNELL_BOX)?;
    let mut document = room()?;
    document["room"]["surfaces"] = cornell["room"]["surfaces"].clone();
    let middle = 0.5 * ROOM_M;
    // the example's method computes grids only
    remove(&mut document, "method");
    document["views"] = json!([{
        "name": "camera", "eye_m": [middle, -1.5 * ROOM_M, middle], "look_at_m": [middle, middle, middle],
        "vertical_fov_deg": 39.3077, "size_px": [settings.size_px, settings.size_px],
    }]);
    remove(&mut document, "grids");
    Ok(document)
}

/// Returns the room of the illuminance comparison (section 6.2) with a grid of `cells` on its floor, made from
/// `examples/holigilm_thesis.json`: 519 lm of sky light through the pipe, no sun; floor, walls and ceiling reflect 0.2, 0.5 and
/// 0.7 where interreflection is on.
pub fn floor(cells: [usize; 2], interreflection: bool) -> Result<Value, ReportError> {
    let mut document = room()?;
    document["grids"] = json!([{ "name": "floor", "height_m": 0.0, "cells": cells }]);
    if !interreflection {
        document["effects"] = json!({ "interreflection": "off" });
    }
    Ok(document)
}

/// Returns the closed room without grids and views.
pub fn room() -> Result<Value, ReportError> {
    let mut document = example("holigilm_thesis.json", HOLIGILM)?;
    document["name"] = "The thesis' room".into();
    document["room"]["surfaces"] = json!({
        "floor": { "reflectance": 0.2 }, "walls": { "reflectance": 0.5 },
        "ceiling": { "reflectance": CEILING_REFLECTANCE },
    });
    remove(&mut document, "effects");
    remove(&mut document, "grids");
    Ok(document)
}

/// Returns `ppm` or `sppm` with the settings of the thesis (section 6.3), and radii by each point's own photons as there.
pub fn thesis_method(kind: &str, settings: &Settings) -> Value {
    let mut method = own_method(kind, settings);
    method["initial_radius_m"] = printed::INITIAL_RADIUS_M.into();
    method["alpha"] = printed::ALPHA.into();
    method["radius"] = "per_point".into();
    method
}

/// Returns `ppm` or `sppm` with this program's radius and alpha.
pub fn own_method(kind: &str, settings: &Settings) -> Value {
    let mut method = json!({ "kind": kind, "photons_per_pass": settings.photons_per_pass });
    if kind == "ppm" {
        method["samples_per_pixel"] = POINTS_PER_PIXEL.into();
    }
    method
}

fn example(file: &str, text: &str) -> Result<Value, ReportError> {
    serde_json::from_str(text).map_err(|error| ReportError::Case(format!("examples/{file}: {error}")))
}

/// Removes a field from a document.
pub fn remove(document: &mut Value, field: &str) {
    if let Some(fields) = document.as_object_mut() {
        fields.remove(field);
    }
}
