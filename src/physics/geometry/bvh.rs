//! Bounding volume hierarchy over triangles: nearest hits, occlusion and distances.
//!
//! A tree in f32 ([`WideTree`]) is a conservative filter; every hit is decided in f64 by the watertight test of [`ShearedRay`].

use glam::{DVec3, Vec3A};
use rayon::iter::IndexedParallelIterator;

use super::lanes::{Lanes, Query, answer};
use super::tree_ray::{BoxRay, TriangleRay};
use super::triangle::{ShearedRay, distance_above, reflected, unit_normal};
use super::wide_tree::{Aabb, NONE, WideTree};

/// Padding of the boxes on every side, as a fraction of the scene's diagonal: more than the rounding of coordinates, ray origins (within a
/// diagonal of the middle, see [`TriangleBvh::skipped`]), directions and slab distances to f32 (each below 2^-23 of the diagonal).
const PADDING: f64 = 1e-6;

/// A set of triangles that answers nearest-hit, occlusion and distance queries.
#[derive(Clone)]
pub struct TriangleBvh {
    tree: WideTree,
    /// Corners, shared between triangles: half the memory of triangles with corners of their own, and memory decides the speed of rays in
    /// large meshes.
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    centre: DVec3,
    /// Scale to the tree's f32 coordinates, (p - centre) * scale, in which the scene has a diagonal of one.
    scale: f64,
    /// Diagonal of the scene in m, the inverse of `scale`; stored because a ray would have to wait for the division.
    diagonal: f64,
}

/// Nearest triangle along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Index of the triangle in the list that the set was built from.
    pub triangle: u32,
    /// Distance from the ray's origin in m, > 0.
    pub distance: f64,
    /// Indices of the triangle's corners.
    corners: [u32; 3],
}

impl std::fmt::Debug for TriangleBvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TriangleBvh").field("triangles", &self.triangles.len()).finish_non_exhaustive()
    }
}

impl TriangleBvh {
    /// Builds the set from `triangles` given by finite corners, at least one.
    pub fn new(triangles: &[[DVec3; 3]]) -> Self {
        let corners = (0..triangles.len() as u32).map(|number| [0, 1, 2].map(|corner| 3 * number + corner));
        Self::of_mesh(triangles.iter().flatten().copied().collect(), corners.collect())
    }

