//! Path tracing: from the sensors and the eye backward to sky, sun and luminaires. Unbiased; one pass is one replicate.
//!
//! Every vertex that scatters with a finite distribution, and every sensor, is connected to a point of each opening and of
//! each luminaire; the ray that goes on from it finds them too, and the two share the light by the power heuristic (Veach
//! and Guibas 1995, beta = 2): what rare rays would add far from an opening, unseen by a standard error, is nothing. From
//! an opening the way goes on through the closure, up the guide and into the sky. Light that comes back down a guide, and
//! light that a closure reflects, is found by the rays that go on alone.
//!
//! The sun's disc is too small to be found by chance: it is counted by connections only, of vertices and of the eye to rays
//! of the sun that go from the collector down to a closure that scatters. What that leaves out is refused: the sun through
//! clear closures, where only one direction in hundreds meets the disc even at its own zenith angle, and by way of mirrors.

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::emission::PathSamples;
use super::eye::enter_room;
use super::kernel::{Kernel, NO_SURFACE, Place, SpecularKernel, SurfaceId, SurfaceKernel, TubeKernel};
use super::light_path::Account;
use super::luminaire::LuminaireKernel;
use super::{GridPass, Integrator, Pass, ViewPass};
use crate::guide::{End, Transit};
use crate::optics::{Closure, Glossy, MeasuredDiffuser, Spectrum};
use crate::sampling::{Key, PathRandom, warp};
use crate::scene::{EstimateKind, Grid, View};
use crate::sky::Sun;
use crate::sky::sun::HALF_ANGLE;

/// Settings of the method.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Paths per sensor and pass; 1..=65_536.
    pub samples_per_sensor: u32,
    /// Paths per pixel and pass; 1..=4_096.
    pub samples_per_pixel: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { samples_per_sensor: 64, samples_per_pixel: 4 }
    }
}

/// Below this share of its first weight a path goes on by roulette even where nothing absorbs.
pub(super) const ROULETTE_BELOW: f64 = 1e-3;

/// Events of one path after which it is cut off; reached only by scenes that absorb nothing.
pub(super) const MAX_EVENTS: u32 = 1_000_000;

/// Rays of the sun per tube and view that are connected to the eye, for each path of the view, and at least.
const SUN_RAYS_PER_PATH: f64 = 0.0625;
const LEAST_SUN_RAYS: u64 = 1024;

/// Rays of the sun that one task traces: fixed, so that sums fold in the same order on any number of threads.
const SUN_CHUNK: u64 = 1024;

/// Below this roughness a connection meets the lobe so rarely that its sunlight is a mirror's.
const NARROW_ROUGHNESS: f64 = 0.2;

/// Least share with which a path goes on from a measured diffuser.
pub(super) const LEAST_MEASURED_SHARE: f64 = 0.05;

/// Streams of random numbers within a pass.
const SENSOR_STREAM: u64 = 1 << 32;
const EYE_STREAM: u64 = 1 << 33;
const SUN_STREAM: u64 = 1 << 34;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct PathTracing<const C: usize> {
    kernel: Arc<Kernel>,
    grids: Vec<Grid>,
    views: Vec<View>,
    settings: Settings,
    seed: Key,
}

impl<const C: usize> PathTracing<C> {
    pub fn new(kernel: Arc<Kernel>, grids: &[Grid], views: &[View], settings: &Settings, seed: u64) -> Self {
        let (grids, views) = (grids.to_vec(), views.to_vec());
        Self { kernel, grids, views, settings: settings.clone(), seed: Key::new(seed) }
    }

