//! Pipes that next to no light passes: black ones and very long dull ones, under a uniform sky.

use std::f64::consts::PI;

use crate::documents::prepare;
use crate::scenes::{
    RADIUS, SIDE, assert_grid, built, cube, daylight, lambertian, light_tracing, run, straight, values,
};
use serde_json::json;
use skyduct::integrator::path_tracing;
use skyduct::optics::Collector;
use skyduct::scene::{EstimateKind, Grid, Scene, TubeShape};

const ZENITH_CD_M2: f64 = 3000.0;

/// Radius in m of a pipe whose 10 000 diameters a document may have.
const SLENDER: f64 = 0.005;

fn scene(aspect: f64, reflectance: f64) -> Scene {
    let pipe = straight(2.0 * RADIUS * aspect, reflectance, lambertian(0.6, 0.0));
    cube(0.3, 0.5, 0.7, vec![pipe], daylight(5, ZENITH_CD_M2, 35.0, 0.0), EstimateKind::Point)
}

/// Share of the light of a uniform sky that passes, to 1 / aspect^2 of it: 1 / (4 aspect^2) of a black pipe (form factor of
/// coaxial discs), and (3/4) M / aspect^2 of a mirror of 50 %, M = 13/3 being the integral of 2 x g(x), g(x) = R^N (1 - (1-R)(x-N))
/// with N = floor(x).
const CASES: [(f64, f64, f64); 3] = [(100.0, 0.0, 0.25), (1000.0, 0.0, 0.25), (10_000.0, 0.5, 3.25)];

/// The flux at the diffuser agrees within 4 standard errors, which are below 4 % of it.
#[test]
fn photons_find_the_narrow_cone_that_passes() {
    for (aspect, reflectance, share) in CASES {
        let scene = scene(aspect, reflectance);
        let estimate = run(&scene, &*light_tracing(&scene, 4096, 1), 32);
        let expected = PI * ZENITH_CD_M2 * PI * RADIUS * RADIUS * share / (aspect * aspect);
        let found = estimate.tubes[0].at_diffuser;
        println!("{aspect} {reflectance}: {} +- {}, {expected}", found.mean, found.standard_error());
        assert!((found.mean - expected).abs() < 4.0 * found.standard_error() + 1e-4 * expected);
        assert!(found.standard_error() < 0.04 * expected);
        // and so is the light below
        let grid = &estimate.grids[0];
        assert!((0..81).all(|sensor| grid.standard_error_lux(sensor) < 0.2 * grid.illuminance_lux(sensor)));
    }
}

/// Paths backward find the same light as photons within 4 standard errors, which are below 5 % each.
#[test]
fn paths_backward_find_the_narrow_cone_that_passes() {
    let dome = || Collector::DielectricDome { refractive_index: 1.5, thickness_m: 0.003, absorption_per_m: 0.0 };
    let cases = CASES.iter().map(|(aspect, reflectance, _)| (*aspect, *reflectance, Collector::Open));
    for (aspect, reflectance, collector) in cases.chain([(6.0, 0.0, dome())]) {
        let mut scene = scene(aspect, reflectance);
        let TubeShape::Cylinders(tube) = &mut scene.tubes[0].shape else { panic!("a straight tube") };
        tube.collector = collector;
        scene.grids = vec![Grid::new("grid".into(), 0.5, [2, 1], 0.3, [SIDE, SIDE], EstimateKind::Point)];
        let (truth, error) = values(&run(&scene, &*light_tracing(&scene, 8192, 1), 32));
        let settings = path_tracing::Settings { samples_per_sensor: 1024, ..Default::default() };
        let paths = built(&scene, &settings, 2);
        let found = run(&scene, &*paths, 32);
        assert_grid(&found, &truth, &error, 4.0, 0.0, &format!("{aspect} {reflectance}"));
        let (_, own) = values(&found);
        assert!((0..2).all(|sensor| own[sensor].max(error[sensor]) < 0.05 * truth[sensor]), "{own:?} {truth:?}");
    }
}

/// HOLIGILM has the flux in closed form; the rays that tell how it lies on the diffuser find it, too: the room gets it all.
#[test]
fn holigilm_lights_the_room_by_the_same_flux() {
    for (aspect, reflectance, share) in CASES {
        let prepared = prepare("S1", |document| {
            document["method"] = "holigilm".into();
            document["sky"] = json!({
                "cie_type": 5, "sun_position": { "altitude_deg": 35, "azimuth_deg": 0 },
                "zenith_luminance_cd_m2": ZENITH_CD_M2
            });
            document["tubes"][0]["reflectance"] = json!(reflectance);
            document["tubes"][0]["diameter_m"] = json!(2.0 * SLENDER);
            document["tubes"][0]["segments"] = json!([{ "length_m": 2.0 * SLENDER * aspect }]);
            document["grids"][0]["cells"] = json!([2, 2]);
        });
        let estimate = prepared.render_all_passes(&mut |_, _| {}).unwrap();
        let expected = PI * ZENITH_CD_M2 * PI * SLENDER * SLENDER * share / (aspect * aspect);
        let flux = estimate.tubes[0].at_diffuser.mean;
        assert!((flux / expected - 1.0).abs() < 1e-4, "{aspect} {reflectance}: {flux} {expected}");
        // one lumen of the same closure lights the floor alike, whatever the pipe
        let lux = estimate.grids[0].mean.mean / flux;
        assert!(lux > 0.01 && lux < 1.0, "{aspect} {reflectance}: {lux} lx per lm");
    }
}
