//! Cuts of closed triangle meshes by a plane.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::sampling::warp;

/// Cut of a mesh by a plane.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// Outlines of the part of the plane that is inside closed surfaces: counter-clockwise about the plane's normal around
    /// solid parts, clockwise around hollow ones.
    pub rings: Vec<Vec<DVec3>>,
    /// True if the plane cuts a surface that is not closed in the plane, and so has no inside.
    pub open: bool,
}

/// Computes the outlines of the part of the plane normal . p = `height` that lies inside closed surfaces: rings counter-clockwise about the
/// unit vector `normal` around solid parts, clockwise around hollow ones.
///
/// The winding of the triangles does not count; surfaces that are not closed where the plane cuts them have no inside. Intersections of
/// closed surfaces are ignored. A corner in the plane counts as below it.
pub fn section(positions: &[DVec3], triangles: &[[u32; 3]], normal: DVec3, height: f64) -> Section {
    let above: Vec<bool> = positions.iter().map(|p| normal.dot(*p) > height).collect();
    // every cut triangle joins two cut edges
    let mut joined: BTreeMap<[u32; 2], Vec<[u32; 2]>> = BTreeMap::new();
    for [a, b, c] in triangles {
        let cut = [[*a, *b], [*b, *c], [*c, *a]].into_iter().filter(|[p, q]| above[*p as usize] != above[*q as usize]);
        let ends: Vec<[u32; 2]> = cut.map(|[p, q]| [p.min(q), p.max(q)]).collect();
        if let [from, to] = ends[..] {
            joined.entry(from).or_default().push(to);
            joined.entry(to).or_default().push(from);
        }
    }
    let crossing = |[p, q]: [u32; 2]| {
        let (p, q) = (positions[p as usize], positions[q as usize]);
        let (low, high) = (normal.dot(p) - height, normal.dot(q) - height);
        p.lerp(q, low / (low - high))
    };
    let mut rings = Vec::new();
    let mut open = false;
    while let Some((start, _)) = joined.first_key_value() {
        let start = *start;
        let mut ring = Vec::new();
        let mut current = start;
        let mut previous = None;
        let closed = loop {
            let Some(next) = joined.remove(&current) else { break current == start && ring.len() > 2 };
            ring.push(crossing(current));
            let [one, other] = next[..] else { break false };
            let onward = if Some(one) == previous { other } else { one };
            previous = Some(current);
            current = onward;
        };
        if closed {
            rings.push(ring);
        } else {
            open = true;
        }
    }
    Section { rings: orient(rings, normal), open }
}

/// Orients rings such that those inside an even number of others run counter-clockwise.
fn orient(mut rings: Vec<Vec<DVec3>>, normal: DVec3) -> Vec<Vec<DVec3>> {
    let depths: Vec<usize> = (0..rings.len())
        .map(|k| (0..rings.len()).filter(|other| *other != k && contains(&rings[*other], rings[k][0], normal)).count())
        .collect();
    for (ring, depth) in rings.iter_mut().zip(depths) {
        let twice: DVec3 = ring.windows(2).map(|pair| (pair[0] - ring[0]).cross(pair[1] - ring[0])).sum();
        if (twice.dot(normal) > 0.0) != depth.is_multiple_of(2) {
            ring.reverse();
        }
    }
    rings
}

/// True if a point of a ring's plane lies inside the ring (by the crossings of a half line).
pub fn contains(ring: &[DVec3], point: DVec3, normal: DVec3) -> bool {
    let (u, v) = (warp::around(normal, DVec3::X), warp::around(normal, DVec3::Y));
    let flat = |p: DVec3| ((p - point).dot(u), (p - point).dot(v));
    let crosses = |k: &usize| {
        let ((ax, ay), (bx, by)) = (flat(ring[*k]), flat(ring[(k + 1) % ring.len()]));
        (ay > 0.0) != (by > 0.0) && ax + ay / (ay - by) * (bx - ax) > 0.0
    };
    (0..ring.len()).filter(crosses).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a box around the z axis from 0 to `top` as 12 triangles of mixed winding.
    fn prism(half: f64, top: f64, first: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let corner = |k: u32| if k == 0 || k == 3 { -half } else { half };
        let at = |k: u32, z: f64| DVec3::new(corner(k), if k < 2 { -half } else { half }, z);
        let positions = (0..4).map(|k| at(k, 0.0)).chain((0..4).map(|k| at(k, top))).collect();
        let mut triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 7, 6]];
        for k in 0..4 {
            let next = (k + 1) % 4;
            triangles.extend([[k, next, next + 4], [k, k + 4, next + 4]]);
        }
        (positions, triangles.into_iter().map(|t| t.map(|corner| corner + first)).collect())
    }

    fn area(rings: &[Vec<DVec3>], normal: DVec3) -> f64 {
        let of_ring = |ring: &Vec<DVec3>| {
            ring.windows(2).map(|p| 0.5 * (p[0] - ring[0]).cross(p[1] - ring[0]).dot(normal)).sum::<f64>()
        };
        rings.iter().map(of_ring).sum()
    }

    #[test]
    fn a_box_standing_on_the_plane() {
        let (positions, triangles) = prism(0.5, 2.0, 0);
        for (height, expected) in [(0.0, 1.0), (1.0, 1.0), (2.0, 0.0), (-0.1, 0.0)] {
            let rings = section(&positions, &triangles, DVec3::Z, height).rings;
            assert!((area(&rings, DVec3::Z) - expected).abs() < 1e-14, "{height}");
        }
        let upright = section(&positions, &triangles, DVec3::NEG_X, 0.2).rings;
        assert!((area(&upright, DVec3::NEG_X) - 2.0).abs() < 1e-14);
    }

    #[test]
    fn hollow_and_open_surfaces() {
        let (mut positions, mut triangles) = prism(1.0, 2.0, 0);
        let (inner, inner_triangles) = prism(0.5, 2.0, 8);
        positions.extend(inner);
        triangles.extend(inner_triangles);
        let cut = |triangles: &[[u32; 3]]| section(&positions, triangles, DVec3::Z, 1.0);
        assert!((area(&cut(&triangles).rings, DVec3::Z) - 3.0).abs() < 1e-14);
        assert!(!cut(&triangles).open);
        // without one side the outer one has no inside; without top and bottom it still has
        let open: Vec<_> = triangles.iter().enumerate().filter(|(k, _)| *k != 4).map(|(_, t)| *t).collect();
        assert!((area(&cut(&open).rings, DVec3::Z) - 1.0).abs() < 1e-14);
        assert!(cut(&open).open);
        assert!((area(&cut(&triangles[4..12]).rings, DVec3::Z) - 4.0).abs() < 1e-14);
    }
}
