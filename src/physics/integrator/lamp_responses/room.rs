//! What every sensor gets per lumen that leaves each patch of each opening: the second of two stages, without the first.
//!
//! It is computed from the room as it is without sky, sun and guides, so that nothing of these can enter into it, and kept for
//! all jobs on the same room.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use super::kept::{Content, Kept};
use super::patch_light::PatchLight;
use super::replicate::{Response, RoomPass};
use crate::guide::{Guide, RayCount, StraightGuide};
use crate::integrator::backward::pass::{each, lifted};
use crate::integrator::backward::walk::Walk;
use crate::integrator::lamp::cells::{CELLS, Receiver, is_far};
use crate::integrator::lamp::zone::Zone;
use crate::sampling::{Key, PathSamples, Stream};
use crate::scene::{EstimateKind, Grid, Scene, Sensor, Tube};
use crate::traceable::{TraceableScene, TraceableTube};

/// Reflections of a path that no roulette decides: it would throw away what even points gain.
const CERTAIN_REFLECTIONS: u32 = 3;

/// Pairs of Sobol coordinates of a path.
const SOBOL_PAIRS: u32 = 8;

/// Points of every patch by which the light straight from it is told: where nothing can stand between, and where something may.
const POINTS: u64 = 256;
const POINTS_IN_PART: u64 = 16;

/// Numbers of a pass.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Photons of sky and sun.
    pub photons: u64,
    /// Relative standard error that they are for.
    pub target: f64,
    /// Paths of each sensor.
    pub paths: u32,
    /// Whether replicates of the room are kept and used again.
    pub keeps_rooms: bool,
}

/// A room with openings that shine, whatever is above them.
#[derive(Debug)]
pub struct Room<const C: usize> {
    scene: TraceableScene,
    /// The zone of each opening that shines.
    zones: Vec<Zone>,
    grids: Vec<Sensors>,
    paths: u32,
    seed: Key,
    /// `None` where nothing is kept.
    kept: Option<Kept>,
}

/// The sensors of a grid.
#[derive(Debug)]
struct Sensors {
    grid: Grid,
    /// For each sensor, true if it sees all openings whole.
    sees_all: Vec<bool>,
    /// For each of these in a grid whose responses are told, light straight from each patch in lx/lm; else empty.
    straight: Vec<Vec<f64>>,
}

impl<const C: usize> Room<C> {
    /// The room of a scene; equal seeds give equal bits.
    pub fn new(scene: &Scene, traceable: &TraceableScene, grids: &[Grid], sizes: Sizes, seed: u64) -> Self {
        let room = below_openings(traceable);
        let kept = sizes.keeps_rooms.then(|| Kept::of(content(scene, traceable, &room, grids, sizes.paths, seed, C)));
        let zones = zones(traceable);
        let grids = grids.iter().map(|grid| Sensors::new(&room, &zones, grid)).collect();
        Self { scene: room, zones, grids, paths: sizes.paths, seed: Key::new(seed), kept }
    }

    /// The zone of each opening that shines.
    pub fn zones(&self) -> &[Zone] {
        &self.zones
    }

    /// True if a sensor of a grid sees all openings whole.
    pub fn sees_all(&self, grid: usize, sensor: usize) -> bool {
        self.grids[grid].sees_all[sensor]
    }

    /// Light straight from each patch to a sensor in lx/lm, of a grid whose responses are told.
    pub fn straight<'a>(&'a self, grid: usize, sensor: usize, response: &'a Response) -> &'a [f64] {
        if self.sees_all(grid, sensor) { &self.grids[grid].straight[sensor] } else { &response.straight }
    }

    /// True if a replicate is kept.
    pub fn keeps(&self, pass: u64) -> bool {
        self.kept.as_ref().is_some_and(|kept| kept.get(pass).is_some())
    }

    /// Replicate `pass` of the responses, the same whether it was kept or not; `None` when cancelled.
    pub fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Arc<RoomPass>> {
        if let Some(kept) = self.kept.as_ref().and_then(|kept| kept.get(pass)) {
            return Some(kept);
        }
        let computed = Arc::new(self.compute(pass, cancel)?);
        if let Some(kept) = &self.kept {
            kept.put(pass, &computed, computed.bytes());
        }
        Some(computed)
    }

