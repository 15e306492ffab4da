//! Form factors from a surface element to rectangles parallel or perpendicular to it, in closed form.

use std::f64::consts::TAU;

/// Computes the form factor to a parallel rectangle at `distance` (> 0) that faces the element; `u` and `v` are its extents in metres,
/// measured from the foot of the element.
///
/// Sum over the corners of 1/(2 pi) [X/sqrt(1+X^2) atan(Y/sqrt(1+X^2)) + Y/sqrt(1+Y^2) atan(X/sqrt(1+Y^2))] (Howell,
/// Catalog of Radiation Heat Transfer Configuration Factors, B-3).
///
/// A very large rectangle fills the hemisphere:
///
/// ```
/// let factor = skyduct_physics::geometry::rectangle::parallel_factor(1.0, [-1e9, 1e9], [-1e9, 1e9]);
/// assert!((factor - 1.0).abs() < 1e-8);
/// ```
pub fn parallel_factor(distance: f64, u: [f64; 2], v: [f64; 2]) -> f64 {
    let corner = |u: f64, v: f64| {
        let (x, y) = (u / distance, v / distance);
        let (root_x, root_y) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        x / root_x * libm::atan(y / root_x) + y / root_y * libm::atan(x / root_y)
    };
    (corner(u[1], v[1]) - corner(u[0], v[1]) - corner(u[1], v[0]) + corner(u[0], v[0])) / TAU
}

/// Computes the form factor to a rectangle in a plane that contains the direction of the element's normal, `distance` (> 0) away.
///
/// The extents of the rectangle are `across`, at right angles to the normal, and `along`, along the normal, both measured from the element
/// in metres; the part below the element's horizon (`along` < 0) does not count. Each corner gives 1/(2 pi) d/sqrt(d^2+v^2)
/// atan(u/sqrt(d^2+v^2)) (Howell, B-4).
///
/// A very large wall fills half of the hemisphere:
///
/// ```
/// let factor = skyduct_physics::geometry::rectangle::perpendicular_factor(1.0, [-1e9, 1e9], [0.0, 1e9]);
/// assert!((factor - 0.5).abs() < 1e-8);
/// ```
pub fn perpendicular_factor(distance: f64, across: [f64; 2], along: [f64; 2]) -> f64 {
    let along = along.map(|v| v.max(0.0));
    if along[1] <= along[0] {
        return 0.0;
    }
    let edge = |v: f64| {
        let slant = libm::hypot(distance, v);
        distance / slant * (libm::atan(across[1] / slant) - libm::atan(across[0] / slant))
    };
    (edge(along[0]) - edge(along[1])) / TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that an element in the middle of a box's floor sees its ceiling and walls, and nothing else.
    #[test]
    fn a_box_closes() {
        let (x, y, z) = ([-0.3, 1.7], [-0.9, 0.4], 1.3);
        let walls = [(0.3, y), (1.7, y), (0.9, x), (0.4, x)];
        let sum: f64 = walls.map(|(distance, across)| perpendicular_factor(distance, across, [0.0, z])).iter().sum();
        assert!((sum + parallel_factor(z, x, y) - 1.0).abs() < 1e-14);
        // what is below the horizon adds nothing
        assert_eq!(perpendicular_factor(1.0, [0.0, 1.0], [-2.0, 0.0]), 0.0);
        assert_eq!(
            perpendicular_factor(1.0, [0.0, 1.0], [-2.0, 0.5]),
            perpendicular_factor(1.0, [0.0, 1.0], [0.0, 0.5])
        );
    }

    /// Checks a 1 m x 1 m panel of 10 000 lm, 3 m above (the geometry of case 5.3 of CIE 171:2006), to the digits of
    /// docs/physics/rooms.md#lambertian-rectangles-and-polygons.
    #[test]
    fn area_source() {
        for (x, lux) in [(0.0, 341.07), (0.5, 324.08), (1.0, 279.89), (1.5, 223.62), (2.0, 169.11)] {
            let factor = parallel_factor(3.0, [-0.5 - x, 0.5 - x], [-0.5, 0.5]);
            assert!((10_000.0 * factor - lux).abs() < 0.005, "{x}: {}", 10_000.0 * factor);
        }
    }
}
