//! The deterministic solver against closed forms and independent references.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::reference::{json, number, rows};
use crate::scenes::{RADIUS, SIDE, cube, daylight, lambertian, straight, traceable};
use glam::{DVec2, DVec3};
use skyduct::analytic::holigilm::Holigilm;
use skyduct::analytic::holigilm::aperture::illuminance_above;
use skyduct::analytic::{Ending, Solution, Solver};
use skyduct::geometry::disc::disc_irradiance;
use skyduct::guide::{Guide, StraightGuide};
use skyduct::integrator::deterministic::installation;
use skyduct::optics::Diffuser;
use skyduct::sampling::Key;
use skyduct::scene::{EstimateKind, Grid, Scene};
use skyduct::sky::zenith::{default_formula, zenith_luminance_cd_m2};
use skyduct::statistics::Moments;

fn solve(scene: &Scene, target: f64) -> Solution {
    let method = Holigilm::new(installation(&traceable(scene), &scene.grids), target, 0);
    method.solve(&AtomicBool::new(false)).unwrap()
}

/// A grid of one point on the floor.
fn point(x: f64, y: f64, size: f64) -> Grid {
    let mut grid = Grid::new("point".into(), 0.0, [1, 1], 0.0, [size, size], EstimateKind::Point);
    (grid.x_m[0], grid.y_m[0]) = (x, y);
    grid
}

#[test]
fn clear_aperture() {
    aperture_agrees(0.98, &[12], 3);
}

#[test]
#[ignore = "a minute: all points, smoother skies, and the same without loss"]
fn clear_aperture_at_all_points_and_under_other_skies() {
    aperture_agrees(0.98, &[1, 5, 12], 1);
    aperture_agrees(1.0, &[1, 5, 12], 1);
}

/// Under a black ceiling the clear aperture's floor illuminance, one in `step` of the rows of a reflectance and a sky type, with the sun
/// 35 degrees high in the south, to the row's error and the own estimate.
fn aperture_agrees(reflectance: f64, types: &[u8], step: usize) {
    let table = rows("clear_aperture_floor.csv");
    let size = 4.0;
    for &cie_type in types {
        let mut day = daylight(cie_type, 1.0, 35.0, 180.0);
        if let Some(sky) = &mut day.sky {
            let formula = default_formula(sky.distribution.sky_type(), None);
            sky.zenith_luminance_cd_m2 = zenith_luminance_cd_m2(&sky.distribution, formula, 35f64.to_radians());
        }
        let rows: Vec<_> = table
            .iter()
            .filter(|row| number(&row[0]) == f64::from(cie_type) && number(&row[4]) == reflectance)
            .collect();
        assert!(rows.len() >= 8);
        let rows: Vec<_> = rows.into_iter().step_by(step).collect();
        let mut tube = straight(1.0, reflectance, Diffuser::Open);
        tube.centre = DVec2::splat(0.5 * size);
        let mut scene = cube(0.0, 0.0, 0.0, vec![tube], day, EstimateKind::Point);
        crate::scenes::resize(&mut scene, DVec3::new(size, size, SIDE));
        scene.grids =
            rows.iter().map(|row| point(0.5 * size + number(&row[2]), 0.5 * size + number(&row[3]), size)).collect();
        let solution = solve(&scene, 2e-4);
        let mut worst = 0f64;
        for (row, grid) in rows.iter().zip(&solution.grids) {
            let (truth, stated) = (number(&row[5]), number(&row[6]));
            let (value, error) = (grid.illuminance[0], grid.error[0]);
            // four of the own standard errors; the table's error is a bound
            let tolerance = stated + 4.0 * error + 0.5e-8;
            assert!((value - truth).abs() <= tolerance, "{row:?}: {value} +- {error}");
            assert!(error < 2.5e-4 * value, "{row:?}: own error {error}");
            worst = worst.max((value - truth).abs() / tolerance);
        }
        println!("type {cie_type} R {reflectance}: worst {worst:.2} of the tolerance");
    }
}

