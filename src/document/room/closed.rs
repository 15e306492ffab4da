//! Faces by numbered corners: the edges at which they meet, and the way that each runs.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::planar::Polygon;
use crate::geometry::welded::places;

/// Largest number of corners at edges of one face that are looked for on the edges of others; no room has as many.
const MOST_LOOSE: usize = 10_000;

/// Faces whose corners have numbers, so that neighbours share them.
#[derive(Clone)]
pub struct CorneredFaces {
    /// Places of the corners in m.
    pub places: Vec<DVec3>,
    /// Rings of each face, the outline and then its holes, as numbers of corners.
    pub faces: Vec<Vec<Vec<usize>>>,
    /// Number of corners that were moved onto others.
    pub moved: usize,
    /// Number of corners that repeat the one before them in their ring, and were left out.
    pub repeated: usize,
}

/// A use of an edge by a face.
#[derive(Clone, Copy)]
struct Use {
    face: usize,
    /// True if the face runs along the edge from the lesser corner to the greater.
    forward: bool,
}

/// Reason why faces are not the surface around one room.
#[derive(Clone, Debug, PartialEq)]
pub enum NotOneSurface {
    /// Closed surfaces that share no edge, each by the number of its first face.
    Apart(Vec<usize>),
    /// A face that can be turned neither way to suit its neighbours.
    Twisted(usize),
}

impl CorneredFaces {
    /// Merges the corners of faces that lie within `near` m, and those of a ring that repeat the one before them; holes are made to run
    /// against their outlines.
    pub fn weld(faces: &[Vec<Vec<DVec3>>], near: f64) -> Self {
        let given: Vec<DVec3> = faces.iter().flatten().flatten().copied().collect();
        let exact = places(&given);
        let cell = |place: DVec3| (place / near).floor().to_array().map(|coordinate| coordinate as i64);
        let mut merged: Vec<DVec3> = Vec::new();
        let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        let mut numbers: HashMap<u32, usize> = HashMap::new();
        let (mut moved, mut repeated) = (0, 0);
        for (place, exact) in given.iter().zip(&exact) {
            if numbers.contains_key(exact) {
                continue;
            }
            let at = cell(*place);
            let around = (0..27).map(|k| [at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1]);
            let known = around.filter_map(|cell| cells.get(&cell)).flatten();
            let found = known.copied().find(|number| merged[*number].distance(*place) <= near);
            moved += usize::from(found.is_some());
            let number = found.unwrap_or_else(|| {
                merged.push(*place);
                cells.entry(at).or_default().push(merged.len() - 1);
                merged.len() - 1
            });
            numbers.insert(*exact, number);
        }
        let mut corner = exact.iter().map(|exact| numbers[exact]);
        let mut cornered: Vec<Vec<Vec<usize>>> = Vec::with_capacity(faces.len());
        for rings in faces {
            let mut of_face: Vec<Vec<usize>> = Vec::with_capacity(rings.len());
            for ring in rings {
                let given = ring.len();
                let mut ring: Vec<usize> = corner.by_ref().take(given).collect();
                ring.dedup();
                while ring.len() > 1 && ring.first() == ring.last() {
                    ring.pop();
                }
                repeated += given - ring.len();
                if let Some(outline) = of_face.first()
                    && area_vector(&merged, outline).dot(area_vector(&merged, &ring)) > 0.0
                {
                    ring.reverse();
                }
                of_face.push(ring);
            }
            cornered.push(of_face);
        }
        Self { places: merged, faces: cornered, moved, repeated }
    }

    /// Returns the places of the corners of each ring of each face in m.
    pub fn rings(&self) -> Vec<Vec<Vec<DVec3>>> {
        let ring = |ring: &Vec<usize>| ring.iter().map(|corner| self.places[*corner]).collect();
        self.faces.iter().map(|rings| rings.iter().map(ring).collect()).collect()
    }

    /// Returns the sides of all faces: the face, and the corners from which and to which it runs.
    fn sides(&self) -> impl Iterator<Item = (usize, [usize; 2])> {
        let of_ring = |ring: &Vec<usize>, k: usize| [ring[k], ring[(k + 1) % ring.len()]];
        self.faces.iter().enumerate().flat_map(move |(face, rings)| {
            rings.iter().flat_map(move |ring| (0..ring.len()).map(move |k| (face, of_ring(ring, k))))
        })
    }

    fn uses(&self) -> HashMap<[usize; 2], Vec<Use>> {
        let mut uses: HashMap<[usize; 2], Vec<Use>> = HashMap::new();
        for (face, [a, b]) in self.sides() {
            uses.entry([a.min(b), a.max(b)]).or_default().push(Use { face, forward: a < b });
        }
        uses
    }

    /// Splits edges of one face at the corners of others that lie on them, within `near` m.
    pub fn split_at_corners(&mut self, near: f64) {
        let uses = self.uses();
        let is_loose = |a: usize, b: usize| uses.get(&[a.min(b), a.max(b)]).is_some_and(|uses| uses.len() == 1);
        let mut ends: Vec<usize> =
            self.sides().filter(|(_, [a, b])| is_loose(*a, *b)).flat_map(|(_, side)| side).collect();
        ends.sort_unstable();
        ends.dedup();
        if ends.len() > MOST_LOOSE {
            return;
        }
        let Self { places, faces, .. } = self;
        ends.sort_by(|a, b| places[*a].x.total_cmp(&places[*b].x));
        for ring in faces.iter_mut().flatten() {
            let mut split = Vec::with_capacity(ring.len());
            for k in 0..ring.len() {
                let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
                split.push(a);
                if is_loose(a, b) {
                    split.extend(corners_between(places, &ends, [a, b], near));
                }
            }
            *ring = split;
        }
    }

