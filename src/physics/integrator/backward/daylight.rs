//! Daylight followed backward: from a vertex through an opening up the guide into the sky, and from the sun down to it.
//!
//! Every vertex is connected to a point of each opening, or of the near part of it, and from there the path continues through the closure,
//! up the guide and into the sky. The scattered ray that leaves the vertex finds openings too, and the two share the sky by the power
//! heuristic (Veach and Guibas 1995, beta = 2). Far from an opening scattered rays would find the sky rarely, unnoticed by the standard
//! error; there their weight is nearly 0.
//!
//! The sun's disc is too small to be found by chance: it is counted by connections only, of vertices and of the eye to rays of the sun that
//! are followed from the collector down to a closure that scatters.
//!
//! The weights are derived in docs/physics/measurement_equation.md#daylight-at-a-vertex.

use glam::DVec3;

use super::meeting::Walk;
use super::next_event::{Daylight, PathState, power_heuristic};
use super::up_guide::upward;
use super::vertex::Vertex;
use crate::guide::{End, Transit};
use crate::integrator::photon::descent::{Exit, sun_exits};
use crate::optics::SheetSide;
use crate::scene::OpeningShape;
use crate::sky::Sun;
use crate::traceable::{TraceableScene, TraceableTube};

/// Daylight estimator whose paths are followed up to the sky, with one connection per vertex and opening.
#[derive(Debug)]
pub struct Followed;

impl<const C: usize> Daylight<C> for Followed {
    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, tube: usize) {
        DaylightConnections::ONE.connect(walk, vertex, tube);
    }

    fn sky_weight(&self, scene: &TraceableScene, tube: usize, state: &PathState, position: DVec3) -> Option<f64> {
        // connections count the sun, and share the sky that is found at once
        Some(DaylightConnections::ONE.sky_weight(&scene.tubes[tube], state, position))
    }
}

/// Daylight estimator of scattered light: like [`Followed`], but without light that enters the room unscattered through clear zones of
/// closures.
#[derive(Debug)]
pub struct ScatteredDaylight {
    /// Number of connections of each vertex to an opening.
    pub connections: u32,
    /// Largest distance in m of points of an opening that are connected; may be infinite.
    pub within: f64,
}

impl ScatteredDaylight {
    fn connections(&self) -> DaylightConnections {
        DaylightConnections { count: self.connections, scattered: true, within: self.within }
    }
}

impl<const C: usize> Daylight<C> for ScatteredDaylight {
    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, tube: usize) {
        self.connections().connect(walk, vertex, tube);
    }

    fn sky_weight(&self, scene: &TraceableScene, tube: usize, state: &PathState, position: DVec3) -> Option<f64> {
        let is_clear = scene.tubes[tube].closure_at(position).unscattered::<C>().is_some();
        let is_within = state.last.is_none_or(|last| (position - last.position).length() < self.within);
        (!is_clear && is_within).then(|| self.connections().sky_weight(&scene.tubes[tube], state, position))
    }
}

/// Connections of a vertex to sky and sun through an opening.
struct DaylightConnections {
    count: u32,
    /// True if clear zones of the closure are excluded.
    scattered: bool,
    /// Largest distance in m of points of the opening that are connected; may be infinite.
    within: f64,
}

impl DaylightConnections {
    /// One connection, to any point of the opening.
    const ONE: Self = Self { count: 1, scattered: false, within: f64::INFINITY };

    /// Returns the weight (MIS) of the sky that a scattered ray finds beside these connections.
    fn sky_weight(&self, tube: &TraceableTube, state: &PathState, position: DVec3) -> f64 {
        state.last.map_or(1.0, |last| {
            let area = Part::within(tube, last.position, self.within).map_or(0.0, |part| part.shape.area_m2());
            let connected = area_density(area, position - last.position, tube);
            power_heuristic(last.density, f64::from(self.count) * connected)
        })
    }

    fn connect<const C: usize>(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, tube: usize) {
        let vertex = &Vertex { weight: vertex.weight * (1.0 / f64::from(self.count)), ..*vertex };
        let scene = walk.scene;
        let tube = &scene.tubes[tube];
        let Some(part) = Part::within(tube, vertex.position, self.within).filter(|_| tube.is_daylit()) else { return };
        for _ in 0..self.count {
            if tube.sky.is_some() {
                self.connect_sky(walk, vertex, tube, &part);
            }
            if let Some(sun) = &tube.sun
                && tube.scatters()
            {
                self.connect_scattered_sun(walk, vertex, tube, sun);
            }
        }
    }

