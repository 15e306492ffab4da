//! Recognition of meshes that are cylinders: they are replaced by the closed form, or the effect of their facets is described.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::mesh::Part;
use super::recognise_bend::{self, NOT_STRAIGHT};
use crate::geometry::TriangleMesh;
use crate::geometry::turn::angle_between;
use crate::geometry::welded;
use crate::optics::Mirror;

/// Largest distance of a vertex from the ideal cylinder, in radii.
const TOLERANCE: f64 = 1e-4;

/// Largest angle in radians by which an edge may turn about the axis; a pipe with fewer than 16 sides is taken as meant to have them.
const MOST_TURN: f64 = TAU / 16.0 * (1.0 + 1e-9);

/// Result of the search for cylinders in a mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum Section {
    /// A cylinder that replaces the mesh.
    Cylinder(RecognisedCylinder),
    /// Cylinders with elbows that replace the mesh.
    Bend(RecognisedBend),
    /// A mesh that is traced facet by facet.
    Facets {
        /// Number of sides of the pipe's lower end, if its vertices lie on one circle around the axis.
        sides: Option<usize>,
        /// Reason why the mesh is not replaced by a cylinder.
        reason: &'static str,
    },
}

/// A straight vertical circular cylinder from z = 0 to z = `length`, open or under a thin cover that does not reflect.
///
/// Its radius is that of the mesh's vertices: modellers put the vertices of a round pipe on the circle, so that the intended pipe is the
/// one around the facets.
#[derive(Clone, Debug, PartialEq)]
pub struct RecognisedCylinder {
    /// Radius in m of the circle through the vertices.
    pub radius: f64,
    /// Length in m, from the opening to the upper end.
    pub length: f64,
    /// Number of sides of the mesh's lower end.
    pub sides: usize,
    /// Largest distance of a vertex from the ideal cylinder, in metres.
    pub deviation: f64,
    /// Reflectance of the wall, per bounce.
    pub reflectance: Mirror,
    /// Transmittance of the cover, linear Rec.709; 1 for an open upper end.
    pub collector_transmittance: [f64; 3],
}

/// Equal cylinders that meet in mitred elbows, open or under a thin cover that does not reflect; their radius is that of the mesh's
/// vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct RecognisedBend {
    /// Radius in m of the circles through the vertices.
    pub radius: f64,
    /// Segments from the opening upward: length in m along the axis and unit axis, in the mesh's frame.
    pub segments: Vec<(f64, DVec3)>,
    /// Number of sides of the mesh's rings.
    pub sides: usize,
    /// Largest distance of a vertex from the ideal cylinders, in metres.
    pub deviation: f64,
    /// Reflectance of the wall, per bounce.
    pub reflectance: Mirror,
    /// Transmittance of the cover, linear Rec.709; 1 for an open upper end.
    pub collector_transmittance: [f64; 3],
}

/// Computes the area of a regular polygon of `sides` >= 3 sides with its vertices on a circle, over the circle's area: (n / 2 pi) sin(2 pi
/// / n).
///
/// ```
/// // a square in the unit circle has an area of 2
/// assert!((skyduct_physics::guide::recognise::area_factor(4) - 2.0 / std::f64::consts::PI).abs() < 1e-15);
/// ```
pub fn area_factor(sides: usize) -> f64 {
    let n = sides as f64;
    n / TAU * libm::sin(TAU / n)
}

/// Computes the mean number of reflections in a prism over a regular polygon of `sides` sides, relative to the cylinder around it: the
/// ratio of circumference to area.
///
/// ```
/// assert!((skyduct_physics::guide::recognise::bounce_factor(4) - 2f64.sqrt()).abs() < 1e-15);
/// ```
pub fn bounce_factor(sides: usize) -> f64 {
    1.0 / libm::cos(PI / sides as f64)
}

/// Recognises cylinders in a mesh in metres in the tube's frame; `parts` has one entry per material; `radius` is that of the opening in
/// metres.
pub fn recognise(mesh: &TriangleMesh, parts: &[Part], radius: f64) -> Section {
    let pipe = Surface::new(mesh, parts, |part| matches!(part, Part::Pipe { .. }));
    let sides = sides(&pipe, radius * TOLERANCE);
    match cylinder(mesh, parts, &pipe, radius) {
        Ok(cylinder) => return Section::Cylinder(cylinder),
        Err(NOT_STRAIGHT) => {}
        Err(reason) => return Section::Facets { sides, reason },
    }
    match bent(mesh, parts, radius) {
        Ok(bend) => Section::Bend(bend),
        Err(reason) => Section::Facets { sides, reason },
    }
}

