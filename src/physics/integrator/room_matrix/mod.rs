//! Matrix of a room: illuminance of every sensor per lumen that leaves each patch of each opening.
//!
//! **Idea.** The room is taken without sky, sun and guides, so that the matrix does not depend on them. Paths go from the sensors through
//! it and estimate the light of one lumen from each patch that surfaces reflect to the sensor ([`patch_light`]); the direct light of a
//! patch is a mean over points of it. One replicate is one estimate of the whole matrix; a job averages the replicates. The product with the
//! lumens of the patches is the light of any sky.
//!
//! Paths for the light of whole openings count coarse solutions ([`TubeSolutions`]). Some continue for the residual, which the sensors of a
//! grid share, as in the method with two stages.
//!
//! **Refuses** rooms without closures that have a Lambertian part, or, for responses to whole openings, that are Lambertian, and sensors within a radius of an opening. Patches of an opening consist of the parts
//! that lie in the Lambertian zone (docs/physics/measurement_equation.md#responses).
//!
//! **Sources.** The matrix of a room that is used again for other skies is that of daylight coefficients (Tregenza and Waters 1983), and
//! the view matrix of its later phases (Ward 2011).

mod patch_light;

use std::num::NonZero;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use gauss_quad::GaussLegendre;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::GridPass;
use super::diffuser_source::closure_source::{is_lambertian, refuses_all_but_lambertian};
use crate::guide::{Guide, RayCount, StraightGuide};
use crate::integrator::backward::pass::{Sampling, each, lifted, paths};
use crate::integrator::diffuser_source::cells::{OpeningReceiver, is_far};
use crate::integrator::diffuser_source::patches::CELLS;
use crate::integrator::diffuser_source::visible_parts::{VisiblePart, visible_parts};
use crate::integrator::diffuser_source::zone::Zone;
use crate::integrator::method::{Refusal, RefusalCode, Task};
use crate::integrator::radiosity::{ExpectedSpreads, MOMENTS, TubeSolutions};
use crate::sampling::{Key, PathSamples, Stream};
use crate::scene::{EstimateKind, Grid, Responses, Sensor};
use crate::traceable::{TraceableScene, TraceableTube};
use patch_light::{EvenLight, PatchLight, to_tubes};

/// Number of patches of every opening: six sectors of each of four rings, or four rows of six parts of a square.
pub const PATCHES: usize = CELLS;

/// Number of paths of a sensor in a replicate with the light of patches.
pub const PATHS_TO_PATCHES: u32 = 128;

/// Returns the reason why a room has no matrix for some grids, if there is one.
pub fn refuses(task: &Task) -> Option<Refusal> {
    let scene = task.traceable;
    let of_whole = task.grids.iter().any(|grid| grid.responses == Responses::ToTubes);
    // a whole opening has one response only where all of its light leaves alike
    let has_response = |tube: &TraceableTube| if of_whole { is_lambertian(tube) } else { tube.even_zone().is_some() };
    if !scene.tubes.is_empty() && !scene.tubes.iter().any(has_response) {
        let refusal = refuses_all_but_lambertian(&scene.tubes);
        if refusal.is_some() {
            return refusal;
        }
    }
    let is_near = |grid: &&Grid| {
        let mut places =
            (0..grid.len()).filter(|index| !grid.is_inside(*index)).map(|index| SensorPoints::of(scene, grid, index));
        grid.responses.are_reported() && places.any(|place| scene.tubes.iter().any(|tube| !place.is_far(tube)))
    };
    let grid = task.grids.iter().find(is_near)?;
    let detail = format!(
        "every sensor must be farther from an opening than the opening's radius, but a sensor of the grid {:?} is \
         nearer",
        grid.name
    );
    Some(Refusal::new(RefusalCode::PointsNearSurfaces, detail))
}

/// Number of reflections of a path without Russian roulette, which would spoil the gain of low-discrepancy points.
const CERTAIN_REFLECTIONS: u32 = 3;

/// Number of pairs of Sobol coordinates of a path.
const SOBOL_PAIRS: u32 = 8;

