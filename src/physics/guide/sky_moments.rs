//! Throughput of any sky through straight tubes, by integrals over the zenith angle that are computed once per sky.

use std::f64::consts::{FRAC_PI_2, PI};
use std::num::NonZeroUsize;

use gauss_quad::GaussLegendre;

use super::transmittance::{ROUGH, through_straight};
use crate::sky::{Sky, direction};

/// Number of zenith angle panels from the zenith to the horizon, with the sun at the border of two.
const PANELS: usize = 32;

/// Number of quadrature nodes along half a circle of azimuths.
const AZIMUTHS: usize = 24;

/// Degree of the polynomials that represent the integrals within a panel.
const DEGREE: usize = 6;

/// Distribution of the light of a sky over zenith angles.
///
/// With the luminance integrated over the azimuths, R(Z), and t = tan Z these are the integrals from the zenith to Z of R sin Z cos Z dZ
/// and R sin^2 Z dZ. They give the light that passes a tube in which it meets the mirror every 1 / (b t) of the length
/// (docs/physics/tubes.md#transmission-of-a-sky). Relative error below 1e-5.
#[derive(Clone, Debug)]
pub struct SkyMoments {
    panels: Vec<Panel>,
    /// Number of panels between the zenith and the sun; `widths` are the widths in radians of these panels and of the others.
    above: usize,
    widths: [f64; 2],
}

/// Integrals within a panel, as coefficients of polynomials in the position within it (0..1).
#[derive(Clone, Debug)]
struct Panel {
    level: [f64; DEGREE + 1],
    upright: [f64; DEGREE + 1],
}

impl SkyMoments {
    /// Computes the integrals of a sky from its luminance in some thousand directions.
    pub fn new(sky: &Sky) -> Self {
        let sun = sky.distribution.sun();
        let of_sun = libm::atan2(sun.truncate().length(), sun.z).clamp(0.0, FRAC_PI_2);
        let split = if sky.distribution.is_azimuthally_uniform() { FRAC_PI_2 } else { of_sun };
        // at least one on either side, where there is one
        let above = (PANELS as f64 * split / FRAC_PI_2).round() as usize;
        let above = above.clamp(usize::from(split > 0.0), PANELS - usize::from(split < FRAC_PI_2));
        let width = |length: f64, count: usize| if count > 0 { length / count as f64 } else { 0.0 };
        let widths = [width(split, above), width(FRAC_PI_2 - split, PANELS - above)];
        let ring = ring(sky);
        let mut panels: Vec<Panel> = Vec::with_capacity(PANELS);
        for number in 0..PANELS {
            let [before, after] = [number.min(above), number.saturating_sub(above)].map(|count| count as f64);
            let (from, width) = (before * widths[0] + after * widths[1], widths[usize::from(number >= above)]);
            let before = panels.last().map_or([0.0; 2], Panel::ends);
            panels.push(Panel::new(from, width, before, &ring));
        }
        Self { panels, above, widths }
    }

    /// Returns the horizontal illuminance in lux.
    pub fn horizontal_illuminance_lux(&self) -> f64 {
        self.panels.last().map_or(0.0, |last| last.ends()[0])
    }

    /// Computes the luminous flux of the sky through a vertical straight tube, per area of its cross-section, in lm/m2; `aspect` is its
    /// length over its diameter (>= 0), `reflectance` that per bounce in 0..=1.
    ///
    /// A uniform sky through an aspect ratio of 4 and a mirror of 98 % keeps 0.869927 of its light:
    ///
    /// ```
    /// use glam::DVec3;
    /// use skyduct_physics::guide::sky_moments::SkyMoments;
    /// use skyduct_physics::sky::{CieType, Sky, SkyDistribution};
    ///
    /// let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
    /// let sky = SkyMoments::new(&Sky::new(distribution, 1.0));
    /// let transmission = sky.through_straight(4.0, 0.98) / sky.horizontal_illuminance_lux();
    /// assert!((transmission - 0.869927).abs() < 5e-7);
    /// ```
    pub fn through_straight(&self, aspect: f64, reflectance: f64) -> f64 {
        if aspect == 0.0 || reflectance == 1.0 {
            return self.horizontal_illuminance_lux();
        }
        through_straight(aspect, reflectance, &ROUGH, |tangent| self.moment(tangent))
    }

