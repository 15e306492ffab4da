//! Photons sorted into a dense grid of cells, for gathering within a fixed radius.

use std::marker::PhantomData;

use glam::DVec3;

use crate::optics::Spectrum;
use crate::traceable::SurfaceId;

/// Cells that a grid may have; photons are bounded by the room, so a dense grid fits.
pub const MAX_CELLS: f64 = 2_097_152.0;

/// Light that arrived at a point; `On` tells on what it lies.
#[derive(Clone, Copy, Debug)]
pub struct Photon<const C: usize, On = SurfaceId> {
    /// Where it arrived, in metres.
    pub position: DVec3,
    /// What it lies on.
    pub on: On,
    /// Flux in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize, On> Photon<C, On> {
    /// True if place and flux are finite.
    pub fn is_finite(&self) -> bool {
        self.position.is_finite() && self.flux.is_finite()
    }
}

/// What light lies on, by its number.
pub trait LiesOn: Copy {
    /// Different for what is told apart.
    fn number(self) -> u32;
}

impl LiesOn for SurfaceId {
    fn number(self) -> u32 {
        self.index() as u32
    }
}

impl LiesOn for () {
    fn number(self) -> u32 {
        0
    }
}

/// Photons that are looked at at once.
const LANES: usize = 16;

/// Steps of as many photons after which sums of single size are added to those of double size.
const MOST_STEPS: usize = 1024;

/// Photons in the order of their cells; within a cell in the order in which they were traced.
///
/// Places and fluxes are kept apart and in single size, so that a processor looks at several at once: a photon is moved by less
/// than a millionth of the room, and sums are the same to the bit whatever instructions it has.
#[derive(Debug)]
pub struct PhotonGrid<const C: usize, On = SurfaceId> {
    /// Places from the origin in metres, by axis; [`LANES`] more than there are photons.
    places: [Vec<f32>; 3],
    on: Vec<u32>,
    /// Fluxes by channel in `unit_lm`.
    fluxes: [Vec<f32>; C],
    unit_lm: f64,
    /// First photon of each cell, and the end.
    starts: Vec<u32>,
    origin: DVec3,
    per_metre: f64,
    dimensions: [usize; 3],
    vectors: pulp::Arch,
    of: PhantomData<On>,
}

/// A ball of a grid, from its origin.
struct Ball {
    centre: [f32; 3],
    radius_squared: f32,
    /// Of the ball of half the area.
    half_squared: f32,
    on: u32,
}

/// Sums over the photons of a ball, by lanes and their totals.
struct Sums<const C: usize> {
    whole: [[f32; LANES]; C],
    half: [[f32; LANES]; C],
    count: [u32; LANES],
    steps: usize,
    totals: [[f64; C]; 2],
}

impl<const C: usize> Sums<C> {
    #[inline(always)]
    fn new() -> Self {
        let zero = [[0.0; LANES]; C];
        Self { whole: zero, half: zero, count: [0; LANES], steps: 0, totals: [[0.0; C]; 2] }
    }

    /// Adds the lanes to the totals, in their order.
    #[inline(always)]
    fn settle(&mut self) {
        for (total, lanes) in self.totals.iter_mut().zip([&mut self.whole, &mut self.half]) {
            for (sum, lanes) in total.iter_mut().zip(lanes) {
                *sum += lanes.iter().map(|lane| f64::from(*lane)).sum::<f64>();
                *lanes = [0.0; LANES];
            }
        }
        self.steps = 0;
    }
}

impl<const C: usize, On: LiesOn> PhotonGrid<C, On> {
    /// Sorts photons (by counting) into cells of about `radius` metres.
    pub fn new(photons: &[Photon<C, On>], radius: f64) -> Self {
        let bounds = |f: fn(DVec3, DVec3) -> DVec3, start| photons.iter().map(|p| p.position).fold(start, f);
        let (low, high) = (bounds(DVec3::min, DVec3::INFINITY), bounds(DVec3::max, DVec3::NEG_INFINITY));
        let brightest = photons.iter().map(|photon| photon.flux.max()).fold(0.0, f64::max);
        let mut grid = Self {
            places: [const { Vec::new() }; 3],
            on: Vec::new(),
            fluxes: [const { Vec::new() }; C],
            unit_lm: if brightest > 0.0 { brightest } else { 1.0 },
            starts: vec![0, 0],
            origin: DVec3::ZERO,
            per_metre: 0.0,
            dimensions: [1; 3],
            vectors: pulp::Arch::new(),
            of: PhantomData,
        };
        if photons.is_empty() {
            return grid;
        }
        let extent = high - low;
        let mut cell = radius;
        let count = |cell: f64| (extent / cell).floor() + 1.0;
        while count(cell).element_product() > MAX_CELLS {
            cell *= 1.26;
        }
        grid.dimensions = count(cell).to_array().map(|n| n as usize);
        (grid.origin, grid.per_metre) = (low, 1.0 / cell);
        let cells: Vec<u32> = photons.iter().map(|photon| grid.cell(photon.position) as u32).collect();
        let mut starts = vec![0u32; grid.dimensions.iter().product::<usize>() + 1];
        for cell in &cells {
            starts[*cell as usize + 1] += 1;
        }
        for index in 1..starts.len() {
            starts[index] += starts[index - 1];
        }
        let mut next = starts.clone();
        let filled = photons.len() + LANES;
        grid.places = [(); 3].map(|()| vec![0.0; filled]);
        grid.fluxes = [(); C].map(|()| vec![0.0; filled]);
        grid.on = vec![0; filled];
        let per_unit = 1.0 / grid.unit_lm;
        for (photon, cell) in photons.iter().zip(&cells) {
            let place = &mut next[*cell as usize];
            let at = *place as usize;
            *place += 1;
            let relative = photon.position - low;
            (0..3).for_each(|axis| grid.places[axis][at] = relative[axis] as f32);
            (0..C).for_each(|channel| grid.fluxes[channel][at] = (photon.flux.0[channel] * per_unit) as f32);
            grid.on[at] = photon.on.number();
        }
        grid.starts = starts;
        grid
    }

