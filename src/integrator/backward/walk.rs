//! One path followed backward, from a sensor or the eye: how it goes on and what light it meets.
//!
//! At every vertex that scatters with a finite distribution the path is connected to each luminaire, in closed form or at a
//! random point, and the ray that goes on finds luminaires too: where there is no closed form the two share the light by the
//! power heuristic (Veach and Guibas 1995, beta = 2). Daylight is the method's own: [`Daylight`] says what an opening sends
//! to a vertex, and which share of the sky a ray counts that finds its way up a guide. Light of the room that a closure
//! reflects, or that comes back down a guide, is found by the rays that go on alone.

use std::f64::consts::PI;

use glam::DVec3;

use super::vertex::{Ray, Vertex, diffuse_share, lobe, luminaire_density, luminaire_share, share};
use crate::integrator::roulette::{MAX_EVENTS, survival};
use crate::optics::Spectrum;
use crate::sampling::{PathSamples, warp};
use crate::traceable::{Place, SpecularOptics, SurfaceId, TraceableScene};

/// A path goes on for certain above this share of its first weight, if its method asks for it.
const CERTAIN_ABOVE: f64 = 0.05;

/// Treatment of the daylight of openings by a method.
pub trait Daylight<const C: usize>: Sync {
    /// Adds what tube `tube` sends straight to a vertex below its opening, and by it toward the eye.
    fn connect(&self, path: &mut Path, vertex: &Vertex<C>, tube: usize, sum: &mut Spectrum<C>);

    /// The share of the sky that a ray counts which meets the opening of tube `tube` at `position` and finds the sky at
    /// once; what it finds after it came back down the guide it counts whole. `None`: it counts neither.
    fn found_share(&self, scene: &TraceableScene, tube: usize, ray: &Ray<C>, position: DVec3) -> Option<f64>;
}

/// One path that is followed backward, with its random numbers.
pub struct Path<'a> {
    pub scene: &'a TraceableScene,
    pub samples: PathSamples,
    /// Number of rays traced up to now.
    pub rays: u64,
    /// Reflections still to come that no roulette decides, as long as the path's weight is worth it.
    pub certain: u32,
}

