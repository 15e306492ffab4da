//! Paths that find the light of the patches of openings, separately for one lumen from each patch.
//!
//! A vertex that sees the opening whole is connected to a point of each patch, any other to some points of the opening, with a shadow
//! ray each. Very near to an opening one such connection and the scattered ray share the light by the power heuristic (Veach and Guibas
//! 1995, beta = 2); after narrow lobes and mirrors the ray finds it. So every light path is counted once.
//!
//! Coarse solutions ([`TubeSolutions`]) are control variates of what surfaces reflect of the light of whole openings.

use std::cell::RefCell;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::integrator::backward::daylight::opening_density;
use crate::integrator::backward::meeting::{Meeting, Ray, Walk};
use crate::integrator::backward::next_event::{Daylight, NextEvent, PathState, power_heuristic};
use crate::integrator::backward::opening::DaylightWeights;
use crate::integrator::backward::vertex::Vertex;
use crate::integrator::diffuser_source::cells::{OpeningReceiver, is_far};
use crate::integrator::diffuser_source::opening_visibility::{OpeningVisibility, opening_visibility};
use crate::integrator::diffuser_source::patches::{CELLS, cell};
use crate::integrator::diffuser_source::zone::Zone;
use crate::integrator::radiosity::{BrightPatches, MOMENTS, Solution, Target, TubeSolutions};
use crate::optics::Spectrum;
use crate::traceable::{RoomHit, SurfaceId, TraceableScene, TraceableTube};

/// Number of points of an opening that a vertex is connected to where it may see only a part of it.
const CONNECTIONS: usize = 2;

/// Light that a path finds of each patch, in lx (or cd/m2 for a path from an eye) per lumen that leaves it, tube by tube; the light of
/// luminaires is added to the walk's sum.
#[derive(Debug)]
pub struct PatchLight<'a, const C: usize> {
    /// Emitting zone of each opening.
    zones: &'a [Zone],
    next_event: NextEvent<'a, EvenLight<'a, C>>,
    /// Light that is found: what coarse solutions do not leave out, and the residual.
    found: RefCell<[Found<C>; 2]>,
    vectors: pulp::Arch,
}

/// Light of openings in lx.
#[derive(Clone, Debug)]
struct Found<const C: usize> {
    /// Illuminances by one lumen from each patch.
    by_connections: Vec<Spectrum<C>>,
    /// Light by coarse solutions: illuminances by the lights of each opening.
    by_solutions: Vec<Spectrum<C>>,
}

impl<const C: usize> Found<C> {
    /// Returns the illuminances in lx by the lights of each opening and by all together ([`to_tubes`]), times a factor.
    fn of_tubes(&self, zones: &[Zone], factor: f64) -> Vec<f64> {
        let to_patches: Vec<f64> = self.by_connections.iter().map(|light| (*light * factor).luminance()).collect();
        let mut lights = to_tubes(zones, &to_patches);
        let by_solutions: Vec<f64> = self.by_solutions.iter().map(|light| (*light * factor).luminance()).collect();
        lights.iter_mut().zip(&by_solutions).for_each(|(light, coarse)| *light += coarse);
        if let Some(all) = lights.last_mut() {
            *all += by_solutions.iter().step_by(MOMENTS).sum::<f64>();
        }
        lights
    }
}

impl<'a, const C: usize> PatchLight<'a, C> {
    /// Makes an estimate of the light of the patches of these zones, one for each tube, that has found nothing yet.
    pub fn new(zones: &'a [Zone], light: &'a EvenLight<'a, C>) -> Self {
        let columns = light.0.map_or(0, TubeSolutions::columns);
        let [by_connections, by_solutions] = [zones.len() * CELLS, columns].map(|lights| vec![Spectrum::ZERO; lights]);
        let none = Found { by_connections, by_solutions };
        Self {
            zones,
            next_event: NextEvent(light),
            found: RefCell::new([none.clone(), none]),
            vectors: pulp::Arch::new(),
        }
    }

    /// Returns the illuminances in lx by one lumen from each patch that all paths have found, times a factor.
    pub fn of_patches(&self, factor: f64) -> Vec<f64> {
        let [found, _] = &*self.found.borrow();
        found.by_connections.iter().map(|light| (*light * factor).luminance()).collect()
    }

    /// Returns the illuminances in lx by the lights of each opening that all paths have found, times a factor: what coarse solutions do not
    /// leave out, and the residual.
    pub fn of_tubes(&self, factor: f64) -> [Vec<f64>; 2] {
        self.found.borrow().each_ref().map(|found| found.of_tubes(self.zones, factor))
    }

    fn find(&self, walk: &Walk<'_, C>, tube: usize, patch: usize, light: Spectrum<C>) {
        let found = &mut self.found.borrow_mut()[usize::from(walk.is_beyond())];
        if let Some(found) = found.by_connections.get_mut(tube * CELLS + patch) {
            *found += light;
        }
    }

    /// Returns the area of the opening of a tube divided by that of the emitting part of a patch; 0 at a point that does not emit.
    fn per_part(&self, tube: &TraceableTube, number: usize, at: DVec3, patch: usize) -> f64 {
        let is_clear = tube.closure_at(at).unscattered::<C>().is_some();
        if is_clear { 0.0 } else { self.zones[number].per_part(patch) }
    }

