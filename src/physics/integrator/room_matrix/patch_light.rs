//! Paths that find the light of the patches of openings, separately for one lumen from each patch.
//!
//! A vertex that sees the opening whole is connected to a point of each patch, any other to some points of the opening, with a shadow
//! ray each. Very near to an opening one such connection and the scattered ray share the light by the power heuristic (Veach and Guibas
//! 1995, beta = 2); after narrow lobes and mirrors the ray finds it. So every light path is counted once.

use std::cell::RefCell;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::integrator::backward::daylight::opening_density;
use crate::integrator::backward::next_event::{Daylight, NextEvent, PathState, power_heuristic};
use crate::integrator::backward::opening::DaylightWeights;
use crate::integrator::backward::vertex::Vertex;
use crate::integrator::backward::walk::{Meeting, Ray, Walk};
use crate::integrator::diffuser_source::cells::{OpeningReceiver, is_far};
use crate::integrator::diffuser_source::opening_visibility::{OpeningVisibility, opening_visibility};
use crate::integrator::diffuser_source::patches::{CELLS, cell};
use crate::integrator::diffuser_source::zone::Zone;
use crate::optics::Spectrum;
use crate::traceable::{SurfaceId, TraceableScene, TraceableTube};

/// Number of points of an opening that a vertex is connected to where it may see only a part of it.
const CONNECTIONS: usize = 2;

/// Light that a path finds of each patch, in lx (or cd/m2 for a path from an eye) per lumen that leaves it, tube by tube; the light of
/// luminaires is added to the walk's sum.
#[derive(Debug)]
pub struct PatchLight<'a, const C: usize> {
    /// Emitting zone of each opening.
    zones: &'a [Zone],
    found: RefCell<Vec<Spectrum<C>>>,
    vectors: pulp::Arch,
}

impl<'a, const C: usize> PatchLight<'a, C> {
    /// Makes an estimate of the light of the patches of these zones, one for each tube, that has found nothing yet.
    pub fn new(zones: &'a [Zone]) -> Self {
        let found = RefCell::new(vec![Spectrum::ZERO; zones.len() * CELLS]);
        Self { zones, found, vectors: pulp::Arch::new() }
    }

    /// Returns the light that all paths have found, patch by patch.
    pub fn into_found(self) -> Vec<Spectrum<C>> {
        self.found.into_inner()
    }

    fn find(&self, tube: usize, patch: usize, light: Spectrum<C>) {
        if let Some(found) = self.found.borrow_mut().get_mut(tube * CELLS + patch) {
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
                    self.find(number, patch, response * (luminance * power_heuristic(connected, density) / connected));
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
                let mut found = self.found.borrow_mut();
                for (found, lit) in found.iter_mut().skip(number * CELLS).zip(lit) {
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
                        self.find(number, patch, response * (per_area * fraction));
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

/// Daylight estimator without light: none comes down the tubes.
struct NoDaylight;

impl<const C: usize> Daylight<C> for NoDaylight {
    fn connect(&self, _: &mut Walk<'_, C>, _: &Vertex<'_, C>, _: usize) {}

    fn sky_weight(&self, _: &TraceableScene, _: usize, _: &PathState, _: DVec3) -> Option<f64> {
        None
    }
}

/// Next-event estimation of luminaires, which are found as by any other path.
const LUMINAIRES: NextEvent<'static, NoDaylight> = NextEvent(&NoDaylight);

impl<const C: usize> Meeting<C> for PatchLight<'_, C> {
    type Trace = PathState;
    type Arrival = ();

    fn arrives(&self, _: &PathState, _: f64) {}

    fn arrives_at_closure(&self) {}

    fn arrives_at_sensor(&self) {}

    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, (): &()) {
        LUMINAIRES.connect(walk, vertex, &());
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
        Meeting::<C>::leaves(&LUMINAIRES, scene, vertex, &(), toward, pdf)
    }

    fn turns(&self, scene: &TraceableScene, state: &PathState, surface: SurfaceId) -> PathState {
        Meeting::<C>::turns(&LUMINAIRES, scene, state, surface)
    }

    fn passes(&self, state: &PathState) -> PathState {
        Meeting::<C>::passes(&LUMINAIRES, state)
    }

    fn luminaire_weight(&self, scene: &TraceableScene, number: usize, ray: &Ray<C, PathState>, position: DVec3) -> f64 {
        LUMINAIRES.luminaire_weight(scene, number, ray, position)
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
            self.find(tube, patch, ray.weight * (self.luminance(of, tube, position, patch) * found));
        }
        Some(DaylightWeights::NONE)
    }
}
