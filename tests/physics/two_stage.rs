//! Two stages: what cannot be cut in two, the settings, and fluxes of tubes. They agree with others in `matrix`.

use crate::documents::{Folder, first_passes, refusal};
use crate::reference;
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, FieldErrorCode, JobDocument, ValidJob};
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::integrator::method::RefusalCode;

fn by_stages(document: &mut Value) {
    document["method"] = "two_stage".into();
}

fn document(edit: impl FnOnce(&mut Value)) -> Result<ValidJob, DocumentErrors> {
    let mut document = reference::json("scenes/S3.json");
    by_stages(&mut document);
    edit(&mut document);
    JobDocument::parse(document.to_string().as_bytes())
}

fn job(edit: impl FnOnce(&mut Value)) -> Result<skyduct::present::prepared::Prepared, DocumentErrors> {
    skyduct::present::prepared::prepare_document(&document(edit)?, &Folder)
}

/// Closures without a Lambertian part are refused with what can compute them, light through a clear zone that a bend sends back to points,
/// and sun by way of mirrors.
#[test]
fn refuses_what_cannot_be_cut() {
    assert!(job(|_| {}).is_ok());
    let mixed = json!({ "kind": "mixed", "lambertian_radius_m": 0.06, "inner": "lambertian",
                        "lambertian_transmittance": 0.6, "clear_transmittance": 0.9 });
    let clear = json!({ "kind": "clear", "transmittance": 0.9 });
    for (diffuser, refusal_code) in [
        (mixed.clone(), RefusalCode::ClearClosuresOfBentTubes),
        (clear, RefusalCode::ClearClosures),
        (json!({ "kind": "open" }), RefusalCode::ClearClosures),
    ] {
        let refused = job(|document| document["tubes"][0]["diffuser"] = diffuser.clone()).err().unwrap().0;
        assert_eq!(refused[0].pointer, "/method");
        let code = refusal(&document(|document| document["tubes"][0]["diffuser"] = diffuser).unwrap());
        assert_eq!(code.map(|refusal| refusal.code), Some(refusal_code));
    }
    let straight = |document: &mut Value| {
        document["tubes"][0]["diffuser"] = mixed.clone();
        document["tubes"][0]["segments"] = json!([{ "length_m": 1.0 }]);
    };
    assert!(job(straight).is_ok());
    // light of the directional part is found for grids alone
    let seen = job(|document| {
        straight(document);
        document["views"] = json!([{ "name": "view", "eye_m": [0.5, 0.5, 1.0], "look_at_m": [1.0, 1.0, 1.0],
                                     "vertical_fov_deg": 60, "size_px": [8, 8] }]);
    });
    assert_eq!(seen.err().unwrap().0[0].refusal.unwrap().0, RefusalCode::ClearClosures);
    // a mirror shows images of the diffusers; by two that face each other, or a narrow lobe, there is always more
    let sunny = |surfaces: &[&str], roughness: f64| {
        let document = document(|document| {
            document["sky"]["direct_normal_illuminance_lux"] = json!(60_000);
            for surface in surfaces {
                document["room"]["surfaces"][*surface] =
                    json!({ "reflectance": 0.1, "specular": 0.8, "roughness": roughness });
            }
        });
        refusal(&document.unwrap()).map(|refusal| refusal.code)
    };
    assert_eq!(sunny(&["floor"], 0.0), None);
    assert_eq!(sunny(&["floor", "ceiling"], 0.0), Some(RefusalCode::SunByMirrors));
    assert_eq!(sunny(&["floor"], 0.1), Some(RefusalCode::SunByMirrors));
}

