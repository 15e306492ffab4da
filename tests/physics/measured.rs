//! Measured diffusers: against Lambertian ones, and against quadrature of their tables.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::scenes::{RADIUS, SIDE, assert_grid, cube, daylight, lambertian, light_tracing, run, sppm, straight};
use glam::DVec3;
use skyduct::estimate::Estimate;
use skyduct::integrator::sppm;
use skyduct::optics::{Diffuser, MeasuredDiffuser};
use skyduct::scene::{EstimateKind, Scene, View};
use skyduct::statistics::Moments;

const ENDS: [f64; 2] = [0.0, FRAC_PI_2];

/// A forward peak of 25 degrees over a faint veil, the same at all angles of incidence but fainter at grazing ones.
fn peaked() -> MeasuredDiffuser {
    let exit: Vec<f64> = [0.0, 10.0, 25.0, 90.0f64].iter().map(|angle| angle.to_radians()).collect();
    let row = |scale: f64| [2.0, 1.4, 0.05, 0.02].iter().map(|value| value * scale).collect::<Vec<f64>>();
    MeasuredDiffuser::new(&ENDS, &exit, &[row(1.0), row(0.4)], None).unwrap()
}

fn settings() -> sppm::Settings {
    sppm::Settings { photons_per_pass: 8192, ..sppm::Settings::default() }
}

/// Radiance below a table under isotropic light of luminance 1: 2 pi int f cos sin over the angles of incidence.
fn seen(table: &MeasuredDiffuser, exit_cosine: f64) -> f64 {
    let n = 20_000;
    let at = |k: u32| {
        let (sin, cos) = ((f64::from(k) + 0.5) / f64::from(n) * FRAC_PI_2).sin_cos();
        table.per_sr(true, cos, exit_cosine) * sin * cos
    };
    2.0 * PI * FRAC_PI_2 / f64::from(n) * (0..n).map(at).sum::<f64>()
}

/// A uniform sky of luminance 1000 over an opening without a tube, in a black room.
fn uniform(diffuser: Diffuser) -> Scene {
    let tube = straight(1e-9, 1.0, diffuser);
    cube(0.0, 0.0, 0.0, vec![tube], daylight(5, 1000.0, 35.0, 0.0), EstimateKind::Point)
}

/// Illuminance of the floor by quadrature over the diffuser, and far more light below than aside.
#[test]
fn a_forward_peak_lights_what_is_below() {
    let table = peaked();
    let scene = uniform(Diffuser::Measured(Arc::new(table.clone())));
    let estimate = run(&scene, &*light_tracing(&scene, 8192, 5), 48);
    let axis = DVec3::new(0.5 * SIDE, 0.5 * SIDE, SIDE);
    let by_angle: Vec<f64> = (0..=2000).map(|k| seen(&table, (f64::from(k) / 2000.0 * FRAC_PI_2).cos())).collect();
    let luminance = |cosine: f64| {
        let at = cosine.acos() / FRAC_PI_2 * 2000.0;
        let k = (at as usize).min(1999);
        1000.0 * (by_angle[k] + (at - k as f64) * (by_angle[k + 1] - by_angle[k]))
    };
    let truth: Vec<f64> = (0..81)
        .map(|sensor| {
            let grid = &scene.grids[0];
            let sensor = DVec3::new(grid.x_m[sensor % 9], grid.y_m[sensor / 9], 0.0);
            let (rings, spokes) = (40, 64);
            let mut lux = 0.0;
            for ring in 0..rings {
                let radius = RADIUS * ((f64::from(ring) + 0.5) / f64::from(rings)).sqrt();
                for spoke in 0..spokes {
                    let angle = 2.0 * PI * (f64::from(spoke) + 0.5) / f64::from(spokes);
                    let way = axis + DVec3::new(angle.cos(), angle.sin(), 0.0) * radius - sensor;
                    let cosine = way.z / way.length();
                    lux += luminance(cosine) * cosine * cosine / way.length_squared();
                }
            }
            lux * PI * RADIUS * RADIUS / f64::from(rings * spokes)
        })
        .collect();
    // the quadrature's error is far below 1e-4 but where the table has its kinks
    let errors: Vec<f64> = truth.iter().map(|lux| 2e-3 * lux).collect();
    assert_grid(&estimate, &truth, &errors, 4.5, 0.0, "forward peak");
    let flat = run(&uniform(lambertian(0.5, 0.0)), &*light_tracing(&uniform(lambertian(0.5, 0.0)), 8192, 6), 8);
    let contrast = |estimate: &Estimate| estimate.grids[0].illuminance_lux(40) / estimate.grids[0].illuminance_lux(36);
    assert!(contrast(&estimate) > 5.0 * contrast(&flat), "{} {}", contrast(&estimate), contrast(&flat));
    assert!(estimate.energy.relative_closure_error().abs() < 1e-9);
}

/// Eyes see the diffuser brighter from below than from aside, by its table.
#[test]
fn views_see_the_table() {
    let table = peaked();
    let mut scene = uniform(Diffuser::Measured(Arc::new(table.clone())));
    let axis = DVec3::new(0.5 * SIDE, 0.5 * SIDE, SIDE);
    let eyes = [DVec3::new(axis.x, axis.y, 0.2), DVec3::new(axis.x, axis.y - 0.5, 1.0), DVec3::new(1.9, 0.3, 1.7)];
    let view = |eye: DVec3| View::new("eye".into(), eye, axis, DVec3::new(0.1, 1.0, 0.2), 1e-3, [8, 8]).unwrap();
    scene.views = eyes.iter().map(|eye| view(*eye)).collect();
    let method = sppm(&scene, &settings(), 7);
    let mut moments = [Moments::default(); 3];
    for number in 0..64 {
        let pass = method.pass(number, &AtomicBool::new(false)).unwrap();
        for (moments, view) in moments.iter_mut().zip(&pass.views) {
            moments.push(view.luminance.iter().sum::<f64>() / view.luminance.len() as f64);
        }
    }
    for (eye, moments) in eyes.iter().zip(&moments) {
        let way = axis - *eye;
        let truth = 1000.0 * seen(&table, way.z / way.length());
        println!("{eye}: {} is {truth} +- {}", moments.mean, moments.standard_error());
        assert!((moments.mean - truth).abs() < 4.5 * moments.standard_error() + 1e-3 * truth, "{eye}");
    }
    assert!(moments[0].mean > 10.0 * moments[2].mean);
}