    /// Computes the integral over t = tan Z from 0 to `tangent` of the sky's light per t, times `tangent` - t.
    fn moment(&self, tangent: f64) -> f64 {
        let angle = libm::atan(tangent);
        let [above, below] = self.widths;
        let split = above * self.above as f64;
        // panel, and position within it; rounding may lead to the end of the last one
        let (first, place) = if angle < split { (0, angle / above) } else { (self.above, (angle - split) / below) };
        let number = (first + place as usize).min(PANELS - 1);
        let [level, upright] = self.panels[number].at(place - (number - first) as f64);
        tangent * level - upright
    }
}

impl Panel {
    /// Integrates over the panel of a `width` that begins at the zenith angle `from`; the integrals up to there are given, and `ring` is
    /// the luminance integrated over the azimuths.
    fn new(from: f64, width: f64, [level, upright]: [f64; 2], ring: &impl Fn(f64) -> f64) -> Self {
        // zeros of Chebyshev's polynomial of the fourth degree
        let nodes: [f64; 4] = std::array::from_fn(|k| 0.5 - 0.5 * libm::cos(PI * (2 * k + 1) as f64 / 8.0));
        let at = nodes.map(|node| {
            let angle = from + width * node;
            let (sin, cos) = libm::sincos(angle);
            (ring(angle) * sin, sin, cos, angle)
        });
        let (mut panel_level, mut panel_upright) = ([0.0; DEGREE + 1], [0.0; DEGREE + 1]);
        // near the zenith the integrands are Z and Z^2 times a function that a cubic polynomial approximates well
        let powers = if from == 0.0 { [1, 2] } else { [0, 0] };
        for (to, power, values) in [
            (&mut panel_level, powers[0], at.map(|(light, _, cos, _)| light * cos)),
            (&mut panel_upright, powers[1], at.map(|(light, sin, ..)| light * sin)),
        ] {
            let values = std::array::from_fn(|k| values[k] / libm::pow(at[k].3, f64::from(power as u32)));
            let scale = libm::pow(width, f64::from(power as u32 + 1));
            for (degree, coefficient) in cubic(nodes, values).into_iter().enumerate() {
                let degree = degree + power + 1;
                to[degree] = coefficient * scale / degree as f64;
            }
        }
        panel_level[0] = level;
        panel_upright[0] = upright;
        Self { level: panel_level, upright: panel_upright }
    }

    /// Evaluates both integrals at a position (0..1) within the panel.
    fn at(&self, fraction: f64) -> [f64; 2] {
        [&self.level, &self.upright]
            .map(|of| of.iter().rev().fold(0.0, |sum, coefficient| sum * fraction + coefficient))
    }

    fn ends(&self) -> [f64; 2] {
        self.at(1.0)
    }
}

/// Returns the coefficients, by powers, of the cubic polynomial through four points, by Newton's divided differences.
fn cubic(nodes: [f64; 4], values: [f64; 4]) -> [f64; 4] {
    let mut divided = values;
    for order in 1..4 {
        for k in (order..4).rev() {
            divided[k] = (divided[k] - divided[k - 1]) / (nodes[k] - nodes[k - order]);
        }
    }
    let mut powers = [divided[3], 0.0, 0.0, 0.0];
    for k in (0..3).rev() {
        for degree in (1..4).rev() {
            powers[degree] = powers[degree - 1] - nodes[k] * powers[degree];
        }
        powers[0] = divided[k] - nodes[k] * powers[0];
    }
    powers
}

