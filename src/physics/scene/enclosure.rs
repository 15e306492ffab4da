//! The surface around a room: named planar faces, seen from inside.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::geometry::covered::Edge;
use crate::geometry::planar::Polygon;
use crate::optics::Surface;

/// Share of the extent within which points coincide, and corners of a face lie in its plane.
const COINCIDING: f64 = 1e-9;

/// The faces that close a room. A box is one constructor of it, [`Enclosure::cuboid`]; whatever needs a box asks
/// [`Enclosure::as_box`].
#[derive(Clone, Debug)]
pub struct Enclosure {
    faces: Vec<EnclosureFace>,
    low: DVec3,
    high: DVec3,
    is_box: bool,
}

/// A planar face of an enclosure.
#[derive(Clone, Debug)]
pub struct EnclosureFace {
    /// Name, unique in the enclosure: `floor`, `ceiling`, `wall_0`.
    pub name: String,
    /// What it is to a designer.
    pub kind: FaceKind,
    /// Its outline with holes, counter-clockwise seen from inside the room, in m.
    pub polygon: Polygon,
    /// Optics; `None` is open: light leaves, a camera may look in.
    pub surface: Option<Surface>,
}

/// The kinds of faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceKind {
    /// What one stands on.
    Floor,
    /// What stands around.
    Wall,
    /// What is overhead.
    Ceiling,
}

/// A plane of a ceiling over a plan: `height_m` at the origin of the plan, and the rise in m per m along x and y.
#[derive(Clone, Copy, Debug)]
pub struct CeilingPlane {
    /// Height at (0, 0) in m.
    pub height_m: f64,
    /// Rise per m; zero where the ceiling is flat.
    pub rise: DVec2,
}

/// Surfaces of a room by the kinds of its faces.
#[derive(Clone, Copy, Debug)]
pub struct KindSurfaces {
    /// Of the floor.
    pub floor: Option<Surface>,
    /// Of all walls.
    pub walls: Option<Surface>,
    /// Of the ceiling.
    pub ceiling: Option<Surface>,
}

/// The faces of a room in box form; the discriminants are their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Face {
    /// The face x = 0.
    West = 0,
    /// The face x = size.x.
    East = 1,
    /// The face y = 0.
    South = 2,
    /// The face y = size.y.
    North = 3,
    /// The face z = 0.
    Floor = 4,
    /// The face z = size.z.
    Ceiling = 5,
}

impl Face {
    /// All faces, each at the index of its discriminant.
    pub const ALL: [Self; 6] = [Self::West, Self::East, Self::South, Self::North, Self::Floor, Self::Ceiling];
}

/// A room in box form.
#[derive(Clone, Copy, Debug)]
pub struct BoxShape {
    /// Extent along x, y and z in m from the origin.
    pub size: DVec3,
    /// Surfaces indexed by [`Face`]; `None` is open.
    pub surfaces: [Option<Surface>; 6],
}

/// Why faces do not enclose a room.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EnclosureError {
    /// A face of no area.
    #[error("the face {face:?} has no area")]
    Flat {
        /// Name of the face.
        face: String,
    },
    /// A corner beside the plane of its face.
    #[error("a corner of the face {face:?} is {distance_m:.3e} m from its plane")]
    NotPlanar {
        /// Name of the face.
        face: String,
        /// Largest distance of a corner.
        distance_m: f64,
    },
    /// Edges that only one face has.
    #[error("the faces leave the room open at the edge from {from} to {to}, and at {others} more")]
    Open {
        /// Start of one of the edges, in m.
        from: DVec3,
        /// Its end.
        to: DVec3,
        /// Number of further edges.
        others: usize,
    },
    /// A ceiling that meets the floor inside the outline.
    #[error("the ceiling is {height_m} m high above the floor at {corner}")]
    LowCeiling {
        /// A corner of the outline in m.
        corner: DVec2,
        /// The ceiling's height there.
        height_m: f64,
    },
}