    /// Returns the luminance in cd/m2 of a point of a patch by one lumen that leaves the patch.
    fn luminance(&self, tube: &TraceableTube, number: usize, at: DVec3, patch: usize) -> f64 {
        self.per_part(tube, number, at, patch) / (PI * tube.opening.area_m2())
    }

    /// Connects a vertex to the opening of a tube; `points` are those that it was connected to last, of the opening of another tube.
    fn connect_to(
        &self,
        walk: &mut Walk<'_, C>,
        vertex: &Vertex<'_, C>,
        (number, tube): (usize, &TraceableTube),
        points: &mut Option<PatchPoints>,
    ) {
        let radius = tube.opening.outer_radius();
        match opening_visibility(walk.scene, vertex, &tube.frame, radius) {
            OpeningVisibility::Never => {}
            _ if vertex.is_narrow() => {}
            _ if !is_far(&tube.frame, radius, vertex.position, 0.0) => {
                let away = tube.opening.point(walk.samples.pair());
                let source = tube.at(away);
                let connected = opening_density(tube, source - vertex.position);
                if let Some((response, density)) = walk.respond(vertex, source, None) {
                    let patch = cell(&tube.opening, away);
                    let luminance = self.luminance(tube, number, source, patch);
                    let weight = power_heuristic(connected, density) / connected;
                    self.find(walk, number, patch, response * (luminance * weight));
                }
            }
            OpeningVisibility::Whole(albedo) => {
                let zone = &self.zones[number];
                let points = match points {
                    Some(points) => points.of(zone),
                    None => points.insert(PatchPoints::new(zone, walk.samples.pair())),
                };
                let receiver = OpeningReceiver::new(vertex.position, vertex.normal, &tube.frame);
                let centre = tube.frame.origin.truncate();
                let lit = PointIlluminances { receiver: &receiver, points, centre };
                let lit = self.vectors.dispatch(lit);
                let found = &mut self.found.borrow_mut()[usize::from(walk.is_beyond())];
                for (found, lit) in found.by_connections[number * CELLS..].iter_mut().zip(lit) {
                    *found += albedo * (lit * (1.0 / PI));
                }
            }
            OpeningVisibility::InPart | OpeningVisibility::ByRays => {
                let numbers: [[f64; 2]; CONNECTIONS] = std::array::from_fn(|_| walk.samples.pair());
                for numbers in numbers {
                    let away = tube.opening.point(numbers);
                    let patch = cell(&tube.opening, away);
                    let source = tube.at(away);
                    let to_light = source - vertex.position;
                    let distance_squared = to_light.length_squared();
                    if let Some((response, _)) = walk.respond(vertex, source, None) {
                        let per_area = tube.frame.up(to_light) / (PI * distance_squared * distance_squared.sqrt());
                        let fraction = self.per_part(tube, number, source, patch) / CONNECTIONS as f64;
                        self.find(walk, number, patch, response * (per_area * fraction));
                    }
                }
            }
        }
    }
}

/// A point of each patch of an opening, relative to its centre. A vertex is connected to the same points of all openings that are alike.
struct PatchPoints {
    zone: Zone,
    numbers: [f64; 2],
    points: [DVec2; CELLS],
    /// 1 for each point that emits, else 0.
    held: [f64; CELLS],
}

impl PatchPoints {
    fn new(zone: &Zone, numbers: [f64; 2]) -> Self {
        Self { zone: *zone, numbers, points: zone.within_each(numbers), held: zone.held() }
    }

    /// Returns the points of a zone, by the same numbers.
    fn of(&mut self, zone: &Zone) -> &Self {
        if self.zone != *zone {
            *self = Self::new(zone, self.numbers);
        }
        self
    }
}

/// Vectorized computation of the illuminance in lx of a receiver by one lumen that leaves each of some points of an opening, where it
/// emits.
struct PointIlluminances<'a> {
    receiver: &'a OpeningReceiver,
    points: &'a PatchPoints,
    centre: DVec2,
}

impl pulp::NullaryFnOnce for PointIlluminances<'_> {
    type Output = [f64; CELLS];

    #[inline(always)]
    fn call(self) -> [f64; CELLS] {
        let Self { receiver, points, centre } = self;
        let mut lit = [0.0; CELLS];
        for ((lit, point), held) in lit.iter_mut().zip(&points.points).zip(&points.held) {
            *lit = receiver.point(centre + *point) * held;
        }
        lit
    }
}

