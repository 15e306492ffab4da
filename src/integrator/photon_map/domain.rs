//! The part of a plane on which photons can lie: gather discs are clipped to it, so that kernels have no boundary bias.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::geometry::disc::{disc_disc_area, disc_edge_area, disc_polygon_area};
use crate::geometry::section::contains;
use crate::scene::Face;
use crate::traceable::TraceableScene;

/// A polygon minus polygons and discs, all in one plane.
#[derive(Clone, Debug)]
pub struct Domain {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
    /// Extent of the outline along u and v.
    size: DVec2,
    holes: Vec<Vec<DVec2>>,
    discs: Vec<(DVec2, f64)>,
    /// Parts that meshes take away.
    regions: Vec<Region>,
}

/// Directed edges around a part of the plane: counter-clockwise around what it holds.
#[derive(Clone, Debug)]
struct Region {
    edges: Vec<[DVec2; 2]>,
    low: DVec2,
    high: DVec2,
}

impl Domain {
    /// One per face of the room and its boxes, in the order of their numbers. Meshes are cut out of the room's faces, not of
    /// the faces of boxes: photons are missing there within a gather radius of a mesh that stands on a box.
    pub fn of_surfaces(scene: &TraceableScene) -> Vec<Self> {
        let mut domains: Vec<Self> = Face::ALL.iter().map(|face| Self::room_face(scene, *face)).collect();
        for object in &scene.boxes {
            domains.extend((0..6).map(|face| {
                let [corner, u, v] = object.face(face);
                Self::rectangle(corner, u, v)
            }));
        }
        domains
    }

    /// The horizontal plane at `height` inside the room, minus the boxes and closed meshes that it cuts.
    pub fn horizontal_plane(scene: &TraceableScene, height: f64) -> Self {
        let mut domain =
            Self::rectangle(DVec3::new(0.0, 0.0, height), DVec3::X * scene.size.x, DVec3::Y * scene.size.y);
        for object in &scene.boxes {
            let (low, high) = object.span();
            if low <= height && height < high {
                domain.holes.push(object.outline().to_vec());
            }
        }
        domain.cut_sections(scene, 1.0);
        domain
    }

    /// Area in m2 of the domain within `radius` of a point of its plane.
    #[inline]
    pub fn area(&self, centre: DVec3, radius: f64) -> f64 {
        let relative = centre - self.origin;
        let p = DVec2::new(relative.dot(self.u), relative.dot(self.v));
        let inside = p.x >= radius && p.y >= radius && self.size.x - p.x >= radius && self.size.y - p.y >= radius;
        let mut area = if inside { PI * radius * radius } else { self.outline_area(p, radius) };
        for hole in &self.holes {
            area -= disc_polygon_area(p, radius, hole);
        }
        for (disc, disc_radius) in &self.discs {
            area -= disc_disc_area(radius, *disc_radius, (p - *disc).length());
        }
        for region in &self.regions {
            area -= region.area(p, radius);
        }
        area.max(0.0)
    }

    fn outline_area(&self, p: DVec2, radius: f64) -> f64 {
        let DVec2 { x, y } = self.size;
        disc_polygon_area(p, radius, &[DVec2::ZERO, DVec2::new(x, 0.0), DVec2::new(x, y), DVec2::new(0.0, y)])
    }

    fn rectangle(origin: DVec3, u: DVec3, v: DVec3) -> Self {
        let size = DVec2::new(u.length(), v.length());
        Self { origin, u: u / size.x, v: v / size.y, size, holes: Vec::new(), discs: Vec::new(), regions: Vec::new() }
    }

    /// Takes away a polygon of the plane through `origin`.
    fn cover(&mut self, origin: DVec3, corners: &[DVec3; 4]) {
        let flat = |p: DVec3| DVec2::new((p - origin).dot(self.u), (p - origin).dot(self.v));
        let mut hole = corners.map(flat).to_vec();
        if signed_area(&hole) < 0.0 {
            hole.reverse();
        }
        self.holes.push(hole);
    }