    /// Illuminance of one sensor in lux, and the rays it took.
    fn sensor(&self, grid: &Grid, index: usize, stream: Key) -> (f64, u64) {
        let (i, j) = (index % grid.cells[0], index / grid.cells[0]);
        let centre = DVec3::new(grid.x_m[i], grid.y_m[j], grid.height_m + self.kernel.contact());
        let (mut lux, mut rays) = (0.0, 0);
        for number in 0..u64::from(self.settings.samples_per_sensor) {
            let mut path = Path { kernel: &self.kernel, samples: PathSamples::new(stream, number), rays: 0 };
            let mut position = centre;
            if grid.estimate == EstimateKind::CellAverage {
                let [u, v] = path.samples.pair();
                position.x += (u - 0.5) * grid.cell_size_m[0];
                position.y += (v - 0.5) * grid.cell_size_m[1];
            }
            if !self.kernel.boxes.iter().any(|object| object.contains(position)) {
                lux += path.illuminance::<C>(position).luminance();
            }
            rays += path.rays;
        }
        (lux / f64::from(self.settings.samples_per_sensor), rays)
    }

    /// Luminance of one pixel in cd/m2, and the rays it took.
    fn pixel(&self, view: &View, pixel: usize, stream: Key) -> (Spectrum<C>, u64) {
        let (column, row) = (pixel % view.size_px[0], pixel / view.size_px[0]);
        let (mut luminance, mut rays) = (Spectrum::ZERO, 0);
        for number in 0..u64::from(self.settings.samples_per_pixel) {
            let mut path = Path { kernel: &self.kernel, samples: PathSamples::new(stream, number), rays: 0 };
            let [x, y] = path.samples.pair();
            let direction = view.ray_direction(column as f64 + x, row as f64 + y);
            if let Some(origin) = enter_room(&self.kernel, view.eye, direction) {
                luminance += path.luminance(origin, direction);
            }
            rays += path.rays;
        }
        (luminance * (1.0 / f64::from(self.settings.samples_per_pixel)), rays)
    }

    /// Adds the sun that closures scatter straight to the eye; returns the rays it took.
    fn add_sun(&self, view: &View, stream: Key, luminance: &mut [f64], cancel: &AtomicBool) -> Option<u64> {
        let Some(sun) = &self.kernel.sun else { return Some(0) };
        let paths = (view.size_px[0] * view.size_px[1]) as f64 * f64::from(self.settings.samples_per_pixel);
        let count = ((paths * SUN_RAYS_PER_PATH) as u64).max(LEAST_SUN_RAYS);
        let mut rays = 0;
        for (number, tube) in self.kernel.tubes.iter().enumerate() {
            if !tube.diffuser.scatters(tube.opening_radius) {
                continue;
            }
            let stream = stream.child(number as u64);
            let chunk = |chunk: u64| {
                let going_on = !cancel.load(Ordering::Relaxed);
                going_on.then(|| {
                    let (mut seen, mut rays) = (Vec::new(), 0);
                    for index in chunk * SUN_CHUNK..((chunk + 1) * SUN_CHUNK).min(count) {
                        let samples = PathSamples::new(stream, index);
                        let mut path = Path { kernel: &self.kernel, samples, rays: 0 };
                        path.sun_exits::<C>(tube, sun, |_, exit| seen.extend(exit.seen_by(&self.kernel, view)));
                        rays += path.rays;
                    }
                    (seen, rays)
                })
            };
            let chunks: Option<Vec<_>> = (0..count.div_ceil(SUN_CHUNK)).into_par_iter().map(chunk).collect();
            for (seen, of_chunk) in chunks? {
                rays += of_chunk;
                for (pixel, value) in seen {
                    for (channel, value) in value.0.into_iter().enumerate() {
                        luminance[pixel * C + channel] += value / count as f64;
                    }
                }
            }
        }
        Some(rays)
    }
}

