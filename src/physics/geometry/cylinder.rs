//! Skew rays inside a mirror cylinder, in closed form.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::turn::unit_vector;

/// Position and direction of a ray after its passage through a cylinder, with the number of reflections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Position at the end of the passage in m, inside or on the cylinder.
    pub position: DVec3,
    /// Unit direction after the last reflection; its z is that of the initial direction.
    pub direction: DVec3,
    /// Number of mirror reflections during the passage; exact up to 2^53.
    pub bounces: f64,
}

/// Half chord in radii below which a ray is taken to follow the wall.
pub(crate) const LEAST_HALF_CHORD: f64 = 1e-9;

/// Follows a ray over `axial` metres along z inside a mirror cylinder of `radius` around the z axis.
///
/// `position` lies inside (or on) the cylinder; `direction` is a unit vector with z != 0, whose sign gives the sense of the `axial` >= 0
/// metres. O(1) for any number of bounces: the impact parameter b is conserved, all chords are equal, and each reflection turns the ray by
/// the same angle. Derived in docs/physics/tubes.md#a-skew-ray-in-a-straight-cylinder.
///
/// In the grazing limit |b| -> radius the bounces go to infinity while their turn stays finite; below h < 1e-9 radius the
/// ray follows the wall and `bounces` is infinite.
///
/// A ray from the axis at 45 degrees comes back to it after five bounces and ten radii:
///
/// ```
/// use glam::DVec3;
///
/// let direction = DVec3::new(1.0, 0.0, 1.0).normalize();
/// let passage = skyduct_physics::geometry::cylinder::traverse(0.1, DVec3::ZERO, direction, 1.0);
/// assert_eq!(passage.bounces, 5.0);
/// assert!((passage.position - DVec3::Z).length() < 1e-15);
/// ```
#[inline]
pub fn traverse(radius: f64, position: DVec3, direction: DVec3, axial: f64) -> Passage {
    let p0 = position.truncate();
    let transverse = direction.truncate();
    let end_z = position.z + axial.copysign(direction.z);
    // all lengths along the path in units of its projection on the cross-section over the speed in it
    let speed_squared = transverse.length_squared();
    let speed = speed_squared.sqrt();
    let path = axial * speed_squared / direction.z.abs();
    if speed == 0.0 || path == 0.0 {
        let end = p0 + transverse * (axial / direction.z.abs());
        return Passage { position: end.extend(end_z), direction, bounces: 0.0 };
    }
    let (reach, impact) = (radius * speed, p0.perp_dot(transverse));
    let half_chord = ((reach - impact.abs()).max(0.0) * (reach + impact.abs())).sqrt();
    if half_chord < LEAST_HALF_CHORD * reach {
        let turn = unit_vector(path / reach * if impact < 0.0 { -1.0 } else { 1.0 });
        let direction = turn.rotate(transverse).extend(direction.z);
        return Passage { position: turn.rotate(p0).extend(end_z), direction, bounces: f64::INFINITY };
    }
    let from_middle = p0.dot(transverse);
    let chords = (from_middle + half_chord + path) / (2.0 * half_chord);
    // entry on the rim may give a chord count a rounding error below zero
    let bounces = chords.floor().max(0.0);
    let rest = (chords - bounces) * 2.0 * half_chord;
    let mut end = p0 + transverse * ((rest - from_middle - half_chord) / speed_squared);
    let mut direction = direction;
    if bounces > 0.0 {
        let rotation = turns(DVec2::new(impact.abs(), half_chord), reach, bounces);
        let rotation = DVec2::new(rotation.x, if impact < 0.0 { -rotation.y } else { rotation.y });
        end = rotation.rotate(end);
        direction = rotation.rotate(transverse).extend(direction.z);
    }
    // rounding must not put the ray outside of the guide
    let distance_squared = end.length_squared();
    if distance_squared > radius * radius {
        end *= radius / distance_squared.sqrt();
    }
    Passage { position: end.extend(end_z), direction, bounces }
}

/// Largest number of bounces for which the rotation is computed by repeated squaring, whose rounding error grows with their number.
const MOST_SQUARED: f64 = 256.0;

/// Returns, as a unit vector, the rotation by 2 `bounces` times the angle of the vector `half_turn` of the given length.
#[inline]
fn turns(half_turn: DVec2, length: f64, bounces: f64) -> DVec2 {
    if bounces > MOST_SQUARED {
        // reduced to one turn before its sine and cosine are taken
        let turns = bounces * 2.0 * libm::atan2(half_turn.y, half_turn.x) * (1.0 / TAU);
        let (sin, cos) = libm::sincos((turns - turns.floor()) * TAU);
        return DVec2::new(cos, sin);
    }
    let half_turn = half_turn / length;
    let mut power = half_turn.rotate(half_turn);
    let mut result = DVec2::X;
    let mut left = bounces as u32;
    while left > 0 {
        if left & 1 == 1 {
            result = result.rotate(power);
        }
        power = power.rotate(power);
        left >>= 1;
    }
    // one step toward a unit vector is enough for what rounding leaves
    result * (1.5 - 0.5 * result.length_squared())
}

