//! Peak memory of a job, estimated before it has run.
//!
//! The estimates are upper bounds rather than best guesses: a job that is admitted must fit. `tests/service/jobs/memory.rs` renders jobs of
//! every method and compares the peak of the process with the estimates made here.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::{Methods, Plan};
use crate::integrator::components::Component;
use crate::integrator::diffuser_source::closure_source::all_lambertian;
use crate::integrator::method::{Described, Load, Retained};
use crate::integrator::moments;
use crate::integrator::radiosity::bytes_of_solutions;
use crate::integrator::room_matrix::{self, PATCHES};
use crate::scene::{EnclosureFace, Grid, MeshObject, Responses, Scene, View};
use crate::traceable::{TraceableScene, TraceableTube};

/// Bytes that a job needs at its peak, in addition to the program itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MemoryEstimate {
    /// Bytes of the sensors of all grids.
    pub grids: f64,
    /// Bytes of the pixels of all views.
    pub views: f64,
    /// Bytes of the working data of a pass: photons and their vertices, or the factors between the patches of a room.
    pub working: f64,
    /// Bytes of the triangles of tubes and objects.
    pub meshes: f64,
}

impl MemoryEstimate {
    /// Returns the sum of all parts, in bytes.
    pub fn total(&self) -> f64 {
        self.grids + self.views + self.working + self.meshes
    }
}

/// Bytes of surroundings: the outline of a horizon, and the table by which light behind it is sampled, of sky and ground.
const SURROUNDINGS: f64 = 200e3;

/// Number of copies of a job's sums in memory at the same time: of all earlier chunks, of the present one, of both, and two while a
/// checkpoint is written or a reader has one.
const COPIES: f64 = 5.0;

/// Bytes of one running mean with its variance: three numbers.
const MOMENTS: f64 = 24.0;

/// Bytes of a sensor at a moment in a pass: light that is scattered and that is not, their sum, and again in the list of a grid.
const VALUES_OF_PASS: f64 = 32.0;

/// Bytes of the statistics that one point carries from pass to pass: its squared radius and its number of photons.
const RADIUS: f64 = 16.0;

/// Bytes of the photon count of one sensor.
const PHOTONS: f64 = 16.0;

/// Bytes of one response of a sensor to a patch, and again of each channel of it: in the list of a thread, and in that of a pass.
const RESPONSE: f64 = 32.0;

/// Bytes of one triangle: as read, in the frame of the room, in the tree over all triangles, with its facet.
const TRIANGLE: f64 = 640.0;

/// Bytes of one triangle of a copy of a mesh: as it is checked in the frame of the room, the optics and patches of both sides, and as a solid
/// of photon maps.
const COPIED_TRIANGLE: f64 = 192.0;

/// Largest number of events of a photon that is assumed: the memory for it is so large that scenes which absorb nearly nothing are refused.
const MOST_EVENTS: f64 = 1e6;

/// Estimates the memory of the meshes of a scene, prepared for rays, in bytes.
pub fn mesh_bytes(scene: &Scene, traceable: &TraceableScene) -> f64 {
    let copied: usize = scene.room.meshes.iter().map(MeshObject::copied_triangles).sum();
    TRIANGLE * triangles(scene, traceable) + COPIED_TRIANGLE * copied as f64
}