    /// Builds the set from a mesh: `positions` are finite; `triangles` are indices into them, at least one triangle.
    pub fn of_mesh(positions: Vec<DVec3>, mut triangles: Vec<[u32; 3]>) -> Self {
        let corners = || triangles.iter().flatten().map(|corner| positions[*corner as usize]);
        let low = corners().fold(DVec3::INFINITY, |low, p| low.min(p));
        let high = corners().fold(DVec3::NEG_INFINITY, |high, p| high.max(p));
        let centre = 0.5 * (low + high);
        let diagonal = (high - low).length();
        let scale = if diagonal > 0.0 { 1.0 / diagonal } else { 1.0 };
        let in_tree: Vec<Vec3A> = positions.iter().map(|point| ((*point - centre) * scale).as_vec3a()).collect();
        let padding = Vec3A::splat(PADDING as f32);
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|triangle| {
                let bounds = Aabb::from_points(&triangle.map(|corner| in_tree[corner as usize]));
                Aabb::new(bounds.min - padding, bounds.max + padding)
            })
            .collect();
        let mut tree = WideTree::new(&boxes, &triangles, &in_tree);
        // corners of a leaf lie side by side, where a ray that asks for one finds the others
        let mut numbers = vec![u32::MAX; positions.len()];
        let mut ordered = Vec::with_capacity(positions.len());
        tree.for_each_corner(|corner| {
            let number = &mut numbers[*corner as usize];
            if *number == u32::MAX {
                *number = ordered.len() as u32;
                ordered.push(positions[*corner as usize]);
            }
            *corner = *number;
        });
        triangles.iter_mut().flatten().for_each(|corner| *corner = numbers[*corner as usize]);
        Self { tree, positions: ordered, triangles, centre, scale, diagonal: scale.recip() }
    }

    /// Returns the number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// True if the set has no triangles, which cannot occur.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Returns the unit normal, by winding, of a triangle that was hit, from the corners kept in the hit.
    #[inline(always)]
    pub fn normal(&self, hit: &TriangleHit) -> DVec3 {
        unit_normal(self.corners(hit.corners))
    }

    /// Counts the ray segments of a path that starts at `origin` along the unit vector `direction` and is reflected by every triangle
    /// marked in `is_mirror`; the path ends at any other triangle, where nothing is hit, or after `most` segments.
    pub fn mirrored(&self, origin: DVec3, direction: DVec3, is_mirror: &[bool], most: u32) -> u32 {
        answer(Mirrored { set: self, origin, direction, is_mirror, most })
    }

    #[inline(always)]
    fn corners(&self, [a, b, c]: [u32; 3]) -> [&DVec3; 3] {
        [&self.positions[a as usize], &self.positions[b as usize], &self.positions[c as usize]]
    }

    /// Finds the nearest triangle at a positive distance along the unit vector `direction`, ignoring `skip` (the planar triangle that the
    /// ray has just left); among equal distances the triangle with the lowest index.
    pub fn nearest(&self, origin: DVec3, direction: DVec3, skip: Option<u32>) -> Option<TriangleHit> {
        answer(Nearest { set: self, origin, direction, skip })
    }

    /// Finds the nearest triangle as [`Self::nearest`] does, with one instruction set.
    #[inline(always)]
    fn nearest_by<L: Lanes>(
        &self,
        lanes: L,
        origin: DVec3,
        direction: DVec3,
        skip: Option<u32>,
    ) -> Option<TriangleHit> {
        let sheared = ShearedRay::new(origin, direction);
        let skipped = self.skipped(origin, direction);
        let start = self.to_f32(origin + skipped * direction);
        let (ray, line) = (BoxRay::new(start, direction.as_vec3a()), TriangleRay::new(start, &sheared));
        let mut nearest: Option<TriangleHit> = None;
        let mut reach = f32::INFINITY;
        self.tree.follow(
            lanes,
            (&ray, &line),
            skip.unwrap_or(NONE),
            reach,
            #[inline(always)]
            |number, corners| {
                let Some(distance) = sheared.intersect(self.corners(corners)) else { return reach };
                let closer = match &nearest {
                    None => true,
                    Some(hit) => distance < hit.distance || (distance == hit.distance && number < hit.triangle),
                };
                if closer {
                    nearest = Some(TriangleHit { triangle: number, distance, corners });
                    // a little beyond the hit, so that rounding cannot cull a nearer one
                    let on_ray = ((distance - skipped) * self.scale) as f32;
                    reach = on_ray * (1.0 + 4.0 * f32::EPSILON) + f32::MIN_POSITIVE;
                }
                reach
            },
        );
        nearest
    }

    /// True if a triangle lies at a positive distance below `reach` along the unit vector `direction`.
    pub fn any_within(&self, origin: DVec3, direction: DVec3, reach: f64) -> bool {
        answer(AnyWithin { set: self, origin, direction, reach })
    }

    /// Calls `show` with the indices of all triangles that may touch the axis-aligned box from `low` to `high`, and of some beside it.
    pub fn around(&self, low: DVec3, high: DVec3, show: impl FnMut(u32)) {
        let padding = Vec3A::splat(PADDING as f32);
        self.tree.around(&Aabb::new(self.to_f32(low) - padding, self.to_f32(high) + padding), show);
    }

    /// Returns groups of a few neighbouring triangles, by their indices: each triangle is in one.
    pub fn groups(&self) -> impl IndexedParallelIterator<Item = Vec<u32>> {
        self.tree.leaves()
    }

    /// Converts a point to the f32 coordinates of the tree.
    #[inline(always)]
    fn to_f32(&self, point: DVec3) -> Vec3A {
        ((point - self.centre) * self.scale).as_vec3a()
    }

    /// Returns the distance in metres along a ray up to which nothing can be hit: the ray enters the tree one diagonal before the middle,
    /// since f32 would move an origin that is many diagonals away by more than boxes are padded.
    #[inline(always)]
    fn skipped(&self, origin: DVec3, direction: DVec3) -> f64 {
        ((self.centre - origin).dot(direction) - self.diagonal).max(0.0)
    }

    /// Returns the distance in metres from a point to the nearest point of the triangles above `height` (z), if it is below `reach`; else
    /// `None`.
    pub fn distance_above(&self, point: DVec3, height: f64, reach: f64) -> Option<f64> {
        // a little wider, so that rounding cannot cull a triangle at the end
        let padding = Vec3A::splat(2.0 * PADDING as f32);
        let around = Aabb::new(self.to_f32(point - reach) - padding, self.to_f32(point + reach) + padding);
        let mut nearest = reach;
        self.tree.around(&around, |number| {
            nearest = nearest.min(
                distance_above(&self.corners(self.triangles[number as usize]).map(|corner| *corner), point, height)
                    .unwrap_or(nearest),
            );
        });
        (nearest < reach).then_some(nearest)
    }
}

