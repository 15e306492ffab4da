//! A tree of boxes, eight to a node, over triangles in fours (built by obvhs, whose only user this is, collapsed here).
//!
//! The binary tree of obvhs is collapsed as Wald, Benthin and Boulos 2008 do: the child of largest area is opened until
//! a node has eight. Boxes are an f32 filter, taken eight at once; what they let through is tested in f64, four triangles at
//! once.

use glam::DVec3;
use obvhs::BvhBuildParams;
pub use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use smallvec::SmallVec;

use super::lanes::{Corners, FOUR, Lanes, TreeRay, WIDTH};

/// Nodes that wait while a ray is followed; deeper trees take memory for more.
const WAITING: usize = 48;

/// Boxes over triangles.
#[derive(Clone, Debug)]
pub struct WideTree {
    nodes: Vec<Node>,
    fours: Vec<Four>,
}

#[derive(Clone, Debug)]
#[repr(align(64))]
struct Node {
    /// Lower x, y, z of the children, then upper x, y, z; of no child at all where `lower > upper`.
    bounds: [[f32; WIDTH]; 6],
    children: [Child; WIDTH],
}

/// Place of a node, or of a leaf's first four triangles.
#[derive(Clone, Copy, Debug)]
struct Child(u32);

/// Up to four triangles of a leaf.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Four {
    /// Coordinates by corner and axis; not a number where there is no triangle.
    pub corners: Corners,
    /// Numbers that the triangles have in the list that the tree was built from; [`Four::NONE`] where there is none.
    pub numbers: [u32; FOUR],
    /// True if the leaf goes on with the next four.
    more: bool,
}

impl Child {
    const LEAF: u32 = 1 << 31;

    fn leaf(self) -> Option<usize> {
        (self.0 & Self::LEAF != 0).then_some((self.0 & !Self::LEAF) as usize)
    }
}

impl Four {
    /// Number where there is no triangle.
    pub const NONE: u32 = u32::MAX;

    fn new(numbers: &[u32], triangles: &[[DVec3; 3]], more: bool) -> Self {
        let mut four = Self { corners: [[[f64::NAN; FOUR]; 3]; 3], numbers: [Self::NONE; FOUR], more };
        for (lane, number) in numbers.iter().enumerate() {
            four.numbers[lane] = *number;
            for (rows, corner) in four.corners.iter_mut().zip(&triangles[*number as usize]) {
                (0..3).for_each(|axis| rows[axis][lane] = corner[axis]);
            }
        }
        four
    }

    /// The corners of the triangles, each with its number.
    pub fn triangles(&self) -> impl Iterator<Item = (u32, [DVec3; 3])> {
        let corner = |corner: usize, lane: usize| DVec3::from_array(self.corners[corner].map(|axis| axis[lane]));
        let triangle = move |lane: usize| (self.numbers[lane], [0, 1, 2].map(|which| corner(which, lane)));
        (0..FOUR).filter(|lane| self.numbers[*lane] != Self::NONE).map(triangle)
    }
}

impl WideTree {
    /// `boxes`: of the triangles, in the coordinates of the tree; `triangles`: at least one, at most 2^31.
    pub fn new(boxes: &[Aabb], triangles: &[[DVec3; 3]]) -> Self {
        let params = BvhBuildParams { max_prims_per_leaf: FOUR as u32, ..BvhBuildParams::medium_build() };
        let tree = build_bvh2(boxes, params, &mut Default::default());
        let mut wide = Self { nodes: Vec::new(), fours: Vec::new() };
        // a list of what is left to do: a tree may be deeper than the stack of a thread
        let mut left = vec![(0, None::<(usize, usize)>)];
        while let Some((binary, parent)) = left.pop() {
            let place = wide.nodes.len();
            if let Some((node, lane)) = parent {
                wide.nodes[node].children[lane] = Child(place as u32);
            }
            wide.nodes.push(Node::EMPTY);
            for (lane, index) in opened(&tree, binary).into_iter().enumerate() {
                let child = &tree.nodes[index];
                let bounds = child.aabb();
                for axis in 0..3 {
                    wide.nodes[place].bounds[axis][lane] = bounds.min[axis];
                    wide.nodes[place].bounds[axis + 3][lane] = bounds.max[axis];
                }
                if child.is_leaf() {
                    wide.nodes[place].children[lane] = Child(wide.fours.len() as u32 | Child::LEAF);
                    let (first, count) = (child.first_index as usize, child.prim_count as usize);
                    let mut numbers = tree.primitive_indices[first..first + count].chunks(FOUR).peekable();
                    while let Some(some) = numbers.next() {
                        wide.fours.push(Four::new(some, triangles, numbers.peek().is_some()));
                    }
                } else {
                    left.push((index, Some((place, lane))));
                }
            }
        }
        wide
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.fours.iter().flat_map(|four| four.numbers).filter(|number| *number != Four::NONE).count()
    }