impl<const C: usize> Integrator for PathTracing<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.child(pass);
        let mut result = Pass::default();
        let mut rays = 0;
        for (number, grid) in self.grids.iter().enumerate() {
            let stream = key.child(SENSOR_STREAM + number as u64);
            let sensor = |index: usize| {
                let going_on = !cancel.load(Ordering::Relaxed);
                going_on.then(|| self.sensor(grid, index, stream.child(index as u64)))
            };
            let sensors: Option<Vec<_>> = (0..grid.len()).into_par_iter().map(sensor).collect();
            let (illuminance, of_sensors): (Vec<f64>, Vec<u64>) = sensors?.into_iter().unzip();
            rays += of_sensors.iter().sum::<u64>();
            result.grids.push(GridPass { illuminance, ..GridPass::default() });
        }
        for (number, view) in self.views.iter().enumerate() {
            let stream = key.child(EYE_STREAM + number as u64);
            let pixel = |index: usize| {
                let going_on = !cancel.load(Ordering::Relaxed);
                going_on.then(|| self.pixel(view, index, stream.child(index as u64)))
            };
            let pixels: Option<Vec<_>> = (0..view.size_px[0] * view.size_px[1]).into_par_iter().map(pixel).collect();
            let mut luminance = Vec::new();
            for (seen, of_pixel) in pixels? {
                luminance.extend(seen.0);
                rays += of_pixel;
            }
            let stream = key.child(SUN_STREAM + number as u64);
            rays += self.add_sun(view, stream, &mut luminance, cancel)?;
            result.views.push(ViewPass { luminance, ..ViewPass::default() });
        }
        // nothing is emitted: no tube's flux is known, and no books are kept
        result.account = Account { rays, ..Account::default() };
        Some(result)
    }
}

/// One path.
struct Path<'a> {
    kernel: &'a Kernel,
    samples: PathSamples,
    rays: u64,
}

/// A point that scatters light toward the eye with a finite distribution, or a sensor.
struct Vertex<'a, const C: usize> {
    position: DVec3,
    normal: DVec3,
    surface: SurfaceId,
    /// Unit vector toward the eye.
    eye: DVec3,
    /// The path's weight times the diffuse reflectance; for a sensor pi.
    diffuse: Spectrum<C>,
    /// The path's weight times its reflectance.
    lobe: Option<(&'a Glossy, Spectrum<C>)>,
    /// The probability with which the ray that goes on is one of the diffuse part.
    diffuse_share: f64,
    /// The lower side of a measured diffuser: pi times its distribution stands for the diffuse reflectance.
    table: Option<(&'a MeasuredDiffuser, Scatter)>,
}

/// On which side of a closure, seen from the light, the eye is, and the cosine of its direction.
#[derive(Clone, Copy)]
pub(super) struct Scatter {
    pub transmitted: bool,
    pub eye_cosine: f64,
}

impl<const C: usize> Vertex<'_, C> {
    /// The path's weight times BSDF times cosine per sr for light from `toward`, and the density of the ray that goes on.
    #[inline]
    fn response(&self, toward: DVec3) -> (Spectrum<C>, f64) {
        let cosine = toward.dot(self.normal);
        if cosine <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let scatters = self.table.map_or(1.0 / PI, |(table, Scatter { transmitted, eye_cosine })| {
            table.per_sr(transmitted, cosine, eye_cosine)
        });
        let mut response = self.diffuse * (scatters * cosine);
        let mut density = self.diffuse_share * cosine / PI;
        if let Some((lobe, weight)) = &self.lobe {
            let per_sr = lobe.density(self.normal, self.eye, toward);
            response += *weight * per_sr;
            density += (1.0 - self.diffuse_share) * per_sr;
        }
        (response, density)
    }

    /// Whether light straight from luminaires has a closed form.
    fn lambert(&self, kernel: &Kernel) -> bool {
        !kernel.luminaires_obstructed && self.lobe.is_none() && self.table.is_none()
    }
}

/// The vertex that a ray comes from, where it is connected.
#[derive(Clone, Copy)]
struct Last {
    position: DVec3,
    /// Of the ray's direction, per sr.
    density: f64,
    /// Light straight from luminaires is counted there in closed form.
    lambert: bool,
}

/// A ray on its way through the room.
#[derive(Clone, Copy)]
struct Ray<const C: usize> {
    origin: DVec3,
    direction: DVec3,
    from: SurfaceId,
    weight: Spectrum<C>,
    /// `None`: nothing counted what the ray finds.
    last: Option<Last>,
}

