//! Merging of corners of triangles that lie in one cell of a lattice, which thins meshes for pictures (Rossignac and Borrel 1993).

use std::collections::{HashMap, HashSet};

use glam::DVec3;

/// Triangles under construction, whose corners are merged.
#[derive(Debug, Default)]
pub struct Merging {
    /// Edge of the cells in m; 0 merges equal corners alone.
    cell_m: f64,
    /// Corners in m: of each cell the first that was met.
    pub corners: Vec<DVec3>,
    /// Numbers of the corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    known: HashMap<[u64; 3], u32>,
    seen: HashSet<[u32; 3]>,
}

impl Merging {
    /// Starts without triangles; cells have edges of `cell_m` in m, or merge equal corners alone where it is 0.
    pub fn new(cell_m: f64) -> Self {
        Self { cell_m, ..Self::default() }
    }

    /// Adds a triangle, unless two of its corners are one now, or another triangle has the same three.
    pub fn add(&mut self, triangle: [DVec3; 3]) {
        let corners = triangle.map(|corner| self.number(corner));
        let mut key = corners;
        key.sort_unstable();
        if key[0] != key[1] && key[1] != key[2] && self.seen.insert(key) {
            self.triangles.push(corners);
        }
    }

    fn number(&mut self, corner: DVec3) -> u32 {
        let place = if self.cell_m > 0.0 { (corner / self.cell_m).floor() } else { corner };
        let next = self.corners.len() as u32;
        // -0 and 0 are one place
        let number = *self.known.entry((place + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next);
        if number == next {
            self.corners.push(corner);
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate of 100 x 100 squares in cells of 10 squares: each cell has its first corner, so that the plate keeps its place and loses less
    /// than a cell of each edge.
    #[test]
    fn a_plate_is_thinned_to_its_cells() {
        let square = |number: usize| {
            let [x, y] = [number % 100, number / 100].map(|at| at as f64);
            let at = |i: f64, j: f64| DVec3::new(x + i, y + j, 0.5) / 100.0;
            [[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)], [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]]
        };
        let merged = |cell_m: f64| {
            let mut merging = Merging::new(cell_m);
            (0..10_000).flat_map(square).for_each(|triangle| merging.add(triangle));
            let of = |[a, b, c]: &[u32; 3]| [a, b, c].map(|corner| merging.corners[*corner as usize]);
            let area: f64 = merging.triangles.iter().map(of).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).z).sum();
            (merging.corners.len(), merging.triangles.len(), area)
        };
        let (corners, triangles, area) = merged(0.0);
        assert_eq!((corners, triangles), (101 * 101, 20_000));
        assert!((area - 1.0).abs() < 1e-9, "{area}");
        // a hair beside the corners, so that rounding moves none into another cell
        let (corners, triangles, area) = merged(0.1001);
        assert_eq!((corners, triangles), (100, 162));
        assert!(area > 0.8 && area <= 1.0, "{area}");
    }
}