/// Without loss the aperture under a uniform sky is a Lambertian disc of the sky's luminance: E = pi L F to rounding.
#[test]
fn roof_opening() {
    for (x, y) in [(0.5 * SIDE, 0.5 * SIDE), (0.1, 0.3), (1.9, 1.0)] {
        let tube = straight(1.7, 1.0, Diffuser::Open);
        let mut scene = cube(0.0, 0.0, 0.0, vec![tube], daylight(5, 3000.0, 35.0, 0.0), EstimateKind::Point);
        scene.grids = vec![point(x, y, SIDE)];
        let offset = (DVec2::new(x, y) - DVec2::splat(0.5 * SIDE)).length();
        let exact = PI * 3000.0 * disc_irradiance(RADIUS, SIDE, offset).vertical;
        let value = solve(&scene, 1e-3).grids[0].illuminance[0];
        assert!((value / exact - 1.0).abs() < 1e-10, "{value} {exact}");
    }
}

/// The illuminance over the lower end under a uniform sky, every key, to its error and four of the own standard errors.
#[test]
fn profile_under_a_uniform_sky() {
    let table = json("diffuser_profile_uniform_sky.json");
    let guide = Guide::Straight(StraightGuide {
        radius: RADIUS,
        length: 1.0,
        reflectance: [0.98; 3].into(),
        collector_transmittance: [1.0; 3],
    });
    let sky = daylight(5, 1.0, 35.0, 0.0).sky.unwrap();
    let keys = table["E_over_L_at_rho_over_r"].as_object().unwrap();
    assert_eq!(keys.len(), 6);
    for (key, truth) in keys {
        let point = DVec2::new(number(key) * RADIUS, 0.0);
        let mut moments = Moments::default();
        for replicate in 0..16 {
            moments.push(illuminance_above(&guide, &sky, point, Key::new(replicate), 1 << 14));
        }
        let (truth, stated) = (truth.as_f64().unwrap(), table["err"][key].as_f64().unwrap());
        let error = moments.standard_error();
        println!("{key}: {} +- {error:.1e}, {truth} +- {stated:.1e}", moments.mean);
        assert!((moments.mean - truth).abs() <= stated + 4.0 * error, "{key}: {}", moments.mean);
        assert!(error < 1e-4 * truth);
    }
}

/// The same scene and seed give the same bits on one thread and on several.
#[test]
fn same_bits_on_any_number_of_threads() {
    let tube = straight(0.6, 0.97, Diffuser::Clear { transmittance: [0.9; 3] });
    let scene = cube(0.2, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 35.0, 225.0), EstimateKind::Point);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&scene, 0.01)).grids[0].illuminance.clone()
    };
    assert_eq!(on(1), on(3));
}

/// A raised flag ends the computation without a result.
#[test]
fn a_cancelled_computation_gives_nothing() {
    let tube = straight(0.6, 0.97, lambertian(0.6, 0.0));
    let scene = cube(0.2, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 35.0, 225.0), EstimateKind::Point);
    let method = Holigilm::new(installation(&traceable(&scene), &scene.grids), 0.01, 0);
    assert!(method.solve(&AtomicBool::new(true)).is_none());
}

/// A flag that is raised within a level gives the level before, bit by bit with its error, and says so; the error is larger
/// than asked.
#[test]
fn levels_that_were_done_count() {
    let tube = straight(0.6, 0.97, Diffuser::Clear { transmittance: [0.9; 3] });
    let mut scene = cube(0.2, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 35.0, 225.0), EstimateKind::Point);
    scene.grids = vec![Grid::new("plane".into(), 0.8, [2, 2], 0.1, [SIDE, SIDE], EstimateKind::Point)];
    // without the error of patches every level is better than the one before
    let mut room = installation(&traceable(&scene), &scene.grids);
    room.interreflection = false;
    let method = Holigilm::new(room, 1e-9, 0);
    let cancel = AtomicBool::new(false);
    let mut levels = Vec::new();
    let cut_short = method.refine(&cancel, &mut |level| {
        levels.push(level.clone());
        cancel.store(levels.len() == 2, Ordering::Relaxed);
    });
    let cut_short = cut_short.unwrap();
    assert_eq!((levels.len(), cut_short.ending), (2, Ending::CutShort));
    let values = |solution: &Solution| solution.grids[0].illuminance.clone();
    let errors = |solution: &Solution| solution.grids[0].error.clone();
    assert_eq!((values(&cut_short), errors(&cut_short)), (values(&levels[1]), errors(&levels[1])));
    assert_ne!(values(&levels[0]), values(&levels[1]));
    assert!(values(&cut_short).iter().zip(errors(&cut_short)).all(|(value, error)| error > 1e-9 * value));
    assert_eq!(cut_short.rays, levels[1].rays);
}