/// Query for the nearest triangle along a ray.
struct Nearest<'a> {
    set: &'a TriangleBvh,
    origin: DVec3,
    direction: DVec3,
    skip: Option<u32>,
}

impl Query for Nearest<'_> {
    type Answer = Option<TriangleHit>;

    #[inline(always)]
    fn answer<L: Lanes>(self, lanes: L) -> Option<TriangleHit> {
        self.set.nearest_by(lanes, self.origin, self.direction, self.skip)
    }
}

/// Query for the number of ray segments of a path along mirrors.
struct Mirrored<'a> {
    set: &'a TriangleBvh,
    origin: DVec3,
    direction: DVec3,
    is_mirror: &'a [bool],
    most: u32,
}

impl Query for Mirrored<'_> {
    type Answer = u32;

    #[inline(always)]
    fn answer<L: Lanes>(self, lanes: L) -> u32 {
        let Self { set, mut origin, mut direction, is_mirror, most } = self;
        let mut from = None;
        let mut rays = 1;
        while rays < most {
            let Some(hit) = set.nearest_by(lanes, origin, direction, from) else { return rays };
            if !is_mirror[hit.triangle as usize] {
                return rays;
            }
            origin += direction * hit.distance;
            direction = reflected(direction, set.corners(hit.corners));
            from = Some(hit.triangle);
            rays += 1;
        }
        rays
    }
}

/// Query for occlusion: any triangle along a ray within a distance.
struct AnyWithin<'a> {
    set: &'a TriangleBvh,
    origin: DVec3,
    direction: DVec3,
    reach: f64,
}

