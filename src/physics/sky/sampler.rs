//! Importance sampling of directions toward a sky.
//!
//! Flux of a photon from a sky at infinity: docs/physics/sky_and_sun.md#sampling-the-sky.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Sky;
use super::looked_up::OfDistance;
use super::tabulated::TabulatedSky;
use crate::sampling::{CONES_SHARE, NestedCones};

/// Number of bands of equal height z; with `SECTORS` sectors of equal azimuth they form cells of equal solid angle.
const BANDS: usize = 64;
const SECTORS: usize = 128;

/// Fraction of the mean that is added to every cell, so that no direction with light has a vanishing density.
const FLOOR: f64 = 0.02;

/// Half-angle in radians below which cones about the zenith lie within the uppermost band.
const WITHIN_A_BAND: f64 = 0.17;

/// A piecewise constant density over the upper hemisphere, and over the lower one where light of the ground counts, proportional to
/// luminance times a weight.
///
/// Cells have equal solid angle. The density is exact: it is that of the sampled direction's own cell, and integrates to one; the
/// luminance is evaluated by the caller at the sampled direction, not taken from the cell. Where only light in a cone about the zenith
/// counts that is far narrower than a cell, most directions are drawn from the cone.
#[derive(Clone, Debug)]
pub struct SkySampler {
    /// Cones about the zenith from which most directions are drawn; `None` if the cells are fine enough.
    cones: Option<NestedCones>,
    /// Lowest height z of a direction as a positive number: 1 with the ground, else 0.
    depth: f64,
    /// Cumulative distribution over the bands, from the lowest.
    bands: Cumulative,
    /// Cumulative distribution over the sectors of each band.
    sectors: Vec<Cumulative>,
    /// Sine and cosine of the azimuth in the middle of each sector.
    middles: [(f64, f64); SECTORS],
}

/// A cumulative distribution over equal intervals, with a lookup table that starts the search near its end.
#[derive(Clone, Debug)]
struct Cumulative {
    /// Values from 0 to exactly 1.
    values: Vec<f64>,
    /// Number of the interval that holds k / LOOKUP.
    first: [u16; LOOKUP],
}

/// Number of entries of the lookup table.
const LOOKUP: usize = 128;

/// Luminances of an open sky at points of the samplers' cells, shared by all tubes under that sky.
#[derive(Clone, Debug)]
pub struct SkyTable {
    /// Luminances in cd/m2: two rows of points per band, and two points per sector in a row.
    luminances: Vec<f64>,
    /// Sine and cosine of the azimuth of each point of a row.
    azimuths: Vec<(f64, f64)>,
    /// Luminance of the sky in any direction.
    sky: TabulatedSky,
}

impl SkyTable {
    /// Tabulates the luminance of a sky without its surroundings at 2 x 2 points of every cell.
    pub fn new(sky: &Sky) -> Self {
        let (of_distance, sun) = (OfDistance::new(&sky.distribution), sky.distribution.sun());
        let azimuth = |place: usize| libm::sincos(TAU * (place as f64 + 0.5) / (2 * SECTORS) as f64);
        let azimuths = (0..2 * SECTORS).map(azimuth).collect();
        let mut table =
            Self { luminances: Vec::with_capacity(4 * BANDS * SECTORS), azimuths, sky: TabulatedSky::new(sky.open()) };
        for place in 0..2 * BANDS {
            let of_height = sky.zenith_luminance_cd_m2 * sky.distribution.of_height(height(place));
            for turn in 0..2 * SECTORS {
                let chord = (table.turned(place, turn) - sun).length();
                table.luminances.push(of_height * of_distance.at(chord));
            }
        }
        table
    }

    /// Returns the sky of the table, for the luminance of each direction that is sampled.
    #[inline]
    pub fn sky(&self) -> &TabulatedSky {
        &self.sky
    }

    /// Returns the luminance of the ground times a weight in the cells below the horizontal, from the lowest band; empty if the product
    /// vanishes everywhere.
    fn below(&self, luminance: f64, weight: impl Fn(DVec3) -> f64) -> Vec<f64> {
        if luminance == 0.0 {
            return Vec::new();
        }
        let mut cells = vec![0.0; BANDS * SECTORS];
        for (place, turn) in (0..2 * BANDS).flat_map(|place| (0..2 * SECTORS).map(move |turn| (place, turn))) {
            let above = self.turned(place, turn);
            cells[(BANDS - 1 - place / 2) * SECTORS + turn / 2] += luminance * weight(above.with_z(-above.z));
        }
        if cells.iter().all(|cell| *cell == 0.0) { Vec::new() } else { cells }
    }

