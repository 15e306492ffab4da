//! Generated meshes of any number of triangles: a bent pipe, and a chair.

use std::f64::consts::{FRAC_PI_4, TAU};

use glam::DVec3;

use super::scenes::DIAMETER_M;
use skyduct::geometry::TriangleMesh;

/// Mesh under construction.
#[derive(Default)]
struct Growing {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    triangle_materials: Vec<u32>,
}

impl Growing {
    fn corner(&mut self, position: DVec3) -> u32 {
        self.positions.push(position);
        self.positions.len() as u32 - 1
    }

    fn triangle(&mut self, corners: [u32; 3], material: u32) {
        self.triangles.push(corners);
        self.triangle_materials.push(material);
    }

    fn finished(self, materials: &[&str]) -> TriangleMesh {
        let Self { positions, triangles, triangle_materials } = self;
        let materials = materials.iter().map(|name| (*name).to_owned()).collect();
        TriangleMesh { positions, triangles, triangle_materials, materials, ..TriangleMesh::default() }
    }
}

/// Returns a pipe of the diameter of S1, the lower half of its `length` in metres upright, the upper half tilted by 45 degrees
/// to the east, of about `triangles` (1000 or more) facets: material `pipe`, and `diffuser` over its opening, whose centre is
/// the origin.
pub fn elbow(length: f64, triangles: usize) -> TriangleMesh {
    let sides = (triangles as f64).sqrt().round() as u32;
    let rows = (triangles as u32 / (4 * sides)).max(1);
    let radius = 0.5 * DIAMETER_M;
    let tilted = DVec3::new(libm::sin(FRAC_PI_4), 0.0, libm::cos(FRAC_PI_4));
    let bend = DVec3::Z * 0.5 * length;
    // of each segment: its axis, a point of the plane that ends it, and the plane's normal
    let segments = [(DVec3::Z, bend, DVec3::Z + tilted), (tilted, bend + tilted * 0.5 * length, tilted)];
    let around = |side: u32| TAU * f64::from(side) / f64::from(sides);
    let begin: Vec<DVec3> =
        (0..sides).map(|side| DVec3::new(libm::cos(around(side)), libm::sin(around(side)), 0.0) * radius).collect();
    let mut mesh = Growing::default();
    let mut ring: Vec<u32> = begin.iter().map(|position| mesh.corner(*position)).collect();
    let centre = mesh.corner(DVec3::ZERO);
    let next = |side: u32| ((side + 1) % sides) as usize;
    for side in 0..sides {
        mesh.triangle([centre, ring[next(side)], ring[side as usize]], 1);
    }
    let mut from = begin;
    for (axis, through, normal) in segments {
        let to: Vec<DVec3> = from
            .iter()
            .map(|position| *position + axis * ((through - *position).dot(normal) / axis.dot(normal)))
            .collect();
        for row in 1..=rows {
            let share = f64::from(row) / f64::from(rows);
            let above: Vec<u32> = from.iter().zip(&to).map(|(from, to)| mesh.corner(from.lerp(*to, share))).collect();
            for side in 0..sides {
                let (here, there) = (side as usize, next(side));
                mesh.triangle([ring[here], above[there], ring[there]], 0);
                mesh.triangle([ring[here], above[here], above[there]], 0);
            }
            ring = above;
        }
        from = to;
    }
    mesh.finished(&["pipe", "diffuser"])
}

/// Height of a chair's seat, its width and depth, and the thickness of its bars and boards, in m.
const SEAT_M: f64 = 0.45;
const SIDE_M: f64 = 0.42;
const BAR_M: f64 = 0.03;

/// Returns a chair of six bars and boards, 0.42 m wide and 0.9 m high, whose faces are grids of `net` x `net` squares: 72 net^2
/// triangles of the material `wood`.
pub fn chair(net: u32) -> TriangleMesh {
    let far = SIDE_M - BAR_M;
    let leg = DVec3::new(BAR_M, BAR_M, SEAT_M);
    let legs = [[0.0, 0.0], [far, 0.0], [0.0, far], [far, far]];
    let mut mesh = Growing::default();
    for [x, y] in legs {
        board(&mut mesh, DVec3::new(x, y, 0.0), leg, net);
    }
    board(&mut mesh, DVec3::new(0.0, 0.0, SEAT_M), DVec3::new(SIDE_M, SIDE_M, BAR_M), net);
    board(&mut mesh, DVec3::new(0.0, far, SEAT_M + BAR_M), DVec3::new(SIDE_M, BAR_M, SEAT_M - BAR_M), net);
    mesh.finished(&["wood"])
}

