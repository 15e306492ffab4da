//! One path followed backward, from a sensor or the eye: how it goes on and what light it meets.
//!
//! At every vertex that scatters with a finite distribution the path is connected to each luminaire, in closed form or at a
//! random point, and the ray that goes on finds luminaires too: where there is no closed form the two share the light by the
//! power heuristic (Veach and Guibas 1995, beta = 2). Daylight is the method's own: [`Daylight`] says what an opening sends
//! to a vertex, and which share of the sky a ray counts that finds its way up a guide. Light of the room that a closure
//! reflects, or that comes back down a guide, is found by the rays that go on alone.

use std::f64::consts::PI;

use glam::DVec3;

use crate::guide::{End, Transit};
use crate::integrator::photon::emission::PathSamples;
use crate::optics::{Closure, Glossy, MeasuredDiffuser, Spectrum};
use crate::sampling::{PathRandom, warp};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{NO_SURFACE, Place, SpecularOptics, SurfaceId, SurfaceOptics, TraceableScene};

/// Below this share of its first weight a path goes on by roulette even where nothing absorbs.
pub const ROULETTE_BELOW: f64 = 1e-3;

/// A path goes on for certain above this share of its first weight, if its method asks for it.
const CERTAIN_ABOVE: f64 = 0.05;

/// Events of one path after which it is cut off; reached only by scenes that absorb nothing.
pub const MAX_EVENTS: u32 = 1_000_000;

/// Below this roughness a connection meets the lobe so rarely that its sunlight is a mirror's.
pub const NARROW_ROUGHNESS: f64 = 0.2;

/// Least share with which a path goes on from a measured diffuser.
pub const LEAST_MEASURED_SHARE: f64 = 0.05;

/// How a method counts the daylight of openings.
pub trait Daylight<const C: usize>: Sync {
    /// Adds what tube `tube` sends straight to a vertex below its opening, and by it toward the eye.
    fn connect(&self, path: &mut Path, vertex: &Vertex<C>, tube: usize, sum: &mut Spectrum<C>);

    /// The share of the sky that a ray counts which meets the opening of tube `tube` at `position` and finds the sky at
    /// once; what it finds after it came back down the guide it counts whole. `None`: it counts neither.
    fn found_share(&self, scene: &TraceableScene, tube: usize, ray: &Ray<C>, position: DVec3) -> Option<f64>;
}

/// One path.
pub struct Path<'a> {
    pub scene: &'a TraceableScene,
    pub samples: PathSamples,
    /// Traced so far.
    pub rays: u64,
    /// Reflections still to come that no roulette decides, as long as the path's weight is worth it.
    pub certain: u32,
}

