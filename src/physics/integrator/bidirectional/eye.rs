//! Eye subpaths: paths from sensors and pixels, each connected to the vertices of one photon.

use std::f64::consts::PI;

use glam::DVec3;

use super::light::LightVertex;
use super::weight::{Edge, MisWeight};
use crate::integrator::backward::meeting::{Meeting, Ray, Walk};
use crate::integrator::backward::opening::DaylightWeights;
use crate::integrator::backward::vertex::Vertex;
use crate::traceable::{SurfaceId, TraceableScene};

/// Densities with which photons start at the sources that eye paths can find.
#[derive(Debug)]
pub struct Starts {
    /// Density of sky light on each tube's opening, per m2.
    pub sky: Vec<f64>,
    /// Density on each luminaire, per m2.
    pub luminaires: Vec<f64>,
}

/// Start of an eye ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum From {
    /// Point sensor: another estimator counts the light that comes to it straight through a clear closure, with other rules than for cells.
    Point,
    /// Cell, with the number of photons times the cell's area in m2 for each of its paths: photons that cross the cell share the light that
    /// a mirror shows it.
    Cell(f64),
    /// Eye, whose rays find the sun.
    Eye,
    /// Vertex, or an opening that the path passed.
    Inside,
}

/// Estimator of one eye path: the photon to which it is connected, and the numbers of samples.
pub struct EyeSide<'a, const C: usize> {
    pub starts: &'a Starts,
    /// Vertices of the photon to which the path is connected.
    pub photon: &'a [LightVertex<C>],
    /// Number of photons of the pass.
    pub photons: f64,
    pub from: From,
    /// Number of connections of photons to the sensor, or to the eye, for each of its paths.
    pub cut: f64,
}

/// State of an eye ray, from which the weights (MIS) of the light that it finds follow.
#[derive(Clone, Copy, Debug)]
pub struct EyeTrace {
    edge: Edge,
    from: From,
}

/// State of an eye path that arrives at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct EyeArrival {
    weight: MisWeight,
    /// Number of samples of the strategy that cuts the edge leaving the vertex.
    cut: f64,
    from: From,
}

impl<const C: usize> EyeSide<'_, C> {
    /// Makes the state of a ray straight from the eye through a pixel of solid angle `pixel` in sr; `outside` is the distance in m from the
    /// eye to the point where its ray enters the room.
    pub fn start_at_eye(&self, outside: f64, pixel: f64) -> EyeTrace {
        let mut edge = Edge::outgoing(&MisWeight::start(1.0, 0.0), 1.0 / pixel, 1.0, 0.0, self.cut);
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

    /// Adds the light that the photon's vertices send straight to a vertex, and that is scattered there toward the eye; sensors have
    /// connections of their own.
    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, arrival: &EyeArrival) {
        if vertex.is_sensor() {
            return;
        }
        let scene = walk.scene;
        for light in self.photon {
            let to_light = light.position - vertex.position;
            let distance_squared = to_light.length_squared();
            if distance_squared == 0.0 {
                continue;
            }
            let toward = to_light / distance_squared.sqrt();
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
        let edge = Edge::outgoing(&arrival.weight, pdf, cosine, vertex.back(toward), arrival.cut);
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

    fn luminaire_weight(&self, scene: &TraceableScene, number: usize, ray: &Ray<C, EyeTrace>, _: DVec3) -> f64 {
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
    ) -> Option<DaylightWeights> {
        let EyeTrace { edge, from } = ray.trace;
        let of_tube = &walk.scene.tubes[tube];
        let cosine = of_tube.frame.up(ray.direction);
        let mut weight = edge.arrive(cosine);
        let clear = of_tube.closure_at(position).unscattered::<C>().is_some();
        let straight_to_sensor = clear && weight.cut > 0.0;
        let start = self.starts.sky[tube];
        let crossing = crossings(&ray.trace, &weight, start);
        if clear {
            weight.cut = 0.0;
        }
        let sun = if clear && from == From::Eye { 1.0 } else { 0.0 };
        let sky = 1.0 / (1.0 + weight.others(start, cosine / PI) + crossing);
        Some(match from {
            // photons reach points by their last segment through the closure alone, cells by any
            From::Point if straight_to_sensor => DaylightWeights { sky: 0.0, sky_later: 1.0, sun },
            From::Cell(_) if straight_to_sensor => DaylightWeights { sky: 0.0, sky_later: 0.0, sun },
            _ => DaylightWeights { sky, sky_later: sky, sun },
        })
    }
}

/// Returns the weight of photons that cross a cell from a mirror showing the source to it, relative to the ray that found the source;
/// `start` is the density of their start per m2.
fn crossings(trace: &EyeTrace, weight: &MisWeight, start: f64) -> f64 {
    match trace.from {
        From::Cell(crossings_per_path) if weight.cut == 0.0 => crossings_per_path * start,
        _ => 0.0,
    }
}
