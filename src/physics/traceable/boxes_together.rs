//! The boxes of a room, met by several rays at once.

use glam::DVec3;
use pulp::Simd;

use super::box_object::TraceableBox;
use crate::geometry::numbers::Numbers;

/// Rays that are looked at at once.
pub const TOGETHER: usize = 8;

/// One number for each of them.
pub type Each = [f64; TOGETHER];

/// Number of no box.
pub const NO_BOX: f64 = -1.0;

/// Boxes that have their bits in one word.
pub const IN_A_WORD: usize = 64;

/// Below this size a component of a direction is taken as this: products with its inverse stay finite.
const LEAST_COMPONENT: f64 = 1e-290;

/// All boxes of a room, in an order of their own: those with one rotation follow each other.
#[derive(Clone, Debug)]
pub struct BoxesTogether {
    turned: Vec<Turned>,
    vectors: pulp::Arch,
}

impl Default for BoxesTogether {
    fn default() -> Self {
        Self { turned: Vec::new(), vectors: pulp::Arch::new() }
    }
}

/// Boxes that are turned alike.
#[derive(Clone, Debug)]
struct Turned {
    /// Rows of the rotation from the room's frame to theirs.
    rows: [[f64; 2]; 2],
    boxes: Vec<Planes>,
    /// The same by coordinates, several boxes in each: low and high.
    by_side: Vec<[[Each; 3]; 2]>,
}

/// A box between three pairs of planes, in the turned frame around the room's origin.
#[derive(Clone, Copy, Debug)]
struct Planes {
    low: [f64; 3],
    high: [f64; 3],
    number: f64,
}

/// Several rays by coordinates.
#[derive(Clone, Copy, Debug)]
pub struct RaysBySide {
    pub origin: [Each; 3],
    /// Of any length.
    pub direction: [Each; 3],
    /// Number of the box that each leaves, which it does not meet; or [`NO_BOX`].
    pub own: Each,
    /// In lengths of the direction: what is met there or farther does not count.
    pub within: Each,
}

/// Rays in vectors.
#[derive(Clone, Copy)]
pub struct RaysInVectors<S: Simd> {
    pub origin: [Numbers<S>; 3],
    pub direction: [Numbers<S>; 3],
    /// One over the components of the direction, by [`inverse`].
    pub inverse: [Numbers<S>; 3],
    pub own: Numbers<S>,
}

/// What each ray meets first.
#[derive(Clone, Copy)]
pub struct FirstMet<S: Simd> {
    /// In lengths of the direction.
    pub distance: Numbers<S>,
    /// The box by its number, or [`NO_BOX`].
    pub number: Numbers<S>,
    /// Its face, 0 to 5.
    pub face: Numbers<S>,
}

/// One over a component of a direction, finite.
#[inline(always)]
pub fn inverse<S: Simd>(simd: S, component: Numbers<S>) -> Numbers<S> {
    let least = Numbers::all(simd, LEAST_COMPONENT);
    Numbers::all(simd, 1.0) / component.abs().is_below(least).pick(least, component)
}

impl BoxesTogether {
    /// The boxes of a room by their numbers.
    pub fn new(boxes: &[TraceableBox]) -> Self {
        let mut turned: Vec<Turned> = Vec::new();
        for (number, object) in boxes.iter().enumerate() {
            let (rows, [low, high]) = object.in_turned_frame();
            let planes = Planes { low: low.to_array(), high: high.to_array(), number: number as f64 };
            match turned.iter_mut().find(|turned| turned.rows == rows && turned.boxes.len() < IN_A_WORD) {
                Some(turned) => turned.boxes.push(planes),
                None => turned.push(Turned { rows, boxes: vec![planes], by_side: Vec::new() }),
            }
        }
        for Turned { boxes, by_side, .. } in &mut turned {
            *by_side = boxes.chunks(TOGETHER).map(by_coordinates).collect();
        }
        Self { turned, vectors: pulp::Arch::new() }
    }

    /// By which vectors it computes.
    pub fn vectors(&self) -> pulp::Arch {
        self.vectors
    }

