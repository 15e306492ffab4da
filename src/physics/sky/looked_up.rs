//! Luminance of a sky interpolated in tables, for many directions of which none needs to be exact.

use glam::DVec3;

use super::{Sky, SkyDistribution};

/// Number of equal intervals of the distance from the sun, and of the height, in which the luminance is interpolated linearly, with a
/// relative error below 2e-3.
const INTERVALS: usize = 256;

/// Factor of a luminance that depends on the distance from the sun.
#[derive(Clone, Debug)]
pub(super) struct OfDistance([f64; INTERVALS + 1]);

impl OfDistance {
    pub(super) fn new(distribution: &SkyDistribution) -> Self {
        Self(std::array::from_fn(|k| distribution.of_distance(2.0 * k as f64 / INTERVALS as f64)))
    }

    /// Interpolates the factor; `chord`: length of the difference of the unit vectors toward the sun and the sky, 0..=2.
    #[inline]
    pub(super) fn at(&self, chord: f64) -> f64 {
        between(&self.0, 0.5 * chord)
    }
}

/// Tables of the luminance of a sky in all directions, with a relative error below 2e-3.
///
/// ```
/// use skyduct_physics::sky::{CieType, Sky, SkyDistribution, direction};
/// use skyduct_physics::sky::looked_up::LookedUp;
///
/// let distribution = SkyDistribution::new(CieType::new(12).unwrap(), direction(0.6, 2.0));
/// let sky = Sky::new(distribution, 3000.0);
/// let (looked_up, toward) = (LookedUp::new(&sky), direction(0.3, 1.0));
/// assert!((looked_up.luminance(toward) / sky.luminance(toward) - 1.0).abs() < 2e-3);
/// ```
#[derive(Clone, Debug)]
pub struct LookedUp {
    of_distance: OfDistance,
    /// Factor that depends on the height, in cd/m2.
    of_height: [f64; INTERVALS + 1],
    sky: Sky,
}

impl LookedUp {
    /// Computes the tables of a sky.
    pub fn new(sky: &Sky) -> Self {
        let Sky { distribution, zenith_luminance_cd_m2, .. } = sky;
        let at = |k: usize| zenith_luminance_cd_m2 * distribution.of_height(k as f64 / INTERVALS as f64);
        let of_distance = OfDistance::new(distribution);
        Self { of_distance, of_height: std::array::from_fn(at), sky: sky.clone() }
    }

    /// Interpolates the luminance in cd/m2 toward a unit vector; without surroundings zero below the horizontal.
    pub fn luminance(&self, direction: DVec3) -> f64 {
        if let Some(luminance) = self.sky.in_front(direction) {
            return luminance;
        }
        if direction.z < 0.0 {
            return 0.0;
        }
        let chord = (direction - self.sky.distribution.sun()).length();
        between(&self.of_height, direction.z) * self.of_distance.at(chord)
    }
}

/// Interpolates a table linearly at a place 0..=1 along it.
#[inline]
fn between(table: &[f64; INTERVALS + 1], place: f64) -> f64 {
    let place = place * INTERVALS as f64;
    let first = (place as usize).min(INTERVALS - 1);
    table[first] + (place - first as f64) * (table[first + 1] - table[first])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::{CieType, direction};

    /// Luminances from tables agree with those of every sky within 2e-3, all over the dome and next to the sun.
    #[test]
    fn luminances_that_are_looked_up_are_near() {
        for cie_type in CieType::all() {
            for altitude in [0.0, 0.3, 1.2] {
                let distribution = SkyDistribution::new(cie_type, direction(altitude, 1.0));
                let sky = Sky::new(distribution, 5000.0);
                let looked_up = LookedUp::new(&sky);
                for (high, round) in (0..50).flat_map(|high| (0..60).map(move |round| (high, round))) {
                    let toward = direction(0.0314 * f64::from(high), 0.105 * f64::from(round));
                    let (found, exact) = (looked_up.luminance(toward), sky.luminance(toward));
                    assert!((found / exact - 1.0).abs() < 2e-3, "{cie_type:?} {altitude} {toward}: {found} {exact}");
                }
            }
        }
        let sky = Sky::new(SkyDistribution::new(CieType::UNIFORM, DVec3::Z), 1.0);
        assert_eq!(LookedUp::new(&sky).luminance(DVec3::NEG_Z), 0.0);
    }
}
