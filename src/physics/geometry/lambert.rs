//! Irradiance by uniform Lambertian polygons in closed form.

use glam::DVec3;

/// Largest number of corners of a quadrilateral cut by one plane.
const MOST_CORNERS: usize = 5;

/// Computes the irradiance in lux at `point`, on a surface with unit `normal`, by a uniform Lambertian quadrilateral of 1 cd/m2 that is
/// planar, convex and wound clockwise seen from the point.
///
/// E = 1/2 sum over edges of Gamma_i n . (r_i x r_i+1) / |r_i x r_i+1| with Gamma_i the angle of the edge (Lambert 1760;
/// Baum, Rushmeier and Winget 1989, eq. 10), after cutting at the horizon of the receiver. Exact; a quadrilateral
/// that is wound the other way gives the negative value.
///
/// A panel of 1 m x 1 m and 10 000 lm, 3 m above, gives 341.07 lx (docs/physics/rooms.md#lambertian-rectangles-and-polygons):
///
/// ```
/// use glam::DVec3;
/// use skyduct_physics::geometry::lambert::quadrilateral_irradiance;
///
/// let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| DVec3::new(x, y, 3.0));
/// let lux = 10_000.0 / std::f64::consts::PI * quadrilateral_irradiance(&corners, DVec3::ZERO, DVec3::Z);
/// assert!((lux - 341.07).abs() < 0.005);
/// ```
#[inline]
pub fn quadrilateral_irradiance(corners: &[DVec3; 4], point: DVec3, normal: DVec3) -> f64 {
    let relative = corners.map(|corner| corner - point);
    let heights = relative.map(|r| r.dot(normal));
    if heights.iter().all(|height| *height > 0.0) {
        return edge_sum(&relative, normal);
    }
    let (mut cut, mut count) = ([DVec3::ZERO; MOST_CORNERS], 0);
    for k in 0..4 {
        let next = (k + 1) % 4;
        if heights[k] > 0.0 {
            cut[count] = relative[k];
            count += 1;
        }
        if (heights[k] > 0.0) != (heights[next] > 0.0) && count < MOST_CORNERS {
            let fraction = heights[k] / (heights[k] - heights[next]);
            cut[count] = relative[k].lerp(relative[next], fraction);
            count += 1;
        }
    }
    if count < 3 { 0.0 } else { edge_sum(&cut[..count], normal) }
}

fn edge_sum(relative: &[DVec3], normal: DVec3) -> f64 {
    let mut sum = 0.0;
    for (k, from) in relative.iter().enumerate() {
        let to = relative[(k + 1) % relative.len()];
        // from x to, without the cancellation of two long vectors that are nearly parallel
        let cross = from.cross(to - *from);
        let length = cross.length();
        if length > 0.0 {
            sum += libm::atan2(length, from.dot(to)) * cross.dot(normal) / length;
        }
    }
    0.5 * sum
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Returns a horizontal square above the origin, clockwise seen from below.
    fn square(half: f64, height: f64) -> [DVec3; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x * half, y * half, height))
    }

    /// Compares with a rectangle's configuration factor: under the corner of an a x b rectangle at height c, with x = a/c and y = b/c, it
    /// is [x/sqrt(1+x^2) atan(y/sqrt(1+x^2)) + y/sqrt(1+y^2) atan(x/sqrt(1+y^2))] / (2 pi) (Howell, C-11); four such rectangles give the
    /// value on the axis.
    #[test]
    fn agrees_with_the_configuration_factor_of_a_rectangle() {
        let corner_factor = |x: f64, y: f64| {
            let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
            (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
        };
        for (half, height) in [(0.5, 3.0), (1.0, 0.2), (1e-4, 10.0), (100.0, 1.0)] {
            let expected = 4.0 * PI * corner_factor(half / height, half / height);
            let found = quadrilateral_irradiance(&square(half, height), DVec3::ZERO, DVec3::Z);
            assert!((found / expected - 1.0).abs() < 1e-11, "{half} {height}: {found} {expected}");
        }
    }

    /// Checks that a receiver that stands upright under the middle of an infinite ceiling sees half of it: E = pi/2.
    #[test]
    fn the_horizon_cuts() {
        let side = quadrilateral_irradiance(&square(1e7, 1.0), DVec3::ZERO, DVec3::X);
        assert!((side - PI / 2.0).abs() < 1e-6);
        assert_eq!(quadrilateral_irradiance(&square(1.0, 1.0), DVec3::ZERO, DVec3::NEG_Z), 0.0);
        let behind = quadrilateral_irradiance(&square(1.0, -1.0), DVec3::ZERO, DVec3::NEG_Z);
        assert!(behind < 0.0);
    }

    /// Checks that a point that touches the source sees a half space of it: E = pi; and a point on its plane but beside it, nothing.
    #[test]
    fn touching_points() {
        let touching = quadrilateral_irradiance(&square(1.0, 1e-9), DVec3::new(0.2, 0.3, 0.0), DVec3::Z);
        assert!((touching - PI).abs() < 1e-8);
        assert_eq!(quadrilateral_irradiance(&square(1.0, 0.0), DVec3::new(2.0, 0.0, 0.0), DVec3::Z), 0.0);
    }
}