    fn compute(&self, pass: u64, cancel: &AtomicBool) -> Option<RoomPass> {
        let key = self.seed.stream(Stream::RoomPass, pass);
        let (mut grids, mut rays) = (Vec::new(), RayCount::default());
        for (number, sensors) in self.grids.iter().enumerate() {
            let stream = key.stream(Stream::Grid, number as u64);
            let of_sensor = |index| self.response(sensors, index, stream.stream(Stream::Sensor, index as u64));
            let (responses, of_grid): (_, Vec<RayCount>) =
                each(sensors.grid.len(), cancel, of_sensor)?.into_iter().unzip();
            grids.push(responses);
            rays += of_grid.into_iter().sum::<RayCount>();
        }
        Some(RoomPass { grids, rays })
    }

    fn response(&self, sensors: &Sensors, index: usize, stream: Key) -> (Response, RayCount) {
        let scene = &self.scene;
        let place = Place::of(scene, &sensors.grid, index);
        let light = PatchLight::<C>::new(&self.zones);
        let (mut luminaires, mut rays) = (0.0, RayCount::default());
        let paths = if sensors.grid.is_inside(index) { 0 } else { self.paths };
        for number in 0..u64::from(paths) {
            let samples = PathSamples::with_pairs(stream, number, SOBOL_PAIRS);
            let mut walk = Walk::<C>::new(scene, samples, CERTAIN_REFLECTIONS);
            let position = place.point(|| walk.samples.pair());
            if !scene.is_in_solid(position) {
                walk.illuminance(&light, Sensor { position, normal: DVec3::Z });
            }
            luminaires += walk.sum.luminance();
            rays += walk.rays;
        }
        let share = 1.0 / f64::from(self.paths);
        let reflected = light.into_found().into_iter().flat_map(|found| (found * share).0).collect();
        let straight = if sensors.grid.responses && !sensors.sees_all[index] {
            straight((scene, &self.zones), &place, stream.stream(Stream::StraightFromPatches, 0), POINTS_IN_PART)
        } else {
            Vec::new()
        };
        (Response { reflected, straight, luminaires: luminaires * share }, rays)
    }
}

/// Everything that the replicates of a room depend on: the scene below the openings (`room`), and what its trees of triangles do not
/// tell, the meshes of objects and of guides that send light back.
fn content(
    scene: &Scene,
    traceable: &TraceableScene,
    room: &TraceableScene,
    grids: &[Grid],
    paths: u32,
    seed: u64,
    channels: usize,
) -> Content {
    let kept = |(tube, shape): (&TraceableTube, &Tube)| returns_light(traceable, tube).then(|| shape.clone());
    let guides: Vec<_> = traceable.tubes.iter().zip(&scene.tubes).map(kept).collect();
    Content::of(&(&scene.room, guides, without_meshes(room), zones(traceable), nameless(grids), channels, paths, seed))
}

/// The zone of each opening that is a lamp.
fn zones(scene: &TraceableScene) -> Vec<Zone> {
    let of = |tube: &TraceableTube| Zone::new(tube.diffuser.even_zone(tube.opening_radius), tube.opening_radius);
    scene.tubes.iter().map(of).collect()
}

/// The scene as it is below the openings: what is above is gone, but for guides that light comes back from.
fn below_openings(scene: &TraceableScene) -> TraceableScene {
    let mut room = scene.clone();
    (room.sky, room.sun) = (None, None);
    for tube in &mut room.tubes {
        tube.daylit = false;
        if returns_light(scene, tube) {
            continue;
        }
        let black = [0.0; 3];
        let radius = tube.opening_radius;
        let pipe = StraightGuide { radius, length: 1.0, reflectance: black.into(), collector_transmittance: black };
        (tube.guide, tube.section, tube.cones) = (Guide::Straight(pipe), None, None);
        tube.diffuser = tube.diffuser.opaque();
    }
    room
}

/// True if light of the room comes back down a tube.
fn returns_light(scene: &TraceableScene, tube: &TraceableTube) -> bool {
    scene.guide_return && tube.guide.returns_light()
}

