//! The eye's side: paths from sensors and pixels, each connected to the vertices of one photon.

use std::f64::consts::PI;

use glam::DVec3;

use super::light::LightVertex;
use super::weight::{Edge, MisWeight};
use crate::integrator::backward::opening::DaylightShare;
use crate::integrator::backward::vertex::Vertex;
use crate::integrator::backward::walk::{Meeting, Ray, Walk};
use crate::traceable::{SurfaceId, TraceableScene};

/// Densities with which photons start, of the sources that eye paths can find.
#[derive(Debug)]
pub struct Starts {
    /// Density of sky light on each tube's opening, per m2.
    pub sky: Vec<f64>,
    /// Density on each luminaire, per m2.
    pub luminaires: Vec<f64>,
}

/// Place where an eye ray starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum From {
    /// A sensor: light that comes to it straight through a clear closure is counted otherwise, by one rule for points and
    /// one for cells.
    Point,
    /// Photons times the cell's area in m2 for each of its paths: what a mirror shows, the photons that cross it share.
    Cell(f64),
    /// The eye: it sees the sun.
    Eye,
    /// A vertex, or an opening that it passed.
    Inside,
}

/// The eye's side of one path: what it is connected to.
pub struct EyeSide<'a, const C: usize> {
    pub starts: &'a Starts,
    /// The vertices of the photon that it is connected to.
    pub photon: &'a [LightVertex<C>],
    /// Number of photons of the pass.
    pub photons: f64,
    pub from: From,
    /// Number of connections of photons to the sensor, or to the eye, for each of its paths.
    pub cut: f64,
}

/// What an eye ray remembers of its way.
#[derive(Clone, Copy, Debug)]
pub struct EyeTrace {
    edge: Edge,
    from: From,
}

/// What is known of the way to a vertex.
#[derive(Clone, Copy, Debug)]
pub struct EyeArrival {
    weight: MisWeight,
    /// Samples of the strategy that cuts the edge that leaves the vertex.
    cut: f64,
    from: From,
}

impl<const C: usize> EyeSide<'_, C> {
    /// Trace of a ray straight from the eye through a pixel of solid angle `pixel` in sr; `outside` is the distance in m from
    /// the eye to where its ray enters the room.
    pub fn start_at_eye(&self, outside: f64, pixel: f64) -> EyeTrace {
        let mut edge = Edge::leaving(&MisWeight::start(1.0, 0.0), 1.0 / pixel, 1.0, 0.0, self.cut);
        edge.extend(outside);
        EyeTrace { edge, from: From::Eye }
    }
}

impl<const C: usize> Meeting<C> for EyeSide<'_, C> {
    type Trace = EyeTrace;
    type Arrival = EyeArrival;

    fn flew(&self, trace: &mut EyeTrace, length: f64) {
        trace.edge.extend(length);
    }

    fn arrives(&self, trace: &EyeTrace, cosine: f64) -> EyeArrival {
        EyeArrival { weight: trace.edge.arrive(cosine), cut: 1.0, from: From::Inside }
    }

    fn arrives_at_closure(&self) -> EyeArrival {
        EyeArrival { weight: MisWeight::start(1.0, 0.0), cut: 1.0, from: From::Inside }
    }

    fn arrives_at_sensor(&self) -> EyeArrival {
        EyeArrival { weight: MisWeight::start(1.0, 0.0), cut: self.cut, from: self.from }
    }

    /// Adds what the photon's vertices send straight to a vertex, and by it toward the eye; sensors have connections of their
    /// own.
    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, arrival: &EyeArrival) {
        if vertex.is_sensor() {
            return;
        }
        let scene = walk.scene;
        for light in self.photon {
            let way = light.position - vertex.position;
            let distance_squared = way.length_squared();
            if distance_squared == 0.0 {
                continue;
            }
            let toward = way / distance_squared.sqrt();
            let (response, forward) = vertex.response(toward);
            let arriving = response * light.intensity(scene, -toward);
            if arriving.max() <= 0.0 {
                continue;
            }
            walk.rays += 1;
            if !scene.visible(light.position, light.surface, vertex.position, vertex.surface) {
                continue;
            }
            let by_eye = forward * -toward.dot(light.normal) / distance_squared;
            let by_light = light.forward(scene, -toward) * toward.dot(vertex.normal) / distance_squared;
            let others = light.weight.others(by_eye, light.back(scene, -toward))
                + arrival.weight.others(by_light, vertex.back(toward));
            walk.sum += arriving * (self.photons / (distance_squared * (1.0 + others)));
        }
    }

    fn leaves(
        &self,
        _: &TraceableScene,
        vertex: &Vertex<'_, C>,
        arrival: &EyeArrival,
        toward: DVec3,
        pdf: f64,
    ) -> EyeTrace {
        let cosine = toward.dot(vertex.normal);
        let edge = Edge::leaving(&arrival.weight, pdf, cosine, vertex.back(toward), arrival.cut);
        EyeTrace { edge, from: arrival.from }
    }

    fn turns(&self, _: &TraceableScene, trace: &EyeTrace, _: SurfaceId) -> EyeTrace {
        let mut trace = *trace;
        trace.edge.turn();
        trace
    }

    fn passes(&self, _: &EyeTrace) -> EyeTrace {
        EyeTrace { edge: Edge::uncut(), from: From::Inside }
    }

    fn luminaire_share(&self, scene: &TraceableScene, number: usize, ray: &Ray<C, EyeTrace>, _: DVec3) -> f64 {
        let cosine = -ray.direction.dot(scene.luminaires[number].normal);
        let weight = ray.trace.edge.arrive(cosine);
        let start = self.starts.luminaires[number];
        let others = weight.others(start, cosine / PI) + crossings(&ray.trace, &weight, start);
        1.0 / (1.0 + others)
    }

    fn meets_opening(
        &self,
        walk: &mut Walk<'_, C>,
        tube: usize,
        ray: &Ray<C, EyeTrace>,
        position: DVec3,
    ) -> Option<DaylightShare> {
        let EyeTrace { edge, from } = ray.trace;
        let mut weight = edge.arrive(ray.direction.z);
        let clear = walk.scene.tubes[tube].closure_at(position).unscattered::<C>().is_some();
        let straight_to_sensor = clear && weight.cut > 0.0;
        let start = self.starts.sky[tube];
        let crossing = crossings(&ray.trace, &weight, start);
        if clear {
            weight.cut = 0.0;
        }
        let sun = if clear && from == From::Eye { 1.0 } else { 0.0 };
        let sky = 1.0 / (1.0 + weight.others(start, ray.direction.z / PI) + crossing);
        Some(match from {
            // photons reach points by their last way through the closure alone, cells by any
            From::Point if straight_to_sensor => DaylightShare { sky: 0.0, sky_later: 1.0, sun },
            From::Cell(_) if straight_to_sensor => DaylightShare { sky: 0.0, sky_later: 0.0, sun },
            _ => DaylightShare { sky, sky_later: sky, sun },
        })
    }
}

/// Photons that cross a cell from a mirror that shows it the source, relative to the ray that found it; `start` is the
/// density of their start per m2.
fn crossings(trace: &EyeTrace, weight: &MisWeight, start: f64) -> f64 {
    match trace.from {
        From::Cell(crossings_per_path) if weight.cut == 0.0 => crossings_per_path * start,
        _ => 0.0,
    }
}