    /// Place in metres and flux in lm of all photons, in the order of their cells.
    pub fn photons(&self) -> impl Iterator<Item = (DVec3, Spectrum<C>)> {
        (0..self.len()).map(|at| (self.origin + self.place(at), self.flux(at)))
    }

    /// Flux of what lies `on` something within `radius` of a point, and within the half of that area, in lm, and the number of photons in
    /// the whole.
    pub fn gather(&self, centre: DVec3, radius: f64, on: On) -> (Spectrum<C>, Spectrum<C>, u64) {
        let radius_squared = radius * radius;
        let ball = Ball {
            centre: (centre - self.origin).to_array().map(|component| component as f32),
            radius_squared: radius_squared as f32,
            half_squared: (0.5 * radius_squared) as f32,
            on: on.number(),
        };
        let sums = self.vectors.dispatch(
            #[inline(always)]
            || {
                let mut sums = Sums::new();
                self.for_each_row(centre, radius, |from, to| self.add(from, to, &ball, &mut sums));
                sums.settle();
                sums
            },
        );
        let [whole, half] = sums.totals.map(|total| Spectrum(total.map(|sum| sum * self.unit_lm)));
        (whole, half, sums.count.iter().map(|count| u64::from(*count)).sum())
    }

    /// Adds the photons of a ball among those from one to before another.
    #[inline(always)]
    fn add(&self, from: usize, to: usize, ball: &Ball, sums: &mut Sums<C>) {
        let mut at = from;
        while at < to {
            // there are so many more than photons
            let [Some(x), Some(y), Some(z)] = self.places.each_ref().map(|of| lanes(of, at)) else { return };
            let Some(on) = lanes(&self.on, at) else { return };
            let left = (to - at) as u32;
            let (mut whole, mut half) = ([0.0f32; LANES], [0.0f32; LANES]);
            for lane in 0..LANES {
                let (dx, dy, dz) = (x[lane] - ball.centre[0], y[lane] - ball.centre[1], z[lane] - ball.centre[2]);
                let distance_squared = dx * dx + dy * dy + dz * dz;
                let found = (distance_squared < ball.radius_squared) & (on[lane] == ball.on) & ((lane as u32) < left);
                let near = found & (distance_squared < ball.half_squared);
                whole[lane] = if found { 1.0 } else { 0.0 };
                half[lane] = if near { 1.0 } else { 0.0 };
                sums.count[lane] += u32::from(found);
            }
            for (channel, fluxes) in self.fluxes.iter().enumerate() {
                let Some(flux) = lanes(fluxes, at) else { return };
                for lane in 0..LANES {
                    sums.whole[channel][lane] += whole[lane] * flux[lane];
                    sums.half[channel][lane] += half[lane] * flux[lane];
                }
            }
            sums.steps += 1;
            if sums.steps == MOST_STEPS {
                sums.settle();
            }
            at += LANES;
        }
    }

    /// Calls `f` with the number of what it lies on, the flux in lm and the squared distance of every photon within `radius` of a
    /// point.
    #[inline]
    pub fn for_each_within(&self, centre: DVec3, radius: f64, mut f: impl FnMut(u32, Spectrum<C>, f64)) {
        let (relative, radius_squared) = (centre - self.origin, radius * radius);
        self.for_each_row(centre, radius, |from, to| {
            for at in from..to {
                let distance_squared = (self.place(at) - relative).length_squared();
                if distance_squared < radius_squared {
                    f(self.on[at], self.flux(at), distance_squared);
                }
            }
        });
    }

