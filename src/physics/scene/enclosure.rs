//! The surface around a room: named planar faces, seen from inside.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::geometry::covered::Edge;
use crate::geometry::planar::Polygon;
use crate::optics::Surface;

/// Fraction of the room's scale within which points coincide, and corners of a face lie in its plane.
const COINCIDING: f64 = 1e-9;

/// The faces that close a room. [`Enclosure::cuboid`] builds a box; code that needs a box calls [`Enclosure::as_box`].
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
    /// Kind of the face.
    pub kind: FaceKind,
    /// Outline with holes, counter-clockwise seen from inside the room, in m.
    pub polygon: Polygon,
    /// Optics; `None` where the face is open: light leaves, and a camera may look in.
    pub surface: Option<Surface>,
}

/// Kinds of faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceKind {
    /// The face below.
    Floor,
    /// A face at the side.
    Wall,
    /// A face overhead.
    Ceiling,
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

/// Reason why faces do not enclose a room.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EnclosureError {
    /// A face without area.
    #[error("the face {face:?} has no area")]
    Flat {
        /// Name of the face.
        face: String,
    },
    /// A corner that does not lie in the plane of its face.
    #[error("a corner of the face {face:?} is {distance_m:.3e} m from its plane")]
    NotPlanar {
        /// Name of the face.
        face: String,
        /// Largest distance of a corner from the plane in m.
        distance_m: f64,
    },
    /// Edges that belong to only one face.
    #[error("the faces leave the room open at the edge from {from} to {to}, and at {others} more")]
    Open {
        /// Start of one of the edges, in m.
        from: DVec3,
        /// End of that edge, in m.
        to: DVec3,
        /// Number of further edges.
        others: usize,
    },
    /// A ceiling that meets the floor inside the outline.
    #[error("the ceiling is {height_m} m high above the floor at {corner}")]
    LowCeiling {
        /// A corner of the outline in m.
        corner: DVec2,
        /// Height of the ceiling there in m.
        height_m: f64,
    },
}

impl Enclosure {
    /// Builds a box from (0, 0, 0) to `size` in m, each > 0; `surfaces` are indexed by [`Face`], and faces have the numbers of [`Face`].
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

    /// Builds an enclosure of faces that close a room, each counter-clockwise seen from inside.
    ///
    /// # Errors
    ///
    /// Faces without area, faces that are not planar, or faces that leave an edge open.
    pub fn new(faces: Vec<EnclosureFace>) -> Result<Self, EnclosureError> {
        let enclosure = Self::of_closed(faces);
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

    /// Builds an enclosure of planar faces that are known to close a room, each counter-clockwise seen from inside; [`Self::new`] checks
    /// this. Where edges of neighbours differ, a ray that passes between two faces ends on the one that it passes closer to.
    pub fn of_closed(faces: Vec<EnclosureFace>) -> Self {
        let corners = || faces.iter().flat_map(|face| face.polygon.corners());
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        Self { faces, low, high, is_box: false }
    }

    /// Checks that every edge of a face has a counterpart that runs the other way.
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

    /// Returns the faces, by their numbers.
    pub fn faces(&self) -> &[EnclosureFace] {
        &self.faces
    }

    /// Lists the surfaces of the faces that are not open.
    pub fn surfaces(&self) -> impl Iterator<Item = &Surface> {
        self.faces.iter().filter_map(|face| face.surface.as_ref())
    }

    /// Returns the lowest and highest corner of the bounds in m.
    pub fn bounds(&self) -> [DVec3; 2] {
        [self.low, self.high]
    }

    /// Returns the extent of the bounds along x, y and z in m.
    pub fn extent(&self) -> DVec3 {
        self.high - self.low
    }

    /// Returns the length in m to which rounding errors of coordinates are related: the diagonal of the bounds, or the distance from the
    /// origin where that is longer.
    pub fn scale_m(&self) -> f64 {
        self.extent().length().max(self.low.abs().max(self.high.abs()).length())
    }

    /// Returns the box if the room is one; `None` for other shapes.
    pub fn as_box(&self) -> Option<BoxShape> {
        let surfaces = || std::array::from_fn(|face| self.faces[face].surface);
        self.is_box.then(|| BoxShape { size: self.high, surfaces: surfaces() })
    }

    /// Replaces the surface of a face, given by its number.
    pub fn paint(&mut self, face: usize, surface: Option<Surface>) {
        self.faces[face].surface = surface;
    }

    /// Replaces the surfaces of all faces, in the order of their numbers.
    pub fn paint_all(&mut self, surfaces: impl IntoIterator<Item = Option<Surface>>) {
        self.faces.iter_mut().zip(surfaces).for_each(|(face, surface)| face.surface = surface);
    }

    /// Returns the height in m of the plane of a face at a place of the plan; infinite or not a number for walls.
    pub fn height_at(&self, face: usize, place: DVec2) -> f64 {
        self.faces[face].polygon.height_at(place)
    }

    /// Finds the face overhead at a place of the plan; `None` outside.
    pub fn ceiling_above(&self, place: DVec2) -> Option<usize> {
        let is_above = |face: &EnclosureFace| {
            face.kind == FaceKind::Ceiling && face.polygon.contains(place.extend(face.polygon.height_at(place)))
        };
        self.faces.iter().position(is_above)
    }

    /// Returns the height in m of the ceiling over a place of the plan, or within `near_m` of the place; `None` outside.
    pub fn ceiling_height_m(&self, place: DVec2, near_m: f64) -> Option<f64> {
        let overhead = self.faces.iter().filter(|face| face.kind == FaceKind::Ceiling);
        let point = |face: &EnclosureFace| place.extend(face.polygon.height_at(place));
        let near = overhead.filter(|face| face.polygon.distance(point(face)) <= near_m);
        near.map(|face| point(face).z).min_by(f64::total_cmp)
    }

    /// Returns the directed edges of the room's section by a level plane, with the inside on the left.
    pub fn section(&self, height_m: f64) -> Vec<Edge> {
        self.faces.iter().flat_map(|face| face.polygon.level_cut(height_m)).collect()
    }
}
