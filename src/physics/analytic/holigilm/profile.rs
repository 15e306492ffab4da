//! Exitance of a diffuser's Lambertian zone in rings and sectors, and the illuminance from it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::geometry::disc::disc_irradiance;
use crate::geometry::turn::unit_vector;

/// Number of rings of equal area in a profile; `SECTORS` is that of sectors of equal angle.
pub const RINGS: usize = 16;
pub const SECTORS: usize = 16;

/// Largest number of points per edge into which a cell is divided where a receiver is near.
const MOST_SPLIT: f64 = 8.0;

/// Exitance in lm/m2 between two circles around the centre of the opening.
#[derive(Clone, Debug)]
pub struct Profile {
    inner: f64,
    outer: f64,
    rings: usize,
    sectors: usize,
    /// Values ring by ring from the inside; sectors counter-clockwise from +x.
    exitance: Vec<f64>,
}

/// The cells of the zone between `inner` and `outer` metres from the centre.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    pub inner: f64,
    pub outer: f64,
}

impl Cells {
    /// Returns the number of the cell that holds a point, measured from the centre.
    pub fn at(&self, point: DVec2) -> usize {
        let (from, to) = (self.inner * self.inner, self.outer * self.outer);
        let fraction = ((point.length_squared() - from) / (to - from)).clamp(0.0, 1.0);
        let turn = libm::atan2(point.y, point.x).rem_euclid(TAU) / TAU;
        let index = |fraction: f64, count: usize| ((fraction * count as f64) as usize).min(count - 1);
        index(fraction, RINGS) * SECTORS + index(turn, SECTORS)
    }

    /// Computes the area of the zone in m2.
    pub fn area(&self) -> f64 {
        PI * (self.outer - self.inner) * (self.outer + self.inner)
    }

    /// Builds the profile of the exitance from the `flux` that leaves each cell, in lm.
    pub fn profile(&self, flux: &[f64]) -> Profile {
        let cell = self.area() / (RINGS * SECTORS) as f64;
        let exitance = flux.iter().map(|flux| flux / cell).collect();
        Profile { inner: self.inner, outer: self.outer, rings: RINGS, sectors: SECTORS, exitance }
    }
}

impl Profile {
    /// Computes the mean of profiles of one zone; `None` without any.
    pub fn mean<'a>(profiles: impl Iterator<Item = &'a Self>) -> Option<Self> {
        let mut count = 0.0;
        let sum = profiles.cloned().reduce(|mut sum, profile| {
            sum.exitance.iter_mut().zip(&profile.exitance).for_each(|(sum, value)| *sum += value);
            count += 1.0;
            sum
        });
        sum.map(|mut sum| {
            sum.exitance.iter_mut().for_each(|value| *value /= count + 1.0);
            sum
        })
    }

    /// Returns the profile with rings and sectors of twice the size, and the same flux.
    pub fn coarse(&self) -> Self {
        let (rings, sectors) = (self.rings / 2, self.sectors / 2);
        let mut exitance = vec![0.0; rings * sectors];
        for (cell, value) in self.exitance.iter().enumerate() {
            exitance[cell / self.sectors / 2 * sectors + cell % self.sectors / 2] += 0.25 * value;
        }
        Self { rings, sectors, exitance, ..self.clone() }
    }

    /// Computes the illuminance in lux of an element with unit `normal` at `offset` from the axis and `depth` > 0 below the opening; the
    /// element's horizon must not cut the zone.
    ///
    /// The mean of each ring acts as a difference of discs in closed form; the deviations of its sectors from the mean act as points.
    pub fn illuminance(&self, offset: DVec2, depth: f64, normal: DVec3) -> f64 {
        let distance = offset.length();
        let inward = if distance > 0.0 { -offset / distance } else { DVec2::ZERO };
        let across = normal.truncate().dot(inward);
        let disc = |radius: f64| {
            let seen = disc_irradiance(radius, depth, distance);
            normal.z * seen.vertical + across * seen.toward_axis
        };
        let split = (self.outer / depth).ceil().clamp(1.0, MOST_SPLIT) as usize;
        let per_cell = PI * (self.outer - self.inner) * (self.outer + self.inner)
            / (self.rings * self.sectors * split * split) as f64;
        let mut sum = 0.0;
        let mut inside = if self.inner > 0.0 { disc(self.inner) } else { 0.0 };
        for (ring, sectors) in self.exitance.chunks_exact(self.sectors).enumerate() {
            let outside = disc(self.radius((ring + 1) as f64));
            let mean = sectors.iter().sum::<f64>() / self.sectors as f64;
            sum += mean * (outside - inside);
            inside = outside;
            for (sector, value) in sectors.iter().enumerate().filter(|(_, value)| **value != mean) {
                let mut seen = 0.0;
                for k in 0..split * split {
                    let part = |k: usize| (k as f64 + 0.5) / split as f64;
                    let radius = self.radius(ring as f64 + part(k / split));
                    let angle = TAU * (sector as f64 + part(k % split)) / self.sectors as f64;
                    let to_source = (unit_vector(angle) * radius - offset).extend(depth);
                    let squared = to_source.length_squared();
                    seen += depth * to_source.dot(normal).max(0.0) / (squared * squared);
                }
                sum += (value - mean) * per_cell / PI * seen;
            }
        }
        sum
    }

    /// Computes the flux that leaves the zone, in lm.
    pub fn flux(&self) -> f64 {
        let area = PI * (self.outer - self.inner) * (self.outer + self.inner);
        self.exitance.iter().sum::<f64>() * area / self.exitance.len() as f64
    }

    /// Returns the radius at which `ring` rings of equal area end.
    fn radius(&self, ring: f64) -> f64 {
        let (from, to) = (self.inner * self.inner, self.outer * self.outer);
        (from + (to - from) * ring / self.rings as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A zone of one exitance is the difference of two discs to rounding, wherever the cells' borders run.
    #[test]
    fn uniform_zones_are_exact() {
        for inner in [0.0, 0.06] {
            let cells = Cells { inner, outer: 0.127 };
            let profile = cells.profile(&vec![2.0; RINGS * SECTORS]);
            assert!((profile.flux() - 512.0).abs() < 1e-10);
            for (offset, depth) in [(0.0, 2.0), (0.7, 2.0), (0.1, 0.01)] {
                let disc = |radius: f64| disc_irradiance(radius, depth, offset).vertical;
                let exact = 512.0 / cells.area() * (disc(0.127) - if inner > 0.0 { disc(inner) } else { 0.0 });
                let value = profile.illuminance(DVec2::new(0.0, offset), depth, DVec3::Z);
                assert!((value / exact - 1.0).abs() < 1e-12, "{value} {exact}");
            }
        }
    }

    /// All light in one cell acts like a small source there: within 2 % of the inverse-square law at 1 m.
    #[test]
    fn a_cell_stands_where_it_is() {
        let cells = Cells { inner: 0.0, outer: 0.127 };
        let place = DVec2::new(0.05, 0.09);
        let mut flux = vec![0.0; RINGS * SECTORS];
        flux[cells.at(place)] = 100.0;
        let profile = cells.profile(&flux);
        for offset in [DVec2::ZERO, DVec2::new(0.4, 0.6), DVec2::new(-0.8, 0.2)] {
            let squared = (place - offset).length_squared() + 1.0;
            let law = 100.0 / PI / (squared * squared);
            let value = profile.illuminance(offset, 1.0, DVec3::Z);
            assert!((value / law - 1.0).abs() < 0.02, "{value} {law}");
        }
    }
}
