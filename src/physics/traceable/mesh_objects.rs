//! Mesh objects as they are traced: opaque triangles with a surface on either side.

use std::collections::HashMap;

use glam::DVec3;

use super::surface_id::Side;
use crate::geometry::bvh::TriangleBvh;
use crate::geometry::facets::{Facets, pieces};
use crate::optics::Surface;
use crate::scene::MeshObject;

/// Fraction of the room's scale by which light starts before a triangle: far more than the rounding of a hit, so that no ray meets the
/// facet that it leaves, and far less than any gap.
const CLEARANCE: f64 = 1e-11;

/// Fraction of the room's scale: corners within this distance of a facet's plane belong to the facet.
const PLANE_TOLERANCE: f64 = 1e-6;

/// All mesh objects of a room.
#[derive(Debug)]
pub struct TraceableMeshes {
    bvh: TriangleBvh,
    /// Corners of all meshes.
    pub positions: Vec<DVec3>,
    /// Numbers of the corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Number of the piece that each triangle belongs to; a piece consists of triangles joined by corners.
    pub pieces: Vec<u32>,
    /// Number of the first triangle of each object.
    first_triangles: Vec<u32>,
    /// Facets of all meshes, numbered consecutively.
    pub facets: Facets,
    /// Distance in m by which light ends before a triangle.
    pub clearance: f64,
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
    /// Compiles all mesh objects of a room of `scale` in m, and returns them with the surfaces of front and back of each facet; `None`
    /// without objects.
    pub fn new(objects: &[MeshObject], scale: f64) -> Option<(Self, Vec<[Surface; 2]>)> {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let (mut sides, mut surfaces, mut first_triangles) = (Vec::new(), Vec::new(), Vec::new());
        for object in objects {
            let (corner, kind) = (positions.len() as u32, surfaces.len() as u32);
            first_triangles.push(triangles.len() as u32);
            positions.extend(&object.mesh.positions);
            triangles.extend(object.mesh.triangles.iter().map(|triangle| triangle.map(|k| k + corner)));
            let mesh = &object.mesh;
            sides.extend((0..mesh.triangles.len()).map(|number| mesh.sides(number).map(|material| material + kind)));
            surfaces.extend(&object.surfaces);
        }
        if triangles.is_empty() {
            return None;
        }
        let kinds = kinds(&positions, &triangles, &sides);
        let facets = Facets::new(&positions, &triangles, &kinds, PLANE_TOLERANCE * scale);
        let of_facets = facets.largest.iter().map(|triangle| {
            let sides: [u32; 2] = sides[*triangle as usize];
            sides.map(|side| surfaces[side as usize])
        });
        let of_facets = of_facets.collect();
        let meshes = Self {
            bvh: TriangleBvh::of_mesh(positions.clone(), triangles.clone()),
            pieces: pieces(positions.len(), &triangles),
            positions,
            triangles,
            first_triangles,
            facets,
            clearance: CLEARANCE * scale,
        };
        Some((meshes, of_facets))
    }

    /// Returns the number of the object that has a facet.
    pub fn object_of(&self, facet: usize) -> usize {
        let triangle = self.facets.largest[facet];
        self.first_triangles.partition_point(|first| *first <= triangle) - 1
    }

    /// Returns a point inside a facet.
    pub fn point_of(&self, facet: usize) -> DVec3 {
        let corners = self.triangles[self.facets.largest[facet] as usize];
        corners.iter().map(|corner| self.positions[*corner as usize]).sum::<DVec3>() / 3.0
    }

    /// Finds the nearest triangle along the unit vector `direction`.
    #[inline]
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<MeshHit> {
        let hit = self.bvh.nearest(origin, direction, None)?;
        let triangle = hit.triangle as usize;
        let facet = self.facets.of_triangle[triangle] as usize;
        let normal = self.bvh.normal(&hit);
        // no negative zeros: the frame around a normal must not depend on the winding
        let normal = (if normal.dot(direction) > 0.0 { -normal } else { normal }) + DVec3::ZERO;
        let side = if self.facets.normals[facet].dot(normal) < 0.0 { Side::Back } else { Side::Front };
        let on_plane = self.positions[self.triangles[triangle][0] as usize];
        let position = origin + direction * hit.distance;
        let position = position + normal * (self.clearance - normal.dot(position - on_plane));
        Some(MeshHit { distance: hit.distance, position, normal, facet, side })
    }

    /// True if a triangle is met before the fraction `until` of the segment from `a` to `b`.
    #[inline]
    pub fn blocks(&self, a: DVec3, b: DVec3, until: f64) -> bool {
        let length = (b - a).length();
        length > 0.0 && self.bvh.any_within(a, (b - a) / length, until * length)
    }

    /// Returns the distance in m of a point to the nearest part of the meshes that rises above the point by more than `level` m; `None`
    /// where that distance is not below `reach`.
    pub fn horizontal_distance(&self, point: DVec3, level: f64, reach: f64) -> Option<f64> {
        self.bvh.distance_above(point, point.z + level, reach)
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
