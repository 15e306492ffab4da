//! Scenes and runs that several tests share.
#![allow(dead_code)]

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};
use skyduct::estimate::Estimate;
use skyduct::integrator::light_tracing::{self, LightTracing};
use skyduct::integrator::sppm::{self, Sppm};
use skyduct::integrator::{Integrator, Kernel};
use skyduct::optics::{Collector, Diffuser, Surface};
use skyduct::plan::{self, EffectRequests, Effects};
use skyduct::scene::{Channels, Daylight, EstimateKind, Grid, Room, Scene, Segment, StraightOrBent, Tube, TubeShape};
use skyduct::sky::zenith::ZenithFormula;
use skyduct::sky::{CieType, Sky, SkyDistribution, direction};

pub const SIDE: f64 = 2.032;
pub const RADIUS: f64 = 0.127;

/// A CIE sky of given zenith luminance, the sun (without a beam) at an altitude and azimuth in degrees.
pub fn daylight(cie_type: u8, zenith_luminance_cd_m2: f64, altitude_deg: f64, azimuth_deg: f64) -> Daylight {
    let sun = direction(altitude_deg.to_radians(), azimuth_deg.to_radians());
    let distribution = SkyDistribution::new(CieType::new(cie_type).unwrap(), sun);
    let sky = Some(Sky { distribution, zenith_luminance_cd_m2 });
    Daylight { sky, sun: None, formula: ZenithFormula::GivenZenithLuminance }
}

/// A vertical straight tube.
pub fn straight(length_m: f64, reflectance: f64, diffuser: Diffuser) -> Tube {
    let segments = vec![Segment { length_m, tilt: 0.0, azimuth: 0.0 }];
    Tube {
        centre: DVec2::splat(0.5 * SIDE),
        opening_radius: RADIUS,
        shape: TubeShape::Cylinders(StraightOrBent {
            reflectance: [reflectance; 3].into(),
            segments,
            collector: Collector::Open,
        }),
        diffuser,
    }
}

pub fn lambertian(transmittance: f64, reflectance: f64) -> Diffuser {
    Diffuser::Lambertian { transmittance: [transmittance; 3], reflectance: [reflectance; 3] }
}

/// The 2.032 m cube with a 9 x 9 grid on the floor.
pub fn cube(
    floor: f64,
    walls: f64,
    ceiling: f64,
    tubes: Vec<Tube>,
    daylight: Daylight,
    estimate: EstimateKind,
) -> Scene {
    let surface = |reflectance| Some(Surface::diffuse([reflectance; 3]));
    let surfaces = [surface(walls), surface(walls), surface(walls), surface(walls), surface(floor), surface(ceiling)];
    Scene {
        daylight: Some(daylight),
        room: Room {
            size: DVec3::splat(SIDE),
            surfaces,
            boxes: Vec::new(),
            meshes: Vec::new(),
            luminaires: Vec::new(),
        },
        tubes,
        grids: vec![Grid::new("floor".into(), 0.0, [9, 9], 0.0, [SIDE, SIDE], estimate)],
        views: Vec::new(),
        channels: Channels::Photopic,
    }
}

/// The cube under a uniform Lambertian disc of 1000 lm: a uniform sky over an aperture of no length.
pub fn disc_room(floor: f64, walls: f64, ceiling: f64, disc: f64, estimate: EstimateKind) -> Scene {
    let transmittance = 0.1;
    let horizontal_lux = 1000.0 / (transmittance * PI * RADIUS * RADIUS);
    let tube = straight(1e-9, 1.0, lambertian(transmittance, disc));
    cube(floor, walls, ceiling, vec![tube], daylight(5, horizontal_lux / PI, 35.0, 0.0), estimate)
}

pub fn kernel(scene: &Scene) -> Arc<Kernel> {
    Arc::new(plan::compile(scene, &Effects::of(scene, &EffectRequests::new())).unwrap())
}

pub fn light_tracing(scene: &Scene, photons_per_pass: u64, seed: u64) -> LightTracing<1> {
    LightTracing::new(kernel(scene), &scene.grids, &light_tracing::Settings { photons_per_pass }, seed)
}

pub fn sppm(scene: &Scene, settings: &sppm::Settings, seed: u64) -> Sppm<1> {
    Sppm::new(kernel(scene), &scene.grids, &scene.views, settings, seed)
}

/// Adds up passes 0..`passes` of one method.
pub fn run(scene: &Scene, method: &dyn Integrator, passes: u64) -> Estimate {
    let mut estimate = Estimate::empty(scene);
    for pass in 0..passes {
        let pass = method.pass(pass, &AtomicBool::new(false)).unwrap();
        estimate.push(Some(&pass), Some(&pass));
    }
    assert_eq!(estimate.first_not_finite(), None);
    estimate
}

/// Fails unless every sensor agrees with its reference within `sigmas` combined standard errors plus `systematic` times
/// the reference; prints the worst.
#[track_caller]
pub fn assert_grid(estimate: &Estimate, truth: &[f64], truth_error: &[f64], sigmas: f64, systematic: f64, what: &str) {
    let grid = &estimate.grids[0];
    assert_eq!(grid.sensors.len(), truth.len());
    let z = |sensor: usize| {
        let error = grid.standard_error_lux(sensor).hypot(truth_error[sensor]);
        let excess = ((grid.illuminance_lux(sensor) - truth[sensor]).abs() - systematic * truth[sensor]).max(0.0);
        excess / error
    };
    let worst = (0..truth.len()).max_by(|a, b| z(*a).total_cmp(&z(*b))).unwrap();
    let rms = ((0..truth.len()).map(|s| z(s).powi(2)).sum::<f64>() / truth.len() as f64).sqrt();
    println!("{what}: worst z {:.2} at sensor {worst}, rms z {rms:.2}", z(worst));
    assert!(
        z(worst) < sigmas,
        "{what}: sensor {worst}: {} +- {} is not {} +- {}",
        grid.illuminance_lux(worst),
        grid.standard_error_lux(worst),
        truth[worst],
        truth_error[worst]
    );
}
