//! What comes to a point from all around, by rays that go side by side.
//!
//! A place where a ray ends sends what patches know of it ([`Lit`]), but for light straight from an opening that the patch sees in
//! part: there a ray is sent to the opening. What patches have wrong of a place ([`Gathering::missing`]) is found by gathering there.
//! Where a ray ends in an opening, or very near to one, a path is followed, which finds all.
//!
//! Directions are even points, turned about the normal and shifted for each gather (Cranley and Patterson 1976).

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::indirect::{Indirect, Lit, Sight};
use crate::geometry::numbers::Numbers;
use crate::guide::RayCount;
use crate::integrator::backward::next_event::{Daylight, NextEvent, Way};
use crate::integrator::backward::vertex::Vertex;
use crate::integrator::backward::walk::{Ray, Walk};
use crate::integrator::lamp::cells::per_lumen;
use crate::integrator::lamp::light::DiffuserLight;
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::{Spectrum, SurfaceOptics};
use crate::sampling::{Key, PathRandom, PathSamples, warp};
use crate::traceable::{Fan, FanHits, Place, RoomHit, Segments, Spread, SurfaceId, TOGETHER, TraceableScene};

/// Sums that are added up side by side, so that none waits for another.
const SUMS: usize = 4;

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
    /// What is traced.
    pub scene: &'a TraceableScene,
    /// What leaves the openings in the pass.
    pub light: &'a DiffuserLight<C>,
    /// The patches.
    pub indirect: &'a Indirect<C>,
    /// What they know of the light of the pass.
    pub lit: Lit<C>,
    /// The rays by which it is found what they have wrong.
    pub looks: Spread,
    /// By which vectors it is computed.
    pub vectors: pulp::Arch,
}

/// What was gathered at a point.
#[derive(Clone, Copy, Debug)]
struct Gathered<'a, const C: usize> {
    /// Illuminance in lx.
    lux: Spectrum<C>,
    /// One of the places that it comes from, all equally likely.
    chosen: Option<Spot<'a>>,
}

/// What is needed while light is gathered, kept from one time to the next.
#[derive(Debug, Default)]
pub struct Scratch {
    hits: FanHits,
    /// Patches and unit normals of the places where rays end.
    patches: Vec<usize>,
    normals: [Vec<f64>; 3],
    /// 0 where a ray ends so near to an opening, or in it, that its light is followed; else 1.
    far: Vec<f64>,
    /// Illuminance of the places per lumen from the middle of an opening.
    per_lumen: Vec<f64>,
    /// Places that may see an opening: the ray and the tube.
    asked: Vec<(usize, usize)>,
    /// Rays that were traced.
    pub rays: RayCount,
}

impl<'a, const C: usize> Gathering<'a, C> {
    /// Gathers at a sensor that looks up; of places nearer than the root of `near_squared`, in m2, that is counted, too, which patches
    /// have wrong.
    pub fn at_sensor(
        &self,
        position: DVec3,
        spread: &Spread,
        near_squared: f64,
        key: Key,
        scratch: &mut Scratch,
    ) -> Spectrum<C> {
        let at = Receiver { position, normal: DVec3::Z, surface: None };
        let mut lux = self.gather(&at, spread, key, scratch).lux;
        if near_squared > 0.0 {
            let mut random = PathRandom::new(key.child(1 << 33));
            let is_near = |ray: &usize| (scratch.end(*ray) - position).length_squared() < near_squared;
            let some = (0..spread.count()).filter(is_near).filter(|_| random.uniform() < SHARE_OF_NEAR);
            let some: Vec<_> = some.map(|ray| (ray, self.spot_of(ray, scratch))).collect();
            for (ray, spot) in some {
                let Some(spot) = spot else { continue };
                let missing = self.missing(spot, key.child((1 << 32) + ray as u64), scratch);
                lux += missing * (1.0 / (SHARE_OF_NEAR * spread.count() as f64));
            }
        }
        lux
    }

    /// Gathers at a point by the rays of `spread`, turned about its normal.
    fn gather(&self, at: &Receiver, spread: &Spread, key: Key, scratch: &mut Scratch) -> Gathered<'a, C> {
        let mut random = PathRandom::new(key);
        let count = spread.count();
        let (sin, cos) = libm::sincos(TAU * random.uniform());
        let [u, v] = [DVec3::X, DVec3::Y].map(|axis| warp::around(at.normal, axis));
        let frame = [u * cos + v * sin, v * cos - u * sin, at.normal];
        let fan = Fan { origin: at.position, from: at.surface, frame, shift: random.uniform(), spread };
        let chosen = (random.uniform() * count as f64) as usize;
        self.scene.meet_fan(&fan, &mut scratch.hits);
        scratch.rays += count as u64;
        self.find_patches(scratch);
        self.find_far(scratch);
        let mut lux = self.known(scratch);
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

