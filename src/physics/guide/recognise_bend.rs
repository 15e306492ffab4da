//! Recognition of meshes that are round pipes with elbows: rings of vertices, one above the other, around a piecewise straight axis.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use super::mesh::Part;
use crate::geometry::TriangleMesh;
use crate::geometry::turn::angle_between;
use crate::geometry::welded;
use crate::sampling::warp;

/// Reason reported for a pipe that is no straight cylinder and has no elbows either.
pub(super) const NOT_STRAIGHT: &str = "its pipe is not a straight vertical cylinder of the opening's diameter";

/// Largest tangent of half a bend's angle, beyond which the mitre's ellipse grows without bound: 175 degrees.
const STEEPEST_HALF: f64 = 22.9;

/// Largest number of segments of a guide that is taken as made of elbows.
const MOST_SEGMENTS: usize = 64;

/// Equal cylinders that meet in mitred elbows, the first of them vertical.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bend {
    /// Length in m along the axis and unit axis of each segment, from the opening upward; at least two.
    pub segments: Vec<(f64, DVec3)>,
    /// Centre of the upper end in m.
    pub end: DVec3,
    /// Number of vertices of every ring.
    pub sides: usize,
    /// Largest distance of a vertex from the ideal cylinders, in m.
    pub deviation: f64,
}

/// Recognises the pipe of a mesh as a bend: vertices within `tolerance` m of cylinders of `radius` m, edges that turn by no more than
/// `most_turn` radians about the axis. Else returns the reason.
pub(super) fn bend(
    mesh: &TriangleMesh,
    parts: &[Part],
    radius: f64,
    tolerance: f64,
    most_turn: f64,
) -> Result<Bend, &'static str> {
    let pipe = PipeGraph::new(mesh, parts);
    let rings = pipe.rings(tolerance)?;
    let centres: Vec<DVec3> = rings.iter().map(|ring| pipe.centre(ring)).collect();
    let nodes = nodes(&centres, tolerance);
    if nodes.len() < 3 {
        return Err(NOT_STRAIGHT);
    }
    if nodes.len() > MOST_SEGMENTS + 1 {
        return Err("its pipe does not consist of a few straight pieces");
    }
    let (first, last) = (centres[0], centres[centres.len() - 1]);
    let segments: Vec<(f64, DVec3)> = nodes
        .windows(2)
        .map(|ends| {
            let axis = centres[ends[1]] - centres[ends[0]];
            (axis.length(), axis.normalize())
        })
        .collect();
    let (lowest, highest) = (segments[0], segments[segments.len() - 1]);
    if first.length() > tolerance || lowest.1.truncate().length() * lowest.0 > tolerance {
        return Err("its pipe does not begin vertically around the opening's centre");
    }
    if !has_room(&segments, radius) {
        return Err("the mitres of its bends cross");
    }
    // every vertex on the cylinders of its ring's segments, those of an elbow on its mitre, the last ring level with its axis
    let mut deviation: f64 = 0.0;
    for (number, ring) in rings.iter().enumerate() {
        let upper = nodes.partition_point(|node| *node <= number).clamp(1, segments.len());
        let is_elbow = upper >= 2 && nodes[upper - 1] == number && number > 0;
        let around = if is_elbow { upper - 2..upper } else { upper - 1..upper };
        for place in ring {
            let position = pipe.positions[place];
            for segment in around.clone() {
                let away = position - centres[nodes[segment]];
                let axis = segments[segment].1;
                deviation = deviation.max(((away - axis * away.dot(axis)).length() - radius).abs());
            }
            let out_of_plane = |normal: DVec3| (position - centres[number]).dot(normal).abs();
            if is_elbow {
                deviation = deviation.max(out_of_plane((segments[upper - 2].1 + segments[upper - 1].1).normalize()));
            } else if number + 1 == rings.len() {
                deviation = deviation.max(out_of_plane(highest.1));
            }
        }
        let axis = segments[around.start].1;
        let (turn, largest) = pipe.turn(ring, centres[number], axis);
        if (turn - TAU).abs() > 1e-6 || largest > most_turn {
            return Err("its pipe is not a single wall of at least 16 sides");
        }
    }
    if deviation > tolerance {
        return Err("its pipe does not consist of cylinders of the opening's diameter");
    }
    Ok(Bend { segments, end: last, sides: rings[0].len(), deviation })
}

/// Returns the mesh in a frame in which the last segment of a bend is the upper end of a vertical pipe of `length` m.
pub(super) fn upright(mesh: &TriangleMesh, bend: &Bend, length: f64) -> TriangleMesh {
    let axis = bend.segments.last().map_or(DVec3::Z, |(_, axis)| *axis);
    let to_local = DMat3::from_cols(warp::around(axis, DVec3::X), warp::around(axis, DVec3::Y), axis).transpose();
    let positions = mesh.positions.iter().map(|position| to_local * (*position - bend.end) + DVec3::Z * length);
    TriangleMesh { positions: positions.collect(), ..mesh.clone() }
}

/// Returns the indices of the rings at which the axis turns, and of both ends.
fn nodes(centres: &[DVec3], tolerance: f64) -> Vec<usize> {
    let mut nodes = vec![0];
    let mut from = 0;
    for next in 2..centres.len() {
        let axis = (centres[next] - centres[from]).normalize_or_zero();
        let off = |centre: &DVec3| {
            let away = *centre - centres[from];
            (away - axis * away.dot(axis)).length()
        };
        // rounding of the digits of a file moves a centre by far less than the tolerance of vertices
        if centres[from + 1..next].iter().any(|centre| off(centre) > 0.1 * tolerance) {
            from = next - 1;
            nodes.push(from);
        }
    }
    nodes.push(centres.len() - 1);
    nodes
}

