//! Conversion of overlapping triangles into sheets that do not overlap, each with a material for either side.

use std::collections::HashMap;

use glam::DVec3;

use super::TriangleMesh;
use super::coincident::{Overlap, TooMany};
use super::convex::{area_vector, cut, perimeter};

/// Largest number of cuts of one polygon by another: some seconds.
const MOST_CUTS: usize = 20_000_000;

/// Triangles with a material for each side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheets {
    /// Corner positions.
    pub positions: Vec<DVec3>,
    /// Indices of the corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Materials of the front of each triangle, about which its corners go counter-clockwise, and of its back.
    pub sides: Vec<[u32; 2]>,
    /// Index of the original triangle that each is, or is a part of.
    pub sources: Vec<u32>,
}

impl Sheets {
    /// Adds the triangles of a mesh, whose materials are numbered from `first` on; `sources` are left to the caller.
    pub fn add(&mut self, mesh: &TriangleMesh, first: u32) {
        let corner = self.positions.len() as u32;
        self.positions.extend(&mesh.positions);
        self.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|k| k + corner)));
        self.sides.extend((0..mesh.triangles.len()).map(|number| mesh.sides(number).map(|side| side + first)));
    }
}

/// Relation of two triangles where they overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// Two surfaces that touch: both stay.
    Apart,
    /// Two surfaces of which the first hides the second.
    Hidden,
    /// One sheet: each triangle gives the material of the side that it faces.
    OneSheet,
}

/// Reason why the materials of overlapping triangles cannot be determined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Undetermined {
    /// Two triangles that face the same side at a point with different materials.
    Contradiction {
        /// Indices of both triangles.
        triangles: [u32; 2],
        /// A point where they overlap, in m.
        at: DVec3,
    },
    /// Too many overlaps or cuts.
    TooMany(TooMany),
}

impl From<TooMany> for Undetermined {
    fn from(reason: TooMany) -> Self {
        Self::TooMany(reason)
    }
}

/// A convex part of a triangle.
struct ConvexCell {
    /// Corners in the order of the triangle's.
    polygon: Vec<DVec3>,
    source: u32,
    is_whole: bool,
    sides: [u32; 2],
    /// Materials that other triangles give to parts of the back.
    claims: Vec<Claim>,
}

struct Claim {
    polygon: Vec<DVec3>,
    kind: u32,
    by: u32,
}

/// Splits the triangles of `given`, of which some have `overlaps`, into sheets that do not overlap; positions within `near` (m) are taken
/// as equal.
///
/// Triangles are handled in the order of `rank`, then of their indices, and keep the area that earlier ones leave. `meeting` gives the
/// relation of an earlier triangle and a later one (the third argument is true for opposite windings); `is_same` is true if two materials
/// are equal.
pub fn apart(
    given: Sheets,
    overlaps: &[Overlap],
    near: f64,
    rank: impl Fn(u32) -> u8,
    meeting: impl Fn(u32, u32, bool) -> Contact,
    is_same: impl Fn(u32, u32) -> bool,
) -> Result<Sheets, Undetermined> {
    let mut partners: HashMap<u32, Vec<(u32, bool)>> = HashMap::new();
    for Overlap { triangles: [a, b], turned, .. } in overlaps {
        partners.entry(*a).or_default().push((*b, *turned));
        partners.entry(*b).or_default().push((*a, *turned));
    }
    let mut order: Vec<u32> = partners.keys().copied().collect();
    order.sort_unstable_by_key(|number| (rank(*number), *number));
    let mut work = Work { cells: Vec::new(), near, cuts: 0 };
    let mut cells_of: HashMap<u32, Vec<usize>> = HashMap::new();
    for number in order {
        let corners = given.triangles[number as usize].map(|corner| given.positions[corner as usize]);
        let sides = given.sides[number as usize];
        let mut pieces = vec![corners.to_vec()];
        let mut is_whole = true;
        for (other, turned) in &partners[&number] {
            let Some(cells) = cells_of.get(other) else { continue };
            let meeting = meeting(*other, number, *turned);
            if meeting == Contact::Apart {
                continue;
            }
            for cell in cells {
                let mut left = Vec::new();
                for piece in pieces {
                    let Some((common, rest)) = work.cut(&piece, *cell)? else {
                        left.push(piece);
                        continue;
                    };
                    is_whole = false;
                    left.extend(rest);
                    if meeting == Contact::OneSheet {
                        work.cells[*cell].meet(common, sides, number, *turned, &is_same)?;
                    }
                }
                pieces = left;
            }
        }
        let first = work.cells.len();
        let cell = |polygon| ConvexCell { polygon, source: number, is_whole, sides, claims: Vec::new() };
        work.cells.extend(pieces.into_iter().map(cell));
        cells_of.insert(number, (first..work.cells.len()).collect());
    }
    let cells = work.sided(&is_same)?;
    Ok(put_together(given, cells, |number| partners.contains_key(&number)))
}