impl Enclosure {
    /// A box from (0, 0, 0) to `size` in m, each > 0; `surfaces` as of [`Face`]. Its faces have the numbers of [`Face`].
    pub fn cuboid(size: DVec3, surfaces: [Option<Surface>; 6]) -> Self {
        let face = |face: Face| {
            let (axis, is_far) = (face as usize / 2, face as usize % 2 == 1);
            let edge = |axis: usize| DVec3::AXES[axis % 3] * size[axis % 3];
            let corner = if is_far { edge(axis) } else { DVec3::ZERO };
            let (u, v) = match is_far {
                false => (edge(axis + 1), edge(axis + 2)),
                true => (edge(axis + 2), edge(axis + 1)),
            };
            let normal = if is_far { -DVec3::AXES[axis] } else { DVec3::AXES[axis] };
            let polygon = Polygon::with_normal(vec![vec![corner, corner + u, corner + u + v, corner + v]], normal);
            let (kind, name) = match face {
                Face::West => (FaceKind::Wall, "wall_west"),
                Face::East => (FaceKind::Wall, "wall_east"),
                Face::South => (FaceKind::Wall, "wall_south"),
                Face::North => (FaceKind::Wall, "wall_north"),
                Face::Floor => (FaceKind::Floor, "floor"),
                Face::Ceiling => (FaceKind::Ceiling, "ceiling"),
            };
            EnclosureFace { name: name.into(), kind, polygon, surface: surfaces[face as usize] }
        };
        Self { faces: Face::ALL.map(face).into(), low: DVec3::ZERO, high: size, is_box: true }
    }

    /// A room above a plan: `rings` are the outline and the holes of the floor in m, simple polygons of either sense that do not meet;
    /// the ceiling is the lowest of its planes (one is flat or sloped, two make a gable). Faces: the floor, walls `wall_K` by
    /// the edges of the rings in their order, then a ceiling for each plane that is lowest anywhere.
    ///
    /// # Errors
    ///
    /// A ceiling that is not above the floor at all corners, or rings of no area.
    pub fn prism(
        rings: &[Vec<DVec2>],
        ceiling: &[CeilingPlane],
        surfaces: KindSurfaces,
    ) -> Result<Self, EnclosureError> {
        let rings: Vec<Vec<DVec2>> =
            rings.iter().enumerate().map(|(number, ring)| directed(ring, number == 0)).collect();
        let height = |p: DVec2| ceiling.iter().map(|plane| plane.at(p)).fold(f64::INFINITY, f64::min);
        let low = rings.iter().flatten().find(|p| height(**p) <= 0.0);
        if let Some(corner) = low {
            return Err(EnclosureError::LowCeiling { corner: *corner, height_m: height(*corner) });
        }
        let on_floor = rings.iter().map(|ring| ring.iter().map(|p| p.extend(0.0)).collect()).collect();
        let mut faces = vec![EnclosureFace {
            name: "floor".into(),
            kind: FaceKind::Floor,
            polygon: Polygon::with_normal(on_floor, DVec3::Z),
            surface: surfaces.floor,
        }];
        for [from, to] in rings.iter().flat_map(|ring| edges(ring)) {
            // the wall's top bends where another plane of the ceiling becomes the lowest
            let at = |share: f64| from.lerp(to, share);
            let mut bends: Vec<f64> = CeilingPlane::crossings(ceiling, from, to);
            bends.retain(|share| CeilingPlane::meet(ceiling, at(*share), height(at(*share))));
            bends.sort_by(f64::total_cmp);
            let top = bends.into_iter().map(at).map(|p| p.extend(height(p)));
            let mut corners = vec![to.extend(0.0), from.extend(0.0), from.extend(height(from))];
            corners.extend(top);
            corners.push(to.extend(height(to)));
            let normal = (to - from).perp().normalize().extend(0.0);
            faces.push(EnclosureFace {
                name: format!("wall_{}", faces.len() - 1),
                kind: FaceKind::Wall,
                polygon: Polygon::with_normal(vec![corners], normal),
                surface: surfaces.walls,
            });
        }
        for (number, plane) in ceiling.iter().enumerate() {
            let others = ceiling.iter().enumerate().filter(|(other, _)| *other != number).map(|(_, other)| *other);
            let parts: Vec<Vec<DVec3>> = rings
                .iter()
                .map(|ring| others.clone().fold(ring.clone(), |ring, other| plane.lower_part(&ring, other)))
                .filter(|ring| ring.len() > 2)
                // seen from below, the sense turns round
                .map(|ring| ring.iter().rev().map(|p| p.extend(plane.at(*p))).collect())
                .collect();
            if parts.is_empty() {
                continue;
            }
            let normal = DVec3::new(plane.rise.x, plane.rise.y, -1.0).normalize();
            faces.push(EnclosureFace {
                name: if ceiling.len() == 1 { "ceiling".into() } else { format!("ceiling_{number}") },
                kind: FaceKind::Ceiling,
                polygon: Polygon::with_normal(parts, normal),
                surface: surfaces.ceiling,
            });
        }
        Self::new(faces)
    }

