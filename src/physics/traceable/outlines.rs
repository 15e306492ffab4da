//! Shadows on a horizontal plane as stretches of its lines, of several obstacles side by side.
//!
//! The shadow of an upright block by light from one point is convex: what is beyond the block's sides, twice two half-planes,
//! within the two that touch its corners as the light sees them. On a line of the plane from west to east it is one stretch,
//! between the easternmost of its western bounds and the westernmost of its eastern ones.

use glam::DVec3;
use pulp::Simd;

use super::block::{Block, ON_TARGET};
use crate::geometry::numbers::Numbers;

/// Obstacles that are looked at side by side.
pub const LANES: usize = 8;

/// A number for each of some obstacles.
pub type Each = [f64; LANES];

/// Sine of the angle below which a side lies from west to east.
const LEVEL: f64 = 1e-12;

/// Number of no obstacle.
const NONE: f64 = -1.0;

/// Obstacles made ready for questions about their shadows.
#[derive(Clone, Debug)]
pub struct Casters {
    groups: Vec<Group>,
    vectors: pulp::Arch,
}

/// Some upright blocks; those that there are not have no height.
#[derive(Clone, Copy, Debug, Default)]
struct Group {
    centre: [Each; 2],
    half: [Each; 2],
    along: [Each; 2],
    /// One over the components to the east of the normals of both sides, and 0 for sides that lie from west to east.
    per_east: [Each; 2],
    low: Each,
    high: Each,
    /// 1 for bounds of what throws the shadow, else 0.
    bound: Each,
    /// Number of the convex obstacle that it is, or [`NONE`].
    convex: Each,
}

/// Half-planes of a shadow that may bound it on one side: one of each pair of sides, and those through two corners.
const EDGES: usize = 4;

/// Shadows of some obstacles on a plane. A bound is at `offset + slope dy` on the line at `dy`; offsets are infinite where there is
/// none. All distances are in m from where the light comes from.
#[derive(Clone, Copy, Debug)]
pub struct Outlines {
    south: Each,
    north: Each,
    /// Offsets and slopes.
    western: [[Each; 2]; EDGES],
    eastern: [[Each; 2]; EDGES],
    /// 1 for bounds of what throws the shadow, else 0.
    pub bound: Each,
}

impl Outlines {
    const EMPTY: Self = Self {
        south: [0.0; LANES],
        north: [0.0; LANES],
        western: [[[0.0; LANES]; 2]; EDGES],
        eastern: [[[0.0; LANES]; 2]; EDGES],
        bound: [0.0; LANES],
    };

    /// Number of vectors that the shadows fill.
    #[inline(always)]
    pub fn vectors<S: Simd>(_: S) -> usize {
        LANES / S::F64_LANES
    }

    /// Distances to the north between which the shadows of the `j`-th vector lie.
    #[inline(always)]
    pub fn reach<S: Simd>(&self, simd: S, j: usize) -> [f64; 2] {
        let (south, north) = (Numbers::of(simd, &self.south, j), Numbers::of(simd, &self.north, j));
        [-(-south).largest(), north.largest()]
    }

    /// Where each shadow of the `j`-th vector lies on the line `dy` to the north: the places in 0..=`length` of the first sensor in it
    /// and of the first one beyond, no less, of sensors `per_m` to the metre from `west` on to the east.
    #[inline(always)]
    pub fn on_line<S: Simd>(&self, (simd, j): (S, usize), dy: f64, [west, per_m, length]: [f64; 3]) -> [Numbers<S>; 2] {
        let number = |number: f64| Numbers::all(simd, number);
        let dy = number(dy);
        let at = |edge: &[Each; 2]| Numbers::of(simd, &edge[0], j) + Numbers::of(simd, &edge[1], j) * dy;
        let [a, b, c, d] = &self.western;
        let from = at(a).larger(at(b)).larger(at(c).larger(at(d)));
        let [a, b, c, d] = &self.eastern;
        let to = at(a).less(at(b)).less(at(c).less(at(d)));
        let place = |east: Numbers<S>| ((east - number(west)) * number(per_m) + number(0.5)).rounded();
        let first = place(from).larger(number(0.0)).less(number(length));
        // beside the shadow nothing is in it
        let south = Numbers::of(simd, &self.south, j).is_below(dy);
        let met = south.and(dy.is_below(Numbers::of(simd, &self.north, j)));
        [first, met.pick(place(to).less(number(length)), number(0.0)).larger(first)]
    }