impl ConvexCell {
    /// Adds the materials that a triangle with two `sides` gives to the part `common`; fails if they contradict the cell's own.
    fn meet(
        &mut self,
        common: Vec<DVec3>,
        sides: [u32; 2],
        by: u32,
        turned: bool,
        is_same: &impl Fn(u32, u32) -> bool,
    ) -> Result<(), Undetermined> {
        let is_double = |[front, back]: [u32; 2]| !is_same(front, back);
        // materials of the other triangle toward the cell's front and back, as far as it gives them
        let [toward_front, toward_back] = match (turned, is_double(sides)) {
            (false, false) => [Some(sides[0]), None],
            (false, true) => [Some(sides[0]), Some(sides[1])],
            (true, false) => [None, Some(sides[0])],
            (true, true) => [Some(sides[1]), Some(sides[0])],
        };
        let own = [Some(self.sides[0]), Some(self.sides[1]).filter(|_| is_double(self.sides))];
        for (claimed, own) in [toward_front, toward_back].into_iter().zip(own) {
            if let (Some(claimed), Some(own)) = (claimed, own)
                && !is_same(claimed, own)
            {
                return Err(contradiction([self.source, by], &common));
            }
        }
        if let Some(kind) = toward_back {
            self.claims.push(Claim { polygon: common, kind, by });
        }
        Ok(())
    }
}

fn contradiction(triangles: [u32; 2], common: &[DVec3]) -> Undetermined {
    Undetermined::Contradiction { triangles, at: common.iter().sum::<DVec3>() / common.len() as f64 }
}

struct Work {
    cells: Vec<ConvexCell>,
    near: f64,
    cuts: usize,
}

/// Common part of two polygons, and the rest of the first in pieces; `None` without a common part.
type Cut = Option<(Vec<DVec3>, Vec<Vec<DVec3>>)>;

impl Work {
    fn cut(&mut self, polygon: &[DVec3], cell: usize) -> Result<Cut, TooMany> {
        self.cuts += 1;
        if self.cuts > MOST_CUTS {
            return Err(TooMany);
        }
        Ok(within(polygon, &self.cells[cell].polygon, self.near))
    }

