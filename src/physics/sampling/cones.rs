//! Directions about an axis, for light that counts only within a narrow angle of it.

use std::f64::consts::TAU;

use glam::DVec3;

use super::warp;

/// Ratio of the half-angle of a cone to that of the next narrower one.
const STEP: f64 = 4.0;

/// Fraction of all directions that are sampled from cones, where others are sampled too.
pub const CONES_SHARE: f64 = 0.75;

/// Probability of the narrowest cone, if there are wider ones.
const NARROWEST_SHARE: f64 = 0.75;

/// Cones about +z, each four times as wide as the one before: a direction is sampled uniformly from one of them, three of four from the
/// narrowest.
///
/// The integrand falls off gradually beyond the narrowest cone: without the wider cones the rare directions there would have far too large
/// weights.
#[derive(Clone, Debug)]
pub struct NestedCones {
    /// Half-angle in radians and probability of each cone.
    cones: Vec<(f64, f64)>,
}

impl NestedCones {
    /// Creates cones of half-angles from `narrowest` to below `widest` radians, the first one in any case; both above 0 and below pi/2.
    pub fn new(narrowest: f64, widest: f64) -> Self {
        let half_angles = std::iter::successors(Some(narrowest), |half_angle| Some(STEP * half_angle));
        let half_angles: Vec<f64> = half_angles
            .enumerate()
            .take_while(|(k, half_angle)| *k == 0 || *half_angle < widest)
            .map(|(_, h)| h)
            .collect();
        let wider = half_angles.len() - 1;
        let first = if wider == 0 { 1.0 } else { NARROWEST_SHARE };
        let fraction = |k: usize| if k == 0 { first } else { (1.0 - first) / wider as f64 };
        Self { cones: half_angles.into_iter().enumerate().map(|(k, half_angle)| (half_angle, fraction(k))).collect() }
    }

    /// Samples a unit vector by a point of the unit square.
    pub fn sample(&self, [u, v]: [f64; 2]) -> DVec3 {
        let (mut from, last) = (0.0, self.cones.len() - 1);
        for (k, (half_angle, fraction)) in self.cones.iter().enumerate() {
            if k == last || u < from + fraction {
                return warp::cone([((u - from) / fraction).clamp(0.0, 1.0), v], *half_angle);
            }
            from += fraction;
        }
        DVec3::Z
    }

    /// Returns the probability density per sr of a unit vector.
    pub fn density(&self, direction: DVec3) -> f64 {
        if direction.z <= 0.0 {
            return 0.0;
        }
        let sine = direction.truncate().length();
        let of_cone = |(half_angle, fraction): &(f64, f64)| {
            let solid_angle = 2.0 * TAU * libm::sin(0.5 * half_angle).powi(2);
            if sine < libm::sin(*half_angle) { fraction / solid_angle } else { 0.0 }
        };
        self.cones.iter().map(of_cone).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};
    use crate::statistics::Moments;

    /// The mean of the inverse density within each cone is its solid angle (4 standard errors, below 2 % of it), which needs enough
    /// directions in each.
    #[test]
    fn densities_are_those_of_the_directions() {
        for (narrowest, widest) in [(1e-5, 0.1), (0.02, 0.1), (0.3, 0.1)] {
            let cones = NestedCones::new(narrowest, widest);
            let mut solid_angles = vec![Moments::default(); cones.cones.len()];
            let mut random = PathRandom::new(Key::new(3));
            for _ in 0..100_000 {
                let direction = cones.sample(random.uniform2());
                let density = cones.density(direction);
                assert!(density > 0.0 && (direction.length() - 1.0).abs() < 1e-12);
                for (solid_angle, (half_angle, _)) in solid_angles.iter_mut().zip(&cones.cones) {
                    let inside = direction.truncate().length() < half_angle.sin();
                    solid_angle.push(if inside { 1.0 / density } else { 0.0 });
                }
            }
            for (found, (half_angle, _)) in solid_angles.iter().zip(&cones.cones) {
                let expected = 2.0 * TAU * (0.5 * half_angle).sin().powi(2);
                let error = found.standard_error();
                assert!((found.mean - expected).abs() < 4.0 * error + 1e-9 * expected, "{half_angle}: {found:?}");
                assert!(error < 0.02 * expected, "{half_angle}: {found:?}");
            }
        }
    }
}
