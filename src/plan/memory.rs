//! What memory a job takes at its peak, before it has run.
//!
//! Upper bounds rather than best guesses: a job that is let in must fit. `tests/service/memory.rs` renders jobs of every method and
//! compares the peak of the process with what stands here.

use super::{Methods, Plan};
use crate::analytic::radiosity;
use crate::integrator::photon::chunks::{PHOTON_CHUNK, chunks_at_once};
use crate::integrator::photon_map::grid;
use crate::integrator::photon_map::progressive::Radius;
use crate::integrator::{Method, bidirectional, light_tracing, ppm, sppm};
use crate::scene::{EstimateKind, Grid, Scene, View};
use crate::traceable::TraceableScene;

/// Bytes that a job needs at its peak, beside the program itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MemoryEstimate {
    /// Bytes of the sensors of all grids.
    pub grids: f64,
    /// Bytes of the pixels of all views.
    pub views: f64,
    /// Bytes of what a pass works with: photons and their vertices, or the factors between the patches of a room.
    pub working: f64,
    /// Bytes of the triangles of tubes and objects.
    pub meshes: f64,
}

impl MemoryEstimate {
    pub fn total(&self) -> f64 {
        self.grids + self.views + self.working + self.meshes
    }
}

/// Copies of a job's sums that are alive together: of all earlier chunks, of this one, of both, and two while a checkpoint
/// is written or a reader has one.
const COPIES: f64 = 5.0;

/// One running mean with its variance: three numbers.
const MOMENTS: f64 = 24.0;

/// Bytes of one triangle: as read, in the frame of the room, in the tree over all, with its facet.
const TRIANGLE: f64 = 640.0;

/// Cells of a sorted set of photons, at most: two numbers each.
const PHOTON_CELLS: f64 = 2.0 * 4.0 * grid::MAX_CELLS;

/// Copies of photons and vertices: in one growing list, and sorted.
const PHOTON_COPIES: f64 = 2.5;

/// Share of the surfaces that a photon meets which lie beyond the plane of a grid on its way down.
const DOWNWARD: f64 = 0.6;

/// Bytes of a factor between two patches: as computed, and as balanced.
const FACTOR: f64 = 16.0;

/// Bytes of a solver's tables of the light that leaves the openings.
const TABLES: f64 = 48e6;

/// Largest number of events of a photon that is counted on: scenes that absorb nearly nothing are refused by the memory
/// that these take.
const MOST_EVENTS: f64 = 1e6;

/// The peak of a planned job.
pub fn estimate(scene: &Scene, traceable: &TraceableScene, plan: &Plan) -> MemoryEstimate {
    let channels = scene.channels.count() as f64;
    let Methods { grids, views } = &plan.methods;
    let mut bytes = MemoryEstimate { meshes: TRIANGLE * triangles(scene, traceable), ..MemoryEstimate::default() };
    if let Some(choice) = grids {
        bytes.grids = scene.grids.iter().map(|grid| of_grid(grid, &choice.method)).sum();
    }
    if let Some(choice) = views {
        bytes.views = scene.views.iter().map(|view| of_view(view, channels, &choice.method)).sum();
    }
    let working = |method: &Method, with_views: bool| of_pass(scene, channels, method, with_views);
    bytes.working = if plan.methods.share_passes() {
        grids.as_ref().map_or(0.0, |choice| working(&choice.method, true))
    } else {
        let of_grids = grids.as_ref().map_or(0.0, |choice| working(&choice.method, false));
        of_grids.max(views.as_ref().map_or(0.0, |choice| working(&choice.method, true)))
    };
    bytes
}

/// Bytes of one grid: its sums, a pass of it, and its files.
fn of_grid(grid: &Grid, method: &Method) -> f64 {
    let sensors = grid.len() as f64;
    let points = match method {
        Method::Ppm(settings) if grid.estimate == EstimateKind::CellAverage => f64::from(settings.samples_per_sensor),
        _ => 1.0,
    };
    let sums = 2.0 * MOMENTS + of_points(method, points);
    let at_once = match method {
        // every chunk of photons has sums of its own
        Method::LightTracing(light_tracing::Settings { photons_per_pass })
        | Method::Bidirectional(bidirectional::Settings { photons_per_pass, .. }) => {
            chunks_at_once(8 * grid.len() as u64).min(photons_per_pass.div_ceil(PHOTON_CHUNK))
        }
        _ => 1,
    };
    let pass = 64.0 + 8.0 * at_once as f64 + 32.0 * points;
    // as JSON and CSV, and as numbers on the way there
    let files = 640.0;
    sensors * (COPIES * sums + pass + files)
}