/// Returns the cosine of the angle between a ray inside a cylinder and the wall's normal, which is equal at every bounce.
///
/// The cosine is s h / r with the transverse speed s = sin(theta), theta from the axis, half the chord h and the radius r.
///
/// ```
/// use glam::DVec3;
///
/// let (sin, cos) = 60f64.to_radians().sin_cos();
/// let meridional = skyduct_physics::geometry::cylinder::cosine_of_incidence(0.1, DVec3::ZERO, DVec3::new(sin, 0.0, cos));
/// assert!((meridional - sin).abs() < 1e-15);
/// ```
#[inline]
pub fn cosine_of_incidence(radius: f64, position: DVec3, direction: DVec3) -> f64 {
    let (p, d) = (position.truncate() / radius, direction.truncate());
    let impact = p.perp_dot(d);
    (d.length_squared() - impact * impact).max(0.0).sqrt()
}

/// Returns the distance along a unit `direction` from inside the cylinder to its wall; infinite for an axial ray.
///
/// ```
/// use glam::DVec3;
///
/// let distance = skyduct_physics::geometry::cylinder::distance_to_wall(0.1, DVec3::new(0.06, 0.0, 0.0), DVec3::Y);
/// assert!((distance - 0.08).abs() < 1e-16);
/// ```
#[inline]
pub fn distance_to_wall(radius: f64, position: DVec3, direction: DVec3) -> f64 {
    let p = position.truncate();
    let d = direction.truncate();
    let a = d.length_squared();
    if a == 0.0 {
        return f64::INFINITY;
    }
    let half_b = p.dot(d);
    let c = p.length_squared() - radius * radius;
    let root = (half_b * half_b - a * c).max(0.0).sqrt();
    // the far root without cancellation; a start on or beyond the wall gives zero, not a negative distance
    let t = if half_b <= 0.0 { (root - half_b) / a } else { -c / (root + half_b) };
    t.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom, warp};

    fn step_by_step(radius: f64, mut p: DVec3, mut d: DVec3, axial: f64) -> Passage {
        let end_z = p.z + axial.copysign(d.z);
        let mut bounces = 0.0;
        loop {
            let wall = distance_to_wall(radius, p, d);
            let end = (end_z - p.z) / d.z;
            if end <= wall {
                return Passage { position: p + d * end, direction: d, bounces };
            }
            p += d * wall;
            let normal = p.truncate().normalize().extend(0.0);
            d -= normal * 2.0 * d.dot(normal);
            bounces += 1.0;
        }
    }

    /// Compares the closed form with stepping: equal bounce counts, positions to 1e-12 m (times the path's growth of rounding errors).
    #[test]
    fn closed_form_equals_stepping() {
        let mut random = PathRandom::new(Key::new(1));
        for k in 0..4000 {
            let p = (warp::disc(random.uniform2()) * 0.127).extend(1.0);
            let d = warp::cosine_hemisphere(random.uniform2());
            let d = if k % 2 == 0 { -d } else { d };
            let closed = traverse(0.127, p, d, 1.0);
            let stepped = step_by_step(0.127, p, d, 1.0);
            assert_eq!(closed.bounces, stepped.bounces);
            let at_wall = p + d * distance_to_wall(0.127, p, d);
            let normal = at_wall.truncate().normalize();
            assert!((cosine_of_incidence(0.127, p, d) - d.truncate().dot(normal)).abs() < 1e-9);
            let tolerance = 1e-13 * (1.0 + closed.bounces) * (1.0 + closed.bounces);
            assert!((closed.position - stepped.position).length() < tolerance.max(1e-12));
            assert!((closed.direction - stepped.direction).length() < tolerance.max(1e-11));
        }
    }

    #[test]
    fn special_rays_are_finite() {
        let r = 0.127;
        let axial = traverse(r, DVec3::new(0.05, 0.0, 1.0), DVec3::NEG_Z, 1.0);
        assert_eq!((axial.bounces, axial.position), (0.0, DVec3::new(0.05, 0.0, 0.0)));
        // through the axis: stays in its plane
        let plane = traverse(r, DVec3::new(0.1, 0.0, 0.0), DVec3::new(0.6, 0.0, 0.8), 3.0);
        assert!(plane.position.y.abs() < 1e-12 && plane.direction.y.abs() < 1e-12);
        // grazing the wall
        let grazing = traverse(r, DVec3::new(r * (1.0 - 1e-15), 0.0, 0.0), DVec3::new(0.0, 0.8, 0.6), 2.0);
        assert!(grazing.position.is_finite() && grazing.position.truncate().length() <= r * (1.0 + 1e-12));
        // from the rim outward: one bounce at distance zero, not an escape
        let rim = traverse(r, DVec3::new(r, 0.0, 0.0), DVec3::new(0.6, 0.0, 0.8), 1e-6);
        assert_eq!(rim.bounces, 1.0);
        // no length: nothing happens
        let none = traverse(r, DVec3::new(0.05, 0.02, 0.0), DVec3::new(0.6, 0.0, 0.8), 0.0);
        assert_eq!((none.bounces, none.position), (0.0, DVec3::new(0.05, 0.02, 0.0)));
        // ten million bounces
        let far = traverse(r, DVec3::new(0.01, 0.03, 0.0), DVec3::new((1.0f64 - 1e-12).sqrt(), 0.0, 1e-6), 1.0);
        assert!(far.bounces > 1e6 && far.position.is_finite());
    }
}
