//! Rings of polygons with holes, the outline first, and their faults.

use glam::DVec2;

use crate::geometry::covered::{self, Edge};

/// Fault of the rings of a polygon with holes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RingFault {
    /// Fewer than three corners are apart from each other.
    Few,
    /// Two edges, by their numbers through all rings, meet or come near each other.
    Meeting {
        /// Numbers of the edges.
        edges: [usize; 2],
        /// A place where they meet.
        at: DVec2,
        /// True if both are edges of one ring.
        of_one_ring: bool,
    },
    /// A hole lies outside the outline.
    Outside,
    /// A hole lies within another one, by its number.
    Within(usize),
}

impl RingFault {
    /// Returns a sentence about the fault in a polygon with the name `of`, with corners taken for one within `near` and places in the
    /// words of `place`.
    pub fn words(self, of: &str, near: f64, place: impl Fn(DVec2) -> String) -> String {
        match self {
            Self::Few => format!("has fewer than 3 corners that are {near:.3e} m apart"),
            Self::Meeting { edges: [a, b], at, of_one_ring } => {
                let rule = match of_one_ring {
                    true => "the polygon must not cross or touch itself",
                    false => "holes must lie within the outline and apart from each other",
                };
                format!("the edges {a} and {b} of the {of} meet at {}: {rule}", place(at))
            }
            Self::Outside => "the hole lies outside the outline".to_owned(),
            Self::Within(other) => format!("the hole lies within the hole {other}"),
        }
    }
}

/// Finds the first fault of rings, the outline and then the holes, and the number of the ring that has it: edges that meet elsewhere than
/// neighbours at their common corner, within `near`, and holes outside of the outline or in each other.
pub fn fault_of_rings(rings: &[Vec<DVec2>], near: f64) -> Option<(usize, RingFault)> {
    let mut all: Vec<(usize, usize, Edge)> = Vec::new();
    let mut first = 0;
    for (number, ring) in rings.iter().enumerate() {
        let of_ring = (0..ring.len()).map(|k| (first + k, number, [ring[k], ring[(k + 1) % ring.len()]]));
        all.extend(of_ring.filter(|(_, _, [a, b])| a.distance(*b) > near));
        first += ring.len();
        if all.iter().filter(|(_, of, _)| *of == number).count() < 3 {
            return Some((number, RingFault::Few));
        }
    }
    for (place, (a, ring_a, edge)) in all.iter().enumerate() {
        for (b, ring_b, other) in &all[place + 1..] {
            if let Some(at) = meeting(*edge, *other, near) {
                return Some((*ring_b, RingFault::Meeting { edges: [*a, *b], at, of_one_ring: ring_a == ring_b }));
            }
        }
    }
    let edges_of = |number: usize| all.iter().filter(move |(_, ring, _)| *ring == number).map(|(_, _, edge)| *edge);
    let outlines: Vec<Vec<Edge>> = (0..rings.len()).map(|number| edges_of(number).collect()).collect();
    outlines.iter().enumerate().skip(1).find_map(|(number, hole)| {
        let corner = hole[0][0];
        let within = |other: usize| covered::contains(&outlines[other], corner);
        if !within(0) {
            return Some((number, RingFault::Outside));
        }
        let other = (1..outlines.len()).find(|other| *other != number && within(*other))?;
        Some((number, RingFault::Within(other - 1)))
    })
}

/// Returns the edges of rings with their numbers.
pub fn edges(rings: &[Vec<DVec2>]) -> impl Iterator<Item = (usize, Edge)> {
    rings.iter().flat_map(|ring| (0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()]])).enumerate()
}

/// Returns the rings with the outline counter-clockwise and the holes clockwise.
pub fn oriented(mut rings: Vec<Vec<DVec2>>) -> Vec<Vec<DVec2>> {
    for (number, ring) in rings.iter_mut().enumerate() {
        let is_clockwise = covered::enclosed_area(&covered::polygon(ring)) < 0.0;
        if is_clockwise == (number == 0) {
            ring.reverse();
        }
    }
    rings
}

/// Finds a place where two edges meet or come within `near` of each other; `None` if they do so only where one ends and the other starts.
fn meeting([a, b]: Edge, [c, d]: Edge, near: f64) -> Option<DVec2> {
    let is_apart = (a.max(b) + near).cmplt(c.min(d)) | (c.max(d) + near).cmplt(a.min(b));
    if is_apart.any() {
        return None;
    }
    let joint = if b.distance(c) <= near {
        Some((b, a, d))
    } else if a.distance(d) <= near {
        Some((a, b, c))
    } else {
        None
    };
    if let Some((joint, one, other)) = joint {
        // neighbours meet again only if one of them turns back along the other
        let (one, other) = (one - joint, other - joint);
        let beside = one.perp_dot(other).abs() / one.length().max(other.length());
        return (one.dot(other) > 0.0 && beside <= near).then_some(joint);
    }
    let closest = [
        (a, covered::distance(&[[c, d]], a)),
        (b, covered::distance(&[[c, d]], b)),
        (c, covered::distance(&[[a, b]], c)),
        (d, covered::distance(&[[a, b]], d)),
    ];
    if let Some((place, _)) = closest.into_iter().find(|(_, distance)| *distance <= near) {
        return Some(place);
    }
    covered::crossing([a, b], [c, d]).map(|fraction| a.lerp(b, fraction))
}
