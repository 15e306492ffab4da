//! What must hold of any bytes that come in: a function for each fuzz target, which panics where it does not.
//!
//! The seeds in `fuzz/corpus` are run through the same functions by `cargo test --test document seeds`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failure is what fuzzing is for")]

use std::sync::Arc;

use axum::http::{HeaderMap, HeaderValue};
use serde_json::{Value, json};
use skyduct::annual::moment::{Convention, moments};
use skyduct::annual::schedule::{Schedule, occupied};
use skyduct::document::weather::read_weather;
use skyduct::document::{DocumentErrors, FileSource, JobDocument, ValidJob, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::http::last_event_id::last_event_id as id_of;
use skyduct::optics::{Diffuser, Mirror};
use skyduct::present::prepared::prepare_document;
use skyduct::scene::{Scene, TubeShape};

/// Sensors and pixels of a document that is prepared: what many of them take is not looked for here.
const MOST_SENSORS: u64 = 10_000;

/// A document is refused with errors that have places and words, or reads back as it was written and becomes a job or a refusal.
pub fn document(bytes: &[u8]) {
    let document = match JobDocument::parse(bytes) {
        Ok(document) => document,
        Err(errors) => return tells(&errors),
    };
    let text = serde_json::to_vec(&document).unwrap();
    assert_eq!(JobDocument::parse(&text).expect("what was accepted"), document);
    if sensors(&document) <= MOST_SENSORS
        && let Err(errors) = prepare_document(&document, &Cube)
    {
        tells(&errors);
    }
}

/// Number of sensors and pixels.
fn sensors(document: &ValidJob) -> u64 {
    let sizes = document.views.iter().map(|view| view.size_px.map(u64::from));
    document.grids.iter().map(|grid| grid.counts()).chain(sizes).map(|[a, b]| a * b).sum()
}

fn tells(errors: &DocumentErrors) {
    assert!(!errors.0.is_empty());
    for error in &errors.0 {
        assert!(error.pointer.is_empty() || error.pointer.starts_with('/'), "{error:?}");
        assert!(!error.detail.is_empty(), "{error:?}");
    }
}

/// One mesh for all ids: a cube of one unit, open below, with a part of each role above the plane z = 0.
struct Cube;

impl FileSource for Cube {
    fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
        parse_obj(CUBE, ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

const CUBE: &[u8] = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    usemtl diffuser\nf 1 2 3 4\nusemtl cover\nf 5 6 7 8\nusemtl pipe\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A file is refused with the number of one of its lines, or its mesh is one: indices in range, coordinates finite, triangles
/// with three corners, none twice.
pub fn obj(bytes: &[u8]) {
    let limits = ObjLimits { looks: 1_000_000, ..ObjLimits::default() };
    let lines = 1 + bytes.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count();
    let mesh = match parse_obj(bytes, limits) {
        Ok(mesh) => mesh,
        Err(error) => {
            assert!((1..=lines).contains(&error.line) && !error.detail.is_empty(), "{error:?}");
            return;
        }
    };
    assert_eq!(mesh.triangles.len(), mesh.triangle_materials.len());
    assert!(mesh.positions.iter().all(|position| position.is_finite()));
    assert!(mesh.triangle_materials.iter().all(|material| (*material as usize) < mesh.materials.len()));
    let mut seen = std::collections::HashSet::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
        assert!(a != b && b != c && c != a, "{triangle:?}");
        let mut corners = *triangle;
        corners.sort_unstable();
        assert!(seen.insert(corners), "twice: {triangle:?}");
    }
}

/// A weather file is refused with the number of one of its lines, or has finite irradiances, moments with the sun up, and a schedule.
pub fn weather(bytes: &[u8]) {
    let lines = 1 + bytes.iter().filter(|byte| **byte == b'\n').count();
    let weather = match read_weather(bytes) {
        Ok((weather, _)) => weather,
        Err(error) => {
            assert!((1..=lines).contains(&error.line) && !error.detail.is_empty(), "{error:?}");
            return;
        }
    };
    for record in &weather.records {
        let light = [record.direct_normal_w_m2, record.diffuse_horizontal_w_m2];
        assert!(light.iter().all(|light| (0.0..1e6).contains(light)) && record.dew_point_c.is_finite(), "{record:?}");
    }
    let convention = Convention { suns_per_hour: 3, ..Convention::of(&weather) };
    for moment in moments(&weather, convention).unwrap().moments {
        assert!(moment.sun.z > 0.0 && moment.share > 0.0 && moment.share <= 1.0, "{moment:?}");
    }
    let occupied = occupied(&weather, &Schedule::lm83(), weather.daylight_saving, weather.sun_offset_minutes);
    assert_eq!(occupied.len(), weather.records.len());
}

/// A header is the id of an event, or refused; ids are taken as they were given out.
pub fn last_event_id(bytes: &[u8]) {
    assert_eq!(id_of(&HeaderMap::new()).unwrap(), None);
    let Ok(value) = HeaderValue::from_bytes(bytes) else { return };
    let headers = HeaderMap::from_iter([(axum::http::header::HeaderName::from_static("last-event-id"), value)]);
    let text = std::str::from_utf8(bytes);
    match id_of(&headers) {
        Ok(Some(id)) => {
            let text = text.unwrap().trim_start_matches('+').trim_start_matches('-');
            assert!(!text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()), "{text:?}");
            assert_eq!(text.parse::<u64>().unwrap(), id.unsigned_abs());
        }
        Ok(None) => panic!("a header that is there"),
        Err(_) => assert!(!text.is_ok_and(|text| text.parse::<u32>().is_ok()), "{text:?} is an id"),
    }
}

/// Directions and cosines at which an accepted table is asked.
const COSINES: [f64; 7] = [0.0, 1e-9, 0.1, 0.5, 0.9, 1.0 - 1e-12, 1.0];

/// Tables in a document are refused at their place, or lose energy and scatter to where they should.
///
/// The bytes are JSON: an object that is the `diffuser` of a tube, and perhaps a `mirror` that is the reflectance of its pipe.
pub fn tables(bytes: &[u8]) {
    let Ok(Value::Object(given)) = serde_json::from_slice(bytes) else { return };
    let of = |name: &str, default: Value| given.get(name).cloned().unwrap_or(default);
    let document = json!({
        "sky": { "cie_type": 1, "sun_position": { "altitude_deg": 40, "azimuth_deg": 0 } },
        "room": { "size_m": [3, 3, 3] },
        "tubes": [{
            "centre_m": [1.5, 1.5], "diameter_m": 0.3, "segments": [{ "length_m": 1 }], "collector": { "kind": "open" },
            "reflectance": of("mirror", json!(0.9)), "diffuser": of("diffuser", json!({ "kind": "open" })),
        }],
        "grids": [{ "name": "floor", "height_m": 0, "cells": [1, 1] }],
    });
    let parsed = match JobDocument::parse(document.to_string().as_bytes()) {
        Ok(parsed) => parsed,
        Err(errors) => {
            tells(&errors);
            let ours =
                |pointer: &str| ["/tubes/0/reflectance", "/tubes/0/diffuser"].iter().any(|it| pointer.starts_with(it));
            // numbers that no f64 has are refused before there are fields
            assert!(errors.0.iter().all(|error| error.pointer.is_empty() || ours(&error.pointer)), "{errors:?}");
            return;
        }
    };
    let (Scene { tubes, .. }, ..) = to_scene(&parsed, &Cube).expect("nothing but tables can be wrong");
    let TubeShape::Cylinders(shape) = &tubes[0].shape else { panic!("no mesh was given") };
    mirror(&shape.reflectance);
    if let Diffuser::Measured(table) = &tubes[0].diffuser {
        for cosine in COSINES {
            let [through, back] = table.albedos(cosine);
            assert!(through >= 0.0 && back >= 0.0 && through + back <= 1.0 + 1e-6, "{cosine}: {through} + {back}");
            for transmitted in [true, false] {
                let values = COSINES.map(|exit| table.per_sr(transmitted, cosine, exit));
                assert!(values.iter().all(|value| *value >= 0.0 && value.is_finite()), "{values:?}");
                for u in COSINES {
                    let direction = table.exit_direction(transmitted, cosine, [u.min(1.0 - f64::EPSILON), u]);
                    assert!((direction.length() - 1.0).abs() < 1e-9 && direction.z >= 0.0, "{direction}");
                }
            }
        }
    }
}

fn mirror(mirror: &Mirror) {
    assert!((0.0..=1.0).contains(&mirror.brightest()));
    for cosine in COSINES {
        let reflectance = mirror.reflectance(|| cosine);
        let within = 0.0..=mirror.brightest() * (1.0 + 1e-12);
        assert!(reflectance.iter().all(|value| within.contains(value)), "{cosine}: {reflectance:?}");
    }
}
