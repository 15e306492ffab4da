//! Sensors of one height in lines, and what of a connection comes past the shadows on them.

use crate::geometry::numbers::Numbers;
use crate::integrator::photon::connect::Connection;
use crate::traceable::outlines::{LANES, Outlines};

/// Share of a step by which sensors of a line may stand beside their even places.
const UNEVEN: f64 = 1e-6;

/// Sensors of a line that have their bits in one number: with one bit more, a place beyond the last would have none.
const TOGETHER: usize = 63;

/// 2^52: whole numbers below that are added to it are the last bits of the sum.
const LAST_BITS: f64 = 4_503_599_627_370_496.0;

/// Sensors of one height.
#[derive(Debug, Default)]
pub struct Lines {
    /// Coordinates in m.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// Lines of evenly spaced sensors from west to east, and the northing of each, which never falls.
    lines: Vec<Line>,
    northings: Vec<f64>,
}

/// Sensors that follow each other from west to east.
#[derive(Debug)]
struct Line {
    first: usize,
    /// Number of its sensors.
    length: f64,
    /// Easting of the first.
    west: f64,
    /// One over the distance of neighbours, per m.
    per_m: f64,
}

/// What is needed while connections are added, kept from one to the next.
#[derive(Debug, Default)]
pub struct Scratch {
    values: Vec<f64>,
    /// Shadows that connections pass.
    pub outlines: Vec<Outlines>,
    /// Of each [`TOGETHER`] sensors of a line.
    shaded: Vec<Shaded>,
}

/// What shadows lie on some sensors, one bit for each, the lowest for the first.
#[derive(Clone, Copy, Debug, Default)]
struct Shaded {
    /// Nothing is seen from these.
    hidden: u64,
    /// Bounds throw a shadow on these.
    bound: u64,
}

impl Lines {
    /// Sensors in the order of their northings, and in lines from west to east, as those of grids.
    pub fn new(x: Vec<f64>, y: Vec<f64>) -> Self {
        let (mut lines, mut northings): (Vec<Line>, Vec<f64>) = (Vec::new(), Vec::new());
        for (place, (east, north)) in x.iter().zip(&y).enumerate() {
            if let (Some(line), Some(northing)) = (lines.last_mut(), northings.last())
                && *northing == *north
            {
                let step = if line.length == 1.0 { east - line.west } else { 1.0 / line.per_m };
                let is_even = (east - line.west - line.length * step).abs() < UNEVEN * step;
                if step > 0.0 && is_even {
                    line.per_m = line.length / (east - line.west);
                    line.length += 1.0;
                    continue;
                }
            }
            lines.push(Line { first: place, length: 1.0, west: *east, per_m: 1.0 });
            northings.push(*north);
        }
        Self { x, y, lines, northings }
    }

    /// Number of sensors.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Adds to the sensors what they get of a connection past the outlines in `scratch`; `sees` tells of a sensor whether it sees the
    /// vertex where only bounds throw a shadow on it.
    pub fn add(
        &self,
        vectors: pulp::Arch,
        connection: &Connection,
        scratch: &mut Scratch,
        sees: impl Fn(usize) -> bool,
        lux: &mut [f64],
    ) {
        if scratch.outlines.is_empty() {
            connection.add_to(vectors, lux, &self.x, &self.y);
            return;
        }
        let Scratch { values, outlines, shaded } = scratch;
        values.clear();
        values.resize(self.len(), 0.0);
        connection.add_to(vectors, values, &self.x, &self.y);
        shaded.clear();
        shaded.resize(self.lines.iter().map(Line::parts).sum(), Shaded::default());
        vectors.dispatch(Hiding { lines: self, connection, outlines, values, shaded });
        // rays are worth it only where nothing else is in the way
        for (first, Shaded { hidden, bound }) in self.lines.iter().flat_map(Line::firsts).zip(shaded) {
            let mut asked = *bound & !*hidden;
            while asked != 0 {
                let place = first + asked.trailing_zeros() as usize;
                asked &= asked - 1;
                if values[place] != 0.0 && !sees(place) {
                    values[place] = 0.0;
                }
            }
        }
        vectors.dispatch(
            #[inline(always)]
            || lux.iter_mut().zip(&*values).for_each(|(sum, value)| *sum += *value),
        );
    }
}