/// Numbers of points along an edge of a patch by which its direct light is computed where nothing can stand between, for points that are at
/// least this number of radii from the opening.
const EDGES: [(f64, usize); 2] = [(6.0, 3), (2.0, 6)];
/// Number of points for sensors that are nearer, and for cells.
const FINE_EDGE: usize = 16;

/// Numbers of the paths and connections of a sensor in a replicate.
#[derive(Clone, Copy, Debug)]
pub struct MatrixCounts {
    /// Number of paths.
    pub paths: u32,
    /// Number of these that continue beyond the first surface with a coarse solution.
    pub beyond: u32,
    /// Number of points of each patch to which a sensor is connected where something may stand between.
    pub points: u32,
}

/// Room with openings that emit light, independent of the sky and of most guides; `C` channels of light.
#[derive(Debug)]
pub struct MatrixEstimator<const C: usize> {
    scene: TraceableScene,
    /// Emitting zone of each opening.
    zones: Vec<Zone>,
    /// Coarse solutions of the light of whole openings; `None` where surfaces reflect none.
    solutions: Option<Arc<TubeSolutions<C>>>,
    /// Variances by which the residuals of sensors are expected to differ, by grid; empty where they are not known.
    spreads: Vec<ExpectedSpreads>,
    grids: Vec<ResponseSensors>,
    seed: Key,
}

/// Sensors of a grid whose daylight coefficients are requested.
#[derive(Debug)]
struct ResponseSensors {
    grid: Grid,
    /// Number of the grid.
    number: usize,
    counts: MatrixCounts,
    /// Part of each opening that each sensor sees, sensor by sensor.
    seen: Vec<VisiblePart>,
    /// Responses of each sensor to the direct light of the openings that it sees whole.
    straight: Vec<Vec<f64>>,
}

/// One replicate of the matrix.
#[derive(Debug)]
pub struct MatrixReplicate {
    /// Illuminances in lx by one lumen of white light, for each grid; none where they are not requested. From each patch, tube by tube; or from
    /// every opening, with its parts from each, and then the moments of these parts, tube by tube.
    pub grids: Vec<Vec<GridPass>>,
    /// Number of rays that were traced for it.
    pub rays: RayCount,
}

impl<const C: usize> MatrixEstimator<C> {
    /// Builds the room of a scene with the numbers of the sensors of each grid, and, for the light of whole openings, coarse solutions and the
    /// variances by which residuals are expected to differ; equal seeds give equal bits.
    pub fn new(
        scene: &TraceableScene,
        grids: &[Grid],
        counts: &[MatrixCounts],
        (solutions, spreads): (Option<Arc<TubeSolutions<C>>>, Vec<ExpectedSpreads>),
        seed: Key,
    ) -> Self {
        let (room, zones) = (below_openings(scene), scene.tubes.iter().map(Zone::of).collect::<Vec<_>>());
        let wanted = grids.iter().zip(counts).enumerate().filter(|(_, (grid, _))| grid.responses.are_reported());
        let sensors = |(number, (grid, counts)): (usize, (&Grid, &MatrixCounts))| {
            ResponseSensors::new(&room, &zones, (number, grid), *counts)
        };
        Self { grids: wanted.map(sensors).collect(), scene: room, zones, solutions, spreads, seed }
    }

    /// Returns the state of the responses of grid `number` before the first replicate.
    pub fn start(&self, number: usize, grid: &Grid) -> Vec<GridPass> {
        let mut responses = vec![GridPass::default(); columns(grid.responses, self.zones.len())];
        if let (Responses::ToTubes, Some(all)) = (grid.responses, responses.first_mut()) {
            let residual = if self.solutions.is_some() { vec![0.0; grid.len()] } else { Vec::new() };
            let part = GridPass { residual: residual.clone(), is_part: true, ..GridPass::default() };
            let companions = vec![part; self.zones.len()];
            let positions: Vec<DVec3> =
                (0..grid.len()).map(|sensor| lifted(&self.scene, grid, sensor).position).collect();
            let expected_spreads = self.spreads.get(number).map_or_else(Vec::new, |spreads| spreads.at(&positions));
            *all = GridPass { residual, companions, expected_spreads, ..GridPass::default() };
        }
        responses
    }

