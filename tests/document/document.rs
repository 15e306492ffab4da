//! The job document: bad documents and the pointers that they get, good ones and what they become.

use std::sync::Arc;

use crate::schema::{parse, parse_any};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};
use skyduct::cli::mesh_files::MeshFiles;
use skyduct::document::{DocumentErrors, JobDocument, MeshSource, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::optics::{Collector, Diffuser};
use skyduct::scene::{Channels, Face, TubeShape};

/// The thesis' room with every field that the engine can do.
fn base() -> Value {
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
struct SquarePipe;

impl MeshSource for SquarePipe {
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
        Ok(Arc::new(TriangleMesh { positions, triangles, triangle_materials, materials }))
    }
}

fn mesh_tube() -> Value {
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
fn with(mut document: Value, pointer: &str, value: Value) -> Value {
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

fn errors(document: &Value) -> DocumentErrors {
    parse(document).and_then(|document| to_scene(&document, &SquarePipe)).map(drop).expect_err("a bad document")
}

/// The one error of `document` is at `pointer`, and its detail contains `detail`.
#[track_caller]
fn refused(document: &Value, pointer: &str, detail: &str) {
    let errors = errors(document).0;
    let found = errors.iter().find(|error| error.pointer == pointer);
    let found = found.unwrap_or_else(|| panic!("nothing at {pointer}: {errors:?}"));
    assert!(found.detail.contains(detail), "{pointer}: {}", found.detail);
    assert_eq!(errors.len(), 1, "{errors:?}");
}

#[test]
fn the_base_document_is_good() {
    let document = parse(&base()).unwrap();
    let (scene, warnings, provenance) = to_scene(&document, &SquarePipe).unwrap();
    assert_eq!(warnings, vec![]);
    assert_eq!(scene.channels, Channels::Photopic);
    assert!(!provenance.sun.unwrap().on);
    assert_eq!(scene.daylight.unwrap().sky.unwrap().zenith_luminance_cd_m2, 5000.0);
}

#[test]
fn every_bound_names_its_field() {
    let cases = [
        // place and sky
        ("/sky/cie_type", json!(0), "1..16"),
        ("/sky/cie_type", json!(17), "17"),
        ("/sky/cie_type", json!("clear"), "invalid type"),
        ("/sky/cie_type", Value::Null, "required"),
        ("/sky/sun_position/altitude_deg", json!(90.5), "-90..90"),
        ("/sky/sun_position/azimuth_deg", json!(-361), "-360..360"),
        ("/sky/sun_position", Value::Null, "location"),
        ("/sky/zenith_luminance_cd_m2", json!(-1), "0.."),
        ("/sky/direct_normal_illuminance_lux", json!(1e12), "1000000000"),
        ("/sky/luminous_turbidity", json!(3), "at most one"),
        ("/sky/turbidity", json!(3), "unknown field"),
        // room
        ("/room/size_m", json!([1, 2]), "length 2"),
        ("/room/surfaces", json!([]), "sequence, expected an object"),
        ("/stop", json!([0.1]), "sequence, expected an object"),
        ("/tubes/0/segments/0", json!([1]), "sequence, expected an object"),
        ("/room/size_m/1", json!(0.001), "0.01..10000"),
        ("/room/size_m/2", json!(-3), "-3"),
        ("/room/surfaces/floor/reflectance", json!(1.2), "0..1"),
        ("/room/surfaces/floor/reflectance", json!(1), "albedo must be < 1"),
        ("/room/surfaces/walls/reflectance", json!([0.5, 1.0, 0.5]), "invalid"),
        ("/room/surfaces/floor/specular", json!(1.5), "within 0..1"),
        ("/room/surfaces/floor/open", json!(1), "invalid type"),
        ("/room/surfaces/roof", json!({}), "unknown field"),
        ("/room/surfaces/wall_north", json!({ "reflectance": "white" }), "invalid type"),
        ("/room/objects/0/position_m/0", json!(0.2), "inside the room"),
        ("/room/objects/0/size_m/2", json!(0), "> 0"),
        ("/room/objects/0/mesh", json!("x"), "not a field of"),
        ("/room/objects/0/surface", Value::Null, "missing"),
        ("/room/objects/0/surface/reflectance", json!(1), "albedo"),
        // tubes
        ("/tubes", json!([]), "at least one tube or luminaire"),
        ("/tubes/0/centre_m/0", json!(0.1), "inside the ceiling"),
        ("/tubes/0/diameter_m", json!(0), "> 0"),
        ("/tubes/0/diameter_m", json!(-0.254), "> 0"),
        ("/tubes/0/reflectance", json!(1.01), "0..1"),
        ("/tubes/0/segments", json!([]), "1..16"),
        ("/tubes/0/segments/0/length_m", json!(0), "> 0"),
        ("/tubes/0/segments/0/tilt_deg", json!(10), "not supported yet"),
        ("/tubes/0/segments/1/tilt_deg", json!(136), "0..135"),
        ("/tubes/0/segments/1/length_m", json!(0.05), "mitres"),
        ("/tubes/0/collector/kind", json!("sphere"), "unknown variant"),
        ("/tubes/0/collector/transmittance", json!(1.5), "0..1"),
        ("/tubes/0/collector/transmittance", Value::Null, "missing"),
        ("/tubes/0/collector/thickness_m", json!(0.003), "not a field of"),
        (
            "/tubes/0/collector",
            json!({ "kind": "dielectric_dome", "refractive_index": 0.9, "thickness_m": 0.003 }),
            "1..4",
        ),
        ("/tubes/0/collector", json!({ "kind": "dielectric_dome", "refractive_index": 1.49 }), "missing"),
        ("/tubes/0/collector/absorption_per_m", json!(2), "not a field of"),
        ("/tubes/0/diffuser/transmittance", json!(1.1), "0..1"),
        ("/tubes/0/diffuser/inner", json!("clear"), "not a field of"),
        // outputs
        ("/grids/0/name", json!("../x"), "begin with a letter"),
        ("/grids/0/name", json!(""), "1..64"),
        ("/grids/0/cells/0", json!(0), "1..1000"),
        ("/grids/0/cells", json!([1000, 1000]), "100000"),
        ("/grids/0/height_m", json!(2.032), "below the ceiling"),
        ("/grids/0/margin_m", json!(1.016), "half the room"),
        ("/grids/0/estimate", json!("mean"), "unknown variant"),
        ("/views/0/size_px/0", json!(8193), "1..8192"),
        ("/views/0/size_px", json!([8192, 8192]), "16777216"),
        ("/views/0/vertical_fov_deg", json!(179), "< 179"),
        ("/views/0/look_at_m", json!([1.9, 0.1, 1.6]), "differ"),
        ("/views/0/up", json!([0, 0, 0]), "zero"),
        // method, stop, effects, seed
        ("/method", json!("light_tracing"), "grids only"),
        ("/method", json!("magic"), "unknown variant"),
        ("/method/samples_per_pixel", json!(4), "not a field of"),
        ("/method/alpha", json!(1), "< 1"),
        ("/method/photons_per_pass", json!(63), "64.."),
        ("/method/initial_radius_m", json!(0), "> 0"),
        ("/method/radius", json!(1), "invalid type"),
        ("/method/radius", json!("knn"), "unknown variant"),
        ("/method/radii", json!(1), "unknown field"),
        ("/stop/relative_error", json!(0), "> 0"),
        ("/stop/confidence", json!(1), "< 1"),
        ("/stop/max_passes", json!(0), "1.."),
        ("/stop/max_seconds", json!(-5), "> 0"),
        ("/effects/bloom", json!("on"), "no effect"),
        ("/effects/glossy", json!("maybe"), "unknown variant"),
        ("/seed", json!(-1), "invalid value"),
        ("/seed", json!(1.5), "invalid type"),
        ("/extra~field", json!(1), "unknown field"),
        ("/name", json!(7), "invalid type"),
    ];
    for (pointer, value, detail) in cases {
        let document = with(base(), &pointer.replace("extra~field", "extra~0field"), value.clone());
        // the error is where the change is, or just inside or around it
        let expected: (&str, &str) = match (pointer, detail) {
            ("/room/surfaces/walls/reflectance", _) => ("/room/surfaces/walls/reflectance/1", "albedo"),
            ("/room/surfaces/wall_north", _) => ("/room/surfaces/wall_north/reflectance", detail),
            ("/tubes/0/collector", "1..4") => ("/tubes/0/collector/refractive_index", "1..4"),
            ("/tubes/0/collector", "missing") => ("/tubes/0/collector/thickness_m", "missing"),
            ("/extra~field", _) => ("/extra~0field", detail),
            _ => (pointer, detail),
        };
        refused(&document, expected.0, expected.1);
    }
}

#[test]
fn place_and_time() {
    let located = |time: Value| {
        let mut document = with(base(), "/sky/sun_position", Value::Null);
        document["location"] = json!({ "latitude_deg": 55.7667, "longitude_deg": 12.5 });
        document["time"] = time;
        document
    };
    refused(&located(json!("2011-09-15T15:00:00")), "/time", "offset");
    refused(&located(json!("2011-02-30T15:00:00Z")), "/time", "RFC 3339");
    refused(&located(json!("+006001-01-01T12:00:00Z")), "/time", "6001");
    refused(&located(json!("-002001-06-01T12:00:00Z")), "/time", "-2001");
    refused(
        &with(located(json!("2011-09-15T15:00:00Z")), "/location/latitude_deg", json!(90.0001)),
        "/location/latitude_deg",
        "90.0001",
    );
    refused(
        &with(located(json!("2011-09-15T15:00:00Z")), "/location/longitude_deg", json!(181)),
        "/location/longitude_deg",
        "181",
    );
    refused(
        &with(located(json!("2011-09-15T15:00:00Z")), "/location/elevation_m", json!(1e5)),
        "/location/elevation_m",
        "9000",
    );
    refused(&with(base(), "/time", json!("2011-09-15T15:00:00Z")), "/sky/sun_position", "exactly one");
    let mut no_place = with(base(), "/sky/sun_position", Value::Null);
    no_place["time"] = json!("2011-09-15T15:00:00Z");
    refused(&no_place, "/location", "required");

    // the apparent altitude, as in tests/reference/sun_positions.csv
    let document = parse(&located(json!("2011-09-15T15:00:00+02:00"))).unwrap();
    let (_, _, provenance) = to_scene(&document, &SquarePipe).unwrap();
    assert!((provenance.sun.unwrap().altitude_deg - 32.4806).abs() < 1e-3);
    assert!((provenance.sun.unwrap().azimuth_deg - 214.6021).abs() < 1e-3);
    // a leap second is not a panic
    let _ = parse(&located(json!("2016-12-31T23:59:60Z")));
}

#[test]
fn tubes_bend_touch_and_overlap() {
    let folded = json!([{ "length_m": 1 }, { "length_m": 1, "tilt_deg": 90, "azimuth_deg": 0 },
                        { "length_m": 1, "tilt_deg": 90, "azimuth_deg": 180 }]);
    refused(&with(base(), "/tubes/0/segments", folded), "/tubes/0/segments/2/tilt_deg", "a bend of 180 degrees");
    let down = json!([{ "length_m": 0.5 }, { "length_m": 1, "tilt_deg": 90 }, { "length_m": 1, "tilt_deg": 135 }]);
    refused(&with(base(), "/tubes/0/segments", down), "/tubes/0/segments/2/tilt_deg", "above the ceiling");
    refused(
        &with(base(), "/tubes/0/segments", json!(vec![json!({ "length_m": 1 }); 17])),
        "/tubes/0/segments",
        "but has 17",
    );
    let tiny = with(base(), "/tubes/0/segments", json!([{ "length_m": 1e-9 }]));
    assert!(parse(&tiny).is_ok());

    let tube = base()["tubes"][0].clone();
    let beside = |x: f64| {
        let mut second = tube.clone();
        second["centre_m"] = json!([x, 1.016]);
        with(base(), "/tubes/-", second)
    };
    refused(&beside(1.2), "/tubes/1/centre_m", "overlaps");
    assert!(parse(&beside(1.016 + 0.254)).is_ok());
    let many: Vec<_> = vec![tube.clone(); 65];
    refused(&with(base(), "/tubes", json!(many)), "/tubes", "but there are 65");
    refused(&with(base(), "/room/surfaces/ceiling", json!({ "open": true })), "/room/surfaces/ceiling/open", "closed");

    let lambertian = json!({ "kind": "lambertian", "transmittance": [0.6, 0.6, 0.6], "reflectance": 0.5 });
    refused(&with(base(), "/tubes/0/diffuser", lambertian), "/tubes/0/diffuser/transmittance", "<= 1");
    let mixed = |radius: f64| {
        json!({ "kind": "mixed", "lambertian_radius_m": radius, "inner": "lambertian",
                "lambertian_transmittance": 0.6, "clear_transmittance": 0.9 })
    };
    refused(&with(base(), "/tubes/0/diffuser", mixed(0.2)), "/tubes/0/diffuser/lambertian_radius_m", "0..0.127");
    assert!(parse(&with(base(), "/tubes/0/diffuser", mixed(0.06))).is_ok());
    // a perfect mirror is a bound, not an error
    assert!(parse(&with(base(), "/tubes/0/reflectance", json!(1))).is_ok());
}

#[test]
fn mesh_tubes() {
    let document = with(base(), "/tubes/0", mesh_tube());
    let parsed = parse(&document).unwrap();
    let (scene, ..) = to_scene(&parsed, &SquarePipe).unwrap();
    let TubeShape::Mesh(mesh) = &scene.tubes[0].shape else { panic!("a mesh") };
    assert_eq!(mesh.parts.len(), 3);

    let bad = |pointer: &str, value: Value| with(document.clone(), pointer, value);
    refused(&bad("/tubes/0/mesh", json!("nothing")), "/tubes/0/mesh", "no mesh");
    refused(&bad("/tubes/0/unit", Value::Null), "/tubes/0/unit", "missing");
    refused(&bad("/tubes/0/unit", json!("inch")), "/tubes/0/unit", "unknown variant");
    refused(&bad("/tubes/0/parts/a~1b", Value::Null), "/tubes/0/parts", "\"a/b\"");
    refused(
        &bad("/tubes/0/parts/glue", json!({ "role": "pipe", "reflectance": 0.9 })),
        "/tubes/0/parts/glue",
        "\"cover\"",
    );
    refused(&bad("/tubes/0/parts/a~1b/reflectance", json!(2)), "/tubes/0/parts/a~1b/reflectance", "0..1");
    refused(&bad("/tubes/0/parts/cover/reflectance", json!(0.5)), "/tubes/0/parts/cover/transmittance", "<= 1");
    refused(&bad("/tubes/0/parts/diffuser/kind", Value::Null), "/tubes/0/parts/diffuser/kind", "missing");
    refused(&bad("/tubes/0/parts/a~1b/role", json!("diffuser")), "/tubes/0/parts/a~1b/kind", "missing");
    let second = json!({ "role": "diffuser", "kind": "clear", "transmittance": 0.9 });
    refused(&bad("/tubes/0/parts/cover", second), "/tubes/0/parts/diffuser", "not supported yet");
    let high = json!({ "role": "diffuser", "kind": "lambertian", "transmittance": 0.6 });
    refused(&bad("/tubes/0/parts/cover", high), "/tubes/0/parts/cover", "not supported yet");
    // millimetres given as metres: out of every bound of a building
    let far = SquarePipe.load("pipe").unwrap().scaled(1e8);
    struct Far(Arc<TriangleMesh>);
    impl MeshSource for Far {
        fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
            Ok(self.0.clone())
        }
    }
    let errors = to_scene(&parsed, &Far(Arc::new(far))).unwrap_err();
    assert_eq!(errors.0[0].pointer, "/tubes/0/mesh");
}

/// The base room with one panel of 0.2 m x 0.1 m in the ceiling.
fn electric() -> Value {
    let panel = json!({ "kind": "rectangle", "corner_m": [0.3, 0.3, 2.032], "edge_u_m": [0, 0.1, 0],
                        "edge_v_m": [0.2, 0, 0], "luminance_cd_m2": 15000 });
    with(base(), "/room/luminaires", json!([panel]))
}

#[test]
fn luminaires() {
    let document = parse(&electric()).unwrap();
    let (scene, ..) = to_scene(&document, &SquarePipe).unwrap();
    assert_eq!(scene.room.luminaires[0].luminance, [15000.0; 3]);
    assert_eq!(scene.channels, Channels::Photopic);
    let coloured = with(electric(), "/room/luminaires/0/luminance_cd_m2", json!([1, 2, 3]));
    let document = parse(&coloured).unwrap();
    assert_eq!(to_scene(&document, &SquarePipe).unwrap().0.channels, Channels::Rgb);

    let panel = "/room/luminaires/0";
    for (field, value, at, detail) in [
        ("corner_m/2", json!(2.04), "corner_m/2", "inside the room"),
        ("corner_m/0", json!(1.9), "corner_m/0", "inside the room"),
        ("corner_m/0", json!(1e9), "corner_m/0", "-1000000..1000000"),
        ("edge_u_m", json!([0, 0, 0]), "edge_u_m", "long"),
        ("edge_u_m", json!([0.1, 0.1, 0]), "edge_v_m", "right angle"),
        ("edge_u_m", json!([0, -0.1, 0]), "edge_v_m", "emits out of the room"),
        ("luminance_cd_m2", json!(-1), "luminance_cd_m2", "0.."),
        ("luminance_cd_m2", json!([1, 1e10, 1]), "luminance_cd_m2/1", "0.."),
        ("kind", json!("disc"), "kind", "unknown variant"),
        ("flux_lm", json!(1), "flux_lm", "unknown field"),
        // the opening has the radius 0.127 around (1.016, 1.016): 0.126 from its centre is covered, 0.128 is not
        ("corner_m", json!([1.142, 1.0, 2.032]), "", "covers the opening of /tubes/0"),
        // the box stands on (0.2, 0.2)..(0.8, 0.8) and is 0.75 high
        ("corner_m", json!([0.75, 0.4, 0.3]), "", "/room/objects/0"),
        ("corner_m", json!([0.3, 0.3, 0.75]), "", "/room/objects/0"),
    ] {
        let pointer = if at.is_empty() { panel.to_owned() } else { format!("{panel}/{at}") };
        refused(&with(electric(), &format!("{panel}/{field}"), value), &pointer, detail);
    }
    let good = [json!([1.144, 1.0, 2.032]), json!([1.142, 1.0, 2.03]), json!([0.81, 0.4, 0.3])];
    for corner in good {
        let document = with(electric(), "/room/luminaires/0/corner_m", corner);
        assert!(parse(&document).is_ok(), "{document}");
    }

    // back to back is a panel that emits on both sides; face on face is a mistake
    let twice = |document: Value, edge_u: Value| {
        let mut second = document["room"]["luminaires"][0].clone();
        second["corner_m"] = json!([
            0.4,
            if edge_u[1] == json!(-0.1) { 0.4 } else { 0.3 },
            document["room"]["luminaires"][0]["corner_m"][2]
        ]);
        second["edge_u_m"] = edge_u;
        with(document, "/room/luminaires/-", second)
    };
    refused(&twice(electric(), json!([0, 0.1, 0])), "/room/luminaires/1", "overlaps /room/luminaires/0");
    let hanging = with(electric(), "/room/luminaires/0/corner_m/2", json!(1.5));
    assert!(parse(&twice(hanging, json!([0, -0.1, 0]))).is_ok());
}

/// Electric light alone needs neither sky nor place; what explains daylight is null then.
#[test]
fn rooms_without_tubes() {
    let mut document = electric();
    document["tubes"] = json!([]);
    document = with(document, "/sky", Value::Null);
    let parsed = parse(&document).unwrap();
    let (scene, warnings, provenance) = to_scene(&parsed, &SquarePipe).unwrap();
    assert!(scene.daylight.is_none() && scene.tubes.is_empty() && warnings.is_empty());
    let json = serde_json::to_value(&provenance).unwrap();
    assert!(json["zenith"].is_null() && json["sun"].is_null() && json["refraction"].is_null());
    assert_eq!(json["guides"], json!([]));

    document["location"] = json!({ "latitude_deg": 55.77, "longitude_deg": 12.5 });
    document["time"] = json!("2011-09-15T15:00:00+02:00");
    let parsed = parse(&document).unwrap();
    assert_eq!(to_scene(&parsed, &SquarePipe).unwrap().1[0].code, "place_without_sky");
    refused(&with(electric(), "/sky", Value::Null), "/sky", "required unless `tubes` is empty");
}

#[test]
fn all_errors_are_collected() {
    let mut document = base();
    document["room"]["surfaces"]["floor"]["reflectance"] = json!(-0.1);
    document["room"]["colour"] = json!("red");
    document["tubes"][0]["segments"][0]["lenght_m"] = json!(1);
    document["stop"]["confidence"] = json!(0.2);
    document["method"] = json!({ "kind": "sppm", "photons_per_pass": 1 });
    let mut pointers: Vec<_> = errors(&document).0.into_iter().map(|error| error.pointer).collect();
    pointers.sort();
    let expected = [
        "/method/photons_per_pass",
        "/room/colour",
        "/room/surfaces/floor/reflectance",
        "/stop/confidence",
        "/tubes/0/segments/0/lenght_m",
    ];
    assert_eq!(pointers, expected);
}

#[test]
fn text_that_is_no_document() {
    let error = |text: &str| JobDocument::parse(text.as_bytes()).unwrap_err().0.remove(0);
    let syntax = error("{\n  \"name\": }");
    assert_eq!(syntax.pointer, "");
    assert!(syntax.detail.contains("line 2"), "{}", syntax.detail);
    assert_eq!(error("").pointer, "");
    assert_eq!(error("{} {}").pointer, "");
    assert_eq!(error("[]").pointer, "");
    assert_eq!(error(&"[".repeat(100_000)).pointer, "");
    assert!(error("{\"room\": {\"size_m\": [NaN, 1, 1]}}").detail.contains("line 1"));
    let overflow = error("{\"room\": {\"size_m\": [1, 1e999, 1]}}");
    assert_eq!((overflow.pointer.as_str(), overflow.detail.contains("out of range")), ("/room/size_m/1", true));
    let twice = error("{\"room\": {\"size_m\": [1, 1, 1], \"size_m\": [2, 2, 2]}}");
    assert_eq!((twice.pointer.as_str(), twice.detail.contains("given twice")), ("/room/size_m", true));
    assert_eq!(error("\u{feff}{}").pointer, "");
    assert!(JobDocument::parse(b"\xff\xfe{}").is_err());
}

#[test]
fn denormals_are_zero() {
    let text = base().to_string().replace("\"margin_m\":0.0", "\"margin_m\":1e-320");
    let document = JobDocument::parse(text.as_bytes()).unwrap();
    assert_eq!(document.grids[0].margin_m, 0.0);
    let text = text.replace("\"length_m\":1.0", "\"length_m\":1e-320");
    let errors = JobDocument::parse(text.as_bytes()).unwrap_err();
    assert_eq!(errors.0[0].pointer, "/tubes/0/segments/0/length_m");
}

#[test]
fn defaults_are_filled_in() {
    let minimal = json!({
        "sky": { "cie_type": 1, "sun_position": { "altitude_deg": 35, "azimuth_deg": 0 } },
        "room": { "size_m": [3, 3, 3] },
        "tubes": [{ "centre_m": [1, 1], "diameter_m": 0.3, "reflectance": 0.98, "segments": [{ "length_m": 1 }],
                    "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 } }],
        "grids": [{ "name": "floor", "height_m": 0, "cells": [3, 3] }]
    });
    let understood = serde_json::to_value(parse(&minimal).unwrap()).unwrap();
    let expect = |pointer: &str, value: Value| assert_eq!(understood.pointer(pointer), Some(&value), "{pointer}");
    expect("/room/surfaces/floor", json!({ "reflectance": 0.2 }));
    expect("/room/surfaces/walls", json!({ "reflectance": 0.5 }));
    expect("/room/surfaces/ceiling", json!({ "reflectance": 0.7 }));
    expect("/method", json!("auto"));
    expect("/grids/0/estimate", json!("point"));
    expect("/tubes/0/diffuser/reflectance", json!(0.0));
    expect("/tubes/0/collector", json!({ "kind": "open" }));
    expect(
        "/stop",
        json!({ "relative_error": 0.02, "view_relative_error": 0.05, "confidence": 0.95,
                            "max_passes": 4096, "max_seconds": 600.0 }),
    );
    expect("/seed", json!(0));
    expect("/views", json!([]));
}

#[test]
fn the_largest_seed_survives() {
    let text = with(base(), "/seed", json!(u64::MAX)).to_string();
    let document = JobDocument::parse(text.as_bytes()).unwrap();
    assert_eq!(document.seed, u64::MAX);
    assert_eq!(serde_json::to_value(&document).unwrap()["seed"], json!(u64::MAX));
    assert!(JobDocument::parse(text.replace("18446744073709551615", "18446744073709551616").as_bytes()).is_err());
}

#[test]
fn walls_colours_and_open_faces() {
    let mut document = base();
    document["room"]["surfaces"]["wall_north"] = json!({ "reflectance": [0.8, 0.1, 0.1] });
    document["room"]["surfaces"]["wall_south"] = json!({ "open": true });
    let (scene, ..) = to_scene(&parse(&document).unwrap(), &SquarePipe).unwrap();
    assert_eq!(scene.channels, Channels::Rgb);
    let surfaces = &scene.room.surfaces;
    assert_eq!(surfaces[Face::North as usize].unwrap().reflectance, [0.8, 0.1, 0.1]);
    assert_eq!(surfaces[Face::South as usize], None);
    assert_eq!(surfaces[Face::East as usize].unwrap().reflectance, [0.5; 3]);
    assert_eq!(surfaces[Face::Ceiling as usize].unwrap().reflectance, [0.7; 3]);
}

#[test]
fn sun_levels_and_warnings() {
    let scene = |document: &Value| to_scene(&parse(document).unwrap(), &SquarePipe).unwrap();
    let night = with(base(), "/sky/sun_position/altitude_deg", json!(-5));
    let (dark, warnings, _) = scene(&night);
    let dark = dark.daylight.unwrap();
    assert!(dark.sky.is_none() && dark.sun.is_none());
    assert_eq!(warnings[0].code, "sun_below_horizon");

    // D is given: the sky integrates back to it
    let mut diffuse = with(base(), "/sky/zenith_luminance_cd_m2", Value::Null);
    diffuse["sky"]["diffuse_horizontal_illuminance_lux"] = json!(12000);
    let (given, warnings, _) = scene(&diffuse);
    assert!((given.daylight.unwrap().horizontal_illuminance_lux().0 - 12000.0).abs() < 1e-8);
    assert!(warnings.is_empty());
    let bright = with(diffuse.clone(), "/sky/diffuse_horizontal_illuminance_lux", json!(80000));
    assert_eq!(scene(&bright).1[0].code, "implausible_illuminance");

    // type 12 at 35 degrees has 86.510 klx at its typical turbidity (docs/physics/sky_and_sun.md#the-sun); types 1, 9 and 16
    // have no beam
    let free = with(base(), "/sky/direct_normal_illuminance_lux", Value::Null);
    assert!((scene(&free).0.daylight.unwrap().sun.unwrap().normal_illuminance_lux - 86_510.0).abs() < 0.5);
    for number in [1, 6, 9, 16] {
        assert!(
            scene(&with(free.clone(), "/sky/cie_type", json!(number))).0.daylight.unwrap().sun.is_none(),
            "type {number}"
        );
    }

    // the room turns, so the sun turns the other way
    let turned = scene(&with(free.clone(), "/room/rotation_deg", json!(225))).0;
    assert!(turned.daylight.unwrap().sun.unwrap().direction.x.abs() < 1e-12);
    let mut overcast = with(base(), "/sky/cie_type", json!(3));
    overcast = with(overcast, "/sky/zenith_luminance_cd_m2", Value::Null);
    overcast["sky"]["luminous_turbidity"] = json!(4);
    refused(&overcast, "/sky/luminous_turbidity", "7..15");
}

#[test]
fn every_example_is_a_good_document() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let documents: Vec<_> =
        files.filter(|file| file.extension().is_some_and(|extension| extension == "json")).collect();
    assert!(documents.len() >= 4, "{documents:?}");
    for file in documents {
        let document = JobDocument::parse(&std::fs::read(&file).unwrap())
            .unwrap_or_else(|errors| panic!("{}: {errors}", file.display()));
        let (scene, warnings, _) = to_scene(&document, &MeshFiles::beside(&file))
            .unwrap_or_else(|errors| panic!("{}: {errors}", file.display()));
        let empty = scene.grids.is_empty() && scene.views.is_empty();
        assert!(!empty && warnings.is_empty(), "{}: {warnings:?}", file.display());
    }
}

/// Any JSON value, biased toward the names of the document.
fn any_json() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        any::<u64>().prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        (-2.0..2.0f64).prop_map(Value::from),
        "[a-z_~/é]{0,8}".prop_map(Value::from),
        Just(json!("lambertian")),
        Just(json!("sppm")),
    ];
    let key = prop_oneof![
        "[a-z_~/]{0,6}",
        proptest::sample::select(vec![
            "kind",
            "sky",
            "room",
            "tubes",
            "size_m",
            "reflectance",
            "mesh",
            "parts",
            "role"
        ])
        .prop_map(str::to_owned),
    ];
    leaf.prop_recursive(4, 48, 6, move |inner| {
        prop_oneof![
            proptest::collection::vec(inner.clone(), 0..5).prop_map(Value::from),
            proptest::collection::btree_map(key.clone(), inner, 0..5)
                .prop_map(|map| Value::Object(map.into_iter().collect())),
        ]
    })
}

/// Pointers of all values in `value`.
fn pointers(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(index, value)| pointers(value, &format!("{at}/{index}"), found));
        }
        Value::Object(values) => values.iter().for_each(|(key, value)| {
            pointers(value, &format!("{at}/{}", key.replace('~', "~0").replace('/', "~1")), found);
        }),
        _ => {}
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn any_json_is_judged_without_panic(value in any_json()) {
        let _ = parse_any(&value);
    }

    #[test]
    fn any_bytes_are_judged_without_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = JobDocument::parse(&bytes);
    }

    /// One value of a good document replaced by anything: a scene, or errors, and never a panic.
    #[test]
    fn one_wrong_value_is_judged_without_panic(value in any_json(), place in any::<proptest::sample::Index>(), mesh in any::<bool>()) {
        let mut document = if mesh { with(base(), "/tubes/0", mesh_tube()) } else { base() };
        let mut places = Vec::new();
        pointers(&document, "", &mut places);
        *document.pointer_mut(place.get::<String>(&places)).unwrap() = value;
        if let Ok(document) = parse_any(&document) {
            let _ = to_scene(&document, &SquarePipe);
        }
    }

    /// Document -> text -> document is the identity, and filling in defaults is done once.
    #[test]
    fn serialised_documents_parse_to_themselves(
        altitude in -90.0..=90.0f64, radius in 1e-6..0.2f64, rgb in proptest::array::uniform3(0.0..0.99f64),
        length in 0.2..10.0f64, cells in proptest::array::uniform2(1u32..300), seed: u64, mesh in any::<bool>(),
        coloured in any::<bool>(), method in proptest::sample::select(vec!["auto", "sppm"]),
    ) {
        let mut document = base();
        document["sky"]["sun_position"]["altitude_deg"] = json!(altitude);
        document["room"]["surfaces"]["wall_west"] = if coloured { json!({ "reflectance": rgb }) } else { json!({ "reflectance": rgb[0] }) };
        document["tubes"][0]["segments"][1]["length_m"] = json!(length);
        document["tubes"][0]["diameter_m"] = json!(2.0 * radius);
        document["grids"][0]["cells"] = json!(cells);
        document["method"] = json!(method);
        document["seed"] = json!(seed);
        if mesh {
            document["tubes"][0] = mesh_tube();
        }
        let parsed = parse(&document).unwrap();
        let text = serde_json::to_string(&parsed).unwrap();
        prop_assert_eq!(&JobDocument::parse(text.as_bytes()).unwrap(), &parsed);
    }
}