fn bent(mesh: &TriangleMesh, parts: &[Part], radius: f64) -> Result<RecognisedBend, &'static str> {
    let tolerance = radius * TOLERANCE;
    let reflectance = reflectance(mesh, parts)?;
    let bend = recognise_bend::bend(mesh, parts, radius, tolerance, MOST_TURN)?;
    let length = radius;
    let upright = recognise_bend::upright(mesh, &bend, length);
    let mut deviation = bend.deviation;
    let collector_transmittance = cover(&upright, parts, radius, length, &mut deviation)?;
    let (segments, sides) = (bend.segments, bend.sides);
    Ok(RecognisedBend { radius, segments, sides, deviation, reflectance, collector_transmittance })
}

/// True if any triangle of the mesh has this material.
fn is_used(mesh: &TriangleMesh, material: usize) -> bool {
    mesh.triangle_materials.iter().any(|used| *used as usize == material)
}

/// Returns the reflectance of the pipe; fails if there are several.
fn reflectance(mesh: &TriangleMesh, parts: &[Part]) -> Result<Mirror, &'static str> {
    let mut reflectances = parts.iter().enumerate().filter_map(|(material, part)| match part {
        Part::Pipe { reflectance } if is_used(mesh, material) => Some(reflectance),
        _ => None,
    });
    let reflectance = reflectances.next().ok_or("it has no pipe")?;
    match reflectances.all(|other| other == reflectance) {
        true => Ok(reflectance.clone()),
        false => Err("its pipe has several reflectances"),
    }
}

/// Describes a mesh that keeps its facets because the document requests it; takes the arguments of [`recognise`].
pub fn keep_facets(mesh: &TriangleMesh, parts: &[Part], radius: f64) -> Section {
    let pipe = Surface::new(mesh, parts, |part| matches!(part, Part::Pipe { .. }));
    Section::Facets { sides: sides(&pipe, radius * TOLERANCE), reason: "the document has `recognise` set to false" }
}

/// Edges of one part of a mesh, with the number of triangles at each.
struct Surface {
    vertices: Vec<DVec3>,
    /// Edges by their two vertex indices, with the number of triangles at each.
    edges: Vec<([u32; 2], u32)>,
}

impl Surface {
    fn new(mesh: &TriangleMesh, parts: &[Part], is_member: impl Fn(&Part) -> bool) -> Self {
        let places = welded::places(&mesh.positions);
        let members = mesh.triangles.iter().zip(&mesh.triangle_materials);
        let members =
            members.filter(|(_, material)| is_member(&parts[**material as usize])).map(|(corners, _)| corners);
        // a vertex for every place that a member has
        let mut numbers = vec![u32::MAX; mesh.positions.len()];
        let mut vertices = Vec::new();
        let mut triangles = Vec::with_capacity(mesh.triangles.len());
        for (triangle, corners) in members.enumerate() {
            let corners = corners.map(|corner| {
                let number = &mut numbers[places[corner as usize] as usize];
                if *number == u32::MAX {
                    *number = vertices.len() as u32;
                    vertices.push(mesh.positions[corner as usize]);
                }
                *number
            });
            triangles.push((triangle as u32, corners));
        }
        let sides = welded::sides(triangles.iter().copied());
        let edges = sides.chunk_by(|a, b| a.edge == b.edge);
        let edges = edges.filter_map(|sides| Some((sides.first()?.edge, sides.len() as u32))).collect();
        Self { edges, vertices }
    }

    /// Returns the ends of each edge.
    fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.edges.iter().map(|(ends, _)| self.ends(*ends))
    }

    /// Returns the ends of each edge at the border, which has one triangle.
    fn boundary(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.edges.iter().filter(|(_, uses)| *uses == 1).map(|(ends, _)| self.ends(*ends))
    }

    fn ends(&self, ends: [u32; 2]) -> (DVec3, DVec3) {
        ends.map(|end| self.vertices[end as usize]).into()
    }

    /// True if every edge has at most two triangles.
    fn is_manifold(&self) -> bool {
        self.edges.iter().all(|(_, uses)| *uses <= 2)
    }

    /// Returns the sum of the angles about the axis of the border edges at height `z`, and their number.
    fn turn_at(&self, z: f64, tolerance: f64) -> (f64, usize) {
        let at = |p: DVec3| (p.z - z).abs() <= tolerance;
        let edges = self.boundary().filter(|(a, b)| at(*a) && at(*b));
        edges.fold((0.0, 0), |(turn, count), (a, b)| (turn + turn_between(a, b), count + 1))
    }
}

fn turn_between(a: DVec3, b: DVec3) -> f64 {
    angle_between(a.truncate(), b.truncate()).abs()
}

