//! Square closures, over which a transition below the pipe spreads light evenly.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use skyduct::geometry::lambert::quadrilateral_irradiance;
use skyduct::integrator::{bidirectional, light_tracing, path_tracing, two_stage};
use skyduct::scene::{EstimateKind, Scene, Transition, Tube};

use crate::scenes::{self, SIDE, bent, built, cube, daylight, domed, furnished, lambertian, run, straight, with_sun};

/// A tube whose closure is a turned square of 0.3 m.
fn squared(tube: Tube, transmittance: f64) -> Tube {
    Tube { transition: Some(Transition { side_m: 0.3, azimuth: 0.4, transmittance }), ..tube }
}

/// Two tubes that send light back, with reflecting square closures, in a furnished room.
fn squares(estimate: EstimateKind) -> Scene {
    furnished([squared(bent(lambertian(0.5, 0.4)), 0.9), squared(domed(lambertian(0.6, 0.3)), 0.8)], estimate)
}

fn light_tracing(photons: u64) -> light_tracing::Settings {
    light_tracing::Settings { photons_per_pass: Some(photons) }
}

/// Photons of equal numbers arrive at the closure with the flux times the transmittance of the transition, to rounding.
#[test]
fn the_transition_takes_a_fraction_of_the_flux() {
    let round = cube(
        0.2,
        0.5,
        0.7,
        vec![straight(1.0, 0.9, lambertian(0.6, 0.0))],
        daylight(5, 5000.0, 40.0, 0.0),
        EstimateKind::Point,
    );
    let square = Scene { tubes: vec![squared(round.tubes[0].clone(), 0.85)], ..round.clone() };
    let stages = two_stage::Settings { photons_per_pass: Some(256), samples_per_sensor: Some(1), ..Default::default() };
    let by_light = [&round, &square].map(|scene| built(scene, &light_tracing(256), 1));
    let by_stages = [&round, &square].map(|scene| built(scene, &stages, 1));
    for methods in [by_light, by_stages] {
        let [round, square] = methods.map(|method| {
            let pass = method.pass(0, &AtomicBool::new(false)).unwrap();
            assert!(pass.totals.energy.relative_closure_error().abs() < 1e-12);
            pass.totals.tubes[0]
        });
        assert_eq!(round.at_collector, square.at_collector);
        for [round, square] in [[round.at_diffuser, square.at_diffuser], [round.into_room, square.into_room]] {
            assert!((square / round - 0.85).abs() < 1e-12, "{square} {round}");
        }
    }
}

/// A square of 0.1 m, at least 20 sides away, lights all sensors of a room like a disc of its area that sends as much flux, within 4.5
/// combined standard errors and the ratio of the second moments of the two, (1/12 - 1/(4 pi)) (s/d)^2 times less than 10.
#[test]
fn a_small_square_is_a_disc_of_its_area() {
    let room = |tube: Tube| cube(0.3, 0.5, 0.7, vec![tube], daylight(5, 5000.0, 40.0, 0.0), EstimateKind::Point);
    let side: f64 = 0.1;
    let tube = straight(1.0, 1.0, lambertian(0.6, 0.0));
    let transition = Some(Transition { side_m: side, azimuth: 0.7, transmittance: 1.0 });
    let square = room(Tube { opening_radius: 0.5 * side, transition, ..tube.clone() });
    let disc = room(Tube { opening_radius: side / PI.sqrt(), ..tube });
    let of_disc = run(&disc, &*built(&disc, &light_tracing(4096), 2), 32);
    let (mut truth, mut errors) = scenes::values(&of_disc);
    // perfect pipes pass all light of their openings
    truth.iter_mut().chain(&mut errors).for_each(|value| *value *= 0.25 * PI);
    let stages = two_stage::Settings { photons_per_pass: Some(512), ..Default::default() };
    let moments = 10.0 * (1.0 / 12.0 - 0.25 / PI) * (side / SIDE).powi(2);
    for (name, found) in [
        ("light tracing", run(&square, &*built(&square, &light_tracing(4096), 3), 32)),
        ("two stages", run(&square, &*built(&square, &stages, 3), 32)),
    ] {
        scenes::assert_grid(&found, &truth, &errors, 4.5, moments, name);
    }
}

/// In a black room a sensor gets the closed form of the square from two stages, with the error of the flux alone, and from photons that are
/// connected to it.
#[test]
fn direct_light_is_that_of_an_even_square() {
    let tube = squared(straight(1.0, 1.0, lambertian(0.5, 0.0)), 0.9);
    let scene = cube(0.0, 0.0, 0.0, vec![tube], daylight(5, 5000.0, 40.0, 0.0), EstimateKind::Point);
    let tube = &scenes::traceable(&scene).tubes[0];
    let corners = tube.corners().unwrap();
    for (name, method) in [
        ("two stages", built(&scene, &two_stage::Settings { photons_per_pass: Some(256), ..Default::default() }, 5)),
        ("light tracing", built(&scene, &light_tracing(2048), 5)),
        ("path tracing", built(&scene, &path_tracing::Settings { samples_per_sensor: 64, ..Default::default() }, 5)),
    ] {
        let found = run(&scene, &*method, 32);
        let (sky, _) = scene.daylight.as_ref().unwrap().horizontal_illuminance_lux();
        let exitance = 0.5 * 0.9 * sky * tube.pipe_area_m2() / tube.opening.area_m2();
        let grid = &scene.grids[0];
        let lux = |sensor| exitance * quadrilateral_irradiance(&corners, grid.centre(sensor), glam::DVec3::Z) / PI;
        let truth: Vec<f64> = (0..grid.len()).map(lux).collect();
        // the sky's illuminance is a quadrature
        scenes::assert_grid(&found, &truth, &vec![0.0; grid.len()], 5.0, 1e-6, name);
    }
}

/// Methods of four kinds agree, at points and in cells, where closures reflect, tubes send light back and openings lie in a furnished room's
/// ceiling: 96 comparisons by Student's t with 23 degrees of freedom, which fail by chance once in 200 times.
#[test]
fn methods_agree_where_light_comes_back() {
    for estimate in [EstimateKind::Point, EstimateKind::CellAverage] {
        let mut scene = squares(estimate);
        with_sun(&mut scene, 30_000.0, 50.0);
        let oracle = run(&scene, &*built(&scene, &light_tracing(16_384), 7), 32);
        let (truth, errors) = scenes::values(&oracle);
        let paths = path_tracing::Settings { samples_per_sensor: 256, ..Default::default() };
        let (photons_per_pass, samples_per_sensor) = (Some(2048), Some(64));
        let both = bidirectional::Settings { photons_per_pass, samples_per_sensor, ..Default::default() };
        let stages = two_stage::Settings { photons_per_pass, samples_per_sensor, ..Default::default() };
        for (name, method) in [
            ("path tracing", built(&scene, &paths, 8)),
            ("bidirectional", built(&scene, &both, 8)),
            ("two stages", built(&scene, &stages, 8)),
        ] {
            let found = run(&scene, &*method, 24);
            scenes::assert_grid(&found, &truth, &errors, 5.0, 0.0, &format!("{name}, {estimate:?}"));
        }
    }
}
