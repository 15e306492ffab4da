//! Bounding volume hierarchy with up to [`WIDTH`] children per node and triangles per leaf: a binary tree of the crate obvhs, which only
//! this module uses, made wide by [`super::collapse`] and traversed as by Wald, Benthin and Boulos 2008.
//!
//! Boxes and triangles are in f32 and tested a whole node or leaf at a time, as a conservative filter: candidates are decided elsewhere, in
//! f64.

use glam::Vec3A;
use obvhs::BvhBuildParams;
pub use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;

use super::collapse::{BinaryNode, Collapse};
use super::lanes::Lanes;
use super::tree_ray::{Bounds, BoxRay, Corners, NO_BOXES, Numbers, TriangleRay, WIDTH};

/// Capacity in nodes of the fixed traversal stack; deeper trees allocate a larger one.
const WAITING: usize = 96;

/// Tree of boxes over triangles.
#[derive(Clone, Debug)]
pub struct WideTree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// Largest number of children that can wait during a traversal.
    most_waiting: usize,
}

#[derive(Clone, Debug)]
#[repr(align(64))]
struct Node {
    bounds: Bounds,
    children: [Child; WIDTH],
}

/// Reference to a child: index of a node, or of a leaf with the bit [`Child::LEAF`] set.
#[derive(Clone, Copy, Debug)]
struct Child(u32);

/// A leaf with up to [`WIDTH`] triangles.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Leaf {
    coordinates: Corners,
    /// Indices of the triangles; [`NONE`] in empty lanes.
    numbers: Numbers,
    /// Indices of the triangles' corners.
    corners: [[u32; 3]; WIDTH],
}

/// Index that stands for no triangle.
pub const NONE: u32 = u32::MAX;

impl Child {
    const LEAF: u32 = 1 << 31;

    fn leaf(self) -> Option<usize> {
        (self.0 & Self::LEAF != 0).then_some((self.0 & !Self::LEAF) as usize)
    }
}

impl Leaf {
    fn new(numbers: impl Iterator<Item = u32>, triangles: &[[u32; 3]], positions: &[Vec3A]) -> Self {
        let mut leaf =
            Self { coordinates: [[[f32::NAN; WIDTH]; 3]; 3], numbers: [NONE; WIDTH], corners: [[0; 3]; WIDTH] };
        for (lane, triangle) in numbers.enumerate() {
            leaf.numbers[lane] = triangle;
            leaf.corners[lane] = triangles[triangle as usize];
            for (rows, corner) in leaf.coordinates.iter_mut().zip(leaf.corners[lane]) {
                (0..3).for_each(|axis| rows[axis][lane] = positions[corner as usize][axis]);
            }
        }
        leaf
    }
}