    /// The same, each no more than the bounds of a shadow.
    #[cfg(test)]
    pub fn as_bounds(self) -> Self {
        Self { bound: [1.0; LANES], ..self }
    }
}

impl Casters {
    pub(super) fn new<'a>(blocks: impl Iterator<Item = &'a Block>) -> Self {
        let mut blocks: Vec<&Block> = blocks.collect();
        // those that are looked at together throw their shadows on the same lines, as far as may be
        blocks.sort_by(|a, b| a.centre.y.total_cmp(&b.centre.y));
        let group = |blocks: &[&Block]| {
            let mut group = Group::default();
            for (lane, block) in blocks.iter().enumerate() {
                for axis in 0..2 {
                    group.centre[axis][lane] = block.centre[axis];
                    group.half[axis][lane] = block.half[axis];
                    group.along[axis][lane] = block.along[axis];
                    let east = [block.along.x, -block.along.y][axis];
                    group.per_east[axis][lane] = if east.abs() < LEVEL { 0.0 } else { 1.0 / east };
                }
                (group.low[lane], group.high[lane]) = (block.low, block.high);
                group.bound[lane] = if block.is_bound() { 1.0 } else { 0.0 };
                group.convex[lane] = block.of_box.map_or(NONE, |number| number as f64);
            }
            group
        };
        Self { groups: blocks.chunks(LANES).map(group).collect(), vectors: pulp::Arch::new() }
    }

    /// The outlines of the shadows that light from `position` throws on the plane at `height` below it; the convex obstacle
    /// `but_for` throws none.
    pub fn outlines(&self, position: DVec3, height: f64, but_for: Option<usize>, outlines: &mut Vec<Outlines>) {
        // all of each is written
        outlines.resize(self.groups.len(), Outlines::EMPTY);
        // a number that no obstacle has
        let but_for = but_for.map_or(2.0 * NONE, |number| number as f64);
        self.vectors.dispatch(OfAll { groups: &self.groups, position, depth: position.z - height, but_for, outlines });
    }
}

/// Asks for the outlines of all groups.
struct OfAll<'a> {
    groups: &'a [Group],
    position: DVec3,
    depth: f64,
    but_for: f64,
    outlines: &'a mut [Outlines],
}

impl pulp::WithSimd for OfAll<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { groups, position, depth, but_for, outlines } = self;
        for (group, outlines) in groups.iter().zip(outlines) {
            for j in 0..LANES / S::F64_LANES {
                group.outline(simd, j, [position.x, position.y, position.z, depth, but_for], outlines);
            }
        }
    }
}