    /// Takes away where closed meshes stand on the plane or reach through it, seen a hair's breadth to the `side` of
    /// u x v; returns the outlines.
    fn cut_sections(&mut self, scene: &TraceableScene, side: f64) -> Vec<Vec<DVec3>> {
        let Some(meshes) = &scene.meshes else { return Vec::new() };
        let normal = self.u.cross(self.v);
        let rings = meshes.section(normal, normal.dot(self.origin) + side * scene.coinciding());
        for ring in &rings {
            let edges = (0..ring.len()).map(|k| [self.flat(ring[k]), self.flat(ring[(k + 1) % ring.len()])]);
            self.regions.push(Region::new(edges.collect()));
        }
        rings
    }

    /// Takes away mesh surfaces that lie in the plane, unless `rings` hold them: the bottom of what stands there.
    fn cut_facets(&mut self, scene: &TraceableScene, rings: &[Vec<DVec3>]) {
        let Some(meshes) = &scene.meshes else { return };
        let normal = self.u.cross(self.v);
        let height = normal.dot(self.origin);
        let in_plane = |p: &DVec3| (normal.dot(*p) - height).abs() <= scene.coinciding();
        for facet in 0..meshes.facets.len() {
            let edges = meshes.facets.edges(facet);
            if edges.is_empty() || !edges.iter().flatten().all(in_plane) {
                continue;
            }
            let inside = meshes.point_of(facet);
            if rings.iter().filter(|ring| contains(ring, inside, normal)).count() % 2 == 1 {
                continue;
            }
            let same = meshes.facets.normals[facet].dot(normal) > 0.0;
            let turned = |[a, b]: &[DVec3; 2]| {
                let (a, b) = (self.flat(*a), self.flat(*b));
                if same { [a, b] } else { [b, a] }
            };
            self.regions.push(Region::new(edges.iter().map(turned).collect()));
        }
    }

    /// Coordinates along u and v.
    fn flat(&self, p: DVec3) -> DVec2 {
        DVec2::new((p - self.origin).dot(self.u), (p - self.origin).dot(self.v))
    }

    fn room_face(scene: &TraceableScene, face: Face) -> Self {
        let axis = face as usize / 2;
        let mut origin = DVec3::ZERO;
        if face as usize % 2 == 1 {
            origin[axis] = scene.size[axis];
        }
        let edge = |k: usize| DVec3::AXES[k] * scene.size[k];
        let mut domain = Self::rectangle(origin, edge((axis + 1) % 3), edge((axis + 2) % 3));
        // faces of boxes that stand against this one cover it
        let tolerance = 1e-9 * scene.size.max_element();
        for object in &scene.boxes {
            for side in 0..6 {
                let [corner, u, v] = object.face(side);
                let corners = [corner, corner + u, corner + u + v, corner + v];
                if corners.iter().all(|p| (p[axis] - origin[axis]).abs() <= tolerance) {
                    domain.cover(origin, &corners);
                }
            }
        }
        for luminaire in &scene.luminaires {
            let corners = luminaire.corners();
            if corners.iter().all(|p| (p[axis] - origin[axis]).abs() <= scene.coinciding()) {
                domain.cover(origin, &corners);
            }
        }
        let rings = domain.cut_sections(scene, if face as usize % 2 == 1 { -1.0 } else { 1.0 });
        domain.cut_facets(scene, &rings);
        if face == Face::Ceiling {
            let flat = |p: DVec3| DVec2::new((p - origin).dot(domain.u), (p - origin).dot(domain.v));
            domain.discs = scene.tubes.iter().map(|tube| (flat(tube.origin), tube.opening_radius)).collect();
        }
        domain
    }
}

impl Region {
    fn new(edges: Vec<[DVec2; 2]>) -> Self {
        let corners = || edges.iter().flatten();
        let low = corners().fold(DVec2::INFINITY, |low, p| low.min(*p));
        let high = corners().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
        Self { edges, low, high }
    }

    /// Area in m2 within `radius` of a point.
    fn area(&self, p: DVec2, radius: f64) -> f64 {
        let apart = (self.low - p).max(p - self.high).max_element();
        if apart >= radius {
            return 0.0;
        }
        self.edges.iter().map(|[a, b]| disc_edge_area(radius, *a - p, *b - p)).sum()
    }
}

fn signed_area(polygon: &[DVec2]) -> f64 {
    (0..polygon.len()).map(|k| 0.5 * polygon[k].perp_dot(polygon[(k + 1) % polygon.len()])).sum()
}
