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
    let corners = |number: u32| triangles[number as usize].map(|corner| positions[corner as usize]);
    let bounds: Vec<[DVec3; 2]> = (0..triangles.len() as u32)
        .map(|number| {
            let [a, b, c] = corners(number);
            [a.min(b).min(c), a.max(b).max(c)]
        })
        .collect();
    let set = TriangleBvh::of_mesh(positions.to_vec(), triangles.to_vec());
    // totals over all tasks: the others stop as well once it is too much
    let (compared, kept) = (AtomicU64::new(0), AtomicUsize::new(0));
    let of_triangle = |number: u32| {
        let [low, high] = bounds[number as usize];
        let (low, high, own) = (low - near, high + near, corners(number));
        let (mut found, mut looked_at) = (Vec::new(), 0);
        set.around(low, high, |other| {
            looked_at += 1;
            let [other_low, other_high] = bounds[other as usize];
            if other > number && (low.cmple(other_high) & other_low.cmple(high)).all() {
                found.push(other);
            }
        });
        found.sort_unstable();
        let overlap = |other: u32| {
            let (area_m2, turned) = common(&own, &corners(other), near)?;
            Some(Overlap { triangles: [number, other], area_m2, turned })
        };
        let pairs: Vec<Overlap> = found.into_iter().filter_map(overlap).collect();
        let too_many = kept.fetch_add(pairs.len(), Ordering::Relaxed) + pairs.len() > MOST_PAIRS
            || compared.fetch_add(looked_at, Ordering::Relaxed) + looked_at > MOST_COMPARED;
        if too_many { Err(TooMany) } else { Ok(pairs) }
    };
    let pairs: Result<Vec<Vec<Overlap>>, TooMany> =
        (0..triangles.len() as u32).into_par_iter().map(of_triangle).collect();
    Ok(pairs?.concat())
}

/// Returns the area in m2 of the overlap of two triangles, and whether their windings are opposite; `None` without an overlap.
fn common(one: &[DVec3; 3], other: &[DVec3; 3], near: f64) -> Option<(f64, bool)> {
    let twice = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a);
    let across = [twice(one), twice(other)];
    // the plane of the larger triangle is more exact
    let (base, laid, across) = if across[0].length_squared() >= across[1].length_squared() {
        (one, other, across)
    } else {
        (other, one, [across[1], across[0]])
    };
    let normal = across[0].try_normalize()?;
    let heights = laid.map(|corner| normal.dot(corner - base[0]));
    if heights.iter().all(|height| *height > near) || heights.iter().all(|height| *height < -near) {
        return None;
    }
    let facing = normal.dot(across[1]);
    let flat = [0, 1, 2].map(|k| laid[k] - normal * heights[k]);
    let flat = if facing < 0.0 { [flat[0], flat[2], flat[1]] } else { flat };
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
    let above = |p: &DVec3| across[1].dot(laid[0] - *p) / facing;
    let is_level = part.iter().all(|p| above(p).abs() <= near);
    is_level.then(|| (area_vector(&part).length(), facing < 0.0))
}

/// True if an edge of a triangle, counter-clockwise about the unit vector `normal`, has all corners of the other triangle beyond it, or
/// within `near` m of it.
fn are_apart(triangle: &[DVec3; 3], other: &[DVec3; 3], normal: DVec3, near: f64) -> bool {
    (0..3).any(|k| {
        let along = triangle[(k + 1) % 3] - triangle[k];
        let inward = normal.cross(along);
        let least = near * along.length();
        other.iter().all(|corner| inward.dot(*corner - triangle[k]) <= least)
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
        let [one, other] = [one, other].map(|triangle| triangle.map(DVec3::from_array));
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
