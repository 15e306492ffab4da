//! Bidirectional path tracing against references, exact form factors and the other methods.

use crate::reference;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::documents::{Folder, prepare, refusal, render};
use crate::reference::{number, rows};
use crate::scenes::{
    RADIUS, SIDE, assert_films, assert_grid, bent, disc_room, furnished, kernel, lambertian, light_tracing, peaked,
    run, sppm, straight, values, with_sun,
};
use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{JobDocument, to_scene};
use skyduct::integrator::Integrator;
use skyduct::integrator::bidirectional::{Bidirectional, Settings};
use skyduct::integrator::light_tracing::{self as light_tracing_method, LightTracing};
use skyduct::integrator::method::{Described, RefusalCode, Task};
use skyduct::integrator::path_tracing::{self, PathTracing};
use skyduct::integrator::sppm;
use skyduct::optics::spectrum::REC709_LUMINANCE;
use skyduct::optics::{Diffuser, DiffuserZone, Specular, Surface};
use skyduct::plan::{self, EffectKind, EffectRequest, EffectRequests, Effects};
use skyduct::scene::{EstimateKind, Face, Grid, Scene, View};
use skyduct::statistics::Moments;

fn both_ways(scene: &Scene, photons_per_pass: u64, samples: u32, seed: u64) -> Bidirectional<1> {
    let settings = Settings { photons_per_pass, samples_per_sensor: samples, samples_per_pixel: samples };
    Bidirectional::new(kernel(scene), &scene.grids, &scene.views, &settings, seed)
}

/// Compares a scene with an independent light tracer at 81 sensors, within 4.5 combined standard errors plus
/// `systematic`.
fn compare(scene: &str, truth: &str, systematic: f64, estimate: &str) {
    let truth = reference::json(&format!("scenes/{truth}.reference.json"));
    let values = |key: &str| {
        let rows = truth[key].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
        rows.map(|value| value.as_f64().unwrap()).collect::<Vec<_>>()
    };
    let merged = render(&prepare(scene, |document| {
        document["method"] = "bidirectional_path_tracing".into();
        document["grids"][0]["estimate"] = estimate.into();
        if estimate == "cell_average" {
            // what crosses a cell is noisier than what is connected to a point
            document["stop"]["relative_error"] = json!(0.0196);
        }
    }));
    assert_grid(&merged, &values("illuminance_lux"), &values("standard_error_lux"), 4.5, systematic, scene);
}

#[test]
fn straight_tube() {
    compare("S1", "S1.exact.point", 0.0, "point");
    compare("S1", "S1.exact.cell_average", 0.0, "cell_average");
}

/// The sun through a clear closure.
#[test]
fn sun_through_a_clear_closure() {
    compare("S2", "S2.exact.point", 0.0, "point");
    compare("S2", "S2.exact.cell_average", 0.0, "cell_average");
}

/// The reference has facets, this scene has cylinders: 0.3 % are allowed.
#[test]
fn bent_tube() {
    compare("S3", "S3.mesh.point", 0.003, "point");
}

/// Rooms from black to white under a disc, against radiosity with exact form factors, whatever the numbers of samples: with
/// few paths photons count most, with few photons paths.
#[test]
fn agrees_with_radiosity() {
    for (case, [floor, walls, ceiling, disc], photons, samples) in [
        ("S0", [0.0; 4], 4096, 16),
        ("S1r", [0.2, 0.5, 0.7, 0.7], 4096, 1),
        ("S1r", [0.2, 0.5, 0.7, 0.7], 64, 64),
        ("S3r", [0.9, 0.9, 0.9, 0.9], 4096, 32),
    ] {
        let mut truth = vec![f64::NAN; 81];
        for row in rows("room_radiosity.csv").iter().filter(|row| row[0].starts_with(case)) {
            truth[number(&row[2]) as usize * 9 + number(&row[1]) as usize] = number(&row[6]);
        }
        let scene = disc_room(floor, walls, ceiling, disc, EstimateKind::Point);
        let result = run(&scene, &both_ways(&scene, photons, samples, 3), 64);
        let errors: Vec<f64> = truth.iter().map(|lux| 2.5e-6 * lux).collect();
        assert_grid(&result, &truth, &errors, 4.5, 0.0, case);
        let mean = &result.grids[0].mean;
        println!("{} +- {}", mean.mean, mean.standard_error());
        assert!(mean.standard_error() < 0.01 * mean.mean, "{case}: {mean:?}");
    }
}