impl WideTree {
    /// Builds a tree from the bounding `boxes` of triangles; `triangles` are the indices of their corners, at least one triangle, at most
    /// 2^31; `positions` are in the coordinates of the boxes.
    pub fn new(boxes: &[Aabb], triangles: &[[u32; 3]], positions: &[Vec3A]) -> Self {
        // one triangle per leaf: leaves are merged together with the nodes
        let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::fast_build() };
        let tree = build_bvh2(boxes, params, &mut Default::default());
        let binary = tree.nodes.iter().map(|node| BinaryNode {
            half_area: node.aabb().half_area(),
            first: node.first_index,
            triangles: node.prim_count,
        });
        let collapse = Collapse::new(binary.collect());
        // room for leaves that are half full on average: what is not used costs nothing
        let leaves = Vec::with_capacity(2 * triangles.len() / WIDTH + 1);
        let mut wide = Self { nodes: Vec::new(), leaves, most_waiting: 1 };
        // a work list instead of recursion: a tree may be deeper than the stack of a thread
        let mut left = vec![(0, None::<(usize, usize)>, 1)];
        while let Some((binary, parent, waiting)) = left.pop() {
            let place = wide.nodes.len();
            if let Some((node, lane)) = parent {
                wide.nodes[node].children[lane] = Child(place as u32);
            }
            wide.nodes.push(Node::EMPTY);
            let children = collapse.children(binary);
            // all but one wait while that is followed
            let waiting = waiting + children.len() - 1;
            wide.most_waiting = wide.most_waiting.max(waiting);
            for (lane, index) in children.into_iter().enumerate() {
                let bounds = tree.nodes[index].aabb();
                for axis in 0..3 {
                    wide.nodes[place].bounds[axis][lane] = bounds.min[axis];
                    wide.nodes[place].bounds[axis + 3][lane] = bounds.max[axis];
                }
                if collapse.is_leaf(index) {
                    wide.nodes[place].children[lane] = Child(wide.leaves.len() as u32 | Child::LEAF);
                    let numbers = collapse.triangles(index).map(|place| tree.primitive_indices[place as usize]);
                    wide.leaves.push(Leaf::new(numbers, triangles, positions));
                } else {
                    left.push((index, Some((place, lane)), waiting));
                }
            }
        }
        wide
    }

    /// Passes the indices of the corners of all triangles to `change`, leaf by leaf.
    pub fn for_each_corner(&mut self, mut change: impl FnMut(&mut u32)) {
        for leaf in &mut self.leaves {
            let used = leaf.corners.iter_mut().zip(leaf.numbers).filter(|(_, number)| *number != NONE);
            used.flat_map(|(corners, _)| corners).for_each(&mut change);
        }
    }

    /// Calls `meet` for every triangle except `skip` that a ray may hit before the distance `reach`, mostly those in nearer boxes first,
    /// with the indices of its corners; `meet` returns the new `reach`.
    #[inline(always)]
    pub fn follow<L: Lanes>(
        &self,
        lanes: L,
        (ray, line): (&BoxRay, &TriangleRay),
        skip: u32,
        mut reach: f32,
        mut meet: impl FnMut(u32, [u32; 3]) -> f32,
    ) {
        let (ray, line) = (lanes.for_boxes(ray), lanes.for_triangles(line));
        let mut few = [(Child(0), 0.0); WAITING];
        let mut many = Vec::new();
        let waiting = if self.most_waiting <= WAITING {
            &mut few[..]
        } else {
            many.resize(self.most_waiting, (Child(0), 0.0));
            &mut many[..]
        };
        let mut count = 0;
        let mut child = Child(0);
        loop {
            if let Some(place) = child.leaf() {
                let leaf = &self.leaves[place];
                let mut touched = lanes.touch(&leaf.coordinates, &line) & lanes.others(&leaf.numbers, skip);
                while touched != 0 {
                    let lane = touched.trailing_zeros() as usize;
                    touched &= touched - 1;
                    reach = meet(leaf.numbers[lane], leaf.corners[lane]);
                }
            } else {
                let node = &self.nodes[child.0 as usize];
                let (entries, mut met) = lanes.enter(&node.bounds, &ray, reach);
                if met != 0 {
                    // the nearest is next, the others wait; the selection has no branch, which would be mispredicted half of the time
                    let first = met.trailing_zeros() as usize;
                    met &= met - 1;
                    let mut next = (node.children[first], entries[first]);
                    while met != 0 {
                        let lane = met.trailing_zeros() as usize;
                        met &= met - 1;
                        let other = (node.children[lane], entries[lane]);
                        let nearer = other.1 < next.1;
                        waiting[count] = if nearer { next } else { other };
                        next = if nearer { other } else { next };
                        count += 1;
                    }
                    child = next.0;
                    continue;
                }
            }
            loop {
                if count == 0 {
                    return;
                }
                count -= 1;
                let (next, entered) = waiting[count];
                if entered <= reach {
                    child = next;
                    break;
                }
            }
        }
    }

    /// Calls `meet` with the index of every triangle of every leaf whose box touches `around`.
    pub fn around(&self, around: &Aabb, mut meet: impl FnMut(u32)) {
        let mut waiting = vec![Child(0)];
        while let Some(child) = waiting.pop() {
            if let Some(place) = child.leaf() {
                self.leaves[place].numbers.into_iter().filter(|number| *number != NONE).for_each(&mut meet);
                continue;
            }
            let node = &self.nodes[child.0 as usize];
            let mut touches = [true; WIDTH];
            for axis in 0..3 {
                let (low, high) = (&node.bounds[axis], &node.bounds[axis + 3]);
                for lane in 0..WIDTH {
                    touches[lane] &= (low[lane] <= around.max[axis]) & (high[lane] >= around.min[axis]);
                }
            }
            waiting.extend((0..WIDTH).filter(|lane| touches[*lane]).map(|lane| node.children[lane]));
        }
    }

    /// Returns the indices of the triangles of each leaf.
    pub fn leaves(&self) -> impl IndexedParallelIterator<Item = Vec<u32>> {
        self.leaves.par_iter().map(|leaf| leaf.numbers.into_iter().filter(|number| *number != NONE).collect())
    }
}