    /// Returns the unit vector toward a point, given by the numbers of its row and of its azimuth.
    fn turned(&self, place: usize, turn: usize) -> DVec3 {
        let z = height(place);
        let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = self.azimuths[turn];
        DVec3::new(radius * sin, radius * cos, z)
    }
}

/// Returns the height z of a row of points.
fn height(place: usize) -> f64 {
    (place as f64 + 0.5) / (2 * BANDS) as f64
}

impl SkySampler {
    /// Builds a sampler of the sky's luminance times `weight`, the relative value of light from the unit vector toward the sky (>= 0,
    /// finite), e.g. the projected area times the transmission of what it enters. `None` when the product vanishes everywhere.
    pub fn new(sky: &Sky, weight: impl Fn(DVec3) -> f64) -> Option<Self> {
        Self::of_table(&SkyTable::new(sky), sky, weight)
    }

    /// Builds a sampler as [`SkySampler::new`] does, from luminances that were tabulated before for the open sky.
    pub fn of_table(table: &SkyTable, sky: &Sky, weight: impl Fn(DVec3) -> f64) -> Option<Self> {
        let below = table.below(sky.ground_luminance_cd_m2(), &weight);
        Self::weighted(table, sky, below, |_, toward| weight(toward))
    }

    /// Builds a sampler as [`SkySampler::of_table`] does, for a weight that is the same at all azimuths and zero below the horizontal; it
    /// is evaluated at azimuth 0.
    pub fn of_table_and_heights(table: &SkyTable, sky: &Sky, weight: impl Fn(DVec3) -> f64) -> Option<Self> {
        let heights: Vec<f64> = (0..2 * BANDS).map(|place| weight(toward(height(place), 0.0))).collect();
        Self::weighted(table, sky, Vec::new(), |place, _| heights[place])
    }

    /// Builds a sampler from the cells below the horizontal, if there are any; `weight` takes the number of a row of points above it and
    /// the unit vector.
    fn weighted(table: &SkyTable, sky: &Sky, ground: Vec<f64>, weight: impl Fn(usize, DVec3) -> f64) -> Option<Self> {
        let (below, mut cells) = (ground.len(), ground);
        cells.resize(below + BANDS * SECTORS, 0.0);
        for (place, row) in table.luminances.chunks(2 * SECTORS).enumerate() {
            for (turn, luminance) in row.iter().enumerate() {
                let cell = &mut cells[below + place / 2 * SECTORS + turn / 2];
                let toward = table.turned(place, turn);
                *cell += sky.in_front(toward).unwrap_or(*luminance) * weight(place, toward);
            }
        }
        let mean = cells.iter().sum::<f64>() / cells.len() as f64;
        if !(mean > 0.0 && mean.is_finite()) {
            return None;
        }
        cells.iter_mut().for_each(|cell| *cell += FLOOR * mean);
        let bands: Vec<f64> = cells.chunks(SECTORS).map(|row| row.iter().sum()).collect();
        let sectors = cells.chunks(SECTORS).map(Cumulative::new).collect();
        let middles = std::array::from_fn(|sector| libm::sincos(TAU * (sector as f64 + 0.5) / SECTORS as f64));
        let depth = if below > 0 { 1.0 } else { 0.0 };
        Some(Self { cones: None, depth, bands: Cumulative::new(&bands), sectors, middles })
    }

    /// Adds a cone of this half-angle (radians, > 0) about the zenith, and wider ones up to the width of the cells there, from which most
    /// directions are drawn; `None` leaves the sampler without cones.
    pub fn with_cone(self, half_angle: Option<f64>) -> Self {
        Self { cones: half_angle.map(|half_angle| NestedCones::new(half_angle, WITHIN_A_BAND)), ..self }
    }

    /// Samples a unit vector toward the sky, and returns its density per sr; continuous in the point `[u, v]` within cells and along them.
    #[inline]
    pub fn sample(&self, [u, v]: [f64; 2]) -> (DVec3, f64) {
        let Some(cones) = &self.cones else { return self.sample_cells([u, v]) };
        let (toward, of_cells) = if u < CONES_SHARE {
            let toward = cones.sample([u / CONES_SHARE, v]);
            (toward, self.density_of_cells(toward))
        } else {
            self.sample_cells([(u - CONES_SHARE) / (1.0 - CONES_SHARE), v])
        };
        (toward, mixed_density(toward, cones, of_cells))
    }

