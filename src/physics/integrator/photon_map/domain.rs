//! The part of a plane on which photons can lie: gather discs are clipped to it, so that kernels have no boundary bias.
//!
//! From every plane is taken what stands on it or reaches through it, seen a hair's breadth before it: sections of boxes and
//! of closed pieces of meshes, together, so that what several cover counts once.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::geometry::covered::{Edge, bounds, covered, polygon, rectangle};
use crate::geometry::disc::{disc_disc_area, disc_edge_area, disc_polygon_area};
use crate::traceable::TraceableScene;
use crate::traceable::solids::{Owner, Sections, Sheet, Solid, sections};

/// A rectangle minus what covers it, and minus discs, all in one plane.
#[derive(Clone, Debug)]
pub struct Domain {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
    /// 1 where the side of u x v is seen, -1 where the other one is.
    looks: f64,
    /// Extent along u and v of the rectangle around it.
    size: DVec2,
    /// Edges of the outline, where that is not the rectangle.
    outline: Option<Vec<Edge>>,
    discs: Vec<(DVec2, f64)>,
    /// Parts that are covered.
    regions: Vec<Region>,
}

/// Directed edges around a part of the plane: counter-clockwise around what it holds.
#[derive(Clone, Debug)]
pub struct Region {
    edges: Vec<Edge>,
    low: DVec2,
    high: DVec2,
}

/// Whether mesh surfaces and luminaires that lie in a plane cover it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Flat {
    /// The plane is a face: what lies on it hides it.
    Covers,
    /// The plane is that of a grid, which counts what arrives there.
    Passes,
}

impl Domain {
    /// The horizontal plane at `height` inside the room, minus the boxes and closed meshes that it cuts.
    pub fn horizontal_plane(scene: &TraceableScene, height: f64) -> Self {
        let ([low, _], size) = (scene.enclosure.bounds(), scene.enclosure.extent());
        let mut domain = Self::rectangle(low.with_z(height), DVec3::X * size.x, DVec3::Y * size.y, 1.0);
        if scene.enclosure.as_box().is_none() {
            let cut = scene.enclosure.polygons.iter().flat_map(|face| face.level_cut(height));
            domain.outline = Some(cut.map(|edge| edge.map(|p| p - low.truncate())).collect());
        }
        domain.cut(scene, &Solid::all(scene), None, Flat::Passes);
        domain
    }

    /// Area in m2 of the domain within `radius` of a point of its plane.
    #[inline]
    pub fn area(&self, centre: DVec3, radius: f64) -> f64 {
        let relative = centre - self.origin;
        let p = DVec2::new(relative.dot(self.u), relative.dot(self.v));
        let inside = self.outline.is_none()
            && p.x >= radius
            && p.y >= radius
            && self.size.x - p.x >= radius
            && self.size.y - p.y >= radius;
        let mut area = if inside { PI * radius * radius } else { self.outline_area(p, radius) };
        for (disc, disc_radius) in &self.discs {
            area -= disc_disc_area(radius, *disc_radius, (p - *disc).length());
        }
        for region in &self.regions {
            area -= region.area(p, radius);
        }
        area.max(0.0)
    }

    fn outline_area(&self, p: DVec2, radius: f64) -> f64 {
        if let Some(edges) = &self.outline {
            return edges.iter().map(|[a, b]| disc_edge_area(radius, *a - p, *b - p)).sum();
        }
        let DVec2 { x, y } = self.size;
        disc_polygon_area(p, radius, &[DVec2::ZERO, DVec2::new(x, 0.0), DVec2::new(x, y), DVec2::new(0.0, y)])
    }

    /// A rectangle from a corner along two edges, seen from the side of u x v where `looks` is 1, else from the other.
    pub fn rectangle(origin: DVec3, u: DVec3, v: DVec3, looks: f64) -> Self {
        let size = DVec2::new(u.length(), v.length());
        let (u, v) = (u / size.x, v / size.y);
        Self { origin, u, v, looks, size, outline: None, discs: Vec::new(), regions: Vec::new() }
    }

