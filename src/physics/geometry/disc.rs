//! Discs in closed form: irradiance by a Lambertian disc, areas of a disc cut by polygons and discs.

use std::f64::consts::PI;

use glam::DVec2;

/// Irradiance vector at a point below a uniform Lambertian disc, per unit exitance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscIrradiance {
    /// Irradiance of a horizontal receiver that looks up.
    pub vertical: f64,
    /// Irradiance of a vertical receiver that looks toward the disc's axis.
    pub toward_axis: f64,
}

/// Computes the irradiance vector of a uniform Lambertian disc of unit exitance, in lx per lm/m2.
///
/// `radius`, `depth` (> 0, below the disc) and `offset` in metres. The form with D(A + D) avoids the cancellation of the
/// textbook formula; exact while the receiver's horizon does not cut the disc. Derived in
/// docs/physics/rooms.md#lambertian-disc.
///
/// A disc of 0.127 m from which 1000 lm leave, 2.032 m above a floor, gives 76.790865423735 lx on its axis:
///
/// ```
/// use std::f64::consts::PI;
///
/// let exitance = 1000.0 / (PI * 0.127 * 0.127);
/// let lux = exitance * skyduct_physics::geometry::disc::disc_irradiance(0.127, 2.032, 0.0).vertical;
/// assert!((lux - 76.790865423735).abs() < 1e-11);
/// ```
pub fn disc_irradiance(radius: f64, depth: f64, offset: f64) -> DiscIrradiance {
    let h2 = depth * depth;
    let r2 = radius * radius;
    let l2 = offset * offset;
    let d = ((h2 + (offset - radius).powi(2)) * (h2 + (offset + radius).powi(2))).sqrt();
    let a = h2 + l2 - r2;
    let vertical = if a > 0.0 { 2.0 * h2 * r2 / (d * (a + d)) } else { 0.5 * (1.0 - a / d) };
    let toward_axis = 2.0 * depth * offset * r2 / (d * (l2 + h2 + r2 + d));
    DiscIrradiance { vertical, toward_axis }
}

/// Computes the area of a disc of `radius` around `centre` inside a convex or concave simple polygon (counter-clockwise: positive).
///
/// A corner of a square cuts a quarter out of a disc around it:
///
/// ```
/// use glam::DVec2;
/// use std::f64::consts::PI;
///
/// let square = [DVec2::ZERO, DVec2::new(9.0, 0.0), DVec2::new(9.0, 9.0), DVec2::new(0.0, 9.0)];
/// let area = skyduct_physics::geometry::disc::disc_polygon_area(DVec2::ZERO, 1.0, &square);
/// assert!((area - PI / 4.0).abs() < 1e-15);
/// ```
pub fn disc_polygon_area(centre: DVec2, radius: f64, polygon: &[DVec2]) -> f64 {
    let corner = |k: usize| polygon[k % polygon.len()] - centre;
    (0..polygon.len()).map(|k| disc_edge_area(radius, corner(k), corner(k + 1))).sum()
}

/// Computes the signed area of a disc around the origin inside the triangle (origin, `a`, `b`): the contribution of one directed edge of an
/// outline.
///
/// An edge far beyond the disc cuts a sector, one that the disc reaches beyond a triangle:
///
/// ```
/// use glam::DVec2;
/// use skyduct_physics::geometry::disc::disc_edge_area;
///
/// let sector = disc_edge_area(1.0, DVec2::new(9.0, 0.0), DVec2::new(0.0, 9.0));
/// assert!((sector - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
/// assert_eq!(disc_edge_area(9.0, DVec2::X, DVec2::Y), 0.5);
/// ```
pub fn disc_edge_area(radius: f64, a: DVec2, b: DVec2) -> f64 {
    let sector = |from: DVec2, to: DVec2| 0.5 * radius * radius * libm::atan2(from.perp_dot(to), from.dot(to));
    let triangle = |from: DVec2, to: DVec2| 0.5 * from.perp_dot(to);
    let edge = b - a;
    let length_squared = edge.length_squared();
    if length_squared == 0.0 {
        return 0.0;
    }
    // |a + t edge| = radius
    let half_b = a.dot(edge);
    let discriminant = half_b * half_b - length_squared * (a.length_squared() - radius * radius);
    if discriminant <= 0.0 {
        return sector(a, b);
    }
    let root = discriminant.sqrt();
    let (enter, leave) = ((-half_b - root) / length_squared, (-half_b + root) / length_squared);
    if enter >= 1.0 || leave <= 0.0 {
        return sector(a, b);
    }
    let start = if enter > 0.0 { a + edge * enter } else { a };
    let end = if leave < 1.0 { a + edge * leave } else { b };
    let before = if enter > 0.0 { sector(a, start) } else { 0.0 };
    let after = if leave < 1.0 { sector(end, b) } else { 0.0 };
    before + triangle(start, end) + after
}