    /// Faces that close a room, each counter-clockwise seen from inside.
    ///
    /// # Errors
    ///
    /// Faces of no area, that are not planar, or that leave an edge open.
    pub fn new(faces: Vec<EnclosureFace>) -> Result<Self, EnclosureError> {
        let corners = || faces.iter().flat_map(|face| face.polygon.corners());
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let enclosure = Self { faces, low, high, is_box: false };
        let hair = COINCIDING * enclosure.scale_m();
        for face in &enclosure.faces {
            if face.polygon.area_m2() <= hair * hair {
                return Err(EnclosureError::Flat { face: face.name.clone() });
            }
            let distance = |corner: DVec3| face.polygon.height(corner).abs();
            let distance_m = face.polygon.corners().map(distance).fold(0.0, f64::max);
            if distance_m > hair {
                return Err(EnclosureError::NotPlanar { face: face.name.clone(), distance_m });
            }
        }
        enclosure.closes(hair)?;
        Ok(enclosure)
    }

    /// Checks that every edge has one that runs the other way.
    fn closes(&self, hair: f64) -> Result<(), EnclosureError> {
        let place = |p: DVec3| (p / (64.0 * hair)).round().to_array().map(|coordinate| coordinate as i64);
        let mut ends: HashMap<[[i64; 3]; 2], i32> = HashMap::new();
        let sides = || self.faces.iter().flat_map(|face| face.polygon.sides());
        for [a, b] in sides() {
            let (a, b) = (place(a), place(b));
            if a < b {
                *ends.entry([a, b]).or_default() += 1;
            } else {
                *ends.entry([b, a]).or_default() -= 1;
            }
        }
        let is_open = |[a, b]: &[DVec3; 2]| {
            let (a, b) = (place(*a), place(*b));
            a != b && ends.get(&[a.min(b), a.max(b)]).is_some_and(|count| *count != 0)
        };
        let mut open = sides().filter(is_open);
        match open.next() {
            Some([from, to]) => Err(EnclosureError::Open { from, to, others: open.count() }),
            None => Ok(()),
        }
    }

    /// Its faces, by their numbers.
    pub fn faces(&self) -> &[EnclosureFace] {
        &self.faces
    }

    /// Surfaces of the faces that are not open.
    pub fn surfaces(&self) -> impl Iterator<Item = &Surface> {
        self.faces.iter().filter_map(|face| face.surface.as_ref())
    }

    /// Lowest and highest corner of its bounds in m.
    pub fn bounds(&self) -> [DVec3; 2] {
        [self.low, self.high]
    }

    /// Extent of its bounds along x, y and z in m.
    pub fn extent(&self) -> DVec3 {
        self.high - self.low
    }

    /// A length in m to which rounding errors of its coordinates are related: the diagonal of its bounds, or the distance from the
    /// origin where that is longer.
    pub fn scale_m(&self) -> f64 {
        self.extent().length().max(self.low.abs().max(self.high.abs()).length())
    }

    /// The box that it is; `None` for other shapes.
    pub fn as_box(&self) -> Option<BoxShape> {
        let surfaces = || std::array::from_fn(|face| self.faces[face].surface);
        self.is_box.then(|| BoxShape { size: self.high, surfaces: surfaces() })
    }