impl Path<'_> {
    /// One sample of the illuminance in lux of a point that looks up; `direct` is what counts the daylight straight from the
    /// openings to it.
    pub fn illuminance<const C: usize>(
        &mut self,
        direct: &impl Daylight<C>,
        daylight: &impl Daylight<C>,
        position: DVec3,
    ) -> Spectrum<C> {
        let vertex = Vertex {
            position,
            normal: DVec3::Z,
            surface: None,
            eye: DVec3::Z,
            diffuse: Spectrum([PI; C]),
            lobe: None,
            diffuse_share: 1.0,
            table: None,
        };
        let mut sum = Spectrum::ZERO;
        let point = self.samples.pair();
        sum += self.connect(direct, &vertex);
        if let Some(ray) = self.scatter(&vertex, point) {
            self.follow(daylight, ray, true, &mut sum);
        }
        sum
    }

    /// One sample of the luminance in cd/m2 that an eye in the room sees.
    pub fn luminance<const C: usize>(
        &mut self,
        daylight: &impl Daylight<C>,
        origin: DVec3,
        direction: DVec3,
    ) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        let ray = Ray { origin, direction, from: None, weight: Spectrum::ONE, last: None, from_eye: true };
        self.follow(daylight, ray, false, &mut sum);
        sum
    }

    /// Follows a ray to its end; `reflected`: a surface that it meets reflects once more.
    fn follow<const C: usize>(
        &mut self,
        daylight: &impl Daylight<C>,
        mut ray: Ray<C>,
        mut reflected: bool,
        sum: &mut Spectrum<C>,
    ) {
        let scene = self.scene;
        let first = ray.weight.max();
        for _ in 0..MAX_EVENTS {
            let hit = scene.intersect(ray.origin, ray.direction, ray.from);
            self.rays += 1;
            let next = match hit.place {
                Place::Opening(index) => self.enter_tube(daylight, index, hit.position, &ray, sum),
                Place::Surface(surface) => {
                    if let Some(luminaire) = scene.luminaire(surface) {
                        let share = ray.last.map_or(1.0, |last| luminaire_share(last, luminaire, hit.position));
                        *sum += ray.weight * luminaire.seen(ray.direction) * share;
                        return;
                    }
                    let Some(optics) = scene.optics(surface) else { return };
                    if reflected && !scene.interreflection {
                        return;
                    }
                    let finite = optics.gathers() || optics.specular.as_ref().is_some_and(|s| s.lobe.is_some());
                    reflected |= finite;
                    let vertex = Vertex {
                        position: hit.position,
                        normal: hit.normal,
                        surface: Some(surface),
                        eye: -ray.direction,
                        diffuse: ray.weight * Spectrum::from_rgb(optics.reflectance),
                        lobe: lobe(optics, ray.weight),
                        diffuse_share: diffuse_share(optics),
                        table: None,
                    };
                    if finite {
                        *sum += self.connect(daylight, &vertex);
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
        specular: Option<&SpecularOptics>,
        weight: Spectrum<C>,
        first: f64,
    ) -> Option<Ray<C>> {
        let reflected = specular.map_or(Spectrum::ZERO, |s| weight * Spectrum::from_rgb(s.reflectance));
        let leaving = (vertex.diffuse + reflected).max();
        if leaving <= 0.0 {
            return None;
        }
        let mut survival = survival(leaving, weight.max(), first);
        if self.certain > 0 && leaving >= CERTAIN_ABOVE * first {
            self.certain -= 1;
            survival = 1.0;
        } else if self.samples.random.uniform() >= survival {
            return None;
        }
        let point = self.samples.pair();
        let mut ray = match specular {
            None => self.scatter(vertex, point)?,
            Some(_) if self.samples.random.uniform() < vertex.diffuse_share => self.scatter(vertex, point)?,
            Some(specular) => {
                let toward = specular.reflect(vertex.normal, vertex.eye, point, &mut self.samples.random);
                let (position, from) = (vertex.position, vertex.surface);
                let ray =
                    |weight, last| Ray { origin: position, direction: toward, from, weight, last, from_eye: false };
                match specular.lobe {
                    None => ray(reflected * (1.0 / (1.0 - vertex.diffuse_share)), None),
                    Some(_) => {
                        let (response, density) = vertex.response(toward);
                        if density <= 0.0 {
                            return None;
                        }
                        let last = vertex.last(self.scene, density);
                        ray(response * (1.0 / density), Some(last))
                    }
                }
            }
        };
        ray.weight = ray.weight * (1.0 / survival);
        Some(ray)
    }

    /// A ray in a direction of the diffuse part of a vertex.
    pub(super) fn scatter<const C: usize>(&self, vertex: &Vertex<C>, point: [f64; 2]) -> Option<Ray<C>> {
        let direction = warp::around(vertex.normal, warp::cosine_hemisphere(point));
        let (response, density) = vertex.response(direction);
        if density <= 0.0 || response.max() <= 0.0 {
            return None;
        }
        let Vertex { position, surface, .. } = *vertex;
        let last = Some(vertex.last(self.scene, density));
        let weight = response * (1.0 / density);
        Some(Ray { origin: position, direction, from: surface, weight, last, from_eye: false })
    }

    /// Light that openings and luminaires send straight to a vertex, and by it toward the eye.
    pub(super) fn connect<const C: usize>(&mut self, daylight: &impl Daylight<C>, vertex: &Vertex<C>) -> Spectrum<C> {
        let scene = self.scene;
        let mut sum = Spectrum::ZERO;
        for (index, tube) in scene.tubes.iter().enumerate() {
            if tube.origin.z > vertex.position.z {
                daylight.connect(self, vertex, index, &mut sum);
            }
        }
        for luminaire in scene.luminaires.iter().filter(|luminaire| luminaire.emits()) {
            if vertex.lambert(scene) {
                sum += vertex.diffuse * luminaire.irradiance(vertex.position, vertex.normal) * (1.0 / PI);
                continue;
            }
            let source = luminaire.point(self.samples.pair()).clamp(DVec3::ZERO, scene.size);
            let way = source - vertex.position;
            let connected = luminaire_density(luminaire, way);
            if connected > 0.0
                && let Some((response, density)) = self.respond(vertex, source, Some(luminaire.surface))
            {
                let light: Spectrum<C> = luminaire.seen(way);
                sum += response * light * (share(connected, density) / connected);
            }
        }
        sum
    }

    /// The response of a vertex to light from a point that it sees, and the density of the ray that goes on.
    pub fn respond<const C: usize>(
        &mut self,
        vertex: &Vertex<C>,
        source: DVec3,
        surface: Option<SurfaceId>,
    ) -> Option<(Spectrum<C>, f64)> {
        let (response, density) = vertex.response((source - vertex.position).normalize());
        if response.max() <= 0.0 {
            return None;
        }
        self.rays += 1;
        self.scene.visible(source, surface, vertex.position, vertex.surface).then_some((response, density))
    }
}
