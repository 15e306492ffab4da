//! Scenes of the benchmarks: those of `tests/reference/scenes`, and variations of them.

use std::path::Path;

use serde_json::{Value, json};

use super::case::Case;
use super::settings::Settings;
use crate::page::ReportError;

const THESIS_ROOM: &str = include_str!("../../../examples/thesis_room.json");

/// Side of the room of S1 to S3 in metres.
pub const ROOM_M: f64 = 2.032;

/// Diameter of the tubes of S1 to S3 in metres.
pub const DIAMETER_M: f64 = 0.254;

/// Reads a JSON file.
pub fn read(file: &Path) -> Result<Value, ReportError> {
    let failed = |reason: String| ReportError::Case(format!("{} cannot be read: {reason}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| failed(error.to_string()))?;
    serde_json::from_str(&text).map_err(|error| failed(error.to_string()))
}

/// Reads the scene S1, S2, S3, S3_mesh or S4.
pub fn stored(settings: &Settings, name: &str) -> Result<Case, ReportError> {
    let folder = settings.reference.join("scenes");
    Ok(Case::beside(read(&folder.join(format!("{name}.json")))?, &folder))
}

/// Returns the room of the thesis with its view, as `skyduct demo` renders it: to its own accuracies.
pub fn demo() -> Result<Case, ReportError> {
    let document = serde_json::from_str(THESIS_ROOM);
    let document: Value = document.map_err(|error| ReportError::Case(format!("examples/thesis_room.json: {error}")))?;
    Ok(Case::beside(document, Path::new("examples")))
}

/// Returns S1 with another tube.
pub fn with_tube(settings: &Settings, tube: Value) -> Result<Case, ReportError> {
    let mut case = stored(settings, "S1")?;
    case.document["tubes"] = json!([tube]);
    Ok(case)
}

/// Returns the tube of S1 with other segments.
pub fn tube(segments: Value) -> Value {
    json!({
        "centre_m": [0.5 * ROOM_M, 0.5 * ROOM_M], "diameter_m": DIAMETER_M, "reflectance": 0.98, "segments": segments,
        "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 },
    })
}

/// Returns the tube of S1 as a mesh with the materials of [`super::meshes::elbow`].
pub fn mesh_tube() -> Value {
    json!({
        "mesh": "tube.obj", "unit": "m", "centre_m": [0.5 * ROOM_M, 0.5 * ROOM_M], "opening_diameter_m": DIAMETER_M,
        "recognise": false,
        "parts": {
            "pipe": { "role": "pipe", "reflectance": 0.98 },
            "diffuser": { "role": "diffuser", "kind": "lambertian", "transmittance": 0.6 },
        },
    })
}

/// Returns S1 with a number of points on each side of its grid.
pub fn points(settings: &Settings, side: u32) -> Result<Case, ReportError> {
    let mut case = stored(settings, "S1")?;
    case.document["grids"][0]["cells"] = json!([side, side]);
    Ok(case)
}

/// Returns a hall of 8 x 8 x 3 m with `side` x `side` tubes of S1, and 16 x 16 points on its floor.
pub fn tubes(settings: &Settings, side: u32) -> Result<Case, ReportError> {
    let mut case = stored(settings, "S1")?;
    let at = |k: u32| 8.0 * (f64::from(k) + 0.5) / f64::from(side);
    let tubes: Vec<Value> = (0..side * side)
        .map(|k| {
            let mut tube = tube(json!([{ "length_m": 1.0 }]));
            tube["centre_m"] = json!([at(k % side), at(k / side)]);
            tube
        })
        .collect();
    case.document["room"]["size_m"] = json!([8.0, 8.0, 3.0]);
    case.document["tubes"] = tubes.into();
    case.document["grids"][0]["cells"] = json!([16, 16]);
    Ok(case)
}

/// Returns S1 with a number of boxes, at most 64, spread over the floor between the points of its grid.
pub fn boxes(settings: &Settings, number: usize) -> Result<Case, ReportError> {
    let mut case = stored(settings, "S1")?;
    let places = (0..number).map(|k| 64 * k / number.max(1)).map(|place| [place % 8 + 1, place / 8 + 1]);
    case.document["room"]["objects"] = places.map(|[x, y]| block(x, y)).collect::<Vec<_>>().into();
    Ok(case)
}

/// Returns a box between four neighbours of 9 x 9 points.
fn block(x: usize, y: usize) -> Value {
    let centre = |k: usize| ROOM_M * k as f64 / 9.0;
    json!({
        "kind": "box", "size_m": [0.12, 0.12, 0.4], "position_m": [centre(x), centre(y), 0.0],
        "surface": { "reflectance": 0.4 },
    })
}

/// Adds a luminaire to the ceiling of S1, beside the tube.
pub fn with_luminaire(mut document: Value) -> Value {
    document["room"]["luminaires"] = json!([{
        "kind": "rectangle", "corner_m": [0.2, 0.2, ROOM_M], "edge_u_m": [0.0, 0.4, 0.0], "edge_v_m": [0.4, 0.0, 0.0],
        "luminance_cd_m2": 1000.0,
    }]);
    document
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> Settings {
        Settings {
            quick: true,
            reference: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference"),
            beside: None,
        }
    }

    #[test]
    fn scenes_are_jobs() {
        let settings = settings();
        let lit = Case::beside(with_luminaire(stored(&settings, "S1").unwrap().document), Path::new("."));
        let mesh = with_tube(&settings, mesh_tube()).unwrap().document;
        let mesh = Case::with(mesh, super::super::meshes::elbow(1.0, 1000));
        let bent =
            with_tube(&settings, tube(json!([{ "length_m": 0.2 }, { "length_m": 0.2, "tilt_deg": 45 }]))).unwrap();
        let cases = [demo(), points(&settings, 3), tubes(&settings, 8), boxes(&settings, 64), stored(&settings, "S4")];
        let cases = cases.map(Result::unwrap).into_iter().chain([lit, mesh, bent]);
        for case in cases {
            let prepared = case.prepare();
            assert!(prepared.is_ok(), "{}: {}", case.document, prepared.err().unwrap());
        }
    }

    #[test]
    fn boxes_stand_between_the_points() {
        let document = boxes(&settings(), 64).unwrap().document;
        let boxes = document["room"]["objects"].as_array().unwrap();
        assert_eq!(boxes.len(), 64);
        let centre = |place: &Value| place["position_m"][0].as_f64().unwrap();
        let point = |k: u8| ROOM_M * (f64::from(k) + 0.5) / 9.0;
        let is_free = |place: &Value| (0..9).all(|k| (point(k) - centre(place)).abs() > 0.5 * 0.12);
        assert!(boxes.iter().all(is_free));
        let mut places: Vec<_> = boxes.iter().map(|place| place["position_m"].to_string()).collect();
        places.sort();
        places.dedup();
        assert_eq!(places.len(), 64);
    }
}