/// Returns a [`chair`] with legs that splay by 2 cm, a back that leans by 10 cm and is hollow, and a seat whose upper side is
/// slightly hollow: no part of it is a cuboid.
pub fn bent_chair(net: u32) -> TriangleMesh {
    let mut mesh = chair(net);
    for corner in &mut mesh.positions {
        let above = (corner.z - SEAT_M) / SEAT_M;
        if above < 0.0 {
            let outward = |at: f64| if at < 0.5 * SIDE_M { above } else { -above };
            *corner += 0.02 * DVec3::new(outward(corner.x), outward(corner.y), 0.0);
        } else {
            let aside = 2.0 * corner.x / SIDE_M - 1.0;
            corner.y += above * (0.1 * above + 0.04 * (0.5 - aside * aside));
        }
    }
    mesh
}

/// Adds a cuboid from a corner, whose six faces are grids of squares that face outward.
fn board(mesh: &mut Growing, corner: DVec3, size: DVec3, net: u32) {
    let edges = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
    for axis in 0..3 {
        let (u, v, w) = (edges[axis], edges[(axis + 1) % 3], edges[(axis + 2) % 3]);
        // u x v is along w
        for (origin, u, v) in [(corner + w, u, v), (corner, v, u)] {
            let mut at = |i: u32, j: u32| {
                mesh.corner(origin + u * (f64::from(i) / f64::from(net)) + v * (f64::from(j) / f64::from(net)))
            };
            let corners: Vec<u32> =
                (0..=net).flat_map(|i| (0..=net).map(move |j| (i, j))).map(|(i, j)| at(i, j)).collect();
            let corner = |i: u32, j: u32| corners[(i * (net + 1) + j) as usize];
            for (i, j) in (0..net).flat_map(|i| (0..net).map(move |j| (i, j))) {
                mesh.triangle([corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)], 0);
                mesh.triangle([corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)], 0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(mesh: &TriangleMesh, material: u32) -> f64 {
        let of = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        let triangles = mesh.triangles.iter().zip(&mesh.triangle_materials);
        triangles.filter(|(_, of)| **of == material).map(|(triangle, _)| of(triangle)).sum()
    }

    /// Mitred pieces of one length have the mantle of a straight pipe.
    #[test]
    fn an_elbow_has_its_facets_and_its_areas() {
        for triangles in [1000, 10_000, 100_000] {
            let mesh = elbow(1.0, triangles);
            let found = mesh.triangles.len() as f64 / triangles as f64;
            assert!((0.9..1.1).contains(&found), "{triangles}: {found}");
            let radius = 0.5 * DIAMETER_M;
            assert!((area(&mesh, 0) / (TAU * radius) - 1.0).abs() < 0.01);
            assert!((area(&mesh, 1) / (0.5 * TAU * radius * radius) - 1.0).abs() < 0.01);
        }
    }

    /// Applies the divergence theorem: a closed surface that faces outward has the volume of its boards, which shearing does
    /// not change but by rounding.
    #[test]
    fn chairs_are_closed_and_their_faces_look_outward() {
        let boards = 4.0 * 0.03 * 0.03 * 0.45 + 0.42 * 0.42 * 0.03 + 0.42 * 0.03 * 0.42;
        for mesh in [chair(12), bent_chair(12)] {
            assert_eq!(mesh.triangles.len(), 72 * 144);
            let of = |corners: &[u32; 3]| {
                let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
                a.dot(b.cross(c)) / 6.0
            };
            let volume: f64 = mesh.triangles.iter().map(of).sum();
            assert!((volume / boards - 1.0).abs() < 1e-9, "{volume}");
        }
    }
}