/// Returns the function that integrates the luminance of a sky over the azimuths at a zenith angle, in cd/m2 rad.
fn ring(sky: &Sky) -> impl Fn(f64) -> f64 {
    let uniform = sky.distribution.is_azimuthally_uniform();
    let sun = sky.distribution.sun();
    let of_sun = libm::atan2(sun.x, sun.y);
    let rule = GaussLegendre::new(NonZeroUsize::new(AZIMUTHS).unwrap_or(NonZeroUsize::MIN));
    // the luminance has a cusp at the sun: nodes crowd toward azimuth difference 0
    let node = |(node, weight): &(f64, f64)| {
        let u = 0.5 * (1.0 + node);
        (direction(0.0, of_sun + PI * u * u * u), 0.5 * weight * 6.0 * PI * u * u)
    };
    let nodes: Vec<_> = rule.as_node_weight_pairs().iter().map(node).collect();
    move |angle: f64| {
        let (sin, cos) = libm::sincos(angle);
        let luminance = |level: glam::DVec3| sky.luminance((sin * level).with_z(cos.max(0.0)));
        if uniform {
            return 2.0 * PI * luminance(glam::DVec3::Y);
        }
        nodes.iter().map(|(level, weight)| weight * luminance(*level)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guide::transmittance::{sky_exitance, uniform_sky_transmission};
    use crate::sky::{CieType, SkyDistribution};

    fn sky(number: u8, altitude_deg: f64) -> Sky {
        let sun = direction(altitude_deg.to_radians(), 0.7);
        let distribution = SkyDistribution::new(CieType::new(number).unwrap(), sun);
        Sky::new(distribution, 5000.0)
    }

    /// Compares with the quadrature over sky and kinks, which is exact to 1e-9 here: every type, high and low suns.
    #[test]
    fn skies_agree_with_quadrature() {
        for number in 1..=16 {
            for altitude in [0.0, 5.0, 35.0, 89.5, 90.0] {
                let sky = sky(number, altitude);
                let moments = SkyMoments::new(&sky);
                let horizontal = moments.horizontal_illuminance_lux() / sky.horizontal_illuminance_lux();
                assert!((horizontal - 1.0).abs() < 1e-5, "type {number} at {altitude}: {horizontal}");
                for (aspect, reflectance) in [(0.5, 0.98), (4.0, 0.98), (20.0, 0.9)] {
                    let ratio = moments.through_straight(aspect, reflectance) / sky_exitance(&sky, aspect, reflectance);
                    assert!((ratio - 1.0).abs() < 1e-5, "type {number} at {altitude}, {aspect} {reflectance}: {ratio}");
                }
            }
        }
    }

    /// Compares a uniform sky through bright and dull, short and very long tubes with its own closed form.
    #[test]
    fn long_and_dull_tubes() {
        let sky = sky(5, 35.0);
        let moments = SkyMoments::new(&sky);
        for aspect in [0.05, 1.0, 11.0, 100.0, 10_000.0] {
            for reflectance in [0.0, 0.5, 0.98, 0.9999, 1.0] {
                let found = moments.through_straight(aspect, reflectance) / sky.horizontal_illuminance_lux();
                let ratio = found / uniform_sky_transmission(aspect, reflectance);
                assert!((ratio - 1.0).abs() < 1e-6, "{aspect} {reflectance}: {ratio}");
            }
        }
        assert_eq!(moments.through_straight(0.0, 0.5), moments.horizontal_illuminance_lux());
    }

    #[test]
    fn a_cubic_curve_goes_through_its_points() {
        let curve = |x: f64| 2.0 + x * (-1.0 + x * (0.5 + 3.0 * x));
        let nodes = [0.1, 0.4, 0.7, 0.9];
        let found = cubic(nodes, nodes.map(curve));
        let expected = [2.0, -1.0, 0.5, 3.0];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}