/// Computes the area common to two discs of radii `r1` and `r2` whose centres are `distance` apart.
///
/// Two unit discs of which each passes through the other's centre share 2 pi / 3 - sqrt(3) / 2:
///
/// ```
/// let lens = skyduct_physics::geometry::disc::disc_disc_area(1.0, 1.0, 1.0);
/// assert!((lens - (2.0 * std::f64::consts::PI / 3.0 - 3f64.sqrt() / 2.0)).abs() < 1e-14);
/// ```
pub fn disc_disc_area(r1: f64, r2: f64, distance: f64) -> f64 {
    if distance >= r1 + r2 {
        return 0.0;
    }
    if distance <= (r1 - r2).abs() {
        return PI * r1.min(r2).powi(2);
    }
    let half_angle = |r: f64, other: f64| {
        libm::acos(((distance * distance + r * r - other * other) / (2.0 * distance * r)).clamp(-1.0, 1.0))
    };
    let (angle1, angle2) = (half_angle(r1, r2), half_angle(r2, r1));
    r1 * r1 * (angle1 - libm::sin(angle1) * libm::cos(angle1))
        + r2 * r2 * (angle2 - libm::sin(angle2) * libm::cos(angle2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(half: f64) -> [DVec2; 4] {
        [DVec2::new(-half, -half), DVec2::new(half, -half), DVec2::new(half, half), DVec2::new(-half, half)]
    }

    /// Checks that the fraction of a disc inside a straight edge at x radii from its centre is 1 - (acos x - x sqrt(1-x^2))/pi.
    #[test]
    fn clipped_areas() {
        let unit = |centre: DVec2| disc_polygon_area(centre, 1.0, &square(10.0)) / PI;
        for (x, fraction) in [(0.0, 0.5), (0.1, 0.5636), (0.25, 0.6575), (0.5, 0.8045), (0.75, 0.9279), (1.0, 1.0)] {
            assert!((unit(DVec2::new(10.0 - x, 0.0)) - fraction).abs() < 1e-4, "edge {x}");
        }
        assert!((unit(DVec2::new(10.0, 10.0)) - 0.25).abs() < 1e-12);
        assert!((disc_polygon_area(DVec2::new(0.3, -0.2), 100.0, &square(1.0)) - 4.0).abs() < 1e-12);
        assert!((unit(DVec2::new(-11.0, 0.0))).abs() < 1e-12);
    }

    #[test]
    fn lenses() {
        assert!((disc_disc_area(1.0, 1.0, 1.0) - (2.0 * PI / 3.0 - 3f64.sqrt() / 2.0)).abs() < 1e-14);
        assert_eq!(disc_disc_area(2.0, 1.0, 0.5), PI);
        assert_eq!(disc_disc_area(2.0, 1.0, 3.0), 0.0);
    }

    /// Checks a source of one millimetre in a hall of 100 m, and a sensor that touches the source.
    #[test]
    fn hard_discs() {
        let r = 0.0005;
        let lux = 1000.0 / (PI * r * r) * disc_irradiance(r, 100.0, 0.0).vertical;
        assert!((lux - 0.0318309886).abs() < 1e-10);
        assert!((disc_irradiance(r, 1e-9, 0.0).vertical - 1.0).abs() < 1e-11);
    }
}