#[test]
fn dielectric_domes_are_read() {
    let read = |dome: Value| {
        let document = with(base(), "/tubes/0/collector", dome);
        let (scene, ..) = to_scene(&parse(&document).unwrap(), &SquarePipe).unwrap();
        let TubeShape::Cylinders(cylinders) = &scene.tubes[0].shape else { panic!("a mesh") };
        cylinders.collector
    };
    let mut dome = json!({ "kind": "dielectric_dome", "refractive_index": 1.49, "thickness_m": 0.003 });
    let clear = Collector::DielectricDome { refractive_index: 1.49, thickness_m: 0.003, absorption_per_m: 0.0 };
    assert_eq!(read(dome.clone()), clear);
    dome["absorption_per_m"] = json!(2);
    let grey = Collector::DielectricDome { refractive_index: 1.49, thickness_m: 0.003, absorption_per_m: 2.0 };
    assert_eq!(read(dome), grey);
}

#[test]
fn mirrors_may_depend_on_the_angle() {
    let read = |reflectance: Value| {
        let document = with(base(), "/tubes/0/reflectance", reflectance);
        parse(&document).map(|document| to_scene(&document, &SquarePipe).unwrap().0)
    };
    let table = json!({ "incidence_deg": [0, 60, 90], "reflectance": [0.9, [0.8, 0.7, 0.6], 1] });
    let scene = read(table.clone()).unwrap();
    assert_eq!(scene.channels, Channels::Rgb);
    let TubeShape::Cylinders(cylinders) = &scene.tubes[0].shape else { panic!("a mesh") };
    let middle = cylinders.reflectance.reflectance(|| 30f64.to_radians().cos());
    for (value, truth) in middle.iter().zip([0.85, 0.8, 0.75]) {
        assert!((value - truth).abs() < 1e-12, "{middle:?}");
    }
    let at = |field: &str, value: Value| with(base(), "/tubes/0/reflectance", with(table.clone(), field, value));
    let cases = [
        ("/incidence_deg", json!([0, 90, 60]), "/incidence_deg/2", "larger"),
        ("/incidence_deg", json!([0, 60, 89]), "/incidence_deg/2", "must be 90"),
        ("/incidence_deg", json!([1, 60, 90]), "/incidence_deg/0", "must be 0"),
        ("/reflectance", json!([0.9, 1]), "/reflectance", "one value for each of the 3 angles"),
        ("/reflectance/1", json!(1.2), "/reflectance/1", "0..1"),
        ("/reflectance", Value::Null, "/reflectance", "missing"),
        ("/angle", json!(1), "/angle", "unknown field"),
    ];
    for (field, value, pointer, detail) in cases {
        refused(&at(field, value), &format!("/tubes/0/reflectance{pointer}"), detail);
    }
    // what does not depend on the angle says so
    let document = with(base(), "/tubes/0", mesh_tube());
    let on_cover = with(document, "/tubes/0/parts/cover/reflectance", table);
    refused(&on_cover, "/tubes/0/parts/cover/reflectance", "not a table");
}

