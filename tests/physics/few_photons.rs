//! Errors of sensors that few photons find, or none: one photon's worth at least, where light can come at all.

use std::sync::atomic::AtomicBool;

use crate::documents::prepare;
use crate::mesh_objects::closed_cube;
use crate::scenes::{
    RADIUS, assert_grid, bent, built, clear, cube, daylight, furnished, lambertian, light_tracing, resize, run, sppm,
    straight, values, with_sun,
};
use glam::{DVec2, DVec3};
use serde_json::json;
use skyduct::document::WarningCode;
use skyduct::engine::cancel::Stop;
use skyduct::engine::progress::StoppedBy;
use skyduct::integrator::{Integrator, photon_mapping, ppm, sppm};
use skyduct::optics::{Specular, Surface};
use skyduct::scene::{Channels, EstimateKind, Grid, Scene, TubeShape};

/// Every method that counts the photons of its sensors, with few of them in a pass.
fn methods(scene: &Scene, photons_per_pass: u64) -> Vec<(&'static str, Box<dyn Integrator>)> {
    let (ppm, photon_mapping) = (ppm::Settings::default(), photon_mapping::Settings::default());
    let ppm = ppm::Settings { photons_per_pass, samples_per_sensor: 4, ..ppm };
    let photon_mapping =
        photon_mapping::Settings { photons_per_pass: Some(photons_per_pass), gather_rays: Some(16), ..photon_mapping };
    let settings = sppm::Settings { photons_per_pass, ..sppm::Settings::default() };
    vec![
        ("light_tracing", light_tracing(scene, photons_per_pass, 1)),
        ("sppm", sppm(scene, &settings, 1)),
        ("ppm", built(scene, &ppm, 1)),
        ("photon_mapping", built(scene, &photon_mapping, 1)),
    ]
}

/// A slim and long room, dim at its far end, lit by a slender tube through a Lambertian diffuser; points below the ceiling.
fn corridor() -> Scene {
    let tube = straight(1.0, 0.98, lambertian(0.6, 0.3));
    let mut scene = cube(0.9, 0.2, 0.1, vec![tube], daylight(15, 3000.0, 20.0, 160.0), EstimateKind::Point);
    resize(&mut scene, DVec3::new(0.8, 11.7, 2.3));
    scene.tubes[0].centre = DVec2::new(0.55, 6.6);
    scene.tubes[0].opening_radius = 0.25 * RADIUS;
    scene.grids = vec![Grid::new("far".into(), 2.2, [4, 3], 0.0, [0.8, 11.7], EstimateKind::Point)];
    scene
}

/// Points count each photon that was connected to all of them, where no surface concentrates light; cells, and points of rooms with
/// glossy walls, count one photon of a pass. The room is low, under a slender tube beside a wall, below sky and a high sun.
#[test]
fn points_count_the_photons_that_were_connected() {
    let found = |glossy: bool| {
        let mut tube = straight(0.6, 0.98, lambertian(0.6, 0.3));
        (tube.centre, tube.opening_radius) = (DVec2::new(0.3, 1.1), 0.05);
        let TubeShape::Cylinders(cylinders) = &mut tube.shape else { panic!("a mesh") };
        cylinders.reflectance = [0.98, 0.95, 0.9].into();
        let sky = daylight(12, 5000.0, 82.0, 2f64.to_degrees());
        let mut scene = cube(0.3, 0.3, 0.3, vec![tube], sky, EstimateKind::Point);
        let size = DVec3::new(3.0, 2.2, 2.5);
        resize(&mut scene, size);
        with_sun(&mut scene, 20_000.0, 82.0);
        scene.channels = Channels::Rgb;
        if glossy {
            let specular = Some(Specular { reflectance: [0.5; 3], roughness: 0.4 });
            let surface = Surface { specular, ..Surface::diffuse([0.3; 3]) };
            (0..6).for_each(|face| scene.room.enclosure.paint(face, Some(surface)));
        }
        let grid = |height, cells, estimate| Grid::new("grid".into(), height, cells, 0.0, [size.x, size.y], estimate);
        scene.grids = vec![
            grid(0.0, [6, 7], EstimateKind::Point),
            grid(1.0, [4, 5], EstimateKind::Point),
            grid(0.4, [3, 3], EstimateKind::CellAverage),
        ];
        let method = light_tracing(&scene, 256, 1);
        let pass = method.pass(0, &AtomicBool::new(false)).unwrap();
        [0, 2].map(|grid: usize| pass.grids[grid].photons.iter().map(|count| count.found).collect::<Vec<_>>())
    };
    let [points, cells] = found(false);
    assert!(points.iter().all(|found| *found == points[0] && (64.0..=256.0).contains(found)), "{points:?}");
    assert_eq!(cells, [1.0; 9]);
    assert_eq!(found(true)[0], [1.0; 42]);
}

