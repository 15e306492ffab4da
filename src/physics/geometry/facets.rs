//! Grouping of mesh triangles into planar facets.

use std::collections::VecDeque;

use glam::{DVec2, DVec3};

use super::disc::disc_edge_area;
use crate::sampling::warp;

/// Largest angle in radians between normals of one plane: areas are then off by less than 1e-6.
const SAME_DIRECTION: f64 = 1e-3;

/// Facets of a mesh: groups of adjacent triangles in one plane, of one kind.
#[derive(Clone, Debug, Default)]
pub struct Facets {
    /// Index of the facet of each triangle.
    pub of_triangle: Vec<u32>,
    /// Unit normal of each facet, by the winding of its largest triangle.
    pub normals: Vec<DVec3>,
    /// Area of each facet in m2, projected on its plane.
    pub areas_m2: Vec<f64>,
    /// Index of the largest triangle of each facet.
    pub largest: Vec<u32>,
    /// Edges around each facet, counter-clockwise about its normal.
    edges: Vec<[DVec3; 2]>,
    /// Index of the first edge of each facet, and one past the last.
    starts: Vec<usize>,
}

impl Facets {
    /// Groups adjacent triangles of equal `kinds`; a triangle joins if its corners lie within `tolerance` (m) of the plane of the group's
    /// largest triangle.
    pub fn new(positions: &[DVec3], triangles: &[[u32; 3]], kinds: &[u32], tolerance: f64) -> Self {
        let corners = |triangle: u32| triangles[triangle as usize].map(|corner| positions[corner as usize]);
        let twice_area = |triangle: u32| {
            let [a, b, c] = corners(triangle);
            (b - a).cross(c - a)
        };
        let neighbours = Neighbours::new(triangles);
        let mut seeds: Vec<u32> = (0..triangles.len() as u32).collect();
        seeds
            .sort_by(|a, b| twice_area(*b).length_squared().total_cmp(&twice_area(*a).length_squared()).then(a.cmp(b)));

        let mut facets = Self { of_triangle: vec![u32::MAX; triangles.len()], starts: vec![0], ..Self::default() };
        for seed in seeds {
            if facets.of_triangle[seed as usize] != u32::MAX {
                continue;
            }
            let number = facets.normals.len() as u32;
            let normal = twice_area(seed).try_normalize().unwrap_or(DVec3::Z);
            let height = normal.dot(corners(seed)[0]);
            let fits = |triangle: u32| {
                let direction = twice_area(triangle).try_normalize().unwrap_or(normal);
                kinds[triangle as usize] == kinds[seed as usize]
                    && direction.cross(normal).length() < SAME_DIRECTION
                    && corners(triangle).iter().all(|corner| (normal.dot(*corner) - height).abs() <= tolerance)
            };
            facets.of_triangle[seed as usize] = number;
            let mut members = vec![seed];
            let mut open = VecDeque::from([seed]);
            while let Some(triangle) = open.pop_front() {
                for next in neighbours.of(triangle) {
                    if facets.of_triangle[next as usize] == u32::MAX && fits(next) {
                        facets.of_triangle[next as usize] = number;
                        members.push(next);
                        open.push_back(next);
                    }
                }
            }
            let forward = |triangle: u32| twice_area(triangle).dot(normal) >= 0.0;
            facets.areas_m2.push(members.iter().map(|triangle| 0.5 * twice_area(*triangle).dot(normal).abs()).sum());
            facets.normals.push(normal);
            facets.largest.push(seed);
            let around = outline(members.iter().flat_map(|triangle| {
                let [a, b, c] = triangles[*triangle as usize];
                sides(if forward(*triangle) { [a, b, c] } else { [a, c, b] })
            }));
            facets.edges.extend(around.into_iter().map(|side| side.map(|corner| positions[corner as usize])));
            facets.starts.push(facets.edges.len());
        }
        facets
    }

    /// Returns the number of facets.
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// True if there is no facet, because the mesh had no triangle.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty()
    }

    /// Returns the edges around a facet, counter-clockwise about its normal.
    pub fn edges(&self, facet: usize) -> &[[DVec3; 2]] {
        &self.edges[self.starts[facet]..self.starts[facet + 1]]
    }

    /// Computes the area in m2 of the part of a facet within `radius` of a point of its plane.
    pub fn area_within(&self, facet: usize, centre: DVec3, radius: f64) -> f64 {
        let normal = self.normals[facet];
        let (u, v) = (warp::around(normal, DVec3::X), warp::around(normal, DVec3::Y));
        let flat = |p: DVec3| DVec2::new((p - centre).dot(u), (p - centre).dot(v));
        self.edges(facet).iter().map(|[a, b]| disc_edge_area(radius, flat(*a), flat(*b))).sum::<f64>().max(0.0)
    }
}

/// Triangles that share a side.
struct Neighbours {
    /// Sides of triangles, three each in their order, sorted by their corners.
    sorted: Vec<u32>,
    /// Range of `sorted` with the same corners, by sides.
    alike: Vec<[u32; 2]>,
}

impl Neighbours {
    fn new(triangles: &[[u32; 3]]) -> Self {
        let corners = triangles.iter().flat_map(|triangle| sides(*triangle).map(unordered));
        let mut all: Vec<([u32; 2], u32)> = corners.zip(0..).collect();
        all.sort_unstable();
        let mut alike = vec![[0; 2]; all.len()];
        let mut first = 0;
        for group in all.chunk_by(|one, other| one.0 == other.0) {
            let next = first + group.len() as u32;
            group.iter().for_each(|(_, side)| alike[*side as usize] = [first, next]);
            first = next;
        }
        Self { sorted: all.into_iter().map(|(_, side)| side).collect(), alike }
    }

