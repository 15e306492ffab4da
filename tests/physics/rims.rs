//! Pixels at the rim of what is much brighter than all around: their errors tell the light that few rays missed.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use serde_json::json;
use skyduct::engine::cancel::Stop;
use skyduct::scene::View;

use crate::documents::prepare;

/// Centre and radius of an opening in m, its luminance in cd/m2 under a uniform sky, and the corner of a lamp and its sides.
const CENTRE: DVec2 = DVec2::new(0.9, 1.1);
const RADIUS: f64 = 0.3;
const LUMINANCE: f64 = 3000.0;
const CORNER: [f64; 2] = [1.35, 0.5];
const SIDES: [[f64; 2]; 2] = [[0.13, 0.4], [-0.4, 0.13]];

const SIDE: f64 = 2.032;
const SIZE: [usize; 2] = [48, 36];
const EYE: [f64; 3] = [0.3, 0.4, 0.5];
const TARGET: [f64; 3] = [1.05, 1.0, 2.032];

/// Points along the side of a pixel by which its truth is known to a third of a percent of the source.
const LINES: usize = 64;

/// Luminance of each pixel: shares of it that opening and lamp take.
fn truth() -> Vec<f64> {
    let view = View::new("up".into(), EYE.into(), TARGET.into(), DVec3::Y, 0.9, SIZE).unwrap();
    let at = |step: usize| (step as f64 + 0.5) / LINES as f64;
    let shines = |direction: DVec3| {
        let met = |height: f64| (view.eye + direction * ((height - view.eye.z) / direction.z)).truncate();
        let [u, v] = SIDES.map(DVec2::from);
        let from = met(2.0) - DVec2::from(CORNER);
        let [a, b] = [from.dot(u), from.dot(v)].map(|along| along / u.length_squared());
        let lamp = (0.0..1.0).contains(&a) && (0.0..1.0).contains(&b);
        direction.z > 0.0 && (lamp || (met(SIDE) - CENTRE).length() < RADIUS)
    };
    let pixel = |pixel: usize| {
        let (column, row) = ((pixel % SIZE[0]) as f64, (pixel / SIZE[0]) as f64);
        let points = (0..LINES * LINES).map(|point| (at(point % LINES), at(point / LINES)));
        let seen = points.filter(|(x, y)| shines(view.ray_direction(column + x, row + y))).count();
        LUMINANCE * seen as f64 / (LINES * LINES) as f64
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

/// In a black room nothing else shines. In 8 passes of each method no pixel is off by more than 12 of its errors, and of those that
/// see an edge or have a neighbour that does not a hundredth by more than 6; pixels farther from every edge do not get an error by it.
/// Without the error of one ray some pixels are off by hundreds of theirs, or told as 0 +- 0.
#[test]
fn errors_at_rims_tell_what_few_rays_missed() {
    let truth = truth();
    let around = |pixel: usize| {
        let (column, row) = (pixel % SIZE[0], pixel / SIZE[0]);
        let rows = row.saturating_sub(2)..(row + 3).min(SIZE[1]);
        rows.flat_map(move |row| (column.saturating_sub(2)..(column + 3).min(SIZE[0])).map(move |c| row * SIZE[0] + c))
    };
    let at_rim: Vec<bool> =
        (0..truth.len()).map(|pixel| around(pixel).any(|near| truth[near] != truth[pixel])).collect();
    for method in ["path_tracing", "two_stage", "bidirectional_path_tracing", "sppm", "photon_mapping"] {
        let (mut worst, mut beyond, mut rim, mut squares): (f64, usize, usize, f64) = (0.0, 0, 0, 0.0);
        for seed in 0..2 {
            let prepared = prepare("S1", |job| {
                let black = json!({ "reflectance": 0 });
                job["sky"]["cie_type"] = json!(5);
                job["room"]["surfaces"] = json!({ "floor": black, "walls": black, "ceiling": black });
                let [u, v] = SIDES.map(|[x, y]| json!([x, y, 0.0]));
                // u cross v looks up, so that the sides stand in the other order
                let lamp = json!({
                    "kind": "rectangle", "corner_m": [CORNER[0], CORNER[1], 2.0], "edge_u_m": v, "edge_v_m": u,
                    "luminance_cd_m2": LUMINANCE
                });
                job["room"]["luminaires"] = json!([lamp]);
                let tube = &mut job["tubes"][0];
                tube["centre_m"] = json!([CENTRE.x, CENTRE.y]);
                tube["diameter_m"] = json!(2.0 * RADIUS);
                tube["reflectance"] = json!(1.0);
                job["grids"] = json!([]);
                job["views"] = json!([{
                    "name": "up", "eye_m": EYE, "look_at_m": TARGET, "up": [0, 1, 0],
                    "vertical_fov_deg": 0.9 * 180.0 / PI, "size_px": SIZE
                }]);
                job["method"] = json!(method);
                job["seed"] = json!(seed);
                job["stop"] = json!({ "max_passes": 8, "max_seconds": 300, "view_relative_error": 1e-6 });
            });
            let estimate = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap().estimate;
            let film = &estimate.views[0];
            for (pixel, truth) in truth.iter().enumerate() {
                let (value, error) = (film.luminance_cd_m2(pixel), film.standard_error_cd_m2(pixel));
                // what the truth itself is not known by
                let excess = ((value - truth).abs() - 0.004 * LUMINANCE).max(0.0);
                if !at_rim[pixel] {
                    assert!(error < 0.15 * LUMINANCE && excess <= 6.0 * error, "{method} {pixel}: {value} +- {error}");
                    continue;
                }
                let z = if excess == 0.0 { 0.0 } else { excess / error };
                worst = worst.max(z);
                squares += z * z;
                rim += 1;
                beyond += usize::from(z > 6.0);
            }
        }
        let rms = (squares / rim as f64).sqrt();
        println!("{method}: worst z {worst:.1}, rms {rms:.2}, {beyond} of {rim} beyond 6");
        assert!(rim > 600 && worst < 12.0 && 100 * beyond < rim, "{method}: {worst}, {beyond} of {rim}");
    }
}