#[test]
fn measured_diffusers_are_read_and_judged() {
    let table = json!({
        "kind": "measured", "incidence_deg": [0, 60, 90], "exit_deg": [0, 30, 90],
        "btdf_per_sr": [[0.3, 0.2, 0.1], [0.2, 0.2, 0.1], [0, 0, 0]], "brdf_per_sr": [[0.1, 0.1, 0.1], [0.1, 0.1, 0.1], [0.3, 0.3, 0.3]]
    });
    let document = |table: Value| with(base(), "/tubes/0/diffuser", table);
    let parsed = parse(&document(table.clone())).unwrap();
    let (scene, ..) = to_scene(&parsed, &SquarePipe).unwrap();
    let Diffuser::Measured(measured) = &scene.tubes[0].diffuser else { panic!("not measured") };
    assert_eq!(measured.per_sr(true, 1.0, 1.0), 0.3);
    let [_, back] = measured.shares(1.0);
    assert!((back - 0.1 * std::f64::consts::PI).abs() < 1e-12);
    let mut on_mesh = mesh_tube();
    on_mesh["parts"]["diffuser"] = table.clone();
    on_mesh["parts"]["diffuser"]["role"] = json!("diffuser");
    let (on_mesh, ..) = {
        let document = with(base(), "/tubes/0", on_mesh);
        to_scene(&parse(&document).unwrap(), &SquarePipe).unwrap()
    };
    assert_eq!(on_mesh.tubes[0].diffuser, scene.tubes[0].diffuser);
    let cases = [
        // 2 pi int 0.35 cos sin = 1.0996, which with the reflected tenth of pi is more
        (
            "/btdf_per_sr/1",
            json!([0.35, 0.35, 0.35]),
            "/btdf_per_sr/1",
            "at incidence 60 degrees the diffuser sends out 1.41",
        ),
        ("/btdf_per_sr", json!([[0, 0, 0], [0, 0, 0]]), "/btdf_per_sr", "one row for each of the 3"),
        ("/brdf_per_sr/2", json!([0, 0]), "/brdf_per_sr/2", "one value for each of the 3"),
        ("/btdf_per_sr/0/1", json!(-0.1), "/btdf_per_sr/0/1", "0..1000000000"),
        ("/exit_deg/2", json!(80), "/exit_deg/2", "must be 90"),
        ("/incidence_deg/1", json!(0), "/incidence_deg/1", "larger"),
        ("/exit_deg", Value::Null, "/exit_deg", "missing"),
        ("/transmittance", json!(0.5), "/transmittance", "not a field of"),
    ];
    for (field, value, pointer, detail) in cases {
        let bad = document(with(table.clone(), field, value));
        refused(&bad, &format!("/tubes/0/diffuser{pointer}"), detail);
    }
    refused(
        &with(base(), "/tubes/0/diffuser/exit_deg", json!([0, 90])),
        "/tubes/0/diffuser/exit_deg",
        "not a field of",
    );
}