/// Computes the responses of a sensor to whole openings from those to their patches: for each tube that to light which leaves its Lambertian
/// zone evenly, and the moments of this response along x and y in radii of the opening; last, the sum over the tubes of the first of these.
///
/// A lumen whose density falls linearly across a disc, with its centroid at c radii, has the response w + 4 (c_x w_x + c_y w_y), because
/// the mean square of a coordinate over the unit disc is 1/4.
pub fn to_tubes(zones: &[Zone], to_patches: &[f64]) -> Vec<f64> {
    let mut all = 0.0;
    let of_tube = |(zone, to_patches): (&Zone, &[f64])| {
        let (mut even, mut moment, mut square) = (0.0, DVec2::ZERO, 0.0);
        for ((share, centroid), response) in zone.shares().into_iter().zip(zone.centroids()).zip(to_patches) {
            even += share * response;
            moment += share * response * centroid;
            square += share * centroid.length_squared();
        }
        // the moment of a response that is linear in position, which centroids alone make too small
        moment *= if square > 0.0 { zone.mean_square() / square } else { 0.0 };
        all += even;
        [even, moment.x, moment.y]
    };
    let mut responses: Vec<f64> = zones.iter().zip(to_patches.chunks_exact(CELLS)).flat_map(of_tube).collect();
    responses.push(all);
    responses
}

/// Daylight of which only the coarse solutions are known, if there are any: none comes down the tubes.
#[derive(Debug)]
pub struct EvenLight<'a, const C: usize>(pub Option<&'a TubeSolutions<C>>);

impl<const C: usize> Daylight<C> for EvenLight<'_, C> {
    fn connect(&self, _: &mut Walk<'_, C>, _: &Vertex<'_, C>, _: usize) {}

    fn reflected(&self, surface: SurfaceId, point: DVec3, sensor: Option<DVec3>) -> Option<Spectrum<C>> {
        self.0?.all.luminance(surface, point, sensor)
    }

    fn coarse_solution(&self) -> Option<&Solution<C>> {
        Some(&self.0?.all)
    }

    fn sky_weight(&self, _: &TraceableScene, _: usize, _: &PathState, _: DVec3) -> Option<f64> {
        None
    }
}

impl<const C: usize> Meeting<C> for PatchLight<'_, C> {
    type Trace = PathState;
    type Arrival = ();

    fn reflected(&self, ray: &Ray<C, PathState>, surface: SurfaceId, point: DVec3) -> Option<Spectrum<C>> {
        self.next_event.reflected(ray, surface, point)
    }

    fn counts(&self, (surface, point): (SurfaceId, DVec3), weight: Spectrum<C>, gathered: f64, beyond: f64) {
        let Some(solutions) = self.next_event.0.0 else { return };
        let lights = solutions.at(surface, point);
        for (found, times) in self.found.borrow_mut().iter_mut().zip([gathered, beyond]) {
            if times != 0.0 {
                let times = weight * times;
                found.by_solutions.iter_mut().zip(lights).for_each(|(found, light)| *found += times * *light);
            }
        }
    }

    fn bright_patches(&self) -> Option<&BrightPatches> {
        self.next_event.bright_patches()
    }

    fn is_aimed(&self, state: PathState, target: Option<Target>, fraction: f64) -> PathState {
        self.next_event.is_aimed(state, target, fraction)
    }

    fn aim_weight(&self, ray: &Ray<C, PathState>, surface: SurfaceId, hit: &RoomHit) -> f64 {
        self.next_event.aim_weight(ray, surface, hit)
    }

    fn arrives(&self, _: &PathState, _: f64) {}

    fn arrives_at_closure(&self) {}

    fn arrives_at_sensor(&self) {}

    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, (): &()) {
        self.next_event.connect(walk, vertex, &());
        if vertex.is_sensor() {
            return;
        }
        let scene = walk.scene;
        let mut points = None;
        for (number, tube) in scene.tubes.iter().enumerate() {
            if tube.frame.depth(vertex.position) > 0.0 {
                self.connect_to(walk, vertex, (number, tube), &mut points);
            }
        }
    }

    fn leaves(&self, scene: &TraceableScene, vertex: &Vertex<'_, C>, (): &(), toward: DVec3, pdf: f64) -> PathState {
        self.next_event.leaves(scene, vertex, &(), toward, pdf)
    }

    fn turns(&self, scene: &TraceableScene, state: &PathState, surface: SurfaceId) -> PathState {
        self.next_event.turns(scene, state, surface)
    }

    fn passes(&self, state: &PathState) -> PathState {
        self.next_event.passes(state)
    }

    fn luminaire_weight(&self, scene: &TraceableScene, number: usize, ray: &Ray<C, PathState>, position: DVec3) -> f64 {
        self.next_event.luminaire_weight(scene, number, ray, position)
    }

    fn meets_opening(
        &self,
        walk: &mut Walk<'_, C>,
        tube: usize,
        ray: &Ray<C, PathState>,
        position: DVec3,
    ) -> Option<DaylightWeights> {
        let of = &walk.scene.tubes[tube];
        let found = match ray.trace.last {
            Some(last) if last.narrow => 1.0,
            Some(last) if is_far(&of.frame, of.opening.outer_radius(), last.position, 0.0) => 0.0,
            Some(last) => power_heuristic(last.density, opening_density(of, position - last.position)),
            None if ray.trace.from_eye => 0.0,
            None => 1.0,
        };
        if found > 0.0 {
            let patch = cell(&of.opening, of.away(position));
            self.find(walk, tube, patch, ray.weight * (self.luminance(of, tube, position, patch) * found));
        }
        Some(DaylightWeights::NONE)
    }
}