    /// Iterates over the triangles that share a side with this one, which is among them.
    fn of(&self, triangle: u32) -> impl Iterator<Item = u32> {
        let ranges = self.alike[3 * triangle as usize..3 * triangle as usize + 3].iter();
        ranges.flat_map(|[from, to]| self.sorted[*from as usize..*to as usize].iter().map(|side| side / 3))
    }
}

/// Returns the index of the connected piece of each triangle; triangles are connected if they share corners, directly or through others.
/// Pieces are numbered in the order of their first triangles.
///
/// ```
/// use skyduct_physics::geometry::facets::pieces;
///
/// assert_eq!(pieces(8, &[[0, 1, 2], [3, 4, 5], [2, 6, 7]]), [0, 1, 0]);
/// ```
pub fn pieces(corners: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    // each corner points to another of its piece, at last to itself
    let mut toward: Vec<u32> = (0..corners as u32).collect();
    let root = |toward: &mut Vec<u32>, mut corner: u32| {
        while toward[corner as usize] != corner {
            let next = toward[toward[corner as usize] as usize];
            toward[corner as usize] = next;
            corner = next;
        }
        corner
    };
    for [a, b, c] in triangles {
        let joined = [*a, *b, *c].map(|corner| root(&mut toward, corner));
        let lowest = joined[0].min(joined[1]).min(joined[2]);
        joined.iter().for_each(|corner| toward[*corner as usize] = lowest);
    }
    let mut numbers = vec![u32::MAX; corners];
    let mut count = 0;
    let number = |[corner, ..]: &[u32; 3]| {
        let number = &mut numbers[root(&mut toward, *corner) as usize];
        if *number == u32::MAX {
            *number = count;
            count += 1;
        }
        *number
    };
    triangles.iter().map(number).collect()
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

fn unordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the directed sides that remain when opposite ones have cancelled: the outline of a group of triangles.
fn outline(sides: impl Iterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
    let mut signed: Vec<([u32; 2], i32)> =
        sides.map(|side| (unordered(side), if side[0] < side[1] { 1 } else { -1 })).collect();
    signed.sort_unstable();
    let mut left = Vec::new();
    for group in signed.chunk_by(|a, b| a.0 == b.0) {
        let net: i32 = group.iter().map(|(_, sign)| sign).sum();
        let [a, b] = group[0].0;
        left.extend(std::iter::repeat_n(if net > 0 { [a, b] } else { [b, a] }, net.unsigned_abs() as usize));
    }
    left
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Returns a unit cube of 12 triangles, half of them wound the wrong way.
    fn cube() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let positions =
            (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
        let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        (positions, faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, d, c]]).collect())
    }

    #[test]
    fn a_cube_has_six_facets() {
        let (positions, triangles) = cube();
        let facets = Facets::new(&positions, &triangles, &[0; 12], 1e-9);
        assert_eq!(facets.len(), 6);
        for facet in 0..6 {
            assert_eq!(facets.edges(facet).len(), 4, "the diagonal is inside");
            assert!((facets.areas_m2[facet] - 1.0).abs() < 1e-15);
        }
        // two materials on one face are two facets
        let mut kinds = [0; 12];
        kinds[3] = 1;
        assert_eq!(Facets::new(&positions, &triangles, &kinds, 1e-9).len(), 7);
    }

    /// Checks a disc in the middle, across an edge, at a corner, and one that covers the whole facet.
    #[test]
    fn clipped_discs() {
        let (positions, triangles) = cube();
        let facets = Facets::new(&positions, &triangles, &[0; 12], 1e-9);
        let top = facets.of_triangle[2] as usize;
        let area = |x: f64, y: f64, radius: f64| facets.area_within(top, DVec3::new(x, y, 1.0), radius);
        assert!((area(0.5, 0.5, 0.3) - PI * 0.09).abs() < 1e-15);
        assert!((area(0.0, 0.5, 0.3) - PI * 0.045).abs() < 1e-15);
        assert!((area(1.0, 1.0, 0.3) - PI * 0.0225).abs() < 1e-15);
        assert!((area(0.3, 0.4, 9.0) - 1.0).abs() < 1e-13);
    }

    /// Checks that a hole in a ring of triangles in one plane does not count as area.
    #[test]
    fn holes_stay_open() {
        let ring = |half: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x * half, y * half, 2.0))
        };
        let positions: Vec<DVec3> = ring(2.0).into_iter().chain(ring(1.0)).collect();
        let triangles: Vec<[u32; 3]> = (0..4)
            .flat_map(|k| {
                let next = (k + 1) % 4;
                [[k, next, next + 4], [k, next + 4, k + 4]]
            })
            .collect();
        let facets = Facets::new(&positions, &triangles, &[0; 8], 1e-9);
        assert_eq!((facets.len(), facets.edges(0).len()), (1, 8));
        assert!((facets.area_within(0, DVec3::new(0.0, 0.0, 2.0), 1.0)).abs() < 1e-14);
        assert!((facets.area_within(0, DVec3::new(0.0, 0.0, 2.0), 10.0) - 12.0).abs() < 1e-12);
    }
}