/// A point that scatters light toward the eye with a finite distribution, or a sensor.
pub struct Vertex<'a, const C: usize> {
    pub position: DVec3,
    pub normal: DVec3,
    pub surface: SurfaceId,
    /// Unit vector toward the eye.
    pub eye: DVec3,
    /// The path's weight times the diffuse reflectance; for a sensor pi.
    pub diffuse: Spectrum<C>,
    /// The path's weight times its reflectance.
    pub lobe: Option<(&'a Glossy, Spectrum<C>)>,
    /// The probability with which the ray that goes on is one of the diffuse part.
    pub diffuse_share: f64,
    /// The lower side of a measured diffuser: pi times its distribution stands for the diffuse reflectance.
    pub table: Option<(&'a MeasuredDiffuser, Scatter)>,
}

/// On which side of a closure, seen from the light, the eye is, and the cosine of its direction.
#[derive(Clone, Copy)]
pub struct Scatter {
    pub transmitted: bool,
    pub eye_cosine: f64,
}

impl<const C: usize> Vertex<'_, C> {
    /// The path's weight times BSDF times cosine per sr for light from `toward`, and the density of the ray that goes on.
    #[inline]
    pub fn response(&self, toward: DVec3) -> (Spectrum<C>, f64) {
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
    fn lambert(&self, scene: &TraceableScene) -> bool {
        !scene.luminaires_obstructed && self.lobe.is_none() && self.table.is_none()
    }

    /// Whether it has a lobe that connections rarely meet.
    pub fn is_narrow(&self) -> bool {
        self.lobe.is_some_and(|(lobe, _)| lobe.roughness() < NARROW_ROUGHNESS)
    }

    /// This vertex, left in a direction of `density`.
    fn last(&self, scene: &TraceableScene, density: f64) -> Last {
        Last { position: self.position, density, lambert: self.lambert(scene), narrow: self.is_narrow() }
    }
}

/// The vertex that a ray comes from, where it is connected.
#[derive(Clone, Copy)]
pub struct Last {
    pub position: DVec3,
    /// Of the ray's direction, per sr.
    pub density: f64,
    /// Light straight from luminaires is counted there in closed form.
    lambert: bool,
    /// The vertex has a lobe that connections rarely meet.
    pub narrow: bool,
}

/// A ray on its way through the room.
#[derive(Clone, Copy)]
pub struct Ray<const C: usize> {
    origin: DVec3,
    direction: DVec3,
    from: SurfaceId,
    weight: Spectrum<C>,
    /// `None`: no vertex counted what the ray finds.
    pub last: Option<Last>,
    /// Straight from the eye.
    pub from_eye: bool,
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
            surface: NO_SURFACE,
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
        let ray = Ray { origin, direction, from: NO_SURFACE, weight: Spectrum::ONE, last: None, from_eye: true };
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
                    let Some(optics) = &scene.surfaces[surface as usize] else { return };
                    if reflected && !scene.interreflection {
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
        let mut survival = leaving / weight.max();
        if weight.max() < ROULETTE_BELOW * first {
            survival *= weight.max() / (ROULETTE_BELOW * first);
        }
        let mut survival = survival.min(1.0);
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
    fn scatter<const C: usize>(&self, vertex: &Vertex<C>, point: [f64; 2]) -> Option<Ray<C>> {
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

    /// A ray meets an opening from below: adds the sky that it finds, and returns how it comes back into the room.
    fn enter_tube<const C: usize>(
        &mut self,
        daylight: &impl Daylight<C>,
        index: usize,
        mut position: DVec3,
        ray: &Ray<C>,
        sum: &mut Spectrum<C>,
    ) -> Option<Ray<C>> {
        let scene = self.scene;
        let tube = &scene.tubes[index];
        let (mut direction, mut weight) = (ray.direction, ray.weight);
        let mut share_of_sky = daylight.found_share(scene, index, ray, position);
        let climbs = share_of_sky.is_some() || (scene.guide_return && tube.guide.returns_light());
        for _ in 0..MAX_EVENTS {
            let from_below = direction.z > 0.0;
            let closure = tube.closure_at(position);
            let scatter = Scatter { transmitted: !from_below, eye_cosine: direction.z.abs() };
            // what goes on down into the room, and what goes up
            let (down, up, upward) = if let Closure::Specular { transmittance } = closure {
                weight *= Spectrum::from_rgb(transmittance);
                if !from_below {
                    let from = NO_SURFACE;
                    return Some(Ray { origin: position, direction, from, weight, last: None, from_eye: false });
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
            if climbs && up.max() > 0.0 {
                let transit: Transit<C> = tube.guide.up(position - tube.origin, upward, &mut self.samples.random);
                self.rays += u64::from(transit.rays);
                let arriving = up * transit.weight();
                if transit.end == End::Top {
                    if let Some(share) = share_of_sky {
                        let toward = transit.direction;
                        let sky = scene.sky.as_ref().map_or(0.0, |sky| share * sky.luminance(toward));
                        *sum += arriving * sky;
                    }
                } else if transit.end == End::Opening && scene.guide_return {
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
                return self.leave_closure(daylight, position, -direction, closure, scatter, goes_on, sum);
            }
            weight = returning * (1.0 / (survival * returns));
            (position, direction) = place;
            share_of_sky = share_of_sky.map(|_| 1.0);
        }
        None
    }

    /// The lower side of a closure scatters light of the room toward the eye.
    #[allow(clippy::too_many_arguments)]
    fn leave_closure<const C: usize>(
        &mut self,
        daylight: &impl Daylight<C>,
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
        *sum += self.connect(daylight, &vertex);
        let point = self.samples.pair();
        self.scatter(&vertex, point)
    }

    /// What openings and luminaires send straight to a vertex, and by it toward the eye.
    fn connect<const C: usize>(&mut self, daylight: &impl Daylight<C>, vertex: &Vertex<C>) -> Spectrum<C> {
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
                && let Some((response, density)) = self.respond(vertex, source, luminaire.surface)
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
        surface: SurfaceId,
    ) -> Option<(Spectrum<C>, f64)> {
        let (response, density) = vertex.response((source - vertex.position).normalize());
        if response.max() <= 0.0 {
            return None;
        }
        self.rays += 1;
        self.scene.visible(source, surface, vertex.position, vertex.surface).then_some((response, density))
    }
}

/// A direction above a closure from which it scatters light toward the eye, and BSDF times cosine over its density.
pub fn above_closure<const C: usize>(
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
pub fn shares<const C: usize>(closure: Closure<'_>, cosine: f64) -> [Spectrum<C>; 2] {
    match closure {
        Closure::Lambertian { transmittance, reflectance } => [transmittance, reflectance].map(Spectrum::from_rgb),
        Closure::Measured(table) => table.shares(cosine).map(|share| Spectrum::ONE * share),
        Closure::Specular { transmittance } => [Spectrum::from_rgb(transmittance), Spectrum::ZERO],
    }
}

fn lobe<const C: usize>(optics: &SurfaceOptics, weight: Spectrum<C>) -> Option<(&Glossy, Spectrum<C>)> {
    let specular = optics.specular.as_ref()?;
    Some((specular.lobe.as_deref()?, weight * Spectrum::from_rgb(specular.reflectance)))
}

/// The probability with which a surface sends a path on diffusely.
pub fn diffuse_share(optics: &SurfaceOptics) -> f64 {
    let brightest = |rgb: [f64; 3]| rgb.into_iter().fold(0.0, f64::max);
    let diffuse = brightest(optics.reflectance);
    match &optics.specular {
        Some(specular) if brightest(specular.reflectance) > 0.0 => {
            diffuse / (diffuse + brightest(specular.reflectance))
        }
        _ => 1.0,
    }
}

/// The same of a luminaire; zero from behind it.
fn luminaire_density(luminaire: &TraceableLuminaire, way: DVec3) -> f64 {
    let leaving = -way.dot(luminaire.normal);
    let distance_squared = way.length_squared();
    if leaving > 0.0 { distance_squared * distance_squared.sqrt() / (leaving * luminaire.area_m2) } else { 0.0 }
}

/// The share of a luminaire's light that a ray counts which finds it.
fn luminaire_share(last: Last, luminaire: &TraceableLuminaire, position: DVec3) -> f64 {
    if last.lambert {
        return 0.0;
    }
    share(last.density, luminaire_density(luminaire, position - last.position))
}

/// The share of light that is counted where it was found with `density`, and not with `other`: the power heuristic.
pub fn share(density: f64, other: f64) -> f64 {
    if other == 0.0 { 1.0 } else { 1.0 / (1.0 + (other / density).powi(2)) }
}
