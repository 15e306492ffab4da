//! Removal of repeated polygons from a mesh: copies of equal or opposite winding, triangulated by any diagonal.

use std::collections::HashMap;

use glam::DVec3;

use super::TriangleMesh;
use super::coincident::{Overlap, overlaps, rounding, slack_m2};
use super::facets::pieces;
use super::sheets::{self, Contact, Sheets, Undetermined};
use super::welded;

/// A mesh in which every polygon occurs once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Once {
    /// Mesh without repeats, with the material of each side; `None` if the given mesh has none to remove.
    pub mesh: Option<TriangleMesh>,
    /// Triangles of the mesh without repeats that may overlap others, by their indices.
    pub overlapping: Vec<u32>,
}

/// Returns the mesh with every polygon once.
///
/// Overlapping triangles are repeats if all of their connected group is covered equally often. Faces of two bodies that touch are no
/// repeats: a body ends there on either side. Triangles that cover others only in part stay. `is_same` is true if two materials are equal.
pub fn without_repeats(mesh: &TriangleMesh, is_same: impl Fn(u32, u32) -> bool) -> Result<Once, Undetermined> {
    let near = rounding(&mesh.positions, &mesh.triangles);
    let found = overlaps(&mesh.positions, &mesh.triangles, near)?;
    if found.is_empty() {
        return Ok(Once::default());
    }
    let positions = rounded(&mesh.positions, near);
    let layers = Layers::new(&positions, &mesh.triangles, &found, near);
    let mut kept = vec![true; mesh.triangles.len()];
    let mut sides: Vec<[u32; 2]> = (0..mesh.triangles.len()).map(|number| mesh.sides(number)).collect();
    // triangles with several materials on one side, which have to be cut
    let mut mixed = vec![false; mesh.triangles.len()];
    for members in layers.components() {
        let Some(times) = layers.times(&members) else { continue };
        layers.drop_repeats(&members, times, &mut kept);
        let determined = layers.determined(&members, times, &kept, &sides, &is_same)?;
        match determined {
            Some(determined) => determined.into_iter().for_each(|(number, back)| sides[number as usize][1] = back),
            None => members.iter().for_each(|member| {
                kept[*member as usize] = true;
                mixed[*member as usize] = true;
            }),
        }
    }
    let numbers: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|number| kept[*number as usize]).collect();
    if numbers.len() == kept.len() && !mixed.contains(&true) {
        let mut overlapping: Vec<u32> = layers.component.into_keys().collect();
        overlapping.sort_unstable();
        return Ok(Once { mesh: None, overlapping });
    }
    let given =
        Sheets { positions, triangles: mesh.triangles.clone(), sides, sources: (0..kept.len() as u32).collect() };
    let in_mixed = |overlap: &&Overlap| mixed[overlap.triangles[0] as usize];
    let cut: Vec<Overlap> = found.iter().filter(in_mixed).copied().collect();
    let whole = sheets::apart(given, &cut, near, |_| 0, |_, _, _| Contact::OneSheet, is_same)?;
    let left = |number: &usize| kept[whole.sources[*number] as usize];
    let left: Vec<usize> = (0..whole.triangles.len()).filter(left).collect();
    let mut once = TriangleMesh {
        positions: whole.positions.clone(),
        triangles: left.iter().map(|number| whole.triangles[*number]).collect(),
        materials: mesh.materials.clone(),
        dropped: mesh.dropped,
        ..TriangleMesh::default()
    };
    once.set_sides(left.iter().map(|number| whole.sides[*number]));
    once.dropped.repeated += mesh.triangles.len() - numbers.len();
    let overlapping = (0..once.triangles.len() as u32).collect();
    Ok(Once { mesh: Some(once), overlapping })
}

/// Overlapping triangles, with the number of times that their area is covered.
struct Layers<'a> {
    positions: &'a [DVec3],
    triangles: &'a [[u32; 3]],
    near: f64,
    /// Overlaps of each triangle: index of the other one, area of the overlap in m2, and whether their windings are opposite.
    partners: HashMap<u32, Vec<(u32, f64, bool)>>,
    /// Component of each triangle: a group of triangles that overlap, directly or through others.
    component: HashMap<u32, u32>,
    /// True for components that are faces of two bodies that touch.
    contacts: Vec<bool>,
}

