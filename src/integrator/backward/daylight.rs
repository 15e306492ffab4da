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

use std::f64::consts::PI;

use glam::DVec3;

use super::opening::{above_closure, shares};
use super::vertex::{Ray, Scatter, Vertex, share};
use super::walk::{Daylight, Path};
use crate::guide::{End, Transit};
use crate::integrator::backward::room_entry::enter_room;
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::{Closure, Spectrum};
use crate::sampling::warp;
use crate::scene::View;
use crate::sky::Sun;
use crate::sky::sun::HALF_ANGLE;
use crate::traceable::{TraceableScene, TraceableTube};

/// Daylight that the path itself follows to sky and sun.
pub struct Followed;

impl<const C: usize> Daylight<C> for Followed {
    fn connect(&self, path: &mut Path, vertex: &Vertex<C>, tube: usize, sum: &mut Spectrum<C>) {
        let scene = path.scene;
        let tube = &scene.tubes[tube];
        if scene.sky.is_some() {
            *sum += path.sky(vertex, tube);
        }
        if let Some(sun) = &scene.sun
            && tube.diffuser.scatters(tube.opening_radius)
        {
            *sum += path.scattered_sun(vertex, tube, sun);
        }
    }

    fn found_share(&self, scene: &TraceableScene, tube: usize, ray: &Ray<C>, position: DVec3) -> Option<f64> {
        // connections count the sun, and share the sky that is found at once
        Some(ray.last.map_or(1.0, |last| {
            let connected = opening_density(&scene.tubes[tube], position - last.position);
            share(last.density, connected)
        }))
    }
}

impl Path<'_> {
    /// Sky through a point of a tube's opening.
    fn sky<const C: usize>(&mut self, vertex: &Vertex<C>, tube: &TraceableTube) -> Spectrum<C> {
        let point = tube.origin + (warp::disc(self.samples.pair()) * tube.opening_radius).extend(0.0);
        let up = self.samples.pair();
        let way = point - vertex.position;
        let Some((response, density)) = self.respond(vertex, point, None) else { return Spectrum::ZERO };
        let toward = way.normalize();
        let (direction, factor) = match tube.closure_at(point) {
            Closure::Specular { transmittance } => (toward, Spectrum::from_rgb(transmittance)),
            closure => {
                let scatter = Scatter { transmitted: true, eye_cosine: toward.z };
                above_closure(closure, scatter, up, &mut self.samples.random)
            }
        };
        if factor.max() <= 0.0 {
            return Spectrum::ZERO;
        }
        let transit: Transit<C> = tube.guide.up(point - tube.origin, direction, &mut self.samples.random);
        self.rays += u64::from(transit.rays);
        if transit.end != End::Top {
            return Spectrum::ZERO;
        }
        let sky = self.scene.sky.as_ref().map_or(0.0, |sky| sky.luminance(transit.direction));
        let connected = opening_density(tube, way);
        response * factor * transit.weight() * (sky * share(connected, density) / connected)
    }

    /// Sun that a tube's closure scatters straight to a vertex.
    fn scattered_sun<const C: usize>(&mut self, vertex: &Vertex<C>, tube: &TraceableTube, sun: &Sun) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        self.sun_exits(tube, sun, |path, exit: &Exit<C>| {
            let way = exit.position - vertex.position;
            let distance_squared = way.length_squared();
            let intensity = exit.intensity(way.z / distance_squared.sqrt());
            if intensity.max() > 0.0
                && let Some((response, _)) = path.respond(vertex, exit.position, None)
            {
                sum += response * intensity * (1.0 / distance_squared);
            }
        });
        sum
    }

    /// A ray of the sun from the collector down, and on as often as the tube returns it to the closure: every point where
    /// it arrives at a closure that scatters.
    pub fn sun_exits<const C: usize>(
        &mut self,
        tube: &TraceableTube,
        sun: &Sun,
        mut at: impl FnMut(&mut Self, &Exit<C>),
    ) {
        let toward = warp::around(sun.direction, warp::cone(self.samples.pair(), HALF_ANGLE));
        let Some(entry) = tube.guide.entry(self.samples.pair(), -toward).filter(|_| toward.z > 0.0) else { return };
        let flux = sun.luminance_cd_m2() * Sun::solid_angle_sr() * entry.projected_area_m2;
        let mut transit: Transit<C> = tube.guide.down(entry.position, -toward, &mut self.samples.random);
        let mut flux = if transit.entered { Spectrum([flux; C]) } else { Spectrum::ZERO };
        let returns = self.scene.guide_return && tube.guide.returns_light();
        for _ in 0..MAX_EVENTS {
            self.rays += u64::from(transit.rays);
            flux *= transit.weight();
            if transit.end != End::Opening || flux.max() <= 0.0 {
                return;
            }
            let mut position = tube.origin + transit.position;
            position.z = tube.origin.z;
            let closure = tube.closure_at(position);
            if matches!(closure, Closure::Specular { .. }) {
                return;
            }
            let cosine = transit.direction.z.abs();
            at(self, &Exit { position, closure, cosine, flux });
            let [_, back] = shares::<C>(closure, cosine);
            let survival = back.max().min(1.0);
            if !returns || self.samples.random.uniform() >= survival {
                return;
            }
            flux = flux * back * (1.0 / survival);
            let direction = match closure {
                Closure::Measured(table) => table.sample(false, cosine, self.samples.pair()),
                _ => warp::cosine_hemisphere(self.samples.pair()),
            };
            transit = tube.guide.up(position - tube.origin, direction, &mut self.samples.random);
        }
    }
}

/// Sunlight that arrives at a closure that scatters.
pub struct Exit<'a, const C: usize> {
    pub position: DVec3,
    pub closure: Closure<'a>,
    /// Cosine of the angle of incidence.
    pub cosine: f64,
    /// Flux that arrives, in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize> Exit<'_, C> {
    /// Intensity in lm/sr into the room at an angle of exit of this cosine.
    fn intensity(&self, exit_cosine: f64) -> Spectrum<C> {
        if exit_cosine <= 0.0 {
            return Spectrum::ZERO;
        }
        let per_sr = match self.closure {
            Closure::Specular { .. } => Spectrum::ZERO,
            Closure::Lambertian { transmittance, .. } => Spectrum::from_rgb(transmittance) * (1.0 / PI),
            Closure::Measured(table) => Spectrum::ONE * table.per_sr(true, self.cosine, exit_cosine),
        };
        self.flux * per_sr * exit_cosine
    }

    /// The pixel of a view that it lights, and by how much, in cd/m2.
    pub fn seen_by(&self, scene: &TraceableScene, view: &View) -> Option<(usize, Spectrum<C>)> {
        let (pixel, solid_angle) = view.pixel_of(self.position)?;
        let way = self.position - view.eye;
        let distance_squared = way.length_squared();
        let direction = way / distance_squared.sqrt();
        let intensity = self.intensity(direction.z);
        if intensity.max() <= 0.0 {
            return None;
        }
        let entry = enter_room(scene, view.eye, direction)?;
        let visible = scene.visible(self.position, None, entry, None);
        visible.then(|| (pixel, intensity * (1.0 / (distance_squared * solid_angle))))
    }
}

/// Density per sr, seen from the start of `way`, of an even point of a tube's opening.
fn opening_density(tube: &TraceableTube, way: DVec3) -> f64 {
    let distance_squared = way.length_squared();
    distance_squared * distance_squared.sqrt() / (way.z.abs() * tube.opening_area_m2())
}
