//! SIMD packets of rays through a bent tube: as many rays as a vector of the processor has numbers, all in the same segment.
//!
//! Rays that run along the axis, graze the wall or bounce very often are followed one by one instead. Every ray has the bits that
//! [`BentGuide::down`] gives it: the same operations in the same order.

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::vectors::{Vector, all, difference, dot, rotated, sum, turned};
use super::{BentGuide, Cylinder, End, Transit};
use crate::geometry::cylinder::{LEAST_HALF_CHORD, MOST_SQUARED};
use crate::geometry::numbers::{Numbers, Truths};
use crate::optics::Mirror;

/// Number of f64 lanes of the widest vector of any processor.
const WIDEST: usize = 8;

/// Largest number of reflections that a packet has by steps before the closed form, and after it.
const MOST_WALLS: usize = 64;

/// Number of sweeps of rays through all segments, down and up in turn; rays that still turn back then are followed one by one.
const MOST_SWEEPS: usize = 16;

impl BentGuide {
    /// Follows light from entry points, each `(position, unit direction)`, down, with the results of [`BentGuide::down`].
    pub(in super::super) fn down_packet<const C: usize>(&self, rays: &[(DVec3, DVec3)]) -> Vec<Transit<C>> {
        let alone = |(position, direction): &(DVec3, DVec3)| self.down(*position, *direction);
        if matches!(self.reflectance, Mirror::ByAngle(_)) {
            return rays.iter().map(alone).collect();
        }
        let mut states: Vec<RayState> = rays.iter().map(|ray| RayState::new(ray, self.segments.len() - 1)).collect();
        Arch::new().dispatch(Sweeps { segments: &self.segments, radius: self.radius, states: &mut states });
        let most_bounces = self.most_bounces();
        let crossings = [self.collected(1), self.collected(2)];
        let transit = |(ray, state): (&(DVec3, DVec3), RayState)| {
            let (end, collector) = match state.at {
                At::Opening => (End::Opening, crossings[0]),
                At::Top => (End::Top, crossings[1]),
                At::Segment(_) | At::Alone => return alone(ray),
            };
            if state.bounces > most_bounces {
                return alone(ray);
            }
            Transit {
                end,
                position: state.position.into(),
                direction: state.direction.into(),
                collector,
                mirrors: self.reflectance.power(|| 1.0, state.bounces),
                entered: true,
                rays: state.rays as u32,
            }
        };
        rays.iter().zip(states).map(transit).collect()
    }
}

/// Place of a ray between sweeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum At {
    /// Segment that the ray is in or about to enter, by its index.
    Segment(usize),
    Opening,
    Top,
    /// Any place: the ray must be followed separately.
    Alone,
}

/// State of a ray in the frame of the tube, between two segments.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RayState {
    position: [f64; 3],
    direction: [f64; 3],
    /// Number of reflections (`bounces`), and of ray segments computed by steps (`rays`).
    bounces: f64,
    rays: f64,
    at: At,
}

impl RayState {
    fn new((position, direction): &(DVec3, DVec3), segment: usize) -> Self {
        let (position, direction) = (position.to_array(), direction.to_array());
        Self { position, direction, bounces: 0.0, rays: 0.0, at: At::Segment(segment) }
    }
}

struct Sweeps<'a> {
    segments: &'a [Cylinder],
    radius: f64,
    states: &'a mut [RayState],
}

// functions are inlined, and no closure is passed on: they would be compiled without the vector instructions

impl WithSimd for Sweeps<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { segments, radius, states } = self;
        let mut here = Vec::with_capacity(states.len());
        for sweep in 0..MOST_SWEEPS {
            let mut left = 0;
            for step in 0..segments.len() {
                let index = if sweep % 2 == 0 { segments.len() - 1 - step } else { step };
                here.clear();
                for (number, state) in states.iter().enumerate() {
                    if state.at == At::Segment(index) {
                        here.push(number);
                    }
                }
                left += here.len();
                for group in here.chunks(S::F64_LANES) {
                    pass(simd, segments, index, radius, states, group);
                }
            }
            if left == 0 {
                break;
            }
        }
    }
}

