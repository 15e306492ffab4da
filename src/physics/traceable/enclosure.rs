//! The faces of a room as rays meet them.

use glam::DVec3;

use crate::geometry::planar::Polygon;
use crate::scene::{Enclosure, Face};

/// Fraction of the room's scale within which points lie on a face.
const HAIR: f64 = 1e-9;

/// Faces of a room, compiled for the intersection with rays.
#[derive(Clone, Debug)]
pub struct TraceableEnclosure {
    shape: Shape,
    /// Faces in the order of their numbers.
    pub polygons: Vec<Polygon>,
    low: DVec3,
    high: DVec3,
    /// Distance in m within which points lie on a face.
    hair: f64,
    scale: f64,
    /// Numbers of the faces behind whose planes parts of the room lie: they can stand between two points of it.
    hiding: Vec<usize>,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    /// A box from the origin to this corner.
    Box(DVec3),
    /// Any other set of faces.
    Faces,
}

/// The face that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct FaceAhead {
    /// Distance along the ray in lengths of its direction.
    pub distance: f64,
    /// Number of the face.
    pub face: usize,
}

impl TraceableEnclosure {
    /// Compiles the faces of an enclosure.
    pub fn new(enclosure: &Enclosure) -> Self {
        let polygons: Vec<Polygon> = enclosure.faces().iter().map(|face| face.polygon.clone()).collect();
        let [low, high] = enclosure.bounds();
        let scale = enclosure.scale_m();
        let hair = HAIR * scale;
        let corners: Vec<DVec3> = polygons.iter().flat_map(Polygon::corners).collect();
        let hides = |face: &usize| corners.iter().any(|corner| polygons[*face].height(*corner) < -hair);
        let shape = enclosure.as_box().map_or(Shape::Faces, |shape| Shape::Box(shape.size));
        let hiding = (0..polygons.len()).filter(hides).collect();
        Self { shape, polygons, low, high, hair, scale, hiding }
    }

    /// Finds the face that a ray from inside meets. Where rounding lets it pass between two faces, the one that it passes closer to.
    #[inline]
    pub fn ahead(&self, origin: DVec3, direction: DVec3) -> FaceAhead {
        match self.shape {
            Shape::Box(size) => ahead_in_box(size, origin, direction),
            Shape::Faces => self.ahead_of_faces(origin, direction),
        }
    }

    fn ahead_of_faces(&self, origin: DVec3, direction: DVec3) -> FaceAhead {
        let candidates = || {
            self.polygons.iter().enumerate().filter_map(|(face, polygon)| {
                let toward = polygon.normal().dot(direction);
                let height = polygon.height(origin);
                // a point on a face may lie a hair behind its neighbour
                (toward < 0.0 && height > -self.hair).then(|| (face, polygon, (height / -toward).max(0.0)))
            })
        };
        let mut nearest = FaceAhead { distance: f64::INFINITY, face: 0 };
        for (face, polygon, distance) in candidates() {
            if distance < nearest.distance && polygon.contains(origin + direction * distance) {
                nearest = FaceAhead { distance, face };
            }
        }
        if nearest.distance.is_finite() {
            return nearest;
        }
        let beside = |(face, polygon, distance): (usize, &Polygon, f64)| {
            (polygon.distance(origin + direction * distance), FaceAhead { distance, face })
        };
        let closest = candidates().map(beside).min_by(|a, b| a.0.total_cmp(&b.0));
        closest.map_or(FaceAhead { distance: 0.0, face: 0 }, |(_, ahead)| ahead)
    }

    /// Returns the point of a face that a ray meets, exactly on the face's plane, so that the next ray starts there.
    #[inline]
    pub fn point_on(&self, ahead: FaceAhead, origin: DVec3, direction: DVec3) -> DVec3 {
        let mut position = origin + direction * ahead.distance;
        match self.shape {
            Shape::Box(size) => position[ahead.face / 2] = if ahead.face % 2 == 1 { size[ahead.face / 2] } else { 0.0 },
            Shape::Faces => position = self.polygons[ahead.face].onto(position),
        }
        self.clamp(position)
    }

    /// Returns the unit normal of a face, pointing into the room.
    #[inline]
    pub fn normal(&self, face: usize) -> DVec3 {
        self.polygons[face].normal()
    }

