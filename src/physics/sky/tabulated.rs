//! Luminance of a sky from nearly exact tables, for light that is followed in many directions.
//!
//! A luminance is a product of a function of the height and one of the distance from the sun, each with an exponential. Between even
//! steps either is nearly a cubic; toward the far side of the sky the distance is taken from the point opposite the sun, about which the
//! function is smooth. The error of the cubics is estimated by cubics through every second value, which are 16 times as far off; a sky
//! with too large an error in any of its tables is computed from its formula.

use std::f64::consts::SQRT_2;

use glam::DVec3;

use super::Sky;

/// Number of steps of the height. `DISTANCES` is that of the distance from the sun and from the opposite point, measured as the length of
/// the difference of unit vectors.
const HEIGHTS: usize = 512;
const DISTANCES: usize = 128;

/// Largest relative error of a table: a thousandth of the error of the most accurate jobs.
const LARGEST_ERROR: f64 = 1e-6;

/// A sky with tables of its luminance.
///
/// ```
/// use skyduct_physics::sky::tabulated::TabulatedSky;
/// use skyduct_physics::sky::{CieType, Sky, SkyDistribution, direction};
///
/// let distribution = SkyDistribution::new(CieType::new(12).unwrap(), direction(0.6, 2.0));
/// let sky = Sky::new(distribution, 3000.0);
/// let (tabulated, toward) = (TabulatedSky::new(sky.clone()), direction(0.3, 1.0));
/// assert!((tabulated.luminance(toward) / sky.luminance(toward) - 1.0).abs() < 2e-6);
/// ```
#[derive(Clone, Debug)]
pub struct TabulatedSky {
    sky: Sky,
    tables: Option<Tables>,
}

#[derive(Clone, Debug)]
struct Tables {
    sun: DVec3,
    /// Factor in cd/m2, over the height z.
    of_height: Table,
    /// Factors over the distance from the sun, and from the opposite point.
    of_distance: [Table; 2],
}

impl TabulatedSky {
    /// Computes the tables of an open sky.
    pub fn new(sky: Sky) -> Self {
        let Sky { distribution, zenith_luminance_cd_m2, .. } = &sky;
        let tables = Tables {
            sun: distribution.sun(),
            of_height: Table::new(HEIGHTS, 1.0, |z| zenith_luminance_cd_m2 * distribution.of_height(z)),
            of_distance: [
                Table::new(DISTANCES, SQRT_2, |chord| distribution.of_distance(chord)),
                Table::new(DISTANCES, SQRT_2, |chord| distribution.of_distance((4.0 - chord * chord).max(0.0).sqrt())),
            ],
        };
        let [near, far] = &tables.of_distance;
        let is_near = [&tables.of_height, near, far].iter().all(|table| table.error() <= LARGEST_ERROR);
        let tables = is_near.then_some(tables);
        Self { sky, tables }
    }

    /// Returns the luminance in cd/m2 toward a unit vector, zero below the horizon, with a relative error below 2e-6.
    #[inline]
    pub fn luminance(&self, direction: DVec3) -> f64 {
        let Some(Tables { sun, of_height, of_distance }) = &self.tables else { return self.sky.luminance(direction) };
        if direction.z < 0.0 {
            return 0.0;
        }
        // a branch would often be mispredicted
        let is_far = usize::from(sun.dot(direction) < 0.0);
        let from = *sun * [1.0, -1.0][is_far];
        of_height.at(direction.z) * of_distance[is_far].at((direction - from).length())
    }
}

/// A function tabulated at even steps from 0 on, and interpolated by cubics through four of its values.
#[derive(Clone, Debug)]
struct Table {
    values: Vec<f64>,
    steps_per_unit: f64,
}

impl Table {
    fn new(steps: usize, end: f64, of: impl Fn(f64) -> f64) -> Self {
        let steps_per_unit = steps as f64 / end;
        Self { values: (0..=steps).map(|step| of(step as f64 / steps_per_unit)).collect(), steps_per_unit }
    }

    #[inline]
    fn at(&self, argument: f64) -> f64 {
        let place = argument * self.steps_per_unit;
        let first = (place as usize).clamp(1, self.values.len() - 3) - 1;
        match self.values[first..] {
            [a, b, c, d, ..] => cubic([a, b, c, d], place - first as f64),
            _ => f64::NAN,
        }
    }

    /// Estimates the largest relative error, from that of cubics through every second value at the values between.
    fn error(&self) -> f64 {
        let mut largest: f64 = 0.0;
        for number in (1..self.values.len() - 1).step_by(2) {
            let first = number.saturating_sub(3).min(self.values.len() - 7);
            let through = [0, 2, 4, 6].map(|after| self.values[first + after]);
            let found = cubic(through, 0.5 * (number - first) as f64);
            // not a number counts as an infinite error
            largest = largest.max((found / self.values[number] - 1.0).abs() / 16.0);
            if found.is_nan() {
                return f64::INFINITY;
            }
        }
        largest
    }
}

/// Evaluates the cubic through values at 0, 1, 2 and 3.
#[inline]
fn cubic([a, b, c, d]: [f64; 4], place: f64) -> f64 {
    let [from_0, from_1, from_2, from_3] = [place, place - 1.0, place - 2.0, place - 3.0];
    let (outer, inner) = (from_0 * from_3, from_1 * from_2);
    (d * from_0 - a * from_3) * inner * (1.0 / 6.0) + (b * from_2 - c * from_1) * outer * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::{CieType, SkyDistribution, direction};

    /// Luminances from tables are within 2e-6 of every sky of the CIE, all over the dome, next to the sun and at the horizon, and no sky
    /// falls back to its formula.
    #[test]
    fn luminances_are_within_what_is_said() {
        for cie_type in CieType::all() {
            for altitude in [0.0, 0.3, 1.2, 1.57] {
                let distribution = SkyDistribution::new(cie_type, direction(altitude, 1.0));
                let sky = Sky::new(distribution, 5000.0);
                let tabulated = TabulatedSky::new(sky.clone());
                assert!(tabulated.tables.is_some(), "{cie_type:?}");
                let dome = (0..150)
                    .flat_map(|high| (0..60).map(move |round| (0.01 * f64::from(high), 0.105 * f64::from(round))));
                let beside_sun = (0..60).map(|round| (altitude + 1e-3, 1.0 + 1e-4 * f64::from(round)));
                let low = (0..60).map(|round| (5e-4 * f64::from(round), 0.105 * f64::from(round)));
                for (altitude, azimuth) in dome.chain(beside_sun).chain(low) {
                    let toward = direction(altitude, azimuth);
                    let (found, exact) = (tabulated.luminance(toward), sky.luminance(toward));
                    assert!((found / exact - 1.0).abs() < 2e-6, "{cie_type:?} {toward}: {found} {exact}");
                }
                assert_eq!(tabulated.luminance(DVec3::NEG_Z), 0.0);
            }
        }
    }

    #[test]
    fn cubics_are_exact() {
        let of = |x: f64| 2.0 - x * (3.0 - x * (0.5 + 4.0 * x));
        let table = Table::new(8, 2.0, of);
        for place in 0..=40 {
            let x = 0.05 * f64::from(place);
            assert!((table.at(x) - of(x)).abs() < 1e-13, "{x}");
        }
        assert!(table.error() < 1e-13);
        // a step is no cubic
        assert!(Table::new(8, 2.0, |x| if x < 1.0 { 1.0 } else { 2.0 }).error() > 1e-3);
    }
}
