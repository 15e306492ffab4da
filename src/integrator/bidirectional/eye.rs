//! The eye's side: paths from sensors and pixels, each connected to the vertices of one photon.

use std::f64::consts::PI;

use glam::DVec3;

use super::light::LightVertex;
use super::weight::{Edge, Share, surface_density};
use crate::guide::{End, Transit};
use crate::integrator::backward::opening::{LEAST_MEASURED_SHARE, above_closure, shares};
use crate::integrator::backward::vertex::{Scatter, diffuse_share};
use crate::integrator::roulette::{MAX_EVENTS, survival};
use crate::optics::{Closure, Spectrum};
use crate::sampling::{PathSamples, warp};
use crate::traceable::{Place, SurfaceId, SurfaceOptics, TraceableScene};

/// Densities with which photons start, of the sources that eye paths can find.
#[derive(Debug)]
pub struct Starts {
    /// Density of sky light on each tube's opening, per m2.
    pub sky: Vec<f64>,
    /// Density on each luminaire, per m2.
    pub luminaires: Vec<f64>,
}

/// One path from a sensor or the eye.
pub struct EyePath<'a, const C: usize> {
    pub scene: &'a TraceableScene,
    pub starts: &'a Starts,
    /// The vertices of the photon that it is connected to.
    pub photon: &'a [LightVertex<C>],
    /// Number of photons of the pass.
    pub photons: f64,
    pub samples: PathSamples,
    pub rays: u64,
    /// Light that the path has found: illuminance in lux or luminance in cd/m2.
    pub sum: Spectrum<C>,
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

/// A ray on its way through the room.
#[derive(Clone, Copy)]
struct Ray<const C: usize> {
    origin: DVec3,
    direction: DVec3,
    from: Option<SurfaceId>,
    weight: Spectrum<C>,
    start: From,
    /// True if a surface that the ray meets reflects for the second time, or lights a sensor.
    reflected: bool,
    edge: Edge,
}

/// A point that scatters light toward the eye.
struct EyeVertex<'a, const C: usize> {
    position: DVec3,
    normal: DVec3,
    surface: Option<SurfaceId>,
    /// Unit vector toward the eye.
    eye: DVec3,
    /// Weight of the path that arrives.
    weight: Spectrum<C>,
    scatters: Scatters<'a>,
    share: Share,
}

enum Scatters<'a> {
    Surface(&'a SurfaceOptics),
    /// The lower side of a closure.
    Closure(Closure<'a>, Scatter),
}

impl<const C: usize> EyeVertex<'_, C> {
    /// The path's weight times BSDF times cosine per sr for light from `toward`.
    fn response(&self, toward: DVec3) -> Spectrum<C> {
        let cosine = toward.dot(self.normal);
        if cosine <= 0.0 {
            return Spectrum::ZERO;
        }
        let bsdf = match &self.scatters {
            Scatters::Surface(optics) => {
                let diffuse = Spectrum::from_rgb(optics.reflectance) * (cosine / PI);
                match optics.specular.as_ref().and_then(|specular| Some((specular, specular.lobe.as_deref()?))) {
                    Some((specular, lobe)) => {
                        let per_sr = lobe.density(self.normal, self.eye, toward);
                        diffuse + Spectrum::from_rgb(specular.reflectance) * per_sr
                    }
                    None => diffuse,
                }
            }
            Scatters::Closure(Closure::Lambertian { transmittance, reflectance }, scatter) => {
                let share = if scatter.transmitted { transmittance } else { reflectance };
                Spectrum::from_rgb(*share) * (cosine / PI)
            }
            Scatters::Closure(Closure::Measured(table), Scatter { transmitted, eye_cosine }) => {
                Spectrum::ONE * (table.per_sr(*transmitted, cosine, *eye_cosine) * cosine)
            }
            Scatters::Closure(Closure::Specular { .. }, _) => Spectrum::ZERO,
        };
        self.weight * bsdf
    }

    /// Density per sr of the ray that goes on `toward`.
    fn forward(&self, toward: DVec3) -> f64 {
        match &self.scatters {
            Scatters::Surface(optics) => surface_density(optics, self.normal, self.eye, toward),
            Scatters::Closure(..) => toward.dot(self.normal).max(0.0) / PI,
        }
    }

    /// Density per sr with which a photon from `toward` goes on to the vertex before.
    fn back(&self, toward: DVec3) -> f64 {
        match &self.scatters {
            Scatters::Surface(optics) => surface_density(optics, self.normal, toward, self.eye),
            Scatters::Closure(..) => 0.0,
        }
    }
}

impl<'a, const C: usize> EyePath<'a, C> {
    /// One sample of the illuminance in lux of a point that looks up; `cut` is the number of connections of photons to it
    /// for each of its paths.
    pub fn illuminance(&mut self, position: DVec3, start: From, cut: f64) {
        let direction = warp::cosine_hemisphere(self.samples.pair());
        if direction.z <= 0.0 {
            return;
        }
        let share = Share::start(1.0, 0.0);
        self.follow(Ray {
            origin: position,
            direction,
            from: None,
            weight: Spectrum([PI; C]),
            start,
            reflected: true,
            edge: Edge::leaving(&share, direction.z / PI, direction.z, 0.0, cut),
        });
    }

