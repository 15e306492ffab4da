//! Blocks around the parts of a mesh: together smaller than one around the whole, so that fewer rays are tested against the mesh itself.

use glam::DVec3;

use crate::geometry::TriangleMesh;

/// Largest number of blocks around one mesh: the legs, the seat and the back of a chair have one each.
const MOST: usize = 8;

/// Number of planes along each axis at which a division of a part is tried.
const PLANES: usize = 15;

/// Largest fraction of the volume of one block around the mesh that blocks around its parts may have together: each costs time, too.
const WORTHWHILE: f64 = 0.5;

/// Lowest and highest corner of an axis-aligned block, in m.
type Bounds = [DVec3; 2];

const EMPTY: Bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];

/// Some triangles of a mesh, and the block around them.
struct TriangleGroup {
    triangles: Vec<u32>,
    bounds: Bounds,
}

/// Finds at most [`MOST`] axis-aligned blocks that hold all triangles of a mesh: the lowest and highest corner of each.
pub fn blocks_around(mesh: &TriangleMesh) -> Vec<Bounds> {
    let whole = TriangleGroup::new(mesh, (0..mesh.triangles.len() as u32).collect());
    if whole.triangles.is_empty() {
        return Vec::new();
    }
    let all = whole.bounds;
    let (mut open, mut done) = (vec![whole], Vec::new());
    let larger = |a: &TriangleGroup, b: &TriangleGroup| volume(&a.bounds).total_cmp(&volume(&b.bounds));
    while let Some(largest) = (0..open.len()).max_by(|a, b| larger(&open[*a], &open[*b])) {
        let part = open.swap_remove(largest);
        match part.divided(mesh).filter(|_| open.len() + done.len() + 2 <= MOST) {
            Some(halves) => open.extend(halves),
            None => done.push(part.bounds),
        }
    }
    if done.iter().map(volume).sum::<f64>() <= WORTHWHILE * volume(&all) { done } else { vec![all] }
}

impl TriangleGroup {
    fn new(mesh: &TriangleMesh, triangles: Vec<u32>) -> Self {
        let bounds = triangles.iter().fold(EMPTY, |bounds, triangle| joined(&bounds, &bounds_of(mesh, *triangle)));
        Self { triangles, bounds }
    }

    /// Divides the part at the plane that leaves the least volume; `None` where every plane has all triangles on one side.
    fn divided(&self, mesh: &TriangleMesh) -> Option<[Self; 2]> {
        let [low, high] = self.bounds;
        // number of the last plane that a triangle's middle is before
        let slab = |triangle: u32, axis: usize| {
            let [least, most] = bounds_of(mesh, triangle).map(|corner| corner[axis]);
            let fraction = (0.5 * (least + most) - low[axis]) / (high[axis] - low[axis]);
            ((fraction * (PLANES + 1) as f64) as usize).min(PLANES)
        };
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in (0..3).filter(|axis| high[*axis] > low[*axis]) {
            let mut slabs = [EMPTY; PLANES + 1];
            for triangle in &self.triangles {
                let slab = &mut slabs[slab(*triangle, axis)];
                *slab = joined(slab, &bounds_of(mesh, *triangle));
            }
            for plane in 1..=PLANES {
                let [before, behind] = [&slabs[..plane], &slabs[plane..]];
                let both = [before, behind].map(|slabs| slabs.iter().fold(EMPTY, |all, slab| joined(&all, slab)));
                let sum = volume(&both[0]) + volume(&both[1]);
                let halves = both.iter().all(|[low, high]| low.x <= high.x);
                if halves && best.is_none_or(|(least, ..)| sum < least) {
                    best = Some((sum, axis, plane));
                }
            }
        }
        let (_, axis, plane) = best?;
        let (before, behind) = self.triangles.iter().partition(|triangle| slab(**triangle, axis) < plane);
        Some([before, behind].map(|triangles| Self::new(mesh, triangles)))
    }
}

fn bounds_of(mesh: &TriangleMesh, triangle: u32) -> Bounds {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|corner| mesh.positions[corner as usize]);
    [a.min(b).min(c), a.max(b).max(c)]
}

fn joined([low, high]: &Bounds, [other_low, other_high]: &Bounds) -> Bounds {
    [low.min(*other_low), high.max(*other_high)]
}

/// Returns the volume of a block in m3.
fn volume([low, high]: &Bounds) -> f64 {
    (*high - *low).element_product()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of five boards: the blocks hold every corner of every triangle, and little else.
    #[test]
    fn parts_have_blocks_of_their_own() {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let legs = [[0.0, 0.0], [0.9, 0.0], [0.0, 0.9], [0.9, 0.9]];
        let legs = legs.map(|[x, y]| [DVec3::new(x, y, 0.0), DVec3::new(0.1, 0.1, 0.7)]);
        for [corner, size] in legs.into_iter().chain([[DVec3::new(0.0, 0.0, 0.7), DVec3::new(1.0, 1.0, 0.02)]]) {
            let first = positions.len() as u32;
            positions.extend((0..8).map(|k| {
                let side = |bit: u32| f64::from(k >> bit & 1);
                corner + size * DVec3::new(side(0), side(1), side(2))
            }));
            for [a, b, c, d] in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
                triangles.extend([[a, b, c], [a, c, d]].map(|corners| corners.map(|corner| first + corner)));
            }
        }
        let triangle_materials = vec![0; triangles.len()];
        let materials = vec![String::new()];
        let mesh = TriangleMesh { positions, triangles, triangle_materials, materials, ..TriangleMesh::default() };
        let blocks = blocks_around(&mesh);
        assert!((5..=MOST).contains(&blocks.len()), "{blocks:?}");
        for triangle in 0..mesh.triangles.len() as u32 {
            let bounds = bounds_of(&mesh, triangle);
            assert!(blocks.iter().any(|block| joined(block, &bounds) == *block), "{bounds:?} {blocks:?}");
        }
        let (all, boards) = (blocks.iter().map(volume).sum::<f64>(), 4.0 * 0.007 + 0.02);
        assert!(all < 2.0 * boards, "{all} {boards}");
    }
}
