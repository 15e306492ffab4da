//! Mesh objects as they are traced: opaque triangles with a surface on either side.
//!
//! Objects that stand once are one body. Each copy of a mesh with several places is a body of its own, which shares triangles, tree and
//! facets with the other copies; rays are converted to its frame.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::DVec3;

use super::box_bounds::BoxBounds;
use super::surface_id::Side;
use crate::geometry::bvh::{TriangleBvh, TriangleHit};
use crate::geometry::facets::{Facets, pieces};
use crate::geometry::placement::Placement;
use crate::geometry::sheets::Sheets;
use crate::geometry::triangle::distance_above;
use crate::scene::MeshObject;

/// Fraction of the room's scale by which light starts before a triangle: far more than the rounding of a hit, so that no ray meets the
/// facet that it leaves, and far less than any gap.
const CLEARANCE: f64 = 1e-11;

/// Fraction of the room's scale: corners within this distance of a facet's plane belong to the facet.
const PLANE_TOLERANCE: f64 = 1e-6;

/// All mesh objects of a room. Facets and pieces are numbered consecutively over all bodies.
#[derive(Debug)]
pub struct TraceableMeshes {
    shapes: Vec<Shape>,
    /// Bodies in the order of their facets; one that stands in the room frame comes first.
    bodies: Vec<Body>,
    /// Number of the first body that is a copy.
    first_copy: usize,
    /// Bounds of the copies.
    bounds: BoxBounds,
    /// Number of facets.
    facets: usize,
    /// Distance in m by which light ends before a triangle.
    pub clearance: f64,
}

/// Triangles in their own frame.
#[derive(Debug)]
struct Shape {
    bvh: TriangleBvh,
    /// Corners of all meshes.
    positions: Vec<DVec3>,
    /// Numbers of the corners of each triangle.
    triangles: Vec<[u32; 3]>,
    /// Number of the piece that each triangle belongs to; a piece consists of triangles joined by corners.
    pieces: Vec<u32>,
    facets: Facets,
    /// Lowest and highest corner.
    bounds: [DVec3; 2],
    /// Number of the first triangle of each object, and the object's number.
    objects: Vec<(u32, usize)>,
}

/// A shape at its place.
#[derive(Debug)]
struct Body {
    shape: usize,
    /// Place of a copy; `None` for the room frame.
    placement: Option<Placement>,
    first_facet: usize,
    first_piece: u32,
}

/// Triangles of a body as they stand in the room.
pub struct BodyTriangles<'a> {
    /// Corners in m.
    pub positions: Cow<'a, [DVec3]>,
    /// Numbers of the corners of each triangle.
    pub triangles: &'a [[u32; 3]],
    /// Number of the piece of each triangle, from 0 for each body.
    pub pieces: &'a [u32],
    /// Number of the body's first piece among all.
    pub first_piece: u32,
}

/// Place where a ray meets a mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeshHit {
    /// Distance from the ray's origin in m, > 0.
    pub distance: f64,
    /// Point just before the triangle, in m.
    pub position: DVec3,
    /// Unit normal on the ray's side.
    pub normal: DVec3,
    /// Number of the facet.
    pub facet: usize,
    /// Side of the facet that the ray meets.
    pub side: Side,
}