    /// Computes a replicate of the first `grids` grids; `None` when cancelled.
    pub fn replicate(&self, number: u64, grids: usize, cancel: &AtomicBool) -> Option<MatrixReplicate> {
        let key = self.seed.stream(Stream::RoomPass, number);
        let mut replicate = MatrixReplicate { grids: vec![Vec::new(); grids], rays: RayCount::default() };
        for sensors in &self.grids {
            let stream = key.stream(Stream::Grid, sensors.number as u64);
            let of_sensor = |index| self.of_sensor(sensors, index, stream.stream(Stream::Sensor, index as u64));
            let found = each(sensors.grid.len(), cancel, of_sensor)?;
            replicate.rays += found.iter().map(|(_, rays)| *rays).sum::<RayCount>();
            let tubes = self.zones.len();
            replicate.grids[sensors.number] = match sensors.grid.responses {
                Responses::None => Vec::new(),
                Responses::ToPatches => (0..tubes * PATCHES).map(|light| responses_to(&found, light)).collect(),
                Responses::ToTubes => {
                    let companions = (0..tubes).map(|tube| responses_to(&found, tube * MOMENTS)).collect();
                    let all = GridPass { companions, ..responses_to(&found, tubes * MOMENTS) };
                    let moments = (0..tubes * MOMENTS).filter(|light| light % MOMENTS > 0);
                    std::iter::once(all).chain(moments.map(|light| responses_to(&found, light))).collect()
                }
            };
        }
        Some(replicate)
    }

    /// Returns the number of openings of which a sensor sees a part, by chance.
    pub fn seen_in_part(&self, grid: usize, sensor: usize) -> usize {
        let sensors = self.grids.iter().find(|sensors| sensors.number == grid);
        sensors.map_or(0, |sensors| sensors.seen_in_part(self.zones.len(), sensor).count())
    }

    /// Computes the responses of a sensor that its grid reports, and the number of rays.
    fn of_sensor(&self, sensors: &ResponseSensors, index: usize, stream: Key) -> (SensorResponses, RayCount) {
        let MatrixCounts { paths: number, beyond, .. } = sensors.counts;
        let responses = sensors.grid.responses;
        let solutions = self.solutions.as_deref().filter(|_| responses == Responses::ToTubes);
        let beyond = solutions.map(|_| beyond);
        let sampling = Sampling { paths: number, beyond, certain: CERTAIN_REFLECTIONS, pairs: SOBOL_PAIRS };
        let even = EvenLight(solutions);
        let light = PatchLight::<C>::new(&self.zones, &even);
        let (_, mut rays) = paths(&self.scene, (&sensors.grid, index), (sampling, true), stream, &light);
        let fraction = 1.0 / f64::from(number);
        let [gathered, residual] = match responses {
            Responses::ToTubes => light.of_tubes(fraction),
            Responses::ToPatches | Responses::None => [light.of_patches(fraction), Vec::new()],
        };
        let stream = stream.stream(Stream::StraightFromPatches, 0);
        let (in_part, of_straight) = self.straight_in_part(sensors, index, stream);
        rays += of_straight;
        let straight = sensors.straight[index].iter().zip(of_patches(responses, &self.zones, in_part));
        let mut whole: Vec<f64> = straight.map(|(whole, in_part)| whole + in_part).collect();
        for part in [&gathered, &residual] {
            whole.iter_mut().zip(part).for_each(|(whole, part)| *whole += part);
        }
        (SensorResponses { whole, gathered, residual }, rays)
    }

