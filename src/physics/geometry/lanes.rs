//! Eight boxes and four triangles at once: by vector instructions where the processor has AVX2 and FMA, else one by one.
//!
//! Both ways find the same hits to the bit: triangles are tested by the same operations of f64 in the same order, and boxes, whose
//! distances may differ in their last bit, are padded by more.

use glam::Vec3A;

use super::triangle::ShearedRay;

/// Boxes that are looked at at once.
pub const WIDTH: usize = 8;

/// Triangles that are tested at once.
pub const FOUR: usize = 4;

/// Below this size a component of a direction is taken as this: f32 products with its inverse stay finite.
const LEAST_COMPONENT: f32 = 1e-18;

/// Coordinates of four triangles by corner and axis.
pub type Corners = [[[f64; FOUR]; 3]; 3];

/// A ray in the coordinates of boxes.
#[derive(Clone, Copy, Debug)]
pub struct TreeRay {
    /// Inverse of the direction's components, and the origin's components times that.
    pub inverse: [f32; 3],
    pub scaled_origin: [f32; 3],
    /// Rows of a node's bounds that the ray meets first, by axis, and those where it leaves.
    pub near: [usize; 3],
    pub far: [usize; 3],
}

impl TreeRay {
    /// `origin` and `direction` of a ray, the origin within some times the extent of the boxes.
    pub fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let inverse = direction.to_array().map(|component| {
            let size = component.abs().max(LEAST_COMPONENT);
            1.0 / size.copysign(component)
        });
        let origin = origin.to_array();
        let near = [0, 1, 2].map(|axis| if inverse[axis] > 0.0 { axis } else { axis + 3 });
        Self {
            inverse,
            scaled_origin: [0, 1, 2].map(|axis| origin[axis] * inverse[axis]),
            near,
            far: [0, 1, 2].map(|axis| 2 * axis + 3 - near[axis]),
        }
    }
}

/// A way of doing several things at once.
pub trait Lanes: Copy {
    /// Distances at which a ray enters the boxes with these lower and upper bounds by axis, and a bit for each that it meets
    /// before `reach`.
    fn enter(self, bounds: &[[f32; WIDTH]; 6], ray: &TreeRay, reach: f32) -> ([f32; WIDTH], u32);

    /// Distances of four triangles as [`ShearedRay::intersect`] finds them, and a bit for each that is met.
    fn intersect(self, ray: &ShearedRay, corners: &Corners) -> ([f64; FOUR], u32);
}

/// A question whose answer needs many of either.
pub trait Query: Sized {
    type Answer;

    /// The answer, by one way: [`answer`] compiles it for each.
    fn answer<L: Lanes>(self, lanes: L) -> Self::Answer;
}

/// The answer to a query by the best way that the processor knows.
#[inline]
pub fn answer<Q: Query>(query: Q) -> Q::Answer {
    #[cfg(target_arch = "x86_64")]
    if let Some(vectors) = pulp::x86::V3::try_new() {
        return vectors.vectorize(by_vectors::Vectorized { query, vectors });
    }
    query.answer(OneByOne)
}

/// Plain arithmetic, for every processor.
#[derive(Clone, Copy, Debug)]
pub struct OneByOne;

impl Lanes for OneByOne {
    #[inline(always)]
    fn enter(self, bounds: &[[f32; WIDTH]; 6], ray: &TreeRay, reach: f32) -> ([f32; WIDTH], u32) {
        let (mut entries, mut met) = ([0.0; WIDTH], 0);
        for lane in 0..WIDTH {
            let (mut entry, mut exit) = (0.0f32, reach);
            for axis in 0..3 {
                let at = |row: usize| bounds[row][lane] * ray.inverse[axis] - ray.scaled_origin[axis];
                (entry, exit) = (entry.max(at(ray.near[axis])), exit.min(at(ray.far[axis])));
            }
            entries[lane] = entry;
            met |= u32::from(entry <= exit) << lane;
        }
        (entries, met)
    }

    #[inline(always)]
    fn intersect(self, ray: &ShearedRay, corners: &Corners) -> ([f64; FOUR], u32) {
        let (mut distances, mut met) = ([0.0; FOUR], 0);
        for lane in 0..FOUR {
            let triangle = corners.map(|corner| corner.map(|axis| axis[lane]).into());
            if let Some(distance) = ray.intersect(&triangle) {
                distances[lane] = distance;
                met |= 1 << lane;
            }
        }
        (distances, met)
    }
}

#[cfg(target_arch = "x86_64")]
mod by_vectors {
    use std::arch::x86_64::{__m256, __m256d, _CMP_GE_OQ, _CMP_GT_OQ, _CMP_LE_OQ};