    /// Splits the cells so that each has one material on its back.
    fn sided(mut self, is_same: &impl Fn(u32, u32) -> bool) -> Result<Vec<ConvexCell>, Undetermined> {
        let mut done = Vec::with_capacity(self.cells.len());
        for mut cell in std::mem::take(&mut self.cells) {
            let claims = std::mem::take(&mut cell.claims);
            let [front, _] = cell.sides;
            let Some(kind) = claims.iter().map(|claim| claim.kind).find(|kind| !is_same(*kind, front)) else {
                done.push(cell);
                continue;
            };
            let area = |polygon: &[DVec3]| area_vector(polygon).length();
            let covered: f64 = claims.iter().map(|claim| area(&claim.polygon)).sum();
            let is_all = covered >= area(&cell.polygon) - 4.0 * self.near * perimeter(&cell.polygon);
            if is_all && claims.iter().all(|claim| is_same(claim.kind, kind)) {
                cell.sides[1] = kind;
                done.push(cell);
                continue;
            }
            let mut parts = vec![(cell.polygon, None)];
            for Claim { polygon: claimed, kind, by } in claims {
                let mut next = Vec::new();
                for (polygon, material) in parts {
                    self.cuts += 1;
                    if self.cuts > MOST_CUTS {
                        return Err(TooMany.into());
                    }
                    let Some((common, rest)) = within(&polygon, &claimed, self.near) else {
                        next.push((polygon, material));
                        continue;
                    };
                    if let Some((other, first)) = material
                        && !is_same(other, kind)
                    {
                        return Err(contradiction([first, by], &common));
                    }
                    next.extend(rest.into_iter().map(|rest| (rest, material)));
                    next.push((common, material.or(Some((kind, by)))));
                }
                parts = next;
            }
            let (source, back) = (cell.source, cell.sides[1]);
            done.extend(parts.into_iter().map(|(polygon, material)| {
                let sides = [front, material.map_or(back, |(kind, _)| kind)];
                ConvexCell { polygon, source, is_whole: false, sides, claims: Vec::new() }
            }));
        }
        Ok(done)
    }
}

fn within(polygon: &[DVec3], cutter: &[DVec3], near: f64) -> Cut {
    cut(polygon, cutter, area_vector(cutter).try_normalize()?, near)
}