/// Returns the number of sides of the border at z = 0, if its vertices are at one distance from the axis and it goes round once.
fn sides(pipe: &Surface, tolerance: f64) -> Option<usize> {
    let radii = || pipe.boundary().filter(|(a, b)| a.z.abs() <= tolerance && b.z.abs() <= tolerance);
    let first = radii().next()?.0.truncate().length();
    let round = radii().all(|(a, b)| [a, b].iter().all(|p| (p.truncate().length() - first).abs() <= tolerance));
    let (turn, count) = pipe.turn_at(0.0, tolerance);
    (round && (turn - TAU).abs() < 1e-6).then_some(count)
}

fn cylinder(
    mesh: &TriangleMesh,
    parts: &[Part],
    pipe: &Surface,
    radius: f64,
) -> Result<RecognisedCylinder, &'static str> {
    let reflectance = reflectance(mesh, parts)?;
    let tolerance = radius * TOLERANCE;
    let length = pipe.vertices.iter().map(|p| p.z).fold(0.0, f64::max);
    let mut deviation: f64 = 0.0;
    for p in &pipe.vertices {
        let off = (p.truncate().length() - radius).abs();
        if off > tolerance {
            return Err(NOT_STRAIGHT);
        }
        deviation = deviation.max(off);
    }
    if !pipe.is_manifold() || pipe.edges().any(|(a, b)| turn_between(a, b) > MOST_TURN) {
        return Err("its pipe is not a single wall of at least 16 sides");
    }
    for (a, b) in pipe.boundary() {
        let off = |z: f64| (a.z - z).abs().max((b.z - z).abs());
        let nearest = off(0.0).min(off(length));
        if nearest > tolerance {
            return Err("its pipe has holes, or ends that are not level");
        }
        deviation = deviation.max(nearest);
    }
    let ((lower, sides), (upper, _)) = (pipe.turn_at(0.0, tolerance), pipe.turn_at(length, tolerance));
    if (lower - TAU).abs() > 1e-6 || (upper - TAU).abs() > 1e-6 {
        return Err("its pipe does not go exactly once around its axis");
    }
    let collector_transmittance = cover(mesh, parts, radius, length, &mut deviation)?;
    Ok(RecognisedCylinder { radius, length, sides, deviation, reflectance, collector_transmittance })
}

/// Returns the transmittance of a cover that every ray into the pipe crosses once: no cover (1), a flat one, or a hemisphere; fails for
/// others.
fn cover(
    mesh: &TriangleMesh,
    parts: &[Part],
    radius: f64,
    length: f64,
    deviation: &mut f64,
) -> Result<[f64; 3], &'static str> {
    let mut covers = parts.iter().enumerate().filter_map(|(material, part)| match part {
        Part::Collector { transmittance, reflectance } if is_used(mesh, material) => {
            Some((*transmittance, *reflectance))
        }
        _ => None,
    });
    let Some((transmittance, reflectance)) = covers.next() else { return Ok([1.0; 3]) };
    if covers.any(|other| other != (transmittance, reflectance)) {
        return Err("its collector has several materials");
    }
    if reflectance != [0.0; 3] {
        return Err("its collector reflects");
    }
    let surface = Surface::new(mesh, parts, |part| matches!(part, Part::Collector { .. }));
    let tolerance = radius * TOLERANCE;
    let centre = DVec3::Z * length;
    let level = surface.vertices.iter().map(|p| (p.z - length).abs()).fold(0.0, f64::max);
    let round = surface.vertices.iter().map(|p| ((*p - centre).length() - radius).abs()).fold(0.0, f64::max);
    let above = surface.vertices.iter().all(|p| p.z >= length - tolerance);
    let rim = surface.boundary().flat_map(|(a, b)| [a, b]).map(|p| (p.truncate().length() - radius).abs());
    let off = level.min(if above { round } else { f64::INFINITY }).max(rim.fold(0.0, f64::max));
    let (turn, count) = surface.turn_at(length, tolerance);
    let closed = surface.is_manifold() && (turn - TAU).abs() < 1e-6 && count == surface.boundary().count();
    if off > tolerance || !closed {
        return Err("its collector is neither a flat cover nor a hemisphere on the pipe's upper end");
    }
    *deviation = deviation.max(off);
    Ok(transmittance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the values of docs/physics/tubes.md#meshes-and-facets, to the digits given there.
    #[test]
    fn facet_factors_of_the_table() {
        let table = [(16, 0.9745, 1.0196), (24, 0.98862, 1.00863), (48, 0.99715, 1.00215), (64, 0.99839, 1.00121)];
        for (sides, area, bounces) in table {
            assert!((area_factor(sides) - area).abs() < 6e-5 && (bounce_factor(sides) - bounces).abs() < 6e-5);
        }
    }
}