impl TraceableMeshes {
    /// Compiles all mesh objects of a room of `scale` in m, and returns them with the numbers of the surfaces of front and back of each facet,
    /// counted over all objects; `None` without triangles.
    pub fn new(objects: &[MeshObject], scale: f64) -> Option<(Self, Vec<[u32; 2]>)> {
        let first_surfaces = objects.iter().scan(0, |next, object| {
            let first = *next;
            *next += object.surfaces.len() as u32;
            Some(first)
        });
        let (mut single, mut of_single) = (Sheets::default(), Vec::new());
        let mut copied = Vec::new();
        for (number, (object, first_surface)) in objects.iter().zip(first_surfaces).enumerate() {
            of_single.push((single.triangles.len() as u32, number));
            single.add(&object.mesh, first_surface);
            if let Some(instances) = &object.instances {
                let mut sheets = Sheets::default();
                sheets.add(&instances.mesh, first_surface);
                copied.push((sheets, vec![(0, number)], instances.placements.iter().copied().map(Some).collect()));
            }
        }
        let mut meshes = Self {
            shapes: Vec::new(),
            bodies: Vec::new(),
            first_copy: usize::from(!single.triangles.is_empty()),
            bounds: BoxBounds::default(),
            facets: 0,
            clearance: CLEARANCE * scale,
        };
        let (mut of_facets, mut spans, mut first_piece) = (Vec::new(), Vec::new(), 0);
        let groups = std::iter::once((single, of_single, vec![None])).chain(copied);
        for (sheets, objects, placements) in groups.filter(|(sheets, ..)| !sheets.triangles.is_empty()) {
            let (shape, sides) = Shape::new(sheets, objects, scale);
            for placement in placements {
                let (number, first_facet) = (meshes.shapes.len(), meshes.facets);
                meshes.bodies.push(Body { shape: number, placement, first_facet, first_piece });
                meshes.facets += shape.facets.len();
                first_piece += shape.pieces.iter().max().map_or(0, |last| last + 1);
                of_facets.extend(&sides);
                spans.extend(placement.map(|placement| placement.bounds(shape.bounds)));
            }
            meshes.shapes.push(shape);
        }
        meshes.bounds = BoxBounds::new(&spans, scale);
        (!meshes.shapes.is_empty()).then_some((meshes, of_facets))
    }

    /// Returns the number of facets.
    pub fn facet_count(&self) -> usize {
        self.facets
    }

    /// Returns the unit normal of the front of a facet.
    pub fn normal(&self, facet: usize) -> DVec3 {
        let (body, shape, own) = self.body_of(facet);
        body.direction(shape.facets.normals[own])
    }

    /// Returns the area of a facet in m2.
    pub fn area_m2(&self, facet: usize) -> f64 {
        let (_, shape, own) = self.body_of(facet);
        shape.facets.areas_m2[own]
    }

    /// Iterates over the edges around a facet, in m, counter-clockwise about its normal.
    pub fn edges(&self, facet: usize) -> impl Iterator<Item = [DVec3; 2]> + Clone {
        let (body, shape, own) = self.body_of(facet);
        shape.facets.edges(own).iter().map(move |edge| edge.map(|end| body.point(end)))
    }

    /// Computes the area in m2 of the part of a facet within `radius` m of a point of its plane.
    pub fn area_within(&self, facet: usize, centre: DVec3, radius: f64) -> f64 {
        let (body, shape, own) = self.body_of(facet);
        shape.facets.area_within(own, body.point_back(centre), radius)
    }

    /// Returns the number of the piece that a facet belongs to.
    pub fn piece(&self, facet: usize) -> u32 {
        let (body, shape, own) = self.body_of(facet);
        body.first_piece + shape.pieces[shape.facets.largest[own] as usize]
    }

    /// Returns the number of the object that has a facet.
    pub fn object_of(&self, facet: usize) -> usize {
        let (_, shape, own) = self.body_of(facet);
        let triangle = shape.facets.largest[own];
        let objects = &shape.objects;
        objects[objects.partition_point(|(first, _)| *first <= triangle) - 1].1
    }

    /// Returns a point inside a facet.
    pub fn point_of(&self, facet: usize) -> DVec3 {
        let (body, shape, own) = self.body_of(facet);
        let corners = shape.triangles[shape.facets.largest[own] as usize];
        corners.iter().map(|corner| body.point(shape.positions[*corner as usize])).sum::<DVec3>() / 3.0
    }

