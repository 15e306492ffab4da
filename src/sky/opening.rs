//! Light of a sky through a horizontal opening, as the roof openings of CIE 171 have it.

use std::num::NonZeroUsize;

use gauss_quad::GaussLegendre;
use glam::{DVec2, DVec3};

use super::Sky;

/// Panels along each side of the opening, of the finer of two rules.
const PANELS: usize = 64;

/// Degree of the Gauss-Legendre rule in each panel.
const DEGREE: usize = 6;

/// Illuminance in lux from the sky alone at `point`, on a surface with the unit `normal`, through a rectangle of no
/// thickness; and an estimate of its numerical error.
///
/// `corner`: the rectangle's corner of least x and y, above the point; `size` along x and y, all in metres. The integral
/// of L cos(theta) cos(theta') / d^2 over the rectangle by a composite Gauss rule; the error is the difference to the rule
/// of half as many panels.
pub fn illuminance_through_rectangle(sky: &Sky, corner: DVec3, size: DVec2, point: DVec3, normal: DVec3) -> (f64, f64) {
    let rule = GaussLegendre::new(NonZeroUsize::new(DEGREE).unwrap_or(NonZeroUsize::MIN));
    let nodes = rule.as_node_weight_pairs();
    let integral = |panels: usize| {
        let panel = size / panels as f64;
        let mut sum = 0.0;
        for row in 0..panels {
            for column in 0..panels {
                let low = corner.truncate() + DVec2::new(column as f64, row as f64) * panel;
                for (x, weight_x) in nodes {
                    for (y, weight_y) in nodes {
                        let within = low + panel * DVec2::new(0.5 * (1.0 + x), 0.5 * (1.0 + y));
                        let way = within.extend(corner.z) - point;
                        let squared = way.length_squared();
                        let toward = way / squared.sqrt();
                        let received = toward.dot(normal).max(0.0) * toward.z / squared;
                        sum += 0.25 * weight_x * weight_y * received * sky.luminance(toward);
                    }
                }
            }
        }
        sum * panel.x * panel.y
    };
    let (fine, coarse) = (integral(PANELS), integral(PANELS / 2));
    (fine, (fine - coarse).abs())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::geometry::disc::disc_irradiance;
    use crate::sky::{CieType, SkyDistribution};

    /// Under a uniform sky the opening is a Lambertian source: a square of the area of a distant disc gives the same.
    #[test]
    fn a_small_opening_is_a_small_source() {
        let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
        let sky = Sky { distribution, zenith_luminance_cd_m2: 1.0 };
        let side = 0.01;
        let corner = DVec3::new(-0.5 * side, -0.5 * side, 3.0);
        let (square, error) =
            illuminance_through_rectangle(&sky, corner, DVec2::splat(side), DVec3::new(1.0, 0.0, 0.0), DVec3::Z);
        let disc = PI * disc_irradiance(side / PI.sqrt(), 3.0, 1.0).vertical;
        // they differ by the second moments of their shapes, of the order (side / distance)^2
        assert!((square / disc - 1.0).abs() < (side / 3.0).powi(2), "{square} {disc}");
        assert!(error < 1e-12 * square);
    }
}