/// Takes the rays `group` of `states`, at least one and no more than a vector has lanes, through the segment they are in.
#[inline(always)]
fn pass<S: Simd>(simd: S, segments: &[Cylinder], index: usize, radius: f64, states: &mut [RayState], group: &[usize]) {
    let mut columns = [[0.0; WIDEST]; 8];
    for lane in 0..S::F64_LANES {
        // unused lanes repeat the first ray
        let state = &states[*group.get(lane).unwrap_or(&group[0])];
        for axis in 0..3 {
            columns[axis][lane] = state.position[axis];
            columns[3 + axis][lane] = state.direction[axis];
        }
        columns[6][lane] = state.bounces;
        columns[7][lane] = state.rays;
    }
    let [x, y, z, u, v, w, bounces, rays] = &columns;
    let (position, direction) = ([of(simd, x), of(simd, y), of(simd, z)], [of(simd, u), of(simd, v), of(simd, w)]);
    let cylinder = &segments[index];
    let origin = all(simd, cylinder.origin);
    let never = of(simd, x).is_below(of(simd, x));
    let mut inside = Rays {
        position: turned(simd, &cylinder.to_local, difference(position, origin)),
        direction: turned(simd, &cylinder.to_local, direction),
        bounces: of(simd, bounces),
        rays: of(simd, rays),
        going: never,
        at_lower: never,
        at_upper: never,
    };
    inside.pass(simd, cylinder, radius);
    let back = cylinder.to_local.transpose();
    let position = sum(origin, turned(simd, &back, inside.position));
    let direction = turned(simd, &back, inside.direction);
    let [x, y, z, u, v, w, bounces, rays] = &mut columns;
    position[0].store(x, 0);
    position[1].store(y, 0);
    position[2].store(z, 0);
    direction[0].store(u, 0);
    direction[1].store(v, 0);
    direction[2].store(w, 0);
    inside.bounces.store(bounces, 0);
    inside.rays.store(rays, 0);
    let (zero, one, two) = (Numbers::all(simd, 0.0), Numbers::all(simd, 1.0), Numbers::all(simd, 2.0));
    let mut ends = [0.0; WIDEST];
    inside.at_lower.pick(one, inside.at_upper.pick(two, zero)).store(&mut ends, 0);
    for (lane, number) in group.iter().enumerate() {
        let at = if ends[lane] == 1.0 {
            if index == 0 { At::Opening } else { At::Segment(index - 1) }
        } else if ends[lane] == 2.0 {
            if index + 1 == segments.len() { At::Top } else { At::Segment(index + 1) }
        } else {
            At::Alone
        };
        let [x, y, z, u, v, w, bounces, rays] = &columns;
        states[*number] = RayState {
            position: [x[lane], y[lane], z[lane]],
            direction: [u[lane], v[lane], w[lane]],
            bounces: bounces[lane],
            rays: rays[lane],
            at,
        };
    }
}

/// A packet of rays in one segment, in its frame.
struct Rays<S: Simd> {
    position: Vector<S>,
    direction: Vector<S>,
    bounces: Numbers<S>,
    rays: Numbers<S>,
    /// Lanes still being followed (`going`), and lanes that reached an end of the segment; a lane in none of the masks has to be followed
    /// by itself.
    going: Truths<S>,
    at_lower: Truths<S>,
    at_upper: Truths<S>,
}

