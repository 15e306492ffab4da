//! The interreflection of a box room against `room_radiosity.csv`.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use crate::reference::{number, rows};
use glam::DVec3;
use skyduct::analytic::patches::Patch;
use skyduct::analytic::radiosity::{Interreflection, Unsolved};
use skyduct::geometry::disc::{disc_irradiance, disc_polygon_area};

const SIDE: f64 = 2.032;
const RADIUS: f64 = 0.127;
static GOES_ON: AtomicBool = AtomicBool::new(false);

/// Exitance of the disc of 1000 lm.
fn exitance() -> f64 {
    1000.0 / (PI * RADIUS * RADIUS)
}

fn direct(point: DVec3, normal: DVec3) -> f64 {
    let toward_axis = (DVec3::splat(0.5 * SIDE) - point).truncate();
    let depth = SIDE - point.z;
    if depth <= 0.0 {
        return 0.0;
    }
    let disc = disc_irradiance(RADIUS, depth, toward_axis.length());
    let across = if toward_axis.length() > 0.0 { toward_axis.normalize() } else { toward_axis };
    exitance() * (normal.z * disc.vertical + normal.truncate().dot(across) * disc.toward_axis)
}

/// Mean over a patch by Gauss' rule of 4 x 4 points.
fn direct_mean(patch: &Patch) -> f64 {
    let nodes = [(-0.8611363115940526, 0.3478548451374538), (-0.3399810435848563, 0.6521451548625461)];
    let nodes = nodes.into_iter().flat_map(|(x, w)| [(x, w), (-x, w)]).collect::<Vec<_>>();
    let half = 0.5 * (patch.high - patch.low);
    let (u, v) = ((patch.axis() + 1) % 3, (patch.axis() + 2) % 3);
    let mut sum = 0.0;
    for (a, weight_a) in &nodes {
        for (b, weight_b) in &nodes {
            let mut point = patch.centre();
            point[u] += a * half[u];
            point[v] += b * half[v];
            sum += 0.25 * weight_a * weight_b * direct(point, patch.normal());
        }
    }
    sum
}

/// Reflectances of floor, ceiling, walls and the disc of each case.
fn case(name: &str) -> [f64; 4] {
    match name {
        "S1_floor.2_ceil.7_wall.5_discblack" => [0.2, 0.7, 0.5, 0.0],
        "S1r_floor.2_ceil.7_wall.5_disc.7" => [0.2, 0.7, 0.5, 0.7],
        "S2_all.5_discblack" => [0.5, 0.5, 0.5, 0.0],
        "S2r_all.5_disc.5" => [0.5; 4],
        "S3r_all.9_disc.9" => [0.9; 4],
        "S0_all_black" => [0.0; 4],
        _ => panic!("a case without reflectances: {name}"),
    }
}

/// Every point of every case agrees within its stated and the estimated error, and that is at most 0.1 %.
#[test]
fn reference_rooms() {
    let table = rows("room_radiosity.csv");
    let mut names: Vec<&str> = table.iter().map(|row| row[0].as_str()).collect();
    names.dedup();
    assert_eq!(names.len(), 6);
    for name in names {
        let [floor, ceiling, walls, disc] = case(name);
        let centre = DVec3::new(0.5 * SIDE, 0.5 * SIDE, SIDE);
        let reflectance = |patch: &Patch| {
            let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| {
                let pick = |k: usize, high: i32| if high == 1 { patch.high[k] } else { patch.low[k] };
                glam::DVec2::new(pick(0, i), pick(1, j))
            });
            match patch.face {
                4 => floor,
                5 => {
                    let share = disc_polygon_area(centre.truncate(), RADIUS, &corners) / patch.area();
                    ceiling * (1.0 - share) + disc * share
                }
                _ => walls,
            }
        };
        let room = Interreflection::new(DVec3::splat(SIDE), reflectance, &GOES_ON).unwrap();
        let on_patches: Vec<f64> = room.mesh().patches.iter().map(direct_mean).collect();
        let exitances = room.exitances(&on_patches, &GOES_ON).unwrap();
        let (mut worst, mut largest, mut least_margin) = (0f64, 0f64, f64::INFINITY);
        for row in table.iter().filter(|row| row[0] == name) {
            let point = DVec3::new(number(&row[3]) + 0.5 * SIDE, number(&row[4]) + 0.5 * SIDE, 0.0);
            let (indirect, error) = room.illuminance(&exitances, point);
            let truth = number(&row[6]);
            let value = direct(point, DVec3::Z) + indirect;
            let stated = if disc == 0.9 { 2.5e-6 } else { 4.4e-7 } * truth + 1e-6;
            let off = (value - truth).abs();
            worst = worst.max(off / truth);
            largest = largest.max(error / truth);
            least_margin = least_margin.min(error / off.max(1e-300));
            assert!(off <= error + stated, "{name} {row:?}: {value} +- {error}");
            assert!(error <= 1e-3 * truth, "{name}: estimated error {}", error / truth);
        }
        println!(
            "{name}: worst {worst:.1e}, largest estimate {largest:.1e}, least estimate over error {least_margin:.1}"
        );
    }
}

/// The mean of all illuminances in a room of one reflectance is exact: E_direct / (1 - rho) (white furnace); also where
/// next to nothing is absorbed.
#[test]
fn white_furnace() {
    for rho in [0.5, 0.9, 0.999, 0.999_99] {
        let room = Interreflection::new(DVec3::new(2.0, 3.0, 2.5), |_| rho, &GOES_ON).unwrap();
        let patches = &room.mesh().patches;
        let direct: Vec<f64> = patches.iter().map(|patch| if patch.face == 4 { 100.0 } else { 0.0 }).collect();
        let exitances = room.exitances(&direct, &GOES_ON).unwrap();
        let area: f64 = patches.iter().map(Patch::area).sum();
        let flux: f64 = patches.iter().zip(&exitances.fine).map(|(patch, m)| patch.area() * m).sum::<f64>() / rho;
        let exact = 100.0 * 6.0 / (1.0 - rho);
        assert!((flux / exact - 1.0).abs() < 1e-6, "{rho}: {flux} of {exact} in {area} m2");
    }
    let mirror = Interreflection::new(DVec3::ONE, |_| 1.0, &GOES_ON).unwrap();
    let no_limit = mirror.exitances(&vec![1.0; mirror.mesh().patches.len()], &GOES_ON);
    assert_eq!(no_limit.unwrap_err(), Unsolved::NoLimit);
}
