//! Triangulation of planar polygons.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

/// Budget of work for the concave polygons of one file.
pub struct Effort<'a> {
    /// Number of tests left of a corner against an ear; a polygon of n corners takes up to about 3 n^2.
    pub looks: u64,
    /// Flag that ends the work, checked once per ear.
    pub cancel: &'a AtomicBool,
}

/// Reason why a polygon was not triangulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Untriangulated {
    /// The [`Effort`] was used up.
    TooCostly,
    /// The flag [`Effort::cancel`] was set.
    Cancelled,
}

/// Splits a polygon into triangles of indices into `corners` (at least 3): a fan when it is convex, ears otherwise.
///
/// The winding is kept. A polygon without area, and the part of a self-crossing one in which no ear is found, is split as a fan.
pub fn triangulate(corners: &[DVec3], effort: &mut Effort<'_>) -> Result<Vec<[usize; 3]>, Untriangulated> {
    let normal = newell_normal(corners);
    let count = corners.len();
    if count == 3 || normal == DVec3::ZERO || is_convex(corners, normal) {
        return Ok((2..count).map(|k| [0, k - 1, k]).collect());
    }
    Ring::new(corners, normal).clip_ears(effort)
}

fn is_convex(corners: &[DVec3], normal: DVec3) -> bool {
    let count = corners.len();
    let at = |k: usize| corners[if k < count { k } else { k - count }];
    (0..count).all(|k| turn(at(k), at(k + 1), at(k + 2), normal) >= 0.0)
}

/// Returns a positive number if a, b, c turn in the sense of the polygon around `normal`.
fn turn(a: DVec3, b: DVec3, c: DVec3, normal: DVec3) -> f64 {
    (b - a).cross(c - b).dot(normal)
}

/// The remaining corners of a polygon while ears are cut off, always the first ear, counted from corner 0.
///
/// An ear is named by its first corner a; with the next two, b and c, it is cut off at b. A triangle abc that was refused because a corner
/// lies in it stays refused while that corner and the triangle exist, and corners found outside it stay outside. So each of the at most 3 n
/// triangles tests each corner once: n^2 in all, while testing again every triangle after every cut takes n^3. Only triangles in `open` may
/// be ears.
struct Ring<'a> {
    corners: &'a [DVec3],
    normal: DVec3,
    next: Vec<usize>,
    previous: Vec<usize>,
    left: Vec<bool>,
    /// Corner at which the search for a blocking corner continues, per first corner.
    looked_up_to: Vec<usize>,
    /// First corners of the triangles that were refused because of this corner, per corner.
    refused_by: Vec<Vec<usize>>,
    open: BTreeSet<usize>,
}

impl<'a> Ring<'a> {
    fn new(corners: &'a [DVec3], normal: DVec3) -> Self {
        let count = corners.len();
        Self {
            corners,
            normal,
            next: (0..count).map(|k| (k + 1) % count).collect(),
            previous: (0..count).map(|k| (k + count - 1) % count).collect(),
            left: vec![true; count],
            looked_up_to: vec![0; count],
            refused_by: vec![Vec::new(); count],
            open: (0..count).collect(),
        }
    }

    fn clip_ears(mut self, effort: &mut Effort<'_>) -> Result<Vec<[usize; 3]>, Untriangulated> {
        let count = self.corners.len();
        let mut triangles = Vec::with_capacity(count - 2);
        while triangles.len() + 3 < count {
            // a polygon that crosses itself may have no ear
            let Some(first) = self.open.pop_first() else { break };
            if !self.is_ear(first, effort)? {
                continue;
            }
            if effort.cancel.load(Ordering::Relaxed) {
                return Err(Untriangulated::Cancelled);
            }
            let tip = self.next[first];
            triangles.push([first, tip, self.next[tip]]);
            self.cut(first, tip);
        }
        let rest: Vec<usize> = (0..count).filter(|corner| self.left[*corner]).collect();
        triangles.extend((2..rest.len()).map(|k| [rest[0], rest[k - 1], rest[k]]));
        Ok(triangles)
    }

