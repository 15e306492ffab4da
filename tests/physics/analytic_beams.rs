//! HOLIGILM where sunbeams from clear zones light walls, against light tracing.

use std::ops::RangeInclusive;
use std::sync::atomic::AtomicBool;

use crate::documents;
use crate::scenes::{self, daylight, straight, traceable};
use glam::{DVec2, DVec3};
use serde_json::json;
use skyduct::analytic::holigilm::Holigilm;
use skyduct::analytic::{Solution, Solver};
use skyduct::integrator::deterministic::installation;
use skyduct::optics::{Diffuser, DiffuserZone};
use skyduct::scene::{EstimateKind, Grid, Scene, Tube};
use skyduct::sky::{Sun, direction};
use skyduct::statistics::interval::two_sided_normal_quantile;

/// Probability with which four standard errors of a normal value are passed; all sensors of a test together get it.
const FALSE_ALARM: f64 = 6.3e-5;

fn solve(scene: &Scene, seed: u64) -> Solution {
    let method = Holigilm::new(installation(&traceable(scene), &scene.grids), 1e-2, seed);
    method.solve(&AtomicBool::new(false)).unwrap()
}

/// A room of reflectances of floor, walls and ceiling in the sun and a clear sky.
fn room(size: [f64; 3], [floor, walls, ceiling]: [f64; 3], tubes: Vec<Tube>, sun_deg: [f64; 2], grid: Grid) -> Scene {
    let [altitude, azimuth] = sun_deg;
    let mut scene =
        scenes::cube(floor, walls, ceiling, tubes, daylight(12, 4000.0, altitude, azimuth), EstimateKind::Point);
    crate::scenes::resize(&mut scene, DVec3::from_array(size));
    let direction = direction(altitude.to_radians(), azimuth.to_radians());
    scene.daylight.as_mut().unwrap().sun = Some(Sun { direction, normal_illuminance_lux: 60_000.0 });
    scene.grids = vec![grid];
    scene
}

fn clear(centre: [f64; 2], radius: f64, length: f64) -> Tube {
    of(centre, radius, length, Diffuser::Clear { transmittance: [0.9; 3] })
}

fn of(centre: [f64; 2], radius: f64, length: f64, diffuser: Diffuser) -> Tube {
    let mut tube = straight(length, 0.98, diffuser);
    (tube.centre, tube.opening_radius) = (DVec2::from_array(centre), radius);
    tube
}

/// Points at the given places.
fn points(height: f64, xs: &[f64], ys: &[f64]) -> Grid {
    let mut grid = Grid::new("points".into(), height, [xs.len(), ys.len()], 0.0, [1.0, 1.0], EstimateKind::Point);
    (grid.x_m, grid.y_m) = (xs.to_vec(), ys.to_vec());
    grid
}

/// Cells over the whole room.
fn cells(height: f64, count: [usize; 2], size: [f64; 2]) -> Grid {
    Grid::new("cells".into(), height, count, 0.0, size, EstimateKind::CellAverage)
}

fn mixed(inner: DiffuserZone) -> Diffuser {
    Diffuser::Mixed {
        lambertian_radius_m: 0.08,
        inner,
        lambertian_transmittance: [0.6; 3],
        lambertian_reflectance: [0.2; 3],
        clear_transmittance: [0.9; 3],
    }
}