impl Node {
    const EMPTY: Self = Self { bounds: NO_BOXES, children: [Child(0); WIDTH] };
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::triangle::ShearedRay;

    /// Checks that every triangle is in one leaf, that every leaf and every node but the first is the child of one node, and that nodes are
    /// full if there is enough to fill them.
    #[test]
    fn every_triangle_is_in_one_leaf() {
        for count in [1, 2, 7, 9, 300, 2000] {
            let corner = |number: u32| {
                let turn = (number / 3) as f32;
                Vec3A::new(turn.sin(), turn.cos(), 0.01 * turn) + 0.02 * Vec3A::AXES[number as usize % 3]
            };
            let positions: Vec<Vec3A> = (0..3 * count).map(corner).collect();
            let triangles: Vec<[u32; 3]> = (0..count).map(|number| [0, 1, 2].map(|which| 3 * number + which)).collect();
            let boxes: Vec<Aabb> = positions.chunks(3).map(Aabb::from_points).collect();
            let tree = WideTree::new(&boxes, &triangles, &positions);
            let mut numbers: Vec<u32> = tree.leaves.iter().flat_map(|leaf| leaf.numbers).collect();
            numbers.retain(|number| *number != NONE);
            numbers.sort_unstable();
            assert_eq!(numbers, (0..count).collect::<Vec<_>>());
            let lanes = tree.nodes.iter().flat_map(|node| (0..WIDTH).map(move |lane| (node, lane)));
            let children = lanes.filter(|(node, lane)| node.bounds[0][*lane] <= node.bounds[3][*lane]);
            let mut children: Vec<u32> = children.map(|(node, lane)| node.children[lane].0).collect();
            children.sort_unstable();
            let leaves = (0..tree.leaves.len() as u32).map(|place| place | Child::LEAF);
            assert_eq!(children, (1..tree.nodes.len() as u32).chain(leaves).collect::<Vec<_>>());
            let full = children.len() as f64 / (WIDTH * tree.nodes.len()) as f64;
            assert!(count < 300 || full > 5.5 / 8.0, "{count}: {full}");
        }
    }

    /// Checks that a line through nested triangles meets each one once, except the skipped one, in trees within the fixed stack depth and
    /// in deeper ones.
    #[test]
    fn every_triangle_on_a_line_is_shown() {
        for (count, is_deep) in [(5, false), (40, false), (3000, true)] {
            let corner = |number: u32| {
                let turn = (number % 3) as f32 * 2.0 * std::f32::consts::FRAC_PI_3;
                0.5 * 0.995f32.powi(number as i32 / 3) * Vec3A::new(turn.cos(), turn.sin(), 1.0)
            };
            let positions: Vec<Vec3A> = (0..3 * count).map(corner).collect();
            let triangles: Vec<[u32; 3]> = (0..count).map(|number| [0, 1, 2].map(|which| 3 * number + which)).collect();
            let boxes: Vec<Aabb> = positions.chunks(3).map(Aabb::from_points).collect();
            let tree = WideTree::new(&boxes, &triangles, &positions);
            assert_eq!(tree.most_waiting > WAITING, is_deep, "{}", tree.most_waiting);
            let (from, along) = (DVec3::new(1e-9, 2e-9, -0.4), DVec3::Z);
            let ray = BoxRay::new(from.as_vec3a(), along.as_vec3a());
            let line = TriangleRay::new(from.as_vec3a(), &ShearedRay::new(from, along));
            let mut shown = Vec::new();
            tree.follow(pulp::Scalar, (&ray, &line), 3, f32::INFINITY, |number, corners| {
                assert_eq!(corners, triangles[number as usize]);
                shown.push(number);
                f32::INFINITY
            });
            shown.sort_unstable();
            assert_eq!(shown, (0..count).filter(|number| *number != 3).collect::<Vec<_>>());
        }
    }
}
