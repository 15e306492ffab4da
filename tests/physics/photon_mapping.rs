//! Photon mapping with final gathering: its settings, its bias, and what it alone finds. It agrees with others in `matrix`.

use crate::documents::{first_passes, prepare};
use crate::reference;
use crate::scenes::{
    SIDE, assert_grid, bent, built, clear, cube, daylight, disc_room, light_tracing, radiosity, run, with_sun,
};
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, FieldErrorCode, JobDocument, ValidJob, WarningCode};
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::integrator::Integrator;
use skyduct::integrator::photon_mapping::Settings;
use skyduct::scene::{EstimateKind, Grid, Scene};

fn quick() -> Settings {
    Settings { photons_per_pass: Some(16_384), ..Settings::default() }
}

fn gathering(scene: &Scene, settings: &Settings, seed: u64) -> Box<dyn Integrator> {
    built(scene, settings, seed)
}

/// What points see of the sun through a clear bent tube is found by density estimates alone: in the mean against cells by
/// light tracing.
#[test]
fn the_sun_through_a_bent_clear_tube_at_points() {
    let scene = |estimate| {
        let mut scene = cube(0.3, 0.5, 0.7, vec![bent(clear())], daylight(12, 5000.0, 40.0, 120.0), estimate);
        scene.grids = vec![Grid::new("grid".into(), 0.3, [12, 12], 0.1, [SIDE, SIDE], estimate)];
        with_sun(&mut scene, 60_000.0, 50.0);
        scene
    };
    let (cells, points) = (scene(EstimateKind::CellAverage), scene(EstimateKind::Point));
    let of_points = run(&points, &*gathering(&points, &quick(), 2), 10).grids[0].mean;
    let of_cells = run(&cells, &*light_tracing(&cells, 16_384, 1), 8).grids[0].mean;
    // the midpoint rule in 144 cells
    let tolerance = 4.0 * of_cells.standard_error().hypot(of_points.standard_error()) + 0.01 * of_cells.mean;
    println!("{} {} +- {tolerance}", of_points.mean, of_cells.mean);
    assert!((of_points.mean - of_cells.mean).abs() < tolerance);
}

fn job(scene: &str, method: Value) -> Result<ValidJob, DocumentErrors> {
    let mut document = reference::json(&format!("scenes/{scene}.json"));
    document["method"] = method;
    JobDocument::parse(document.to_string().as_bytes())
}

#[test]
fn settings_have_bounds() {
    for (field, value, code) in [
        ("gather_rays", json!(0), FieldErrorCode::OutOfRange),
        ("gather_rays", json!(65_537), FieldErrorCode::OutOfRange),
        ("photons_per_pass", json!(63), FieldErrorCode::OutOfRange),
        ("initial_radius_m", json!(0), FieldErrorCode::OutOfRange),
        ("alpha", json!(0.5), FieldErrorCode::UnknownField),
        ("samples_per_pixel", json!(4), FieldErrorCode::UnknownField),
    ] {
        let errors = job("S1", json!({ "kind": "photon_mapping", field: value })).unwrap_err().0;
        assert!(errors.len() == 1 && errors[0].pointer == format!("/method/{field}"), "{errors:?}");
        assert_eq!(errors[0].code, code, "{errors:?}");
    }
    let errors = job("S1", json!({ "kind": "sppm", "gather_rays": 4 })).unwrap_err().0;
    assert_eq!(errors[0].code, FieldErrorCode::UnknownField, "{errors:?}");
    // what the accuracy decides is not filled in
    let given = json!({ "kind": "photon_mapping", "gather_rays": 64 });
    let document = job("S1", given.clone()).unwrap();
    assert_eq!(serde_json::to_value(&document).unwrap()["method"], given);
}

/// The plan says that the bias stays; fluxes of tubes and the balance of energy are known.
#[test]
fn results_name_bias_and_fluxes() {
    let prepared = prepare("S1", |document| {
        document["method"] = json!({ "kind": "photon_mapping", "photons_per_pass": 4096 });
        document["stop"] = json!({ "relative_error": 1e-3, "max_passes": 4 });
    });
    let choice = prepared.plan.methods.grids.clone().unwrap();
    let remark = choice.method.described().remark().unwrap();
    assert!(choice.method.name() == "photon_mapping" && choice.reason.ends_with(remark), "{choice:?}");
    let estimate = first_passes(&prepared, 8);
    let summary = prepared.summary_json(&estimate, Spent::NOTHING, StoppedBy::MaxPasses);
    assert!(summary["energy"]["emitted_lm"].as_f64() > Some(0.0));
    assert!(summary["tubes"][0]["into_room"]["flux_lm"].as_f64() > Some(0.0));
    assert!(estimate.rays > 4 * 81 * 256 && estimate.photons == 4 * 4096);
}

/// A radius of a fifth of the room has a bias of several times the noise, and its estimate covers it.
#[test]
fn the_bias_is_estimated() {
    let scene = disc_room(0.2, 0.5, 0.7, 0.7, EstimateKind::Point);
    let truth = radiosity("S1r", EstimateKind::Point).0;
    let settings = Settings { initial_radius_m: Some(0.4), gather_rays: Some(512), ..quick() };
    let found = run(&scene, &*gathering(&scene, &settings, 4), 16);
    let errors: Vec<f64> = truth.iter().map(|lux| 2.5e-6 * lux).collect();
    assert_grid(&found, &truth, &errors, 4.5, 0.0, "a large radius");
    let grid = &found.grids[0];
    let deviation = |sensor: usize| (grid.illuminance_lux(sensor) - truth[sensor]) / truth[sensor];
    let rms = ((0..81).map(|sensor| deviation(sensor).powi(2)).sum::<f64>() / 81.0).sqrt();
    let noise = (0..81).map(|sensor| grid.sensors[sensor].standard_error() / truth[sensor]).sum::<f64>() / 81.0;
    println!("rms deviation {rms}, noise {noise}");
    assert!(rms > 2.0 * noise);
}

/// Photon maps find by rare paths what a mirror sends to a glossy surface and it to the eye, and say so; a mirror alone they follow.
#[test]
fn photon_maps_warn_of_gloss_by_mirrors() {
    let warns = |method: &str, roughness: f64| {
        let prepared = prepare("S1", |document| {
            document["method"] = method.into();
            document["grids"] = json!([]);
            document["room"]["surfaces"]["wall_east"] = json!({ "reflectance": 0.05, "specular": 0.85 });
            let floor = json!({ "reflectance": 0.3, "specular": 0.2, "roughness": roughness });
            document["room"]["surfaces"]["floor"] = floor;
            document["views"] =
                json!([{ "name": "v", "eye_m": [1, 0.1, 1], "look_at_m": [1, 1, 0.5], "size_px": [8, 8] }]);
        });
        prepared.warnings.iter().any(|warning| warning.code == WarningCode::MirrorsByChance)
    };
    for method in ["sppm", "ppm", "photon_mapping"] {
        assert!(warns(method, 0.3) && !warns(method, 0.0), "{method}");
    }
}