fn clear() -> Diffuser {
    Diffuser::Clear { transmittance: [0.8; 3] }
}

fn mixed(inner: DiffuserZone) -> Diffuser {
    Diffuser::Mixed {
        lambertian_radius_m: 0.6 * RADIUS,
        inner,
        lambertian_transmittance: [0.5; 3],
        lambertian_reflectance: [0.3; 3],
        clear_transmittance: [0.8; 3],
    }
}

/// Bent and straight tubes, closures that scatter in the sun and clear ones; without the sun a mirror.
#[test]
fn agrees_with_light_tracing() {
    for (what, tubes, sun, mirror) in [
        ("scattering", [bent(lambertian(0.5, 0.4)), straight(1.0, 0.95, peaked())], 60_000.0, false),
        ("clear in the sun", [bent(peaked()), straight(0.7, 0.95, clear())], 60_000.0, false),
        ("mixed in the sun", [bent(lambertian(0.3, 0.6)), straight(0.7, 0.95, mixed(DiffuserZone::Clear))], 6e4, false),
        ("bent and clear", [bent(clear()), straight(0.5, 0.9, Diffuser::Open)], 0.0, false),
        ("bent and mixed", [bent(mixed(DiffuserZone::Lambertian)), straight(0.5, 0.9, clear())], 0.0, false),
        ("mirror", [bent(clear()), straight(0.5, 0.9, lambertian(0.5, 0.4))], 0.0, true),
    ] {
        for estimate in [EstimateKind::CellAverage, EstimateKind::Point] {
            let mut scene = furnished(tubes.clone(), estimate);
            if sun > 0.0 {
                with_sun(&mut scene, sun, 50.0);
            }
            if mirror {
                let mirror = Specular { reflectance: [0.7; 3], roughness: 0.0 };
                scene.room.surfaces[Face::North as usize] =
                    Some(Surface { reflectance: [0.2; 3], specular: Some(mirror) });
            }
            if estimate == EstimateKind::Point && light_tracing_method::refuses_points(&kernel(&scene)).is_some() {
                continue;
            }
            let (truth, error) = values(&run(&scene, &light_tracing(&scene, 16_384, 1), 32));
            let found = run(&scene, &both_ways(&scene, 4_096, 64, 2), 32);
            assert_grid(&found, &truth, &error, 4.5, 0.0, what);
            let mean = &found.grids[0].mean;
            println!("{} +- {}", mean.mean, mean.standard_error());
            // a point in the beam sees the disc of the sun in few directions
            let bound = if sun > 0.0 && estimate == EstimateKind::Point { 0.1 } else { 0.01 };
            assert!(mean.standard_error() < bound * mean.mean, "{what}: {mean:?}");
        }
    }
}

/// At points, what a bent tube with a clear closure sends back, and what a mirror shows: as path tracing finds it.
#[test]
fn agrees_with_path_tracing_at_points() {
    let mut scene = furnished([bent(clear()), bent(mixed(DiffuserZone::Clear))], EstimateKind::Point);
    let mirror = Specular { reflectance: [0.7; 3], roughness: 0.0 };
    scene.room.surfaces[Face::North as usize] = Some(Surface { reflectance: [0.2; 3], specular: Some(mirror) });
    let settings = path_tracing::Settings { samples_per_sensor: 256, ..Default::default() };
    let paths = PathTracing::<1>::new(kernel(&scene), &scene.grids, &[], &settings, 2);
    let (truth, error) = values(&run(&scene, &paths, 48));
    assert_grid(&run(&scene, &both_ways(&scene, 8_192, 64, 2), 48), &truth, &error, 4.5, 0.0, "points");
}