impl<S: Simd> Rays<S> {
    /// Follows the packet from its positions to the ends of the segment.
    #[inline(always)]
    fn pass(&mut self, simd: S, cylinder: &Cylinder, radius: f64) {
        let zero = Numbers::all(simd, 0.0);
        let (free_from, free_to) = (Numbers::all(simd, cylinder.free_from), Numbers::all(simd, cylinder.free_to));
        let (down, up) = (self.direction[2].is_below(zero), zero.is_below(self.direction[2]));
        self.going = down.or(up);
        // reflections near the end by which the rays came
        for _ in 0..MOST_WALLS {
            let z = self.position[2];
            let near = down.and(free_to.is_below(z)).or(up.and(z.is_below(free_from)));
            let near = near.and(self.going);
            if !near.any() {
                break;
            }
            self.meet(simd, cylinder, radius, near);
        }
        // up to the height from which the other end may be met
        let z = self.position[2];
        let free = self.going.but_not(z.is_below(free_from).or(free_to.is_below(z)));
        let axial = down.pick(z - free_from, free_to - z);
        let free = free.and(zero.is_below(axial));
        if free.any() {
            self.traverse(simd, radius, axial, free);
        }
        for _ in 0..MOST_WALLS {
            if !self.going.any() {
                break;
            }
            self.meet(simd, cylinder, radius, self.going);
            // rounding may leave a wall on this side of where the closed form ended
            let z = self.position[2];
            let again = down.and(free_from.is_below(z)).or(up.and(z.is_below(free_to)));
            self.going = self.going.but_not(again);
        }
    }

    /// Moves the lanes `these` to the wall, where they are reflected, or to an end of the segment.
    #[inline(always)]
    fn meet(&mut self, simd: S, cylinder: &Cylinder, radius: f64, these: Truths<S>) {
        let (zero, one) = (Numbers::all(simd, 0.0), Numbers::all(simd, 1.0));
        let (two, infinity) = (Numbers::all(simd, 2.0), Numbers::all(simd, f64::INFINITY));
        let (p, d) = (self.position, self.direction);
        // the far wall, as `distance_to_wall` has it
        let a = d[0] * d[0] + d[1] * d[1];
        let half_b = p[0] * d[0] + p[1] * d[1];
        let c = (p[0] * p[0] + p[1] * p[1]) - Numbers::all(simd, radius * radius);
        let root = (half_b * half_b - a * c).larger(zero).root();
        let outward = zero.is_below(half_b);
        let wall = (outward.pick(-c, root - half_b) / outward.pick(root + half_b, a)).larger(zero);
        let wall = zero.is_below(a).pick(wall, infinity);
        let (lower_normal, upper_normal) = (all(simd, cylinder.lower_normal), all(simd, cylinder.upper_normal));
        let toward_lower = dot(d, lower_normal);
        let lower = (-dot(p, lower_normal) / toward_lower).larger(zero);
        let lower = toward_lower.is_below(zero).pick(lower, infinity);
        let toward_upper = dot(d, upper_normal);
        let to_top = difference(all(simd, DVec3::Z * cylinder.length), p);
        let upper = (dot(to_top, upper_normal) / toward_upper).larger(zero);
        let upper = zero.is_below(toward_upper).pick(upper, infinity);
        let at_wall = wall.is_below(lower.less(upper));
        let at_upper = upper.is_below(lower);
        let distance = at_wall.pick(wall, at_upper.pick(upper, lower));
        let there = sum(p, [d[0] * distance, d[1] * distance, d[2] * distance]);
        // the ray after the wall
        let per_radius = Numbers::all(simd, 1.0 / radius);
        let normal = [there[0] * per_radius, there[1] * per_radius];
        let cosine = d[0] * normal[0] + d[1] * normal[1];
        let twice = two * cosine;
        let reflected = these.and(at_wall);
        for axis in 0..2 {
            self.position[axis] = these.pick(there[axis], p[axis]);
            self.direction[axis] = reflected.pick(d[axis] - normal[axis] * twice, d[axis]);
        }
        self.position[2] = these.pick(there[2], p[2]);
        self.bounces = self.bounces + reflected.pick(one, zero);
        self.rays = self.rays + these.pick(one, zero);
        let ended = these.but_not(at_wall);
        self.at_upper = self.at_upper.or(ended.and(at_upper));
        self.at_lower = self.at_lower.or(ended.but_not(at_upper));
        self.going = self.going.but_not(ended);
    }

