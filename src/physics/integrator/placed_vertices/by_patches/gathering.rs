//! What comes to a point from all around, by rays that go side by side.
//!
//! A place where a ray ends sends what patches know of it ([`Known`]), but for light straight from an opening that the patch sees in
//! part: there a ray is sent to the opening. What patches have wrong of a place ([`Gathering::missing`]) is found by gathering there.
//! Where a ray ends in an opening, or very near to one, a path is followed, which finds all.
//!
//! Directions are even points, turned about the normal and shifted for each gather (Cranley and Patterson 1976).

use std::f64::consts::PI;

use glam::DVec3;

use super::indirect::Sight;
use super::known::{Known, Scratch};
use crate::guide::RayCount;
use crate::integrator::backward::next_event::{Daylight, NextEvent, Way};
use crate::integrator::backward::vertex::Vertex;
use crate::integrator::backward::walk::{Ray, Walk};
use crate::integrator::lamp::cells::per_lumen;
use crate::integrator::lamp::light::DiffuserLight;
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::{Spectrum, SurfaceOptics};
use crate::sampling::{Key, PathRandom, PathSamples};
use crate::traceable::{Fan, Place, RoomHit, Segments, Spread, SurfaceId, TOGETHER};

/// Share of the near places of a sensor at which it is looked for what patches have wrong: a look takes as long as some tens of rays, and
/// finds a fraction of the light.
const SHARE_OF_NEAR: f64 = 0.25;

/// A point that receives light.
#[derive(Clone, Copy, Debug)]
struct Receiver {
    position: DVec3,
    /// Unit normal.
    normal: DVec3,
    /// The surface on which it is, if any.
    surface: Option<SurfaceId>,
}

/// A point of a diffuse surface, far from openings.
#[derive(Clone, Copy, Debug)]
pub struct Spot<'a> {
    position: DVec3,
    /// Unit normal.
    normal: DVec3,
    surface: SurfaceId,
    optics: &'a SurfaceOptics,
    patch: usize,
}

/// Light in the room as far as it is known without following it.
pub struct Gathering<'a, const C: usize> {
    /// What patches know.
    pub known: Known<'a, C>,
    /// What leaves the openings in the pass.
    pub light: &'a DiffuserLight<C>,
    /// The rays by which it is found what patches have wrong.
    pub looks: Spread,
}

/// What was gathered at a point.
#[derive(Clone, Copy, Debug)]
struct Gathered<'a, const C: usize> {
    /// Illuminance in lx.
    lux: Spectrum<C>,
    /// One of the places that it comes from, all equally likely.
    chosen: Option<Spot<'a>>,
}

impl<'a, const C: usize> Gathering<'a, C> {
    /// Gathers at a sensor that looks up: its illuminance in lx by what patches reflect.
    pub fn at_sensor(&self, position: DVec3, spread: &Spread, key: Key, scratch: &mut Scratch) -> Spectrum<C> {
        let at = Receiver { position, normal: DVec3::Z, surface: None };
        self.gather(&at, spread, key, scratch).lux
    }

    /// What patches have wrong of the places nearer than the root of `near_squared`, in m2, to a sensor that has just gathered.
    pub fn missing_near(
        &self,
        position: DVec3,
        near_squared: f64,
        spread: &Spread,
        key: Key,
        scratch: &mut Scratch,
    ) -> Spectrum<C> {
        let mut random = PathRandom::new(key.child(1 << 33));
        let is_near = |ray: &usize| (scratch.end(*ray) - position).length_squared() < near_squared;
        let some = (0..spread.count()).filter(is_near).filter(|_| random.uniform() < SHARE_OF_NEAR);
        let some: Vec<_> = some.map(|ray| (ray, self.spot_of(ray, scratch))).collect();
        let mut lux = Spectrum::ZERO;
        for (ray, spot) in some {
            let Some(spot) = spot else { continue };
            let missing = self.missing(spot, key.child((1 << 32) + ray as u64), scratch);
            lux += missing * (1.0 / (SHARE_OF_NEAR * spread.count() as f64));
        }
        lux
    }