/// Effects that are switched off are left out as light tracing leaves them out.
#[test]
fn effects_can_be_left_out() {
    let scene = furnished([bent(lambertian(0.5, 0.4)), bent(clear())], EstimateKind::CellAverage);
    for off in [EffectKind::Interreflection, EffectKind::GuideReturn, EffectKind::Objects] {
        let requests = EffectRequests::from([(off, EffectRequest::Off)]);
        let kernel = Arc::new(plan::compile(&scene, &Effects::of(&scene, &requests)).unwrap());
        let light = light_tracing_method::Settings { photons_per_pass: 32_768 };
        let light = LightTracing::<1>::new(kernel.clone(), &scene.grids, &light, 3);
        let settings = Settings { photons_per_pass: 4_096, samples_per_sensor: 64, samples_per_pixel: 1 };
        let found = Bidirectional::<1>::new(kernel, &scene.grids, &[], &settings, 4);
        let (truth, error) = values(&run(&scene, &light, 32));
        assert_grid(&run(&scene, &found, 32), &truth, &error, 4.5, 0.0, off.name());
    }
}

/// More sensors than a vertex is connected to.
#[test]
fn large_grids() {
    let mut scene = disc_room(0.2, 0.5, 0.7, 0.7, EstimateKind::Point);
    scene.grids = vec![Grid::new("grid".into(), 0.5, [40, 60], 0.0, [SIDE, SIDE], EstimateKind::Point)];
    let (truth, error) = values(&run(&scene, &light_tracing(&scene, 8_192, 1), 32));
    assert_grid(&run(&scene, &both_ways(&scene, 4_096, 2, 2), 32), &truth, &error, 5.0, 0.0, "large grid");
}

/// Views: diffusers and luminaires, a sun patch and the sunbeam in a glossy wall, and up a clear pipe, against photon mapping, its bias included, and where
/// it is able path tracing.
#[test]
fn views_agree() {
    let lambert = || straight(1.0, 0.95, lambertian(0.5, 0.4));
    let into = (DVec3::new(0.3, 0.2, 0.9), DVec3::new(1.9, 1.5, 1.2));
    let up = (DVec3::new(1.8, 0.2, 0.9), DVec3::new(0.9, 1.0, 1.9));
    let pipe = (DVec3::new(1.3, 1.1, 1.2), DVec3::new(1.5, 1.3, SIDE));
    for (what, tubes, (eye, target), sun) in [
        ("into the room", [lambert(), lambert()], into, 0.0),
        ("up in the sun", [lambert(), bent(peaked())], up, 60_000.0),
        ("sun patch", [bent(lambertian(0.5, 0.4)), straight(0.5, 0.95, clear())], into, 60_000.0),
        ("up the pipe", [lambert(), straight(0.5, 0.95, clear())], pipe, 0.0),
        ("up a bent pipe", [lambert(), bent(clear())], pipe, 0.0),
    ] {
        let mut scene = furnished(tubes, EstimateKind::Point);
        if sun > 0.0 {
            with_sun(&mut scene, sun, 50.0);
        }
        scene.grids = Vec::new();
        scene.views = vec![View::new("view".into(), eye, target, DVec3::Z, 1.2, [40, 32]).unwrap()];
        let found = run(&scene, &both_ways(&scene, 16_384, 8, 6), 32);
        let settings = sppm::Settings { photons_per_pass: 32_768, initial_radius_m: Some(0.04), ..Default::default() };
        let truth = run(&scene, &sppm(&scene, &settings, 5), 48);
        assert_films(&found.views[0], &truth.views[0], what);
        let task_scene = kernel(&scene);
        if path_tracing::Settings::default().refuses(&Task::whole(&scene, &task_scene)).is_none() {
            let settings = path_tracing::Settings { samples_per_pixel: 32, ..Default::default() };
            let paths = PathTracing::<1>::new(kernel(&scene), &[], &scene.views, &settings, 7);
            assert_films(&found.views[0], &run(&scene, &paths, 64).views[0], what);
        }
    }
}

