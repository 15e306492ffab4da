//! Conversion of a binary tree of boxes into one with [`WIDTH`] children per node and up to as many triangles per leaf, such that the
//! expected number of nodes and leaves that a ray visits is least.
//!
//! The probability that a ray meets a box is proportional to its surface. The least expected cost of each subtree, as one child of a node
//! or as several, follows from those of its halves (Ylitie, Karras and Laine 2017).

use super::tree_ray::WIDTH;

/// Cost of a leaf relative to a node: specular chains in a bent pipe of 30 000 triangles are equally fast from 0.1 to 2.
const LEAF_COST: f32 = 0.6;

/// A node of a binary tree.
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    /// Half the surface of its box, in any unit.
    pub half_area: f32,
    /// Index of the first of its two children, which the other follows; for a leaf, position of its first triangle.
    pub first: u32,
    /// Number of triangles of a leaf, at most [`WIDTH`]; 0 for an inner node.
    pub triangles: u32,
}

/// Optimal conversion of each node of a binary tree.
pub struct Collapse {
    tree: Vec<BinaryNode>,
    nodes: Vec<Collapsed>,
}

#[derive(Clone, Copy)]
struct Collapsed {
    /// Least cost as at most 1, 2 ... `most` children of a wide node.
    costs: [f32; WIDTH - 1],
    /// Number of children that come from the first half when the node is split into 2, 3 ... `WIDTH` children; 0 if fewer children cost no
    /// more.
    firsts: [u8; WIDTH - 1],
    /// Largest number of children that the subtree can be split into.
    most: u8,
    /// Number of triangles if the subtree becomes a leaf; else 0.
    leaf: u8,
}

impl Collapsed {
    const NONE: Self = Self { costs: [0.0; WIDTH - 1], firsts: [0; WIDTH - 1], most: 1, leaf: 0 };
}

impl Collapse {
    /// Computes the conversion of a `tree`, the root first.
    pub fn new(tree: Vec<BinaryNode>) -> Self {
        let nodes = vec![Collapsed::NONE; tree.len()];
        let mut collapse = Self { tree, nodes };
        // children stand after their parents
        let mut order = vec![0];
        let mut next = 0;
        while let Some(index) = order.get(next).copied() {
            order.extend(collapse.halves(index).into_iter().flatten());
            next += 1;
        }
        for index in order.into_iter().rev() {
            collapse.nodes[index] = collapse.judged(index);
        }
        collapse
    }

    fn halves(&self, index: usize) -> Option<[usize; 2]> {
        let node = &self.tree[index];
        (node.triangles == 0).then_some([node.first as usize, node.first as usize + 1])
    }

    /// Computes the conversion of a node whose halves have been converted.
    fn judged(&self, index: usize) -> Collapsed {
        let BinaryNode { half_area: area, triangles, .. } = self.tree[index];
        let Some([left, right]) = self.halves(index).map(|halves| halves.map(|half| self.nodes[half])) else {
            let mut leaf = Collapsed { leaf: triangles as u8, ..Collapsed::NONE };
            leaf.costs[0] = LEAF_COST * area;
            return leaf;
        };
        // as several children: the best number of them from the first half
        let most = usize::from(left.most + right.most).min(WIDTH);
        let mut firsts = [0; WIDTH - 1];
        let mut parted = [f32::INFINITY; WIDTH - 1];
        for children in 2..=most {
            let (first, least) = (&mut firsts[children - 2], &mut parted[children - 2]);
            let fewest = children.saturating_sub(right.most.into()).max(1);
            for of_left in fewest..=(children - 1).min(left.most.into()) {
                let cost = left.costs[of_left - 1] + right.costs[children - of_left - 1];
                if cost < *least {
                    (*first, *least) = (of_left as u8, cost);
                }
            }
        }
        // as one child
        let as_node = area + parted[most - 2];
        let triangles = left.leaf + right.leaf;
        let may_be_leaf = left.leaf > 0 && right.leaf > 0 && usize::from(triangles) <= WIDTH;
        let as_leaf = if may_be_leaf { LEAF_COST * area } else { f32::INFINITY };
        let mut costs = [0.0; WIDTH - 1];
        costs[0] = as_node.min(as_leaf);
        for more in 1..most.min(WIDTH - 1) {
            costs[more] = costs[more - 1].min(parted[more - 1]);
            if costs[more] == costs[more - 1] {
                firsts[more - 1] = 0;
            }
        }
        let leaf = if as_leaf <= as_node { triangles } else { 0 };
        Collapsed { costs, firsts, most: most as u8, leaf }
    }

    /// True if a node of the binary tree becomes a leaf.
    pub fn is_leaf(&self, index: usize) -> bool {
        self.nodes[index].leaf > 0
    }

    /// Returns the nodes of the binary tree that become the children of a wide node.
    pub fn children(&self, index: usize) -> Vec<usize> {
        if self.is_leaf(index) {
            return vec![index];
        }
        let mut children = Vec::with_capacity(WIDTH);
        let mut left = vec![(index, WIDTH)];
        while let Some((index, mut count)) = left.pop() {
            let firsts = &self.nodes[index].firsts;
            while count > 1 && firsts[count - 2] == 0 {
                count -= 1;
            }
            match self.halves(index) {
                Some([first, second]) if count > 1 => {
                    let of_first = usize::from(firsts[count - 2]);
                    left.extend([(first, of_first), (second, count - of_first)]);
                }
                _ => children.push(index),
            }
        }
        children
    }

    /// Returns the positions of all triangles below a node.
    pub fn triangles(&self, index: usize) -> impl Iterator<Item = u32> {
        let mut left = vec![index];
        let mut leaves = Vec::with_capacity(WIDTH);
        while let Some(index) = left.pop() {
            match self.halves(index) {
                Some(halves) => left.extend(halves),
                None => leaves.push(self.tree[index]),
            }
        }
        leaves.into_iter().flat_map(|BinaryNode { first, triangles, .. }| first..first + triangles)
    }
}
