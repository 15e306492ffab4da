//! What a pass costs, before it has run: only the division of a job into chunks depends on it.

use super::{Methods, Plan};
use crate::integrator::{Method, photon_mapping};
use crate::plan::{EffectKind, GuideKind};
use crate::scene::Scene;

/// Rough seconds per pass on one core of the machine that the constants were measured on.
///
/// A function of the job alone, never of the machine or of a clock, so that every worker divides a job alike.
pub fn seconds_per_pass(scene: &Scene, plan: &Plan) -> f64 {
    let per_path = plan
        .guides
        .iter()
        .map(|guide| if guide.kind == GuideKind::Mesh { 8e-6 } else { 0.5e-6 })
        .fold(0.5e-6, f64::max);
    // rays among the triangles of objects, along paths and from each vertex to each sensor
    let (per_path, per_connection) =
        if scene.room.meshes.is_empty() { (per_path, 10e-9) } else { (per_path + 4e-6, 500e-9) };
    let sensors: usize = scene.grids.iter().map(|grid| grid.len()).sum();
    let pixels: usize = scene.views.iter().map(|view| view.size_px[0] * view.size_px[1]).sum();
    // lobes cost more to evaluate than a cosine
    let per_connection =
        if plan.effects.is_on(EffectKind::Glossy) { f64::max(per_connection, 50e-9) } else { per_connection };
    let methods: &Methods = &plan.methods;
    let of = |method: &Method, sensors: usize, pixels: usize| match method {
        Method::LightTracing(settings) => {
            settings.photons_per_pass as f64 * (per_path + per_connection * sensors.min(1024) as f64)
        }
        Method::PathTracing(settings) => {
            let per_tube = per_path * scene.tubes.len() as f64;
            let sensor_paths = settings.samples_per_sensor as f64 * sensors as f64;
            let eye_paths = settings.samples_per_pixel as f64 * pixels as f64;
            (sensor_paths + eye_paths) * (1e-6 + 2.0 * per_tube)
        }
        Method::Bidirectional(settings) => {
            let photons =
                settings.photons_per_pass as f64 * (per_path + 5.0 * per_connection * sensors.min(1024) as f64);
            let sensor_paths = settings.samples_per_sensor as f64 * sensors as f64;
            let eye_paths = settings.samples_per_pixel as f64 * pixels as f64;
            photons + (sensor_paths + eye_paths) * (3e-6 + per_path * scene.tubes.len() as f64)
        }
        Method::PhotonMapping(settings) => {
            let rays = |default: u32| f64::from(settings.gather_rays.unwrap_or(default));
            let gather_rays = rays(photon_mapping::SENSOR_GATHER_RAYS) * sensors as f64
                + rays(photon_mapping::POINT_GATHER_RAYS) * pixels as f64;
            settings.photons_per_pass as f64 * (per_path + 0.5e-6)
                + 2.5e-6 * pixels as f64
                + 30e-6 * sensors as f64
                + gather_rays * (2e-6 + 0.1e-6 * scene.tubes.len() as f64 + 10.0 * per_connection)
        }
        Method::TwoStage(settings) => {
            let sensor_paths = settings.samples_per_sensor as f64 * sensors as f64;
            let eye_paths = settings.samples_per_pixel as f64 * pixels as f64;
            let photons = settings.photons_per_pass as f64;
            photons * (per_path + 2e-9 * sensors as f64)
                + (sensor_paths + eye_paths) * (1e-6 + 0.5e-6 * scene.tubes.len() as f64)
        }
        Method::Holigilm => 1.0 + 1e-3 * sensors as f64,
        Method::Jenkins(_) => 0.1e-6 * sensors as f64,
        Method::Ppm(settings) => {
            let rays = settings.samples_per_pixel as f64 * pixels as f64;
            settings.photons_per_pass as f64 * (per_path + 0.5e-6)
                + 2.5e-6 * rays
                + (30e-6 + 2e-6 * f64::from(settings.samples_per_sensor)) * sensors as f64
        }
        Method::Sppm(settings) => {
            settings.photons_per_pass as f64 * (per_path + 0.5e-6) + 2.5e-6 * pixels as f64 + 30e-6 * sensors as f64
        }
    };
    let grids = methods.grids.as_ref().filter(|_| !methods.share_passes());
    grids.map_or(0.0, |choice| of(&choice.method, sensors, 0))
        + methods
            .views
            .as_ref()
            .map_or(0.0, |choice| of(&choice.method, if methods.share_passes() { sensors } else { 0 }, pixels))
}
