//! Solids in a room, which can cover parts of its surfaces and of grids: boxes, and the pieces of its meshes.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::box_object::TraceableBox;
use super::mesh_objects::BodyTriangles;
use super::scene::TraceableScene;
use crate::geometry::TriangleMesh;
use crate::geometry::covered::{Edge, contains, cross};
use crate::geometry::facets::pieces;
use crate::geometry::planar::Polygon;
use crate::geometry::section::section;
use crate::geometry::welded::places;

/// A body whose inside no light reaches.
pub struct Solid {
    /// Box or piece of a mesh that the solid is.
    pub of: Owner,
    /// Lowest corner of its bounds in m.
    pub low: DVec3,
    /// Highest corner of its bounds in m.
    pub high: DVec3,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// False if light may get inside through an open end: the solid has no inside then, whatever its sections look like.
    closed: bool,
}

/// The box or piece of a mesh that a solid is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// Number of a box.
    Box(usize),
    /// Number of a piece: triangles of the meshes that are joined by corners.
    Piece(u32),
}

/// A plane with a frame, seen from one side.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    /// A point of the plane, in m.
    pub origin: DVec3,
    /// First of two perpendicular unit vectors in the plane.
    pub u: DVec3,
    /// Second of the two unit vectors.
    pub v: DVec3,
    /// Unit normal on the side that is seen.
    pub seen: DVec3,
    /// Lowest corner of the bounds of the part of the plane that counts, in m.
    pub low: DVec3,
    /// Highest corner of these bounds, in m.
    pub high: DVec3,
    /// Distance in metres before the plane at which solids are cut.
    pub hair: f64,
}

impl Sheet {
    /// Returns the coordinates of a point along `u` and `v` in m.
    pub fn flat(&self, p: DVec3) -> DVec2 {
        DVec2::new((p - self.origin).dot(self.u), (p - self.origin).dot(self.v))
    }
}

/// Parts of a plane that solids cover.
#[derive(Default)]
pub struct Sections {
    /// Outlines, one per solid or nest of pieces, in the frame of the sheet.
    pub covers: Vec<Vec<Edge>>,
    /// True if the plane cuts a mesh that is not closed, which covers nothing.
    pub open: bool,
}

impl Solid {
    /// Lists all boxes and pieces of meshes of a scene.
    pub fn all(scene: &TraceableScene) -> Vec<Self> {
        let boxes = scene.boxes.iter().enumerate().map(|(number, object)| Self::of_box(number, object));
        let mut solids: Vec<Self> = boxes.collect();
        let Some(meshes) = &scene.meshes else { return solids };
        for BodyTriangles { positions, triangles, pieces, first_piece } in meshes.bodies() {
            let own = Self::of_pieces(&positions, triangles, pieces, &scene.enclosure.polygons, scene.coinciding());
            solids.extend((first_piece..).zip(own).map(|(piece, solid)| Self { of: Owner::Piece(piece), ..solid }));
        }
        solids
    }

    /// Lists the pieces of one mesh by itself, in a room of these `faces`; corners at the same place are joined. Points within `near` m
    /// of a face of the room lie on it: the face closes a piece that stands on it.
    pub fn of_mesh(mesh: &TriangleMesh, faces: &[Polygon], near: f64) -> Vec<Self> {
        let places = places(&mesh.positions);
        let triangles: Vec<[u32; 3]> =
            mesh.triangles.iter().map(|corners| corners.map(|corner| places[corner as usize])).collect();
        let mut positions = Vec::new();
        for (place, position) in places.iter().zip(&mesh.positions) {
            // places are numbered in the order in which they first appear
            if *place as usize == positions.len() {
                positions.push(*position);
            }
        }
        Self::of_pieces(&positions, &triangles, &pieces(positions.len(), &triangles), faces, near)
    }

    fn of_pieces(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        pieces: &[u32],
        faces: &[Polygon],
        near: f64,
    ) -> Vec<Self> {
        let mut members: Vec<Vec<u32>> = Vec::new();
        for (triangle, piece) in (0..).zip(pieces) {
            if *piece as usize == members.len() {
                members.push(Vec::new());
            }
            members[*piece as usize].push(triangle);
        }
        let of_piece = |(piece, members): (u32, Vec<u32>)| {
            let corners: Vec<[u32; 3]> = members.iter().map(|triangle| triangles[*triangle as usize]).collect();
            let mut used: Vec<u32> = corners.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            let own = |corner: u32| used.binary_search(&corner).map_or(0, |place| place as u32);
            let triangles: Vec<[u32; 3]> = corners.iter().map(|triangle| triangle.map(own)).collect();
            let positions: Vec<DVec3> = used.iter().map(|corner| positions[*corner as usize]).collect();
            let closed = is_closed(&positions, &triangles, faces, near);
            Self { closed, ..Self::new(Owner::Piece(piece), positions, triangles) }
        };
        (0..).zip(members).map(of_piece).collect()
    }