/// Beams on walls: a low, a middle and a high sun; points at table height, on the floor at the foot of a lit wall and just
/// below the ceiling; cell averages; two tubes with mixed closures; an open tube near a corner.
fn kinds() -> Vec<(&'static str, Scene)> {
    let halls = [4.0, 3.0, 2.7];
    let light = [0.3, 0.8, 0.85];
    vec![
        (
            "table",
            room(halls, light, vec![clear([1.0, 1.0], 0.15, 1.0)], [30.0, 130.0], {
                points(0.85, &[0.22, 1.8, 3.78], &[0.5, 0.83, 1.17, 2.5])
            }),
        ),
        (
            "above the table",
            room(halls, [0.2, 0.5, 0.7], vec![clear([2.0, 1.5], 0.15, 1.0)], [45.0, 130.0], {
                points(1.4, &[0.15, 1.1, 3.85], &[0.2, 1.0, 1.9, 2.8])
            }),
        ),
        (
            "foot of a wall",
            room([3.0, 3.0, 2.7], [0.3, 0.7, 0.8], vec![clear([0.7, 0.6], 0.15, 1.0)], [60.0, 200.0], {
                points(0.0, &[0.1, 0.6, 2.2], &[0.1, 1.3, 2.1, 2.9])
            }),
        ),
        (
            "cells at the foot of a wall",
            room([3.0, 3.0, 2.7], [0.2, 0.8, 0.8], vec![clear([0.8, 0.9], 0.15, 1.0)], [45.0, 160.0], {
                cells(0.0, [6, 6], [3.0, 3.0])
            }),
        ),
        (
            "low sun, cells",
            room(halls, light, vec![of([2.5, 1.2], 0.15, 1.0, Diffuser::Open)], [20.0, 250.0], {
                cells(0.85, [5, 4], [4.0, 3.0])
            }),
        ),
        (
            "high sun in a corner",
            room([3.0, 3.0, 2.7], [0.6, 0.7, 0.8], vec![of([0.4, 0.5], 0.15, 0.4, Diffuser::Open)], [75.0, 10.0], {
                points(0.0, &[0.1, 1.2, 2.5], &[1.6, 2.0, 2.4, 2.8])
            }),
        ),
        (
            "two mixed closures",
            room(
                halls,
                [0.3, 0.6, 0.8],
                vec![
                    of([1.0, 1.0], 0.15, 1.0, mixed(DiffuserZone::Clear)),
                    of([3.0, 2.0], 0.15, 0.5, mixed(DiffuserZone::Lambertian)),
                ],
                [35.0, 100.0],
                points(0.8, &[0.15, 2.2, 3.85], &[0.15, 0.9, 2.3, 2.85]),
            ),
        ),
        (
            "below the ceiling",
            room(halls, light, vec![clear([1.2, 0.8], 0.25, 0.5)], [30.0, 40.0], {
                points(2.0, &[1.75, 2.75, 3.75], &[0.25, 0.75, 2.25, 2.75])
            }),
        ),
    ]
}

/// One of points and one of cells below a clear closure, an open end, and mixed closures.
const USUAL: [&str; 4] = ["table", "cells at the foot of a wall", "high sun in a corner", "two mixed closures"];

#[test]
fn agrees_with_light_tracing() {
    agree(&[0], |name| USUAL.contains(&name));
}

#[test]
#[ignore = "a minute: other places of beams, and other random numbers"]
fn agrees_with_light_tracing_elsewhere_and_with_other_seeds() {
    agree(&[0], |name| !USUAL.contains(&name));
    agree(&[1, 2], |_| true);
}

