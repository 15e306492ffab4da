//! The columns of the matrix: every method that computes light without approximation, at about the same cost a pass, and what
//! users get who name no method.
//!
//! `two_stage` and `auto` have the settings that users get who name none. `jenkins` is left out: it is a formula for rooms
//! that absorb everything, and has no error.

use skyduct::integrator::photon_map::progressive::Radius;
use skyduct::integrator::{
    Method, bidirectional, holigilm, light_tracing, path_tracing, photon_mapping, ppm, sppm, two_stage,
};
use skyduct::plan::MethodRequest;
use skyduct::scene::Scene;

/// A column: a method and its settings.
pub struct Column {
    pub name: &'static str,
    method: Option<fn(&Work) -> Method>,
}

/// Kind of an estimator; an oracle is of another family than what it judges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Photons, connected to points and counted in cells.
    LightTracing,
    /// Paths from sensors and eyes alone.
    PathTracing,
    /// Vertices of paths and of photons, connected.
    Bidirectional,
    /// Patterns of light at diffusers, and paths that find them.
    TwoStage,
    /// Final gathering over a density estimate.
    Gathering,
    /// Density estimates at what is seen.
    Density,
    /// Quadrature and radiosity.
    Deterministic,
}

impl Family {
    pub fn of(method: &Method) -> Self {
        match method {
            Method::LightTracing(_) => Self::LightTracing,
            Method::PathTracing(_) => Self::PathTracing,
            Method::Bidirectional(_) => Self::Bidirectional,
            Method::TwoStage(_) => Self::TwoStage,
            Method::PhotonMapping(_) => Self::Gathering,
            Method::Ppm(_) | Method::Sppm(_) => Self::Density,
            Method::Holigilm(_) | Method::Jenkins(_) => Self::Deterministic,
        }
    }
}

/// Size of a pass.
pub struct Work {
    sensors: f64,
    pixels: f64,
    factor: f64,
    /// Paths from sensors and eyes alone are so many times more.
    paths: f64,
}

impl Work {
    pub fn of(scene: &Scene, factor: f64, paths: f64) -> Self {
        let sensors = scene.grids.iter().map(|grid| grid.len()).sum::<usize>();
        let pixels = scene.views.iter().map(|view| view.size_px[0] * view.size_px[1]).sum::<usize>();
        Self { sensors: sensors.max(1) as f64, pixels: pixels.max(1) as f64, factor, paths }
    }

    fn photons(&self, photons: f64) -> u64 {
        (photons * self.factor) as u64
    }

    /// Paths of each sensor, of so many in all.
    fn per_sensor(&self, paths: f64) -> u32 {
        (paths * self.factor / self.sensors).ceil().max(2.0) as u32
    }

    fn per_pixel(&self, paths: f64) -> u32 {
        (paths * self.factor / self.pixels).ceil() as u32
    }
}

impl Column {
    /// What a document would ask for: a method with its settings, or what the program chooses.
    pub fn request(&self, work: &Work) -> MethodRequest {
        self.method.map_or(MethodRequest::Auto, |method| MethodRequest::Method(method(work)))
    }
}

/// The column of that name.
pub fn column(name: &str) -> &'static Column {
    COLUMNS.iter().find(|column| column.name == name).unwrap_or_else(|| panic!("no column {name}"))
}

pub const COLUMNS: &[Column] = &[
    Column {
        name: "light_tracing",
        method: Some(|work| {
            Method::LightTracing(light_tracing::Settings { photons_per_pass: Some(work.photons(2048.0)) })
        }),
    },
    Column {
        name: "path_tracing",
        method: Some(|work| {
            Method::PathTracing(path_tracing::Settings {
                samples_per_sensor: work.per_sensor(1024.0 * work.paths),
                samples_per_pixel: work.per_pixel(2560.0 * work.paths),
            })
        }),
    },
    Column {
        name: "bidirectional_path_tracing",
        method: Some(|work| {
            Method::Bidirectional(bidirectional::Settings {
                photons_per_pass: Some(work.photons(1024.0)),
                samples_per_sensor: Some(work.per_sensor(256.0 * work.paths)),
                samples_per_pixel: work.per_pixel(1280.0 * work.paths),
            })
        }),
    },
    Column { name: "two_stage", method: Some(|_| Method::TwoStage(two_stage::Settings::default())) },
    Column {
        name: "photon_mapping",
        method: Some(|work| {
            Method::PhotonMapping(photon_mapping::Settings {
                photons_per_pass: Some(work.photons(4096.0)),
                // points of views gather as often as sensors of grids
                gather_rays: Some(work.per_sensor(512.0).min(work.per_pixel(5120.0).max(4))),
                ..Default::default()
            })
        }),
    },
    Column { name: "ppm", method: Some(|work| fixed(work, Radius::Schedule)) },
    Column { name: "ppm_per_point", method: Some(|work| fixed(work, Radius::PerPoint)) },
    Column { name: "sppm", method: Some(|work| moving(work, Radius::Schedule)) },
    Column { name: "sppm_per_point", method: Some(|work| moving(work, Radius::PerPoint)) },
    Column { name: "holigilm", method: Some(|_| Method::Holigilm(holigilm::Settings::default())) },
    // the settings and the method that users get; where it is two_stage, that column renders it
    Column { name: "auto", method: None },
];

fn fixed(work: &Work, radius: Radius) -> Method {
    // the error of fixed points is brought down by their number, not by passes
    let points = ppm::Settings { samples_per_sensor: 64, samples_per_pixel: 4, ..Default::default() };
    Method::Ppm(ppm::Settings { photons_per_pass: work.photons(8192.0), radius, ..points })
}

fn moving(work: &Work, radius: Radius) -> Method {
    Method::Sppm(sppm::Settings { photons_per_pass: work.photons(8192.0), radius, ..Default::default() })
}
