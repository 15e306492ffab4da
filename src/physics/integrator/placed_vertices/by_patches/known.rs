//! What patches know of the places where the rays of a fan end.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::indirect::{Indirect, Lit, Sight};
use crate::geometry::numbers::Numbers;
use crate::guide::RayCount;
use crate::optics::Spectrum;
use crate::traceable::{Fan, FanHits, SurfaceId, TraceableScene};

/// The golden section, less than 1: steps of it lie even, however many there are.
const GOLDEN_SECTION: f64 = 0.618_033_988_749_894_9;

/// Sums that are added up side by side, so that none waits for another.
const SUMS: usize = 4;

/// Patches, and the light on them.
#[derive(Debug)]
pub struct Known<'a, const C: usize> {
    /// What is traced.
    pub scene: &'a TraceableScene,
    /// The patches.
    pub indirect: &'a Indirect<C>,
    /// What they know of the light of the pass.
    pub lit: Lit<C>,
    /// Where the light of each opening leaves.
    pub leaving: Vec<Leaving>,
    /// By which vectors it is computed.
    pub vectors: pulp::Arch,
}

/// Points of an opening, each of which stands for as much of its flux, over and over.
#[derive(Debug)]
pub struct Leaving {
    /// Coordinates in m of so many points, and then of as many more as a fan may have rays.
    x: Vec<f64>,
    y: Vec<f64>,
    count: usize,
}

/// What is needed while light is gathered, kept from one time to the next.
#[derive(Debug, Default)]
pub struct Scratch {
    hits: FanHits,
    /// Patches of the places where rays end, and unit normals.
    pub patches: Vec<usize>,
    normals: [Vec<f64>; 3],
    /// 0 where a ray ends so near to an opening, or in it, that its light is followed; else 1.
    pub far: Vec<f64>,
    /// Illuminance of the places per lumen from points of an opening.
    per_lumen: Vec<f64>,
    /// Places that may see an opening: the ray and the tube.
    pub asked: Vec<(usize, usize)>,
    /// Rays that were traced.
    pub rays: RayCount,
}

impl<const C: usize> Known<'_, C> {
    /// Finds where the rays of a fan end, and of which patch each place is.
    pub fn look(&self, fan: &Fan<'_>, scratch: &mut Scratch) {
        self.scene.meet_fan(fan, &mut scratch.hits);
        scratch.rays += fan.spread.count() as u64;
        self.find_patches(scratch);
        self.find_far(scratch);
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
        for tube in &self.scene.tubes {
            let (origin, radius) = (tube.origin, tube.opening_radius);
            self.vectors.dispatch(Far { position: &hits.position, origin, radius, far });
        }
    }

    /// Pi times the luminances in cd/m2 of all places, added up, as far as patches know them; who may see an opening in part is noted.
    /// `start` in 0..1 is the point of an opening whose light comes to the first place.
    pub fn sum(&self, start: f64, scratch: &mut Scratch) -> Spectrum<C> {
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
            self.find_per_lumen(tube, start, scratch);
            let sight = self.indirect.sight(tube);
            let of_sums = scratch.per_lumen.chunks_exact(SUMS).zip(scratch.patches.chunks_exact(SUMS));
            let of_sums = of_sums.zip(scratch.far.chunks_exact(SUMS));
            for (number, ((per_lumen, patches), far)) in of_sums.enumerate() {
                for lane in 0..SUMS {
                    sums[lane] += straight[patches[lane]] * per_lumen[lane];
                    // without branches: who sees an opening is as random as the rays; one point of it may be behind who sees another
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

    /// Illuminance of all places per lumen, of each from another point of an opening; 0 where they face away, or light is followed.
    fn find_per_lumen(&self, tube: usize, start: f64, scratch: &mut Scratch) {
        let Scratch { hits, normals, per_lumen, far, .. } = scratch;
        per_lumen.clear();
        per_lumen.resize(far.len(), 0.0);
        let Leaving { x, y, count } = &self.leaving[tube];
        if *count == 0 {
            return;
        }
        let first = ((start * *count as f64) as usize).min(count - 1);
        let (from, height) = ([&x[first..], &y[first..]], self.scene.tubes[tube].origin.z);
        self.vectors.dispatch(PerLumen { position: &hits.position, normals, far, from, height, per_lumen });
    }
}

impl Leaving {
    /// Points for fans of up to so many rays; those that follow each other lie all over the opening.
    pub fn new(points: impl Iterator<Item = DVec2>, rays: usize) -> Self {
        let points: Vec<DVec2> = points.collect();
        let count = points.len();
        // neighbours in the list are neighbours in space
        let mut step = ((count as f64 * GOLDEN_SECTION) as usize).max(1);
        while has_common_divisor(step, count) {
            step += 1;
        }
        let length = if count == 0 { 0 } else { count + rays };
        let point = |index: usize| points[index * step % count];
        Self {
            x: (0..length).map(|index| point(index).x).collect(),
            y: (0..length).map(|index| point(index).y).collect(),
            count,
        }
    }
}

/// True if a number above 1 divides both.
fn has_common_divisor(mut a: usize, mut b: usize) -> bool {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a > 1
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

/// Illuminances per lumen from points of the ceiling, of what is far from them.
struct PerLumen<'a> {
    position: &'a [Vec<f64>; 3],
    normals: &'a [Vec<f64>; 3],
    far: &'a [f64],
    from: [&'a [f64]; 2],
    height: f64,
    per_lumen: &'a mut [f64],
}

impl pulp::WithSimd for PerLumen<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { position, normals, far, from, height, per_lumen } = self;
        let number = |number: f64| Numbers::all(simd, number);
        for j in 0..far.len() / S::F64_LANES {
            let [x, y, z] = position.each_ref().map(|of| Numbers::of(simd, of, j));
            let way = [Numbers::of(simd, from[0], j) - x, Numbers::of(simd, from[1], j) - y, number(height) - z];
            let normal = normals.each_ref().map(|of| Numbers::of(simd, of, j));
            let squared = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
            let cosine = (way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2]).most_of(number(0.0));
            let lux = Numbers::of(simd, far, j) * cosine * way[2] / (number(PI) * squared * squared);
            lux.store(per_lumen, j);
        }
    }
}

