//! Planar polygons with holes in space.

use glam::{DVec2, DVec3};

use super::covered::{Edge, contains};

/// A planar polygon with holes. Its outline runs counter-clockwise about its normal, and its holes clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    rings: Vec<Vec<DVec3>>,
    normal: DVec3,
    /// Distance of the plane from the origin along the normal, in m.
    offset: f64,
    /// Axis that is dropped for tests in two coordinates: the longest component of the normal.
    without: usize,
    edges: Vec<Edge>,
    low: DVec3,
    high: DVec3,
}

impl Polygon {
    /// Creates a polygon from rings (the outline, then holes) in m; `None` if its area is zero.
    pub fn new(rings: Vec<Vec<DVec3>>) -> Option<Self> {
        let normal = area_vector(&rings).try_normalize()?;
        Some(Self::with_normal(rings, normal))
    }

    /// Creates a polygon from rings in m with a given unit normal, so that planes along axes have it to the bit.
    pub fn with_normal(rings: Vec<Vec<DVec3>>, normal: DVec3) -> Self {
        // no negative zeros: the frame around a normal depends on their sign
        let normal = normal + DVec3::ZERO;
        let corners = || rings.iter().flatten().copied();
        let count = corners().count().max(1) as f64;
        let offset = match normal.abs().max_element() {
            // the plane's own coordinate, without rounding
            1.0 => corners().next().map_or(0.0, |corner| corner.dot(normal)),
            _ => corners().map(|corner| corner.dot(normal)).sum::<f64>() / count,
        };
        let without = (0..3).fold(0, |axis, other| if normal[other].abs() > normal[axis].abs() { other } else { axis });
        let edges = rings.iter().flat_map(|ring| ring_sides(ring)).map(|side| side.map(|p| flat(p, without))).collect();
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        Self { rings, normal, offset, without, edges, low, high }
    }

    /// Returns the unit normal.
    #[inline]
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Returns the lowest and highest corner of the bounding box in m.
    pub fn bounds(&self) -> [DVec3; 2] {
        [self.low, self.high]
    }

    /// Returns the outlines and the holes.
    pub fn rings(&self) -> &[Vec<DVec3>] {
        &self.rings
    }

    /// Returns the corners of the outline and the holes.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.rings.iter().flatten().copied()
    }

    /// Returns the directed sides of the outline and the holes.
    pub fn sides(&self) -> impl Iterator<Item = [DVec3; 2]> {
        self.rings.iter().flat_map(|ring| ring_sides(ring))
    }

    /// Returns the area in m2, holes excluded.
    pub fn area_m2(&self) -> f64 {
        area_vector(&self.rings).dot(self.normal)
    }

    /// Returns the height in m of a point above the plane, along the normal.
    #[inline]
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// Returns the height in m of the plane at a place seen from above.
    pub fn height_at(&self, place: DVec2) -> f64 {
        (self.offset - self.normal.truncate().dot(place)) / self.normal.z
    }

    /// True if a point of the plane is in the polygon.
    #[inline]
    pub fn contains(&self, point: DVec3) -> bool {
        contains(&self.edges, flat(point, self.without))
    }

    /// Projects a point onto the plane.
    #[inline]
    pub fn onto(&self, point: DVec3) -> DVec3 {
        let mut foot = point - self.normal * self.height(point);
        if self.normal[self.without].abs() == 1.0 {
            foot[self.without] = self.offset * self.normal[self.without];
        }
        foot
    }

    /// Returns the distance in m of a point from the nearest point of the polygon.
    pub fn distance(&self, point: DVec3) -> f64 {
        if self.contains(self.onto(point)) {
            return self.height(point).abs();
        }
        self.distance_to_sides(point)
    }

    /// Returns the distance in m of a point from the nearest side of the outline or a hole.
    pub fn distance_to_sides(&self, point: DVec3) -> f64 {
        let to_side = |[a, b]: [DVec3; 2]| {
            let along = b - a;
            let fraction = ((point - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            (point - a.lerp(b, fraction)).length()
        };
        self.sides().map(to_side).fold(f64::INFINITY, f64::min)
    }

    /// Returns a rectangle around the polygon in its plane: a corner, and two edges whose cross product is along the normal.
    pub fn rectangle(&self) -> [DVec3; 3] {
        let longest = self.sides().map(|[a, b]| b - a).fold(DVec3::ZERO, |longest, side| {
            if side.length_squared() > longest.length_squared() { side } else { longest }
        });
        let u = longest.normalize_or(self.normal.any_orthonormal_vector());
        let v = self.normal.cross(u);
        let span = |axis: DVec3| {
            let along = || self.corners().map(move |corner| corner.dot(axis));
            (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max))
        };
        let ((left, right), (low, high)) = (span(u), span(v));
        [u * left + v * low + self.normal * self.offset, u * (right - left), v * (high - low)]
    }

    /// Cuts the polygon by a level plane and returns the edges seen from above, with the normal on their left; empty for a level polygon.
    pub fn level_cut(&self, height: f64) -> Vec<Edge> {
        self.cut(DVec3::Z, height).map(|edge| edge.map(DVec3::truncate)).collect()
    }

    /// Cuts the polygon by the plane of the points whose product with the unit vector `across` is `offset` in m; yields nothing for a polygon
    /// parallel to it.
    pub fn cut(&self, across: DVec3, offset: f64) -> impl Iterator<Item = [DVec3; 2]> {
        let crossing = |[a, b]: [DVec3; 2]| {
            let (from, to) = (a.dot(across), b.dot(across));
            ((from > offset) != (to > offset)).then(|| a.lerp(b, (offset - from) / (to - from)))
        };
        let mut points: Vec<DVec3> = self.sides().filter_map(crossing).collect();
        let along = self.normal.cross(across);
        points.sort_by(|a, b| a.dot(along).total_cmp(&b.dot(along)));
        let pairs = points.len() / 2;
        (0..pairs).map(move |pair| [points[2 * pair], points[2 * pair + 1]])
    }
}

