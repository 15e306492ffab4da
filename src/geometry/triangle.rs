//! Watertight ray-triangle intersection in f64.

use glam::DVec3;

/// A ray prepared for many triangles: the shear that takes its direction to +z (Woop, Benthin and Wald 2013).
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    origin: DVec3,
    /// Axis permutation, the dominant axis of the direction last.
    axes: [usize; 3],
    shear: DVec3,
}

impl ShearedRay {
    /// `direction` need not be normalised, but not zero; distances are in its length.
    #[inline]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let size = direction.abs();
        let z = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if direction[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        let shear = DVec3::new(direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]);
        Self { origin, axes: [x, y, z], shear }
    }

    /// Distance to the triangle, from either side, when it is positive.
    ///
    /// Edges and corners belong to every triangle that shares them, so that no ray slips through between neighbours.
    #[inline]
    pub fn intersect(&self, corners: &[DVec3; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|corner| corner - self.origin);
        let sheared = |p: DVec3| (p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z]);
        let ((ax, ay), (bx, by), (cx, cy)) = (sheared(a), sheared(b), sheared(c));
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let distance = self.shear.z * (u * a[z] + v * b[z] + w * c[z]) / determinant;
        (distance > 0.0).then_some(distance)
    }
}
