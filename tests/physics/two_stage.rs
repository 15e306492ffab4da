//! Two stages against references, exact form factors and the methods that follow light from its sources or back to them.

use crate::reference;
use std::f64::consts::PI;
use std::sync::Arc;

use crate::documents::{Folder, prepare, refusal, render, render_chunk};
use crate::reference::{number, rows};
use crate::scenes::{
    RADIUS, SIDE, assert_films, assert_grid, bent, cube, daylight, disc_room, furnished, kernel, lambertian,
    light_tracing, run, straight, values, with_sun,
};
use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, JobDocument, ValidJob, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::integrator::light_tracing::{self as light_tracing_method, LightTracing};
use skyduct::integrator::method::RefusalCode;
use skyduct::integrator::path_tracing::{self, PathTracing};
use skyduct::integrator::two_stage::{Settings, TwoStage};
use skyduct::optics::{Collector, Diffuser, Specular, Surface};
use skyduct::plan::{self, EffectRequests, Effects};
use skyduct::scene::{
    Channels, EstimateKind, Face, Grid, MeshObject, Scene, Segment, StraightOrBent, Tube, TubeShape, View,
};

fn stages(scene: &Scene, photons: u64, samples: u32, seed: u64) -> TwoStage<1> {
    TwoStage::new(kernel(scene), &scene.grids, &scene.views, &settings(photons, samples), seed)
}

fn settings(photons_per_pass: u64, samples: u32) -> Settings {
    Settings { photons_per_pass, samples_per_sensor: samples, samples_per_pixel: samples }
}

fn by_stages(document: &mut Value) {
    document["method"] = "two_stage".into();
}

/// Compares a scene with an independent light tracer at 81 sensors, within 4.5 combined standard errors plus
/// `systematic`.
fn compare(scene: &str, truth: &str, systematic: f64, edit: impl FnOnce(&mut Value)) {
    let truth = reference::json(&format!("scenes/{truth}.reference.json"));
    let values = |key: &str| {
        let rows = truth[key].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
        rows.map(|value| value.as_f64().unwrap()).collect::<Vec<_>>()
    };
    let merged = render(&prepare(scene, |document| {
        by_stages(document);
        edit(document);
    }));
    assert_grid(&merged, &values("illuminance_lux"), &values("standard_error_lux"), 4.5, systematic, scene);
}

#[test]
fn straight_tube() {
    compare("S1", "S1.exact.point", 0.0, |_| {});
    compare("S1", "S1.exact.cell_average", 0.0, |document| document["grids"][0]["estimate"] = "cell_average".into());
}

/// The reference of S3 has facets, the first scene has cylinders: 0.3 % are allowed.
#[test]
fn bent_and_mesh_tubes() {
    compare("S3", "S3.mesh.point", 0.003, |_| {});
    compare("S3_mesh", "S3.mesh.cell_average", 0.0, |document| {
        document["grids"][0]["estimate"] = "cell_average".into();
    });
}

/// Rooms from black to white under a disc, against radiosity with exact form factors.
#[test]
fn agrees_with_radiosity() {
    for (case, [floor, walls, ceiling, disc]) in
        [("S0", [0.0; 4]), ("S1r", [0.2, 0.5, 0.7, 0.7]), ("S3r", [0.9, 0.9, 0.9, 0.9])]
    {
        let mut truth = vec![f64::NAN; 81];
        for row in rows("room_radiosity.csv").iter().filter(|row| row[0].starts_with(case)) {
            truth[number(&row[2]) as usize * 9 + number(&row[1]) as usize] = number(&row[6]);
        }
        let scene = disc_room(floor, walls, ceiling, disc, EstimateKind::Point);
        let result = run(&scene, &stages(&scene, 4096, 256, 6), 32);
        let errors: Vec<f64> = truth.iter().map(|lux| 2.5e-6 * lux).collect();
        assert_grid(&result, &truth, &errors, 4.5, 0.0, case);
        let mean = &result.grids[0].mean;
        println!("{case}: {:.5}", mean.standard_error() / mean.mean);
        assert!(mean.standard_error() < 0.0015 * mean.mean, "{case}: {mean:?}");
    }
}

/// A straight tube under a dome that refracts: some light from below comes back.
fn domed(diffuser: Diffuser) -> Tube {
    let collector = Collector::DielectricDome { refractive_index: 1.49, thickness_m: 0.003, absorption_per_m: 0.0 };
    let segments = vec![Segment { length_m: 0.6, tilt: 0.0, azimuth: 0.0 }];
    let shape = StraightOrBent { reflectance: [0.95; 3].into(), segments, collector };
    Tube { shape: TubeShape::Cylinders(shape), ..straight(1.0, 0.9, diffuser) }
}