impl Query for AnyWithin<'_> {
    type Answer = bool;

    #[inline(always)]
    fn answer<L: Lanes>(self, lanes: L) -> bool {
        let Self { set, origin, direction, reach } = self;
        let skipped = set.skipped(origin, direction);
        if reach < skipped {
            return false;
        }
        let sheared = ShearedRay::new(origin, direction);
        // a little longer, so that rounding cannot cull a triangle at the end
        let on_ray = ((reach - skipped) * set.scale) as f32 * (1.0 + 4.0 * f32::EPSILON) + 2.0 * PADDING as f32;
        let start = set.to_f32(origin + skipped * direction);
        let (ray, line) = (BoxRay::new(start, direction.as_vec3a()), TriangleRay::new(start, &sheared));
        let mut any = false;
        set.tree.follow(
            lanes,
            (&ray, &line),
            NONE,
            on_ray,
            #[inline(always)]
            |_, corners| {
                any |= sheared.intersect(set.corners(corners)).is_some_and(|distance| distance < reach);
                // nothing is nearer than what lies behind
                if any { f32::NEG_INFINITY } else { on_ray }
            },
        );
        any
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom, warp};

    /// Returns a closed box of 12 triangles around `centre`.
    fn closed_box(centre: DVec3, half: f64) -> Vec<[DVec3; 3]> {
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let corner = |u: f64, v: f64| {
                    let mut p = DVec3::ZERO;
                    p[axis] = side * half;
                    p[(axis + 1) % 3] = u * half;
                    p[(axis + 2) % 3] = v * half;
                    centre + p
                };
                triangles.push([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)]);
                triangles.push([corner(-1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
            }
        }
        triangles
    }

    /// Checks that rays at corners and edge points of a closed box never leak, near the origin and far from it.
    #[test]
    fn watertight_at_corners_and_edges() {
        for centre in [DVec3::ZERO, DVec3::new(1000.0, 2000.0, 50.0)] {
            let triangles = closed_box(centre, 1.5);
            let bvh = TriangleBvh::new(&triangles);
            let mut random = PathRandom::new(Key::new(5));
            for triangle in &triangles {
                for k in 0..3 {
                    for _ in 0..300 {
                        let fraction = if random.uniform() < 0.3 { 0.0 } else { random.uniform() };
                        let target = triangle[k].lerp(triangle[(k + 1) % 3], fraction);
                        let origin = centre + (warp::cosine_hemisphere(random.uniform2()) - DVec3::Z * 0.5) * 0.9;
                        let direction = (target - origin).normalize();
                        let hit = bvh.nearest(origin, direction, None).expect("leak");
                        assert!((origin + direction * hit.distance - target).length() < 1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn mirrored_paths_end_where_a_mirror_does() {
        let bvh = TriangleBvh::new(&closed_box(DVec3::ZERO, 1.0));
        // no edge is near this path
        let (origin, direction) = (DVec3::new(0.113, 0.227, -0.371), DVec3::new(0.31, 0.53, 0.677).normalize());
        let all = vec![true; bvh.len()];
        assert_eq!(bvh.mirrored(origin, direction, &all, 40), 40);
        assert_eq!(bvh.mirrored(origin, direction, &vec![false; bvh.len()], 40), 1);
        // the path by hand to the third triangle that it meets, where it ends if that alone is no mirror
        let (mut at, mut toward, mut from) = (origin, direction, None);
        let mut met = Vec::new();
        for _ in 0..3 {
            let hit = bvh.nearest(at, toward, from).unwrap();
            at += toward * hit.distance;
            toward = toward.reflect(bvh.normal(&hit));
            from = Some(hit.triangle);
            met.push(hit.triangle);
        }
        let but_third: Vec<bool> = (0..bvh.len()).map(|triangle| triangle as u32 != met[2]).collect();
        assert!(met[0] != met[2] && met[1] != met[2]);
        assert_eq!(bvh.mirrored(origin, direction, &but_third, 40), 3);
    }

    #[test]
    fn axis_parallel_rays_with_negative_zero_hit() {
        let bvh = TriangleBvh::new(&closed_box(DVec3::ZERO, 1.0));
        for direction in [DVec3::X, DVec3::Y, DVec3::Z] {
            for direction in [direction, -direction] {
                let hit = bvh.nearest(DVec3::new(0.1, 0.2, 0.3), direction, None).unwrap();
                assert!(hit.distance > 0.6 && hit.distance < 1.4);
            }
        }
    }

    /// Checks that distances from 1e-9 m on count, and that the triangle just left can be skipped.
    #[test]
    fn near_hits_and_skips() {
        let bvh = TriangleBvh::new(&closed_box(DVec3::ZERO, 1.0));
        let near = bvh.nearest(DVec3::new(0.1, 0.2, 1.0 - 1e-9), DVec3::Z, None).unwrap();
        assert!((near.distance - 1e-9).abs() < 1e-15);
        let far = bvh.nearest(DVec3::new(0.1, 0.2, 1.0 - 1e-9), DVec3::Z, Some(near.triangle));
        assert_eq!(far, None);
    }

    #[test]
    fn distances_agree_with_brute_force() {
        let mut random = PathRandom::new(Key::new(10));
        let mut point = || DVec3::new(random.uniform(), random.uniform(), random.uniform());
        let triangles: Vec<_> = (0..500)
            .map(|_| {
                let p = point() * 4.0 + 100.0;
                [p, p + point() * 0.3, p + point() * 0.1]
            })
            .collect();
        let bvh = TriangleBvh::new(&triangles);
        let mut found = 0;
        for _ in 0..2000 {
            let (from, height, reach) = (point() * 5.0 + 99.5, 102.0, 0.02 + 0.3 * point().x);
            let distances = triangles.iter().filter_map(|triangle| distance_above(triangle, from, height));
            let brute = distances.reduce(f64::min).filter(|distance| *distance < reach);
            assert_eq!(bvh.distance_above(from, height, reach), brute);
            found += usize::from(brute.is_some());
        }
        assert!((200..1800).contains(&found), "{found}");
        // one triangle alone is a tree of one leaf
        let one = TriangleBvh::new(&triangles[..1]);
        assert!(one.distance_above(triangles[0][0] + DVec3::Z * 1e-3, 0.0, 1.0).is_some());
    }

    #[test]
    fn agrees_with_brute_force() {
        let mut random = PathRandom::new(Key::new(9));
        let mut point = || DVec3::new(random.uniform(), random.uniform(), random.uniform());
        let triangles: Vec<_> = (0..500)
            .map(|_| {
                let p = point() * 4.0;
                [p, p + point(), p + point() * 0.1]
            })
            .collect();
        let bvh = TriangleBvh::new(&triangles);
        for _ in 0..2000 {
            let (origin, direction) = (point() * 4.0, (point() - 0.5).normalize());
            let ray = ShearedRay::new(origin, direction);
            let brute = triangles.iter().filter_map(|t| ray.intersect(t.each_ref())).fold(f64::INFINITY, f64::min);
            let hit = bvh.nearest(origin, direction, None).map_or(f64::INFINITY, |hit| hit.distance);
            assert_eq!(brute, hit);
            for reach in [0.5, 1.0, 3.0] {
                assert_eq!(bvh.any_within(origin, direction, reach), brute < reach);
            }
        }
    }
}