    /// Iterates over all triangles: the number of the facet, and the corners in m.
    pub fn triangles(&self) -> impl Iterator<Item = (usize, [DVec3; 3])> {
        self.bodies.iter().flat_map(|body| {
            let shape = &self.shapes[body.shape];
            shape.triangles.iter().zip(&shape.facets.of_triangle).map(move |(corners, facet)| {
                (body.first_facet + *facet as usize, corners.map(|corner| body.point(shape.positions[corner as usize])))
            })
        })
    }

    /// Iterates over the bodies.
    pub fn bodies(&self) -> impl Iterator<Item = BodyTriangles<'_>> {
        self.bodies.iter().map(|body| {
            let Shape { positions, triangles, pieces, .. } = &self.shapes[body.shape];
            let positions = match body.placement {
                None => Cow::Borrowed(positions.as_slice()),
                Some(place) => positions.iter().map(|position| place.point(*position)).collect(),
            };
            BodyTriangles { positions, triangles, pieces, first_piece: body.first_piece }
        })
    }

    /// Finds the nearest triangle along the unit vector `direction`.
    #[inline]
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<MeshHit> {
        let mut nearest: Option<(&Body, TriangleHit)> = None;
        for body in &self.bodies[..self.first_copy] {
            nearest = self.shapes[body.shape].bvh.nearest(origin, direction, None).map(|hit| (body, hit));
        }
        if self.first_copy < self.bodies.len() {
            let reach = nearest.as_ref().map_or(f64::INFINITY, |(_, hit)| hit.distance);
            for number in self.bounds.met(origin, direction, reach) {
                let body = &self.bodies[self.first_copy + number];
                let (start, toward) = (body.point_back(origin), body.direction_back(direction));
                let hit = self.shapes[body.shape].bvh.nearest(start, toward, None);
                let is_nearer = |hit: &TriangleHit| nearest.is_none_or(|(_, other)| hit.distance < other.distance);
                nearest = hit.filter(is_nearer).map(|hit| (body, hit)).or(nearest);
            }
        }
        nearest.map(|(body, hit)| self.hit(body, &hit, origin, direction))
    }

    /// Returns the place where a ray meets a triangle of a body.
    #[inline]
    fn hit(&self, body: &Body, hit: &TriangleHit, origin: DVec3, direction: DVec3) -> MeshHit {
        let shape = &self.shapes[body.shape];
        let triangle = hit.triangle as usize;
        let own = shape.facets.of_triangle[triangle] as usize;
        let normal = body.direction(shape.bvh.normal(hit));
        // no negative zeros: the frame around a normal must not depend on the winding
        let normal = (if normal.dot(direction) > 0.0 { -normal } else { normal }) + DVec3::ZERO;
        let front = body.direction(shape.facets.normals[own]);
        let side = if front.dot(normal) < 0.0 { Side::Back } else { Side::Front };
        let on_plane = body.point(shape.positions[shape.triangles[triangle][0] as usize]);
        let position = origin + direction * hit.distance;
        let position = position + normal * (self.clearance - normal.dot(position - on_plane));
        MeshHit { distance: hit.distance, position, normal, facet: body.first_facet + own, side }
    }

    /// True if a triangle is met before the fraction `until` of the segment from `a` to `b`.
    #[inline]
    pub fn blocks(&self, a: DVec3, b: DVec3, until: f64) -> bool {
        let length = (b - a).length();
        let (direction, reach) = ((b - a) / length, until * length);
        let blocks = |body: &Body| {
            let (start, toward) = (body.point_back(a), body.direction_back(direction));
            self.shapes[body.shape].bvh.any_within(start, toward, reach)
        };
        let (single, copies) = self.bodies.split_at(self.first_copy);
        let by_copy = || self.bounds.met(a, direction, reach).into_iter().any(|number| blocks(&copies[number]));
        length > 0.0 && (single.iter().any(blocks) || !copies.is_empty() && by_copy())
    }

    /// Returns the distance in m of a point to the nearest part of the meshes that rises above the point by more than `level` m; `None`
    /// where that distance is not below `reach`.
    pub fn horizontal_distance(&self, point: DVec3, level: f64, reach: f64) -> Option<f64> {
        let of_body = |body: &Body| {
            let shape = &self.shapes[body.shape];
            if body.placement.is_none() {
                return shape.bvh.distance_above(point, point.z + level, reach);
            }
            let (start, mut nearest) = (body.point_back(point), reach);
            shape.bvh.around(start - reach, start + reach, |number| {
                let corners =
                    shape.triangles[number as usize].map(|corner| body.point(shape.positions[corner as usize]));
                nearest = nearest.min(distance_above(&corners, point, point.z + level).unwrap_or(nearest));
            });
            (nearest < reach).then_some(nearest)
        };
        self.bodies.iter().filter_map(of_body).reduce(f64::min)
    }

    /// Returns the body of a facet, its shape, and the facet's number in the shape.
    #[inline]
    fn body_of(&self, facet: usize) -> (&Body, &Shape, usize) {
        let body = &self.bodies[self.bodies.partition_point(|body| body.first_facet <= facet) - 1];
        (body, &self.shapes[body.shape], facet - body.first_facet)
    }
}