    /// Gives a face, by its number, another surface.
    pub fn paint(&mut self, face: usize, surface: Option<Surface>) {
        self.faces[face].surface = surface;
    }

    /// Gives all faces these surfaces, in the order of their numbers.
    pub fn paint_all(&mut self, surfaces: impl IntoIterator<Item = Option<Surface>>) {
        self.faces.iter_mut().zip(surfaces).for_each(|(face, surface)| face.surface = surface);
    }

    /// Height in m of the plane of a face at a place of the plan; infinite or not a number for walls.
    pub fn height_at(&self, face: usize, place: DVec2) -> f64 {
        self.faces[face].polygon.height_at(place)
    }

    /// The face overhead at a place of the plan; `None` outside.
    pub fn ceiling_above(&self, place: DVec2) -> Option<usize> {
        let is_above = |face: &EnclosureFace| {
            face.kind == FaceKind::Ceiling && face.polygon.contains(place.extend(face.polygon.height_at(place)))
        };
        self.faces.iter().position(is_above)
    }

    /// Directed edges of the room's section by a level plane, with the inside on the left.
    pub fn section(&self, height_m: f64) -> Vec<Edge> {
        self.faces.iter().flat_map(|face| face.polygon.level_cut(height_m)).collect()
    }
}

impl CeilingPlane {
    /// A flat ceiling.
    pub fn flat(height_m: f64) -> Self {
        Self { height_m, rise: DVec2::ZERO }
    }

    /// Height in m at a place of the plan.
    pub fn at(&self, place: DVec2) -> f64 {
        self.height_m + self.rise.dot(place)
    }

    /// The part of a ring where this plane is not above another one.
    fn lower_part(&self, ring: &[DVec2], other: Self) -> Vec<DVec2> {
        let below = |p: DVec2| other.at(p) - self.at(p);
        let mut part = Vec::new();
        for [a, b] in edges(ring) {
            let (from, to) = (below(a), below(b));
            if from >= 0.0 {
                part.push(a);
            }
            if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
                part.push(a.lerp(b, from / (from - to)));
            }
        }
        part
    }

    /// Shares of the way between two places at which two of some planes cross.
    fn crossings(planes: &[Self], from: DVec2, to: DVec2) -> Vec<f64> {
        let pairs = planes.iter().enumerate().flat_map(|(number, a)| planes[number + 1..].iter().map(move |b| (a, b)));
        let share = |(a, b): (&Self, &Self)| {
            let (start, end) = (a.at(from) - b.at(from), a.at(to) - b.at(to));
            ((start > 0.0 && end < 0.0) || (start < 0.0 && end > 0.0)).then(|| start / (start - end))
        };
        pairs.filter_map(share).collect()
    }

    /// True if two of some planes have this height at a place.
    fn meet(planes: &[Self], place: DVec2, height: f64) -> bool {
        planes.iter().filter(|plane| plane.at(place) <= height * (1.0 + COINCIDING)).count() > 1
    }
}

fn edges(ring: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> {
    (0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()]])
}

