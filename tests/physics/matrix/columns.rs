//! The columns of the matrix: every method that computes light without approximation, at about the same cost a pass.
//!
//! `jenkins` is left out: it is a formula for rooms that absorb everything, and has no error.

use skyduct::integrator::photon_map::progressive::Radius;
use skyduct::integrator::{
    Method, bidirectional, holigilm, lamp_responses, light_tracing, path_tracing, photon_mapping, placed_vertices, ppm,
    sppm, two_stage,
};
use skyduct::scene::Scene;

/// A column: a method and its settings.
pub struct Column {
    pub name: &'static str,
    /// What its estimator is; an oracle is of another family than what it judges.
    pub family: Family,
    method: fn(&Work) -> Method,
}

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
    /// Patterns of light at diffusers, and points placed where sensors need them.
    PlacedVertices,
    /// Final gathering over a density estimate.
    Gathering,
    /// Density estimates at what is seen.
    Density,
    /// Quadrature and radiosity.
    Deterministic,
}

/// Size of a pass.
pub struct Work {
    sensors: f64,
    pixels: f64,
    factor: f64,
    /// Paths from sensors alone are so many times more.
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
    pub fn method(&self, work: &Work) -> Method {
        (self.method)(work)
    }
}

/// The column of that name.
pub fn column(name: &str) -> &'static Column {
    COLUMNS.iter().find(|column| column.name == name).unwrap_or_else(|| panic!("no column {name}"))
}

pub const COLUMNS: &[Column] = &[
    Column {
        name: "light_tracing",
        family: Family::LightTracing,
        method: |work| Method::LightTracing(light_tracing::Settings { photons_per_pass: Some(work.photons(4096.0)) }),
    },
    Column {
        name: "path_tracing",
        family: Family::PathTracing,
        method: |work| {
            Method::PathTracing(path_tracing::Settings {
                samples_per_sensor: work.per_sensor(1024.0 * work.paths),
                samples_per_pixel: work.per_pixel(2560.0),
            })
        },
    },
    Column {
        name: "bidirectional_path_tracing",
        family: Family::Bidirectional,
        method: |work| {
            Method::Bidirectional(bidirectional::Settings {
                photons_per_pass: Some(work.photons(1024.0)),
                samples_per_sensor: Some(work.per_sensor(256.0 * work.paths)),
                samples_per_pixel: work.per_pixel(1280.0),
            })
        },
    },
    Column {
        name: "two_stage",
        family: Family::TwoStage,
        method: |work| {
            Method::TwoStage(two_stage::Settings {
                photons_per_pass: Some(work.photons(2048.0)),
                samples_per_sensor: Some(work.per_sensor(512.0 * work.paths)),
                samples_per_pixel: work.per_pixel(2560.0),
            })
        },
    },
    Column {
        name: "placed_vertices",
        family: Family::PlacedVertices,
        method: |work| {
            Method::PlacedVertices(placed_vertices::Settings {
                photons_per_pass: Some(work.photons(512.0)),
                vertices_per_pass: Some(work.photons(1024.0)),
            })
        },
    },
    Column {
        name: "lamp_responses",
        family: Family::TwoStage,
        method: |work| {
            Method::LampResponses(lamp_responses::Settings {
                photons_per_pass: Some(work.photons(2048.0)),
                samples_per_sensor: work.per_sensor(512.0 * work.paths),
                ..Default::default()
            })
        },
    },
    Column {
        name: "photon_mapping",
        family: Family::Gathering,
        method: |work| {
            Method::PhotonMapping(photon_mapping::Settings {
                photons_per_pass: Some(work.photons(4096.0)),
                // points of views gather as often as sensors of grids
                gather_rays: Some(work.per_sensor(512.0).min(work.per_pixel(5120.0).max(4))),
                ..Default::default()
            })
        },
    },
    Column { name: "ppm", family: Family::Density, method: |work| fixed(work, Radius::Schedule) },
    Column { name: "ppm_per_point", family: Family::Density, method: |work| fixed(work, Radius::PerPoint) },
    Column { name: "sppm", family: Family::Density, method: |work| moving(work, Radius::Schedule) },
    Column { name: "sppm_per_point", family: Family::Density, method: |work| moving(work, Radius::PerPoint) },
    Column {
        name: "holigilm",
        family: Family::Deterministic,
        method: |_| Method::Holigilm(holigilm::Settings::default()),
    },
];

fn fixed(work: &Work, radius: Radius) -> Method {
    // the error of fixed points is brought down by their number, not by passes
    let points = ppm::Settings { samples_per_sensor: 64, samples_per_pixel: 4, ..Default::default() };
    Method::Ppm(ppm::Settings { photons_per_pass: work.photons(8192.0), radius, ..points })
}

fn moving(work: &Work, radius: Radius) -> Method {
    Method::Sppm(sppm::Settings { photons_per_pass: work.photons(8192.0), radius, ..Default::default() })
}