    /// Number of words with a bit for each box.
    pub fn words(&self) -> usize {
        self.turned.len()
    }

    /// The box that each ray enters first, by its number, or [`NO_BOX`]. Where a ray passes an edge within rounding, it may be another
    /// one than a ray alone meets, or none.
    pub fn first_met(&self, rays: &RaysBySide) -> Each {
        let mut met = [NO_BOX; TOGETHER];
        if !self.turned.is_empty() {
            self.vectors.dispatch(Ask { boxes: self, rays, met: &mut met });
        }
        met
    }

    /// The box that each ray enters first before `within`; only boxes are looked at whose bits are set in the words.
    #[inline(always)]
    pub fn meet<S: Simd>(
        &self,
        simd: S,
        rays: &RaysInVectors<S>,
        within: Numbers<S>,
        words: impl Iterator<Item = u64>,
    ) -> FirstMet<S> {
        let number = |number: f64| Numbers::all(simd, number);
        let zero = number(0.0);
        let mut first = FirstMet { distance: within, number: number(NO_BOX), face: zero };
        for (Turned { rows, boxes, .. }, word) in self.turned.iter().zip(words) {
            if word == 0 {
                continue;
            }
            let turn = |v: &[Numbers<S>; 3], row: usize| number(rows[row][0]) * v[0] + number(rows[row][1]) * v[1];
            let is_turned = rows[0] != [1.0, 0.0];
            let direction = match is_turned {
                true => [turn(&rays.direction, 0), turn(&rays.direction, 1), rays.direction[2]],
                false => rays.direction,
            };
            let inverse = match is_turned {
                true => [inverse(simd, direction[0]), inverse(simd, direction[1]), rays.inverse[2]],
                false => rays.inverse,
            };
            let start = match is_turned {
                true => [turn(&rays.origin, 0) * inverse[0], turn(&rays.origin, 1) * inverse[1]],
                false => [rays.origin[0] * inverse[0], rays.origin[1] * inverse[1]],
            };
            let start = [start[0], start[1], rays.origin[2] * inverse[2]];
            // who goes down an axis comes in by the upper face
            let face = |axis: usize| {
                let lower = number(2.0 * axis as f64);
                direction[axis].is_below(zero).pick(lower + number(1.0), lower)
            };
            let faces = [face(0), face(1), face(2)];
            let mut rest = word;
            while rest != 0 {
                let planes = &boxes[rest.trailing_zeros() as usize];
                rest &= rest - 1;
                let at = |axis: usize, plane: f64| number(plane) * inverse[axis] - start[axis];
                let spans = [0, 1, 2].map(|axis| {
                    let (low, high) = (at(axis, planes.low[axis]), at(axis, planes.high[axis]));
                    (low.least_of(high), low.most_of(high))
                });
                let beside = spans[0].0.most_of(spans[1].0);
                let enter = beside.most_of(spans[2].0);
                let leave = spans[0].1.least_of(spans[1].1).least_of(spans[2].1).least_of(first.distance);
                let other = zero.is_below((rays.own - number(planes.number)).abs());
                let is_met = enter.is_below(leave).and(other).but_not(enter.is_below(zero));
                let by_side = spans[0].0.is_below(spans[1].0).pick(faces[1], faces[0]);
                let by = beside.is_below(spans[2].0).pick(faces[2], by_side);
                first.distance = is_met.pick(enter, first.distance);
                first.number = is_met.pick(number(planes.number), first.number);
                first.face = is_met.pick(by, first.face);
            }
        }
        first
    }

    /// Words with the bits of the boxes that reach into each of several wedges: those of a wedge follow each other. A wedge lies between two
    /// planes through `apex`, on the side of each to which a vector points; of a box that reaches into none the bit may be set.
    pub fn reached(&self, apex: DVec3, wedges: &[[DVec3; 2]], words: &mut Vec<u64>) {
        words.clear();
        words.resize(self.words() * wedges.len(), 0);
        self.vectors.dispatch(Reached { boxes: self, apex, wedges, words });
    }
}