    /// Adds the light of the sky through a random point of a tube's opening.
    fn connect_sky<const C: usize>(
        &self,
        walk: &mut Walk<'_, C>,
        vertex: &Vertex<'_, C>,
        tube: &TraceableTube,
        part: &Part,
    ) {
        let away = tube.frame.direction_in_room(part.shape.point(walk.samples.pair()).extend(0.0));
        let point = part.centre + away;
        let to_light = point - vertex.position;
        if to_light.length() >= self.within || !tube.has(point) {
            return;
        }
        let from = -to_light.normalize();
        let closure = tube.closure_at(point);
        // drawn before the vertex answers, so that what is hidden uses as many numbers as what is seen
        let upward = upward::<C>(tube, &closure, from, SheetSide::Other, &mut walk.samples);
        let Some((response, density)) = walk.respond(vertex, point, None) else { return };
        let Some((toward, weight)) = upward.filter(|(_, weight)| weight.max() > 0.0) else { return };
        if self.scattered && closure.unscattered::<C>().is_some() {
            return;
        }
        let transit: Transit<C> = tube.up(point, toward, &mut walk.samples.random);
        walk.rays += transit.ray_count();
        if transit.end != End::Top {
            return;
        }
        let sky = tube.sky.as_ref().map_or(0.0, |sky| sky.luminance(transit.direction));
        let connected = area_density(part.shape.area_m2(), to_light, tube);
        let counted = power_heuristic(f64::from(self.count) * connected, density);
        walk.sum += response * weight * transit.weight() * (sky * counted / connected);
    }

    /// Adds the sunlight that a tube's closure scatters straight to a vertex.
    fn connect_scattered_sun<const C: usize>(
        &self,
        walk: &mut Walk<'_, C>,
        vertex: &Vertex<'_, C>,
        tube: &TraceableTube,
        sun: &Sun,
    ) {
        let mut exits: Vec<Exit<'_, C>> = Vec::new();
        sun_exits(walk.scene, tube, sun, &mut walk.samples, &mut walk.rays, |exit| exits.push(*exit));
        for exit in exits {
            let to_light = exit.position - vertex.position;
            let distance_squared = to_light.length_squared();
            if distance_squared >= self.within * self.within {
                continue;
            }
            let intensity = exit.intensity(-to_light / distance_squared.sqrt());
            if intensity.max() > 0.0
                && let Some((response, _)) = walk.respond(vertex, exit.position, None)
            {
                walk.sum += response * intensity * (1.0 / distance_squared);
            }
        }
    }
}

/// Part of the plane of an opening from which points are drawn: it contains the part of the opening that is near to a vertex.
struct Part {
    centre: DVec3,
    shape: OpeningShape,
}

impl Part {
    /// Returns a tube's opening, or the disc of its plane within `within` m of `from` where that is smaller than the disc around the
    /// opening; `None` if the plane is farther away.
    fn within(tube: &TraceableTube, from: DVec3, within: f64) -> Option<Self> {
        let height = tube.frame.depth(from);
        let radius = (within * within - height * height).max(0.0).sqrt();
        if radius < tube.opening.outer_radius() {
            let (centre, shape) = (tube.frame.onto(from), OpeningShape::Disc { radius });
            return (radius > 0.0).then_some(Self { centre, shape });
        }
        Some(Self { centre: tube.frame.origin, shape: tube.opening })
    }
}

/// Returns the density per sr, seen from the start of `to_light`, of a uniform random point of a tube's opening.
pub fn opening_density(tube: &TraceableTube, to_light: DVec3) -> f64 {
    area_density(tube.opening.area_m2(), to_light, tube)
}

/// Returns the density per sr, seen from the start of `to_light`, of a uniform random point of an area in m2 in the plane of a tube's opening.
fn area_density(area_m2: f64, to_light: DVec3, tube: &TraceableTube) -> f64 {
    let distance_squared = to_light.length_squared();
    distance_squared * distance_squared.sqrt() / (tube.frame.up(to_light).abs() * area_m2)
}
