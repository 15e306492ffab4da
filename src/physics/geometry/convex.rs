//! Convex planar polygons in space, and their cuts by planes.

use glam::DVec3;

/// Splits a convex polygon by the plane through `on` with the unit vector `normal` into the parts in front and behind, each in the order of
/// the corners; a part is empty if nothing lies on that side.
pub(super) fn split(polygon: &[DVec3], on: DVec3, normal: DVec3) -> [Vec<DVec3>; 2] {
    let height = |p: DVec3| normal.dot(p - on);
    let mut parts = [Vec::with_capacity(polygon.len() + 1), Vec::with_capacity(polygon.len() + 1)];
    for (k, p) in polygon.iter().enumerate() {
        let next = polygon[(k + 1) % polygon.len()];
        let (here, there) = (height(*p), height(next));
        if here >= 0.0 {
            parts[0].push(*p);
        }
        if here <= 0.0 {
            parts[1].push(*p);
        }
        if here * there < 0.0 {
            let between = p.lerp(next, here / (here - there));
            parts.iter_mut().for_each(|part| part.push(between));
        }
    }
    parts
}

/// Cuts a convex polygon by the prism over a convex `cutter`, whose corners go counter-clockwise about the unit vector `normal`: returns
/// the part inside, and the rest in convex pieces; `None` without a part inside. Pieces narrower than `near` (m) are dropped.
pub(super) fn cut(
    polygon: &[DVec3],
    cutter: &[DVec3],
    normal: DVec3,
    near: f64,
) -> Option<(Vec<DVec3>, Vec<Vec<DVec3>>)> {
    let (mut inside, mut outside) = (polygon.to_vec(), Vec::new());
    for (k, corner) in cutter.iter().enumerate() {
        let along = cutter[(k + 1) % cutter.len()] - *corner;
        let Some(outward) = along.cross(normal).try_normalize() else { continue };
        let [beyond, within] = split(&inside, *corner, outward);
        if is_wide(&beyond, near) {
            outside.push(beyond);
        }
        inside = within;
        if !is_wide(&inside, near) {
            return None;
        }
    }
    Some((inside, outside))
}

/// Returns the area of a planar polygon times its unit normal, by the order of its corners.
pub(super) fn area_vector(polygon: &[DVec3]) -> DVec3 {
    let Some(first) = polygon.first() else { return DVec3::ZERO };
    0.5 * polygon.windows(2).map(|pair| (pair[0] - *first).cross(pair[1] - *first)).sum::<DVec3>()
}

/// Returns the length of a polygon's outline.
pub(super) fn perimeter(polygon: &[DVec3]) -> f64 {
    (0..polygon.len()).map(|k| polygon[k].distance(polygon[(k + 1) % polygon.len()])).sum()
}

/// True if a convex polygon is wider than about `near` (m).
pub(super) fn is_wide(polygon: &[DVec3], near: f64) -> bool {
    polygon.len() > 2 && area_vector(polygon).length() > 0.5 * near * perimeter(polygon)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64, side: f64) -> Vec<DVec3> {
        [(x, y), (x + side, y), (x + side, y + side), (x, y + side)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec()
    }

    /// Checks that the part inside and the rest make up the whole; a cutter beside the polygon cuts nothing, and one that covers it leaves
    /// nothing.
    #[test]
    fn pieces_make_up_the_whole() {
        let area = |polygon: &Vec<DVec3>| area_vector(polygon).z;
        let whole = square(0.0, 0.0, 1.0);
        for (cutter, expected) in
            [(square(0.5, 0.5, 2.0), 0.25), (square(0.25, 0.25, 0.5), 0.25), (square(-1.0, -1.0, 3.0), 1.0)]
        {
            let (inside, left) = cut(&whole, &cutter, DVec3::Z, 1e-6).unwrap();
            assert!((area(&inside) - expected).abs() < 1e-12);
            assert!((left.iter().map(area).sum::<f64>() - (1.0 - expected)).abs() < 1e-12);
        }
        assert_eq!(cut(&whole, &square(1.0, 0.0, 1.0), DVec3::Z, 1e-6), None);
        assert_eq!(cut(&whole, &square(1.0 - 1e-7, 0.0, 1.0), DVec3::Z, 1e-6), None);
    }
}