impl Group {
    /// Several shadows at once: every step without branches.
    #[inline(always)]
    fn outline<S: Simd>(&self, simd: S, j: usize, [x, y, z, depth, but_for]: [f64; 5], outlines: &mut Outlines) {
        let number = |number: f64| Numbers::all(simd, number);
        let each = |each: &Each| Numbers::of(simd, each, j);
        let (zero, one, infinity) = (number(0.0), number(1.0), number(f64::INFINITY));
        let (half, along) = ([each(&self.half[0]), each(&self.half[1])], [each(&self.along[0]), each(&self.along[1])]);
        // what a bound is drawn around may be flat
        let hair = each(&self.bound) * (number(depth) + (half[0] + half[1])) * number(ON_TARGET);
        let half = [half[0] + hair, half[1] + hair];
        // over which shares of its way the light is at the block's heights
        let share = |height: Numbers<S>| {
            let share = (number(z) - height) * number(1.0 / depth);
            share.larger(zero).less(number(1.0 - ON_TARGET))
        };
        let (enters, leaves) = (share(each(&self.high) + hair), share(each(&self.low) - hair));
        let (per_entry, per_exit) = (one / enters, one / leaves);
        // the light in the frame of the block
        let (dx, dy) = (number(x) - each(&self.centre[0]), number(y) - each(&self.centre[1]));
        let start = [dx * along[0] + dy * along[1], along[0] * dy - along[1] * dx];
        // the farther away the nearer the light passes
        let from = |low: Numbers<S>| low * low.is_below(zero).pick(per_entry, per_exit);
        let to = |high: Numbers<S>| high * zero.is_below(high).pick(per_entry, per_exit);
        let wide = (along[1].abs() * half[0] + along[0].abs() * half[1]) * number(1.0 + ON_TARGET);
        let wide = wide + number(ON_TARGET * depth);
        let (mut south, mut north) = (from(-dy - wide), to(wide - dy));
        for (axis, y) in [(0, along[1]), (1, along[0])] {
            let (low, high) = (from(-half[axis] - start[axis]), to(half[axis] - start[axis]));
            let per_east = each(&self.per_east[axis]);
            let (a, b) = (low * per_east, high * per_east);
            let (eastward, westward) = (zero.is_below(per_east), per_east.is_below(zero));
            let (west, east) =
                (eastward.pick(a, westward.pick(b, -infinity)), eastward.pick(b, westward.pick(a, infinity)));
            west.store(&mut outlines.western[axis][0], j);
            east.store(&mut outlines.eastern[axis][0], j);
            let slope = -y * per_east;
            slope.store(&mut outlines.western[axis][1], j);
            slope.store(&mut outlines.eastern[axis][1], j);
            // sides that lie from west to east
            let (below, above) = (zero.is_below(y).pick(low, -high), zero.is_below(y).pick(high, -low));
            let below = eastward.pick(-infinity, westward.pick(-infinity, below));
            let above = eastward.pick(infinity, westward.pick(infinity, above));
            (south, north) = (south.larger(below), north.less(above));
        }
        // the corners that the light sees at the block's edges, counter-clockwise behind it
        let side = |axis: usize| {
            let below = start[axis].is_below(-half[axis]).pick(-one, zero);
            half[axis].is_below(start[axis]).pick(one, below)
        };
        let (rx, ry) = (side(0), side(1));
        let or = |sign: Numbers<S>, other: Numbers<S>| zero.is_below(sign.abs()).pick(sign, other);
        let corner = |x: Numbers<S>, y: Numbers<S>| [half[0] * x - start[0], half[1] * y - start[1]];
        let (first, last) = (corner(or(ry, rx), or(-rx, ry)), corner(or(-ry, rx), or(rx, ry)));
        let is_beside = rx.abs() + ry.abs();
        // normals of what is beyond them, in the frame of the block; none where the light is above it
        for (edge, [u, v]) in [(2, [-first[1], first[0]]), (3, [last[1], -last[0]])] {
            let (x, y) = ((u * along[0] - v * along[1]) * is_beside, u * along[1] + v * along[0]);
            let (westward, eastward) = (x.is_below(zero), zero.is_below(x));
            westward.pick(zero, -infinity).store(&mut outlines.western[edge][0], j);
            eastward.pick(zero, infinity).store(&mut outlines.eastern[edge][0], j);
            let slope = -y * is_beside / x;
            let slope = westward.pick(slope, eastward.pick(slope, zero));
            slope.store(&mut outlines.western[edge][1], j);
            slope.store(&mut outlines.eastern[edge][1], j);
        }
        let other = (each(&self.convex) - number(but_for)).abs();
        let south = zero.is_below(other).pick(south, infinity);
        let south = enters.is_below(leaves).pick(south, infinity);
        south.store(&mut outlines.south, j);
        enters.is_below(leaves).pick(north, -infinity).store(&mut outlines.north, j);
        each(&self.bound).store(&mut outlines.bound, j);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use pulp::WithSimd;

    use super::*;
    use crate::sampling::{Key, PathRandom};

    /// Sensors of a line that are in a shadow: of which obstacle, and the first place in it and the first beyond, in bits.
    type Stretch = (usize, [u64; 2]);

    /// Asks for the outlines of some casters, and for where they lie on lines.
    struct Asked<'a>(&'a Casters, DVec3, Option<usize>);

