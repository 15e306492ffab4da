//! Triangulation of plane polygons.

use glam::DVec3;

/// Ear clipping takes time with the square of the corners; no real face comes near.
pub const MOST_CONCAVE_CORNERS: usize = 1000;

/// Splits a polygon into triangles of indices into `corners` (at least 3): a fan when it is convex, ears otherwise.
///
/// `None` for a concave polygon of more than [`MOST_CONCAVE_CORNERS`] corners. The winding is kept; a polygon without
/// area, or one that crosses itself, gives a fan of what is left.
pub fn triangulate(corners: &[DVec3]) -> Option<Vec<[usize; 3]>> {
    let fan = |ring: &[usize]| (2..ring.len()).map(|k| [ring[0], ring[k - 1], ring[k]]).collect::<Vec<_>>();
    let mut ring: Vec<usize> = (0..corners.len()).collect();
    let normal = newell_normal(corners);
    let at = |ring: &[usize], k: usize| corners[ring[k % ring.len()]];
    let turn = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - b).dot(normal);
    let convex = (0..ring.len()).all(|k| turn(at(&ring, k), at(&ring, k + 1), at(&ring, k + 2)) >= 0.0);
    if convex || normal == DVec3::ZERO {
        return Some(fan(&ring));
    }
    if corners.len() > MOST_CONCAVE_CORNERS {
        return None;
    }
    let mut triangles = Vec::with_capacity(corners.len() - 2);
    while ring.len() > 3 {
        let is_ear = |k: &usize| {
            let [a, b, c] = [*k, k + 1, k + 2].map(|k| ring[k % ring.len()]);
            let [pa, pb, pc] = [a, b, c].map(|index| corners[index]);
            let inside = |p: DVec3| turn(pa, pb, p) >= 0.0 && turn(pb, pc, p) >= 0.0 && turn(pc, pa, p) >= 0.0;
            let corner_of_ear = |p: DVec3| p == pa || p == pb || p == pc;
            let others = ring.iter().map(|index| corners[*index]);
            turn(pa, pb, pc) > 0.0 && !others.into_iter().any(|p| !corner_of_ear(p) && inside(p))
        };
        let Some(ear) = (0..ring.len()).find(is_ear) else {
            break;
        };
        triangles.push([ear, ear + 1, ear + 2].map(|k| ring[k % ring.len()]));
        ring.remove((ear + 1) % ring.len());
    }
    triangles.extend(fan(&ring));
    Some(triangles)
}

/// Normal of a polygon with twice its area as its length (Newell).
fn newell_normal(corners: &[DVec3]) -> DVec3 {
    let origin = corners[0];
    let pairs = corners.windows(2).map(|pair| (pair[0] - origin).cross(pair[1] - origin));
    pairs.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let of_one =
            |[a, b, c]: &[usize; 3]| 0.5 * (corners[*b] - corners[*a]).cross(corners[*c] - corners[*a]).length();
        triangles.iter().map(of_one).sum()
    }

    #[test]
    fn concave_polygons_keep_their_area_and_stay_inside() {
        // an L of area 3 whose fan from the first corner would cover ground outside
        let corners = [(2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0), (0.0, 0.0)]
            .map(|(x, y)| DVec3::new(x, 3.0, y));
        let triangles = triangulate(&corners).unwrap();
        assert_eq!(triangles.len(), 4);
        assert!((area(&corners, &triangles) - 3.0).abs() < 1e-12);
        let mut turned = corners;
        turned.reverse();
        assert!((area(&turned, &triangulate(&turned).unwrap()) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn convex_polygons_are_fans() {
        let corners: Vec<_> =
            (0..100_000).map(|k| DVec3::from((glam::DVec2::from_angle(f64::from(k) * 6.28e-5), 0.0))).collect();
        assert_eq!(triangulate(&corners).unwrap().len(), corners.len() - 2);
    }

    #[test]
    fn degenerate_polygons_do_not_panic() {
        let point = [DVec3::ONE; 5];
        assert_eq!(triangulate(&point).unwrap().len(), 3);
        let bow_tie = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        assert_eq!(triangulate(&bow_tie).unwrap().len(), 2);
        let star: Vec<_> =
            (0..5).map(|k| DVec3::from((glam::DVec2::from_angle(f64::from(k * 2) * 1.2566), 0.0))).collect();
        assert_eq!(triangulate(&star).unwrap().len(), 3);
    }
}