    #[inline]
    fn sample_cells(&self, [u, v]: [f64; 2]) -> (DVec3, f64) {
        let (band, height, band_probability) = self.bands.invert(u);
        let (sector, turn, sector_probability) = self.sectors[band].invert(v);
        let z = (band as f64 + height) / BANDS as f64 - self.depth;
        // on from the middle of the sector, by an angle below pi / SECTORS: the series' next terms are below 1e-17
        let (middle_sin, middle_cos) = self.middles[sector];
        let angle = TAU / SECTORS as f64 * (turn - 0.5);
        let y = angle * angle;
        let sin = angle * (1.0 - y * (1.0 / 6.0 - y * (1.0 / 120.0 - y * (1.0 / 5040.0))));
        let cos = 1.0 - y * (0.5 - y * (1.0 / 24.0 - y * (1.0 / 720.0 - y * (1.0 / 40320.0))));
        let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = (middle_sin * cos + middle_cos * sin, middle_cos * cos - middle_sin * sin);
        (DVec3::new(radius * sin, radius * cos, z), density(band_probability, sector_probability))
    }

    /// Returns the density per sr at a unit vector toward the sky; zero below the horizontal where no light of the ground counts.
    pub fn density(&self, direction: DVec3) -> f64 {
        let of_cells = self.density_of_cells(direction);
        self.cones.as_ref().map_or(of_cells, |cones| mixed_density(direction, cones, of_cells))
    }

    fn density_of_cells(&self, direction: DVec3) -> f64 {
        if direction.z < -self.depth {
            return 0.0;
        }
        let band = (((direction.z + self.depth) * BANDS as f64) as usize).min(self.sectors.len() - 1);
        let turn = libm::atan2(direction.x, direction.y).rem_euclid(TAU) / TAU;
        let sector = ((turn * SECTORS as f64) as usize).min(SECTORS - 1);
        density(self.bands.probability(band), self.sectors[band].probability(sector))
    }
}

/// Returns the density per sr of the mixture of cones and cells.
fn mixed_density(toward: DVec3, cones: &NestedCones, of_cells: f64) -> f64 {
    CONES_SHARE * cones.density(toward) + (1.0 - CONES_SHARE) * of_cells
}

/// Returns the unit vector at height `z` and azimuth `turn` of a full turn, clockwise from +y.
#[inline]
fn toward(z: f64, turn: f64) -> DVec3 {
    let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(TAU * turn);
    DVec3::new(radius * sin, radius * cos, z)
}

#[inline]
fn density(band_probability: f64, sector_probability: f64) -> f64 {
    band_probability * sector_probability * (BANDS * SECTORS) as f64 / TAU
}

impl Cumulative {
    /// Builds the distribution of `weights`: positive, at most 65 535 of them.
    fn new(weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        let mut values = vec![0.0];
        values.extend(weights.iter().map(|weight| {
            sum += weight;
            (sum / total).min(1.0)
        }));
        values[weights.len()] = 1.0;
        let mut index = 0;
        let first = std::array::from_fn(|k| {
            while values[index + 1] <= k as f64 / LOOKUP as f64 {
                index += 1;
            }
            index as u16
        });
        Self { values, first }
    }

    fn probability(&self, index: usize) -> f64 {
        self.values[index + 1] - self.values[index]
    }

    /// Finds the interval that holds `u` in 0..1, the position of `u` within it in 0..=1, and the interval's probability.
    #[inline]
    fn invert(&self, u: f64) -> (usize, f64, f64) {
        let count = self.values.len() - 1;
        let mut index = usize::from(self.first[((u * LOOKUP as f64) as usize).min(LOOKUP - 1)]);
        while index + 1 < count && self.values[index + 1] <= u {
            index += 1;
        }
        let probability = self.probability(index);
        let within = ((u - self.values[index]) / probability).clamp(0.0, 1.0);
        (index, within, probability)
    }
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    use super::*;
    use crate::sampling::{Key, PathRandom};
    use crate::sky::{CieType, SkyDistribution, direction};

    fn sky(number: u8, altitude_deg: f64) -> Sky {
        let sun = direction(altitude_deg.to_radians(), 0.7);
        let distribution = SkyDistribution::new(CieType::new(number).unwrap(), sun);
        Sky::new(distribution, 5000.0)
    }