/// A ring counter-clockwise around its inside, or clockwise.
fn directed(ring: &[DVec2], counter_clockwise: bool) -> Vec<DVec2> {
    let ring = ring.to_vec();
    let doubled: f64 = edges(&ring).map(|[a, b]| a.perp_dot(b)).sum();
    match (doubled > 0.0) == counter_clockwise {
        true => ring,
        false => ring.into_iter().rev().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(corners: &[[f64; 2]]) -> Vec<DVec2> {
        corners.iter().map(|corner| DVec2::from(*corner)).collect()
    }

    const OPEN: KindSurfaces = KindSurfaces { floor: None, walls: None, ceiling: None };

    fn area(enclosure: &Enclosure, kind: FaceKind) -> f64 {
        enclosure.faces().iter().filter(|face| face.kind == kind).map(|face| face.polygon.area_m2()).sum()
    }

    /// Volume by the cones of the faces over the origin: their normals point inward.
    fn volume(enclosure: &Enclosure) -> f64 {
        let cone = |face: &EnclosureFace| face.polygon.height(DVec3::ZERO) * face.polygon.area_m2() / 3.0;
        enclosure.faces().iter().map(cone).sum()
    }

    /// A box as such and as a prism has the same volume, areas and section, whichever way its outline runs.
    #[test]
    fn a_box_is_a_prism() {
        let size = DVec3::new(3.0, 2.0, 2.5);
        let outline = [[0.0, 0.0], [0.0, 2.0], [3.0, 2.0], [3.0, 0.0]];
        let prism = Enclosure::prism(&[ring(&outline)], &[CeilingPlane::flat(2.5)], OPEN).unwrap();
        let cuboid = Enclosure::cuboid(size, [None; 6]);
        cuboid.closes(1e-9).unwrap();
        for enclosure in [&prism, &cuboid] {
            assert_eq!((enclosure.bounds(), enclosure.scale_m()), ([DVec3::ZERO, size], size.length()));
            assert!((volume(enclosure) - 15.0).abs() < 1e-12);
            assert!((area(enclosure, FaceKind::Wall) - 25.0).abs() < 1e-12);
            let section: f64 = enclosure.section(1.0).iter().map(|[a, b]| 0.5 * a.perp_dot(*b)).sum();
            assert!((section - 6.0).abs() < 1e-12);
            assert_eq!(enclosure.ceiling_above(DVec2::new(1.0, 1.0)), Some(5));
        }
        assert!(prism.as_box().is_none() && cuboid.as_box().is_some());
    }

    /// A gable over a plan with a core that stands below the ridge: volume, the height of both ceilings, walls that bend.
    #[test]
    fn a_gable_over_a_core() {
        let outline = ring(&[[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]]);
        let core = ring(&[[2.0, 1.0], [3.0, 1.0], [3.0, 3.0], [2.0, 3.0]]);
        let planes = [
            CeilingPlane { height_m: 2.0, rise: DVec2::new(0.0, 0.5) },
            CeilingPlane { height_m: 4.0, rise: DVec2::new(0.0, -0.5) },
        ];
        let gable = Enclosure::prism(&[outline, core], &planes, OPEN).unwrap();
        // 2.5 m high in the mean over the outline, 2.75 m over the core
        assert!((volume(&gable) - (24.0 * 2.5 - 2.0 * 2.75)).abs() < 1e-12, "{}", volume(&gable));
        let south = gable.ceiling_above(DVec2::new(5.0, 1.0)).unwrap();
        assert!((gable.height_at(south, DVec2::new(5.0, 1.0)) - 2.5).abs() < 1e-12);
        assert_eq!(gable.ceiling_above(DVec2::new(2.5, 2.0)), None, "over the core");
        let corners =
            |name: &str| gable.faces().iter().find(|face| face.name == name).unwrap().polygon.corners().count();
        assert_eq!(["wall_0", "wall_1", "wall_3", "wall_5"].map(corners), [4, 5, 5, 5]);
    }

    /// Faces that leave a gap, one that is not planar, and a ceiling that comes down to the floor are refused with their places.
    #[test]
    fn what_encloses_nothing() {
        let outline = ring(&[[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]);
        let room = Enclosure::prism(std::slice::from_ref(&outline), &[CeilingPlane::flat(2.5)], OPEN).unwrap();
        let mut faces = room.faces().to_vec();
        faces.pop();
        assert!(matches!(Enclosure::new(faces), Err(EnclosureError::Open { others: 3, .. })));
        let mut faces = room.faces().to_vec();
        let mut corners: Vec<DVec3> = faces[0].polygon.corners().collect();
        corners[0].z += 0.01;
        faces[0].polygon = Polygon::new(vec![corners]).unwrap();
        assert!(matches!(Enclosure::new(faces), Err(EnclosureError::NotPlanar { face, .. }) if face == "floor"));
        let slope = CeilingPlane { height_m: 1.0, rise: DVec2::new(0.0, -0.5) };
        let low = Enclosure::prism(&[outline], &[slope], OPEN);
        assert!(matches!(low, Err(EnclosureError::LowCeiling { height_m: 0.0, .. })));
    }
}