/// Estimates the peak memory of a planned job.
pub fn estimate(scene: &Scene, traceable: &TraceableScene, plan: &Plan) -> MemoryEstimate {
    let Methods { grids, views, parts, check, year: _ } = &plan.methods;
    let meshes = mesh_bytes(scene, traceable);
    let mut bytes = MemoryEstimate { meshes, ..MemoryEstimate::default() };
    let load = |views: usize| Load {
        size: scene.room.enclosure.extent(),
        channels: scene.channels.count(),
        grids: scene.grids.len(),
        views,
        events: events(scene),
        sunbeams: traceable.has_sun() && traceable.tubes.iter().any(lets_beams_in),
        directional_sensors: if all_lambertian(&traceable.tubes) { 0 } else { scene.grids.iter().map(Grid::len).sum() },
    };
    if let Some(choice) = grids {
        let method = choice.method.described();
        // the parts of the light, each of which needs as much as the whole
        let copies = 1 + parts.map_or(0, |_| Component::of_scene(traceable).len());
        let tubes = traceable.tubes.len();
        let columns = |grid: &Grid| (copies + room_matrix::columns(grid.responses, tubes)) as f64;
        bytes.grids = scene.grids.iter().map(|grid| columns(grid) * of_grid(grid, method)).sum::<f64>();
        let views = if plan.methods.passes_are_common() { scene.views.len() } else { 0 };
        let sensors: usize = scene.grids.iter().filter(|grid| grid.responses.are_reported()).map(Grid::len).sum();
        let responses = (sensors * tubes * PATCHES) as f64 * (RESPONSE * scene.channels.count() as f64 + RESPONSE);
        let has_whole = scene.grids.iter().any(|grid| grid.responses == Responses::ToTubes);
        let solutions = if has_whole { bytes_of_solutions(tubes, scene.channels.count()) as f64 } else { 0.0 };
        bytes.working = method.working_bytes(&load(views)) + responses + solutions;
    }
    if let Some(check) = check {
        let method = check.method.described();
        bytes.grids += scene.grids.iter().map(|grid| of_grid(grid, method)).sum::<f64>();
        bytes.working = bytes.working.max(method.working_bytes(&load(0)));
    }
    if let Some(choice) = views {
        let (method, channels) = (choice.method.described(), scene.channels.count() as f64);
        bytes.views = scene.views.iter().map(|view| of_view(view, channels, method)).sum();
        // grids and views are computed in turn
        bytes.working = bytes.working.max(method.working_bytes(&load(scene.views.len())));
    }
    if let Some(years) = scene.moments.as_ref().map(|moments| &moments.years) {
        let sensors = scene.grids.iter().map(Grid::len).sum::<usize>() as f64;
        let moments: usize = years.iter().map(Vec::len).sum();
        bytes.grids +=
            sensors * moments::columns_of_all(years.iter().map(Vec::len)) as f64 * (COPIES * MOMENTS + VALUES_OF_PASS);
        // luminances, and of each sensor the light of all patches, of those of one more part, and the coefficients
        bytes.working += moments::COEFFICIENTS as f64 * (8.0 * moments as f64 + 40.0 * sensors);
    }
    bytes.working += SURROUNDINGS * distinct_surroundings(scene) as f64;
    bytes
}

/// Counts the different surroundings of tubes.
fn distinct_surroundings(scene: &Scene) -> usize {
    let all = scene.tubes.iter().filter_map(|tube| tube.surroundings.as_ref());
    all.map(Arc::as_ptr).collect::<BTreeSet<_>>().len()
}

/// Returns the bytes of one grid: its sums, a pass of it, and its files.
fn of_grid(grid: &Grid, method: &dyn Described) -> f64 {
    let sensors = grid.len() as f64;
    let retained = method.retained_per_sensor(grid);
    let sums = 2.0 * MOMENTS + PHOTONS + of_points(retained);
    let pass = 80.0 + 8.0 * retained.concurrent_sums + 32.0 * retained.points;
    // as JSON and CSV, and as numbers before
    let files = 640.0;
    sensors * (COPIES * sums + pass + files)
}

/// Returns the bytes of one view: its sums, a pass of it, and its files.
fn of_view(view: &View, channels: f64, method: &dyn Described) -> f64 {
    let pixels = (view.size_px[0] * view.size_px[1]) as f64;
    let retained = method.retained_per_pixel();
    // values, their variance and rays, and blocks of 64 pixels
    let sums = 8.0 * channels + 16.0 + 2.0 * MOMENTS / 64.0 + of_points(retained);
    // values of pixels with their rays in lists that grow, the image, its bias
    let pass = 40.0 * channels + 40.0 + 32.0 * retained.points;
    // floats for EXR and the file itself, two pictures, and luminances in order for their scales
    let files = 8.0 * (channels + 2.0) + 48.0;
    // memory of a pass is free when files are made
    pixels * (COPIES * sums + f64::max(pass, files))
}

/// Returns the bytes that fixed points and statistics per point add to the sums of one sensor or pixel.
fn of_points(retained: Retained) -> f64 {
    MOMENTS * retained.contrasts + RADIUS * retained.radii
}

/// Returns the mean number of surfaces that a photon hits in the room, if it hit all surfaces in proportion to their areas: 1 / (1 - rho).
fn events(scene: &Scene) -> f64 {
    let most = |albedo: [f64; 3]| albedo.into_iter().fold(0.0, f64::max);
    let faces = scene.room.enclosure.faces();
    let reflected =
        |face: &EnclosureFace| face.polygon.area_m2() * face.surface.map_or(0.0, |surface| most(surface.albedo()));
    let area: f64 = faces.iter().map(|face| face.polygon.area_m2()).sum();
    let rho = faces.iter().map(reflected).sum::<f64>() / area;
    (1.0 / (1.0 - rho)).clamp(1.0, MOST_EVENTS)
}

/// True if light passes a part of a tube's closure unscattered.
fn lets_beams_in(tube: &TraceableTube) -> bool {
    tube.specular_zone().is_some()
}

fn triangles(scene: &Scene, traceable: &TraceableScene) -> f64 {
    let objects: usize = scene.room.meshes.iter().map(MeshObject::kept_triangles).sum();
    let tubes: usize = traceable.tubes.iter().map(|tube| tube.guide.triangle_count()).sum();
    (objects + tubes) as f64
}
