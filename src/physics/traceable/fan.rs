//! Rays from one point, spread about a direction: where all of them end.

use std::f64::consts::TAU;

use glam::DVec3;
use pulp::Simd;

use super::boxes_together::{NO_BOX, RaysInVectors, TOGETHER, inverse};
use super::scene::TraceableScene;
use super::surface_id::SurfaceId;
use crate::geometry::numbers::Numbers;
use crate::sampling::warp;

/// Directions about an axis, so that their density is the cosine with it over pi, by whole groups of [`TOGETHER`] that follow each other
/// around.
#[derive(Clone, Debug, Default)]
pub struct Spread {
    /// Cosine and sine of the angle around the axis.
    around: [Vec<f64>; 2],
    /// Square of the sine of the angle to the axis.
    aside: Vec<f64>,
}

/// Rays from a point.
#[derive(Clone, Copy, Debug)]
pub struct Fan<'a> {
    /// In m.
    pub origin: DVec3,
    /// The surface on which it is, if any.
    pub from: Option<SurfaceId>,
    /// Two unit vectors from which angles around the axis are counted, and the axis; each at right angles to the others.
    pub frame: [DVec3; 3],
    /// What is added to the squares of sines, in 0..1: those beyond 1 begin anew at 0.
    pub shift: f64,
    /// The directions.
    pub spread: &'a Spread,
}

/// Where the rays of a fan end, one after the other; kept from fan to fan.
#[derive(Clone, Debug, Default)]
pub struct FanHits {
    /// Numbers of the surfaces.
    pub surface: Vec<f64>,
    /// Coordinates in m.
    pub position: [Vec<f64>; 3],
    /// Which boxes each group of rays may meet.
    words: Vec<u64>,
    wedges: Vec<[DVec3; 2]>,
}

impl Spread {
    /// From points of the unit square, whole groups of them; the first coordinates are squares of sines, the others shares of a turn.
    pub fn new(points: impl Iterator<Item = [f64; 2]>) -> Self {
        let mut points: Vec<[f64; 2]> = points.collect();
        points.sort_by(|a, b| a[1].total_cmp(&b[1]));
        let mut spread = Self::default();
        for [aside, turn] in points {
            let (sin, cos) = libm::sincos(TAU * turn);
            spread.around[0].push(cos);
            spread.around[1].push(sin);
            spread.aside.push(aside);
        }
        spread
    }

    /// Number of directions.
    pub fn count(&self) -> usize {
        self.aside.len()
    }
}

impl<'a> Fan<'a> {
    /// Rays about a unit `axis`, turned around it and shifted by two numbers in 0..1.
    pub fn turned(
        origin: DVec3,
        from: Option<SurfaceId>,
        axis: DVec3,
        [turn, shift]: [f64; 2],
        spread: &'a Spread,
    ) -> Self {
        let (sin, cos) = libm::sincos(TAU * turn);
        let [u, v] = [DVec3::X, DVec3::Y].map(|across| warp::around(axis, across));
        Self { origin, from, frame: [u * cos + v * sin, v * cos - u * sin, axis], shift, spread }
    }

    /// The wedges in which groups of rays lie.
    fn wedges(&self, wedges: &mut Vec<[DVec3; 2]>) {
        let [u, v, _] = self.frame;
        let [cos, sin] = &self.spread.around;
        let groups = cos.chunks_exact(TOGETHER).zip(sin.chunks_exact(TOGETHER));
        wedges.clear();
        wedges.extend(groups.map(|(cos, sin)| {
            let last = TOGETHER - 1;
            // a wedge of half a turn and more bounds nothing
            let is_wide = cos[0] * sin[last] - sin[0] * cos[last] <= 0.0;
            if is_wide { [DVec3::ZERO; 2] } else { [v * cos[0] - u * sin[0], u * sin[last] - v * cos[last]] }
        }));
    }
}

impl TraceableScene {
    /// Finds where the rays of a fan end in a room of faces and boxes; what is met near an edge, within rounding, may be either side of it.
    pub fn meet_fan(&self, fan: &Fan<'_>, hits: &mut FanHits) {
        let FanHits { surface, position, words, wedges } = hits;
        for numbers in position.iter_mut().chain([&mut *surface]) {
            numbers.resize(fan.spread.count(), 0.0);
        }
        fan.wedges(wedges);
        self.boxes_together.reached(fan.origin, wedges, words);
        self.boxes_together.vectors().dispatch(MeetFan { scene: self, fan, surface, position, words });
    }
}

/// Finds where rays end on boxes and faces.
struct MeetFan<'a> {
    scene: &'a TraceableScene,
    fan: &'a Fan<'a>,
    surface: &'a mut [f64],
    position: &'a mut [Vec<f64>; 3],
    words: &'a [u64],
}

