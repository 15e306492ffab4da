//! Eight boxes or eight triangles at once: by vector instructions where the processor has AVX2 and FMA, else one by one.
//!
//! Both are filters in f32, which let through what a ray meets and a little more: their last bits may differ from one way to the
//! other, and what is let through is decided in f64.

use glam::Vec3A;

/// Boxes that are looked at at once, and triangles.
pub const WIDTH: usize = 8;

/// Largest error of a coordinate of a triangle seen along a ray, in the coordinates of boxes: corners are within one of the ray's
/// origin in each, or two where it lies outside; rounding of both, of the direction (2^-24 each) and of what is computed from them stays
/// below 1e-6.
const BLUR: f32 = 2e-6;

/// Below this size a component of a direction is taken as this: f32 products with its inverse stay finite.
const LEAST_COMPONENT: f32 = 1e-18;

/// Coordinates of eight triangles by corner and axis; not a number where there is no triangle.
pub type Corners = [[[f32; WIDTH]; 3]; 3];

/// A ray in the coordinates of boxes.
#[derive(Clone, Copy, Debug)]
pub struct TreeRay {
    /// Inverse of the direction's components, and the origin's components times that.
    pub inverse: [f32; 3],
    pub scaled_origin: [f32; 3],
    /// Rows of a node's bounds that the ray meets first, by axis, and those where it leaves.
    pub near: [usize; 3],
    pub far: [usize; 3],
    origin: [f32; 3],
    /// The axes, that of the direction's largest component last, and the shear that takes the direction to the last one.
    axes: [usize; 3],
    shear: [f32; 2],
}

impl TreeRay {
    /// `origin` and `direction` of a ray, the origin within some times the extent of the boxes.
    pub fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let inverse = direction.to_array().map(|component: f32| {
            let size = component.abs().max(LEAST_COMPONENT);
            1.0 / size.copysign(component)
        });
        let (origin, direction) = (origin.to_array(), direction.to_array());
        let size = direction.map(f32::abs);
        let last = if size[0] > size[1] && size[0] > size[2] { 0 } else { 2 - usize::from(size[1] > size[2]) };
        let axes = [(last + 1) % 3, (last + 2) % 3, last];
        let near = [0, 1, 2].map(|axis| if inverse[axis] > 0.0 { axis } else { axis + 3 });
        Self {
            inverse,
            scaled_origin: [0, 1, 2].map(|axis| origin[axis] * inverse[axis]),
            near,
            far: [0, 1, 2].map(|axis| 2 * axis + 3 - near[axis]),
            origin,
            axes,
            shear: [0, 1].map(|axis| direction[axes[axis]] / direction[last]),
        }
    }
}

/// A way of doing several things at once.
pub trait Lanes: Copy {
    /// Distances at which a ray enters the boxes with these lower and upper bounds by axis, and a bit for each that it meets
    /// before `reach`.
    fn enter(self, bounds: &[[f32; WIDTH]; 6], ray: &TreeRay, reach: f32) -> ([f32; WIDTH], u32);

    /// A bit for each triangle that the line of a ray meets, or passes so closely that rounding may hide that it does.
    fn touch(self, corners: &Corners, ray: &TreeRay) -> u32;
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
    fn touch(self, corners: &Corners, ray: &TreeRay) -> u32 {
        let mut touched = 0;
        for lane in 0..WIDTH {
            // across the ray, and how far rounding may have moved the product of two of them
            let [a, b, c] = corners.each_ref().map(|corner| {
                let [x, y, z] = ray.axes.map(|axis| corner[axis][lane] - ray.origin[axis]);
                let (x, y) = (x - ray.shear[0] * z, y - ray.shear[1] * z);
                (x, y, BLUR * (x.abs() + y.abs() + 2.0 * BLUR))
            });
            let sides = [(c, b), (a, c), (b, a)];
            let sides = sides.map(|(from, to)| (from.0 * to.1 - from.1 * to.0, from.2 + to.2));
            let inside =
                sides.iter().all(|(side, blur)| *side >= -blur) || sides.iter().all(|(side, blur)| *side <= *blur);
            touched |= u32::from(inside) << lane;
        }
        touched
    }
}

#[cfg(target_arch = "x86_64")]
mod by_vectors {
    use std::arch::x86_64::{__m256, _CMP_GE_OQ, _CMP_LE_OQ};

    use pulp::x86::V3;

    use super::{BLUR, Corners, Lanes, Query, TreeRay, WIDTH};

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

    /// One corner of eight triangles across a ray, and how far rounding may have moved its product with another.
    #[inline(always)]
    fn across(vectors: V3, ray: &TreeRay, corner: &[[f32; WIDTH]; 3]) -> [__m256; 3] {
        let (avx, fma) = (vectors.avx, vectors.fma);
        let [x, y, z] = ray.axes;
        let x = avx._mm256_sub_ps(pulp::cast(corner[x]), avx._mm256_set1_ps(ray.origin[x]));
        let y = avx._mm256_sub_ps(pulp::cast(corner[y]), avx._mm256_set1_ps(ray.origin[y]));
        let z = avx._mm256_sub_ps(pulp::cast(corner[z]), avx._mm256_set1_ps(ray.origin[z]));
        let x = fma._mm256_fnmadd_ps(avx._mm256_set1_ps(ray.shear[0]), z, x);
        let y = fma._mm256_fnmadd_ps(avx._mm256_set1_ps(ray.shear[1]), z, y);
        let sign = avx._mm256_set1_ps(-0.0);
        let size = avx._mm256_add_ps(avx._mm256_andnot_ps(sign, x), avx._mm256_andnot_ps(sign, y));
        let blur = avx._mm256_set1_ps(BLUR);
        [x, y, fma._mm256_fmadd_ps(size, blur, avx._mm256_set1_ps(2.0 * BLUR * BLUR))]
    }

