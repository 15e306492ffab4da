//! Parts of a plane on which photons can lie: gather discs are clipped to them, so that kernels have no boundary bias.
//!
//! Sections of boxes and of closed pieces of meshes that stand on the plane or reach through it are subtracted, taken at a small distance
//! before the plane. They are joined first, so that an area covered by several counts once.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::geometry::covered::{Edge, bounds, covered, enclosed_area, polygon, rectangle};
use crate::geometry::disc::{disc_disc_area, disc_edge_area, disc_polygon_area};
use crate::traceable::TraceableScene;
use crate::traceable::solids::{Owner, Sections, Sheet, Solid, sections};

/// Rectangle or polygon of one plane, without covered regions and discs.
#[derive(Clone, Debug)]
pub struct Domain {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
    /// 1 if the side of u x v is seen, -1 if the other side is.
    looks: f64,
    /// Extent in m along u and v of the bounding rectangle.
    size: DVec2,
    /// Edges of the outline; `None` if it is the bounding rectangle.
    outline: Option<Vec<Edge>>,
    /// Round openings, and square ones.
    discs: Vec<(DVec2, f64)>,
    squares: Vec<Region>,
    /// Covered parts.
    regions: Vec<Region>,
}

/// Part of a plane, bounded by directed edges that run counter-clockwise around it.
#[derive(Clone, Debug)]
pub struct Region {
    edges: Vec<Edge>,
    low: DVec2,
    high: DVec2,
}

/// Rule for mesh surfaces and luminaires that lie in a plane.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Flat {
    /// The plane is a face: surfaces that lie on it cover it.
    Covers,
    /// The plane is that of a grid: surfaces that lie in it do not cover it, and light that arrives there is counted.
    Passes,
}

impl Domain {
    /// Creates the domain of the horizontal plane at `height` m inside the room, without the boxes and closed meshes that it cuts.
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

    /// Returns the area in m2 of the domain within `radius` m of a point of its plane.
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
        for region in self.squares.iter().chain(&self.regions) {
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

    /// Creates a rectangle from a corner along two edges, seen from the side of u x v if `looks` is 1, from the other side if it is -1.
    pub fn rectangle(origin: DVec3, u: DVec3, v: DVec3, looks: f64) -> Self {
        let size = DVec2::new(u.length(), v.length());
        let (u, v) = (u / size.x, v / size.y);
        Self { origin, u, v, looks, size, outline: None, discs: vec![], squares: vec![], regions: vec![] }
    }

    /// Subtracts the solids that cover the domain, except the solid `own` whose face it is; true if a mesh that is not closed stands there.
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

    /// Creates the domain of a face of the room without its openings; solids are not subtracted.
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
        for tube in openings {
            match tube.corners() {
                Some(corners) => domain.squares.push(Region::around(&corners.map(flat))),
                None => domain.discs.push((flat(tube.frame.origin), tube.opening.outer_radius())),
            }
        }
        domain
    }
}

/// Returns the outlines of luminaires and mesh surfaces that lie in the plane of a sheet.
fn flat_covers(scene: &TraceableScene, sheet: &Sheet) -> Vec<Vec<Edge>> {
    let near = scene.coinciding();
    let in_plane = |p: &DVec3| (*p - sheet.origin).dot(sheet.seen).abs() <= near;
    let corners = scene.luminaires.iter().map(|luminaire| luminaire.corners());
    let lying = corners.filter(|corners| corners.iter().all(in_plane));
    let mut covers: Vec<Vec<Edge>> = lying.map(|corners| polygon(&corners.map(|p| sheet.flat(p)))).collect();
    if let Some(meshes) = &scene.meshes {
        for facet in 0..meshes.facet_count() {
            let edges = meshes.edges(facet);
            if edges.clone().next().is_some() && edges.clone().flatten().all(|end| in_plane(&end)) {
                covers.push(edges.map(|edge| edge.map(|p| sheet.flat(p))).collect());
            }
        }
    }
    covers
}

/// Covers that are near each other, with their bounds.
struct Group {
    covers: Vec<Vec<Edge>>,
    low: DVec2,
    high: DVec2,
}

/// Returns the covered parts of an outline: one region for each group of covers that are near each other.
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
    /// Returns the region inside a simple polygon.
    fn around(corners: &[DVec2]) -> Self {
        let mut edges = polygon(corners);
        if enclosed_area(&edges) < 0.0 {
            edges.iter_mut().for_each(|edge| edge.reverse());
        }
        Self::new(edges)
    }

    fn new(edges: Vec<Edge>) -> Self {
        let (low, high) = bounds(edges.iter());
        Self { edges, low, high }
    }

    /// Returns the area in m2 of the region within `radius` m of a point.
    pub fn area(&self, p: DVec2, radius: f64) -> f64 {
        let apart = (self.low - p).max(p - self.high).max_element();
        if apart >= radius {
            return 0.0;
        }
        self.edges.iter().map(|[a, b]| disc_edge_area(radius, *a - p, *b - p)).sum()
    }
}