    /// True if no face stands between two points of the room.
    #[inline]
    pub fn is_clear(&self, a: DVec3, b: DVec3) -> bool {
        // a segment that leaves the room crosses a face from its front, so that its end is behind that face
        self.hiding.iter().all(|face| {
            let polygon = &self.polygons[*face];
            let (from, to) = (polygon.height(a), polygon.height(b));
            let is_crossed = from.max(to) > self.hair && from.min(to) < -self.hair;
            !is_crossed || !polygon.contains(a.lerp(b, from / (from - to)))
        })
    }

    /// Lists the faces that can stand between two points of the room.
    pub fn hiding(&self) -> impl Iterator<Item = &Polygon> {
        self.hiding.iter().map(|face| &self.polygons[*face])
    }

    /// True if no face stands between any two points of the room.
    pub fn is_convex(&self) -> bool {
        self.hiding.is_empty()
    }

    /// True if a point is in the room or on its faces.
    pub fn contains(&self, point: DVec3) -> bool {
        if point.cmplt(self.low).any() || point.cmpgt(self.high).any() {
            return false;
        }
        match self.shape {
            Shape::Box(_) => true,
            Shape::Faces => {
                let on = |polygon: &Polygon| polygon.height(point).abs() <= self.hair && polygon.contains(point);
                self.polygons.iter().any(on) || self.crossings(point, SKEW).count() % 2 == 1
            }
        }
    }

    /// True if a point lies outside of the room: of a box, by more than rounding.
    #[inline]
    pub fn is_outside(&self, point: DVec3) -> bool {
        match self.shape {
            Shape::Box(_) => (point.cmplt(self.low - self.hair) | point.cmpgt(self.high + self.hair)).any(),
            Shape::Faces => !self.contains(point),
        }
    }

    /// Returns the face and the point where a ray from outside comes into the room; `None` where it misses the room.
    pub fn entry(&self, origin: DVec3, direction: DVec3) -> Option<(usize, DVec3)> {
        let (distance, face) = self.crossings(origin, direction).min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((face, self.point_on(FaceAhead { distance, face }, origin, direction)))
    }

    /// Finds the faces that a ray crosses, from either side, each with its distance.
    fn crossings(&self, origin: DVec3, direction: DVec3) -> impl Iterator<Item = (f64, usize)> {
        self.polygons.iter().enumerate().filter_map(move |(face, polygon)| {
            let distance = -polygon.height(origin) / polygon.normal().dot(direction);
            let crosses = distance > 0.0 && distance.is_finite() && polygon.contains(origin + direction * distance);
            crosses.then_some((distance, face))
        })
    }

    /// Returns the point of the room's bounds that is nearest to a point.
    #[inline]
    pub fn clamp(&self, point: DVec3) -> DVec3 {
        point.clamp(self.low, self.high)
    }

    /// Returns the extent along x, y and z in m, from the origin, of a room that is a box; `None` for other shapes.
    pub fn as_box(&self) -> Option<DVec3> {
        match self.shape {
            Shape::Box(size) => Some(size),
            Shape::Faces => None,
        }
    }

    /// Returns the shortest edge of the bounds in m, a length scale of the room.
    pub fn shortest_edge_m(&self) -> f64 {
        self.extent().min_element()
    }

    /// Returns the extent of the bounds along x, y and z in m.
    pub fn extent(&self) -> DVec3 {
        self.high - self.low
    }

    /// Returns the lowest and highest corner of the bounds in m.
    pub fn bounds(&self) -> [DVec3; 2] {
        [self.low, self.high]
    }

    /// Returns the length in m to which rounding errors are related, [`Enclosure::scale_m`].
    pub fn scale_m(&self) -> f64 {
        self.scale
    }

    /// True if all points lie on one face, within `near` m.
    pub fn is_on_a_face(&self, points: &[DVec3], near: f64) -> bool {
        self.polygons.iter().any(|polygon| points.iter().all(|point| polygon.distance(*point) <= near))
    }
}

/// Direction that is unlikely to be parallel to an edge or a face of any room.
const SKEW: DVec3 = DVec3::new(0.312_906_4, 0.518_273_1, 0.795_914_2);