    fn is_ear(&mut self, first: usize, effort: &mut Effort<'_>) -> Result<bool, Untriangulated> {
        let tip = self.next[first];
        let [a, b, c] = [first, tip, self.next[tip]].map(|corner| self.corners[corner]);
        if turn(a, b, c, self.normal) <= 0.0 {
            return Ok(false);
        }
        let normal = self.normal;
        let inside =
            |p: DVec3| turn(a, b, p, normal) >= 0.0 && turn(b, c, p, normal) >= 0.0 && turn(c, a, p, normal) >= 0.0;
        let (from, count) = (self.looked_up_to[first], self.corners.len());
        let blocking = (from..count).find(|other| {
            let p = self.corners[*other];
            self.left[*other] && p != a && p != b && p != c && inside(p)
        });
        let looks = blocking.map_or(count - from, |other| other - from + 1);
        effort.looks = effort.looks.checked_sub(looks as u64).ok_or(Untriangulated::TooCostly)?;
        self.looked_up_to[first] = blocking.unwrap_or(count);
        if let Some(other) = blocking {
            self.refused_by[other].push(first);
        }
        Ok(blocking.is_none())
    }

    /// Removes the corner `tip` after `first`.
    fn cut(&mut self, first: usize, tip: usize) {
        let after = self.next[tip];
        self.next[first] = after;
        self.previous[after] = first;
        self.left[tip] = false;
        self.open.remove(&tip);
        let freed = std::mem::take(&mut self.refused_by[tip]);
        self.open.extend(freed.into_iter().filter(|corner| self.left[*corner]));
        for changed in [first, self.previous[first]] {
            self.looked_up_to[changed] = 0;
            self.open.insert(changed);
        }
    }
}