impl Line {
    /// Number of its parts of [`TOGETHER`] sensors.
    fn parts(&self) -> usize {
        (self.length as usize).div_ceil(TOGETHER)
    }

    /// Place of the first sensor of each part.
    fn firsts(&self) -> impl Iterator<Item = usize> {
        (0..self.parts()).map(|part| self.first + part * TOGETHER)
    }
}

/// Takes what sensors in shadows got, and notes those in bounds of shadows.
struct Hiding<'a> {
    lines: &'a Lines,
    connection: &'a Connection,
    outlines: &'a [Outlines],
    values: &'a mut [f64],
    shaded: &'a mut [Shaded],
}

impl pulp::WithSimd for Hiding<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { lines, connection, outlines, values, shaded } = self;
        for outlines in outlines {
            for j in 0..Outlines::vectors(simd) {
                let [south, north] = outlines.reach(simd, j);
                let mut rest = &mut *shaded;
                for (line, northing) in lines.lines.iter().zip(&lines.northings) {
                    let (of_line, of_others) = rest.split_at_mut(line.parts());
                    rest = of_others;
                    let (west, dy) = (line.west - connection.vertex.x, northing - connection.vertex.y);
                    if dy <= south || dy >= north {
                        continue;
                    }
                    let ends = outlines.on_line((simd, j), dy, [west, line.per_m, line.length]);
                    shade(simd, ends, &outlines.bound, j, of_line);
                }
            }
        }
        let parts =
            lines.lines.iter().flat_map(|line| line.firsts().map(|first| (first, line.first + line.length as usize)));
        for ((first, end), Shaded { hidden, .. }) in parts.zip(shaded) {
            let end = end.min(first + TOGETHER);
            for (bit, value) in values[first..end].iter_mut().enumerate() {
                *value = if *hidden >> bit & 1 == 1 { 0.0 } else { *value };
            }
        }
    }
}

