//! From text to a document: what is no document, numbers at their limits, and defaults.

use crate::given::{base, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::cli::mesh_files::MeshFiles;
use skyduct::document::errors::WarningCode;
use skyduct::document::outputs::FILE_ENDINGS;
use skyduct::document::{FieldErrorCode, JobDocument, Warning, to_scene};
use skyduct::present::outputs::Format;

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
    assert_eq!((overflow.pointer.as_str(), overflow.code), ("/room/size_m/1", FieldErrorCode::Invalid));
    let twice = error("{\"room\": {\"size_m\": [1, 1, 1], \"size_m\": [2, 2, 2]}}");
    assert_eq!((twice.pointer.as_str(), twice.code), ("/room/size_m", FieldErrorCode::Invalid));
    assert!(JobDocument::parse(b"\xff\xfe{}").is_err());
    let refused = |bytes: &[u8]| JobDocument::parse(bytes).unwrap_err().0.remove(0).detail;
    assert!(refused(b"{\"name\": \"caf\xe9\"}").contains("not UTF-8 after byte 13"));
    assert!(refused(b"\x1f\x8b\x08\0\0").contains("gzip"));
    assert!(refused(b"{\0\0\0}\0\0\0").contains("UTF-32"));
}

/// What editors of other systems save.
#[test]
fn marks_and_encodings_of_text() {
    let mut document = base();
    document["name"] = json!("caf\u{e9} \u{1f600}");
    let plain = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    for mark in ["", "\u{feff}"] {
        let text = format!("{mark}{}", document.to_string().replace(",\"", ",\r\n\""));
        let units = || text.encode_utf16();
        let little: Vec<u8> = units().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = units().flat_map(u16::to_be_bytes).collect();
        for bytes in [text.as_bytes(), &little, &big] {
            assert_eq!(JobDocument::parse(bytes).as_ref(), Ok(&plain));
        }
    }
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
fn every_example_is_a_good_document() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let documents: Vec<_> =
        files.filter(|file| file.extension().is_some_and(|extension| extension == "json")).collect();
    assert!(documents.len() >= 4, "{documents:?}");
    for file in documents {
        let value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        let document = JobDocument::from_files(value, &MeshFiles::beside(&file))
            .unwrap_or_else(|errors| panic!("{}: {errors}", file.display()));
        let (scene, warnings, _) = to_scene(&document, &MeshFiles::beside(&file))
            .unwrap_or_else(|errors| panic!("{}: {errors}", file.display()));
        let empty = scene.grids.is_empty() && scene.views.is_empty();
        // a model says what is not read of it
        let is_fault = |warning: &Warning| warning.code != WarningCode::ModelChanged;
        assert!(!empty && !warnings.iter().any(is_fault), "{}: {warnings:?}", file.display());
    }
}

/// A list in the place of an object is told as such, whatever serde says of its items; right lists beside it are left alone.
#[test]
fn lists_are_no_objects() {
    let of = |pointer: &str, list: Value| {
        let mut document = base();
        document["grids"][0]["cells"] = json!([3, 2]);
        match pointer {
            "" => document = list,
            _ => document[&pointer[1..]] = list,
        }
        let errors = JobDocument::parse(document.to_string().as_bytes()).unwrap_err().0;
        let found = errors.into_iter().find(|error| error.pointer == pointer).unwrap();
        assert_eq!(found.detail, "invalid type: sequence, expected an object", "{pointer}");
    };
    for (pointer, list) in [
        ("", json!([])),
        ("", json!([1, 2])),
        ("/location", json!([55.7, 12.5, null])),
        ("/location", json!([55.7, 12.5, 3])),
        ("/stop", json!([])),
        ("/stop", json!(["a"])),
    ] {
        of(pointer, list);
    }
    let mut document = base();
    document["grids"][0]["cells"] = json!([3, "a"]);
    let errors = JobDocument::parse(document.to_string().as_bytes()).unwrap_err().0;
    assert_eq!((errors.len(), errors[0].pointer.as_str()), (1, "/grids/0/cells/1"), "{errors:?}");
}

/// Names whose files would have the paths of another output's are refused; alone they are names as any other.
#[test]
fn names_of_files_of_other_outputs() {
    let of = |names: [&str; 2]| {
        let mut document = base();
        let mut other = document["grids"][0].clone();
        document["grids"][0]["name"] = json!(names[0]);
        other["name"] = json!(names[1]);
        document["grids"].as_array_mut().unwrap().push(other);
        JobDocument::parse(document.to_string().as_bytes()).map(|_| ()).map_err(|errors| errors.0)
    };
    for (names, index) in [(["a", "a.json"], 1), (["a.csv", "a"], 0), (["a.b", "a.b.npy"], 1)] {
        let errors = of(names).unwrap_err();
        assert_eq!((errors.len(), errors[0].pointer.clone()), (1, format!("/grids/{index}/name")), "{errors:?}");
    }
    for names in [["a.json", "a.csv"], ["a", "a.b"], ["a", "b.json"]] {
        assert_eq!(of(names), Ok(()));
    }
    for format in Format::ALL {
        assert!(FILE_ENDINGS.contains(&format.suffix()));
    }
}
