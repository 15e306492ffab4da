//! Daylight followed backward: from a vertex through an opening up the guide into the sky, and from the sun down to it.
//!
//! Every vertex is connected to a point of each opening, and from there the way goes on through the closure, up the guide and
//! into the sky; the ray that goes on from the vertex finds openings too, and the two share the sky by the power heuristic
//! (Veach and Guibas 1995, beta = 2): what rare rays would add far from an opening, unseen by a standard error, is nothing.
//!
//! The sun's disc is too small to be found by chance: it is counted by connections only, of vertices and of the eye to rays
//! of the sun that go from the collector down to a closure that scatters.
//!
//! The weights are derived in docs/physics/measurement_equation.md#daylight-at-a-vertex.

use glam::DVec3;

use super::next_event::{Daylight, Way, share};
use super::up_guide::upward;
use super::vertex::Vertex;
use super::walk::Walk;
use crate::guide::{End, Transit};
use crate::integrator::photon::descent::{Exit, sun_exits};
use crate::optics::SheetSide;
use crate::sampling::warp;
use crate::sky::Sun;
use crate::traceable::{TraceableScene, TraceableTube};

/// Daylight that the path itself follows to sky and sun.
#[derive(Debug)]
pub struct Followed;

impl<const C: usize> Daylight<C> for Followed {
    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, tube: usize) {
        connect_daylight(walk, vertex, tube, (1, false));
    }

    fn found_share(&self, scene: &TraceableScene, tube: usize, way: &Way, position: DVec3) -> Option<f64> {
        // connections count the sun, and share the sky that is found at once
        Some(sky_share(&scene.tubes[tube], way, position, 1))
    }
}

/// The share of the sky that a ray counts beside so many connections.
fn sky_share(tube: &TraceableTube, way: &Way, position: DVec3, connections: u32) -> f64 {
    way.last.map_or(1.0, |last| {
        let connected = f64::from(connections) * opening_density(tube, position - last.position);
        share(last.density, connected)
    })
}

/// Connects a vertex to sky and sun through a tube, so many times; `scattered`: not through clear zones of its closure.
fn connect_daylight<const C: usize>(
    walk: &mut Walk<'_, C>,
    vertex: &Vertex<'_, C>,
    tube: usize,
    (connections, scattered): (u32, bool),
) {
    let vertex = &Vertex { weight: vertex.weight * (1.0 / f64::from(connections)), ..*vertex };
    let scene = walk.scene;
    let tube = &scene.tubes[tube];
    if !tube.daylit {
        return;
    }
    for _ in 0..connections {
        if scene.sky.is_some() {
            connect_sky(walk, vertex, tube, (connections, scattered));
        }
        if let Some(sun) = &scene.sun
            && tube.diffuser.scatters(tube.opening_radius)
        {
            connect_scattered_sun(walk, vertex, tube, sun);
        }
    }
}

/// The same but for light that comes into the room unscattered, through clear zones of closures.
#[derive(Debug)]
pub struct FollowedThroughLamps {
    /// Connections of each vertex.
    pub connections: u32,
}

impl<const C: usize> Daylight<C> for FollowedThroughLamps {
    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, tube: usize) {
        connect_daylight(walk, vertex, tube, (self.connections, true));
    }

    fn found_share(&self, scene: &TraceableScene, tube: usize, way: &Way, position: DVec3) -> Option<f64> {
        let is_clear = scene.tubes[tube].closure_at(position).unscattered::<C>().is_some();
        (!is_clear).then(|| sky_share(&scene.tubes[tube], way, position, self.connections))
    }
}

/// Adds sky through a point of a tube's opening, one of so many connections; `scattered`: only where the closure scatters it.
fn connect_sky<const C: usize>(
    walk: &mut Walk<'_, C>,
    vertex: &Vertex<'_, C>,
    tube: &TraceableTube,
    (connections, scattered): (u32, bool),
) {
    let point = tube.origin + (warp::disc(walk.samples.pair()) * tube.opening_radius).extend(0.0);
    let way = point - vertex.position;
    let from = -way.normalize();
    let closure = tube.closure_at(point);
    // drawn before the vertex answers, so that what is hidden uses as many numbers as what is seen
    let upward = upward::<C>(tube, &closure, from, SheetSide::Other, &mut walk.samples);
    let Some((response, density)) = walk.respond(vertex, point, None) else { return };
    let Some((toward, weight)) = upward.filter(|(_, weight)| weight.max() > 0.0) else { return };
    if scattered && closure.unscattered::<C>().is_some() {
        return;
    }
    let transit: Transit<C> = tube.guide.up(point - tube.origin, toward, &mut walk.samples.random);
    walk.rays += transit.ray_count();
    if transit.end != End::Top {
        return;
    }
    let sky = walk.scene.sky.as_ref().map_or(0.0, |sky| sky.luminance(transit.direction));
    let connected = opening_density(tube, way);
    let counted = share(f64::from(connections) * connected, density);
    walk.sum += response * weight * transit.weight() * (sky * counted / connected);
}

/// Adds sun that a tube's closure scatters straight to a vertex.
fn connect_scattered_sun<const C: usize>(
    walk: &mut Walk<'_, C>,
    vertex: &Vertex<'_, C>,
    tube: &TraceableTube,
    sun: &Sun,
) {
    let mut exits: Vec<Exit<'_, C>> = Vec::new();
    sun_exits(walk.scene, tube, sun, &mut walk.samples, &mut walk.rays, |exit| exits.push(*exit));
    for exit in exits {
        let way = exit.position - vertex.position;
        let distance_squared = way.length_squared();
        let intensity = exit.intensity(-way / distance_squared.sqrt());
        if intensity.max() > 0.0
            && let Some((response, _)) = walk.respond(vertex, exit.position, None)
        {
            walk.sum += response * intensity * (1.0 / distance_squared);
        }
    }
}

/// Density per sr, seen from the start of `way`, of an even point of a tube's opening.
pub fn opening_density(tube: &TraceableTube, way: DVec3) -> f64 {
    let distance_squared = way.length_squared();
    distance_squared * distance_squared.sqrt() / (way.z.abs() * tube.opening_area_m2())
}