/// Returns the normal of a polygon with a length of twice its area (Newell).
fn newell_normal(corners: &[DVec3]) -> DVec3 {
    let origin = corners[0];
    let pairs = corners.windows(2).map(|pair| (pair[0] - origin).cross(pair[1] - origin));
    pairs.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    use glam::DVec2;
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    static NEVER: AtomicBool = AtomicBool::new(false);

    fn triangulate(corners: &[DVec3]) -> Vec<[usize; 3]> {
        super::triangulate(corners, &mut Effort { looks: u64::MAX, cancel: &NEVER }).unwrap()
    }

    fn flat(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 0.0)
    }

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let of_one =
            |[a, b, c]: &[usize; 3]| 0.5 * (corners[*b] - corners[*a]).cross(corners[*c] - corners[*a]).length();
        triangles.iter().map(of_one).sum()
    }

    /// Returns a ribbon of `count` corners that goes up and down `count / 2 - 1` times.
    fn zigzag(count: usize) -> Vec<DVec3> {
        let line: Vec<_> = (0..count / 2).map(|k| flat(k as f64 * 0.01, (k % 2) as f64)).collect();
        let back = line.iter().rev().map(|corner| *corner - flat(0.0, 0.02));
        line.iter().copied().chain(back).collect()
    }

    /// Triangulates by the definition of [`Ring`], slowly: searches the first ear after every cut, testing everything again.
    fn ears_by_definition(corners: &[DVec3]) -> Vec<[usize; 3]> {
        let normal = newell_normal(corners);
        let mut ring: Vec<usize> = (0..corners.len()).collect();
        let mut triangles = Vec::new();
        while ring.len() > 3 {
            let ear = (0..ring.len()).find(|k| {
                let [a, b, c] = [*k, k + 1, k + 2].map(|k| corners[ring[k % ring.len()]]);
                let inside =
                    |p: DVec3| [(a, b), (b, c), (c, a)].iter().all(|(from, to)| turn(*from, *to, p, normal) >= 0.0);
                let blocks = |p: DVec3| p != a && p != b && p != c && inside(p);
                turn(a, b, c, normal) > 0.0 && !ring.iter().any(|corner| blocks(corners[*corner]))
            });
            let Some(ear) = ear else { break };
            triangles.push([ear, ear + 1, ear + 2].map(|k| ring[k % ring.len()]));
            ring.remove((ear + 1) % ring.len());
        }
        triangles.extend((2..ring.len()).map(|k| [ring[0], ring[k - 1], ring[k]]));
        triangles
    }

    #[test]
    fn the_ears_are_those_of_the_definition() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut unit = move || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        for round in 0..600 {
            let count = 4 + round % 29;
            let corners: Vec<DVec3> = match round % 4 {
                // stars
                0 => (0..count)
                    .map(|k| {
                        let angle = std::f64::consts::TAU * k as f64 / count as f64;
                        DVec3::from((DVec2::from_angle(angle) * (0.1 + unit()), 0.0))
                    })
                    .collect(),
                // lines that cross
                1 => (0..count).map(|_| flat(unit(), unit())).collect(),
                // many equal corners, and many on one line
                2 => (0..count).map(|_| flat((unit() * 4.0).floor(), (unit() * 4.0).floor())).collect(),
                _ => zigzag(count),
            };
            let mut turned = corners.clone();
            turned.reverse();
            for corners in [corners, turned] {
                let normal = newell_normal(&corners);
                if normal != DVec3::ZERO && !is_convex(&corners, normal) {
                    assert_eq!(triangulate(&corners), ears_by_definition(&corners), "{corners:?}");
                }
                assert_eq!(triangulate(&corners).len(), corners.len() - 2);
            }
        }
    }

    #[test]
    fn a_ribbon_costs_the_square_of_its_corners() {
        for count in [500, 1000] {
            let corners = zigzag(count);
            let looks = 3 * (count * count) as u64;
            let mut effort = Effort { looks, cancel: &NEVER };
            let triangles = super::triangulate(&corners, &mut effort).unwrap();
            let expected = 0.02 * 0.01 * (count / 2 - 1) as f64;
            assert!((area(&corners, &triangles) - expected).abs() < 1e-9 * expected, "{count}");
            let used = looks - effort.looks;
            let mut too_little = Effort { looks: used - 1, cancel: &NEVER };
            assert_eq!(super::triangulate(&corners, &mut too_little), Err(Untriangulated::TooCostly));
        }
        let mut cancelled = Effort { looks: u64::MAX, cancel: &AtomicBool::new(true) };
        assert_eq!(super::triangulate(&zigzag(100), &mut cancelled), Err(Untriangulated::Cancelled));
    }

    #[test]
    fn concave_polygons_keep_their_area_and_stay_inside() {
        // an L of area 3 whose fan from the first corner would cover ground outside
        let corners = [(2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0), (0.0, 0.0)]
            .map(|(x, y)| DVec3::new(x, 3.0, y));
        let triangles = triangulate(&corners);
        assert_eq!(triangles.len(), 4);
        assert!((area(&corners, &triangles) - 3.0).abs() < 1e-12);
        let mut turned = corners;
        turned.reverse();
        assert!((area(&turned, &triangulate(&turned)) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn convex_polygons_are_fans() {
        let corners: Vec<_> =
            (0..100_000).map(|k| DVec3::from((glam::DVec2::from_angle(f64::from(k) * 6.28e-5), 0.0))).collect();
        assert_eq!(triangulate(&corners).len(), corners.len() - 2);
    }

    #[test]
    fn degenerate_polygons_do_not_panic() {
        let point = [DVec3::ONE; 5];
        assert_eq!(triangulate(&point).len(), 3);
        let bow_tie = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        assert_eq!(triangulate(&bow_tie).len(), 2);
        let star: Vec<_> =
            (0..5).map(|k| DVec3::from((glam::DVec2::from_angle(f64::from(k * 2) * 1.2566), 0.0))).collect();
        assert_eq!(triangulate(&star).len(), 3);
    }
}
