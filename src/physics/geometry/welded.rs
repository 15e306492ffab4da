//! Merging of equal corners of triangles, and the sides that meet at an edge.

use std::collections::HashMap;

use glam::DVec3;

/// Returns a number for each position, the same for equal positions, from 0 in the order in which they first appear.
///
/// ```
/// use glam::DVec3;
/// use skyduct_physics::geometry::welded::places;
///
/// // -0 and 0 are one place
/// assert_eq!(places(&[DVec3::X, DVec3::ZERO, DVec3::X, -DVec3::ZERO]), [0, 1, 0, 1]);
/// ```
pub fn places(positions: &[DVec3]) -> Vec<u32> {
    let mut known: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len());
    let mut place = |position: &DVec3| {
        let next = known.len() as u32;
        *known.entry((*position + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next)
    };
    positions.iter().map(&mut place).collect()
}

/// One side of a triangle, with places as given by [`places`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TriangleSide {
    /// Places of the ends, the lesser first, which identify the edge.
    pub edge: [u32; 2],
    /// Number of the triangle.
    pub triangle: u32,
    /// Number of the side in the triangle: from corner `side` to the next.
    pub side: u8,
    /// True if the triangle's winding runs along the side from the lesser place to the greater.
    pub forward: bool,
}

/// Returns the sides of triangles, each given by its number and the places of its corners, sorted such that all sides at an edge are
/// adjacent (`chunk_by` the edge).
pub fn sides(triangles: impl Iterator<Item = (u32, [u32; 3])> + Clone) -> Vec<TriangleSide> {
    let of_triangle = |(triangle, corners): (u32, [u32; 3])| {
        [0_u8, 1, 2].map(|side| {
            let (a, b) = (corners[usize::from(side)], corners[usize::from(side + 1) % 3]);
            TriangleSide { edge: [a.min(b), a.max(b)], triangle, side, forward: a < b }
        })
    };
    // counting sort by the lesser place, at which few sides begin, then by the rest of the key
    let lesser = |[a, b, c]: [u32; 3]| [a.min(b), b.min(c), c.min(a)].map(|place| place as usize);
    let mut ends = Vec::new();
    for place in triangles.clone().flat_map(|(_, corners)| lesser(corners)) {
        ends.resize(ends.len().max(place + 1), 0_u32);
        ends[place] += 1;
    }
    let mut count = 0;
    for end in &mut ends {
        (*end, count) = (count, count + *end);
    }
    let none = TriangleSide { edge: [0; 2], triangle: 0, side: 0, forward: false };
    let mut sides = vec![none; count as usize];
    for side in triangles.flat_map(of_triangle) {
        let end = &mut ends[side.edge[0] as usize];
        sides[*end as usize] = side;
        *end += 1;
    }
    let mut start = 0;
    for end in ends {
        sides[start..end as usize].sort_unstable_by_key(|side| (side.edge[1], side.triangle, side.side));
        start = end as usize;
    }
    sides
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that two triangles of one winding run along their common edge in opposite senses.
    #[test]
    fn sides_of_an_edge_stand_together() {
        let sides = sides([(7, [0, 1, 2]), (9, [2, 1, 3])].into_iter());
        let pairs: Vec<_> = sides.chunk_by(|a, b| a.edge == b.edge).filter(|edge| edge.len() == 2).collect();
        let common = [
            TriangleSide { edge: [1, 2], triangle: 7, side: 1, forward: true },
            TriangleSide { edge: [1, 2], triangle: 9, side: 0, forward: false },
        ];
        assert_eq!(pairs, [common]);
        assert_eq!(sides.len(), 6);
        assert_eq!(super::sides(std::iter::empty()), []);
    }

    /// Checks that sides are sorted by their edges, then by triangles, whatever the order of the triangles and the places.
    #[test]
    fn sides_are_in_order() {
        let corner = |number: u32, which: u32| (number * 7919 + which * 104_729) % 61;
        let triangles = (0..400).rev().map(|number| (number, [0, 1, 2].map(|which| corner(number, which))));
        let sides = sides(triangles);
        assert_eq!(sides.len(), 1200);
        assert!(sides.windows(2).all(|pair| {
            let [a, b] = [&pair[0], &pair[1]].map(|side| (side.edge, side.triangle, side.side));
            a < b
        }));
    }
}