/// Bytes of one view: its sums, a pass of it, and its files.
fn of_view(view: &View, channels: f64, method: &Method) -> f64 {
    let pixels = (view.size_px[0] * view.size_px[1]) as f64;
    let points = match method {
        Method::Ppm(settings) => f64::from(settings.samples_per_pixel),
        _ => 1.0,
    };
    // values, their variance, and blocks of 64 pixels
    let sums = 8.0 * channels + 8.0 + 2.0 * MOMENTS / 64.0 + of_points(method, points);
    // values of pixels with their rays in lists that grow, the image, its bias
    let pass = 40.0 * channels + 32.0 + 32.0 * points;
    // floats for EXR and the file itself, two pictures, and luminances in order for their scales
    let files = 8.0 * (channels + 2.0) + 48.0;
    // what a pass needs is gone when files are made
    pixels * (COPIES * sums + f64::max(pass, files))
}

/// Bytes that fixed points and statistics per point add to the sums of one sensor or pixel.
fn of_points(method: &Method, points: f64) -> f64 {
    let per_point = |radius: Radius| if radius == Radius::PerPoint { 16.0 * points } else { 0.0 };
    match method {
        // a contrast for every block of at least two points
        Method::Ppm(settings) => 0.5 * MOMENTS * points + per_point(settings.radius),
        Method::Sppm(settings) => per_point(settings.radius),
        _ => 0.0,
    }
}

/// Bytes of the photons of a pass and of the vertices that are kept of them.
fn of_pass(scene: &Scene, channels: f64, method: &Method, with_views: bool) -> f64 {
    let photon = 32.0 + 8.0 * channels;
    let events = events(scene);
    let grids = scene.grids.len() as f64;
    // at its diffuser; where it crosses planes; on surfaces, and there again when it is a caustic
    let crossings = grids * DOWNWARD * events;
    let kept = |surfaces: f64| (1.0 + crossings + surfaces * events) * photon * PHOTON_COPIES;
    let cells = (grids + 4.0) * PHOTON_CELLS;
    let on_surfaces = if with_views { 1.0 } else { 0.0 };
    match method {
        Method::PhotonMapping(settings) => settings.photons_per_pass as f64 * kept(2.0) + cells,
        Method::Ppm(ppm::Settings { photons_per_pass, .. }) | Method::Sppm(sppm::Settings { photons_per_pass, .. }) => {
            *photons_per_pass as f64 * kept(on_surfaces) + cells
        }
        Method::Bidirectional(settings) => {
            let vertex = bidirectional::vertex_bytes(channels as usize) as f64;
            settings.photons_per_pass as f64 * (1.0 + events) * vertex * PHOTON_COPIES
        }
        // a place on the diffuser, the flux, and an offset for cells
        Method::TwoStage(settings) => settings.photons_per_pass as f64 * (32.0 + 8.0 * channels) * PHOTON_COPIES,
        Method::Holigilm => TABLES + FACTOR * (radiosity::Mesh::fine_count(scene.room.size) as f64).powi(2),
        Method::LightTracing(_) | Method::PathTracing(_) | Method::Jenkins(_) => 0.0,
    }
}

/// Mean number of surfaces that a photon meets in the room, were all surfaces met alike: 1 / (1 - rho).
fn events(scene: &Scene) -> f64 {
    let size = scene.room.size;
    let areas = [size.y * size.z, size.y * size.z, size.x * size.z, size.x * size.z, size.x * size.y, size.x * size.y];
    let most = |albedo: [f64; 3]| albedo.into_iter().fold(0.0, f64::max);
    let faces = scene.room.surfaces.iter().zip(areas);
    let reflected: f64 =
        faces.map(|(surface, area)| area * surface.map_or(0.0, |surface| most(surface.albedo()))).sum();
    let rho = reflected / areas.iter().sum::<f64>();
    (1.0 / (1.0 - rho)).clamp(1.0, MOST_EVENTS)
}

fn triangles(scene: &Scene, traceable: &TraceableScene) -> f64 {
    let objects: usize = scene.room.meshes.iter().map(|object| object.mesh.triangles.len()).sum();
    let tubes: usize = traceable.tubes.iter().map(|tube| tube.guide.triangle_count()).sum();
    (objects + tubes) as f64
}
