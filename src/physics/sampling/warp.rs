//! Warps of the unit square, all continuous so that stratified points stay stratified.

use std::f64::consts::{FRAC_PI_4, TAU};

use glam::{DVec2, DVec3};

/// Returns a uniform point on the unit disc (concentric map of Shirley and Chiu 1997); density 1/pi.
///
/// ```
/// use glam::DVec2;
/// use skyduct_physics::sampling::warp;
///
/// assert_eq!(warp::disc([0.5, 0.5]), DVec2::ZERO);
/// assert_eq!(warp::disc([1.0, 0.5]), DVec2::X);
/// ```
#[inline]
pub fn disc([u, v]: [f64; 2]) -> DVec2 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return DVec2::ZERO;
    }
    // polar coordinates: the larger side is the radius, the ratio of the smaller one gives an angle of at most an eighth of a turn; the
    // choice indexes arrays, as a branch would be mispredicted half of the time
    let wide = usize::from(a.abs() > b.abs());
    let (radius, other) = ([b, a][wide], [a, b][wide]);
    let (sin, cos) = small_sin_cos(FRAC_PI_4 * (other / radius));
    let (along, across) = (radius * cos, radius * sin);
    DVec2::new([across, along][wide], [along, across][wide])
}

/// Computes sine and cosine of |x| <= pi/4 by their series to x^15 and x^16, exact to 1e-15: a third of the time of the general functions,
/// and the same bits on every machine.
#[inline]
fn small_sin_cos(x: f64) -> (f64, f64) {
    let y = x * x;
    let y8 = ((y * y) * (y * y)) * ((y * y) * (y * y));
    (x * eight_terms(y, &SINE), eight_terms(y, &COSINE) + y8 * (1.0 / 20_922_789_888_000.0))
}

/// Coefficients of the series 1 - y/3! + y^2/5! - ..., and 1 - y/2! + y^2/4! - ...
const SINE: [f64; 8] = alternating_factorials(1);
const COSINE: [f64; 8] = alternating_factorials(0);

/// Returns (-1)^k / (2 k + odd)! for k = 0..7.
const fn alternating_factorials(odd: usize) -> [f64; 8] {
    let mut terms = [1.0; 8];
    let mut k = 1;
    while k < 8 {
        let n = 2 * k + odd;
        terms[k] = -terms[k - 1] / (n * (n - 1)) as f64;
        k += 1;
    }
    terms
}

/// Evaluates a polynomial of eight terms in pairs, and pairs of pairs, so that few operations depend on each other.
#[inline]
fn eight_terms(y: f64, [a, b, c, d, e, f, g, h]: &[f64; 8]) -> f64 {
    let (y2, y4) = (y * y, (y * y) * (y * y));
    ((a + b * y) + (c + d * y) * y2) + ((e + f * y) + (g + h * y) * y2) * y4
}

/// Returns a uniform point between two circles around the origin, 0 <= `inner` < `outer`; density 1 / (pi (outer^2 - inner^2)).
///
/// ```
/// let middle = skyduct_physics::sampling::warp::annulus([0.5, 0.0], 0.6, 0.8);
/// assert!((middle.length_squared() - 0.5).abs() < 1e-15);
/// ```
#[inline]
pub fn annulus([u, v]: [f64; 2], inner: f64, outer: f64) -> DVec2 {
    if inner == 0.0 {
        return disc([u, v]) * outer;
    }
    let radius = (inner * inner + u * (outer * outer - inner * inner)).sqrt();
    let (sin, cos) = libm::sincos(TAU * v);
    DVec2::new(radius * cos, radius * sin)
}

