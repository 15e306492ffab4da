//! SIMD tests of sixteen boxes or sixteen triangles: with vector instructions if the processor has AVX-512, or AVX2 and FMA, else one by
//! one.
//!
//! Both tests are conservative filters in f32, which pass everything a ray hits and a little more: their last bits may differ between
//! instruction sets, and the candidates are decided in f64.

use pulp::{Scalar, Simd};

use super::tree_ray::{Bounds, BoxRay, Corners, Numbers, TriangleRay, WIDTH};

/// Largest error of a triangle's coordinate projected along a ray, in the coordinates of boxes: corners are within one of the ray's origin
/// along each axis, or two if it lies outside; rounding of both, of the direction (2^-24 each) and of values computed from them stays below
/// 1e-6.
const BLUR: f32 = 2e-6;

/// A computation that tests many boxes or triangles and is compiled for each instruction set.
pub trait Query: Sized {
    type Answer;

    /// Computes the answer with one instruction set; [`answer`] compiles it for each.
    fn answer<L: Lanes>(self, lanes: L) -> Self::Answer;
}

/// Computes the answer to a query with the best instruction set that the processor supports.
#[inline]
pub fn answer<Q: Query>(query: Q) -> Q::Answer {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(lanes) = pulp::x86::V4::try_new() {
            return lanes.vectorize(Compiled { query, lanes });
        }
        if let Some(lanes) = pulp::x86::V3::try_new() {
            return lanes.vectorize(Compiled { query, lanes });
        }
    }
    query.answer(Scalar)
}

/// A query with the instruction set that it is compiled for.
struct Compiled<Q, L> {
    query: Q,
    lanes: L,
}

impl<Q: Query, L: Lanes> pulp::NullaryFnOnce for Compiled<Q, L> {
    type Output = Q::Answer;

    #[inline(always)]
    fn call(self) -> Q::Answer {
        self.query.answer(self.lanes)
    }
}

/// An instruction set that handles several numbers at a time.
// all methods are inlined: a closure, or a method that takes one, would be compiled without the vector instructions
pub trait Lanes: Simd {
    /// Returns a bit mask with one bit per lane.
    fn bits(self, mask: Self::m32s) -> u32;

    /// Copies a ray for box tests to every lane.
    #[inline(always)]
    fn for_boxes(self, ray: &BoxRay) -> BoxRay<Self::f32s> {
        let [x, y, z] = ray.inverse;
        let [start_x, start_y, start_z] = ray.start;
        BoxRay {
            inverse: [self.splat_f32s(x), self.splat_f32s(y), self.splat_f32s(z)],
            start: [self.splat_f32s(start_x), self.splat_f32s(start_y), self.splat_f32s(start_z)],
            near: ray.near,
            far: ray.far,
        }
    }

    /// Copies a ray for triangle tests to every lane.
    #[inline(always)]
    fn for_triangles(self, ray: &TriangleRay) -> TriangleRay<Self::f32s> {
        let [x, y, z] = ray.origin;
        TriangleRay {
            axes: ray.axes,
            origin: [self.splat_f32s(x), self.splat_f32s(y), self.splat_f32s(z)],
            shear: [self.splat_f32s(ray.shear[0]), self.splat_f32s(ray.shear[1])],
        }
    }

    /// Computes the distances at which a ray enters boxes, and a bit mask of those that it hits before `reach`.
    #[inline(always)]
    fn enter(self, bounds: &Bounds, ray: &BoxRay<Self::f32s>, reach: f32) -> ([f32; WIDTH], u32) {
        let (mut entries, mut met) = ([0.0; WIDTH], 0);
        let reach = self.splat_f32s(reach);
        for (group, entries) in Self::as_mut_simd_f32s(&mut entries).0.iter_mut().enumerate() {
            let [x, y, z] = ray.near;
            *entries = self.max_f32s(
                self.max_f32s(crossing(self, &bounds[x], ray, 0, group), crossing(self, &bounds[y], ray, 1, group)),
                self.max_f32s(crossing(self, &bounds[z], ray, 2, group), self.splat_f32s(0.0)),
            );
            let [x, y, z] = ray.far;
            let exits = self.min_f32s(
                self.min_f32s(crossing(self, &bounds[x], ray, 0, group), crossing(self, &bounds[y], ray, 1, group)),
                self.min_f32s(crossing(self, &bounds[z], ray, 2, group), reach),
            );
            met |= self.bits(self.less_than_or_equal_f32s(*entries, exits)) << (group * Self::F32_LANES);
        }
        (entries, met)
    }