/// Notes the sensors of a line that lie in the shadows of the `j`-th vector, between the places `first` and `end` of each; `bound` is 1
/// for bounds, else 0. No branches: where a shadow ends is as random as the light.
#[inline(always)]
fn shade<S: pulp::Simd>(
    simd: S,
    [first, end]: [Numbers<S>; 2],
    bound: &[f64; LANES],
    j: usize,
    of_line: &mut [Shaded],
) {
    let (mut firsts, mut ends) = ([0.0; LANES], [0.0; LANES]);
    let last_bits = Numbers::all(simd, LAST_BITS);
    (first + last_bits).store(&mut firsts, j);
    (end + last_bits).store(&mut ends, j);
    let mut before = 0;
    for shaded in of_line {
        let (mut all, mut of_bounds) = (0, 0);
        for lane in j * S::F64_LANES..(j + 1) * S::F64_LANES {
            let place = |places: &[f64; LANES]| {
                let place = places[lane].to_bits() & ((1 << 32) - 1);
                place.saturating_sub(before).min(TOGETHER as u64)
            };
            let stretch = (1_u64 << place(&ends)) - (1_u64 << place(&firsts));
            let is_bound = 0_u64.wrapping_sub(bound[lane].to_bits() >> 61 & 1);
            all |= stretch & !is_bound;
            of_bounds |= stretch & is_bound;
        }
        shaded.hidden |= all;
        shaded.bound |= of_bounds;
        before += TOGETHER as u64;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::sampling::{Key, PathRandom};
    use crate::scene::BoxObject;
    use crate::traceable::TraceableBox;
    use crate::traceable::obstacles::Obstacles;

    /// Sensors get what a connection sends where a ray from the vertex meets no box, and nothing elsewhere; where boxes are
    /// taken as bounds of what throws shadows, each sensor in one is asked once. Some of the lines have gaps, some are long.
    #[test]
    fn sensors_behind_boxes_get_nothing() {
        let mut random = PathRandom::new(Key::new(9));
        let at = |k: usize| 0.05 + 0.1 * k as f64;
        let places = (0..900).map(|k| (k % 30, k / 30)).filter(|(x, y)| (x * 7 + y * 3) % 11 != 0);
        let places = places.map(|(x, y)| (at(x), at(y)));
        let (x, y): (Vec<f64>, Vec<f64>) =
            places.chain((0..450).map(|k| (0.02 * (k % 150) as f64, at(30 + k / 150)))).unzip();
        let lines = Lines::new(x, y);
        assert!(lines.lines.iter().any(|line| line.parts() == 3));
        let (mut hidden, mut scratch) = (0, Scratch::default());
        for round in 0..200 {
            let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
            let boxes: Vec<TraceableBox> = (0..11)
                .map(|number| {
                    let base = DVec3::new(uniform(0.3, 2.7), uniform(0.3, 2.7), uniform(0.0, 0.4));
                    let size = DVec3::new(uniform(0.1, 0.6), uniform(0.1, 0.6), uniform(0.1, 1.0));
                    let rotation = if number % 2 == 0 { 0.0 } else { uniform(0.0, 7.0) };
                    let surface = crate::optics::Surface::diffuse([0.5; 3]);
                    TraceableBox::new(&BoxObject { size, base, rotation, surface })
                })
                .collect();
            let (height, vertex) = (0.2, DVec3::new(uniform(0.0, 3.0), uniform(0.0, 3.0), uniform(0.3, 2.0)));
            let depth = vertex.z - height;
            let connection = Connection { vertex, normal: DVec3::NEG_Z, depth, per_sr: 1.0, near_squared: 0.0 };
            let but_for = (round % 2 == 0).then_some(3);
            let casters = Obstacles::new(&boxes, &[], &[]).casters();
            casters.outlines(vertex, height, but_for, &mut scratch.outlines);
            let sees = |place: usize| {
                let sensor = DVec3::new(lines.x[place], lines.y[place], height);
                let others = boxes.iter().enumerate().filter(|(number, _)| Some(*number) != but_for);
                others
                    .map(|(_, object)| object)
                    .all(|object| object.intersect(sensor, vertex - sensor).is_none_or(|(share, ..)| share >= 1.0))
            };
            let inside = |place: usize| {
                let sensor = DVec3::new(lines.x[place], lines.y[place], height);
                boxes.iter().any(|object| object.contains(sensor) || object.contains(vertex))
            };
            let mut lux = vec![0.0; lines.len()];
            lines.add(pulp::Arch::new(), &connection, &mut scratch, |_| unreachable!(), &mut lux);
            // the same where rays decide
            scratch.outlines.iter_mut().for_each(|outlines| *outlines = outlines.as_bounds());
            let asked = std::cell::Cell::new(0);
            let count = |place: usize| {
                asked.set(asked.get() + 1);
                sees(place)
            };
            let mut by_rays = vec![0.0; lines.len()];
            lines.add(pulp::Arch::new(), &connection, &mut scratch, count, &mut by_rays);
            for place in (0..lines.len()).filter(|place| !inside(*place)) {
                let expected = if sees(place) { connection.illuminance(lines.x[place], lines.y[place]) } else { 0.0 };
                assert_eq!([lux[place], by_rays[place]], [expected; 2], "{vertex} {place}");
                hidden += usize::from(expected == 0.0);
            }
            assert!(asked.get() <= lux.iter().filter(|lux| **lux == 0.0).count());
        }
        assert!(hidden > 10_000, "{hidden}");
    }
}
