//! Bidirectional path tracing: points in corners, threads, refusals. It agrees with others in `matrix`.

use std::sync::atomic::AtomicBool;

use crate::documents::{prepare, refusal};
use crate::reference;
use crate::scenes::{assert_grid, bent, built, clear, furnished, lambertian, run, straight, traceable, values};
use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, JobDocument, WarningCode, to_scene};
use skyduct::integrator::Integrator;
use skyduct::integrator::bidirectional::{Bidirectional, PathCounts};
use skyduct::integrator::method::RefusalCode;
use skyduct::integrator::path_tracing;
use skyduct::integrator::two_stage;
use skyduct::plan;
use skyduct::scene::{EstimateKind, Scene, View};

fn both_ways(scene: &Scene, photons_per_pass: u64, samples: u32, seed: u64) -> Bidirectional<1> {
    let sizes = PathCounts { photons: photons_per_pass, per_sensor: samples, per_pixel: samples };
    Bidirectional::new(traceable(scene), &scene.grids, &scene.views, sizes, seed)
}

/// Points 2 mm from two walls: photons that are connected to them are rare and bright, so light tracing says no. In a glossy room
/// the plan picks this method, in a diffuse one placed vertices, which finds what comes from so near by paths from the sensor.
/// Both agree with path tracing.
#[test]
fn points_in_a_corner() {
    let document = |method: &str, gloss: f64| {
        let mut document = reference::json("scenes/S1.json");
        document["method"] = method.into();
        let surface = json!({ "reflectance": 0.5, "specular": gloss, "roughness": 0.5 });
        document["room"]["surfaces"]["wall_east"] = surface;
        document["grids"][0] = json!({ "name": "corner", "height_m": 0.5, "cells": [1, 1], "margin_m": 0.5 });
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        let mut scene = to_scene(&document, &crate::documents::Folder).unwrap().0;
        scene.grids[0].x_m = vec![0.002];
        scene.grids[0].y_m = vec![0.002];
        (scene, document.method.request())
    };
    let (scene, request) = document("light_tracing", 0.0);
    let refusal = plan::Methods::choose(&scene, &traceable(&scene), &request).unwrap_err();
    assert_eq!(refusal.code, RefusalCode::PointsNearSurfaces, "{refusal}");
    let chosen = |gloss: f64| {
        let (scene, request) = document("auto", gloss);
        plan::Methods::choose(&scene, &traceable(&scene), &request).unwrap().grids.unwrap().method
    };
    assert_eq!([0.2, 0.0].map(|gloss| chosen(gloss).name()), ["two_stage"; 2]);
    let settings = path_tracing::Settings { samples_per_sensor: 4096, ..Default::default() };
    let paths = built(&scene, &settings, 2);
    let (truth, error) = values(&run(&scene, &*paths, 48));
    let stages = two_stage::Settings { samples_per_sensor: Some(4096), ..Default::default() };
    let stages = built(&scene, &stages, 3);
    for found in [run(&scene, &both_ways(&scene, 4_096, 1024, 2), 48), run(&scene, &*stages, 48)] {
        assert_grid(&found, &truth, &error, 4.0, 0.0, "corner");
        assert!(found.grids[0].standard_error_lux(0) < 0.01 * truth[0] && error[0] < 0.01 * truth[0]);
    }
}

/// The same bits on any number of threads.
#[test]
fn threads_do_not_matter() {
    let mut scene = furnished([bent(lambertian(0.5, 0.4)), straight(0.5, 0.95, clear())], EstimateKind::CellAverage);
    let (eye, target) = (DVec3::new(0.3, 0.2, 0.9), DVec3::new(1.9, 1.5, 1.2));
    scene.views = vec![View::new("view".into(), eye, target, DVec3::Z, 1.2, [16, 12]).unwrap()];
    let method = both_ways(&scene, 5_000, 2, 1);
    let pass = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let pass = pool.install(|| method.pass(3, &AtomicBool::new(false))).unwrap();
        (pass.grids[0].illuminance.clone(), pass.views[0].luminance.clone())
    };
    let one = pass(1);
    assert!(one == pass(2) && one == pass(5));
}

/// Cells between mirrors have errors that are too small, of which the reader is told; without mirrors there is no warning.
#[test]
fn warns_of_cells_between_mirrors() {
    let warns = |specular: f64| {
        let prepared = prepare("S1", |document| {
            document["method"] = "bidirectional_path_tracing".into();
            document["grids"][0]["estimate"] = "cell_average".into();
            document["room"]["surfaces"]["wall_east"] = json!({ "reflectance": 0.05, "specular": specular });
        });
        prepared.warnings.iter().any(|warning| warning.code == WarningCode::MirrorsByChance)
    };
    assert!(warns(0.85) && !warns(0.0));
}

/// Where chance alone would find the sun the method is refused with the reason; so are numbers out of bounds.
#[test]
fn refusals() {
    let job = |edit: &dyn Fn(&mut Value)| {
        let mut document = reference::json("scenes/S3.json");
        document["method"] = "bidirectional_path_tracing".into();
        document["sky"]["direct_normal_illuminance_lux"] = json!(60_000);
        edit(&mut document);
        JobDocument::parse(document.to_string().as_bytes())
    };
    let code =
        |edit: &dyn Fn(&mut Value)| job(edit).map(|document| refusal(&document).map(|refusal| refusal.code)).unwrap();
    assert_eq!(code(&|_| {}), None);
    let mirror = json!({ "reflectance": 0.1, "specular": 0.8 });
    let diffuser = json!({ "kind": "clear", "transmittance": 0.9 });
    let through = |document: &mut Value| document["tubes"][0]["diffuser"] = diffuser.clone();
    let reflected = |document: &mut Value| document["room"]["surfaces"]["floor"] = mirror.clone();
    for (edit, reason) in [
        (&through as &dyn Fn(&mut Value), RefusalCode::SunThroughClearClosures),
        (&reflected, RefusalCode::SunByMirrors),
    ] {
        assert_eq!(code(edit), Some(reason));
        let without_sun = |document: &mut Value| {
            edit(document);
            document["effects"] = json!({ "sun": "off" });
        };
        assert_eq!(code(&without_sun), None, "{reason}");
    }
    let many = json!({ "kind": "bidirectional_path_tracing", "photons_per_pass": 1_048_577 });
    let errors = job(&|document: &mut Value| document["method"] = many.clone()).err().unwrap().0;
    let expected = ("/method/photons_per_pass", FieldErrorCode::OutOfRange);
    assert_eq!((errors[0].pointer.as_str(), errors[0].code), expected, "{errors:?}");
}