    /// Shows the triangles of every leaf whose box a ray meets before a distance, nearer boxes first: `reach` at first, then what
    /// `meet` returns.
    #[inline(always)]
    pub fn follow<L: Lanes>(&self, lanes: L, ray: &TreeRay, mut reach: f32, mut meet: impl FnMut(&Four) -> f32) {
        let mut waiting = SmallVec::<[(Child, f32); WAITING]>::new();
        waiting.push((Child(0), 0.0));
        while let Some((mut child, entered)) = waiting.pop() {
            if entered > reach {
                continue;
            }
            loop {
                if let Some(mut place) = child.leaf() {
                    loop {
                        let four = &self.fours[place];
                        reach = meet(four);
                        if !four.more {
                            break;
                        }
                        place += 1;
                    }
                    break;
                }
                let node = &self.nodes[child.0 as usize];
                let (entries, mut met) = lanes.enter(&node.bounds, ray, reach);
                if met == 0 {
                    break;
                }
                // the nearest is next, the others wait, the farthest first
                let first = met.trailing_zeros() as usize;
                met &= met - 1;
                let mut next = (node.children[first], entries[first]);
                let before = waiting.len();
                while met != 0 {
                    let lane = met.trailing_zeros() as usize;
                    met &= met - 1;
                    let mut other = (node.children[lane], entries[lane]);
                    if other.1 < next.1 {
                        std::mem::swap(&mut other, &mut next);
                    }
                    let mut place = waiting.len();
                    waiting.push(other);
                    while place > before && waiting[place - 1].1 < other.1 {
                        waiting[place] = waiting[place - 1];
                        place -= 1;
                    }
                    waiting[place] = other;
                }
                child = next.0;
            }
        }
    }

    /// Shows the triangles of every leaf whose box touches `around`.
    pub fn around(&self, around: &Aabb, mut meet: impl FnMut(&Four)) {
        let mut waiting = vec![Child(0)];
        while let Some(child) = waiting.pop() {
            let Some(mut place) = child.leaf() else {
                let node = &self.nodes[child.0 as usize];
                let touches = |lane: usize| {
                    (0..3).all(|axis| {
                        node.bounds[axis][lane] <= around.max[axis] && node.bounds[axis + 3][lane] >= around.min[axis]
                    })
                };
                waiting.extend((0..WIDTH).filter(|lane| touches(*lane)).map(|lane| node.children[lane]));
                continue;
            };
            loop {
                let four = &self.fours[place];
                meet(four);
                if !four.more {
                    break;
                }
                place += 1;
            }
        }
    }
}

impl Node {
    const EMPTY: Self = {
        let (lower, upper) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self { bounds: [lower, lower, lower, upper, upper, upper], children: [Child(0); WIDTH] }
    };
}

/// The nodes of a binary tree that become the children of one.
fn opened(tree: &Bvh2, index: usize) -> Vec<usize> {
    let children = |index: usize| {
        let first = tree.nodes[index].first_index as usize;
        [first, first + 1]
    };
    if tree.nodes[index].is_leaf() {
        return vec![index];
    }
    let mut open = children(index).to_vec();
    while open.len() < WIDTH {
        let area = |index: usize| tree.nodes[index].aabb().half_area();
        let inner = (0..open.len()).filter(|place| !tree.nodes[open[*place]].is_leaf());
        let Some(largest) = inner.max_by(|a, b| area(open[*a]).total_cmp(&area(open[*b]))) else { break };
        let [left, right] = children(open[largest]);
        open[largest] = left;
        open.push(right);
    }
    open
}