/// Several boxes by coordinates; where there are fewer, the first stands for the others.
fn by_coordinates(boxes: &[Planes]) -> [[Each; 3]; 2] {
    let of = |coordinate: &dyn Fn(&Planes) -> f64| {
        std::array::from_fn(|lane| coordinate(boxes.get(lane).unwrap_or(&boxes[0])))
    };
    [[0, 1, 2].map(|axis| of(&|planes| planes.low[axis])), [0, 1, 2].map(|axis| of(&|planes| planes.high[axis]))]
}

/// Asks which boxes reach into wedges.
struct Reached<'a> {
    boxes: &'a BoxesTogether,
    apex: DVec3,
    wedges: &'a [[DVec3; 2]],
    words: &'a mut [u64],
}

impl pulp::WithSimd for Reached<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { boxes, apex, wedges, words } = self;
        let number = |number: f64| Numbers::all(simd, number);
        for (group, Turned { rows, by_side, .. }) in boxes.turned.iter().enumerate() {
            let turn = |v: DVec3| [rows[0][0] * v.x + rows[0][1] * v.y, rows[1][0] * v.x + rows[1][1] * v.y, v.z];
            let apex = turn(apex).map(number);
            for (wedge, sides) in wedges.iter().enumerate() {
                let sides = sides.map(|side| turn(side).map(number));
                let mut word = 0;
                for (several, [low, high]) in by_side.iter().enumerate() {
                    let mut reach = [0.0; TOGETHER];
                    for j in 0..TOGETHER / S::F64_LANES {
                        let from = |corner: &[Each; 3], axis: usize| Numbers::of(simd, &corner[axis], j) - apex[axis];
                        let ways = [0, 1, 2].map(|axis| [from(low, axis), from(high, axis)]);
                        // of the corner that is farthest along
                        let farthest = |side: [Numbers<S>; 3]| {
                            let [x, y, z] =
                                [0, 1, 2].map(|axis| (ways[axis][0] * side[axis]).most_of(ways[axis][1] * side[axis]));
                            // never a negative zero
                            x + y + z + number(0.0)
                        };
                        farthest(sides[0]).least_of(farthest(sides[1])).store(&mut reach, j);
                    }
                    for (lane, reach) in reach.iter().enumerate() {
                        word |= (!reach.to_bits() >> 63) << (several * TOGETHER + lane);
                    }
                }
                words[wedge * boxes.words() + group] = word & all_of(&boxes.turned[group]);
            }
        }
    }
}

/// The bits of all boxes that are turned alike.
fn all_of(turned: &Turned) -> u64 {
    u64::MAX >> (IN_A_WORD - turned.boxes.len())
}

/// Asks for the box that each ray meets first.
struct Ask<'a> {
    boxes: &'a BoxesTogether,
    rays: &'a RaysBySide,
    met: &'a mut Each,
}

impl pulp::WithSimd for Ask<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { boxes, rays, met } = self;
        for j in 0..TOGETHER / S::F64_LANES {
            let of = |each: &Each| Numbers::of(simd, each, j);
            let direction = rays.direction.each_ref().map(of);
            let origin = rays.origin.each_ref().map(of);
            let by_vectors =
                RaysInVectors { origin, direction, inverse: direction.map(|d| inverse(simd, d)), own: of(&rays.own) };
            let all = boxes.turned.iter().map(all_of);
            boxes.meet(simd, &by_vectors, of(&rays.within), all).number.store(met, j);
        }
    }
}

#[cfg(test)]
mod tests {
    use pulp::WithSimd;

    use super::*;
    use crate::sampling::{Key, PathRandom};
    use crate::scene::BoxObject;