/// The Cornell box (scene S4) against means of 8 x 8 pixel blocks by a public path tracer and light tracer: every block's
/// luminance within 5 combined standard errors (1024 of 63 degrees of freedom: a false alarm of 0.5 %), the mean of each
/// channel within 4 and the 0.13 % by which the reference's own renderers differ.
#[test]
fn agrees_on_the_cornell_box() {
    const BLOCKS: usize = 32;
    let mut document = reference::json("scenes/S4.json");
    document["views"][0]["size_px"] = json!([BLOCKS, BLOCKS]);
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    let (scene, ..) = to_scene(&document, &Folder).unwrap();
    let kernel = plan::compile(&scene, &Effects::of(&scene, &EffectRequests::new())).unwrap();
    let settings = Settings { photons_per_pass: 16_384, samples_per_pixel: 16, ..Settings::default() };
    let method = Bidirectional::<3>::new(Arc::new(kernel), &[], &scene.views, &settings, 1);
    let (mut blocks, mut channels) = (vec![Moments::default(); BLOCKS * BLOCKS], [Moments::default(); 3]);
    for pass in 0..64 {
        let pass = method.pass(pass, &AtomicBool::new(false)).unwrap();
        let mut rgb = [0.0; 3];
        for (block, of_block) in blocks.iter_mut().zip(pass.views[0].luminance.chunks_exact(3)) {
            block.push((0..3).map(|channel| REC709_LUMINANCE[channel] * of_block[channel]).sum());
            (0..3).for_each(|channel| rgb[channel] += of_block[channel] / (BLOCKS * BLOCKS) as f64);
        }
        channels.iter_mut().zip(rgb).for_each(|(moments, value)| moments.push(value));
    }
    let truth = reference::json("scenes/S4.blocks.reference.json");
    let weighted = |key: &str, block: usize| -> f64 {
        let value = &truth[key][block / BLOCKS][block % BLOCKS];
        (0..3).map(|channel| REC709_LUMINANCE[channel] * value[channel].as_f64().unwrap()).sum()
    };
    for (block, found) in blocks.iter().enumerate() {
        let expected = weighted("rgb", block);
        let error = found.standard_error().hypot(weighted("standard_error", block));
        assert!((found.mean - expected).abs() <= 5.0 * error, "block {block}: {found:?} is not {expected} +- {error}");
    }
    for channel in 0..3 {
        let expected = truth["mean_rgb"][channel].as_f64().unwrap();
        let (mean, error) = (channels[channel].mean, channels[channel].standard_error());
        println!("channel {channel}: {mean:.6} +- {error:.6}, reference {expected:.6}");
        assert!((mean - expected).abs() < 4.0 * error + 0.0013 * expected && error < 0.005 * expected);
    }
}

/// Points 2 mm from two walls: photons that are connected to them are rare and bright, so light tracing says no and the plan
/// picks this method, which agrees with path tracing.
#[test]
fn points_in_a_corner() {
    let document = |method: &str| {
        let mut document = reference::json("scenes/S1.json");
        document["method"] = method.into();
        document["grids"][0] = json!({ "name": "corner", "height_m": 0.5, "cells": [1, 1], "margin_m": 0.5 });
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        let mut scene = to_scene(&document, &Folder).unwrap().0;
        scene.grids[0].x_m = vec![0.002];
        scene.grids[0].y_m = vec![0.002];
        (scene, document.method.request())
    };
    let (scene, request) = document("light_tracing");
    let refusal = plan::Methods::choose(&scene, &kernel(&scene), &request).unwrap_err();
    assert_eq!(refusal.code, RefusalCode::PointsNearSurfaces, "{refusal}");
    let (scene, request) = document("auto");
    let chosen = plan::Methods::choose(&scene, &kernel(&scene), &request).unwrap().grids.unwrap();
    assert_eq!(chosen.method.name(), "bidirectional_path_tracing");
    let settings = path_tracing::Settings { samples_per_sensor: 4096, ..Default::default() };
    let paths = PathTracing::<1>::new(kernel(&scene), &scene.grids, &[], &settings, 2);
    let (truth, error) = values(&run(&scene, &paths, 48));
    let found = run(&scene, &both_ways(&scene, 4_096, 1024, 2), 48);
    assert_grid(&found, &truth, &error, 4.0, 0.0, "corner");
    assert!(found.grids[0].standard_error_lux(0) < 0.01 * truth[0] && error[0] < 0.01 * truth[0]);
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
    assert!(errors[0].pointer == "/method/photons_per_pass" && errors[0].detail.contains("1048576"), "{errors:?}");
}