/// Returns a cosine-distributed direction around +z; density cos(theta) / pi per sr.
///
/// ```
/// assert_eq!(skyduct_physics::sampling::warp::cosine_hemisphere([0.5, 0.5]), glam::DVec3::Z);
/// ```
#[inline]
pub fn cosine_hemisphere(point: [f64; 2]) -> DVec3 {
    let p = disc(point);
    DVec3::new(p.x, p.y, (1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Returns a direction uniform in solid angle within `half_angle` (radians, <= pi/2) of +z.
///
/// The polar angle comes from chord lengths, sin(theta/2) = r sin(half_angle/2), which has no cancellation for a cone as
/// small as the sun.
///
/// The edge of the square is mapped to that of the cone:
///
/// ```
/// let edge = skyduct_physics::sampling::warp::cone([1.0, 0.5], 0.3);
/// assert!((edge.z - 0.3f64.cos()).abs() < 1e-15 && (edge.x - 0.3f64.sin()).abs() < 1e-15);
/// ```
#[inline]
pub fn cone(point: [f64; 2], half_angle: f64) -> DVec3 {
    let p = disc(point);
    let chord = libm::sin(0.5 * half_angle);
    let half_sine_squared = p.length_squared() * chord * chord;
    // sin(theta) = 2 sin(theta/2) cos(theta/2), along p
    let transverse = p * (2.0 * chord * (1.0 - half_sine_squared).sqrt());
    DVec3::new(transverse.x, transverse.y, 1.0 - 2.0 * half_sine_squared)
}

/// Rotates `local` from a frame whose z axis is the unit vector `axis` into the frame of `axis`.
///
/// ```
/// use glam::DVec3;
/// use skyduct_physics::sampling::warp;
///
/// assert_eq!(warp::around(DVec3::X, DVec3::Z), DVec3::X);
/// ```
#[inline]
pub fn around(axis: DVec3, local: DVec3) -> DVec3 {
    // Duff et al. 2017, "Building an Orthonormal Basis, Revisited": branchless and accurate at both poles
    let sign = 1f64.copysign(axis.z);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    let tangent = DVec3::new(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x);
    let bitangent = DVec3::new(b, sign + axis.y * axis.y * a, -axis.y);
    tangent * local.x + bitangent * local.y + axis * local.z
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize) -> impl Iterator<Item = [f64; 2]> {
        (0..n * n).map(move |k| [((k % n) as f64 + 0.5) / n as f64, ((k / n) as f64 + 0.5) / n as f64])
    }

    /// Second moments of the warped midpoint grid are their integrals; the rule's error is O(1/n^2).
    #[test]
    fn moments_of_the_warps() {
        let n = 400;
        let mean = |f: &dyn Fn([f64; 2]) -> f64| grid(n).map(f).sum::<f64>() / (n * n) as f64;
        assert!((mean(&|p| disc(p).length_squared()) - 0.5).abs() < 1e-4);
        assert!((mean(&|p| annulus(p, 0.5, 1.0).length_squared()) - 0.625).abs() < 1e-4);
        assert!((mean(&|p| cosine_hemisphere(p).z) - 2.0 / 3.0).abs() < 1e-4);
        let half_angle: f64 = 0.3;
        assert!((mean(&|p| cone(p, half_angle).z) - 0.5 * (1.0 + half_angle.cos())).abs() < 1e-6);
    }

    #[test]
    fn series_agree_with_the_library() {
        for k in -1000..=1000 {
            let x = f64::from(k) / 1000.0 * FRAC_PI_4;
            let ((sin, cos), truth) = (small_sin_cos(x), x.sin_cos());
            assert!((sin - truth.0).abs() < 1e-15 && (cos - truth.1).abs() < 1e-15, "{x}");
        }
    }

    #[test]
    fn frames_are_orthonormal_at_the_poles() {
        for axis in [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::new(1e-9, 0.0, -1.0).normalize()] {
            let x = around(axis, DVec3::X);
            let y = around(axis, DVec3::Y);
            assert!(x.dot(y).abs() < 1e-15 && x.dot(axis).abs() < 1e-15 && (x.length() - 1.0).abs() < 1e-15);
            assert!((around(axis, DVec3::Z) - axis).length() < 1e-15);
        }
    }
}
