//! What a document's writer is told: everything that is missing at once, what may have been meant, and other units.

use serde_json::{Value, json};
use skyduct::document::tube_flux::TubeFluxDocument;
use skyduct::document::{FieldError, FieldErrorCode, JobDocument};

fn base() -> Value {
    json!({
        "sky": { "cie_type": 12, "sun_position": { "altitude_deg": 35, "azimuth_deg": 225 } },
        "room": { "size_m": [4, 6, 2.7], "objects": [
            { "kind": "box", "size_m": [0.6, 0.6, 0.75], "position_m": [0.5, 0.5, 0], "surface": { "reflectance": 0.5 } }] },
        "tubes": [{ "centre_m": [2, 3], "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.2 }],
                    "collector": { "kind": "dome", "transmittance": 0.92 },
                    "diffuser": { "kind": "lambertian", "transmittance": 0.6 } }],
        "grids": [{ "name": "floor", "height_m": 0, "cells": [4, 4] }],
        "views": [{ "name": "room", "eye_m": [1.9, 0.1, 1.6], "look_at_m": [1, 1.2, 0.8] }]
    })
}

/// The errors of `document`, sorted by their pointers.
fn errors(document: &Value) -> Vec<FieldError> {
    let mut errors = JobDocument::parse(document.to_string().as_bytes()).expect_err("a bad document").0;
    errors.sort_by(|a, b| a.pointer.cmp(&b.pointer));
    errors
}

fn pointers(errors: &[FieldError]) -> Vec<&str> {
    errors.iter().map(|error| error.pointer.as_str()).collect()
}

#[track_caller]
fn missing(document: &Value, pointers: &[&str]) {
    let errors = errors(document);
    assert_eq!(self::pointers(&errors), pointers, "{errors:?}");
    for error in &errors {
        // needed only where another field is absent or has items
        let depends = ["/grids", "/sky", "/tubes"].contains(&error.pointer.as_str());
        let code = if depends { FieldErrorCode::Invalid } else { FieldErrorCode::Missing };
        assert_eq!(error.code, code, "{error}");
    }
}

/// `base` with the value at `pointer` replaced.
fn with(pointer: &str, value: Value) -> Value {
    let mut document = base();
    *document.pointer_mut(pointer).unwrap_or_else(|| panic!("no {pointer}")) = value;
    document
}

#[test]
fn the_base_document_is_good() {
    JobDocument::parse(base().to_string().as_bytes()).unwrap();
}

#[test]
fn everything_that_is_missing_is_named_at_once() {
    missing(&json!({}), &["/grids", "/room", "/tubes"]);
    missing(
        &json!({ "tubes": [{}], "grids": [{}], "views": [{}], "location": {} }),
        &[
            "/grids/0/cells",
            "/grids/0/height_m",
            "/grids/0/name",
            "/location/latitude_deg",
            "/location/longitude_deg",
            "/room",
            "/sky",
            "/tubes/0/centre_m",
            "/tubes/0/collector",
            "/tubes/0/diameter_m",
            "/tubes/0/diffuser",
            "/tubes/0/reflectance",
            "/tubes/0/segments",
            "/views/0/eye_m",
            "/views/0/look_at_m",
            "/views/0/name",
        ],
    );
    missing(
        &with("/tubes/0", json!({ "mesh": "pipe.obj", "parts": { "wall": {}, "lid": { "role": "collector" } } })),
        &[
            "/tubes/0/centre_m",
            "/tubes/0/opening_diameter_m",
            "/tubes/0/parts/lid/transmittance",
            "/tubes/0/parts/wall/role",
            "/tubes/0/unit",
        ],
    );
    missing(
        &with("/room", json!({ "objects": [{}, { "kind": "box" }], "luminaires": [{ "kind": "rectangle" }] })),
        &[
            "/room/luminaires/0/corner_m",
            "/room/luminaires/0/edge_u_m",
            "/room/luminaires/0/edge_v_m",
            "/room/luminaires/0/luminance_cd_m2",
            "/room/objects/0/kind",
            "/room/objects/1/position_m",
            "/room/objects/1/size_m",
            "/room/objects/1/surface",
            "/room/size_m",
        ],
    );
    missing(
        &with("/tubes/0/diffuser", json!({ "kind": "mixed" })),
        &[
            "/tubes/0/diffuser/clear_transmittance",
            "/tubes/0/diffuser/inner",
            "/tubes/0/diffuser/lambertian_radius_m",
            "/tubes/0/diffuser/lambertian_transmittance",
        ],
    );
}