    /// Moves the lanes `these` over `axial` > 0 metres along the axis, as [`crate::geometry::cylinder::traverse`] does.
    #[inline(always)]
    fn traverse(&mut self, simd: S, radius: f64, axial: Numbers<S>, these: Truths<S>) {
        let (zero, one, two) = (Numbers::all(simd, 0.0), Numbers::all(simd, 1.0), Numbers::all(simd, 2.0));
        let half = Numbers::all(simd, 0.5);
        let (p, d) = (self.position, self.direction);
        let end_z = p[2] + zero.is_below(d[2]).pick(axial, -axial);
        let speed_squared = d[0] * d[0] + d[1] * d[1];
        let path = axial * speed_squared / d[2].abs();
        let reach = Numbers::all(simd, radius) * speed_squared.root();
        let side = p[0] * d[1] - p[1] * d[0];
        let impact = side.abs();
        let half_chord = ((reach - impact).larger(zero) * (reach + impact)).root();
        let from_middle = p[0] * d[0] + p[1] * d[1];
        let chords = (from_middle + half_chord + path) / (two * half_chord);
        let bounces = chords.floor().larger(zero);
        // excluded: rays along the axis, rays along the wall, and more bounces than repeated squaring takes
        let usual = zero.is_below(path).but_not(half_chord.is_below(Numbers::all(simd, LEAST_HALF_CHORD) * reach));
        let usual = usual.but_not(Numbers::all(simd, MOST_SQUARED).is_below(bounces));
        self.going = self.going.but_not(these.but_not(usual));
        let these = these.and(usual);
        let rest = (chords - bounces) * two * half_chord;
        let rest = (rest - from_middle - half_chord) / speed_squared;
        let mut end = [p[0] + d[0] * rest, p[1] + d[1] * rest];
        // twice the half turn, as often as there are bounces
        let half_turn = [impact / reach, half_chord / reach];
        let mut power = rotated(half_turn, half_turn);
        let mut turn = [one, zero];
        let mut left = these.pick(bounces, zero);
        while zero.is_below(left).any() {
            let half_left = (left * half).floor();
            let odd = zero.is_below(left - two * half_left);
            let further = rotated(turn, power);
            turn = [odd.pick(further[0], turn[0]), odd.pick(further[1], turn[1])];
            power = rotated(power, power);
            left = half_left;
        }
        let to_unit = Numbers::all(simd, 1.5) - half * (turn[0] * turn[0] + turn[1] * turn[1]);
        let (cos, sin) = (turn[0] * to_unit, turn[1] * to_unit);
        let turn = [cos, side.is_below(zero).pick(-sin, sin)];
        let bounced = zero.is_below(bounces);
        let (end_turned, d_turned) = (rotated(turn, end), rotated(turn, [d[0], d[1]]));
        end = [bounced.pick(end_turned[0], end[0]), bounced.pick(end_turned[1], end[1])];
        let distance_squared = end[0] * end[0] + end[1] * end[1];
        let outside = these.and(Numbers::all(simd, radius * radius).is_below(distance_squared));
        if outside.any() {
            let inward = outside.pick(Numbers::all(simd, radius) / distance_squared.root(), one);
            end = [end[0] * inward, end[1] * inward];
        }
        for axis in 0..2 {
            self.position[axis] = these.pick(end[axis], p[axis]);
            self.direction[axis] = these.and(bounced).pick(d_turned[axis], d[axis]);
        }
        self.position[2] = these.pick(end_z, p[2]);
        self.bounces = self.bounces + these.pick(bounces, zero);
    }
}

