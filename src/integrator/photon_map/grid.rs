//! Photons sorted into a dense grid of cells, for gathering within a fixed radius.

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

/// Photons in the order of their cells; within a cell in the order in which they were traced.
#[derive(Debug)]
pub struct PhotonGrid<const C: usize, On = SurfaceId> {
    photons: Vec<Photon<C, On>>,
    /// First photon of each cell, and the end.
    starts: Vec<u32>,
    origin: DVec3,
    per_metre: f64,
    dimensions: [usize; 3],
}

impl<const C: usize, On: Copy + PartialEq> PhotonGrid<C, On> {
    /// Sorts photons (by counting) into cells of about `radius` metres.
    pub fn new(photons: &[Photon<C, On>], radius: f64) -> Self {
        let bounds = |f: fn(DVec3, DVec3) -> DVec3, start| photons.iter().map(|p| p.position).fold(start, f);
        let (low, high) = (bounds(DVec3::min, DVec3::INFINITY), bounds(DVec3::max, DVec3::NEG_INFINITY));
        if photons.is_empty() {
            let starts = vec![0, 0];
            return Self { photons: Vec::new(), starts, origin: DVec3::ZERO, per_metre: 0.0, dimensions: [1; 3] };
        }
        let extent = high - low;
        let mut cell = radius;
        let count = |cell: f64| (extent / cell).floor() + 1.0;
        while count(cell).element_product() > MAX_CELLS {
            cell *= 1.26;
        }
        let dimensions = count(cell).to_array().map(|n| n as usize);
        let mut grid = Self { photons: Vec::new(), starts: Vec::new(), origin: low, per_metre: 1.0 / cell, dimensions };
        let cells: Vec<u32> = photons.iter().map(|photon| grid.cell(photon.position) as u32).collect();
        let mut starts = vec![0u32; dimensions.iter().product::<usize>() + 1];
        for cell in &cells {
            starts[*cell as usize + 1] += 1;
        }
        for index in 1..starts.len() {
            starts[index] += starts[index - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0u32; photons.len()];
        for (index, cell) in cells.iter().enumerate() {
            let place = &mut next[*cell as usize];
            order[*place as usize] = index as u32;
            *place += 1;
        }
        grid.photons = order.iter().map(|index| photons[*index as usize]).collect();
        grid.starts = starts;
        grid
    }

    /// All photons, in the order of their cells.
    pub fn photons(&self) -> &[Photon<C, On>] {
        &self.photons
    }

    /// Flux of what lies `on` something within `radius` of a point, and within the half of that area, in lm, and the number of photons in
    /// the whole.
    pub fn gather(&self, centre: DVec3, radius: f64, on: On) -> (Spectrum<C>, Spectrum<C>, u64) {
        let (mut whole, mut half, mut count) = (Spectrum::ZERO, Spectrum::ZERO, 0);
        let half_squared = 0.5 * (radius * radius);
        self.for_each_within(centre, radius, |photon, distance_squared| {
            if photon.on == on {
                whole += photon.flux;
                count += 1;
                if distance_squared < half_squared {
                    half += photon.flux;
                }
            }
        });
        (whole, half, count)
    }

    /// Calls `f` with every photon within `radius` of a point and its squared distance.
    #[inline]
    pub fn for_each_within(&self, centre: DVec3, radius: f64, mut f: impl FnMut(&Photon<C, On>, f64)) {
        let radius_squared = radius * radius;
        let low = self.coordinates(centre - radius);
        let high = self.coordinates(centre + radius);
        if self.photons.is_empty() {
            return;
        }
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                // cells of a row follow each other
                let row = (z * self.dimensions[1] + y) * self.dimensions[0];
                let from = self.starts[row + low[0]] as usize;
                let to = self.starts[row + high[0] + 1] as usize;
                for photon in &self.photons[from..to] {
                    let distance_squared = (photon.position - centre).length_squared();
                    if distance_squared < radius_squared {
                        f(photon, distance_squared);
                    }
                }
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};

    /// Every photon counts once, for few and many, near borders and beyond them.
    #[test]
    fn gathers_what_brute_force_gathers() {
        let mut random = PathRandom::new(Key::new(4));
        let mut point = || DVec3::new(random.uniform() * 4.0, random.uniform() * 3.0, random.uniform());
        for count in [0, 1, 25, 3000] {
            let photons: Vec<Photon<1, usize>> =
                (0..count).map(|k| Photon { position: point(), on: k % 2, flux: Spectrum([1.0]) }).collect();
            for radius in [0.01, 0.3, 2.0, 10.0] {
                let grid = PhotonGrid::new(&photons, radius);
                for _ in 0..50 {
                    let centre = point() * 1.2 - 0.3;
                    let within = |r_squared: f64| {
                        let near =
                            |p: &&Photon<1, usize>| (p.position - centre).length_squared() < r_squared && p.on == 1;
                        photons.iter().filter(near).count() as f64
                    };
                    let (whole, half, count) = grid.gather(centre, radius, 1);
                    assert_eq!(whole.0[0], within(radius * radius));
                    assert_eq!(count as f64, whole.0[0]);
                    assert_eq!(half.0[0], within(0.5 * radius * radius));
                }
            }
        }
    }
}