/// What is missing hides no other fault, and makes none up.
#[test]
fn faults_beside_missing_fields_are_named_too() {
    let mut document = base();
    document["tubes"][0]["reflectance"] = json!(1.5);
    document["tubes"][0].as_object_mut().unwrap().remove("diameter_m");
    document["tubes"][0]["colour"] = json!("red");
    document["views"][0]["size_px"] = json!([9000, 10]);
    document["grids"][0]["cells"] = json!("many");
    document["stop"] = json!({ "max_passes": 0 });
    let errors = errors(&document);
    let expected = [
        "/grids/0/cells",
        "/stop/max_passes",
        "/tubes/0/colour",
        "/tubes/0/diameter_m",
        "/tubes/0/reflectance",
        "/views/0/size_px/0",
    ];
    assert_eq!(pointers(&errors), expected, "{errors:?}");
    // a second tube overlaps nothing that was made up
    let mut document = base();
    let mut second = document["tubes"][0].clone();
    second["centre_m"] = json!([0.2, 0.2]);
    document["tubes"].as_array_mut().unwrap().push(second);
    document["tubes"][0].as_object_mut().unwrap().remove("centre_m");
    missing(&document, &["/tubes/0/centre_m"]);
}

/// A tube that is given as cylinders and as a mesh, and a method with the settings of another one.
#[test]
fn fields_of_another_kind_are_all_named() {
    let mut document = base();
    document["tubes"][0]["mesh"] = json!("pipe.obj");
    document["method"] = json!({ "kind": "path_tracing", "photons_per_pass": 1000, "alpha": 0.8 });
    let errors = errors(&document);
    let of = |code: FieldErrorCode| -> Vec<&str> {
        errors.iter().filter(|error| error.code == code).map(|error| error.pointer.as_str()).collect()
    };
    let others =
        ["collector", "diameter_m", "diffuser", "reflectance", "segments"].map(|name| format!("/tubes/0/{name}"));
    let mut expected = vec!["/method/alpha", "/method/photons_per_pass"];
    expected.extend(others.iter().map(String::as_str));
    assert_eq!(of(FieldErrorCode::UnknownField), expected, "{errors:?}");
    assert_eq!(
        of(FieldErrorCode::Missing),
        ["/tubes/0/opening_diameter_m", "/tubes/0/parts", "/tubes/0/unit"],
        "{errors:?}"
    );
}

#[test]
fn slips_in_names_get_a_proposal() {
    for (pointer, slip, meant) in [
        ("/location", "lat", "latitude_deg"),
        ("/tubes/0", "diameter", "diameter_m"),
        ("/grids/0", "hight_m", "height_m"),
        ("/tubes/0/segments/0", "lenght_m", "length_m"),
        ("", "tube", "tubes"),
        ("/effects", "glosy", "glossy"),
    ] {
        let mut document = base();
        document["location"] = json!({ "latitude_deg": 55, "longitude_deg": 12 });
        document["effects"] = json!({});
        document.pointer_mut(pointer).unwrap()[slip] = json!("off");
        let errors = errors(&document);
        let at = format!("{pointer}/{slip}");
        let detail = &errors.iter().find(|error| error.pointer == at).expect(slip).detail;
        assert!(detail.ends_with(&format!("; did you mean `{meant}`?")), "{detail}");
    }
    let mut document = base();
    document["method"] = json!("light_trasing");
    let errors = errors(&document);
    assert!(errors.len() == 1 && errors[0].detail.ends_with("; did you mean `light_tracing`?"), "{errors:?}");
    document["method"] = json!("weather");
    assert!(!errors_of(&document).contains("did you mean"));
}

fn errors_of(document: &Value) -> String {
    errors(document).into_iter().map(|error| format!("{error}\n")).collect()
}

#[test]
fn numbers_in_other_units_get_a_hint() {
    for (pointer, number, at, hint) in [
        ("/tubes/0/diameter_m", json!(350), "/tubes/0/diameter_m", "350 looks like millimetres: 0.35"),
        ("/tubes/0/diameter_m", json!(350_000_000), "/tubes/0/diameter_m", ""),
        ("/tubes/0/centre_m/1", json!(3000), "/tubes/0/centre_m/1", "3000 looks like millimetres: 3"),
        (
            "/tubes/0/segments/0/length_m",
            json!(1200),
            "/tubes/0/segments/0/length_m",
            "1200 looks like millimetres: 1.2",
        ),
        ("/grids/0/height_m", json!(850), "/grids/0/height_m", "850 looks like millimetres: 0.85"),
        ("/room/objects/0/position_m/0", json!(500), "/room/objects/0/position_m/0", "500 looks like millimetres: 0.5"),
        ("/tubes/0/reflectance", json!(98), "/tubes/0/reflectance", "98 looks like percent: 0.98"),
        (
            "/tubes/0/collector/transmittance",
            json!(92),
            "/tubes/0/collector/transmittance",
            "92 looks like percent: 0.92",
        ),
        ("/tubes/0/reflectance", json!(-1), "/tubes/0/reflectance", ""),
    ] {
        let errors = errors(&with(pointer, number.clone()));
        let error = errors.iter().find(|error| error.pointer == at);
        let detail = &error.unwrap_or_else(|| panic!("{pointer}: {errors:?}")).detail;
        if hint.is_empty() {
            assert!(!detail.contains("looks like"), "{detail}");
        } else {
            assert!(detail.ends_with(hint), "{pointer} {number}: {errors:?}");
        }
    }
}