fn at(tube: Tube, x: f64, y: f64) -> Tube {
    Tube { centre: DVec2::new(x, y), ..tube }
}

fn against_light_tracing(scene: &Scene, most_error: f64, what: &str) {
    let (truth, error) = values(&run(scene, &light_tracing(scene, 32_768, 1), 32));
    let found = run(scene, &stages(scene, 8192, 256, 2), 32);
    assert_grid(&found, &truth, &error, 4.5, 0.0, what);
    let mean = &found.grids[0].mean;
    println!("{what}: {} +- {}", mean.mean, mean.standard_error());
    assert!(mean.standard_error() < most_error * mean.mean, "{what}: {mean:?}");
}

/// Straight, bent and domed tubes, furniture, a glossy wall, a luminaire; light that comes back down the guides.
#[test]
fn agrees_with_light_tracing_in_furnished_rooms() {
    for (tubes, sun, estimate) in [
        ([bent(lambertian(0.5, 0.4)), straight(1.0, 0.95, lambertian(0.6, 0.2))], 0.0, EstimateKind::Point),
        ([bent(lambertian(0.5, 0.4)), straight(1.0, 0.95, lambertian(0.6, 0.2))], 60_000.0, EstimateKind::CellAverage),
        ([domed(lambertian(0.3, 0.6)), bent(lambertian(0.3, 0.6))], 60_000.0, EstimateKind::Point),
    ] {
        let mut scene = furnished(tubes, estimate);
        if sun > 0.0 {
            with_sun(&mut scene, sun, 50.0);
        }
        against_light_tracing(&scene, 0.003, &format!("sun {sun}, {estimate:?}"));
    }
}

/// A mesh whose leaning face is cut off from part of a diffuser by its own horizon.
#[test]
fn leaning_surfaces() {
    let corners = [[0.3, 0.4, 0.2], [1.5, 0.4, 1.9], [1.5, 1.6, 1.9], [0.3, 1.6, 0.2]].map(DVec3::from);
    let mesh = TriangleMesh {
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0, 0],
        materials: vec!["board".into()],
    };
    let tubes = vec![at(straight(0.5, 0.95, lambertian(0.6, 0.2)), 1.3, 1.0)];
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(12, 5000.0, 40.0, 120.0), EstimateKind::Point);
    scene.room.meshes.push(MeshObject { mesh, surfaces: vec![Surface::diffuse([0.8; 3])] });
    with_sun(&mut scene, 30_000.0, 50.0);
    scene.grids = vec![Grid::new("grid".into(), 0.1, [5, 5], 0.1, [SIDE, SIDE], EstimateKind::Point)];
    against_light_tracing(&scene, 0.01, "leaning");
}

/// Mirrors and narrow lobes under the sky: light on its way by mirrors is followed up the tubes.
#[test]
fn mirrors_and_narrow_lobes() {
    for roughness in [0.0, 0.1] {
        let mut scene = furnished([bent(lambertian(0.5, 0.4)), domed(lambertian(0.6, 0.2))], EstimateKind::CellAverage);
        let specular = Specular { reflectance: [0.7; 3], roughness };
        scene.room.surfaces[Face::North as usize] = Some(Surface { reflectance: [0.2; 3], specular: Some(specular) });
        against_light_tracing(&scene, 0.015, &format!("roughness {roughness}"));
    }
}

/// The light of the sun leaves a diffuser in patterns. A metre below the tube they matter, and are not lost.
#[test]
fn patterns_of_the_sun() {
    for (altitude_deg, estimate) in
        [(30.0, EstimateKind::Point), (45.0, EstimateKind::CellAverage), (60.0, EstimateKind::Point)]
    {
        let mut scene = cube(
            0.2,
            0.5,
            0.7,
            vec![straight(0.4, 0.95, lambertian(0.6, 0.2))],
            daylight(12, 100.0, altitude_deg, 120.0),
            estimate,
        );
        with_sun(&mut scene, 60_000.0, altitude_deg);
        scene.grids = vec![Grid::new("grid".into(), SIDE - 1.0, [5, 5], 0.0, [SIDE, SIDE], estimate)];
        let (truth, error) = values(&run(&scene, &light_tracing(&scene, 65_536, 1), 32));
        let found = run(&scene, &stages(&scene, 16_384, 256, 2), 32);
        assert_grid(&found, &truth, &error, 4.0, 0.0, &format!("sun at {altitude_deg}"));
        let rms = |of: &dyn Fn(usize) -> f64| ((0..25).map(|k| of(k).powi(2)).sum::<f64>() / 25.0).sqrt();
        let relative = rms(&|k| error[k] / truth[k]);
        let found = rms(&|k| found.grids[0].standard_error_lux(k) / truth[k]);
        println!("sun at {altitude_deg}: standard errors {relative:.5}, {found:.5}");
        assert!(relative < 0.002 && found < 0.002, "{altitude_deg}: {relative} {found}");
    }
}

