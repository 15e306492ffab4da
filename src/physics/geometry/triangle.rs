//! Triangles in f64: watertight intersection with rays, distance from points.

use glam::DVec3;

/// A ray prepared for many triangles: the shear that takes its direction to +z (Woop, Benthin and Wald 2013).
// numbers of axes index arrays: a branch on the axis would be guessed wrong for every other ray
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    /// Axis permutation, the dominant axis of the direction last.
    axes: [usize; 3],
    /// Coordinates of the origin along these axes.
    origin: [f64; 3],
    shear: [f64; 3],
}

impl ShearedRay {
    /// Prepares a ray; `direction` need not be normalised, but not zero; distances are in units of its length.
    #[inline(always)]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let direction = direction.to_array();
        let [x, y, z] = [direction[0].abs(), direction[1].abs(), direction[2].abs()];
        let last = if x > y && x > z { 0 } else { 2 - usize::from(y > z) };
        let turned = usize::from(direction[last] < 0.0);
        let [x, y, z] = [AFTER[last][turned], AFTER[last][1 - turned], last];
        let origin = origin.to_array();
        Self {
            axes: [x, y, z],
            origin: [origin[x], origin[y], origin[z]],
            shear: [direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]],
        }
    }

    /// Returns the axis permutation, the axis of the direction's largest component last.
    #[inline(always)]
    pub fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// Returns the shear: the amounts subtracted from coordinates along the first two axes for each metre along the last.
    #[inline(always)]
    pub fn shear(&self) -> [f64; 2] {
        [self.shear[0], self.shear[1]]
    }

    /// Computes the distance to the triangle, hit from either side, if it is positive.
    ///
    /// Edges and corners belong to every triangle that shares them, so that no ray slips through between neighbours.
    // always: the traversal is compiled for vectors, and what it calls is not
    #[inline(always)]
    pub fn intersect(&self, [a, b, c]: [&DVec3; 3]) -> Option<f64> {
        let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (self.across(a), self.across(b), self.across(c));
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let distance = self.shear[2] * (u * az + v * bz + w * cz) / determinant;
        (distance > 0.0).then_some(distance)
    }

    /// Transforms a corner to the axes of the ray: two coordinates sheared across it, and one along the last axis.
    #[inline(always)]
    fn across(&self, corner: &DVec3) -> [f64; 3] {
        let [x, y, z] = self.axes;
        let corner: &[f64; 3] = corner.as_ref();
        let along = corner[z] - self.origin[2];
        [corner[x] - self.origin[0] - self.shear[0] * along, corner[y] - self.origin[1] - self.shear[1] * along, along]
    }
}

/// Pairs of axes that follow each axis cyclically.
const AFTER: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// Returns the unit normal of a triangle by its winding; +z for a triangle without area.
#[inline(always)]
pub fn unit_normal([a, b, c]: [&DVec3; 3]) -> DVec3 {
    (*b - *a).cross(*c - *a).try_normalize().unwrap_or(DVec3::Z)
}

/// Reflects a direction by a triangle; returns it unchanged for a triangle without area.
// the normal is not made a unit vector: the next ray waits for this, and a square root would double what it takes
#[inline(always)]
pub fn reflected(direction: DVec3, [a, b, c]: [&DVec3; 3]) -> DVec3 {
    let normal = (*b - *a).cross(*c - *a);
    let squared = normal.length_squared();
    if squared > 0.0 { direction - normal * (2.0 * direction.dot(normal) / squared) } else { direction }
}

/// Computes the distance in metres from a point to the nearest point of a triangle's part above `height` (z); `None` if no part is above. A
/// triangle may be as narrow as a line or a point.
///
/// ```
/// use glam::DVec3;
/// use skyduct_physics::geometry::triangle::distance_above;
///
/// let upright = [DVec3::ZERO, DVec3::X, DVec3::Z];
/// let point = DVec3::new(0.2, 0.3, 0.2);
/// assert!((distance_above(&upright, point, 0.0).unwrap() - 0.3).abs() < 1e-15);
/// assert!((distance_above(&upright, point, 0.6).unwrap() - 0.3f64.hypot(0.4)).abs() < 1e-15);
/// assert_eq!(distance_above(&upright, point, 1.0), None);
/// ```
pub fn distance_above(corners: &[DVec3; 3], point: DVec3, height: f64) -> Option<f64> {
    // the corners of the part above, in order: four at most
    let mut part = Vec::with_capacity(4);
    for (index, corner) in corners.iter().enumerate() {
        let next = corners[(index + 1) % 3];
        if corner.z > height {
            part.push(*corner);
        }
        if (corner.z > height) != (next.z > height) {
            part.push(corner.lerp(next, (height - corner.z) / (next.z - corner.z)));
        }
    }
    let triangles = (2..part.len()).map(|last| distance(&[part[0], part[last - 1], part[last]], point));
    triangles.reduce(f64::min)
}