/// Points that no photon found in any pass, but for the light that is connected, are within 4.5 of their errors of what light
/// tracing finds there: 24 comparisons, of which one is beyond with a probability of 1.6e-4, Poisson's tail apart. Their spread
/// alone tells nothing of the light that they miss.
#[test]
fn points_that_found_no_photon_have_the_error_of_one() {
    let scene = corridor();
    let (truth, error) = values(&run(&scene, &*light_tracing(&scene, 8192, 7), 64));
    for (name, method) in methods(&scene, 4096).iter().filter(|(name, _)| name.ends_with("ppm")) {
        let estimate = run(&scene, method.as_ref(), 32);
        let grid = &estimate.grids[0];
        let too_few = (0..12).filter(|sensor| {
            let missing = (grid.illuminance_lux(*sensor) - truth[*sensor]).abs();
            grid.photons[*sensor].found == 0.0 && missing > 10.0 * grid.sensors[*sensor].standard_error()
        });
        assert!(too_few.count() > 0, "{name} found photons everywhere");
        assert_grid(&estimate, &truth, &error, 4.5, 0.0, name);
    }
}

/// Nothing comes through a black pipe of a thousand diameters but what few photons could tell: that is no exact 0.
#[test]
fn what_no_photon_told_is_not_exactly_zero() {
    let pipe = straight(2000.0 * RADIUS, 0.0, lambertian(0.6, 0.3));
    let mut scene = cube(0.3, 0.5, 0.7, vec![pipe], daylight(5, 3000.0, 35.0, 0.0), EstimateKind::Point);
    scene.grids = vec![Grid::new("grid".into(), 0.5, [2, 1], 0.3, [2.0, 2.0], EstimateKind::Point)];
    for (name, method) in methods(&scene, 64) {
        let estimate = run(&scene, method.as_ref(), 2);
        let grid = &estimate.grids[0];
        for sensor in 0..2 {
            assert!(grid.standard_error_lux(sensor) > 0.0, "{name}: {}", grid.illuminance_lux(sensor));
        }
    }
}

/// Inside a box or a closed mesh it is dark without an error; and without reflection nothing but direct light comes, which has
/// its own error alone.
#[test]
fn what_is_known_to_be_dark_stays_exact() {
    let mut scene = furnished([bent(lambertian(0.5, 0.4)), straight(0.5, 0.95, clear())], EstimateKind::Point);
    scene.room.meshes = vec![closed_cube(DVec3::new(0.3, 0.2, 0.1), 0.6)];
    let inside = [DVec2::new(1.2, 0.6), DVec2::new(0.6, 0.5)];
    scene.grids = inside
        .map(|place| {
            let mut grid = Grid::new("inside".into(), 0.5, [1, 1], 0.0, [2.0, 2.0], EstimateKind::Point);
            (grid.x_m, grid.y_m) = (vec![place.x], vec![place.y]);
            grid
        })
        .to_vec();
    for (name, method) in methods(&scene, 256) {
        for grid in &run(&scene, method.as_ref(), 2).grids {
            assert_eq!((grid.illuminance_lux(0), grid.standard_error_lux(0)), (0.0, 0.0), "{name}");
        }
    }
    let pipe = straight(0.5, 0.95, lambertian(0.6, 0.3));
    let mut black = cube(0.0, 0.0, 0.0, vec![pipe], daylight(5, 3000.0, 35.0, 0.0), EstimateKind::Point);
    black.grids[0] = Grid::new("grid".into(), 0.5, [3, 1], 0.3, [2.0, 2.0], EstimateKind::Point);
    for (name, method) in methods(&black, 256).iter().skip(1) {
        let grid = &run(&black, method.as_ref(), 4).grids[0];
        for sensor in 0..3 {
            assert_eq!(grid.error_of_few_photons_lux(sensor), 0.0, "{name}");
        }
    }
}

/// A board in the beam of the sun and nothing else that reflects: no light comes to the floor, by no method. The job ends by itself
/// and says why, with the error of the photon that none was.
#[test]
fn a_job_that_no_light_reaches_ends_and_says_so() {
    for (method, told) in [("light_tracing", true), ("bidirectional_path_tracing", false)] {
        let prepared = prepare("S1", |job| {
            let black = json!({ "reflectance": 0 });
            job["sky"] = json!({
                "cie_type": 12, "sun_position": { "altitude_deg": 90, "azimuth_deg": 180 },
                "diffuse_horizontal_illuminance_lux": 0, "direct_normal_illuminance_lux": 100_000
            });
            job["room"]["surfaces"] = json!({ "floor": black, "walls": black, "ceiling": black });
            let board = json!({
                "kind": "box", "size_m": [0.8, 0.8, 0.05], "position_m": [1.016, 1.016, 1.0], "surface": black
            });
            job["room"]["objects"] = json!([board]);
            job["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 1 });
            let average = json!({ "name": "mean", "height_m": 0, "cells": [9, 9], "estimate": "cell_average" });
            job["grids"] = json!([job["grids"][0], average]);
            job["method"] = json!(method);
            job["stop"] = json!({ "relative_error": 0.02, "max_seconds": 300 });
        });
        let rendered = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap();
        assert_eq!(rendered.stopped_by, StoppedBy::NoLight, "{method}");
        assert!(rendered.estimate.passes < 100, "{method}: {}", rendered.estimate.passes);
        let cells = &rendered.estimate.grids[1];
        assert_eq!((cells.illuminance_lux(40), cells.standard_error_lux(40) > 0.0), (0.0, told), "{method}");
        let warnings = prepared.render_warnings(&rendered.estimate);
        let said = warnings.iter().find(|warning| warning.code == WarningCode::NoLight).unwrap();
        assert!(said.detail.contains("\"floor\""), "{}", said.detail);
    }
}