/// Lengths that no building has, and things that fit with thousandths of all their lengths.
#[test]
fn millimetres_everywhere() {
    let hints = |document: &Value| -> usize { errors_of(document).matches(" like millimetres").count() };
    let mut in_millimetres = base();
    in_millimetres["room"]["size_m"] = json!([4000, 6000, 2700]);
    in_millimetres["tubes"][0]["centre_m"] = json!([2000, 3000]);
    assert_eq!(hints(&in_millimetres), 3, "{}", errors_of(&in_millimetres));
    for (pointer, value, expected) in [
        ("/room/size_m/1", json!(6000), 1),
        ("/tubes/0/segments/0/length_m", json!(600), 1),
        ("/tubes/0/segments/0/length_m", json!(150), 1),
        ("/room/objects/0/size_m", json!([600, 600, 750]), 3),
        (
            "/room/objects/0",
            json!({ "kind": "box", "size_m": [600, 600, 750], "position_m": [500, 500, 0],
                                    "surface": { "reflectance": 0.5 } }),
            3,
        ),
        (
            "/room/luminaires",
            json!([{ "kind": "rectangle", "corner_m": [500, 500, 2600], "edge_u_m": [0, 600, 0],
                                      "edge_v_m": [600, 0, 0], "luminance_cd_m2": 1000 }]),
            3,
        ),
    ] {
        let mut document = base();
        document["room"]["luminaires"] = json!([]);
        *document.pointer_mut(pointer).unwrap() = value;
        assert_eq!(hints(&document), expected, "{pointer}: {}", errors_of(&document));
    }
    // a tube by itself in a room that is made for it
    let request = json!({ "tube": { "diameter_m": 350, "reflectance": 0.98, "segments": [{ "length_m": 1.2 }],
                          "collector": { "kind": "open" }, "diffuser": { "kind": "open" } },
                          "skies": [{ "cie_type": 1, "sun_position": { "altitude_deg": 35, "azimuth_deg": 225 } }] });
    let errors = TubeFluxDocument::from_value(request).map(drop).unwrap_err();
    assert!(errors.to_string().contains("350 looks like millimetres: 0.35"), "{errors}");
}

/// What a document has wrongly is told once, and nothing is held against what stands in for it.
#[test]
fn one_fault_has_one_error() {
    let mut base = base();
    base["grids"][0] = json!({ "name": "floor", "height_m": 0.85, "spacing_m": 0.5 });
    for (pointer, value, expected) in [
        ("/room/size_m", json!([4, 6]), "/room/size_m"),
        ("/room/size_m", json!("large"), "/room/size_m"),
        (
            "/room",
            json!({ "plan": { "outline_m": [[0, 0], [4, "a"], [4, 3]] }, "ceiling": { "kind": "flat", "height_m": 2.7 } }),
            "/room/plan/outline_m/1/1",
        ),
        (
            "/room/objects/0",
            json!({ "kind": "mesh", "mesh": "x", "unit": "m", "up": "x", "position_m": [2, 3, 0], "surfaces": {} }),
            "/room/objects/0/up",
        ),
        ("/tubes/0/centre_m", json!([2, 3, 1]), "/tubes/0/centre_m"),
    ] {
        let mut document = base.clone();
        *document.pointer_mut(pointer).unwrap() = value;
        assert_eq!(pointers(&errors(&document)), [expected], "{}", errors_of(&document));
    }
}

/// A sensor without a direction is told what its six numbers are.
#[test]
fn a_sensor_needs_a_direction() {
    let mut document = base();
    document["grids"] = json!([{ "name": "desk", "points_m": [[1, 1, 0.75]] }]);
    let errors = errors(&document);
    assert_eq!(pointers(&errors), ["/grids/0/points_m/0"]);
    assert!(
        errors[0].detail.ends_with("array of length 6: x, y and z in m, and the direction in which the sensor faces")
    );
}