/// Finds the face that a ray from inside meets in a box from the origin to `size`.
#[inline]
fn ahead_in_box(size: DVec3, origin: DVec3, direction: DVec3) -> FaceAhead {
    let (mut distance, mut axis) = (f64::INFINITY, Face::Floor as usize / 2);
    for k in 0..3 {
        // without branches: which wall a ray heads for is as random as the ray
        let wall = if direction[k] > 0.0 { size[k] } else { 0.0 };
        let to_wall = (wall - origin[k]) / direction[k];
        let nearer = direction[k] != 0.0 && to_wall < distance;
        (distance, axis) = if nearer { (to_wall, k) } else { (distance, axis) };
    }
    FaceAhead { distance: distance.max(0.0), face: 2 * axis + usize::from(direction[axis] > 0.0) }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::sampling::{Key, PathRandom, warp};
    use crate::scene::prism::{CeilingPlane, KindSurfaces};

    /// A U-shaped room below a slope, with a core.
    fn room() -> TraceableEnclosure {
        let ring = |corners: &[[f64; 2]]| corners.iter().map(|corner| DVec2::from(*corner)).collect::<Vec<_>>();
        let outline =
            ring(&[[-1.0, 0.0], [5.0, 0.0], [5.0, 4.0], [3.5, 4.0], [3.5, 1.5], [1.0, 2.0], [1.0, 4.0], [-1.0, 4.0]]);
        let core = ring(&[[4.0, 1.0], [4.3, 1.2], [4.1, 1.6]]);
        let slope = CeilingPlane { height_m: 2.0, rise: DVec2::new(0.2, 0.1) };
        let surfaces = KindSurfaces { floor: None, walls: None, ceiling: None };
        TraceableEnclosure::new(&Enclosure::prism(&[outline, core], 1e-9, &[slope], surfaces).unwrap())
    }

    /// Rays end on the nearest face that they cross, on its front; points before it are visible, other parts of the room are not; and
    /// rays that start on faces, edges and corners do not leave the room.
    #[test]
    fn rays_end_on_the_nearest_face() {
        let room = room();
        assert!(!room.is_convex() && room.as_box().is_none());
        let [low, high] = room.bounds();
        let mut random = PathRandom::new(Key::new(5));
        let mut uniform = move || random.uniform();
        let (mut inside, mut hidden) = (0, 0);
        for _ in 0..20_000 {
            let mut point = || low + (high - low) * DVec3::new(uniform(), uniform(), uniform());
            let (origin, other) = (point(), point());
            let direction = (other - origin).normalize();
            if !room.contains(origin) {
                // a ray from outside enters the room through the back of a face
                if let Some((face, entry)) = room.entry(origin, direction) {
                    assert!(room.normal(face).dot(direction) > 0.0 && room.contains(entry));
                }
                continue;
            }
            inside += 1;
            let ahead = room.ahead(origin, direction);
            let position = room.point_on(ahead, origin, direction);
            assert!(room.normal(ahead.face).dot(direction) < 0.0);
            assert!((position - origin - direction * ahead.distance).length() < 1e-9);
            let place = format!("{origin} {position} {direction} {ahead:?}");
            assert!(room.contains(origin.lerp(position, 0.999)), "{place}");
            assert!(!room.contains(position - room.normal(ahead.face) * 1e-6), "{place}");
            let is_before = (other - origin).length() < ahead.distance;
            if room.contains(other) {
                assert_eq!(room.is_clear(origin, other), is_before);
                hidden += usize::from(!is_before);
            }
            // on from there, in any direction
            let onward = warp::around(room.normal(ahead.face), warp::cosine_hemisphere([uniform(), uniform()]));
            let next = room.point_on(room.ahead(position, onward), position, onward);
            assert!(room.contains(position.lerp(next, 0.5)), "{position} {next}");
        }
        assert!(inside > 5000 && hidden > 500, "{inside} {hidden}");
        let corners: Vec<DVec3> = room.polygons.iter().flat_map(Polygon::corners).collect();
        for (from, to) in corners.iter().flat_map(|from| corners.iter().map(move |to| (*from, *to))) {
            if (to - from).length() > 1e-9 {
                let direction = (to - from).normalize();
                let end = room.point_on(room.ahead(from, direction), from, direction);
                assert!(end.is_finite() && end.cmpge(low - 1e-9).all() && end.cmple(high + 1e-9).all());
            }
        }
    }
}
