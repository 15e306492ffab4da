//! Rooms that are no boxes, and boxes of the same size: documents of the benchmarks.

use serde_json::{Value, json};

use super::case::Case;
use super::furnished::{self, USUAL};
use super::scenes;
use super::settings::Settings;
use crate::page::ReportError;
use skyduct::geometry::TriangleMesh;

/// Distance of the points of a grid in m.
const SPACING_M: f64 = 1.0;

/// Height of the boxes in m.
const HEIGHT_M: f64 = 2.8;

/// Reads a room of `tests/reference/rooms`, with points on a level grid.
pub fn stored(settings: &Settings, name: &str) -> Result<Case, ReportError> {
    let mut document = scenes::read(&settings.reference.join("rooms").join(format!("{name}.json")))?;
    document["grids"] = json!([{ "name": "level", "height_m": 0.85, "spacing_m": SPACING_M }]);
    Ok(Case::with(document, TriangleMesh::default()))
}

/// Returns a box with the floor area, length, tubes, surfaces and grid of a room with a plan.
pub fn as_box(mut room: Case) -> Case {
    let document = &mut room.document;
    let plan = &document["room"]["plan"];
    let holes = plan["holes_m"].as_array().into_iter().flatten();
    let area = area_m2(&plan["outline_m"]) - holes.map(area_m2).sum::<f64>();
    let length = corners(&plan["outline_m"]).map(|[x, _]| x).fold(0.0, f64::max);
    let depth = area / length;
    let mut surfaces = document["room"]["surfaces"].clone();
    if let Value::Object(surfaces) = &mut surfaces {
        surfaces.retain(|name, _| ["floor", "walls", "ceiling"].contains(&name.as_str()));
    }
    document["room"] = json!({ "size_m": [length, depth, HEIGHT_M], "surfaces": surfaces });
    if let Value::Array(tubes) = &mut document["tubes"] {
        let count = tubes.len() as f64;
        for (number, tube) in tubes.iter_mut().enumerate() {
            tube["centre_m"] = json!([length * (number as f64 + 0.5) / count, 0.5 * depth]);
            if let Value::Object(tube) = tube {
                tube.remove("drop_m");
            }
        }
    }
    room
}

/// Returns the corners of a polygon in m.
fn corners(outline: &Value) -> impl Iterator<Item = [f64; 2]> + '_ {
    let coordinate = |corner: &Value, axis: usize| corner[axis].as_f64().unwrap_or_default();
    outline.as_array().into_iter().flatten().map(move |corner| [0, 1].map(|axis| coordinate(corner, axis)))
}

/// Returns the area of a polygon in m2.
fn area_m2(outline: &Value) -> f64 {
    let corners: Vec<[f64; 2]> = corners(outline).collect();
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>().abs()
}

/// Returns the furnished office without a corner of 10 x 12 m, its tubes and its furniture.
pub fn l_office() -> Case {
    let mut case = furnished::office(true, USUAL);
    let room = &mut case.document["room"];
    room["plan"] = json!({ "outline_m": [[0, 0], [20, 0], [20, 18], [10, 18], [10, 30], [0, 30]] });
    room["ceiling"] = json!({ "kind": "flat", "height_m": room["size_m"][2] });
    let is_kept = |place: &Value| {
        let [x, y] = [0, 1].map(|axis| place[axis].as_f64().unwrap_or_default());
        x < 9.0 || y < 17.0
    };
    if let Value::Object(room) = room {
        room.remove("size_m");
    }
    if let Value::Array(objects) = &mut room["objects"] {
        objects.retain(|object| is_kept(&object["position_m"]));
    }
    if let Value::Array(tubes) = &mut case.document["tubes"] {
        tubes.retain(|tube| is_kept(&tube["centre_m"]));
    }
    case
}

/// Number of strips along the attic that each have a face of the floor, of the ceiling and of two walls, and of faces of each gable wall.
const STRIPS: u32 = 7;
const OF_GABLE: u32 = 6;

/// Returns the stored attic with 40 faces in place of its plan.
pub fn attic_of_faces(settings: &Settings) -> Result<Case, ReportError> {
    let mut case = stored(settings, "attic")?;
    let rise = libm::tan(35.0_f64.to_radians());
    let (length, depth) = (5.0, 4.0);
    let x = |strip: u32| length * f64::from(strip) / f64::from(STRIPS);
    let y = |part: u32| depth * f64::from(part) / f64::from(OF_GABLE);
    let floor = |x: f64, y: f64| [x, y, 0.0];
    let ceiling = |x: f64, y: f64| [x, y, 2.2 + rise * y];
    // corners of the gable walls lie on the edges of the strips beside them
    let between = |strip: u32| if [0, STRIPS].contains(&strip) { 1..OF_GABLE } else { 1..1 };
    let strip_of = |strip: u32, at: &dyn Fn(f64, f64) -> [f64; 3]| -> Vec<[f64; 3]> {
        let east = between(strip + 1).map(|part| at(x(strip + 1), y(part)));
        let west = between(strip).rev().map(|part| at(x(strip), y(part)));
        let ends = [at(x(strip), 0.0), at(x(strip + 1), 0.0)];
        ends.into_iter().chain(east).chain([at(x(strip + 1), depth), at(x(strip), depth)]).chain(west).collect()
    };
    let upright = |[from, to]: [[f64; 2]; 2]| {
        vec![floor(from[0], from[1]), floor(to[0], to[1]), ceiling(to[0], to[1]), ceiling(from[0], from[1])]
    };
    let mut faces = Vec::new();
    let mut add = |kind: &str, boundary: Vec<[f64; 3]>| {
        faces.push(json!({ "name": format!("{kind}_{}", faces.len()), "kind": kind, "boundary_m": boundary }));
    };
    for strip in 0..STRIPS {
        add("floor", strip_of(strip, &floor));
        add("ceiling", strip_of(strip, &ceiling));
        add("wall", upright([[x(strip), 0.0], [x(strip + 1), 0.0]]));
        add("wall", upright([[x(strip + 1), depth], [x(strip), depth]]));
    }
    for part in 0..OF_GABLE {
        add("wall", upright([[length, y(part)], [length, y(part + 1)]]));
        add("wall", upright([[0.0, y(part + 1)], [0.0, y(part)]]));
    }
    let room = &mut case.document["room"];
    if let Value::Object(room) = room {
        room.remove("plan");
        room.remove("ceiling");
    }
    room["faces"] = faces.into();
    Ok(case)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn rooms_of_all_shapes_are_jobs() {
        let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference");
        let settings = Settings { quick: true, reference, beside: None };
        let mut cases = vec![l_office(), attic_of_faces(&settings).unwrap()];
        assert_eq!(cases[1].document["room"]["faces"].as_array().map(Vec::len), Some(40));
        for name in ["L_hall", "attic", "gable", "skew"] {
            let case = stored(&settings, name).unwrap();
            cases.extend([as_box(case.clone()), case]);
        }
        assert_eq!(
            as_box(stored(&settings, "L_hall").unwrap()).document["room"]["size_m"],
            json!([8.0, 4.5, HEIGHT_M])
        );
        for case in cases {
            let prepared = case.clone().to(0.05, 1.0).prepare();
            assert!(prepared.is_ok(), "{}: {}", case.document, prepared.err().unwrap());
        }
    }
}
