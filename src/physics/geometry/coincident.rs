//! Coincident triangles: polygons that a file writes twice, or that overlap in one plane.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::bvh::TriangleBvh;
use super::convex::{area_vector, is_wide, perimeter};

/// Distance within which positions are taken as equal, as a fraction of the mesh's diagonal: the last digits that files have.
const ROUNDING: f64 = 5e-6;

/// Upper bound in m of the distance within which positions are taken as equal, whatever the size of a mesh: less than the thickness of a
/// sheet of paper.
const THINNEST_M: f64 = 2e-5;

/// Upper bounds of the overlapping pairs kept for a mesh (`MOST_PAIRS`) and of the candidates compared (`MOST_COMPARED`): some seconds,
/// some hundred megabytes.
const MOST_PAIRS: usize = 6_000_000;
const MOST_COMPARED: u64 = 2_000_000_000;

/// Two triangles that overlap in part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Indices of both triangles, the lesser first.
    pub triangles: [u32; 2],
    /// Area of the common part in m2.
    pub area_m2: f64,
    /// True if the triangles are wound in opposite senses.
    pub turned: bool,
}

/// Error of a mesh with more overlapping or narrow triangles than can be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("too many polygons lie on each other, or are too long and narrow, to be compared: simplify the mesh")]
pub struct TooMany;

/// Returns the distance in m within which positions of a mesh are taken as equal; 0 without triangles.
pub fn rounding(positions: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    let corners = || triangles.iter().flatten().map(|corner| positions[*corner as usize]);
    let [Some(low), Some(high)] = [corners().reduce(DVec3::min), corners().reduce(DVec3::max)] else { return 0.0 };
    (ROUNDING * (high - low).length()).min(THINNEST_M)
}

/// Finds all pairs of triangles that overlap within `near` m, sorted by their indices.
///
/// Overlaps narrower than `near` are ignored: neighbours share an edge, but do not overlap.
pub fn overlaps(positions: &[DVec3], triangles: &[[u32; 3]], near: f64) -> Result<Vec<Overlap>, TooMany> {
    if triangles.len() < 2 {
        return Ok(Vec::new());
    }
    let flat: Vec<Flat> =
        triangles.par_iter().map(|triangle| Flat::of(triangle.map(|corner| positions[corner as usize]))).collect();
    let set = TriangleBvh::of_mesh(positions.to_vec(), triangles.to_vec());
    // totals over all tasks: the others stop as well once it is too much
    let (compared, kept) = (AtomicU64::new(0), AtomicUsize::new(0));
    // a group of neighbours searches the tree once
    let of_group = |group: Vec<u32>| {
        let around = |[low, high]: [DVec3; 2], number: &u32| {
            let [other_low, other_high] = flat[*number as usize].bounds();
            [low.min(other_low), high.max(other_high)]
        };
        let [low, high] = group.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], around);
        let mut close = Vec::new();
        set.around(low - near, high + near, |other| close.push((other, flat[other as usize].bounds())));
        let mut pairs = Vec::new();
        for number in &group {
            let own = &flat[*number as usize];
            let [low, high] = own.bounds();
            let (low, high) = (low - near, high + near);
            for (other, [other_low, other_high]) in &close {
                if other > number
                    && (low.cmple(*other_high) & other_low.cmple(high)).all()
                    && let Some((area_m2, turned)) = common(own, &flat[*other as usize], near)
                {
                    pairs.push(Overlap { triangles: [*number, *other], area_m2, turned });
                }
            }
        }
        let looked_at = (group.len() * close.len()) as u64;
        let too_many = kept.fetch_add(pairs.len(), Ordering::Relaxed) + pairs.len() > MOST_PAIRS
            || compared.fetch_add(looked_at, Ordering::Relaxed) + looked_at > MOST_COMPARED;
        if too_many { Err(TooMany) } else { Ok(pairs) }
    };
    let pairs: Result<Vec<Vec<Overlap>>, TooMany> = set.groups().map(of_group).collect();
    let mut pairs = pairs?.concat();
    pairs.sort_unstable_by_key(|overlap| overlap.triangles);
    Ok(pairs)
}

/// Triangle with the plane in which it lies.
struct Flat {
    corners: [DVec3; 3],
    /// Unit normal, by winding; 0 without an area.
    normal: DVec3,
    area_m2: f64,
}

impl Flat {
    fn of(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let twice = (b - a).cross(c - a);
        Self { corners, normal: twice.normalize_or_zero(), area_m2: 0.5 * twice.length() }
    }

    fn bounds(&self) -> [DVec3; 2] {
        let [a, b, c] = self.corners;
        [a.min(b).min(c), a.max(b).max(c)]
    }
}