impl<'a> Layers<'a> {
    fn new(positions: &'a [DVec3], triangles: &'a [[u32; 3]], found: &[Overlap], near: f64) -> Self {
        let mut partners: HashMap<u32, Vec<(u32, f64, bool)>> = HashMap::new();
        for Overlap { triangles: [a, b], area_m2, turned } in found {
            partners.entry(*a).or_default().push((*b, *area_m2, *turned));
            partners.entry(*b).or_default().push((*a, *area_m2, *turned));
        }
        let mut numbers: Vec<u32> = partners.keys().copied().collect();
        numbers.sort_unstable();
        let place = |number: u32| numbers.binary_search(&number).unwrap_or_default() as u32;
        let alone = (0..numbers.len() as u32).map(|number| [number; 3]);
        let joined = found.iter().map(|Overlap { triangles: [a, b], .. }| [place(*a), place(*b), place(*b)]);
        let of: Vec<u32> = pieces(numbers.len(), &alone.chain(joined).collect::<Vec<_>>());
        let component: HashMap<u32, u32> = numbers.iter().copied().zip(of).collect();
        let count = component.values().max().map_or(0, |last| *last as usize + 1);
        let mut layers = Self { positions, triangles, near, partners, component, contacts: vec![false; count] };
        layers.find_contacts();
        layers
    }