    use pulp::x86::V3;

    use super::{Corners, FOUR, Lanes, Query, ShearedRay, TreeRay, WIDTH};

    pub struct Vectorized<Q> {
        pub query: Q,
        pub vectors: V3,
    }

    impl<Q: Query> pulp::NullaryFnOnce for Vectorized<Q> {
        type Output = Q::Answer;

        #[inline(always)]
        fn call(self) -> Q::Answer {
            self.query.answer(self.vectors)
        }
    }

    // what takes part is inlined: a closure, or a method that takes one, would be compiled without the vector instructions

    /// Distances at which a ray crosses one row of bounds, in direction `axis`.
    #[inline(always)]
    fn crossings(vectors: V3, bounds: &[[f32; WIDTH]; 6], row: usize, ray: &TreeRay, axis: usize) -> __m256 {
        let bounds = pulp::cast::<[f32; WIDTH], __m256>(bounds[row]);
        let inverse = vectors.avx._mm256_set1_ps(ray.inverse[axis]);
        let origin = vectors.avx._mm256_set1_ps(ray.scaled_origin[axis]);
        vectors.fma._mm256_fmsub_ps(bounds, inverse, origin)
    }

    /// One corner of four triangles in the frame of a sheared ray.
    #[inline(always)]
    fn sheared(vectors: V3, ray: &ShearedRay, corner: &[[f64; FOUR]; 3]) -> [__m256d; 3] {
        let avx = vectors.avx;
        let [x, y, z] = ray.axes;
        let x = avx._mm256_sub_pd(pulp::cast(corner[x]), avx._mm256_set1_pd(ray.origin[x]));
        let y = avx._mm256_sub_pd(pulp::cast(corner[y]), avx._mm256_set1_pd(ray.origin[y]));
        let z = avx._mm256_sub_pd(pulp::cast(corner[z]), avx._mm256_set1_pd(ray.origin[z]));
        let x = avx._mm256_sub_pd(x, avx._mm256_mul_pd(avx._mm256_set1_pd(ray.shear.x), z));
        let y = avx._mm256_sub_pd(y, avx._mm256_mul_pd(avx._mm256_set1_pd(ray.shear.y), z));
        [x, y, z]
    }

    /// a b - c d.
    #[inline(always)]
    fn difference(vectors: V3, [a, b]: [__m256d; 2], [c, d]: [__m256d; 2]) -> __m256d {
        let avx = vectors.avx;
        avx._mm256_sub_pd(avx._mm256_mul_pd(a, b), avx._mm256_mul_pd(c, d))
    }

    impl Lanes for V3 {
        #[inline(always)]
        fn enter(self, bounds: &[[f32; WIDTH]; 6], ray: &TreeRay, reach: f32) -> ([f32; WIDTH], u32) {
            let avx = self.avx;
            let [x, y, z] = ray.near;
            let entries = avx._mm256_max_ps(
                avx._mm256_max_ps(crossings(self, bounds, x, ray, 0), crossings(self, bounds, y, ray, 1)),
                avx._mm256_max_ps(crossings(self, bounds, z, ray, 2), avx._mm256_set1_ps(0.0)),
            );
            let [x, y, z] = ray.far;
            let exits = avx._mm256_min_ps(
                avx._mm256_min_ps(crossings(self, bounds, x, ray, 0), crossings(self, bounds, y, ray, 1)),
                avx._mm256_min_ps(crossings(self, bounds, z, ray, 2), avx._mm256_set1_ps(reach)),
            );
            let met = avx._mm256_movemask_ps(avx._mm256_cmp_ps::<_CMP_LE_OQ>(entries, exits));
            (pulp::cast(entries), met as u32)
        }