impl Shape {
    /// Compiles the triangles of `objects`, each given by the number of its first triangle and its own, in a room of `scale` in m; returns
    /// the sides of each facet, too.
    fn new(sheets: Sheets, objects: Vec<(u32, usize)>, scale: f64) -> (Self, Vec<[u32; 2]>) {
        let Sheets { positions, triangles, sides, .. } = sheets;
        let facets =
            Facets::new(&positions, &triangles, &kinds(&positions, &triangles, &sides), PLANE_TOLERANCE * scale);
        let of_facets = facets.largest.iter().map(|triangle| sides[*triangle as usize]).collect();
        let corners = || triangles.iter().flatten().map(|corner| positions[*corner as usize]);
        let shape = Self {
            bounds: [corners().fold(DVec3::INFINITY, DVec3::min), corners().fold(DVec3::NEG_INFINITY, DVec3::max)],
            bvh: TriangleBvh::of_mesh(positions.clone(), triangles.clone()),
            pieces: pieces(positions.len(), &triangles),
            positions,
            triangles,
            facets,
            objects,
        };
        (shape, of_facets)
    }
}

impl Body {
    #[inline]
    fn point(&self, point: DVec3) -> DVec3 {
        self.placement.as_ref().map_or(point, |place| place.point(point))
    }

    #[inline]
    fn direction(&self, direction: DVec3) -> DVec3 {
        self.placement.as_ref().map_or(direction, |place| place.direction(direction))
    }

    #[inline]
    fn point_back(&self, point: DVec3) -> DVec3 {
        self.placement.as_ref().map_or(point, |place| place.point_back(point))
    }

    #[inline]
    fn direction_back(&self, direction: DVec3) -> DVec3 {
        self.placement.as_ref().map_or(direction, |place| place.direction_back(direction))
    }
}

/// Numbers the kinds of triangles from which facets are made: triangles with different materials on their two sides are of one kind only
/// if they face the same way.
fn kinds(positions: &[DVec3], triangles: &[[u32; 3]], sides: &[[u32; 2]]) -> Vec<u32> {
    let mut known: HashMap<([u32; 2], u32), u32> = HashMap::new();
    let first = sides.iter().flatten().max().map_or(0, |last| last + 1);
    let kind = |(triangle, [front, back]): (&[u32; 3], &[u32; 2])| {
        if front == back {
            return *front;
        }
        let [a, b, c] = triangle.map(|corner| positions[corner as usize]);
        let across = (b - a).cross(c - a);
        let axis = (0..3).max_by(|i, j| across[*i].abs().total_cmp(&across[*j].abs())).unwrap_or(0);
        let facing = 2 * axis as u32 + u32::from(across[axis] < 0.0);
        let next = first + known.len() as u32;
        *known.entry(([*front, *back], facing)).or_insert(next)
    };
    triangles.iter().zip(sides).map(kind).collect()
}