/// The same scene without its meshes, which the description of the room has.
fn without_meshes(scene: &TraceableScene) -> TraceableScene {
    let mut scene = scene.clone();
    scene.meshes = None;
    scene
}

/// Grids without what does not touch their values.
fn nameless(grids: &[Grid]) -> Vec<Grid> {
    grids.iter().map(|grid| Grid { name: String::new(), ..grid.clone() }).collect()
}

/// Points of a sensor.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    centre: DVec3,
    /// Edges of the cell in m; `None` for a point.
    cell: Option<DVec2>,
}

impl Place {
    /// The sensor `index` of a grid.
    pub fn of(scene: &TraceableScene, grid: &Grid, index: usize) -> Self {
        let cell = (grid.estimate == EstimateKind::CellAverage).then_some(DVec2::from(grid.cell_size_m));
        Self { centre: lifted(scene, grid, index).position, cell }
    }

    /// Half the diagonal of the cell in m.
    pub fn reach(&self) -> f64 {
        self.cell.map_or(0.0, |cell| 0.5 * cell.length())
    }

    /// The sensor's centre.
    pub fn centre(&self) -> DVec3 {
        self.centre
    }

    /// A point of the sensor, by two numbers in 0..1 that are drawn for cells alone.
    pub fn point(&self, numbers: impl FnOnce() -> [f64; 2]) -> DVec3 {
        match self.cell {
            None => self.centre,
            Some(cell) => self.centre + (cell * (DVec2::from(numbers()) - 0.5)).extend(0.0),
        }
    }

    /// True if no point of the sensor is near the opening of a tube.
    pub fn is_far(&self, tube: &TraceableTube) -> bool {
        is_far(tube.origin, tube.opening_radius, self.centre, self.reach())
    }

    /// True if nothing can stand between any point of the sensor and any of the opening of a tube.
    fn sees(&self, scene: &TraceableScene, tube: &TraceableTube) -> bool {
        scene.leaves_clear(self.centre, self.reach(), None, tube.origin, tube.opening_radius)
    }
}

impl Sensors {
    fn new(scene: &TraceableScene, zones: &[Zone], grid: &Grid) -> Self {
        let places: Vec<Place> = (0..grid.len()).map(|index| Place::of(scene, grid, index)).collect();
        let sees_all = |place: &Place| scene.tubes.iter().all(|tube| place.sees(scene, tube));
        let sees_all: Vec<bool> = places.iter().map(sees_all).collect();
        let straight_to = |(place, sees_all): (&Place, &bool)| {
            // the same points for all sensors: a response has no noise of its own here
            if *sees_all {
                straight((scene, zones), place, Key::new(0).stream(Stream::StraightFromPatches, 0), POINTS)
            } else {
                Vec::new()
            }
        };
        let straight =
            if grid.responses { places.iter().zip(&sees_all).map(straight_to).collect() } else { Vec::new() };
        Self { grid: grid.clone(), sees_all, straight }
    }
}

/// Light straight from each patch to a sensor in lx/lm, by `points` of each, of a room with the zones of its openings.
fn straight((scene, zones): (&TraceableScene, &[Zone]), place: &Place, stream: Key, points: u64) -> Vec<f64> {
    let mut lit = vec![0.0; scene.tubes.len() * CELLS];
    for number in 0..points {
        let mut samples = PathSamples::new(stream, number);
        let position = place.point(|| samples.pair());
        if scene.is_in_solid(position) {
            continue;
        }
        let numbers = samples.pair();
        for ((tube, zone), lit) in scene.tubes.iter().zip(zones).zip(lit.chunks_exact_mut(CELLS)) {
            let (of_patches, held) = (zone.within_each(numbers), zone.held());
            let receiver = Receiver::new(position, DVec3::Z, tube.origin);
            for ((lit, point), held) in lit.iter_mut().zip(&of_patches).zip(held) {
                let source = tube.origin + (*point * tube.opening_radius).extend(0.0);
                if held > 0.0 && scene.visible(source, None, position, None) {
                    *lit += receiver.point(source.truncate()) / points as f64;
                }
            }
        }
    }
    lit
}