    /// Computes the direct light in lx/lm of the patches of openings that a sensor sees in part, and the number of shadow rays.
    fn straight_in_part(&self, sensors: &ResponseSensors, index: usize, stream: Key) -> (Vec<f64>, RayCount) {
        let scene = &self.scene;
        let place = SensorPoints::of(scene, &sensors.grid, index);
        let (mut lit, mut rays) = (vec![0.0; scene.tubes.len() * PATCHES], RayCount::default());
        if sensors.grid.is_inside(index) {
            return (lit, rays);
        }
        let tubes: Vec<usize> = sensors.seen_in_part(scene.tubes.len(), index).collect();
        let points = u64::from(sensors.counts.points);
        for number in (0..points).filter(|_| !tubes.is_empty()) {
            let mut samples = PathSamples::new(stream, number);
            let position = place.point(|| samples.pair());
            if scene.is_in_solid(position) {
                continue;
            }
            let numbers = samples.pair();
            for tube in &tubes {
                let frame = &scene.tubes[*tube].frame;
                let receiver = OpeningReceiver::new(position, place.normal, frame);
                let patches = self.zones[*tube].within_each(numbers).into_iter().zip(self.zones[*tube].held());
                for (lit, (point, held)) in lit[tube * CELLS..].iter_mut().zip(patches) {
                    let source = scene.tubes[*tube].at(point);
                    let lux = receiver.point(frame.origin.truncate() + point);
                    if held > 0.0 && lux > 0.0 {
                        rays += 1;
                        *lit += if scene.visible(source, None, position, None) { lux / points as f64 } else { 0.0 };
                    }
                }
            }
        }
        (lit, rays)
    }
}

/// Responses of a sensor in lx/lm to the lights that its grid asks for.
struct SensorResponses {
    whole: Vec<f64>,
    /// Part that paths find, and of this the residual beyond coarse solutions; none where there is no coarse solution.
    gathered: Vec<f64>,
    residual: Vec<f64>,
}

/// Gathers the responses of all sensors to one light.
fn responses_to(sensors: &[(SensorResponses, RayCount)], light: usize) -> GridPass {
    let of = |values: fn(&SensorResponses) -> &[f64]| {
        sensors.iter().filter_map(|(sensor, _)| values(sensor).get(light).copied()).collect()
    };
    let (illuminance, residual) = (of(|sensor| &sensor.whole), of(|sensor| &sensor.residual));
    GridPass { illuminance, residual, gathered: of(|sensor| &sensor.gathered), ..GridPass::default() }
}

/// Returns the number of responses of a sensor in a room with `tubes` tubes; those to whole openings are that to all, of which each tube's is a
/// part, and the moments of each.
pub fn columns(responses: Responses, tubes: usize) -> usize {
    match responses {
        Responses::None => 0,
        Responses::ToPatches => tubes * PATCHES,
        Responses::ToTubes => 1 + tubes * (MOMENTS - 1),
    }
}

/// Computes the responses that a grid reports from those to patches.
fn of_patches(responses: Responses, zones: &[Zone], to_patches: Vec<f64>) -> Vec<f64> {
    match responses {
        Responses::None => Vec::new(),
        Responses::ToPatches => to_patches,
        Responses::ToTubes => to_tubes(zones, &to_patches),
    }
}