    /// Takes away what covers the rectangle, but for the solid `own` whose face it is; true if a mesh that is not closed
    /// stands there.
    pub fn cut(&mut self, scene: &TraceableScene, solids: &[Solid], own: Option<Owner>, flat: Flat) -> bool {
        let (origin, u, v) = (self.origin, self.u * self.size.x, self.v * self.size.y);
        let corners = [origin, origin + u, origin + u + v, origin + v];
        let sheet = Sheet {
            origin,
            u: self.u,
            v: self.v,
            seen: self.looks * self.u.cross(self.v),
            low: corners.iter().fold(DVec3::INFINITY, |low, p| low.min(*p)),
            high: corners.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p)),
            hair: scene.coinciding(),
        };
        let near = solids.iter().filter(|solid| Some(solid.of) != own && solid.may_cut(&sheet));
        let Sections { mut covers, open } = sections(near, &sheet);
        if flat == Flat::Covers {
            covers.extend(flat_covers(scene, &sheet));
        }
        let whole = rectangle(DVec2::ZERO, self.size);
        self.regions = regions(self.outline.as_ref().unwrap_or(&whole), covers, scene);
        open
    }

    /// A face of the room, whole.
    pub fn room_face(scene: &TraceableScene, face: usize) -> Self {
        let polygon = &scene.enclosure.polygons[face];
        let [origin, u, v] = polygon.rectangle();
        let mut domain = Self::rectangle(origin, u, v, 1.0);
        let (u, v) = (domain.u, domain.v);
        let flat = |p: DVec3| DVec2::new((p - origin).dot(u), (p - origin).dot(v));
        if scene.enclosure.as_box().is_none() {
            domain.outline = Some(polygon.sides().map(|side| side.map(flat)).collect());
        }
        let openings = scene.tubes.iter().filter(|tube| tube.face == face && !tube.hangs);
        domain.discs = openings.map(|tube| (flat(tube.origin), tube.opening_radius)).collect();
        domain
    }
}

/// Luminaires and mesh surfaces that lie in the plane of a sheet.
fn flat_covers(scene: &TraceableScene, sheet: &Sheet) -> Vec<Vec<Edge>> {
    let near = scene.coinciding();
    let in_plane = |p: &DVec3| (*p - sheet.origin).dot(sheet.seen).abs() <= near;
    let corners = scene.luminaires.iter().map(|luminaire| luminaire.corners());
    let lying = corners.filter(|corners| corners.iter().all(in_plane));
    let mut covers: Vec<Vec<Edge>> = lying.map(|corners| polygon(&corners.map(|p| sheet.flat(p)))).collect();
    if let Some(meshes) = &scene.meshes {
        for facet in 0..meshes.facets.len() {
            let edges = meshes.facets.edges(facet);
            if !edges.is_empty() && edges.iter().flatten().all(in_plane) {
                covers.push(edges.iter().map(|edge| edge.map(|p| sheet.flat(p))).collect());
            }
        }
    }
    covers
}

/// Covers that are near each other, and bounds around them.
struct Group {
    covers: Vec<Vec<Edge>>,
    low: DVec2,
    high: DVec2,
}

/// The covered parts of an outline: one region for covers that are near each other.
pub fn regions(outline: &[Edge], covers: Vec<Vec<Edge>>, scene: &TraceableScene) -> Vec<Region> {
    let tolerance = 4.0 * scene.coinciding();
    let gap = 16.0 * tolerance;
    let mut groups: Vec<Group> = Vec::new();
    for cover in covers {
        let (low, high) = bounds(cover.iter());
        let mut all = Group { covers: vec![cover], low, high };
        let near =
            |all: &Group, one: &Group| all.low.cmple(one.high + gap).all() && one.low.cmple(all.high + gap).all();
        // joined groups may reach further ones
        while let Some(other) = groups.iter().position(|group| near(&all, group)) {
            let Group { covers, low, high } = groups.swap_remove(other);
            all.covers.extend(covers);
            (all.low, all.high) = (all.low.min(low), all.high.max(high));
        }
        groups.push(all);
    }
    let regions = groups.iter().map(|group| Region::new(covered(outline, &group.covers, tolerance)));
    regions.filter(|region| !region.edges.is_empty()).collect()
}

impl Region {
    fn new(edges: Vec<Edge>) -> Self {
        let (low, high) = bounds(edges.iter());
        Self { edges, low, high }
    }

    /// Area in m2 within `radius` of a point.
    pub fn area(&self, p: DVec2, radius: f64) -> f64 {
        let apart = (self.low - p).max(p - self.high).max_element();
        if apart >= radius {
            return 0.0;
        }
        self.edges.iter().map(|[a, b]| disc_edge_area(radius, *a - p, *b - p)).sum()
    }
}