    /// Returns a bit mask of the triangles that the line of a ray hits, or passes so closely that rounding may hide the hit.
    #[inline(always)]
    fn touch(self, corners: &Corners, ray: &TriangleRay<Self::f32s>) -> u32 {
        let mut touched = 0;
        for group in 0..WIDTH / Self::F32_LANES {
            let [a, b, c] = [
                across(self, &corners[0], ray, group),
                across(self, &corners[1], ray, group),
                across(self, &corners[2], ray, group),
            ];
            let [u, v, w] = [side(self, c, b), side(self, a, c), side(self, b, a)];
            let least = self.min_f32s(self.min_f32s(u, v), w);
            let most = self.max_f32s(self.max_f32s(u, v), w);
            // how far rounding may have moved the product of two corners
            let size = self.add_f32s(self.add_f32s(size(self, a), size(self, b)), size(self, c));
            let blur = self.mul_add_e_f32s(size, self.splat_f32s(BLUR), self.splat_f32s(4.0 * BLUR * BLUR));
            let inside = self.or_m32s(
                self.less_than_or_equal_f32s(self.neg_f32s(blur), least),
                self.less_than_or_equal_f32s(most, blur),
            );
            touched |= self.bits(inside) << (group * Self::F32_LANES);
        }
        touched
    }

    /// Returns a bit mask of the lanes whose number differs from `number`.
    #[inline(always)]
    fn others(self, numbers: &Numbers, number: u32) -> u32 {
        let number = self.splat_u32s(number);
        let mut same = 0;
        for (group, numbers) in Self::as_simd_u32s(numbers).0.iter().enumerate() {
            same |= self.bits(self.equal_u32s(*numbers, number)) << (group * Self::U32_LANES);
        }
        !same
    }
}

/// Computes the distances at which a ray crosses one row of bounds, along `axis`.
#[inline(always)]
fn crossing<L: Lanes>(lanes: L, row: &[f32; WIDTH], ray: &BoxRay<L::f32s>, axis: usize, group: usize) -> L::f32s {
    lanes.mul_add_e_f32s(L::as_simd_f32s(row).0[group], ray.inverse[axis], ray.start[axis])
}

/// Projects one corner of each triangle along a ray.
#[inline(always)]
fn across<L: Lanes>(lanes: L, corner: &[[f32; WIDTH]; 3], ray: &TriangleRay<L::f32s>, group: usize) -> [L::f32s; 2] {
    let [x, y, z] = ray.axes;
    let x = lanes.sub_f32s(L::as_simd_f32s(&corner[x]).0[group], ray.origin[0]);
    let y = lanes.sub_f32s(L::as_simd_f32s(&corner[y]).0[group], ray.origin[1]);
    let z = lanes.sub_f32s(L::as_simd_f32s(&corner[z]).0[group], ray.origin[2]);
    [lanes.mul_add_e_f32s(ray.shear[0], z, x), lanes.mul_add_e_f32s(ray.shear[1], z, y)]
}

/// Computes twice the signed areas of the triangles between the ray and the sides from one corner to another.
#[inline(always)]
fn side<L: Lanes>(lanes: L, from: [L::f32s; 2], to: [L::f32s; 2]) -> L::f32s {
    lanes.mul_add_e_f32s(from[0], to[1], lanes.neg_f32s(lanes.mul_f32s(from[1], to[0])))
}

/// Returns an upper bound of the distances of corners from a ray.
#[inline(always)]
fn size<L: Lanes>(lanes: L, corner: [L::f32s; 2]) -> L::f32s {
    lanes.add_f32s(magnitude(lanes, corner[0]), magnitude(lanes, corner[1]))
}

/// Computes absolute values. Where a crate is compiled in many units, as for tests, `abs_f32s` of pulp is a call for AVX-512, which takes a
/// third of the time of tests with meshes.
#[inline(always)]
fn magnitude<L: Lanes>(lanes: L, value: L::f32s) -> L::f32s {
    lanes.max_f32s(value, lanes.sub_f32s(lanes.splat_f32s(0.0), value))
}

