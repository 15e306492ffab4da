//! Thin surfaces with a material for either side.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use serde_json::json;
use skyduct::document::{FileSource, JobDocument, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};

use super::super::row::{Row, exact};

/// A sheet of 4 m x 3 m in the millimetres of a survey, its front toward z.
struct Sheet;

impl FileSource for Sheet {
    fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
        let corners = [(0.0, 0.0), (4000.0, 0.0), (4000.0, 3000.0), (0.0, 3000.0)];
        let corners = corners.map(|(x, y)| format!("v {} {} 7000\n", 3e9 + x, 5e9 + y));
        let text = format!("{}usemtl sheet\nf 1 2 3 4\n", corners.concat());
        parse_obj(text.as_bytes(), ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// Luminance of the panels in cd/m2.
const LUMINANCE: f64 = 3000.0;

/// Reflectances of the sheet's western front and its eastern back.
const SIDES: [f64; 2] = [0.8, 0.3];

/// Corners of the panel in the western half, in the plane of the ceiling; that of the eastern half is its mirror image.
const PANEL: [(f64, f64); 4] = [(0.6, 1.4), (1.2, 1.4), (1.2, 2.2), (0.6, 2.2)];

/// Illuminance of the western panel at a point whose horizon lies below it (Lambert 1760, for polygons).
fn direct(point: DVec3, normal: DVec3) -> f64 {
    let corners = PANEL.map(|(x, y)| (DVec3::new(x, y, 3.0) - point).normalize());
    let edge = |k: usize| {
        let (a, b) = (corners[k], corners[(k + 1) % 4]);
        a.dot(b).acos() * a.cross(b).normalize().dot(normal)
    };
    0.5 * LUMINANCE * (0..4).map(edge).sum::<f64>().abs()
}

/// Illuminance of the floor at a point of the western half by way of the sheet's front: the integral of Lambert's law over it.
fn by_sheet(point: DVec3) -> f64 {
    let (columns, rows) = (400, 300);
    let (dy, dz) = (4.0 / f64::from(columns), 3.0 / f64::from(rows));
    let part = |place: i32| {
        let (y, z) = ((f64::from(place / rows) + 0.5) * dy, (f64::from(place % rows) + 0.5) * dz);
        let on_sheet = DVec3::new(2.0, y, z);
        let away = on_sheet - point;
        direct(on_sheet, DVec3::NEG_X) * away.z * away.x / away.length_squared().powi(2)
    };
    (0..columns * rows).map(part).sum::<f64>() * dy * dz / PI
}

/// A black room that a sheet divides into halves, each with a panel: the floor has the panel's light, and that which the sheet's side
/// reflects once.
pub fn sheet_of_two_sides_points() -> Row {
    let panel = |x: f64| {
        json!({ "kind": "rectangle", "corner_m": [x, 1.4, 3], "edge_u_m": [0, 0.8, 0], "edge_v_m": [0.6, 0, 0],
                "luminance_cd_m2": LUMINANCE })
    };
    let black = json!({ "reflectance": 0 });
    let document = json!({
        "room": {
            "size_m": [4, 4, 3], "surfaces": { "floor": black, "walls": black, "ceiling": black },
            "luminaires": [panel(0.6), panel(2.8)],
            "objects": [{ "kind": "mesh", "mesh": "sheet", "scale": 0.001, "offset": [3e9, 5e9, 7000], "position_m": [2, 4, 0],
                          "rotation_deg": [-90, 0, 90], "surfaces": { "sheet": { "reflectance": SIDES[0] } },
                          "back_surfaces": { "sheet": { "reflectance": SIDES[1] } } }]
        },
        "grids": [{ "name": "floor", "height_m": 0, "cells": [4, 2] }]
    });
    let scene = to_scene(&JobDocument::parse(document.to_string().as_bytes()).unwrap(), &Sheet).unwrap().0;
    let of_sensor = |number: usize| {
        let at = scene.grids[0].centre(number);
        let (west, reflectance) =
            if at.x < 2.0 { (at, SIDES[0]) } else { (DVec3::new(4.0 - at.x, at.y, 0.0), SIDES[1]) };
        direct(west, DVec3::Z) + reflectance * by_sheet(west)
    };
    let values: Vec<f64> = (0..scene.grids[0].len()).map(of_sensor).collect();
    // the quadrature has a tenth of this error
    Row::new(scene).given(exact(&values, 1e-4), 0.0)
}