/// Returns the scene below the openings: everything above is removed, except guides from which light comes back.
fn below_openings(scene: &TraceableScene) -> TraceableScene {
    let mut room = scene.clone();
    for tube in &mut room.tubes {
        (tube.sky, tube.sun) = (None, None);
        if returns_light(scene, tube) {
            continue;
        }
        let black = [0.0; 3];
        let radius = tube.pipe_radius;
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

/// Points of a sensor.
#[derive(Clone, Copy, Debug)]
struct SensorPoints {
    centre: DVec3,
    normal: DVec3,
    /// Edges of the cell in m; `None` for a point.
    cell: Option<DVec2>,
}

impl SensorPoints {
    /// Returns the points of sensor `index` of a grid.
    fn of(scene: &TraceableScene, grid: &Grid, index: usize) -> Self {
        let cell = (grid.estimate == EstimateKind::CellAverage).then_some(DVec2::from(grid.cell_size_m));
        let Sensor { position: centre, normal } = lifted(scene, grid, index);
        Self { centre, normal, cell }
    }

    /// Returns half the diagonal of the cell in m.
    fn reach(&self) -> f64 {
        self.cell.map_or(0.0, |cell| 0.5 * cell.length())
    }

    /// Returns a point of the sensor, by two numbers in 0..1 that are drawn for cells only.
    fn point(&self, numbers: impl FnOnce() -> [f64; 2]) -> DVec3 {
        match self.cell {
            None => self.centre,
            Some(cell) => self.centre + (cell * (DVec2::from(numbers()) - 0.5)).extend(0.0),
        }
    }

    /// True if no point of the sensor is near the opening of a tube.
    fn is_far(&self, tube: &TraceableTube) -> bool {
        is_far(&tube.frame, tube.opening.outer_radius(), self.centre, self.reach())
    }
}

impl ResponseSensors {
    fn new(scene: &TraceableScene, zones: &[Zone], (number, grid): (usize, &Grid), counts: MatrixCounts) -> Self {
        let rules = PatchRules::new();
        let seen = visible_parts(scene, grid);
        let of_sensor = |index: usize| {
            let mut lit = vec![0.0; zones.len() * CELLS];
            if !grid.is_inside(index) {
                let place = SensorPoints::of(scene, grid, index);
                let seen = &seen[index * zones.len()..];
                for (number, (tube, zone)) in scene.tubes.iter().zip(zones).enumerate() {
                    if seen[number] == VisiblePart::Whole {
                        add_straight((tube, zone), (&place, &rules), &mut lit[number * CELLS..(number + 1) * CELLS]);
                    }
                }
            }
            of_patches(grid.responses, zones, lit)
        };
        let straight = (0..grid.len()).into_par_iter().map(of_sensor).collect();
        Self { grid: grid.clone(), number, counts, seen, straight }
    }

    /// Returns the numbers of those of some tubes of whose openings a sensor sees a part.
    fn seen_in_part(&self, tubes: usize, sensor: usize) -> impl Iterator<Item = usize> {
        let is_in_part = |seen: &VisiblePart| matches!(seen, VisiblePart::InPart | VisiblePart::PastBoxes);
        let of_sensor = self.seen[sensor * tubes..][..tubes].iter().enumerate();
        of_sensor.filter(move |(_, seen)| is_in_part(seen)).map(|(tube, _)| tube)
    }
}

/// Points of the unit square with weights that add up to 1: Gauss-Legendre nodes for each of [`EDGES`], and for [`FINE_EDGE`].
struct PatchRules([Vec<([f64; 2], f64)>; EDGES.len() + 1]);

impl PatchRules {
    fn new() -> Self {
        let edges = EDGES.iter().map(|(_, edge)| *edge).chain([FINE_EDGE]);
        let mut rules: [Vec<([f64; 2], f64)>; EDGES.len() + 1] = Default::default();
        for (rule, edge) in rules.iter_mut().zip(edges) {
            let Some(edge) = NonZero::new(edge) else { continue };
            let nodes: Vec<(f64, f64)> =
                GaussLegendre::new(edge).iter().map(|(node, weight)| (0.5 * (1.0 + node), 0.5 * weight)).collect();
            rule.extend(nodes.iter().flat_map(|(u, of_u)| nodes.iter().map(move |(v, of_v)| ([*u, *v], of_u * of_v))));
        }
        Self(rules)
    }

    /// Returns the points for a sensor at a distance from an opening, in its radii.
    fn of(&self, place: &SensorPoints, radii: f64) -> &[([f64; 2], f64)] {
        let coarse = EDGES.iter().position(|(least, _)| place.cell.is_none() && radii >= *least);
        &self.0[coarse.unwrap_or(EDGES.len())]
    }
}

/// Adds the direct light in lx/lm of each patch of an opening to a sensor that sees all of it. Sensors and replicates share the points, so that
/// this light has no noise.
fn add_straight((tube, zone): (&TraceableTube, &Zone), (place, rules): (&SensorPoints, &PatchRules), lit: &mut [f64]) {
    let radii = place.centre.distance(tube.frame.origin) / tube.opening.outer_radius();
    let held = zone.held();
    for (number, (numbers, weight)) in rules.of(place, radii).iter().enumerate() {
        let mut samples = PathSamples::new(Key::new(0).stream(Stream::StraightFromPatches, 0), number as u64);
        let position = place.point(|| samples.pair());
        let receiver = OpeningReceiver::new(position, place.normal, &tube.frame);
        for (lit, (point, held)) in lit.iter_mut().zip(zone.within_each(*numbers).into_iter().zip(held)) {
            *lit += held * weight * receiver.point(tube.frame.origin.truncate() + point).max(0.0);
        }
    }
}