/// Returns the area in m2 of the overlap of two triangles, and whether their windings are opposite; `None` without an overlap.
fn common(one: &Flat, other: &Flat, near: f64) -> Option<(f64, bool)> {
    // the plane of the larger triangle is more exact
    let (base, laid) = if one.area_m2 >= other.area_m2 { (one, other) } else { (other, one) };
    let (normal, corner) = (base.normal, base.corners[0]);
    let heights = laid.corners.map(|of| normal.dot(of - corner));
    let is_level = heights.iter().any(|height| *height <= near) && heights.iter().any(|height| *height >= -near);
    if !is_level || normal == DVec3::ZERO {
        return None;
    }
    let facing = normal.dot(laid.normal);
    let flat = [0, 1, 2].map(|k| laid.corners[k] - normal * heights[k]);
    let flat = if facing < 0.0 { [flat[0], flat[2], flat[1]] } else { flat };
    let base = &base.corners;
    if are_apart(base, &flat, normal, near) || are_apart(&flat, base, normal, near) {
        return None;
    }
    let mut part = flat.to_vec();
    for k in 0..3 {
        let outward = (base[(k + 1) % 3] - base[k]).cross(normal).try_normalize()?;
        [_, part] = super::convex::split(&part, base[k], outward);
    }
    if !is_wide(&part, 2.0 * near) {
        return None;
    }
    // height of the other triangle's plane above the first's, within the overlap
    let above = |p: &DVec3| laid.normal.dot(laid.corners[0] - *p) / facing;
    let is_level = part.iter().all(|p| above(p).abs() <= near);
    is_level.then(|| (area_vector(&part).length(), facing < 0.0))
}

/// True if an edge of a triangle, counter-clockwise about the unit vector `normal`, has all corners of the other triangle beyond it, or
/// within `near` m of it.
fn are_apart(triangle: &[DVec3; 3], other: &[DVec3; 3], normal: DVec3, near: f64) -> bool {
    (0..3).any(|k| {
        let along = triangle[(k + 1) % 3] - triangle[k];
        let inward = normal.cross(along);
        let inside = other.map(|corner| inward.dot(corner - triangle[k])).into_iter().fold(0.0, f64::max);
        inside * inside <= near * near * along.length_squared()
    })
}

/// Returns the area in m2 by which rounding of `near` m may change a triangle.
pub fn slack_m2(corners: &[DVec3; 3], near: f64) -> f64 {
    4.0 * near * perimeter(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEAR: f64 = 1e-6;

    fn pair(one: [[f64; 3]; 3], other: [[f64; 3]; 3]) -> Option<(f64, bool)> {
        let [one, other] = [one, other].map(|triangle| Flat::of(triangle.map(DVec3::from_array)));
        let found = common(&one, &other, NEAR);
        assert_eq!(found.is_some(), common(&other, &one, NEAR).is_some());
        found
    }

    /// Checks pairs that are equal, turned, overlapping in part or equal within rounding, and pairs side by side, one above the other,
    /// crossing or at a small angle, which have nothing in common.
    #[test]
    fn common_parts() {
        let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let close = |found: Option<(f64, bool)>, area: f64, turned: bool| {
            assert!(found.is_some_and(|found| (found.0 - area).abs() < 1e-5 && found.1 == turned), "{found:?} {area}");
        };
        close(pair(unit, unit), 0.5, false);
        close(pair(unit, [unit[2], unit[1], unit[0]]), 0.5, true);
        close(pair(unit, [[0.0, 0.0, 4e-7], [1.0, 3e-7, 0.0], [-2e-7, 1.0, -4e-7]]), 0.5, false);
        close(pair(unit, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]), 0.25, false);
        close(pair(unit, [[0.1, 0.1, 0.0], [0.1, 0.2, 0.0], [0.2, 0.1, 0.0]]), 0.005, true);
        for other in [
            [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            unit.map(|[x, y, _]| [x, y, 1e-5]),
            [[0.2, 0.2, -1.0], [0.3, 0.2, 1.0], [0.2, 0.3, 1.0]],
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1e-4]],
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        ] {
            assert_eq!(pair(unit, other), None, "{other:?}");
        }
    }

    /// Checks two grids of squares with different diagonals: every triangle overlaps two of the other grid.
    #[test]
    fn nets_of_other_diagonals() {
        let (side, net) = (20_u32, |turned: bool, first: u32| {
            (0..20 * 20).flat_map(move |cell: u32| {
                let corner = |i: u32, j: u32| first + (cell / 20 + i) * 21 + cell % 20 + j;
                let [a, b, c, d] = [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)];
                if turned { [[d, c, b], [d, b, a]] } else { [[a, b, c], [a, c, d]] }
            })
        });
        let places = (0..=side)
            .flat_map(|i| (0..=side).map(move |j| DVec3::new(f64::from(i), f64::from(j), 0.5 * f64::from(i))));
        let positions: Vec<DVec3> = places.clone().chain(places).collect();
        let triangles: Vec<[u32; 3]> = net(false, 0).chain(net(true, 441)).collect();
        let found = overlaps(&positions, &triangles, 1e-5).unwrap();
        assert_eq!(found.len(), 1600);
        assert!(found.iter().all(|overlap| overlap.turned && (overlap.area_m2 - 0.25 * 1.25_f64.sqrt()).abs() < 1e-9));
        assert_eq!(overlaps(&positions, &triangles[..800], 1e-5), Ok(vec![]));
    }
}