/// Kinds of these names, with each of the seeds, sensor by sensor within four combined standard errors, corrected for the number of
/// sensors; the root mean square of a grid within 1.5 of them, where errors of few passes spread as Student's distribution
/// does. The light is accounted for to 0.2 %.
fn agree(seeds: &[u64], is_taken: impl Fn(&str) -> bool) {
    let mut kinds = kinds();
    kinds.retain(|(name, _)| is_taken(name));
    assert!(!kinds.is_empty());
    let sensors: usize = kinds.iter().map(|(_, scene)| scene.grids[0].len()).sum();
    let most = two_sided_normal_quantile(1.0 - FALSE_ALARM / (sensors * seeds.len()) as f64);
    for (name, scene) in &kinds {
        let passes = 12;
        let traced = scenes::run(scene, &*scenes::light_tracing(scene, 1 << 13, 7), passes);
        // the variance of Student's distribution
        let freedom = passes as f64 - 1.0;
        let most_rms = 1.5 * (freedom / (freedom - 2.0)).sqrt();
        for &seed in seeds {
            let solution = solve(scene, seed);
            let (mut worst, mut squares) = (0f64, 0.0);
            for sensor in 0..scene.grids[0].len() {
                let (value, own) = (solution.grids[0].illuminance[sensor], solution.grids[0].error[sensor]);
                let (other, error) =
                    (traced.grids[0].illuminance_lux(sensor), traced.grids[0].standard_error_lux(sensor));
                let z = (value - other) / own.hypot(error);
                worst = worst.max(z.abs());
                squares += z * z;
                assert!(z.abs() < most, "{name}, seed {seed}, {sensor}: {value} +- {own}, {other} +- {error}");
                assert!(own < 0.03 * value, "{name}, seed {seed}, {sensor}: {value} +- {own}");
            }
            let rms = (squares / scene.grids[0].len() as f64).sqrt();
            println!("{name}, seed {seed}: worst z {worst:.2} of {most:.2}, rms {rms:.2}");
            assert!(rms < most_rms, "{name}, seed {seed}: rms z {rms}");
            let balance = solution.balance;
            let gone = balance.collector
                + balance.guide
                + balance.guide_top
                + balance.diffuser
                + balance.room
                + balance.open_surfaces;
            assert!((gone / balance.emitted - 1.0).abs() < 2e-3, "{name}, seed {seed}: {balance:?}");
        }
    }
}

#[test]
fn sensors_beside_a_lit_wall() {
    agree_beside_a_lit_wall(1..=1);
}

#[test]
#[ignore = "the same with other random numbers"]
fn sensors_beside_a_lit_wall_with_other_seeds() {
    agree_beside_a_lit_wall(2..=3);
}

/// Sensors beside a lit wall, where patches of radiosity once were 9 % off: within four combined standard errors of light
/// tracing's values (40 s of passes), corrected for their number and three seeds; 0.5 % of own error and more is told.
fn agree_beside_a_lit_wall(seeds: RangeInclusive<u64>) {
    let truth =
        [(169.721, 0.202), (167.018, 0.133), (172.225, 0.129), (170.855, 0.135), (161.913, 0.121), (143.268, 0.106)];
    let most = two_sided_normal_quantile(1.0 - FALSE_ALARM / (3 * truth.len()) as f64);
    for seed in seeds {
        let prepared = documents::prepare("S1", |document| {
            let surface = |reflectance: f64| json!({ "reflectance": reflectance });
            *document = json!({
                "sky": { "cie_type": 12, "sun_position": { "altitude_deg": 30, "azimuth_deg": 130 } },
                "room": {
                    "size_m": [4, 3, 2.7],
                    "surfaces": { "floor": surface(0.3), "walls": surface(0.8), "ceiling": surface(0.85) }
                },
                "tubes": [{
                    "centre_m": [1, 1],
                    "diameter_m": 0.3,
                    "reflectance": 0.98,
                    "segments": [{ "length_m": 1 }],
                    "collector": { "kind": "open" },
                    "diffuser": { "kind": "clear", "transmittance": 0.9 }
                }],
                "grids": [{ "name": "g", "height_m": 0.85, "cells": [9, 9], "margin_m": 0, "estimate": "point" }],
                "stop": { "relative_error": 0.005 },
                "seed": seed,
                "method": "holigilm"
            });
        });
        let estimate = documents::first_passes(&prepared, 8);
        for (row, (lux, error)) in truth.into_iter().enumerate() {
            let (value, own) =
                (estimate.grids[0].illuminance_lux(9 * row + 8), estimate.grids[0].standard_error_lux(9 * row + 8));
            let z = (value - lux) / own.hypot(error);
            println!("seed {seed}, row {row}: {value:.2} +- {own:.2}, z {z:.2}");
            assert!(z.abs() < most && own < 0.005 * value, "seed {seed}, row {row}: {value} +- {own} is not {lux}");
        }
    }
}