#[test]
fn settings_have_bounds() {
    for (field, values) in
        [("samples_per_sensor", [0, 65_537]), ("samples_per_pixel", [0, 4_097]), ("photons_per_pass", [63, 16_777_217])]
    {
        for value in values {
            let errors = job(|document| document["method"] = json!({ "kind": "two_stage", field: value }));
            let errors = errors.err().unwrap().0;
            let expected = (format!("/method/{field}"), FieldErrorCode::OutOfRange);
            assert_eq!((errors[0].pointer.clone(), errors[0].code), expected, "{errors:?}");
        }
    }
    for field in ["initial_radius_m", "alpha", "coefficient"] {
        let errors = job(|document| document["method"] = json!({ "kind": "two_stage", field: 0.5 })).err().unwrap().0;
        assert_eq!(errors[0].code, FieldErrorCode::UnknownField, "{errors:?}");
    }
    let prepared = job(|document| document["method"] = json!({ "kind": "two_stage", "samples_per_pixel": 7 })).unwrap();
    // what follows from the accuracy asked for is no setting
    assert_eq!(prepared.document["method"], json!({ "kind": "two_stage", "samples_per_pixel": 7 }));
}

/// Fluxes of tubes are those of light tracing; a bent tube in a black room.
#[test]
fn fluxes_are_those_of_light_tracing() {
    let summary = |method: &str| {
        let prepared = job(|document| {
            document["method"] = method.into();
            document["stop"] = json!({ "relative_error": 1e-3, "max_passes": 64 });
            document["room"]["surfaces"] = json!({ "floor": { "reflectance": 0 }, "walls": { "reflectance": 0 },
                                                   "ceiling": { "reflectance": 0 } });
        });
        let prepared = prepared.unwrap();
        prepared.summary_json(&first_passes(&prepared, 32), Spent::NOTHING, StoppedBy::MaxPasses)
    };
    let (found, truth) = (summary("two_stage"), summary("light_tracing"));
    for field in ["at_collector", "at_diffuser", "into_room"] {
        let of = |summary: &Value, key: &str| summary["tubes"][0][field][key].as_f64().unwrap();
        let error = of(&found, "standard_error_lm").hypot(of(&truth, "standard_error_lm"));
        let (a, b) = (of(&found, "flux_lm"), of(&truth, "flux_lm"));
        assert!((a - b).abs() < 4.0 * error && error < 0.01 * b, "{field}: {a} is not {b} +- {error}");
    }
    assert!(found["timing"]["photons"].as_u64() > Some(0) && found["timing"]["rays"].as_u64() > Some(0));
}

/// A cell of which half lies before a mirror, and the middle behind it, gets of it what light tracing finds; in a black room.
#[test]
fn mirrors_light_what_of_a_cell_lies_before_them() {
    let mean = |method: &str| {
        let prepared = job(|document| {
            document["method"] = method.into();
            document["stop"] = json!({ "relative_error": 1e-3, "max_passes": 512 });
            let black = json!({ "reflectance": 0 });
            document["room"]["surfaces"] = json!({ "floor": black, "walls": black, "ceiling": black });
            document["room"]["objects"] = json!([{ "kind": "box", "size_m": [1.0, 0.6, 1.5], "position_m": [0.5, 1.3, 0.0],
                                                   "surface": { "reflectance": 0, "specular": 0.9 } }]);
            document["tubes"][0]["centre_m"] = json!([0.5, 0.7]);
            document["tubes"][0]["segments"] = json!([{ "length_m": 0.5 }]);
            document["grids"] =
                json!([{ "name": "floor", "height_m": 0.1, "cells": [1, 1], "estimate": "cell_average" }]);
        });
        let prepared = prepared.unwrap();
        let summary = prepared.summary_json(&first_passes(&prepared, 512), Spent::NOTHING, StoppedBy::MaxPasses);
        ["mean_lux", "mean_lux_standard_error"].map(|key| {
            summary["grids"][0]["statistics"][key].as_f64().unwrap_or_else(|| panic!("{}", summary["grids"][0]))
        })
    };
    let ([found, of_found], [truth, of_truth]) = (mean("two_stage"), mean("light_tracing"));
    let error = of_found.hypot(of_truth);
    assert!((found - truth).abs() < 4.0 * error && error < 0.01 * truth, "{found} is not {truth} +- {error}");
}
