//! How a binary tree of boxes becomes one of eight to a node, whose leaves have up to eight triangles: so that a ray is expected to
//! look at the fewest of both.
//!
//! A ray meets a box as often as its surface is large. The least expected cost of each subtree, as one child of a node or as
//! several, follows from those of its halves (Ylitie, Karras and Laine 2017, eq. 1 to 4).

use obvhs::bvh2::Bvh2;

use super::lanes::WIDTH;

/// Cost of a leaf in those of a node: of 0.3 to 1.5 the rays of specular chains are fastest at this (a bent pipe of 30 000 triangles).
const LEAF_COST: f32 = 0.6;

/// What becomes of each node of a binary tree.
pub struct Collapse<'a> {
    tree: &'a Bvh2,
    nodes: Vec<Collapsed>,
}

#[derive(Clone, Copy)]
struct Collapsed {
    /// Least cost as at most 1, 2 ... 7 children of a node.
    costs: [f32; WIDTH - 1],
    /// Number of those of 2, 3 ... 8 children that are of its first half; 0 where fewer children cost less.
    firsts: [u8; WIDTH - 1],
    /// Triangles of a leaf; 0 where it is none.
    leaf: u8,
}

impl<'a> Collapse<'a> {
    /// `tree`: at most eight triangles in each leaf.
    pub fn new(tree: &'a Bvh2) -> Self {
        let none = Collapsed { costs: [0.0; WIDTH - 1], firsts: [0; WIDTH - 1], leaf: 0 };
        let mut collapse = Self { tree, nodes: vec![none; tree.nodes.len()] };
        // halves stand after what they are halves of
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
        let node = &self.tree.nodes[index];
        let first = node.first_index as usize;
        (!node.is_leaf()).then_some([first, first + 1])
    }

    /// A node whose halves are known.
    fn judged(&self, index: usize) -> Collapsed {
        let area = self.tree.nodes[index].aabb().half_area();
        let Some([left, right]) = self.halves(index).map(|halves| halves.map(|half| self.nodes[half])) else {
            let triangles = self.tree.nodes[index].prim_count as u8;
            return Collapsed { costs: [LEAF_COST * area; WIDTH - 1], firsts: [0; WIDTH - 1], leaf: triangles };
        };
        // as several children, so many of them of the first half
        let mut firsts = [0; WIDTH - 1];
        let mut parted = [f32::INFINITY; WIDTH - 1];
        for (children, (first, least)) in (2..).zip(firsts.iter_mut().zip(&mut parted)) {
            for of_left in 1..children {
                let cost = left.costs[of_left - 1] + right.costs[children - of_left - 1];
                if cost < *least {
                    (*first, *least) = (of_left as u8, cost);
                }
            }
        }
        // as one child
        let as_node = area + parted[WIDTH - 2];
        let triangles = left.leaf + right.leaf;
        let may_be_leaf = left.leaf > 0 && right.leaf > 0 && usize::from(triangles) <= WIDTH;
        let as_leaf = if may_be_leaf { LEAF_COST * area } else { f32::INFINITY };
        let mut costs = [as_node.min(as_leaf); WIDTH - 1];
        for more in 1..WIDTH - 1 {
            costs[more] = costs[more - 1].min(parted[more - 1]);
            if costs[more] == costs[more - 1] {
                firsts[more - 1] = 0;
            }
        }
        Collapsed { costs, firsts, leaf: if as_leaf <= as_node { triangles } else { 0 } }
    }

    /// True if a node of the binary tree becomes a leaf.
    pub fn is_leaf(&self, index: usize) -> bool {
        self.nodes[index].leaf > 0
    }

    /// The nodes of the binary tree that become the children of one.
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

    /// Numbers of the triangles of a node.
    pub fn primitives(&self, index: usize) -> Vec<u32> {
        let mut primitives = Vec::with_capacity(WIDTH);
        let mut left = vec![index];
        while let Some(index) = left.pop() {
            match self.halves(index) {
                Some(halves) => left.extend(halves),
                None => {
                    let leaf = &self.tree.nodes[index];
                    let (first, count) = (leaf.first_index as usize, leaf.prim_count as usize);
                    primitives.extend_from_slice(&self.tree.primitive_indices[first..first + count]);
                }
            }
        }
        primitives
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;
    use obvhs::BvhBuildParams;
    use obvhs::aabb::Aabb;
    use obvhs::bvh2::builder::build_bvh2;

    use super::*;

    /// Every triangle is in one leaf, no leaf and no node has more than eight, and a node is full where there is enough to fill it.
    #[test]
    fn every_triangle_is_in_one_leaf() {
        for count in [1, 2, 7, 9, 300, 2000] {
            let place = |number: u32| {
                let angle = number as f32;
                Vec3A::new(angle.sin(), angle.cos(), 0.01 * angle)
            };
            let boxes: Vec<Aabb> =
                (0..count).map(|number| Aabb::new(place(number) - 0.01, place(number) + 0.02)).collect();
            let params = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::fast_build() };
            let tree = build_bvh2(&boxes, params, &mut Default::default());
            let collapse = Collapse::new(&tree);
            let (mut seen, mut nodes, mut children) = (vec![0; count as usize], 0, 0);
            let mut left = vec![0];
            while let Some(index) = left.pop() {
                let of_node = collapse.children(index);
                assert!((1..=WIDTH).contains(&of_node.len()));
                (nodes, children) = (nodes + 1, children + of_node.len());
                for child in of_node {
                    if !collapse.is_leaf(child) {
                        left.push(child);
                        continue;
                    }
                    let primitives = collapse.primitives(child);
                    assert!((1..=WIDTH).contains(&primitives.len()));
                    primitives.iter().for_each(|number| seen[*number as usize] += 1);
                }
            }
            assert!(seen.iter().all(|times| *times == 1), "{count}");
            assert!(count < 300 || children as f64 > 5.5 * f64::from(nodes), "{count}: {children} of {nodes}");
        }
    }
}
