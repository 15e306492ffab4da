//! Light of a sky through a horizontal opening, such as the roof openings of CIE 171.

use std::num::NonZeroUsize;

use gauss_quad::GaussLegendre;
use glam::{DVec2, DVec3};

use super::Sky;

/// Number of even divisions of each side of the opening, in the finer of two rules.
const DIVISIONS: usize = 16;

/// Number of halvings toward the image of the sun, where the luminance has a cusp.
const HALVINGS: usize = 14;

/// Degree of the Gauss-Legendre rule in each panel.
const DEGREE: usize = 8;

/// Computes the illuminance in lux from the sky alone at `point`, on a surface with the unit `normal`, through a rectangle of no
/// thickness; and an estimate of its numerical error.
///
/// `corner`: the rectangle's corner of least x and y, above the point; `size` along x and y, all in metres. The integral of L cos(theta)
/// cos(theta') / d^2 over the rectangle is taken by a Gauss rule on panels that shrink toward the point where the rectangle shows the
/// sun; the error is the difference from the rule of half as many panels.
///
/// Under a uniform sky a 1 m x 1 m opening 3 m above a point gives it Lambert's configuration factor, 3.41068 % of the
/// illuminance outdoors:
///
/// ```
/// use glam::{DVec2, DVec3};
/// use skyduct_physics::sky::{CieType, Sky, SkyDistribution, opening::illuminance_through_rectangle};
///
/// let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
/// let sky = Sky::new(distribution, 1.0);
/// let corner = DVec3::new(-0.5, -0.5, 3.0);
/// let (lux, _) = illuminance_through_rectangle(&sky, corner, DVec2::ONE, DVec3::ZERO, DVec3::Z);
/// assert!((lux / sky.horizontal_illuminance_lux() - 0.0341068).abs() < 1e-7);
/// ```
pub fn illuminance_through_rectangle(sky: &Sky, corner: DVec3, size: DVec2, point: DVec3, normal: DVec3) -> (f64, f64) {
    let rule = GaussLegendre::new(NonZeroUsize::new(DEGREE).unwrap_or(NonZeroUsize::MIN));
    let nodes = rule.as_node_weight_pairs();
    let sun = sky.distribution.sun();
    let image = point + sun * ((corner.z - point.z) / sun.z.max(1e-9));
    let integral = |fineness: usize| {
        let [columns, rows] = [0, 1].map(|axis| panels(corner[axis], size[axis], image[axis], fineness));
        let mut sum = 0.0;
        for (x_low, x_size) in &columns {
            for (y_low, y_size) in &rows {
                for (x, weight_x) in nodes {
                    for (y, weight_y) in nodes {
                        let across = DVec2::new(x_low + x_size * 0.5 * (1.0 + x), y_low + y_size * 0.5 * (1.0 + y));
                        let to_opening = across.extend(corner.z) - point;
                        let squared = to_opening.length_squared();
                        let toward = to_opening / squared.sqrt();
                        let received = toward.dot(normal).max(0.0) * toward.z / squared;
                        sum += 0.25 * weight_x * weight_y * x_size * y_size * received * sky.luminance(toward);
                    }
                }
            }
        }
        sum
    };
    let (fine, coarse) = (integral(2), integral(1));
    (fine, (fine - coarse).abs())
}

/// Divides `low`..`low + size` into intervals (start, length): even ones, cut again at distances from `focus` that halve.
fn panels(low: f64, size: f64, focus: f64, fineness: usize) -> Vec<(f64, f64)> {
    let high = low + size;
    let focus = focus.clamp(low, high);
    let even = fineness * DIVISIONS / 2;
    let mut cuts: Vec<f64> = (0..=even).map(|k| low + size * k as f64 / even as f64).collect();
    for k in 0..fineness * HALVINGS / 2 {
        let distance = size * 0.5f64.powi(k as i32 + 1);
        cuts.extend([focus - distance, focus + distance].into_iter().filter(|cut| (low..high).contains(cut)));
    }
    cuts.push(focus);
    cuts.sort_by(f64::total_cmp);
    cuts.windows(2).map(|pair| (pair[0], pair[1] - pair[0])).filter(|(_, length)| *length > 0.0).collect()
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
        let sky = Sky::new(distribution, 1.0);
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