#[inline(always)]
fn of<S: Simd>(simd: S, column: &[f64; WIDEST]) -> Numbers<S> {
    Numbers::of(simd, column, 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom, warp};

    enum Vectors {
        Any,
        None,
    }

    fn swept(guide: &BentGuide, rays: &[(DVec3, DVec3)], vectors: Vectors) -> Vec<RayState> {
        let mut states: Vec<RayState> = rays.iter().map(|ray| RayState::new(ray, guide.segments.len() - 1)).collect();
        let sweeps = Sweeps { segments: &guide.segments, radius: guide.radius, states: &mut states };
        match vectors {
            Vectors::Any => Arch::new().dispatch(sweeps),
            Vectors::None => sweeps.with_simd(pulp::Scalar),
        }
        states
    }

    fn guide(axes: &[(f64, DVec3)], reflectance: f64) -> BentGuide {
        BentGuide::new(0.127, axes, [reflectance; 3].into(), [0.92; 3])
    }

    /// Checks that each ray has the same bits in a packet as alone: through bends of several angles, long and short segments, mirrors that
    /// leave little, light from everywhere, along the axis and along the wall; most rays stay in packets.
    #[test]
    fn rays_have_the_bits_of_each_alone() {
        let tilted = |angle: f64, azimuth: f64| {
            let (sin, cos) = libm::sincos(angle);
            let (x, y) = libm::sincos(azimuth);
            DVec3::new(sin * x, sin * y, cos)
        };
        let up = DVec3::Z;
        let guides = [
            guide(&[(1.0, up)], 0.98),
            guide(&[(0.5, up), (0.5, tilted(0.8, 1.6)), (0.5, up)], 0.98),
            guide(&[(0.5, up), (0.5, tilted(0.8, 1.6)), (0.5, up)], 0.2),
            guide(&[(0.3, up), (30.0, tilted(0.3, 0.2)), (0.2, tilted(1.2, 0.4))], 0.999),
            guide(&[(0.06, up), (0.1, tilted(0.5, 2.0)), (0.11, tilted(0.9, 3.0))], 1.0),
        ];
        let mut random = PathRandom::new(Key::new(8));
        for guide in guides {
            let top = guide.segments.last().unwrap().to_local.transpose();
            let mut rays: Vec<(DVec3, DVec3)> = Vec::new();
            for number in 0..4003 {
                let local = -match number {
                    0..5 => DVec3::Z,
                    5..9 => DVec3::new(1.0, 0.0, 1e-9).normalize(),
                    _ => warp::cosine_hemisphere(random.uniform2()),
                };
                let direction = top * local;
                let point = if number % 9 == 3 { [1.0 - 1e-15, 0.1] } else { random.uniform2() };
                rays.extend(guide.entry(point, direction).map(|entry| (entry.position, direction)));
            }
            let together = guide.down_packet::<1>(&rays);
            assert_eq!(together.len(), rays.len());
            for ((position, direction), transit) in rays.iter().zip(together) {
                let alone: Transit<1> = guide.down(*position, *direction);
                assert_eq!(format!("{alone:?}"), format!("{transit:?}"));
            }
            let states = swept(&guide, &rays, Vectors::Any);
            let alone = states.iter().filter(|state| !matches!(state.at, At::Opening | At::Top)).count();
            assert!(alone < rays.len() / 3, "{alone} of {}", rays.len());
        }
    }

    /// Checks that the bits are the same without vector instructions.
    #[test]
    fn rays_have_the_same_bits_on_all_processors() {
        let guide = guide(&[(0.5, DVec3::Z), (0.7, DVec3::new(0.6, 0.0, 0.8))], 0.95);
        let mut random = PathRandom::new(Key::new(9));
        let rays = (0..2001).map(|_| {
            let direction = -warp::around(DVec3::new(0.6, 0.0, 0.8), warp::cosine_hemisphere(random.uniform2()));
            (guide.entry(random.uniform2(), direction).unwrap().position, direction)
        });
        let rays: Vec<(DVec3, DVec3)> = rays.collect();
        let (any, none) = (swept(&guide, &rays, Vectors::Any), swept(&guide, &rays, Vectors::None));
        for (any, none) in any.iter().zip(&none).filter(|(any, _)| any.at != At::Alone) {
            assert_eq!(any, none);
        }
        let alone = |states: &[RayState]| states.iter().map(|state| state.at == At::Alone).collect::<Vec<_>>();
        assert_eq!(alone(&any), alone(&none));
    }
}