    impl WithSimd for Asked<'_> {
        type Output = (Vec<u64>, Vec<Stretch>);

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let Self(casters, position, but_for) = self;
            let (groups, depth) = (&casters.groups, position.z - 0.2);
            let but_for = but_for.map_or(2.0 * NONE, |number| number as f64);
            let mut outlines = vec![Outlines::EMPTY; groups.len()];
            OfAll { groups, position, depth, but_for, outlines: &mut outlines }.with_simd(simd);
            let (mut numbers, mut stretches) = (Vec::new(), Vec::new());
            for (group, outlines) in outlines.iter().enumerate() {
                let edges = outlines.western.iter().chain(&outlines.eastern).flatten();
                let all = edges.chain([&outlines.south, &outlines.north, &outlines.bound]).flatten();
                numbers.extend(all.map(|number| number.to_bits()));
                for line in 0..24 {
                    let dy = 0.137 * f64::from(line) - position.y;
                    let mut of_line = Vec::new();
                    for j in 0..Outlines::vectors(simd) {
                        let [firsts, ends] = outlines.on_line((simd, j), dy, [0.05 - position.x, 10.0, 30.0]);
                        let mut places = [[0.0; LANES]; 2];
                        firsts.store(&mut places[0], j);
                        ends.store(&mut places[1], j);
                        for lane in j * S::F64_LANES..(j + 1) * S::F64_LANES {
                            let ends = places.map(|places| places[lane]);
                            if ends[0] < ends[1] {
                                of_line.push((LANES * group + lane, ends.map(f64::to_bits)));
                            }
                        }
                    }
                    stretches.extend(of_line);
                }
            }
            (numbers, stretches)
        }
    }

    /// Vectors of one number, of two, four and eight, and the widest of this machine: the same bits, for blocks that stand, hang
    /// and lie in each other, turned and not, seen from beside, above and within.
    #[test]
    fn bits_do_not_depend_on_the_width_of_vectors() {
        let mut random = PathRandom::new(Key::new(21));
        let mut met = 0;
        for round in 0..300 {
            let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
            let block = |number: usize, uniform: &mut dyn FnMut(f64, f64) -> f64| {
                let turn = [0.0, std::f64::consts::FRAC_PI_2, uniform(0.0, 7.0)][number % 3];
                let low = if number.is_multiple_of(4) { 0.0 } else { uniform(0.0, 0.6) };
                Block {
                    centre: DVec2::new(uniform(0.2, 2.8), uniform(0.2, 2.8)),
                    half: DVec2::new(uniform(0.01, 0.6), if number % 5 == 4 { 0.0 } else { uniform(0.01, 0.6) }),
                    along: DVec2::new(turn.cos(), turn.sin()),
                    low,
                    high: low + uniform(0.01, 1.2),
                    of_box: (number % 5 != 4).then_some(number),
                }
            };
            let blocks: Vec<Block> = (0..1 + round % 19).map(|number| block(number, &mut uniform)).collect();
            let casters = Casters::new(blocks.iter());
            // straight above the middle of a block in every third round
            let [x, y] =
                if round % 3 == 0 { blocks[0].centre.to_array() } else { [uniform(0.0, 3.0), uniform(0.0, 3.0)] };
            let asked = || {
                Asked(&casters, DVec3::new(x, y, 0.25 + 0.01 * f64::from(round as u32)), (round % 2 == 0).then_some(1))
            };
            let one = asked().with_simd(pulp::Scalar);
            assert_eq!(one, asked().with_simd(pulp::Scalar128b));
            assert_eq!(one, asked().with_simd(pulp::Scalar256b));
            assert_eq!(one, asked().with_simd(pulp::Scalar512b));
            assert_eq!(one, pulp::Arch::new().dispatch(asked()));
            met += one.1.len();
        }
        assert!(met > 10_000, "{met}");
    }
}