    /// Twice the areas of the triangles between the ray and the sides from one corner to another, and their errors.
    #[inline(always)]
    fn side(vectors: V3, from: [__m256; 3], to: [__m256; 3]) -> [__m256; 2] {
        let (avx, fma) = (vectors.avx, vectors.fma);
        let area = fma._mm256_fmsub_ps(from[0], to[1], avx._mm256_mul_ps(from[1], to[0]));
        [area, avx._mm256_add_ps(from[2], to[2])]
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
        fn touch(self, corners: &Corners, ray: &TreeRay) -> u32 {
            let avx = self.avx;
            let a = across(self, ray, &corners[0]);
            let b = across(self, ray, &corners[1]);
            let c = across(self, ray, &corners[2]);
            let [u, blur_u] = side(self, c, b);
            let [v, blur_v] = side(self, a, c);
            let [w, blur_w] = side(self, b, a);
            let least = avx._mm256_min_ps(avx._mm256_add_ps(u, blur_u), avx._mm256_add_ps(v, blur_v));
            let least = avx._mm256_min_ps(least, avx._mm256_add_ps(w, blur_w));
            let most = avx._mm256_max_ps(avx._mm256_sub_ps(u, blur_u), avx._mm256_sub_ps(v, blur_v));
            let most = avx._mm256_max_ps(most, avx._mm256_sub_ps(w, blur_w));
            let zero = avx._mm256_set1_ps(0.0);
            let inside = avx._mm256_or_ps(
                avx._mm256_cmp_ps::<_CMP_GE_OQ>(least, zero),
                avx._mm256_cmp_ps::<_CMP_LE_OQ>(most, zero),
            );
            avx._mm256_movemask_ps(inside) as u32
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::triangle::ShearedRay;
    use crate::sampling::{Key, PathRandom};

    /// Kernels that the compiler makes vectors of are compiled for them, too: the feature x86-v3 of pulp.
    #[cfg(target_arch = "x86_64")]
    #[test]
    fn plain_loops_are_compiled_for_vectors() {
        let scalar = matches!(pulp::Arch::new(), pulp::Arch::Scalar);
        assert_eq!(scalar, pulp::x86::V3::try_new().is_none());
    }

    /// What is asked of one ray, boxes and triangles.
    struct Both<'a>(&'a [[f32; WIDTH]; 6], &'a Corners, TreeRay);

    impl Query for Both<'_> {
        type Answer = (u32, u32);

        fn answer<L: Lanes>(self, lanes: L) -> Self::Answer {
            (lanes.enter(self.0, &self.2, 1.5).1, lanes.touch(self.1, &self.2))
        }
    }

    /// Vectors and plain arithmetic meet the same boxes, and let every triangle through that a ray meets by f64, also along axes, by
    /// edges and corners, and of triangles that are narrow; few others, and none that is missing.
    #[test]
    fn filters_let_through_what_is_met() {
        let mut random = PathRandom::new(Key::new(21));
        let (mut boxes_met, mut triangles_met, mut let_through) = (0, 0, [0; 2]);
        for round in 0..6000 {
            let mut point = || DVec3::new(random.uniform(), random.uniform(), random.uniform()) - 0.5;
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
            let size = [1.0, 1e-2, 1e-4][round % 3];
            let triangles: Vec<[DVec3; 3]> = (0..WIDTH - 1)
                .map(|lane| {
                    let base = point();
                    let narrow = if lane == 0 { 1e-9 } else { 1.0 };
                    [base, base + point() * size, base + point() * size * narrow]
                })
                .collect();
            let mut corners = [[[f32::NAN; WIDTH]; 3]; 3];
            for (lane, triangle) in triangles.iter().enumerate() {
                for (rows, corner) in corners.iter_mut().zip(triangle) {
                    (0..3).for_each(|axis| rows[axis][lane] = corner[axis] as f32);
                }
            }
            let [a, b, _] = triangles[round % triangles.len()];
            let aim = [a, a.lerp(b, point().x + 0.5), point()][round % 7 % 3];
            let direction = match round % 4 {
                0 => DVec3::AXES[round % 3],
                1 => -DVec3::AXES[round % 3],
                _ => point().normalize(),
            };
            let origin = aim - direction * point().x.abs() * 2.0;
            let ray = TreeRay::new(origin.as_vec3a(), direction.as_vec3a());
            let by_f64 = [direction, -direction].map(|along| ShearedRay::new(origin, along));
            let met = |triangle: &[DVec3; 3]| by_f64.iter().any(|ray| ray.intersect(triangle.each_ref()).is_some());
            let met: u32 = triangles.iter().enumerate().map(|(lane, triangle)| u32::from(met(triangle)) << lane).sum();
            let plain = Both(&bounds, &corners, ray).answer(OneByOne);
            let vectors = answer(Both(&bounds, &corners, ray));
            assert_eq!(plain.0, vectors.0, "{round}");
            boxes_met += plain.0.count_ones();
            triangles_met += met.count_ones();
            for (sum, touched) in let_through.iter_mut().zip([plain.1, vectors.1]) {
                assert_eq!(met & !touched, 0, "{round}: {met:b} {touched:b}");
                assert_eq!(touched >> (WIDTH - 1), 0, "{round}");
                *sum += touched.count_ones();
            }
        }
        assert!(boxes_met > 1000 && triangles_met > 1000, "{boxes_met} {triangles_met}");
        // of triangles no larger than some ten times the blur, neighbours of the ray, too
        assert!(let_through.iter().all(|sum| *sum < 2 * triangles_met), "{let_through:?} {triangles_met}");
    }
}