impl Scratch {
    /// Where a ray ends, in m.
    #[inline]
    pub fn end(&self, ray: usize) -> DVec3 {
        let [x, y, z] = &self.hits.position;
        DVec3::new(x[ray], y[ray], z[ray])
    }

    /// Unit normal there.
    #[inline]
    pub fn normal(&self, ray: usize) -> DVec3 {
        let [x, y, z] = &self.normals;
        DVec3::new(x[ray], y[ray], z[ray])
    }

    /// The surface there.
    #[inline]
    pub fn surface(&self, ray: usize) -> SurfaceId {
        SurfaceId::numbered(self.hits.surface[ray] as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::placed_vertices::panels::panels;
    use crate::optics::{Collector, Diffuser, Surface};
    use crate::sampling::{Key, Replicate};
    use crate::scene::{BoxObject, Channels, Face, Room, Scene, Segment, StraightOrBent, Tube, TubeShape};
    use crate::traceable::{Follow, Spread};

    /// A box whose side faces west, below a tube whose opening lies but for an edge behind that side.
    fn scene() -> Scene {
        let grey = Surface::diffuse([0.5; 3]);
        let tube = Tube {
            centre: DVec2::new(1.5, 1.5),
            opening_radius: 0.2,
            shape: TubeShape::Cylinders(StraightOrBent {
                reflectance: [0.95; 3].into(),
                segments: vec![Segment { length_m: 0.8, tilt: 0.0, azimuth: 0.0 }],
                collector: Collector::Open,
            }),
            diffuser: Diffuser::Lambertian { transmittance: [0.5; 3], reflectance: [0.0; 3] },
        };
        let object = BoxObject {
            size: DVec3::new(0.6, 0.6, 1.0),
            base: DVec3::new(1.7, 1.5, 0.0),
            rotation: 0.0,
            surface: grey,
        };
        let room = Room {
            size: DVec3::new(3.0, 3.0, 2.5),
            surfaces: [Some(grey); 6],
            boxes: vec![object],
            meshes: Vec::new(),
            luminaires: Vec::new(),
        };
        let (grids, views) = (Vec::new(), Vec::new());
        Scene { daylight: None, room, tubes: vec![tube], grids, views, channels: Channels::Photopic }
    }

    /// Places from which the middle of an opening lies behind their surface, but some of it does not, ask for its light.
    #[test]
    fn places_that_see_an_edge_of_an_opening_ask_for_it() {
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        let scene = TraceableScene::new(&scene(), follow).unwrap();
        let indirect = Indirect::<1>::of(&scene, &panels(&scene));
        let lit = indirect.lit(&[Spectrum([1.0])]);
        let leaving = vec![Leaving::new([scene.tubes[0].origin.truncate()].into_iter(), 64)];
        let known = Known { scene: &scene, indirect: &indirect, lit, leaving, vectors: pulp::Arch::new() };
        let (replicate, first) = Replicate::of(Key::new(71), 0);
        let spread = Spread::new((0..64).map(|index| replicate.point(first + index, 0)).map(|[u, v, ..]| [u, v]));
        let mut scratch = Scratch::default();
        let sensor = DVec3::new(1.1, 1.5, 0.0);
        known.look(&Fan::turned(sensor, None, DVec3::Z, [0.3, 0.6], &spread), &mut scratch);
        known.sum(0.5, &mut scratch);
        let west = scene.numbering.box_face(0, Face::West as usize);
        let on_side: Vec<usize> = (0..64).filter(|ray| scratch.surface(*ray) == west).collect();
        assert!(on_side.len() > 5, "{on_side:?}");
        for ray in on_side {
            assert!(scratch.per_lumen[ray] == 0.0 && scratch.asked.contains(&(ray, 0)), "{ray}");
        }
    }

    /// From any start on as many points follow as a fan has rays, each as often as the others; points that follow each other lie apart.
    #[test]
    fn points_of_openings_come_evenly() {
        for count in [1, 7, 64, 100] {
            let points = (0..count).map(|number| DVec2::new(f64::from(number), -f64::from(number)));
            let leaving = Leaving::new(points, 256);
            assert_eq!((leaving.x.len(), leaving.count), (count as usize + 256, count as usize));
            let mut round = leaving.x[..count as usize].to_vec();
            assert!(leaving.x.iter().zip(&leaving.y).all(|(x, y)| *x == -*y));
            round.sort_by(f64::total_cmp);
            assert!(round.iter().enumerate().all(|(number, x)| *x == number as f64));
            assert!((0..256).all(|index| leaving.x[index] == leaving.x[index + count as usize]));
            // eight in a row fall into at least six of eight equal parts
            if count >= 64 {
                let mut parts: Vec<_> = leaving.x[..8].iter().map(|x| (8.0 * x / f64::from(count)) as usize).collect();
                parts.sort_unstable();
                parts.dedup();
                assert!(parts.len() >= 6, "{parts:?}");
            }
        }
    }
}