        #[inline(always)]
        fn intersect(self, ray: &ShearedRay, corners: &Corners) -> ([f64; FOUR], u32) {
            let avx = self.avx;
            let [ax, ay, az] = sheared(self, ray, &corners[0]);
            let [bx, by, bz] = sheared(self, ray, &corners[1]);
            let [cx, cy, cz] = sheared(self, ray, &corners[2]);
            let u = difference(self, [cx, by], [cy, bx]);
            let v = difference(self, [ax, cy], [ay, cx]);
            let w = difference(self, [bx, ay], [by, ax]);
            let least = avx._mm256_min_pd(avx._mm256_min_pd(u, v), w);
            let most = avx._mm256_max_pd(avx._mm256_max_pd(u, v), w);
            let zero = avx._mm256_set1_pd(0.0);
            let inside = avx._mm256_or_pd(
                avx._mm256_cmp_pd::<_CMP_GE_OQ>(least, zero),
                avx._mm256_cmp_pd::<_CMP_LE_OQ>(most, zero),
            );
            if avx._mm256_movemask_pd(inside) == 0 {
                return ([0.0; FOUR], 0);
            }
            let determinant = avx._mm256_add_pd(avx._mm256_add_pd(u, v), w);
            let sum = avx._mm256_add_pd(avx._mm256_mul_pd(u, az), avx._mm256_mul_pd(v, bz));
            let sum = avx._mm256_add_pd(sum, avx._mm256_mul_pd(w, cz));
            // without an area this is not a number, and no hit
            let distances = avx._mm256_div_pd(avx._mm256_mul_pd(avx._mm256_set1_pd(ray.shear.z), sum), determinant);
            let ahead = avx._mm256_cmp_pd::<_CMP_GT_OQ>(distances, zero);
            let met = avx._mm256_movemask_pd(avx._mm256_and_pd(inside, ahead));
            (pulp::cast(distances), met as u32)
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::sampling::{Key, PathRandom};

    /// Kernels that the compiler makes vectors of are compiled for them, too: the feature x86-v3 of pulp.
    #[cfg(target_arch = "x86_64")]
    #[test]
    fn plain_loops_are_compiled_for_vectors() {
        let scalar = matches!(pulp::Arch::new(), pulp::Arch::Scalar);
        assert_eq!(scalar, pulp::x86::V3::try_new().is_none());
    }

    /// What is asked of one ray, boxes and triangles.
    struct Both<'a>(&'a [[f32; WIDTH]; 6], TreeRay, &'a Corners, ShearedRay);

    impl Query for Both<'_> {
        type Answer = (u32, Vec<Option<f64>>);

        fn answer<L: Lanes>(self, lanes: L) -> Self::Answer {
            let (_, boxes) = lanes.enter(self.0, &self.1, 1.5);
            let (distances, met) = lanes.intersect(&self.3, self.2);
            let hit = |lane: usize| (met >> lane & 1 == 1).then_some(distances[lane]);
            (boxes, (0..FOUR).map(hit).collect())
        }
    }

    /// Vectors and plain arithmetic meet the same boxes and find the same distances to the bit, also along axes, by edges and
    /// corners, and of triangles that are narrow or missing.
    #[test]
    fn both_ways_agree() {
        let mut random = PathRandom::new(Key::new(21));
        let mut hits = [0; 2];
        for round in 0..4000 {
            let mut point = || DVec3::new(random.uniform(), random.uniform(), random.uniform());
            let mut corners = [[[0.0; FOUR]; 3]; 3];
            let mut bounds = [[0.0; WIDTH]; 6];
            for (row, values) in [0, 1, 2, 0, 1, 2].into_iter().zip(&mut bounds) {
                values.iter_mut().for_each(|value| *value = point()[row] as f32);
            }
            for axis in 0..3 {
                let (lower, upper) = bounds.split_at_mut(3);
                for (low, high) in lower[axis].iter_mut().zip(&mut upper[axis]) {
                    (*low, *high) = (low.min(*high), low.max(*high));
                }
            }
            for lane in 0..FOUR {
                let base = point();
                for corner in &mut corners {
                    let place = if round % 5 == 0 { base } else { point() };
                    (0..3).for_each(|axis| corner[axis][lane] = place[axis]);
                }
            }
            if round % 3 == 0 {
                corners.iter_mut().flatten().for_each(|lanes| lanes[3] = f64::NAN);
                (0..3).for_each(|axis| (bounds[axis][7], bounds[axis + 3][7]) = (f32::INFINITY, f32::NEG_INFINITY));
            }
            let corner = DVec3::from_array([0, 1, 2].map(|axis| corners[round % 3][axis][1]));
            let origin = point() * 2.0 - 0.5;
            let direction = match round % 4 {
                0 => (corner - origin).normalize(),
                1 => DVec3::AXES[round % 3],
                2 => -DVec3::AXES[round % 3],
                _ => (point() - 0.5).normalize(),
            };
            let ray = TreeRay::new(origin.as_vec3a(), direction.as_vec3a());
            let query = || Both(&bounds, ray, &corners, ShearedRay::new(origin, direction));
            let (boxes, triangles) = query().answer(OneByOne);
            assert_eq!(answer(query()), (boxes, triangles.clone()), "{round}");
            hits[0] += boxes.count_ones() as usize;
            hits[1] += triangles.iter().flatten().count();
        }
        assert!(hits[0] > 1000 && hits[1] > 500, "{hits:?}");
    }
}