/// True if every segment is long enough that the ellipses of its mitres do not cross; the ellipse of a bend by b reaches r tan(b / 2) along
/// the axis.
fn has_room(segments: &[(f64, DVec3)], radius: f64) -> bool {
    let half_tangent = |a: DVec3, b: DVec3| a.cross(b).length() / (1.0 + a.dot(b)).max(0.0);
    let bends: Vec<f64> = segments.windows(2).map(|pair| half_tangent(pair[0].1, pair[1].1)).collect();
    let reach = |bend: Option<&f64>| bend.map_or(0.0, |half_tangent| radius * half_tangent);
    bends.iter().all(|half_tangent| *half_tangent <= STEEPEST_HALF)
        && segments.iter().enumerate().all(|(index, (length, _))| {
            *length >= reach(index.checked_sub(1).and_then(|below| bends.get(below))) + reach(bends.get(index))
        })
}

/// The pipe of a mesh as a graph of places (merged positions).
struct PipeGraph {
    positions: HashMap<u32, DVec3>,
    neighbours: HashMap<u32, Vec<u32>>,
    /// Neighbours along edges at the border, which have one triangle.
    border: HashMap<u32, Vec<u32>>,
    is_manifold: bool,
}

impl PipeGraph {
    fn new(mesh: &TriangleMesh, parts: &[Part]) -> Self {
        let places = welded::places(&mesh.positions);
        let mut pipe =
            Self { positions: HashMap::new(), neighbours: HashMap::new(), border: HashMap::new(), is_manifold: true };
        let members = mesh.triangles.iter().zip(&mesh.triangle_materials).enumerate();
        let members = members.filter(|(_, (_, material))| matches!(parts[**material as usize], Part::Pipe { .. }));
        let triangles: Vec<(u32, [u32; 3])> = members
            .map(|(number, (corners, _))| {
                let triangle = corners.map(|corner| places[corner as usize]);
                for (place, corner) in triangle.iter().zip(corners) {
                    pipe.positions.insert(*place, mesh.positions[*corner as usize]);
                }
                (number as u32, triangle)
            })
            .collect();
        for edge in welded::sides(triangles.iter().copied()).chunk_by(|a, b| a.edge == b.edge) {
            let Some([a, b]) = edge.first().map(|side| side.edge) else { continue };
            pipe.is_manifold &= edge.len() <= 2;
            for (one, other) in [(a, b), (b, a)] {
                pipe.neighbours.entry(one).or_default().push(other);
                if edge.len() == 1 {
                    pipe.border.entry(one).or_default().push(other);
                }
            }
        }
        pipe
    }

    /// Returns the vertices ring by ring, from the border in the opening's plane upward; each ring consists of the neighbours of the ring
    /// below.
    fn rings(&self, tolerance: f64) -> Result<Vec<Vec<u32>>, &'static str> {
        let mut first: Vec<u32> = self.border.keys().copied().collect();
        first.retain(|place| self.positions[place].z.abs() <= tolerance);
        // the map's order differs from run to run
        first.sort_unstable();
        let mut ring_of: HashMap<u32, usize> = first.iter().map(|place| (*place, 0)).collect();
        let mut rings = vec![first];
        loop {
            let number = rings.len();
            let mut next = Vec::new();
            for place in &rings[number - 1] {
                for neighbour in &self.neighbours[place] {
                    if !ring_of.contains_key(neighbour) {
                        ring_of.insert(*neighbour, number);
                        next.push(*neighbour);
                    }
                }
            }
            if next.is_empty() {
                break;
            }
            if next.len() != rings[0].len() {
                return Err("its pipe is not made of equal rings of vertices");
            }
            next.sort_unstable();
            rings.push(next);
        }
        let is_end = |place: &u32| ring_of.get(place).is_some_and(|ring| *ring == 0 || *ring + 1 == rings.len());
        if !self.is_manifold || ring_of.len() != self.positions.len() || !self.border.keys().all(is_end) {
            return Err("its pipe has holes, or is not a single wall");
        }
        Ok(rings)
    }

    /// Returns the mean of a ring's vertices, which are evenly spaced around it.
    fn centre(&self, ring: &[u32]) -> DVec3 {
        ring.iter().map(|place| self.positions[place]).sum::<DVec3>() / ring.len() as f64
    }

    /// Returns the sum of the angles about an axis of the edges of a ring, which is sorted by place, and the largest of them.
    fn turn(&self, ring: &[u32], centre: DVec3, axis: DVec3) -> (f64, f64) {
        let to_local = DMat3::from_cols(warp::around(axis, DVec3::X), warp::around(axis, DVec3::Y), axis).transpose();
        let flat = |place: &u32| (to_local * (self.positions[place] - centre)).truncate();
        let (mut sum, mut largest): (f64, f64) = (0.0, 0.0);
        for place in ring {
            let in_ring = |other: &&u32| *other > place && ring.binary_search(other).is_ok();
            for other in self.neighbours[place].iter().filter(in_ring) {
                let turn = angle_between(flat(place), flat(other)).abs();
                sum += turn;
                largest = largest.max(turn);
            }
        }
        (sum, largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that a mitre of 90 degrees reaches one radius along the axis, and that an axis cannot bend back on itself.
    #[test]
    fn mitres_need_room() {
        let room = |length: f64, axis: DVec3| has_room(&[(0.5, DVec3::Z), (length, axis), (0.5, DVec3::Z)], 0.1);
        assert!(room(0.201, DVec3::X) && !room(0.199, DVec3::X));
        assert!(!room(100.0, DVec3::NEG_Z) && room(0.001, DVec3::Z));
    }
}