impl pulp::WithSimd for MeetFan<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { scene, fan, surface, position, words } = self;
        let number = |number: f64| Numbers::all(simd, number);
        let (zero, one) = (number(0.0), number(1.0));
        let origin = fan.origin.to_array().map(number);
        let own = fan.from.and_then(|surface| scene.numbering.box_of(surface));
        let own = number(own.map_or(NO_BOX, |own| own as f64));
        let shift = number(fan.shift);
        let Spread { around, aside } = fan.spread;
        let in_a_group = TOGETHER / S::F64_LANES;
        let of_group = scene.boxes_together.words();
        for j in 0..fan.spread.count() / S::F64_LANES {
            let shifted = Numbers::of(simd, aside, j) + shift;
            let squared = shifted - shifted.is_below(one).pick(zero, one);
            let (sine, cosine) = (squared.root(), (one - squared).root());
            let (u, v) = (sine * Numbers::of(simd, &around[0], j), sine * Numbers::of(simd, &around[1], j));
            let direction = [0, 1, 2].map(|axis| {
                let [along, across, up] = fan.frame.map(|vector| number(vector[axis]));
                along * u + across * v + up * cosine
            });
            let inverse = direction.map(|component| inverse(simd, component));
            let (mut distance, mut met) = (number(f64::INFINITY), zero);
            for axis in 0..3 {
                let is_far = zero.is_below(direction[axis]);
                let wall = is_far.pick(number(scene.size[axis]), zero);
                let to_wall = ((wall - origin[axis]) * inverse[axis]).most_of(zero);
                let nearer = to_wall.is_below(distance);
                let lower = number(2.0 * axis as f64);
                met = nearer.pick(is_far.pick(lower + one, lower), met);
                distance = nearer.pick(to_wall, distance);
            }
            let rays = RaysInVectors { origin, direction, inverse, own };
            let first = j / in_a_group * of_group;
            let words = words[first..first + of_group].iter().copied();
            let on_box = scene.boxes_together.meet(simd, &rays, distance, words);
            let six = number(6.0);
            let is_box = number(-0.5).is_below(on_box.number);
            is_box.pick(six + six * on_box.number + on_box.face, met).store(surface, j);
            for axis in 0..3 {
                let end = origin[axis] + direction[axis] * on_box.distance;
                end.most_of(zero).least_of(number(scene.size[axis])).store(&mut position[axis], j);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Surface;
    use crate::sampling::{Key, PathRandom, Replicate};
    use crate::scene::{BoxObject, Channels, Room, Scene};
    use crate::traceable::{Follow, Place};

    /// A room with many boxes, some of them turned, and rays from faces, boxes and anywhere.
    fn furnished(random: &mut PathRandom, boxes: usize) -> TraceableScene {
        let size = DVec3::new(4.0, 3.0, 2.5);
        let grey = Surface::diffuse([0.5; 3]);
        let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
        let object = |number: usize| BoxObject {
            size: DVec3::new(uniform(0.1, 0.5), uniform(0.1, 0.5), uniform(0.1, 1.0)),
            base: DVec3::new(
                uniform(0.4, 3.6),
                uniform(0.4, 2.6),
                if number.is_multiple_of(3) { 0.0 } else { uniform(0.0, 1.0) },
            ),
            rotation: [0.0, 0.4, uniform(0.0, 7.0)][number % 3],
            surface: grey,
        };
        let boxes = (0..boxes).map(object).collect();
        let room = Room { size, surfaces: [Some(grey); 6], boxes, meshes: Vec::new(), luminaires: Vec::new() };
        let scene = Scene {
            daylight: None,
            room,
            tubes: Vec::new(),
            grids: Vec::new(),
            views: Vec::new(),
            channels: Channels::Photopic,
        };
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        TraceableScene::new(&scene, follow).unwrap()
    }

    /// Each ray of a fan ends where a ray alone does, whatever wedge it lies in; together they have the moments of the cosine.
    #[test]
    fn rays_end_where_rays_alone_do() {
        let mut random = PathRandom::new(Key::new(51));
        let mut hits = FanHits::default();
        let (mut on_boxes, mut cosines, mut rays) = (0, 0.0, 0);
        for round in 0..120u64 {
            let scene = furnished(&mut random, [0, 1, 7, 30, 90][round as usize % 5]);
            let (replicate, _) = Replicate::of(Key::new(round), 0);
            let points = (0..[8, 16, 64, 256][round as usize % 4]).map(|k| replicate.point(k, 0));
            let spread = Spread::new(points.map(|[u, v, ..]| [u, v]));
            let [a, b, c, d] = std::array::from_fn(|_| random.uniform());
            let start = scene.size * DVec3::new(a, b, c);
            let from = scene.intersect(start, warp::cone([d, a], std::f64::consts::PI), None);
            let Place::Surface(surface) = from.place else { unreachable!() };
            let fan = Fan::turned(from.position, Some(surface), from.normal, [b, c], &spread);
            scene.meet_fan(&fan, &mut hits);
            assert_eq!(hits.surface.len(), spread.count());
            for ray in 0..spread.count() {
                let end = DVec3::from_array([0, 1, 2].map(|axis| hits.position[axis][ray]));
                let direction = (end - from.position).normalize();
                let alone = scene.intersect(from.position, direction, Some(surface));
                // a ray that grazes what it leaves, or an edge, may end on either side
                let is_same = alone.place == Place::Surface(SurfaceId::numbered(hits.surface[ray] as usize));
                assert!(is_same && (alone.position - end).length() < 1e-9, "{round} {ray}: {alone:?} {end}");
                on_boxes += usize::from(hits.surface[ray] >= 6.0);
                cosines += direction.dot(from.normal);
                rays += 1;
            }
        }
        assert!(on_boxes > rays / 10, "{on_boxes} of {rays}");
        // the mean cosine is 2/3, its variance 1/18; even points are nearer than that
        let error = (1.0 / 18.0 / rays as f64).sqrt();
        assert!((cosines / rays as f64 - 2.0 / 3.0).abs() < 4.0 * error, "{} {error}", cosines / rays as f64);
    }
}