    fn of_box(number: usize, object: &TraceableBox) -> Self {
        let (bottom, top) = object.span();
        let outline = object.outline();
        let positions = [bottom, top].iter().flat_map(|z| outline.map(|corner| corner.extend(*z))).collect();
        let mut triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        for k in 0..4 {
            let next = (k + 1) % 4;
            triangles.extend([[k, next, next + 4], [k, next + 4, k + 4]]);
        }
        Self::new(Owner::Box(number), positions, triangles)
    }

    fn new(of: Owner, positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let low = positions.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = positions.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        Self { of, low, high, positions, triangles, closed: true }
    }

    /// True if light cannot get inside: the solid is closed, by itself or by a face of the room.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Returns the number of triangles that a section has to test.
    pub fn work(&self) -> usize {
        self.triangles.len()
    }

    /// False where bounds show that a sheet does not cut the solid.
    pub fn may_cut(&self, sheet: &Sheet) -> bool {
        let near = self.low.cmple(sheet.high + sheet.hair) & self.high.cmpge(sheet.low - sheet.hair);
        if !near.all() {
            return false;
        }
        let (middle, half) = (0.5 * (self.low + self.high), 0.5 * (self.high - self.low));
        let height = (sheet.origin - middle).dot(sheet.seen) + sheet.hair;
        height.abs() <= half.dot(sheet.seen.abs()) + sheet.hair
    }
}

/// True if every edge of some triangles belongs to an even number of them, or lies in a face of the room, which closes a solid that
/// stands on it.
fn is_closed(positions: &[DVec3], triangles: &[[u32; 3]], faces: &[Polygon], hair: f64) -> bool {
    let mut uses: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for [a, b, c] in triangles {
        for [p, q] in [[*a, *b], [*b, *c], [*c, *a]] {
            *uses.entry([p.min(q), p.max(q)]).or_default() += 1;
        }
    }
    let on_face = |edge: &[u32; 2]| {
        let ends = edge.map(|corner| positions[corner as usize]);
        faces.iter().any(|face| ends.iter().all(|end| face.height(*end).abs() <= hair))
    };
    uses.iter().all(|(edge, count)| count.is_multiple_of(2) || on_face(edge))
}

/// Finds the parts of a sheet that solids cover. A piece inside another one, whose outlines do not cross, is its cavity.
pub fn sections<'a>(solids: impl Iterator<Item = &'a Solid>, sheet: &Sheet) -> Sections {
    let mut found = Sections::default();
    let mut cut: Vec<(&Solid, Vec<Edge>)> = Vec::new();
    for solid in solids {
        let outlines =
            section(&solid.positions, &solid.triangles, sheet.seen, sheet.seen.dot(sheet.origin) + sheet.hair);
        found.open |= outlines.open || !solid.closed && !outlines.rings.is_empty();
        if !solid.closed {
            continue;
        }
        let ring = |ring: &Vec<DVec3>| -> Vec<Edge> {
            (0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()]].map(|p| sheet.flat(p))).collect()
        };
        let edges: Vec<Edge> = outlines.rings.iter().flat_map(ring).collect();
        if !edges.is_empty() {
            cut.push((solid, edges));
        }
    }
    // cavities go to the largest piece around them
    let around = |inner: usize, outer: usize| {
        let ((small, edges), (large, rings)) = (&cut[inner], &cut[outer]);
        inner != outer
            && matches!((small.of, large.of), (Owner::Piece(_), Owner::Piece(_)))
            && small.low.cmpgt(large.low).all()
            && small.high.cmplt(large.high).all()
            && contains(rings, edges[0][0])
            && !cross(edges, rings)
    };
    let extent = |k: usize| (cut[k].0.high - cut[k].0.low).length_squared();
    let nest = |inner: usize| {
        let outer = (0..cut.len()).filter(|outer| around(inner, *outer));
        outer.max_by(|a, b| extent(*a).total_cmp(&extent(*b))).unwrap_or(inner)
    };
    let nests: Vec<usize> = (0..cut.len()).map(nest).collect();
    for outer in (0..cut.len()).filter(|k| nests[*k] == *k) {
        let members = (0..cut.len()).filter(|inner| nests[*inner] == outer);
        found.covers.push(members.flat_map(|inner| cut[inner].1.iter().copied()).collect());
    }
    found
}