impl Lanes for Scalar {
    #[inline(always)]
    fn bits(self, mask: bool) -> u32 {
        mask.into()
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V3 {
    #[inline(always)]
    fn bits(self, mask: Self::m32s) -> u32 {
        self.avx._mm256_movemask_ps(pulp::cast(mask)) as u32
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V4 {
    #[inline(always)]
    fn bits(self, mask: Self::m32s) -> u32 {
        mask.0.into()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::triangle::ShearedRay;
    use crate::sampling::{Key, PathRandom};

    /// Checks that loops which the compiler vectorises itself are compiled for vectors, too: the feature x86-v3 of pulp.
    #[cfg(target_arch = "x86_64")]
    #[test]
    fn plain_loops_are_compiled_for_vectors() {
        let scalar = matches!(pulp::Arch::new(), pulp::Arch::Scalar);
        assert_eq!(scalar, pulp::x86::V3::try_new().is_none());
    }

    /// Query that tests one ray against boxes and triangles.
    #[derive(Clone, Copy)]
    struct Both<'a>(&'a Bounds, &'a Corners, BoxRay, TriangleRay);

    impl Query for Both<'_> {
        type Answer = (u32, u32);

        fn answer<L: Lanes>(self, lanes: L) -> Self::Answer {
            let (ray, line) = (lanes.for_boxes(&self.2), lanes.for_triangles(&self.3));
            (lanes.enter(self.0, &ray, 1.5).1, lanes.touch(self.1, &line))
        }
    }

    /// Query for the lanes whose number differs from a given one.
    #[derive(Clone, Copy)]
    struct Others<'a>(&'a Numbers, u32);

    impl Query for Others<'_> {
        type Answer = u32;

        fn answer<L: Lanes>(self, lanes: L) -> u32 {
            lanes.others(self.0, self.1)
        }
    }

    /// Returns the answers to a query by every instruction set that the processor supports, scalar arithmetic first.
    fn answers<Q: Query + Copy>(query: Q) -> Vec<Q::Answer> {
        let mut answers = vec![query.answer(Scalar)];
        #[cfg(target_arch = "x86_64")]
        {
            answers.extend(pulp::x86::V3::try_new().map(|lanes| lanes.vectorize(Compiled { query, lanes })));
            answers.extend(pulp::x86::V4::try_new().map(|lanes| lanes.vectorize(Compiled { query, lanes })));
        }
        answers.push(answer(query));
        answers
    }

    #[test]
    fn numbers_are_compared_lane_by_lane() {
        let numbers: Numbers = std::array::from_fn(|lane| lane as u32 % 5);
        for number in 0..6 {
            let others = (0..WIDTH).filter(|lane| numbers[*lane] != number).fold(0, |bits, lane| bits | 1 << lane);
            for found in answers(Others(&numbers, number)) {
                assert_eq!(found & ((1 << WIDTH) - 1), others);
            }
        }
    }

    /// Checks that vector and scalar arithmetic hit the same boxes, and that every triangle which a ray hits in f64 passes the filter, also
    /// along axes, at edges and corners, and for narrow triangles; few others pass, and no hit is missing.
    #[test]
    fn filters_let_through_what_is_met() {
        let mut random = PathRandom::new(Key::new(21));
        let (mut boxes_met, mut triangles_met, mut let_through) = (0, 0, Vec::new());
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
            let by_f64 = [direction, -direction].map(|along| ShearedRay::new(origin, along));
            let ray = BoxRay::new(origin.as_vec3a(), direction.as_vec3a());
            let line = TriangleRay::new(origin.as_vec3a(), &by_f64[0]);
            let met = |triangle: &[DVec3; 3]| by_f64.iter().any(|ray| ray.intersect(triangle.each_ref()).is_some());
            let met: u32 = triangles.iter().enumerate().map(|(lane, triangle)| u32::from(met(triangle)) << lane).sum();
            let found = answers(Both(&bounds, &corners, ray, line));
            boxes_met += found[0].0.count_ones();
            triangles_met += met.count_ones();
            let_through.resize(found.len(), 0);
            for (sum, (entered, touched)) in let_through.iter_mut().zip(&found) {
                assert_eq!(*entered, found[0].0, "{round}");
                assert_eq!(met & !touched, 0, "{round}: {met:b} {touched:b}");
                assert_eq!(touched >> (WIDTH - 1), 0, "{round}");
                *sum += touched.count_ones();
            }
        }
        assert!(boxes_met > 1000 && triangles_met > 1000, "{boxes_met} {triangles_met}");
        // also triangles no larger than some ten times the blur, near the ray
        assert!(let_through.iter().all(|sum| *sum < 2 * triangles_met), "{let_through:?} {triangles_met}");
    }
}