    /// Returns the members of each component, in the order of their indices.
    fn components(&self) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); self.contacts.len()];
        self.component.iter().for_each(|(number, component)| members[*component as usize].push(*number));
        members.iter_mut().for_each(|members| members.sort_unstable());
        members
    }

    fn corners(&self, number: u32) -> [DVec3; 3] {
        self.triangles[number as usize].map(|corner| self.positions[corner as usize])
    }

    /// Returns the area of a triangle in m2, and its uncertainty by rounding.
    fn area(&self, number: u32) -> (f64, f64) {
        let [a, b, c] = self.corners(number);
        (0.5 * (b - a).cross(c - a).length(), slack_m2(&[a, b, c], self.near))
    }

    /// Returns the area in m2 of a triangle's overlaps with the triangles that `counts` selects; an area covered by several counts several
    /// times.
    fn covered(&self, number: u32, counts: impl Fn(u32) -> bool) -> f64 {
        self.partners[&number].iter().filter(|(other, ..)| counts(*other)).map(|(_, area, _)| area).sum()
    }

    /// Returns the least number of times that any triangle of a component is covered, itself included; `None` if it is once, or if the
    /// component is a contact of two bodies.
    fn times(&self, members: &[u32]) -> Option<f64> {
        if self.contacts[self.component[&members[0]] as usize] {
            return None;
        }
        let times = |number: &u32| {
            let (area, slack) = self.area(*number);
            1.0 + ((self.covered(*number, |_| true) + slack) / area).floor()
        };
        members.iter().map(times).reduce(f64::min).filter(|times| *times > 1.0)
    }

    /// Keeps one of every `times` triangles that cover the same area, and drops the others.
    fn drop_repeats(&self, members: &[u32], times: f64, kept: &mut [bool]) {
        members.iter().for_each(|member| kept[*member as usize] = false);
        for member in members {
            let (area, slack) = self.area(*member);
            let by_kept = self.covered(*member, |other| kept[other as usize]);
            let wanted = (area + self.covered(*member, |_| true)) / times;
            let is_repeat = by_kept >= area - slack && by_kept + area > wanted + 0.5 * area;
            kept[*member as usize] = !is_repeat;
        }
    }

    /// Returns the back materials of the kept triangles whose backs differ from their fronts; `None` if the back of a triangle has several
    /// materials, or a triangle already has two.
    fn determined(
        &self,
        members: &[u32],
        times: f64,
        kept: &[bool],
        sides: &[[u32; 2]],
        is_same: &impl Fn(u32, u32) -> bool,
    ) -> Result<Option<Vec<(u32, u32)>>, Undetermined> {
        let mut backs = Vec::new();
        if members.iter().map(|member| sides[*member as usize]).any(|[front, back]| !is_same(front, back)) {
            return Ok(None);
        }
        for member in members.iter().filter(|member| kept[**member as usize]) {
            let (area, slack) = self.area(*member);
            // several bodies meet here
            if (area + self.covered(*member, |_| true)) / times > area + slack {
                continue;
            }
            let [front, _] = sides[*member as usize];
            let of = |other: u32| sides[other as usize][0];
            let copies = || self.partners[member].iter().filter(|(other, ..)| !kept[*other as usize]);
            if let Some((other, ..)) = copies().find(|(other, _, turned)| !turned && !is_same(of(*other), front)) {
                let at = self.corners(*member).iter().sum::<DVec3>() / 3.0;
                return Err(Undetermined::Contradiction { triangles: [*member, *other], at });
            }
            let back = || copies().filter(|(.., turned)| *turned);
            let Some((other, ..)) = back().find(|(other, ..)| !is_same(of(*other), front)) else { continue };
            let kind = of(*other);
            let is_one = back().all(|(other, ..)| is_same(of(*other), kind));
            if !is_one || back().map(|(_, area, _)| area).sum::<f64>() < area - slack {
                return Ok(None);
            }
            backs.push((*member, kind));
        }
        Ok(Some(backs))
    }

    /// Finds the components that separate two touching bodies: at every edge of their border two other triangles meet, or only triangles of
    /// other components.
    fn find_contacts(&mut self) {
        let (mut by_two, mut otherwise) = (vec![false; self.contacts.len()], vec![false; self.contacts.len()]);
        let places = welded::places(self.positions);
        let numbered = (0..).zip(self.triangles.iter().map(|triangle| triangle.map(|corner| places[corner as usize])));
        for edge in welded::sides(numbered).chunk_by(|a, b| a.edge == b.edge) {
            let component = |side: &welded::TriangleSide| self.component.get(&side.triangle).copied();
            let singles = edge.iter().filter(|side| component(side).is_none()).count();
            for side in edge {
                let Some(own) = component(side) else { continue };
                let is_alone = edge.iter().all(|other| component(other) == Some(own));
                by_two[own as usize] |= singles >= 2;
                otherwise[own as usize] |= singles == 1 || is_alone && self.is_border(edge);
            }
        }
        self.contacts = by_two.iter().zip(otherwise).map(|(by_two, otherwise)| *by_two && !otherwise).collect();
    }

    /// True if all triangles at an edge lie on one side of it.
    fn is_border(&self, edge: &[welded::TriangleSide]) -> bool {
        let inward = |side: &welded::TriangleSide| {
            let corners = self.corners(side.triangle);
            let at = |k: u8| corners[usize::from((side.side + k) % 3)];
            let along = (at(1) - at(0)).normalize_or_zero();
            let away = at(2) - at(0);
            away - along * along.dot(away)
        };
        let Some(first) = edge.first().map(inward) else { return false };
        edge.iter().all(|side| inward(side).dot(first) > 0.0)
    }
}

/// Returns the positions, each one within `near` m of an earlier one replaced by it.
pub fn rounded(positions: &[DVec3], near: f64) -> Vec<DVec3> {
    if near <= 0.0 {
        return positions.to_vec();
    }
    // cells of several widths, so that few places have to look into a neighbour
    let width = 8.0 * near;
    let mut known: HashMap<[i64; 3], Vec<DVec3>> = HashMap::with_capacity(positions.len());
    let cell = |p: DVec3| (p / width).floor().to_array().map(|number| number as i64);
    let round = |position: &DVec3| {
        let ([x, y, z], far) = (cell(*position - near), cell(*position + near));
        for i in x..=far[0] {
            for j in y..=far[1] {
                for k in z..=far[2] {
                    let close = |other: &&DVec3| other.distance_squared(*position) <= near * near;
                    if let Some(other) = known.get(&[i, j, k]).and_then(|others| others.iter().find(close)) {
                        return *other;
                    }
                }
            }
        }
        known.entry(cell(*position)).or_default().push(*position);
        *position
    };
    positions.iter().map(round).collect()
}