    /// Several rays, and the boxes that they may meet.
    fn question(random: &mut PathRandom, count: usize) -> (Vec<TraceableBox>, RaysBySide) {
        let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
        let boxes = (0..count)
            .map(|number| {
                TraceableBox::new(&BoxObject {
                    size: DVec3::new(uniform(0.1, 0.6), uniform(0.1, 0.6), uniform(0.1, 1.0)),
                    base: DVec3::new(uniform(0.5, 3.5), uniform(0.5, 2.5), uniform(0.0, 1.0)),
                    rotation: if number % 2 == 0 { 0.0 } else { uniform(0.0, 7.0) },
                    surface: crate::optics::Surface::diffuse([0.5; 3]),
                })
            })
            .collect();
        let mut each = |low: f64, high: f64| std::array::from_fn(|_| uniform(low, high));
        let origin = [each(0.0, 4.0), each(0.0, 3.0), each(0.0, 2.5)];
        let mut direction = [each(-1.0, 1.0), each(-1.0, 1.0), each(-1.0, 1.0)];
        // along an axis and in a plane
        (direction[0][0], direction[1][0], direction[2][1]) = (0.0, 0.0, 0.0);
        let own = std::array::from_fn(|lane| if lane % 3 == 0 { 0.0 } else { NO_BOX });
        (boxes, RaysBySide { origin, direction, own, within: each(0.2, 3.0) })
    }

    /// Each ray meets the box that it enters first alone, but for its own one, and none beyond its reach.
    #[test]
    fn each_ray_meets_what_it_meets_alone() {
        let mut random = PathRandom::new(Key::new(41));
        let mut met = 0;
        for round in 0..2000 {
            let (boxes, rays) = question(&mut random, 1 + round % 80);
            let together = BoxesTogether::new(&boxes).first_met(&rays);
            for (lane, together) in together.into_iter().enumerate() {
                let [origin, direction] =
                    [rays.origin, rays.direction].map(|of| DVec3::from_array(of.map(|v| v[lane])));
                let others = boxes.iter().enumerate().filter(|(number, _)| *number as f64 != rays.own[lane]);
                let entries = others.filter_map(|(number, object)| {
                    let (t, ..) = object.intersect(origin, direction)?;
                    (t < rays.within[lane]).then_some((t, number))
                });
                let alone = entries.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(NO_BOX, |(_, number)| number as f64);
                assert_eq!(together, alone, "{round} {lane}");
                met += usize::from(alone != NO_BOX);
            }
        }
        assert!(met > 2000, "{met}");
    }

    /// Vectors of one number, of two, four and eight, and the widest of this machine: the same answers.
    #[test]
    fn answers_do_not_depend_on_the_width_of_vectors() {
        let mut random = PathRandom::new(Key::new(42));
        for round in 0..300 {
            let (boxes, rays) = question(&mut random, 1 + round % 80);
            let boxes = BoxesTogether::new(&boxes);
            let wedges = [[DVec3::new(1.0, 0.3, 0.1), DVec3::new(-0.2, 1.0, 0.0)], [DVec3::ZERO; 2]];
            let apex = DVec3::new(2.0, 1.5, 0.0);
            let asked = |ask: &dyn Fn(Ask<'_>), reach: &dyn Fn(Reached<'_>)| {
                let mut met = [NO_BOX; TOGETHER];
                ask(Ask { boxes: &boxes, rays: &rays, met: &mut met });
                let mut words = vec![0; boxes.words() * wedges.len()];
                reach(Reached { boxes: &boxes, apex, wedges: &wedges, words: &mut words });
                (met, words)
            };
            let one = asked(&|ask| ask.with_simd(pulp::Scalar), &|reach| reach.with_simd(pulp::Scalar));
            // a wedge without sides has all
            assert_eq!(
                one.1[boxes.words()..].iter().map(|word| word.count_ones()).sum::<u32>() as usize,
                1 + round % 80
            );
            assert_eq!(one, asked(&|ask| ask.with_simd(pulp::Scalar128b), &|reach| reach.with_simd(pulp::Scalar128b)));
            assert_eq!(one, asked(&|ask| ask.with_simd(pulp::Scalar256b), &|reach| reach.with_simd(pulp::Scalar256b)));
            assert_eq!(one, asked(&|ask| ask.with_simd(pulp::Scalar512b), &|reach| reach.with_simd(pulp::Scalar512b)));
            let widest = pulp::Arch::new();
            assert_eq!(one, asked(&|ask| widest.dispatch(ask), &|reach| widest.dispatch(reach)));
        }
    }
}