    /// One sample of the luminance in cd/m2 of a pixel of solid angle `pixel` in sr; `outside` is the distance from the eye
    /// to where its ray enters the room.
    pub fn luminance(&mut self, origin: DVec3, direction: DVec3, outside: f64, pixel: f64, cut: f64) {
        let share = Share::start(1.0, 0.0);
        let mut edge = Edge::leaving(&share, 1.0 / pixel, 1.0, 0.0, cut);
        edge.extend(outside);
        let weight = Spectrum::ONE;
        self.follow(Ray { origin, direction, from: None, weight, start: From::Eye, reflected: false, edge });
    }

    fn follow(&mut self, mut ray: Ray<C>) {
        let scene = self.scene;
        let first = ray.weight.max();
        for _ in 0..MAX_EVENTS {
            let hit = scene.intersect(ray.origin, ray.direction, ray.from);
            self.rays += 1;
            ray.edge.extend((hit.position - ray.origin).length());
            let next = match hit.place {
                Place::Opening(index) => self.enter_tube(index, hit.position, &ray),
                Place::Surface(surface) => {
                    if scene.luminaire(surface).is_some() {
                        self.find_luminaire(surface, &ray);
                        return;
                    }
                    let Some(optics) = scene.optics(surface) else { return };
                    if ray.reflected && !scene.interreflection {
                        return;
                    }
                    let vertex = EyeVertex {
                        position: hit.position,
                        normal: hit.normal,
                        surface: Some(surface),
                        eye: -ray.direction,
                        weight: ray.weight,
                        scatters: Scatters::Surface(optics),
                        share: ray.edge.arrive(-ray.direction.dot(hit.normal)),
                    };
                    if finite(optics) {
                        self.connect(&vertex);
                    }
                    self.reflect(&vertex, optics, &ray, first)
                }
            };
            match next {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    /// Adds what a ray sees of the luminaire that it meets.
    fn find_luminaire(&mut self, surface: SurfaceId, ray: &Ray<C>) {
        let Some(number) = self.scene.numbering.luminaire_of(surface) else { return };
        let luminaire = &self.scene.luminaires[number];
        let cosine = -ray.direction.dot(luminaire.normal);
        if cosine > 0.0 {
            let share = ray.edge.arrive(cosine);
            let start = self.starts.luminaires[number];
            let others = share.others(start, cosine / PI) + crossings(ray, &share, start);
            let seen: Spectrum<C> = luminaire.seen(ray.direction);
            self.sum += ray.weight * seen * (1.0 / (1.0 + others));
        }
    }

    /// The ray that goes on from a surface, by roulette.
    fn reflect(
        &mut self,
        vertex: &EyeVertex<'_, C>,
        optics: &SurfaceOptics,
        ray: &Ray<C>,
        first: f64,
    ) -> Option<Ray<C>> {
        let specular = optics.specular.as_ref();
        let diffuse = ray.weight * Spectrum::from_rgb(optics.reflectance);
        let reflected = specular.map_or(Spectrum::ZERO, |s| ray.weight * Spectrum::from_rgb(s.reflectance));
        let leaving = (diffuse + reflected).max();
        if leaving <= 0.0 {
            return None;
        }
        let survival = survival(leaving, ray.weight.max(), first);
        if self.samples.random.uniform() >= survival {
            return None;
        }
        let point = self.samples.pair();
        let diffuse_share = diffuse_share(optics);
        let toward = match specular {
            Some(specular) if self.samples.random.uniform() >= diffuse_share => {
                let toward = specular.reflect(vertex.normal, vertex.eye, point, &mut self.samples.random);
                if specular.lobe.is_none() {
                    let mut mirrored = Ray { origin: vertex.position, direction: toward, from: vertex.surface, ..*ray };
                    mirrored.weight = reflected * (1.0 / (survival * (1.0 - diffuse_share)));
                    mirrored.edge.turn();
                    mirrored.reflected |= finite(optics);
                    return Some(mirrored);
                }
                toward
            }
            _ => warp::around(vertex.normal, warp::cosine_hemisphere(point)),
        };
        let mut next = self.scatter(vertex, toward)?;
        next.weight = next.weight * (1.0 / survival);
        Some(next)
    }

    /// A ray that goes on `toward`, chosen by the finite parts of a vertex.
    fn scatter(&self, vertex: &EyeVertex<'_, C>, toward: DVec3) -> Option<Ray<C>> {
        let (density, response) = (vertex.forward(toward), vertex.response(toward));
        if density <= 0.0 || response.max() <= 0.0 {
            return None;
        }
        let cosine = toward.dot(vertex.normal);
        Some(Ray {
            origin: vertex.position,
            direction: toward,
            from: vertex.surface,
            weight: response * (1.0 / density),
            start: From::Inside,
            reflected: true,
            edge: Edge::leaving(&vertex.share, density, cosine, vertex.back(toward), 1.0),
        })
    }

    /// A ray meets an opening from below: adds the sky that it finds, and returns how it comes back into the room.
    fn enter_tube(&mut self, index: usize, mut position: DVec3, ray: &Ray<C>) -> Option<Ray<C>> {
        let scene = self.scene;
        let tube = &scene.tubes[index];
        let (mut direction, mut weight) = (ray.direction, ray.weight);
        let mut share = ray.edge.arrive(direction.z);
        let clear = matches!(tube.closure_at(position), Closure::Specular { .. });
        let straight_to_sensor = clear && share.cut > 0.0;
        let start = self.starts.sky[index];
        let crossing = crossings(ray, &share, start);
        if clear {
            share.cut = 0.0;
        }
        let mut share_of_sky = 1.0 / (1.0 + share.others(start, direction.z / PI) + crossing);
        if straight_to_sensor && matches!(ray.start, From::Point | From::Cell(_)) {
            share_of_sky = 0.0;
        }
        for _ in 0..MAX_EVENTS {
            let from_below = direction.z > 0.0;
            let closure = tube.closure_at(position);
            let scatter = Scatter { transmitted: !from_below, eye_cosine: direction.z.abs() };
            // what goes on down into the room, and what goes up
            let (down, up, upward) = if let Closure::Specular { transmittance } = closure {
                weight *= Spectrum::from_rgb(transmittance);
                if !from_below {
                    return Some(Ray {
                        origin: position,
                        direction,
                        from: None,
                        weight,
                        start: From::Inside,
                        reflected: ray.reflected,
                        edge: Edge::uncut(),
                    });
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
                    let sky = scene.sky.as_ref().map_or(0.0, |sky| share_of_sky * sky.luminance(toward));
                    let sun = scene.sun.filter(|sun| clear && ray.start == From::Eye && sun.covers(toward));
                    let sun = sun.filter(|_| toward.z > 0.0).map_or(0.0, |sun| sun.luminance_cd_m2());
                    self.sum += arriving * (sky + sun);
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
                return self.leave_closure(position, -direction, closure, scatter, goes_on);
            }
            weight = returning * (1.0 / (survival * returns));
            (position, direction) = place;
            // photons reach points by their last way through the closure alone, cells by any
            if straight_to_sensor && ray.start == From::Point {
                share_of_sky = 1.0;
            }
        }
        None
    }

    /// The lower side of a closure scatters light of the room toward the eye.
    fn leave_closure(
        &mut self,
        position: DVec3,
        eye: DVec3,
        closure: Closure<'_>,
        scatter: Scatter,
        weight: Spectrum<C>,
    ) -> Option<Ray<C>> {
        let vertex = EyeVertex {
            position,
            normal: DVec3::NEG_Z,
            surface: None,
            eye,
            weight,
            scatters: Scatters::Closure(closure, scatter),
            share: Share::start(1.0, 0.0),
        };
        self.connect(&vertex);
        let toward = warp::around(DVec3::NEG_Z, warp::cosine_hemisphere(self.samples.pair()));
        self.scatter(&vertex, toward)
    }

    /// Adds what the photon's vertices send straight to a vertex, and by it toward the eye.
    fn connect(&mut self, vertex: &EyeVertex<'_, C>) {
        let scene = self.scene;
        for light in self.photon {
            let way = light.position - vertex.position;
            let distance_squared = way.length_squared();
            if distance_squared == 0.0 {
                continue;
            }
            let toward = way / distance_squared.sqrt();
            let response = vertex.response(toward);
            let arriving = response * light.intensity(scene, -toward);
            if arriving.max() <= 0.0 {
                continue;
            }
            self.rays += 1;
            if !scene.visible(light.position, light.surface, vertex.position, vertex.surface) {
                continue;
            }
            let by_eye = vertex.forward(toward) * -toward.dot(light.normal) / distance_squared;
            let by_light = light.forward(scene, -toward) * toward.dot(vertex.normal) / distance_squared;
            let others = light.share.others(by_eye, light.back(scene, -toward))
                + vertex.share.others(by_light, vertex.back(toward));
            self.sum += arriving * (self.photons / (distance_squared * (1.0 + others)));
        }
    }
}

/// Photons that cross a cell from a mirror that shows it the source, relative to the ray that found it; `start` is the
/// density of their start per m2.
fn crossings<const C: usize>(ray: &Ray<C>, share: &Share, start: f64) -> f64 {
    match ray.start {
        From::Cell(crossings_per_path) if share.cut == 0.0 => crossings_per_path * start,
        _ => 0.0,
    }
}

/// True if any of a surface's light goes into more than one direction.
fn finite(optics: &SurfaceOptics) -> bool {
    optics.gathers() || optics.specular.as_ref().is_some_and(|specular| specular.lobe.is_some())
}