/// Assembles the triangles: those of `given` that are `replaced` come from the cells, the others are kept, in the order of their sources.
fn put_together(given: Sheets, cells: Vec<ConvexCell>, replaced: impl Fn(u32) -> bool) -> Sheets {
    let name = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut numbers: HashMap<[u64; 3], u32> =
        given.positions.iter().zip(0..).map(|(position, number)| (name(*position), number)).collect();
    let mut sheets = Sheets { positions: given.positions, ..Sheets::default() };
    let mut by_source: Vec<(u32, [u32; 3], [u32; 2])> = Vec::with_capacity(given.triangles.len());
    let untouched = (0..).zip(given.triangles.iter().zip(&given.sides)).filter(|(number, _)| !replaced(*number));
    by_source.extend(untouched.map(|(number, (triangle, sides))| (number, *triangle, *sides)));
    for ConvexCell { polygon, source, is_whole, sides, .. } in cells {
        if is_whole {
            by_source.push((source, given.triangles[source as usize], sides));
            continue;
        }
        let mut number = |p: DVec3| {
            *numbers.entry(name(p)).or_insert_with(|| {
                sheets.positions.push(p);
                (sheets.positions.len() - 1) as u32
            })
        };
        for k in 2..polygon.len() {
            let fan = [polygon[0], polygon[k - 1], polygon[k]];
            let longest = fan[0].distance(fan[2]).max(fan[1].distance(fan[2]));
            // corners on one line are no triangle
            if area_vector(&fan).length() > 1e-12 * longest * longest {
                by_source.push((source, fan.map(&mut number), sides));
            }
        }
    }
    by_source.sort_by_key(|(source, ..)| *source);
    for (source, triangle, sides) in by_source {
        sheets.sources.push(given.sources[source as usize]);
        sheets.triangles.push(triangle);
        sheets.sides.push(sides);
    }
    sheets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::coincident::overlaps;

    const NEAR: f64 = 1e-6;

    /// Returns rectangles at height 0, each given by two opposite corners, true if seen from above, and a material.
    fn sheets(rectangles: &[([f64; 2], [f64; 2], bool, u32)]) -> Sheets {
        let mut sheets = Sheets::default();
        for ([x, y], [to_x, to_y], up, kind) in rectangles {
            let first = sheets.positions.len() as u32;
            let corners = [(*x, *y), (*to_x, *y), (*to_x, *to_y), (*x, *to_y)];
            sheets.positions.extend(corners.map(|(x, y)| DVec3::new(x, y, 0.0)));
            let triangles = if *up { [[0, 1, 2], [0, 2, 3]] } else { [[3, 2, 1], [3, 1, 0]] };
            sheets.triangles.extend(triangles.map(|triangle| triangle.map(|corner| first + corner)));
            sheets.sides.extend([[*kind; 2]; 2]);
        }
        sheets.sources = (0..sheets.triangles.len() as u32).collect();
        sheets
    }

    fn split(given: Sheets) -> Result<Sheets, Undetermined> {
        let found = overlaps(&given.positions, &given.triangles, NEAR).unwrap();
        apart(given, &found, NEAR, |_| 0, |_, _, _| Contact::OneSheet, |a, b| a == b)
    }

    /// Returns the area for each pair of materials of the upper and the lower side.
    fn areas(sheets: &Sheets) -> Vec<([u32; 2], f64)> {
        let mut areas: Vec<([u32; 2], f64)> = Vec::new();
        for (triangle, sides) in sheets.triangles.iter().zip(&sheets.sides) {
            let area = area_vector(&triangle.map(|corner| sheets.positions[corner as usize])).z;
            let sides = if area > 0.0 { *sides } else { [sides[1], sides[0]] };
            match areas.iter_mut().find(|(other, _)| *other == sides) {
                Some((_, sum)) => *sum += area.abs(),
                None => areas.push((sides, area.abs())),
            }
        }
        areas.sort_by_key(|(sides, _)| *sides);
        areas
    }

    fn assert_areas(given: &[([f64; 2], [f64; 2], bool, u32)], expected: &[([u32; 2], f64)]) {
        let found = split(sheets(given)).unwrap();
        let areas = areas(&found);
        let fits = areas.len() == expected.len()
            && areas.iter().zip(expected).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-4);
        assert!(fits, "{given:?}: {areas:?}");
        assert_eq!(overlaps(&found.positions, &found.triangles, NEAR), Ok(vec![]));
    }

    /// Checks that every point is covered by one sheet: for rectangles given once, twice, turned, of different extent and with different
    /// materials on their sides.
    #[test]
    fn every_place_is_one_sheet() {
        let (unit, half) = ([1.0, 1.0], [1.0, 0.5]);
        let all = ([0.0; 2], unit, true, 0);
        assert_areas(&[all], &[([0, 0], 1.0)]);
        assert_areas(&[all, all, ([0.0; 2], unit, false, 0)], &[([0, 0], 1.0)]);
        assert_areas(&[all, ([0.0; 2], unit, false, 1)], &[([0, 1], 1.0)]);
        assert_areas(&[([0.0; 2], unit, false, 1), all], &[([0, 1], 1.0)]);
        assert_areas(&[all, ([0.0; 2], half, false, 1)], &[([0, 0], 0.5), ([0, 1], 0.5)]);
        assert_areas(&[all, ([0.5, 0.5], [1.5, 1.5], true, 0)], &[([0, 0], 1.75)]);
        // a larger rectangle below: the part beyond has its own material on both sides
        assert_areas(&[all, ([0.5, 0.5], [1.5, 1.5], false, 1)], &[([0, 0], 0.75), ([0, 1], 0.25), ([1, 1], 0.75)]);
        assert_areas(&[([0.0; 2], half, false, 1), ([0.0, 0.5], unit, false, 2), all], &[([0, 1], 0.5), ([0, 2], 0.5)]);
    }

    /// Checks that two materials on one side at one point contradict each other, on the front as on the back.
    #[test]
    fn two_materials_of_one_side_are_a_contradiction() {
        let at = |up: bool, kind: u32| ([0.25, 0.25], [0.75, 0.75], up, kind);
        let all = |up: bool, kind: u32| ([0.0; 2], [1.0; 2], up, kind);
        for given in [[all(true, 0), at(true, 1), at(false, 0)], [all(true, 0), all(false, 1), at(false, 2)]] {
            let found = split(sheets(&given));
            let Err(Undetermined::Contradiction { at, .. }) = found else { panic!("{given:?}: {found:?}") };
            assert!(at.cmpge(DVec3::new(0.25, 0.25, 0.0)).all() && at.cmple(DVec3::new(0.75, 0.75, 0.0)).all(), "{at}");
        }
    }
}