/// Interreflected light alone in the sun, where vertices meet rings, sectors and one photon: the sensors look past the tube.
#[test]
fn interreflection_in_the_sun() {
    let tube = at(straight(0.3, 0.95, lambertian(0.6, 0.2)), RADIUS, 0.5 * SIDE);
    let mut scene = cube(0.5, 0.8, 0.8, vec![tube], daylight(12, 100.0, 40.0, 120.0), EstimateKind::Point);
    with_sun(&mut scene, 60_000.0, 40.0);
    scene.grids = vec![Grid::new("grid".into(), SIDE - 0.01, [4, 4], 0.3, [SIDE, SIDE], EstimateKind::Point)];
    against_light_tracing(&scene, 0.01, "interreflection");
}

/// Tubes that touch walls and each other, points and cells on a plane 5 cm below them.
#[test]
fn tubes_beside_walls() {
    for estimate in [EstimateKind::Point, EstimateKind::CellAverage] {
        let tube = || straight(0.5, 0.95, lambertian(0.6, 0.2));
        let tubes = vec![at(tube(), RADIUS, RADIUS), at(tube(), RADIUS, 3.0 * RADIUS)];
        let mut scene = cube(0.3, 0.8, 0.7, tubes, daylight(12, 5000.0, 50.0, 120.0), estimate);
        with_sun(&mut scene, 20_000.0, 50.0);
        scene.grids = vec![Grid::new("grid".into(), SIDE - 0.05, [6, 6], 0.0, [SIDE, SIDE], estimate)];
        against_light_tracing(&scene, 0.01, &format!("beside walls, {estimate:?}"));
    }
}

/// Colours of tube, closure and room.
#[test]
fn three_channels() {
    let colour = [0.8, 0.5, 0.3];
    let tube = Tube {
        shape: TubeShape::Cylinders(StraightOrBent {
            reflectance: [0.9, 0.95, 0.8].into(),
            segments: vec![Segment { length_m: 0.8, tilt: 0.0, azimuth: 0.0 }],
            collector: Collector::Flat { transmittance: [0.9, 0.8, 0.7] },
        }),
        ..straight(1.0, 0.9, Diffuser::Lambertian { transmittance: [0.3, 0.5, 0.6], reflectance: [0.2, 0.1, 0.3] })
    };
    let mut scene = cube(0.3, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 40.0, 120.0), EstimateKind::Point);
    scene.room.surfaces[Face::North as usize] = Some(Surface::diffuse(colour));
    scene.channels = Channels::Rgb;
    with_sun(&mut scene, 40_000.0, 40.0);
    let light = light_tracing_method::Settings { photons_per_pass: 32_768 };
    let light = LightTracing::<3>::new(kernel(&scene), &scene.grids, &light, 1);
    let (truth, error) = values(&run(&scene, &light, 16));
    let found = TwoStage::<3>::new(kernel(&scene), &scene.grids, &[], &settings(8192, 128), 2);
    assert_grid(&run(&scene, &found, 16), &truth, &error, 4.5, 0.0, "three channels");
}

/// Effects that are switched off are left out as light tracing leaves them out.
#[test]
fn effects_can_be_left_out() {
    use skyduct::plan::{EffectKind, EffectRequest};
    let tubes = [bent(lambertian(0.5, 0.4)), domed(lambertian(0.6, 0.2))];
    let scene = furnished(tubes, EstimateKind::CellAverage);
    for off in [EffectKind::Interreflection, EffectKind::GuideReturn, EffectKind::Objects] {
        let requests = EffectRequests::from([(off, EffectRequest::Off)]);
        let kernel = Arc::new(plan::compile(&scene, &Effects::of(&scene, &requests)).unwrap());
        let light = light_tracing_method::Settings { photons_per_pass: 32_768 };
        let light = LightTracing::<1>::new(kernel.clone(), &scene.grids, &light, 3);
        let found = TwoStage::<1>::new(kernel, &scene.grids, &[], &settings(8192, 128), 4);
        let (truth, error) = values(&run(&scene, &light, 32));
        assert_grid(&run(&scene, &found, 32), &truth, &error, 4.5, 0.0, off.name());
    }
}