impl Path<'_> {
    /// One sample of the illuminance in lux of a point that looks up.
    fn illuminance<const C: usize>(&mut self, position: DVec3) -> Spectrum<C> {
        let vertex = Vertex {
            position,
            normal: DVec3::Z,
            surface: NO_SURFACE,
            eye: DVec3::Z,
            diffuse: Spectrum([PI; C]),
            lobe: None,
            diffuse_share: 1.0,
            table: None,
        };
        let mut sum = Spectrum::ZERO;
        let point = self.samples.pair();
        sum += self.connect(&vertex);
        if let Some(ray) = self.scatter(&vertex, point) {
            self.follow(ray, true, &mut sum);
        }
        sum
    }

    /// One sample of the luminance in cd/m2 that an eye in the room sees.
    fn luminance<const C: usize>(&mut self, origin: DVec3, direction: DVec3) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        let ray = Ray { origin, direction, from: NO_SURFACE, weight: Spectrum::ONE, last: None };
        self.follow(ray, false, &mut sum);
        sum
    }

    /// Follows a ray to its end; `reflected`: a surface that it meets reflects once more.
    fn follow<const C: usize>(&mut self, mut ray: Ray<C>, mut reflected: bool, sum: &mut Spectrum<C>) {
        let kernel = self.kernel;
        let first = ray.weight.max();
        for _ in 0..MAX_EVENTS {
            let hit = kernel.intersect(ray.origin, ray.direction, ray.from);
            self.rays += 1;
            let next = match hit.place {
                Place::Opening(index) => self.enter_tube(index, hit.position, &ray, sum),
                Place::Surface(surface) => {
                    if let Some(luminaire) = kernel.luminaire(surface) {
                        let share = ray.last.map_or(1.0, |last| luminaire_share(last, luminaire, hit.position));
                        *sum += ray.weight * luminaire.seen(ray.direction) * share;
                        return;
                    }
                    let Some(optics) = &kernel.surfaces[surface as usize] else { return };
                    if reflected && !kernel.interreflection {
                        return;
                    }
                    let finite = optics.gathers() || optics.specular.as_ref().is_some_and(|s| s.lobe.is_some());
                    reflected |= finite;
                    let vertex = Vertex {
                        position: hit.position,
                        normal: hit.normal,
                        surface,
                        eye: -ray.direction,
                        diffuse: ray.weight * Spectrum::from_rgb(optics.reflectance),
                        lobe: lobe(optics, ray.weight),
                        diffuse_share: diffuse_share(optics),
                        table: None,
                    };
                    if finite {
                        *sum += self.connect(&vertex);
                    }
                    self.reflect(&vertex, optics.specular.as_ref(), ray.weight, first)
                }
            };
            match next {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    /// The ray that goes on from a surface, by roulette.
    fn reflect<const C: usize>(
        &mut self,
        vertex: &Vertex<C>,
        specular: Option<&SpecularKernel>,
        weight: Spectrum<C>,
        first: f64,
    ) -> Option<Ray<C>> {
        let reflected = specular.map_or(Spectrum::ZERO, |s| weight * Spectrum::from_rgb(s.reflectance));
        let leaving = (vertex.diffuse + reflected).max();
        if leaving <= 0.0 {
            return None;
        }
        let mut survival = leaving / weight.max();
        if weight.max() < ROULETTE_BELOW * first {
            survival *= weight.max() / (ROULETTE_BELOW * first);
        }
        let survival = survival.min(1.0);
        if self.samples.random.uniform() >= survival {
            return None;
        }
        let point = self.samples.pair();
        let mut ray = match specular {
            None => self.scatter(vertex, point)?,
            Some(_) if self.samples.random.uniform() < vertex.diffuse_share => self.scatter(vertex, point)?,
            Some(specular) => {
                let toward = specular.reflect(vertex.normal, vertex.eye, point, &mut self.samples.random);
                let (position, from) = (vertex.position, vertex.surface);
                let ray = |weight, last| Ray { origin: position, direction: toward, from, weight, last };
                match specular.lobe {
                    None => ray(reflected * (1.0 / (1.0 - vertex.diffuse_share)), None),
                    Some(_) => {
                        let (response, density) = vertex.response(toward);
                        if density <= 0.0 {
                            return None;
                        }
                        let last = Last { position, density, lambert: vertex.lambert(self.kernel) };
                        ray(response * (1.0 / density), Some(last))
                    }
                }
            }
        };
        ray.weight = ray.weight * (1.0 / survival);
        Some(ray)
    }

    /// A ray in a direction of the diffuse part of a vertex.
    fn scatter<const C: usize>(&self, vertex: &Vertex<C>, point: [f64; 2]) -> Option<Ray<C>> {
        let direction = warp::around(vertex.normal, warp::cosine_hemisphere(point));
        let (response, density) = vertex.response(direction);
        if density <= 0.0 || response.max() <= 0.0 {
            return None;
        }
        let Vertex { position, surface, .. } = *vertex;
        let last = Some(Last { position, density, lambert: vertex.lambert(self.kernel) });
        Some(Ray { origin: position, direction, from: surface, weight: response * (1.0 / density), last })
    }

    /// A ray meets an opening from below: adds the sky and sun that it finds, and returns how it comes back into the room.
    fn enter_tube<const C: usize>(
        &mut self,
        index: usize,
        mut position: DVec3,
        ray: &Ray<C>,
        sum: &mut Spectrum<C>,
    ) -> Option<Ray<C>> {
        let kernel = self.kernel;
        let tube = &kernel.tubes[index];
        let (mut direction, mut weight) = (ray.direction, ray.weight);
        // connections count the sun, and share the sky that is found at once
        let mut share_of_sky = ray.last.map_or(1.0, |last| {
            let connected = opening_density(tube, position - last.position);
            share(last.density, connected)
        });
        for _ in 0..MAX_EVENTS {
            let from_below = direction.z > 0.0;
            let closure = tube.closure_at(position);
            let scatter = Scatter { transmitted: !from_below, eye_cosine: direction.z.abs() };
            // what goes on down into the room, and what goes up
            let (down, up, upward) = if let Closure::Specular { transmittance } = closure {
                weight *= Spectrum::from_rgb(transmittance);
                if !from_below {
                    return Some(Ray { origin: position, direction, from: NO_SURFACE, weight, last: None });
                }
                (Spectrum::ZERO, weight, direction)
            } else {
                let mut shares = shares::<C>(closure, scatter.eye_cosine);
                if matches!(closure, Closure::Measured(_)) {
                    // a table need not be reciprocal: the eye may see light where it would send none
                    shares = shares.map(|share| share.map(|share| share.max(LEAST_MEASURED_SHARE)));
                }
                let point = self.samples.pair();
                let above = Scatter { transmitted: from_below, ..scatter };
                let (upward, factor) = above_closure(closure, above, point, &mut self.samples.random);
                (weight * shares[usize::from(from_below)], weight * factor, upward)
            };
            let (mut returning, mut place) = (Spectrum::ZERO, (position, direction));
            if up.max() > 0.0 {
                let transit: Transit<C> = tube.guide.up(position - tube.origin, upward, &mut self.samples.random);
                self.rays += u64::from(transit.rays);
                let arriving = up * transit.weight();
                if transit.end == End::Top {
                    let toward = transit.direction;
                    let sky = kernel.sky.as_ref().map_or(0.0, |sky| share_of_sky * sky.luminance(toward));
                    *sum += arriving * sky;
                } else if transit.end == End::Opening && kernel.guide_return {
                    returning = arriving;
                    place = (tube.origin + transit.position, transit.direction);
                    place.0.z = tube.origin.z;
                }
            }
            // one of the two goes on, by roulette
            let both = returning.max() + down.max();
            let survival = (both / weight.max()).min(1.0);
            if both <= 0.0 || self.samples.random.uniform() >= survival {
                return None;
            }
            let returns = returning.max() / both;
            if self.samples.random.uniform() >= returns {
                let goes_on = weight * (1.0 / (survival * (1.0 - returns)));
                return self.leave_closure(position, -direction, closure, scatter, goes_on, sum);
            }
            weight = returning * (1.0 / (survival * returns));
            (position, direction) = place;
            share_of_sky = 1.0;
        }
        None
    }

    /// The lower side of a closure scatters light of the room toward the eye.
    fn leave_closure<const C: usize>(
        &mut self,
        position: DVec3,
        eye: DVec3,
        closure: Closure<'_>,
        scatter: Scatter,
        weight: Spectrum<C>,
        sum: &mut Spectrum<C>,
    ) -> Option<Ray<C>> {
        let (diffuse, table) = match closure {
            Closure::Lambertian { transmittance, reflectance } => {
                (weight * Spectrum::from_rgb(if scatter.transmitted { transmittance } else { reflectance }), None)
            }
            Closure::Measured(table) => (weight, Some((table, scatter))),
            Closure::Specular { .. } => return None,
        };
        let vertex = Vertex {
            position,
            normal: DVec3::NEG_Z,
            surface: NO_SURFACE,
            eye,
            diffuse,
            lobe: None,
            diffuse_share: 1.0,
            table,
        };
        *sum += self.connect(&vertex);
        let point = self.samples.pair();
        self.scatter(&vertex, point)
    }

    /// What luminaires, sky and sun send straight to a vertex, and by it toward the eye.
    fn connect<const C: usize>(&mut self, vertex: &Vertex<C>) -> Spectrum<C> {
        let kernel = self.kernel;
        let mut sum = Spectrum::ZERO;
        for tube in kernel.tubes.iter().filter(|tube| tube.origin.z > vertex.position.z) {
            if kernel.sky.is_some() {
                sum += self.sky(vertex, tube);
            }
            if let Some(sun) = &kernel.sun
                && tube.diffuser.scatters(tube.opening_radius)
            {
                sum += self.scattered_sun(vertex, tube, sun);
            }
        }
        for luminaire in kernel.luminaires.iter().filter(|luminaire| luminaire.emits()) {
            if vertex.lambert(kernel) {
                sum += vertex.diffuse * luminaire.irradiance(vertex.position, vertex.normal) * (1.0 / PI);
                continue;
            }
            let source = luminaire.point(self.samples.pair()).clamp(DVec3::ZERO, kernel.size);
            let way = source - vertex.position;
            let connected = luminaire_density(luminaire, way);
            if connected > 0.0
                && let Some((response, density)) = self.respond(vertex, source, luminaire.surface)
            {
                let light: Spectrum<C> = luminaire.seen(way);
                sum += response * light * (share(connected, density) / connected);
            }
        }
        sum
    }

    /// The response of a vertex to light from a point that it sees, and the density of the ray that goes on.
    fn respond<const C: usize>(
        &mut self,
        vertex: &Vertex<C>,
        source: DVec3,
        surface: SurfaceId,
    ) -> Option<(Spectrum<C>, f64)> {
        let (response, density) = vertex.response((source - vertex.position).normalize());
        if response.max() <= 0.0 {
            return None;
        }
        self.rays += 1;
        self.kernel.visible(source, surface, vertex.position, vertex.surface).then_some((response, density))
    }

    /// Sky through a point of a tube's opening.
    fn sky<const C: usize>(&mut self, vertex: &Vertex<C>, tube: &TubeKernel) -> Spectrum<C> {
        let point = tube.origin + (warp::disc(self.samples.pair()) * tube.opening_radius).extend(0.0);
        let up = self.samples.pair();
        let way = point - vertex.position;
        let Some((response, density)) = self.respond(vertex, point, NO_SURFACE) else { return Spectrum::ZERO };
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
        let sky = self.kernel.sky.as_ref().map_or(0.0, |sky| sky.luminance(transit.direction));
        let connected = opening_density(tube, way);
        response * factor * transit.weight() * (sky * share(connected, density) / connected)
    }

    /// Sun that a tube's closure scatters straight to a vertex.
    fn scattered_sun<const C: usize>(&mut self, vertex: &Vertex<C>, tube: &TubeKernel, sun: &Sun) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        self.sun_exits(tube, sun, |path, exit: &Exit<C>| {
            let way = exit.position - vertex.position;
            let distance_squared = way.length_squared();
            let intensity = exit.intensity(way.z / distance_squared.sqrt());
            if intensity.max() > 0.0
                && let Some((response, _)) = path.respond(vertex, exit.position, NO_SURFACE)
            {
                sum += response * intensity * (1.0 / distance_squared);
            }
        });
        sum
    }

    /// A ray of the sun from the collector down, and on as often as the tube returns it to the closure: every point where
    /// it arrives at a closure that scatters.
    fn sun_exits<const C: usize>(&mut self, tube: &TubeKernel, sun: &Sun, mut at: impl FnMut(&mut Self, &Exit<C>)) {
        let toward = warp::around(sun.direction, warp::cone(self.samples.pair(), HALF_ANGLE));
        let Some(entry) = tube.guide.entry(self.samples.pair(), -toward).filter(|_| toward.z > 0.0) else { return };
        let flux = sun.luminance_cd_m2() * Sun::solid_angle_sr() * entry.projected_area_m2;
        let mut transit: Transit<C> = tube.guide.down(entry.position, -toward, &mut self.samples.random);
        let mut flux = if transit.entered { Spectrum([flux; C]) } else { Spectrum::ZERO };
        let returns = self.kernel.guide_return && tube.guide.returns_light();
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
struct Exit<'a, const C: usize> {
    position: DVec3,
    closure: Closure<'a>,
    /// Of the angle of incidence.
    cosine: f64,
    /// In lm, of what arrives.
    flux: Spectrum<C>,
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
    fn seen_by(&self, kernel: &Kernel, view: &View) -> Option<(usize, Spectrum<C>)> {
        let (pixel, solid_angle) = view.pixel_of(self.position)?;
        let way = self.position - view.eye;
        let distance_squared = way.length_squared();
        let direction = way / distance_squared.sqrt();
        let intensity = self.intensity(direction.z);
        if intensity.max() <= 0.0 {
            return None;
        }
        let entry = enter_room(kernel, view.eye, direction)?;
        let visible = kernel.visible(self.position, NO_SURFACE, entry, NO_SURFACE);
        visible.then(|| (pixel, intensity * (1.0 / (distance_squared * solid_angle))))
    }
}

/// A direction above a closure from which it scatters light toward the eye, and BSDF times cosine over its density.
pub(super) fn above_closure<const C: usize>(
    closure: Closure<'_>,
    scatter: Scatter,
    point: [f64; 2],
    random: &mut PathRandom,
) -> (DVec3, Spectrum<C>) {
    let Scatter { transmitted, eye_cosine } = scatter;
    let table = match closure {
        Closure::Measured(table) => Some((table, table.shares(eye_cosine)[usize::from(!transmitted)])),
        _ => None,
    };
    // a table is sampled as if it were reciprocal, which is likely; the cosine covers what it leaves out
    let table = table.filter(|(_, share)| *share > 0.0);
    let table_share = if table.is_some() { 0.5 } else { 0.0 };
    let direction = match &table {
        Some((table, _)) if random.uniform() < table_share => table.sample(transmitted, eye_cosine, point),
        _ => warp::cosine_hemisphere(point),
    };
    let cosine = direction.z;
    if cosine <= 0.0 {
        return (direction, Spectrum::ZERO);
    }
    let mut density = (1.0 - table_share) * cosine / PI;
    if let Some((table, share)) = table {
        density += table_share * table.per_sr(transmitted, eye_cosine, cosine) * cosine / share;
    }
    let bsdf = match closure {
        Closure::Lambertian { transmittance, reflectance } => {
            Spectrum::from_rgb(if transmitted { transmittance } else { reflectance }) * (1.0 / PI)
        }
        Closure::Measured(table) => Spectrum::ONE * table.per_sr(transmitted, cosine, eye_cosine),
        Closure::Specular { .. } => Spectrum::ZERO,
    };
    (direction, bsdf * (cosine / density))
}

/// Transmittance and reflectance of a closure for light at a cosine of incidence.
pub(super) fn shares<const C: usize>(closure: Closure<'_>, cosine: f64) -> [Spectrum<C>; 2] {
    match closure {
        Closure::Lambertian { transmittance, reflectance } => [transmittance, reflectance].map(Spectrum::from_rgb),
        Closure::Measured(table) => table.shares(cosine).map(|share| Spectrum::ONE * share),
        Closure::Specular { transmittance } => [Spectrum::from_rgb(transmittance), Spectrum::ZERO],
    }
}

fn lobe<const C: usize>(optics: &SurfaceKernel, weight: Spectrum<C>) -> Option<(&Glossy, Spectrum<C>)> {
    let specular = optics.specular.as_ref()?;
    Some((specular.lobe.as_deref()?, weight * Spectrum::from_rgb(specular.reflectance)))
}

/// The probability with which a surface sends a path on diffusely.
fn diffuse_share(optics: &SurfaceKernel) -> f64 {
    let brightest = |rgb: [f64; 3]| rgb.into_iter().fold(0.0, f64::max);
    let diffuse = brightest(optics.reflectance);
    match &optics.specular {
        Some(specular) if brightest(specular.reflectance) > 0.0 => {
            diffuse / (diffuse + brightest(specular.reflectance))
        }
        _ => 1.0,
    }
}

/// Density per sr, seen from the start of `way`, of an even point of a tube's opening.
fn opening_density(tube: &TubeKernel, way: DVec3) -> f64 {
    let distance_squared = way.length_squared();
    let area = PI * tube.opening_radius * tube.opening_radius;
    distance_squared * distance_squared.sqrt() / (way.z.abs() * area)
}

/// The same of a luminaire; zero from behind it.
fn luminaire_density(luminaire: &LuminaireKernel, way: DVec3) -> f64 {
    let leaving = -way.dot(luminaire.normal);
    let distance_squared = way.length_squared();
    if leaving > 0.0 { distance_squared * distance_squared.sqrt() / (leaving * luminaire.area_m2) } else { 0.0 }
}

/// The share of a luminaire's light that a ray counts which finds it.
fn luminaire_share(last: Last, luminaire: &LuminaireKernel, position: DVec3) -> f64 {
    if last.lambert {
        return 0.0;
    }
    share(last.density, luminaire_density(luminaire, position - last.position))
}

/// The share of light that is counted where it was found with `density`, and not with `other`: the power heuristic.
fn share(density: f64, other: f64) -> f64 {
    if other == 0.0 { 1.0 } else { 1.0 / (1.0 + (other / density).powi(2)) }
}

/// Why this method cannot compute a scene, if it cannot: the sun's disc would be found by chance only, and its part of the
/// error would stay unseen.
pub fn refuses(kernel: &Kernel) -> Option<&'static str> {
    kernel.sun?;
    let clear = |tube: &TubeKernel| tube.diffuser.specular_zone(tube.opening_radius).is_some();
    if kernel.tubes.iter().any(clear) {
        Some("the sun's beam through a clear closure is found by chance only")
    } else if kernel.specular().any(|specular| specular.roughness < NARROW_ROUGHNESS) {
        Some("the sun's beam by way of a mirror or of a glossy surface of roughness below 0.2 is found by chance only")
    } else {
        None
    }
}