/// Returns the sum of the areas of rings, each times its normal.
fn area_vector(rings: &[Vec<DVec3>]) -> DVec3 {
    let of_ring = |ring: &Vec<DVec3>| -> DVec3 {
        let Some(first) = ring.first() else { return DVec3::ZERO };
        ring_sides(ring).map(|[a, b]| 0.5 * (a - *first).cross(b - *first)).sum()
    };
    rings.iter().map(of_ring).sum()
}

fn ring_sides(ring: &[DVec3]) -> impl Iterator<Item = [DVec3; 2]> {
    (0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()]])
}

#[inline]
fn flat(point: DVec3, without: usize) -> DVec2 {
    match without {
        0 => DVec2::new(point.y, point.z),
        1 => DVec2::new(point.z, point.x),
        _ => point.truncate(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks a sloped square with a hole: area, distances, the rectangle around it, a level cut that the hole divides.
    #[test]
    fn a_square_with_a_hole() {
        let at = |x: f64, y: f64| DVec3::new(x, y, 1.0 + 0.75 * y);
        let ring = |low: f64, high: f64| vec![at(low, low), at(high, low), at(high, high), at(low, high)];
        let mut hole = ring(0.5, 1.5);
        hole.reverse();
        let polygon = Polygon::new(vec![ring(0.0, 2.0), hole]).unwrap();
        assert!((polygon.area_m2() - 3.0 * 1.25).abs() < 1e-12);
        assert!(polygon.normal().z > 0.0 && polygon.contains(at(0.2, 1.0)) && !polygon.contains(at(1.0, 1.0)));
        assert!((polygon.distance(at(1.0, 1.0)) - 0.5).abs() < 1e-12, "to the side of the hole");
        let above = at(0.2, 1.0) + polygon.normal() * 0.3;
        assert!((polygon.distance(above) - 0.3).abs() < 1e-12 && (polygon.height(above) - 0.3).abs() < 1e-12);
        let [corner, u, v] = polygon.rectangle();
        assert!((u.cross(v) - polygon.normal() * 5.0).length() < 1e-12 && polygon.height(corner).abs() < 1e-12);
        let cut = polygon.level_cut(1.75);
        let places: Vec<f64> = cut.iter().flatten().map(|p| p.x).collect();
        assert_eq!(cut.len(), 2);
        assert!(places.iter().zip([2.0, 1.5, 0.5, 0.0]).all(|(x, expected)| (x - expected).abs() < 1e-12), "{cut:?}");
        assert!(cut.iter().flatten().all(|p| (p.y - 1.0).abs() < 1e-12));
    }
}
