//! Rotations in the plane, with the same bits on every machine (glam's own take the system's sine and cosine).

use glam::{DMat2, DVec2};

/// Returns the unit vector at `angle` radians from +x toward +y.
///
/// ```
/// let vector = skyduct_physics::geometry::turn::unit_vector(60f64.to_radians());
/// assert!((vector.x - 0.5).abs() < 1e-15 && (vector.y - 0.75f64.sqrt()).abs() < 1e-15);
/// ```
#[inline]
pub fn unit_vector(angle: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle);
    DVec2::new(cos, sin)
}

/// Returns the matrix that turns +x by `angle` radians toward +y.
pub fn rotation(angle: f64) -> DMat2 {
    let x_axis = unit_vector(angle);
    DMat2::from_cols(x_axis, x_axis.perp())
}

/// Returns the angle in radians from `a` to `b`, -pi..=pi, positive from +x toward +y; 0 if one of them is zero.
///
/// ```
/// use glam::DVec2;
/// use skyduct_physics::geometry::turn::angle_between;
///
/// assert_eq!(angle_between(DVec2::new(2.0, 0.0), DVec2::new(0.0, 3.0)), std::f64::consts::FRAC_PI_2);
/// ```
pub fn angle_between(a: DVec2, b: DVec2) -> f64 {
    libm::atan2(a.perp_dot(b), a.dot(b))
}