    /// Chi-squared of 2e5 samples over all cells against the stated density, every type, sun at 5, 35 and 85 degrees;
    /// false alarm rate 1e-6 each (48 tests).
    #[test]
    fn samples_follow_the_stated_density() {
        let samples = 200_000;
        for number in 1..=16 {
            for altitude in [5.0, 35.0, 85.0] {
                let sampler = SkySampler::new(&sky(number, altitude), |d| d.z).unwrap();
                let mut counts = vec![0.0; BANDS * SECTORS];
                let mut random = PathRandom::new(Key::new(u64::from(number)).child(altitude as u64));
                for _ in 0..samples {
                    let (toward, density) = sampler.sample(random.uniform2());
                    assert!((sampler.density(toward) / density - 1.0).abs() < 1e-9 || toward.z < 1e-12);
                    let band = ((toward.z * BANDS as f64) as usize).min(BANDS - 1);
                    let turn = toward.x.atan2(toward.y).rem_euclid(TAU) / TAU;
                    counts[band * SECTORS + ((turn * SECTORS as f64) as usize).min(SECTORS - 1)] += 1.0;
                }
                // cells are pooled until each pool expects at least 10 samples
                let (mut statistic, mut pools, mut observed, mut expected) = (0.0, 0.0, 0.0, 0.0);
                for (index, count) in counts.iter().enumerate() {
                    let z = ((index / SECTORS) as f64 + 0.5) / BANDS as f64;
                    let turn = ((index % SECTORS) as f64 + 0.5) / SECTORS as f64;
                    observed += count;
                    expected += sampler.density(toward(z, turn)) * TAU / (BANDS * SECTORS) as f64 * f64::from(samples);
                    if expected >= 10.0 {
                        statistic += (observed - expected) * (observed - expected) / expected;
                        pools += 1.0;
                        (observed, expected) = (0.0, 0.0);
                    }
                }
                let limit = ChiSquared::new(pools - 1.0).unwrap().inverse_cdf(1.0 - 1e-6);
                assert!(statistic < limit, "type {number} at {altitude}: {statistic} > {limit}");
            }
        }
    }

    /// With a cone the density still integrates to one over the hemisphere (the mean of its inverse is 2 pi), the stated density is that
    /// of the direction, and the cone gets its fraction of the directions: 4 standard errors.
    #[test]
    fn a_narrow_cone_has_directions_of_its_own() {
        for half_angle in [1e-5, 1e-3, 0.1] {
            let sampler = SkySampler::new(&sky(5, 35.0), |d| d.z).unwrap().with_cone(Some(half_angle));
            let mut random = PathRandom::new(Key::new(12));
            let [mut inverse, mut inside, mut solid_angle] = [crate::statistics::Moments::default(); 3];
            for _ in 0..200_000 {
                let (toward, density) = sampler.sample(random.uniform2());
                assert!((sampler.density(toward) / density - 1.0).abs() < 1e-9 || toward.z < 1e-12);
                let within = toward.truncate().length() < half_angle.sin();
                inverse.push(1.0 / density);
                inside.push(if within { 1.0 } else { 0.0 });
                solid_angle.push(if within { 1.0 / density } else { 0.0 });
            }
            assert!((inverse.mean - TAU).abs() < 4.0 * inverse.standard_error(), "{half_angle}: {inverse:?}");
            // the narrowest has three quarters of the cones' directions, and some of the wider ones'
            let least = 0.75 * CONES_SHARE;
            assert!(inside.mean > least - 4.0 * inside.standard_error(), "{half_angle}: {inside:?}");
            let expected = 2.0 * TAU * (0.5 * half_angle).sin().powi(2);
            let error = solid_angle.standard_error();
            assert!((solid_angle.mean - expected).abs() < 4.0 * error && error < 0.01 * expected, "{solid_angle:?}");
        }
    }

    /// The tabulated luminance by which directions are chosen agrees with the sky's within 2e-3.
    #[test]
    fn the_table_has_the_luminance() {
        for number in 1..=16 {
            for altitude in [0.0, 35.0, 90.0] {
                let sky = sky(number, altitude);
                let table = SkyTable::new(&sky);
                for (point, luminance) in table.luminances.iter().enumerate() {
                    let toward = table.turned(point / (2 * SECTORS), point % (2 * SECTORS));
                    let ratio = luminance / sky.luminance(toward);
                    assert!((ratio - 1.0).abs() < 2e-3, "type {number} at {altitude}, {toward}: {ratio}");
                }
            }
        }
    }

    /// The estimate of the horizontal illuminance agrees with the quadrature within 4 standard errors.
    #[test]
    fn estimates_the_horizontal_illuminance() {
        for number in 1..=16 {
            let sky = sky(number, 35.0);
            let sampler = SkySampler::new(&sky, |d| d.z).unwrap();
            let mut random = PathRandom::new(Key::new(u64::from(number)));
            let mut moments = crate::statistics::Moments::default();
            for _ in 0..20_000 {
                let (toward, density) = sampler.sample(random.uniform2());
                moments.push(sky.luminance(toward) * toward.z / density);
            }
            let error = moments.mean - sky.horizontal_illuminance_lux();
            assert!(error.abs() < 4.0 * moments.standard_error(), "type {number}");
        }
    }
}
