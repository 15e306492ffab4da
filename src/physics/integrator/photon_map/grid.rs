//! Photons sorted into a dense grid of cells, for gathering within a fixed radius.

use std::marker::PhantomData;

use glam::DVec3;

use super::lanes::{Ball, BallSums, Columns, LANES, Rows, within};
use crate::optics::Spectrum;
use crate::traceable::SurfaceId;

/// Largest number of cells of a grid; photons lie within the room, so a dense grid fits.
pub const MAX_CELLS: f64 = 2_097_152.0;

/// Light that arrived at a point; `On` identifies the surface, tube or list entry that it belongs to.
#[derive(Clone, Copy, Debug)]
pub struct Photon<const C: usize, On = SurfaceId> {
    /// Point of arrival in metres.
    pub position: DVec3,
    /// Surface, tube or list entry that the photon belongs to.
    pub on: On,
    /// Flux in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize, On> Photon<C, On> {
    /// True if position and flux are finite.
    pub fn is_finite(&self) -> bool {
        self.position.is_finite() && self.flux.is_finite()
    }
}

/// Identifier of what a photon belongs to, such as a surface or a tube.
pub trait LiesOn: Copy {
    /// Returns a number that differs between identifiers that must be distinguished.
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

/// Photons in the order of their cells, and within a cell in the order in which they were traced.
///
/// Positions and fluxes are separate arrays in single precision, so that a processor handles several photons at once. This moves a photon
/// by less than a millionth of the room, and sums are identical to the bit whatever instructions the processor has.
#[derive(Debug)]
pub struct PhotonGrid<const C: usize, On = SurfaceId> {
    /// Positions in metres relative to `origin`, and fluxes in `unit_lm`.
    columns: Columns<C>,
    unit_lm: f64,
    origin: DVec3,
    per_metre: f64,
    dimensions: [usize; 3],
    of: PhantomData<On>,
}

impl<const C: usize, On: LiesOn> PhotonGrid<C, On> {
    /// Sorts photons (by counting) into cells of about `radius` metres.
    pub fn new(photons: &[Photon<C, On>], radius: f64) -> Self {
        let bounds = |f: fn(DVec3, DVec3) -> DVec3, start| photons.iter().map(|p| p.position).fold(start, f);
        let (low, high) = (bounds(DVec3::min, DVec3::INFINITY), bounds(DVec3::max, DVec3::NEG_INFINITY));
        let brightest = photons.iter().map(|photon| photon.flux.max()).fold(0.0, f64::max);
        let mut grid = Self {
            columns: Columns {
                places: [const { Vec::new() }; 3],
                on: Vec::new(),
                fluxes: [const { Vec::new() }; C],
                starts: vec![0, 0],
            },
            unit_lm: if brightest > 0.0 { brightest } else { 1.0 },
            origin: DVec3::ZERO,
            per_metre: 0.0,
            dimensions: [1; 3],
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
        let mut columns = Columns {
            places: [(); 3].map(|()| vec![0.0; filled]),
            on: vec![0; filled],
            fluxes: [(); C].map(|()| vec![0.0; filled]),
            starts,
        };
        let per_unit = 1.0 / grid.unit_lm;
        for (photon, cell) in photons.iter().zip(&cells) {
            let place = &mut next[*cell as usize];
            let at = *place as usize;
            *place += 1;
            let relative = photon.position - low;
            (0..3).for_each(|axis| columns.places[axis][at] = relative[axis] as f32);
            (0..C).for_each(|channel| columns.fluxes[channel][at] = (photon.flux.0[channel] * per_unit) as f32);
            columns.on[at] = photon.on.number();
        }
        grid.columns = columns;
        grid
    }

    /// Returns the position in metres and the flux in lm of all photons, in the order of their cells.
    pub fn photons(&self) -> impl Iterator<Item = (DVec3, Spectrum<C>)> {
        (0..self.len()).map(|at| (self.origin + self.place(at), self.flux(at)))
    }

    /// Sums the flux in lm of the photons that lie `on` a surface within `radius` m of a point, and within half that area; also returns
    /// their number in the whole.
    pub fn gather(&self, centre: DVec3, radius: f64, on: On) -> (Spectrum<C>, Spectrum<C>, u64) {
        let radius_squared = radius * radius;
        let ball = Ball {
            centre: (centre - self.origin).to_array().map(|component| component as f32),
            radius_squared: radius_squared as f32,
            half_squared: (0.5 * radius_squared) as f32,
            on: on.number(),
        };
        let [low, high] = [centre - radius, centre + radius].map(|corner| self.coordinates(corner));
        let [across, down, _] = self.dimensions;
        let number = |[x, y, z]: [usize; 3]| (z * down + y) * across + x;
        let first = number(low);
        let rows = Rows {
            first,
            end: first + high[0] - low[0] + 1,
            counts: [high[1] - low[1] + 1, high[2] - low[2] + 1],
            strides: [across, across * down],
        };
        let BallSums { whole, half, count } = within(&self.columns, rows, ball);
        let [whole, half] = [whole, half].map(|flux| Spectrum(flux.map(|flux| flux * self.unit_lm)));
        (whole, half, count)
    }

    /// Calls `f` with the identifier's number, the flux in lm and the squared distance in m2 of every photon within `radius` m of a point.
    #[inline]
    pub fn for_each_within(&self, centre: DVec3, radius: f64, mut f: impl FnMut(u32, Spectrum<C>, f64)) {
        let (relative, radius_squared) = (centre - self.origin, radius * radius);
        let [low, high] = [centre - radius, centre + radius].map(|corner| self.coordinates(corner));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                // cells of a row follow each other
                let row = (z * self.dimensions[1] + y) * self.dimensions[0];
                let starts = &self.columns.starts;
                for at in starts[row + low[0]] as usize..starts[row + high[0] + 1] as usize {
                    let distance_squared = (self.place(at) - relative).length_squared();
                    if distance_squared < radius_squared {
                        f(self.columns.on[at], self.flux(at), distance_squared);
                    }
                }
            }
        }
    }

    fn len(&self) -> usize {
        self.columns.starts.last().map_or(0, |end| *end as usize)
    }

    /// Returns the position of a photon in metres relative to `origin`.
    fn place(&self, at: usize) -> DVec3 {
        DVec3::from_array(self.columns.places.each_ref().map(|of| f64::from(of[at])))
    }

    fn flux(&self, at: usize) -> Spectrum<C> {
        Spectrum(self.columns.fluxes.each_ref().map(|of| f64::from(of[at]) * self.unit_lm))
    }

    fn cell(&self, position: DVec3) -> usize {
        let [x, y, z] = self.coordinates(position);
        (z * self.dimensions[1] + y) * self.dimensions[0] + x
    }

    /// Returns the cell coordinates of a position, clamped to the grid.
    fn coordinates(&self, position: DVec3) -> [usize; 3] {
        let scaled = ((position - self.origin) * self.per_metre).max(DVec3::ZERO);
        std::array::from_fn(|axis| (scaled[axis] as usize).min(self.dimensions[axis] - 1))
    }
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

    /// Every photon is counted once, for few and many photons, near borders and beyond them.
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
}