    /// The patches and normals of all places.
    fn find_patches(&self, scratch: &mut Scratch) {
        let Scratch { hits, patches, normals, .. } = scratch;
        patches.resize(hits.surface.len(), 0);
        normals.iter_mut().for_each(|normals| normals.resize(hits.surface.len(), 0.0));
        let [u, v, w] = normals;
        let faces = &self.indirect.patches.faces;
        let [x, y, z] = &hits.position;
        let normals = u.iter_mut().zip(v.iter_mut()).zip(w.iter_mut());
        let positions = x.iter().zip(y).zip(z).map(|((x, y), z)| DVec3::new(*x, *y, *z));
        for (((surface, patch), ((u, v), w)), position) in
            hits.surface.iter().zip(&mut *patches).zip(normals).zip(positions)
        {
            let face = &faces[*surface as u32 as usize];
            *patch = face.at(position);
            (*u, *v, *w) = face.normal.into();
        }
    }

    /// Where rays end in openings, or near to them.
    fn find_far(&self, scratch: &mut Scratch) {
        let Scratch { hits, far, .. } = scratch;
        far.clear();
        far.resize(hits.surface.len(), 1.0);
        for tube in self.light.tubes() {
            self.vectors.dispatch(Far { position: &hits.position, origin: tube.origin, radius: tube.radius, far });
        }
    }

    /// Pi times the luminances in cd/m2 of all places, added up, as far as patches know them; who may see an opening is noted.
    fn known(&self, scratch: &mut Scratch) -> Spectrum<C> {
        let mut sums = [Spectrum::<C>::ZERO; SUMS];
        for (far, patches) in scratch.far.chunks_exact(SUMS).zip(scratch.patches.chunks_exact(SUMS)) {
            for lane in 0..SUMS {
                sums[lane] += self.lit.reflected[patches[lane]] * far[lane];
            }
        }
        let count = scratch.patches.len();
        let mut asked = 0;
        scratch.asked.resize(count * self.lit.straight.len(), (0, 0));
        for (tube, straight) in self.lit.straight.iter().enumerate() {
            self.find_per_lumen(tube, scratch);
            let sight = self.indirect.sight(tube);
            let of_sums = scratch.per_lumen.chunks_exact(SUMS).zip(scratch.patches.chunks_exact(SUMS));
            let of_sums = of_sums.zip(scratch.far.chunks_exact(SUMS));
            for (number, ((per_lumen, patches), far)) in of_sums.enumerate() {
                for lane in 0..SUMS {
                    sums[lane] += straight[patches[lane]] * per_lumen[lane];
                    // without branches: who sees an opening is as random as the rays; its middle may be behind who sees its edge
                    scratch.asked[asked] = (number * SUMS + lane, tube);
                    asked += usize::from((far[lane] > 0.0) & (sight[patches[lane]] == Sight::Partly));
                }
            }
        }
        scratch.asked.truncate(asked);
        let [mut first, second, third, fourth] = sums;
        first += second;
        let mut others = third;
        others += fourth;
        first += others;
        first
    }

    /// Illuminance of all places per lumen that leaves the middle of an opening; 0 where they face away, or light is followed.
    fn find_per_lumen(&self, tube: usize, scratch: &mut Scratch) {
        let Scratch { hits, normals, per_lumen, far, .. } = scratch;
        per_lumen.resize(far.len(), 0.0);
        let origin = self.light.tubes()[tube].origin;
        self.vectors.dispatch(PerLumen { position: &hits.position, normals, far, origin, per_lumen });
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
            lit[lane] = self.indirect.reflectances[scratch.patches[*ray]] * photon.flux * lux;
            segments.set(lane, scratch.end(*ray), way);
            segments.own[lane] = self.scene.box_with(scratch.hits.surface[*ray]);
        }
        let mut sum = Spectrum::ZERO;
        for (lit, clear) in lit.iter().zip(self.scene.clear_of_boxes(&segments)) {
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
        let optics = self.scene.optics(surface)?;
        let (position, normal) = (scratch.end(ray), scratch.normal(ray));
        Some(Spot { position, normal, surface, optics, patch: scratch.patches[ray] })
    }

