//! Gather rays of final gathering: light that diffuse parts of surfaces send to a receiver, estimated from the photons where the rays end.

use std::cell::Cell;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use crate::guide::RayCount;
use crate::integrator::backward::meeting::{Meeting, Ray, Walk};
use crate::integrator::backward::opening::DaylightWeights;
use crate::integrator::backward::vertex::Vertex;
use crate::integrator::photon_map::maps::{Gathered, Mapper, Maps};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Replicate, warp};
use crate::traceable::{Place, RoomHit, SurfaceId, TraceableScene};

/// Photon maps of one pass, with a count of the rays that gather from them.
pub struct FinalGathering<'a, const C: usize> {
    mapper: &'a Mapper<C>,
    pub maps: &'a Maps<C>,
    /// Number of rays that were traced.
    rays: RayCounter,
}

/// Surface element from which gather rays start.
pub struct GatherPoint {
    pub normal: DVec3,
    pub surface: Option<SurfaceId>,
    pub key: Key,
}

/// Ray counter that many threads add to; sums of integers do not depend on the order.
#[derive(Default)]
struct RayCounter {
    followed: AtomicU64,
    lost: AtomicU64,
}

impl RayCounter {
    fn add(&self, rays: RayCount) {
        self.followed.fetch_add(rays.followed, Ordering::Relaxed);
        if rays.lost > 0 {
            self.lost.fetch_add(rays.lost, Ordering::Relaxed);
        }
    }

    fn into_inner(self) -> RayCount {
        RayCount { followed: self.followed.into_inner(), lost: self.lost.into_inner() }
    }
}

impl<'a, const C: usize> FinalGathering<'a, C> {
    pub fn new(mapper: &'a Mapper<C>, maps: &'a Maps<C>) -> Self {
        Self { mapper, maps, rays: RayCounter::default() }
    }

    /// Adds rays that were traced elsewhere for the same pass.
    pub fn count(&self, rays: RayCount) {
        self.rays.add(rays);
    }

    /// Returns the number of all rays that were counted.
    pub fn rays(self) -> RayCount {
        self.rays.into_inner()
    }

    /// Estimates the irradiance of a receiver by light from diffuse parts of surfaces, by `count` rays. `start` maps a point of the unit
    /// square to the start of a ray; it returns `None` where no light arrives.
    pub fn gather(&self, receiver: &GatherPoint, start: impl Fn([f64; 2]) -> Option<DVec3>, count: u32) -> Gathered<C> {
        let mut sum = Gathered::NOTHING;
        if !self.mapper.scene.interreflection {
            return sum;
        }
        let mut rays = RayCount::default();
        for number in 0..u64::from(count) {
            let (replicate, index) = Replicate::of(receiver.key, number);
            let [u, v, x, y] = replicate.point(index, 0);
            let Some(origin) = start([x, y]) else { continue };
            let direction = warp::around(receiver.normal, warp::cosine_hemisphere([u, v]));
            let (from, weight) = (receiver.surface, Spectrum::ONE);
            let gathered = GatherRay { gathering: self, bias: Cell::new(0.0), found: Cell::new(0.0) };
            let mut walk = Walk::new(&self.mapper.scene, PathSamples::with_pairs(receiver.key, number, 0), 0);
            walk.follow(&gathered, Ray { origin, direction, from, weight, reflected: true, trace: () });
            sum.irradiance += walk.sum;
            sum.bias += gathered.bias.get();
            sum.found += gathered.found.get();
            rays += walk.rays;
        }
        self.rays.add(rays);
        let per_ray = PI / f64::from(count);
        Gathered { irradiance: sum.irradiance * per_ray, bias: sum.bias * per_ray, found: sum.found }
    }

    /// Estimates the direct irradiance of a surface point from diffusers and luminaires, with its bias.
    pub fn direct(
        &self,
        hit: &RoomHit,
        surface: SurfaceId,
        connections: usize,
        strata: usize,
        random: &mut PathRandom,
    ) -> Gathered<C> {
        let RoomHit { position, normal, .. } = *hit;
        let mut light =
            self.mapper.diffuser_irradiance(self.maps, position, normal, Some(surface), connections, random);
        light.irradiance += self.mapper.luminaire_irradiance(position, normal, Some(surface), strata, random);
        light
    }
}

/// Gather ray: adds the luminance in cd/m2 that diffuse parts of surfaces send along it. Light from diffusers and luminaires, and through
/// openings, is estimated separately.
struct GatherRay<'a, const C: usize> {
    gathering: &'a FinalGathering<'a, C>,
    /// Estimated bias in cd/m2.
    bias: Cell<f64>,
    /// Photons found, scaled to full discs.
    found: Cell<f64>,
}

impl<const C: usize> Meeting<C> for GatherRay<'_, C> {
    const FOLLOWS_DIFFUSE: bool = false;
    type Trace = ();
    type Arrival = ();

    fn arrives(&self, (): &(), _: f64) {}

    fn arrives_at_closure(&self) {}

    fn arrives_at_sensor(&self) {}

    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, (): &()) {
        let Some((surface, optics)) = vertex.surface.and_then(|surface| Some((surface, walk.scene.optics(surface)?)))
        else {
            return;
        };
        if optics.gathers() {
            let Self { gathering, bias, found } = self;
            let Vertex { position, normal, weight, .. } = *vertex;
            let hit = RoomHit { position, normal, place: Place::Surface(surface) };
            let weight = weight * optics.diffuse() * (1.0 / PI);
            let mut light = gathering.mapper.indirect(gathering.maps, gathering.maps.radius, position, surface);
            light.add_light(&gathering.direct(&hit, surface, 1, 1, &mut walk.samples.random));
            walk.sum += light.irradiance * weight;
            bias.set(bias.get() + light.bias * weight.luminance());
            found.set(found.get() + light.found);
        }
    }

    fn leaves(&self, _: &TraceableScene, _: &Vertex<'_, C>, (): &(), _: DVec3, _: f64) {}

    fn turns(&self, _: &TraceableScene, (): &(), _: SurfaceId) {}

    fn passes(&self, (): &()) {}

    fn luminaire_weight(&self, _: &TraceableScene, _: usize, _: &Ray<C, ()>, _: DVec3) -> f64 {
        0.0
    }

    fn meets_opening(&self, _: &mut Walk<'_, C>, _: usize, _: &Ray<C, ()>, _: DVec3) -> Option<DaylightWeights> {
        None
    }
}