/// What stands a millimetre below the diffuser has an error that passes bring down.
#[test]
fn near_an_opening_the_error_stays_finite() {
    let mut scene = disc_room(0.2, 0.5, 0.7, 0.5, EstimateKind::Point);
    let margin = 0.5 * SIDE - 0.5 * RADIUS;
    scene.grids = vec![Grid::new("near".into(), SIDE - 0.001, [3, 1], margin, [SIDE, SIDE], EstimateKind::Point)];
    let found = run(&scene, &stages(&scene, 4096, 256, 2), 32);
    // nothing but the disc, of exitance 1000 lm over its area, is seen from there, up to reflections below 1 %
    let exitance = 1000.0 / (PI * RADIUS * RADIUS);
    let (lux, error) = values(&found);
    for (lux, error) in lux.iter().zip(&error) {
        println!("{lux} +- {error}, {exitance}");
        assert!((lux / exitance - 1.0).abs() < 0.01 + 4.0 * error / exitance && *error < 0.01 * exitance);
    }
}

/// Views into furnished rooms and up to diffusers, in blocks of 8 x 8 pixels, against path tracing: under the sky with a
/// mirror that shows a diffuser, and in the sun.
#[test]
fn views_agree_with_path_tracing() {
    for (eye, target, sun) in [
        (DVec3::new(0.3, 0.2, 0.9), DVec3::new(1.0, 2.0, 1.4), 0.0),
        (DVec3::new(1.8, 0.2, 0.9), DVec3::new(0.9, 1.0, 1.9), 60_000.0),
    ] {
        let mut scene =
            furnished([straight(1.0, 0.95, lambertian(0.5, 0.4)), bent(lambertian(0.5, 0.4))], EstimateKind::Point);
        if sun > 0.0 {
            with_sun(&mut scene, sun, 50.0);
        } else {
            let mirror = Specular { reflectance: [0.7; 3], roughness: 0.0 };
            scene.room.surfaces[Face::North as usize] = Some(Surface { reflectance: [0.1; 3], specular: Some(mirror) });
        }
        scene.grids = Vec::new();
        scene.views = vec![View::new("view".into(), eye, target, DVec3::Z, 1.2, [40, 32]).unwrap()];
        let paths = path_tracing::Settings { samples_per_pixel: 16, ..Default::default() };
        let paths = PathTracing::<1>::new(kernel(&scene), &[], &scene.views, &paths, 5);
        let truth = run(&scene, &paths, 64);
        let found = run(&scene, &stages(&scene, 8192, 16, 6), 64);
        assert_films(&found.views[0], &truth.views[0], &format!("view, sun {sun}"));
    }
}

/// Without tubes the second stage is left: the Cornell box, its floor and a view, against path tracing.
#[test]
fn electric_light_alone() {
    let mut document = reference::json("scenes/S4.json");
    document["views"][0]["size_px"] = json!([32, 32]);
    document["grids"] = json!([{ "name": "floor", "height_m": 0.1, "cells": [4, 4] }]);
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    let (scene, ..) = to_scene(&document, &Folder).unwrap();
    let paths = path_tracing::Settings { samples_per_sensor: 256, samples_per_pixel: 16 };
    let paths = PathTracing::<3>::new(kernel(&scene), &scene.grids, &scene.views, &paths, 1);
    let stages = Settings { photons_per_pass: 64, samples_per_sensor: 256, samples_per_pixel: 16 };
    let stages = TwoStage::<3>::new(kernel(&scene), &scene.grids, &scene.views, &stages, 2);
    let (truth, found) = (run(&scene, &paths, 32), run(&scene, &stages, 32));
    let (lux, error) = values(&truth);
    assert_grid(&found, &lux, &error, 4.5, 0.0, "electric light");
    assert_films(&found.views[0], &truth.views[0], "electric light");
    assert!(found.photons == 0);
}