    /// Returns the edges that belong to one face alone, each with the face and its ends in the face's direction.
    pub fn open_edges(&self) -> Vec<(usize, [usize; 2])> {
        let uses = self.uses();
        self.sides().filter(|(_, [a, b])| uses[&[*a.min(b), *a.max(b)]].len() == 1).collect()
    }

    /// Returns the edges that belong to more than two faces, each with its ends and the faces.
    pub fn crowded_edges(&self) -> Vec<([usize; 2], Vec<usize>)> {
        let crowded = self.uses().into_iter().filter(|(_, uses)| uses.len() > 2);
        let mut crowded: Vec<_> =
            crowded.map(|(ends, uses)| (ends, uses.iter().map(|one| one.face).collect::<Vec<_>>())).collect();
        crowded.sort();
        crowded
    }

    /// Finds the faces to turn so that all run the same way, each edge being that of two faces; the first face is not turned.
    pub fn turns(&self) -> Result<Vec<bool>, NotOneSurface> {
        let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); self.faces.len()];
        let uses = self.uses();
        for (face, [a, b]) in self.sides() {
            for other in uses[&[a.min(b), a.max(b)]].iter().filter(|other| other.face != face) {
                // neighbours that run the same way pass their common edge in opposite senses
                neighbours[face].push((other.face, other.forward == (a < b)));
            }
        }
        let mut turns: Vec<Option<bool>> = vec![None; self.faces.len()];
        let mut firsts = Vec::new();
        for first in 0..self.faces.len() {
            if turns[first].is_some() {
                continue;
            }
            firsts.push(first);
            turns[first] = Some(false);
            let mut waiting = vec![first];
            while let Some(face) = waiting.pop() {
                let turned = turns[face] == Some(true);
                for (other, differs) in &neighbours[face] {
                    match turns[*other] {
                        None => {
                            turns[*other] = Some(turned != *differs);
                            waiting.push(*other);
                        }
                        Some(of_other) if of_other != (turned != *differs) => {
                            return Err(NotOneSurface::Twisted(*other));
                        }
                        Some(_) => {}
                    }
                }
            }
        }
        if firsts.len() > 1 {
            return Err(NotOneSurface::Apart(firsts));
        }
        Ok(turns.into_iter().map(|turn| turn == Some(true)).collect())
    }
}

/// Returns the corners among `ends`, which are sorted by x, that lie within an edge, in its direction.
fn corners_between(places: &[DVec3], ends: &[usize], [a, b]: [usize; 2], near: f64) -> Vec<usize> {
    let (from, along) = (places[a], places[b] - places[a]);
    let length = along.length();
    let unit = along / length;
    let (low, high) = (places[a].x.min(places[b].x) - near, places[a].x.max(places[b].x) + near);
    let first = ends.partition_point(|corner| places[*corner].x < low);
    let candidates = ends[first..].iter().take_while(|corner| places[**corner].x <= high);
    let mut between: Vec<(f64, usize)> = candidates
        .filter(|corner| **corner != a && **corner != b)
        .map(|corner| (unit.dot(places[*corner] - from), *corner))
        .filter(|(way, corner)| {
            *way > near && *way < length - near && places[*corner].distance(from + unit * *way) <= near
        })
        .collect();
    between.sort_by(|one, other| one.0.total_cmp(&other.0));
    between.into_iter().map(|(_, corner)| corner).collect()
}

/// Returns the area of a ring of corners times the normal about which it runs counter-clockwise.
pub fn area_vector(places: &[DVec3], ring: &[usize]) -> DVec3 {
    let Some(first) = ring.first().map(|corner| places[*corner]) else { return DVec3::ZERO };
    ring.windows(2).map(|side| 0.5 * (places[side[0]] - first).cross(places[side[1]] - first)).sum()
}

/// Finds two polygons that cross by more than `near` m, and a place where a side of one passes through the other.
pub fn crossing(polygons: &[Polygon], near: f64) -> Option<([usize; 2], DVec3)> {
    let is_apart = |one: &Polygon, other: &Polygon| {
        let ([low, high], [other_low, other_high]) = (one.bounds(), other.bounds());
        (low + near).cmpge(other_high).any() || (other_low + near).cmpge(high).any()
    };
    let passes = |one: &Polygon, through: &Polygon| {
        one.sides().find_map(|[a, b]| {
            let (from, to) = (through.height(a), through.height(b));
            let is_crossed = from.max(to) > near && from.min(to) < -near;
            let place = is_crossed.then(|| a.lerp(b, from / (from - to)))?;
            (through.contains(place) && through.distance_to_sides(place) > near).then_some(place)
        })
    };
    polygons.iter().enumerate().find_map(|(number, one)| {
        polygons[..number].iter().enumerate().find_map(|(earlier, other)| {
            if is_apart(one, other) {
                return None;
            }
            let place = passes(one, other).or_else(|| passes(other, one))?;
            Some(([earlier, number], place))
        })
    })
}
