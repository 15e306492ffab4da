//! Path tracing: what it refuses and warns of, its settings and what its results leave out. It agrees with others in `matrix`.

use std::f64::consts::PI;

use crate::documents::{first_passes, prepare, refusal};
use crate::reference;
use crate::scenes::{RADIUS, SIDE, disc_room, run, values};
use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, JobDocument, WarningCode};
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::integrator::method::RefusalCode;
use skyduct::integrator::path_tracing;
use skyduct::integrator::two_stage;
use skyduct::scene::{EstimateKind, Grid};

/// Where only chance finds the sun's disc the method is refused with the reason.
#[test]
fn refuses_what_chance_alone_finds() {
    let job = |edit: &dyn Fn(&mut Value)| {
        let mut document = reference::json("scenes/S3.json");
        document["method"] = "path_tracing".into();
        document["sky"]["direct_normal_illuminance_lux"] = json!(60_000);
        edit(&mut document);
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        refusal(&document).map(|refusal| refusal.code)
    };
    assert_eq!(job(&|_| {}), None);
    let clear =
        |document: &mut Value| document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
    let mirror = json!({ "reflectance": 0.1, "specular": 0.8 });
    for (edit, reason) in [
        (&clear as &dyn Fn(&mut Value), RefusalCode::SunThroughClearClosures),
        (&|document: &mut Value| document["room"]["surfaces"]["floor"] = mirror.clone(), RefusalCode::SunByMirrors),
    ] {
        assert_eq!(job(edit), Some(reason));
        let without_sun = |document: &mut Value| {
            edit(document);
            document["effects"] = json!({ "sun": "off" });
        };
        assert_eq!(job(&without_sun), None, "{reason}");
    }
}

/// Three points a millimetre below the diffuser, by paths alone and by two stages, have an error that passes bring down.
#[test]
fn near_an_opening_the_error_stays_finite() {
    let mut scene = disc_room(0.2, 0.5, 0.7, 0.5, EstimateKind::Point);
    let margin = 0.5 * SIDE - 0.5 * RADIUS;
    scene.grids = vec![Grid::new("near".into(), SIDE - 0.001, [3, 1], margin, [SIDE, SIDE], EstimateKind::Point)];
    let paths = path_tracing::Settings { samples_per_sensor: 256, ..Default::default() };
    let stages =
        two_stage::Settings { photons_per_pass: Some(4096), samples_per_sensor: Some(256), samples_per_pixel: 1 };
    // nothing but the disc, of exitance 1000 lm over its area, is seen from there, up to reflections below 1 %
    let exitance = 1000.0 / (PI * RADIUS * RADIUS);
    for method in [crate::scenes::built(&scene, &paths, 2), crate::scenes::built(&scene, &stages, 2)] {
        let (lux, error) = values(&run(&scene, &*method, 32));
        for (lux, error) in lux.iter().zip(&error) {
            println!("{lux} +- {error}, {exitance}");
            assert!((lux / exitance - 1.0).abs() < 0.01 + 4.0 * error / exitance && *error < 0.01 * exitance);
        }
    }
}

/// Under the sky it finds what a mirror shows by chance, and says so.
#[test]
fn warns_of_mirrors() {
    let prepared = prepare("S1", |document| {
        document["method"] = "path_tracing".into();
        document["room"]["objects"] = json!([{
            "kind": "box", "size_m": [0.8, 0.1, 1.6], "position_m": [1.0, 1.6, 0], "rotation_deg": 15,
            "surface": { "reflectance": 0.05, "specular": 0.85 }
        }]);
    });
    assert!(prepared.warnings.iter().any(|warning| warning.code == WarningCode::MirrorsByChance));
}

#[test]
fn settings_have_bounds() {
    let job = |method: Value| {
        let mut document = reference::json("scenes/S1.json");
        document["method"] = method;
        JobDocument::parse(document.to_string().as_bytes())
    };
    for (field, values) in [("samples_per_sensor", [0, 65_537]), ("samples_per_pixel", [0, 4_097])] {
        for value in values {
            let errors = job(json!({ "kind": "path_tracing", field: value })).unwrap_err().0;
            let expected = (format!("/method/{field}"), FieldErrorCode::OutOfRange);
            assert_eq!((errors[0].pointer.clone(), errors[0].code), expected, "{errors:?}");
        }
        let errors = job(json!({ "kind": "sppm", field: 4 })).unwrap_err().0;
        assert_eq!(errors[0].code, FieldErrorCode::UnknownField, "{errors:?}");
    }
    let document = job(json!({ "kind": "path_tracing", "samples_per_pixel": 4_096 })).unwrap();
    let written = serde_json::to_value(&document).unwrap();
    let all = json!({ "kind": "path_tracing", "samples_per_sensor": 64, "samples_per_pixel": 4_096 });
    assert_eq!(written["method"], all);
}

/// Fluxes and the balance of energy are unknown, not zero.
#[test]
fn unknown_fluxes_are_null() {
    let prepared = prepare("S1", |document| {
        document["method"] = json!({ "kind": "path_tracing", "samples_per_sensor": 4 });
        document["stop"] = json!({ "relative_error": 1e-3, "max_passes": 4 });
    });
    let estimate = first_passes(&prepared, 8);
    let summary = prepared.summary_json(&estimate, Spent::NOTHING, StoppedBy::MaxPasses);
    let tube = &summary["tubes"][0];
    for field in ["at_collector", "at_diffuser", "into_room", "transmission_efficiency", "level_aperture_efficiency"] {
        assert!(tube.get(field).unwrap().is_null(), "{field}");
    }
    assert!(summary["energy"].is_null() && summary["timing"]["photons"] == 0);
    assert!(
        summary["timing"]["rays"].as_u64().unwrap() > 4 * 4 * 81 && tube["level_aperture_flux_lm"].as_f64() > Some(0.0)
    );
    let light = prepare("S1", |document| {
        document["method"] = json!("light_tracing");
        document["stop"] = json!({ "relative_error": 1e-3, "max_passes": 4 });
    });
    let estimate = first_passes(&light, 8);
    let summary = light.summary_json(&estimate, Spent::NOTHING, StoppedBy::MaxPasses);
    assert!(
        summary["energy"]["emitted_lm"].as_f64() > Some(0.0)
            && summary["tubes"][0]["into_room"]["flux_lm"].as_f64() > Some(0.0)
    );
}