fn document(edit: impl FnOnce(&mut Value)) -> Result<ValidJob, DocumentErrors> {
    let mut document = reference::json("scenes/S3.json");
    by_stages(&mut document);
    edit(&mut document);
    JobDocument::parse(document.to_string().as_bytes())
}

fn job(edit: impl FnOnce(&mut Value)) -> Result<skyduct::job::prepare::Prepared, DocumentErrors> {
    skyduct::job::prepare::prepare_document(&document(edit)?, &Folder)
}

/// Closures that are not wholly Lambertian are refused with what can compute them, and sun by way of mirrors.
#[test]
fn refuses_what_cannot_be_cut() {
    assert!(job(|_| {}).is_ok());
    let mixed = json!({ "kind": "mixed", "lambertian_radius_m": 0.06, "inner": "lambertian",
                        "lambertian_transmittance": 0.6, "clear_transmittance": 0.9 });
    let clear = json!({ "kind": "clear", "transmittance": 0.9 });
    for diffuser in [mixed, clear, json!({ "kind": "open" })] {
        let refused = job(|document| document["tubes"][0]["diffuser"] = diffuser.clone()).err().unwrap().0;
        assert_eq!(refused[0].pointer, "/method");
        let code = refusal(&document(|document| document["tubes"][0]["diffuser"] = diffuser).unwrap());
        assert_eq!(code.map(|refusal| refusal.code), Some(RefusalCode::ClearClosures));
    }
    let mirror = document(|document| {
        document["sky"]["direct_normal_illuminance_lux"] = json!(60_000);
        document["room"]["surfaces"]["floor"] = json!({ "reflectance": 0.1, "specular": 0.8 });
    });
    assert_eq!(refusal(&mirror.unwrap()).map(|refusal| refusal.code), Some(RefusalCode::SunByMirrors));
}

#[test]
fn settings_have_bounds() {
    for (field, values) in
        [("samples_per_sensor", [0, 65_537]), ("samples_per_pixel", [0, 4_097]), ("photons_per_pass", [63, 16_777_217])]
    {
        for value in values {
            let errors = job(|document| document["method"] = json!({ "kind": "two_stage", field: value }));
            let errors = errors.err().unwrap().0;
            assert!(errors[0].pointer == format!("/method/{field}") && errors[0].detail.contains(".."), "{errors:?}");
        }
    }
    for field in ["initial_radius_m", "alpha", "coefficient"] {
        let errors = job(|document| document["method"] = json!({ "kind": "two_stage", field: 0.5 })).err().unwrap().0;
        assert!(errors[0].detail.contains("not a field of"), "{errors:?}");
    }
    let prepared = job(|document| document["method"] = json!({ "kind": "two_stage", "samples_per_pixel": 7 })).unwrap();
    let all =
        json!({ "kind": "two_stage", "photons_per_pass": 8192, "samples_per_sensor": 256, "samples_per_pixel": 7 });
    assert_eq!(prepared.document["method"], all);
}

/// Fluxes of tubes are those of light tracing, the balance of energy is unknown; a bent tube in a black room.
#[test]
fn fluxes_are_known_and_the_balance_is_not() {
    let chunks = |method: &str| {
        let prepared = job(|document| {
            document["method"] = method.into();
            document["stop"] = json!({ "relative_error": 1e-3, "max_passes": 64 });
            document["room"]["surfaces"] = json!({ "floor": { "reflectance": 0 }, "walls": { "reflectance": 0 },
                                                   "ceiling": { "reflectance": 0 } });
        });
        let prepared = prepared.unwrap();
        let mut merged = prepared.empty_estimate();
        for index in 0..3 {
            let chunk = render_chunk(&prepared, index, &merged);
            merged.merge(&chunk.estimate);
        }
        prepared.summary_json(&merged, 1.0)
    };
    let (found, truth) = (chunks("two_stage"), chunks("light_tracing"));
    for field in ["at_collector", "at_diffuser", "into_room"] {
        let of = |summary: &Value, key: &str| summary["tubes"][0][field][key].as_f64().unwrap();
        let error = of(&found, "standard_error_lm").hypot(of(&truth, "standard_error_lm"));
        let (a, b) = (of(&found, "flux_lm"), of(&truth, "flux_lm"));
        assert!((a - b).abs() < 4.0 * error && error < 0.01 * b, "{field}: {a} is not {b} +- {error}");
    }
    assert!(found["energy"].is_null() && !truth["energy"].is_null());
    assert!(found["timing"]["photons"].as_u64() > Some(0) && found["timing"]["rays"].as_u64() > Some(0));
}