    /// The place that a ray meets.
    pub fn spot(&self, hit: &RoomHit) -> Option<Spot<'a>> {
        let Place::Surface(surface) = hit.place else { return None };
        let RoomHit { position, normal, .. } = *hit;
        let optics = self.scene.optics(surface).filter(|_| self.light.is_far(position, 0.0))?;
        let patch = self.indirect.patches.faces.get(surface.index())?.at(position);
        Some(Spot { position, normal, surface, optics, patch })
    }

    /// Pi times the luminance in cd/m2 that comes from a place to a point, found by a path.
    fn followed(&self, at: &Receiver, end: DVec3, key: Key, rays: &mut RayCount) -> Spectrum<C> {
        let mut walk = Walk::<C>::new(self.scene, PathSamples::with_pairs(key, 0, 0), 0);
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
            missing += self.lit.reflected[patch] * -1.0;
            missing += self.missing_straight(&spot, reflectance, key.child(2 * step + 2), scratch);
            sum += weight * missing;
            let goes_on = reflectance.max().min(1.0);
            let Some(next) = gathered.chosen.filter(|_| random.uniform() < goes_on) else { break };
            weight *= reflectance * (1.0 / goes_on);
            spot = next;
        }
        sum
    }

    /// What patches have wrong of the same by light straight from the openings.
    fn missing_straight(
        &self,
        spot: &Spot<'a>,
        reflectance: Spectrum<C>,
        key: Key,
        scratch: &mut Scratch,
    ) -> Spectrum<C> {
        let mut walk = Walk::<C>::new(self.scene, PathSamples::with_pairs(key, 0, 0), 0);
        // all of the closed form
        walk.met = 1;
        let Spot { position, normal, surface, optics, patch } = *spot;
        let hit = RoomHit { position, normal, place: Place::Surface(surface) };
        let vertex = Vertex::surface(&hit, surface, optics, normal, Spectrum::ONE);
        let mut known = Spectrum::ZERO;
        for (number, (tube, lumens)) in self.light.tubes().iter().zip(&self.lit.lumens).enumerate() {
            match self.indirect.sight(number)[patch] {
                // all of that is found where it is gathered
                Sight::Partly => continue,
                Sight::Hidden => {}
                Sight::Whole => known += *lumens * per_lumen(tube.origin - position, normal).max(0.0),
            }
            Daylight::connect(self.light, &mut walk, &vertex, number);
        }
        scratch.rays += walk.rays;
        let mut missing = walk.sum * PI;
        missing += known * reflectance * -1.0;
        missing
    }
}

/// Sets to 0 what is nearer to a disc in the ceiling than its radius.
struct Far<'a> {
    position: &'a [Vec<f64>; 3],
    origin: DVec3,
    radius: f64,
    far: &'a mut [f64],
}

impl pulp::WithSimd for Far<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { position, origin, radius, far } = self;
        let number = |number: f64| Numbers::all(simd, number);
        let zero = number(0.0);
        for j in 0..far.len() / S::F64_LANES {
            let [dx, dy, depth] = [0, 1, 2].map(|axis| number(origin[axis]) - Numbers::of(simd, &position[axis], j));
            let beside = ((dx * dx + dy * dy).root() - number(radius)).most_of(zero);
            let is_near = (depth * depth + beside * beside).is_below(number(radius * radius));
            is_near.pick(zero, Numbers::of(simd, far, j)).store(far, j);
        }
    }
}

/// Illuminances per lumen from a point of the ceiling, of what is far from it.
struct PerLumen<'a> {
    position: &'a [Vec<f64>; 3],
    normals: &'a [Vec<f64>; 3],
    far: &'a [f64],
    origin: DVec3,
    per_lumen: &'a mut [f64],
}

impl pulp::WithSimd for PerLumen<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { position, normals, far, origin, per_lumen } = self;
        let number = |number: f64| Numbers::all(simd, number);
        for j in 0..far.len() / S::F64_LANES {
            let way = [0, 1, 2].map(|axis| number(origin[axis]) - Numbers::of(simd, &position[axis], j));
            let normal = normals.each_ref().map(|of| Numbers::of(simd, of, j));
            let squared = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
            let cosine = (way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2]).most_of(number(0.0));
            let lux = Numbers::of(simd, far, j) * cosine * way[2] / (number(PI) * squared * squared);
            lux.store(per_lumen, j);
        }
    }
}

impl Scratch {
    #[inline]
    fn end(&self, ray: usize) -> DVec3 {
        let [x, y, z] = &self.hits.position;
        DVec3::new(x[ray], y[ray], z[ray])
    }

    #[inline]
    fn normal(&self, ray: usize) -> DVec3 {
        let [x, y, z] = &self.normals;
        DVec3::new(x[ray], y[ray], z[ray])
    }

    fn surface(&self, ray: usize) -> SurfaceId {
        SurfaceId::numbered(self.hits.surface[ray] as usize)
    }
}