    /// Calls `f` with the first and the end of photons that follow each other, all those within `radius` of a point among them.
    #[inline(always)]
    fn for_each_row(&self, centre: DVec3, radius: f64, mut f: impl FnMut(usize, usize)) {
        let low = self.coordinates(centre - radius);
        let high = self.coordinates(centre + radius);
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                // cells of a row follow each other
                let row = (z * self.dimensions[1] + y) * self.dimensions[0];
                f(self.starts[row + low[0]] as usize, self.starts[row + high[0] + 1] as usize);
            }
        }
    }

    fn len(&self) -> usize {
        self.starts.last().map_or(0, |end| *end as usize)
    }

    /// Place of a photon from the origin in metres.
    fn place(&self, at: usize) -> DVec3 {
        DVec3::from_array(self.places.each_ref().map(|of| f64::from(of[at])))
    }

    fn flux(&self, at: usize) -> Spectrum<C> {
        Spectrum(self.fluxes.each_ref().map(|of| f64::from(of[at]) * self.unit_lm))
    }

    fn cell(&self, position: DVec3) -> usize {
        let [x, y, z] = self.coordinates(position);
        (z * self.dimensions[1] + y) * self.dimensions[0] + x
    }

    /// Cell coordinates, clamped to the grid.
    fn coordinates(&self, position: DVec3) -> [usize; 3] {
        let scaled = ((position - self.origin) * self.per_metre).max(DVec3::ZERO);
        std::array::from_fn(|axis| (scaled[axis] as usize).min(self.dimensions[axis] - 1))
    }
}

/// The values from one on that are looked at at once.
#[inline(always)]
fn lanes<T>(values: &[T], at: usize) -> Option<&[T; LANES]> {
    values.get(at..)?.first_chunk()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};

    impl LiesOn for u32 {
        fn number(self) -> u32 {
            self
        }
    }

    fn photons<const C: usize>(count: u32, random: &mut PathRandom) -> Vec<Photon<C, u32>> {
        let mut photon = |k: u32| {
            let position = DVec3::new(random.uniform() * 4.0, random.uniform() * 3.0, random.uniform());
            Photon { position, on: k % 2, flux: Spectrum([(); C].map(|()| random.uniform() * 1e-3)) }
        };
        (0..count).map(&mut photon).collect()
    }

    /// Every photon counts once, for few and many, near borders and beyond them.
    #[test]
    fn gathers_what_brute_force_gathers() {
        let mut random = PathRandom::new(Key::new(4));
        for count in [0, 1, 25, 3000] {
            let photons = photons::<1>(count, &mut random);
            for radius in [0.01, 0.3, 2.0, 10.0] {
                let grid = PhotonGrid::new(&photons, radius);
                for _ in 0..50 {
                    let mut coordinate = |size: f64| random.uniform() * size * 1.2 - 0.3;
                    let centre = DVec3::new(coordinate(4.0), coordinate(3.0), coordinate(1.0));
                    let within = |r_squared: f64| {
                        let near =
                            |p: &&Photon<1, u32>| (p.position - centre).length_squared() < r_squared && p.on == 1;
                        photons.iter().filter(near).map(|p| p.flux.0[0]).fold((0.0, 0), |(sum, n), x| (sum + x, n + 1))
                    };
                    let (whole, half, count) = grid.gather(centre, radius, 1);
                    let (expected, expected_count) = within(radius * radius);
                    assert_eq!(count, expected_count);
                    // single size has 24 bits
                    assert!((whole.0[0] - expected).abs() <= 1e-6 * expected);
                    let expected = within(0.5 * radius * radius).0;
                    assert!((half.0[0] - expected).abs() <= 1e-6 * expected);
                    let mut each = (0.0, 0);
                    grid.for_each_within(centre, radius, |on, flux, _| {
                        if on == 1 {
                            each = (each.0 + flux.0[0], each.1 + 1);
                        }
                    });
                    assert!(each.1 == expected_count && (each.0 - whole.0[0]).abs() <= 1e-6 * each.0);
                }
            }
        }
    }

    /// Sums are the same to the bit with vector instructions and without, also of so many photons that they are settled between.
    #[test]
    fn instructions_change_no_bit() {
        let mut random = PathRandom::new(Key::new(5));
        let photons = photons::<3>(50_000, &mut random);
        let fast = PhotonGrid::new(&photons, 1.0);
        let plain = PhotonGrid { vectors: pulp::Arch::Scalar, ..PhotonGrid::new(&photons, 1.0) };
        for radius in [0.2, 1.0, 9.0] {
            let centre = DVec3::new(2.0, 1.0, 0.5);
            let [(a, b, n), (c, d, m)] = [&fast, &plain].map(|grid| grid.gather(centre, radius, 1));
            assert_eq!(
                (a.0.map(f64::to_bits), b.0.map(f64::to_bits), n),
                (c.0.map(f64::to_bits), d.0.map(f64::to_bits), m)
            );
            assert!(n > 100);
        }
    }
}