    /// Gathers at a point by the rays of `spread`, turned about its normal.
    fn gather(&self, at: &Receiver, spread: &Spread, key: Key, scratch: &mut Scratch) -> Gathered<'a, C> {
        let mut random = PathRandom::new(key);
        let count = spread.count();
        let turn_and_shift = [random.uniform(), random.uniform()];
        let chosen = (random.uniform() * count as f64) as usize;
        self.known.look(&Fan::turned(at.position, at.surface, at.normal, turn_and_shift, spread), scratch);
        let mut lux = self.known.sum(random.uniform(), scratch);
        for number in (0..scratch.asked.len()).step_by(TOGETHER) {
            lux += self.seen_by_places(number, &mut random, scratch);
        }
        for ray in 0..count {
            if scratch.far[ray] == 0.0 {
                lux += self.followed(at, scratch.end(ray), key.child(ray as u64), &mut scratch.rays);
            }
        }
        Gathered { lux: lux * (1.0 / count as f64), chosen: self.spot_of(chosen, scratch) }
    }

    /// What some of the noted places, from `first` on, reflect of the light of openings that they may see.
    fn seen_by_places(&self, first: usize, random: &mut PathRandom, scratch: &mut Scratch) -> Spectrum<C> {
        let asked = &scratch.asked[first..(first + TOGETHER).min(scratch.asked.len())];
        scratch.rays += asked.len() as u64;
        let mut lit = [Spectrum::<C>::ZERO; TOGETHER];
        let mut segments = Segments::default();
        for (lane, (ray, tube)) in asked.iter().enumerate() {
            let light = &self.light.tubes()[*tube];
            let Some((photon, _)) = light.choice(random.uniform()) else { continue };
            let way = photon.position.extend(light.origin.z) - scratch.end(*ray);
            let lux = per_lumen(way, scratch.normal(*ray)).max(0.0);
            lit[lane] = self.known.indirect.reflectances[scratch.patches[*ray]] * photon.flux * lux;
            let own = self.known.scene.numbering.box_of(scratch.surface(*ray));
            segments.set(lane, scratch.end(*ray), way, own);
        }
        let mut sum = Spectrum::ZERO;
        for (lit, clear) in lit.iter().zip(self.known.scene.clear_of_boxes(&segments)) {
            sum += *lit * clear;
        }
        sum
    }

    /// The place where a ray of the last fan ends.
    fn spot_of(&self, ray: usize, scratch: &Scratch) -> Option<Spot<'a>> {
        if scratch.far[ray] == 0.0 {
            return None;
        }
        let surface = scratch.surface(ray);
        let optics = self.known.scene.optics(surface)?;
        let (position, normal) = (scratch.end(ray), scratch.normal(ray));
        Some(Spot { position, normal, surface, optics, patch: scratch.patches[ray] })
    }

    /// The place that a ray meets.
    pub fn spot(&self, hit: &RoomHit) -> Option<Spot<'a>> {
        let Place::Surface(surface) = hit.place else { return None };
        let RoomHit { position, normal, .. } = *hit;
        let optics = self.known.scene.optics(surface).filter(|_| self.light.is_far(position, 0.0))?;
        let patch = self.known.indirect.patches.faces.get(surface.index())?.at(position);
        Some(Spot { position, normal, surface, optics, patch })
    }

    /// Pi times the luminance in cd/m2 that comes from a place to a point, found by a path.
    fn followed(&self, at: &Receiver, end: DVec3, key: Key, rays: &mut RayCount) -> Spectrum<C> {
        let mut walk = Walk::<C>::new(self.known.scene, PathSamples::with_pairs(key, 0, 0), 0);
        let direction = (end - at.position).normalize_or(at.normal);
        let (weight, trace) = (Spectrum::ONE, Way::COUNTED);
        let ray = Ray { origin: at.position, direction, from: at.surface, weight, reflected: true, trace };
        walk.follow(&NextEvent(self.light), ray);
        *rays += walk.rays;
        walk.sum * PI
    }

    /// What patches have wrong of pi times the luminance in cd/m2 of a spot: what is gathered there is too much or too little, and what is
    /// wrong of one of the places that it comes from stands for all of these.
    pub fn missing(&self, mut spot: Spot<'a>, key: Key, scratch: &mut Scratch) -> Spectrum<C> {
        let mut random = PathRandom::new(key);
        let (mut sum, mut weight) = (Spectrum::ZERO, Spectrum::<C>::ONE);
        for step in 0..u64::from(MAX_EVENTS) {
            let reflectance = spot.optics.diffuse();
            let Spot { position, normal, surface, patch, .. } = spot;
            let at = Receiver { position, normal, surface: Some(surface) };
            let gathered = self.gather(&at, &self.looks, key.child(2 * step + 1), scratch);
            let mut missing = gathered.lux * reflectance;
            missing += self.known.lit.reflected[patch] * -1.0;
            missing += self.missing_straight(&spot, key.child(2 * step + 2), scratch);
            sum += weight * missing;
            let goes_on = reflectance.max().min(1.0);
            let Some(next) = gathered.chosen.filter(|_| random.uniform() < goes_on) else { break };
            weight *= reflectance * (1.0 / goes_on);
            spot = next;
        }
        sum
    }

    /// What patches have wrong of the same by light straight from the openings.
    fn missing_straight(&self, spot: &Spot<'a>, key: Key, scratch: &mut Scratch) -> Spectrum<C> {
        let mut walk = Walk::<C>::new(self.known.scene, PathSamples::with_pairs(key, 0, 0), 0);
        // all of the closed form
        walk.met = 1;
        let Spot { position, normal, surface, optics, patch } = *spot;
        let hit = RoomHit { position, normal, place: Place::Surface(surface) };
        let vertex = Vertex::surface(&hit, surface, optics, normal, Spectrum::ONE);
        for number in 0..self.light.tubes().len() {
            // all of what others see is found where it is gathered
            if self.known.indirect.sight(number)[patch] == Sight::Hidden {
                Daylight::connect(self.light, &mut walk, &vertex, number);
            }
        }
        scratch.rays += walk.rays;
        walk.sum * PI
    }
}