/// Computes the distance in metres from a point to a triangle.
fn distance(corners: &[DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = *corners;
    let across = (b - a).cross(c - a);
    let sides = [(a, b), (b, c), (c, a)];
    let over = |(from, to): (DVec3, DVec3)| (to - from).cross(point - from).dot(across) >= 0.0;
    if across.length_squared() > 0.0 && sides.into_iter().all(over) {
        return ((point - a).dot(across) / across.length()).abs();
    }
    sides.map(|(from, to)| distance_to_line(from, to, point)).into_iter().fold(f64::INFINITY, f64::min)
}

/// Computes the distance in metres from a point to the line segment between `from` and `to`.
fn distance_to_line(from: DVec3, to: DVec3, point: DVec3) -> f64 {
    let along = to - from;
    let squared = along.length_squared();
    let fraction = if squared > 0.0 { ((point - from).dot(along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (from + along * fraction - point).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};

    /// Compares the distance to the part above a height with a fine lattice of points of the triangle, which is never nearer, and farther
    /// by half a step at most.
    #[test]
    fn distances_are_those_of_the_nearest_point() {
        let mut random = PathRandom::new(Key::new(11));
        let mut point = || DVec3::new(random.uniform(), random.uniform(), random.uniform());
        let steps = 150;
        for _ in 0..300 {
            let corners = [point(), point(), point()];
            let (from, height) = (point() * 2.0 - 0.5, point().x);
            let [a, b, c] = corners;
            let lattice = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| (i, j)));
            let places = lattice.map(|(i, j)| {
                let fraction = |k: i32| f64::from(k) / f64::from(steps);
                a + (b - a) * fraction(i) + (c - a) * fraction(j)
            });
            let near = places.filter(|place| place.z > height).map(|place| (place - from).length()).reduce(f64::min);
            let step = (b - a).length().max((c - a).length()).max((c - b).length()) / f64::from(steps);
            match (distance_above(&corners, from, height), near) {
                (Some(exact), Some(near)) => assert!(exact <= near + 1e-12, "{exact} {near}"),
                (exact, near) => assert!(near.is_none(), "{exact:?} {near:?}"),
            }
            // the lattice of the whole triangle has no gaps at an edge of its own
            if let (Some(exact), Some(near)) = (distance_above(&corners, from, -1.0), near)
                && corners.iter().all(|corner| corner.z > height)
            {
                assert!(near <= exact + step, "{exact} {near} {step}");
            }
        }
    }

    #[test]
    fn reflection_is_that_by_the_unit_normal() {
        let mut random = PathRandom::new(Key::new(12));
        let mut point = || DVec3::new(random.uniform(), random.uniform(), random.uniform()) - 0.5;
        for _ in 0..300 {
            let (corners, direction) = ([point(), point(), point()], point().normalize());
            let by_normal = direction.reflect(unit_normal(corners.each_ref()));
            // both have the same normal before it is made a unit vector: some ten roundings differ
            assert!((reflected(direction, corners.each_ref()) - by_normal).length() < 16.0 * f64::EPSILON);
        }
        assert_eq!(reflected(DVec3::X, [&DVec3::Y; 3]), DVec3::X);
    }

    #[test]
    fn slivers_have_distances() {
        let line = [DVec3::ZERO, DVec3::X, DVec3::X * 0.5];
        assert!((distance_above(&line, DVec3::new(0.5, 2.0, 0.0), -1.0).unwrap() - 2.0).abs() < 1e-15);
        assert!((distance_above(&[DVec3::Z; 3], DVec3::ZERO, 0.0).unwrap() - 1.0).abs() < 1e-15);
    }
}
