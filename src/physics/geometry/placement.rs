//! Places of copies of a mesh: a rotation and a translation.

use glam::{DMat3, DVec3};

use super::TriangleMesh;

/// Place of a copy of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Rotation from the mesh's own axes to those of the room.
    rotation: DMat3,
    /// Rotation back.
    back: DMat3,
    /// Point of the room in m at which the mesh's origin lies.
    pub origin: DVec3,
}

impl Placement {
    /// Creates the place of a mesh whose own unit vectors become `axes` and whose origin comes to `origin`.
    pub fn new(axes: [DVec3; 3], origin: DVec3) -> Self {
        let [x, y, z] = axes;
        let rotation = DMat3::from_cols(x, y, z);
        Self { rotation, back: rotation.transpose(), origin }
    }

    /// Converts a point of the mesh to the room.
    #[inline]
    pub fn point(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.origin
    }

    /// Converts a direction of the mesh to the room.
    #[inline]
    pub fn direction(&self, direction: DVec3) -> DVec3 {
        self.rotation * direction
    }

    /// Converts a point of the room to the mesh.
    #[inline]
    pub fn point_back(&self, point: DVec3) -> DVec3 {
        self.back * (point - self.origin)
    }

    /// Converts a direction of the room to the mesh.
    #[inline]
    pub fn direction_back(&self, direction: DVec3) -> DVec3 {
        self.back * direction
    }

    /// Returns the lowest and the highest corner of the axis-aligned block around a block of the mesh.
    pub fn bounds(&self, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
        let (middle, half) = (self.point(0.5 * (low + high)), 0.5 * (high - low));
        let reach = self.rotation.x_axis.abs() * half.x
            + self.rotation.y_axis.abs() * half.y
            + self.rotation.z_axis.abs() * half.z;
        [middle - reach, middle + reach]
    }

    /// Returns the copy of a mesh that stands here.
    pub fn copy(&self, mesh: &TriangleMesh) -> TriangleMesh {
        let positions = mesh.positions.iter().map(|position| self.point(*position)).collect();
        TriangleMesh { positions, ..mesh.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_come_back_and_bounds_hold_their_corners() {
        let (sin, cos) = libm::sincos(0.6);
        let axes = [DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos)];
        let place = Placement::new(axes, DVec3::new(3.0, -1.0, 0.5));
        let block = [DVec3::new(-1.0, 0.0, 0.25), DVec3::new(0.5, 2.0, 0.75)];
        let [low, high] = place.bounds(block);
        let mut met = [false; 6];
        for k in 0..8 {
            let corner = DVec3::new(block[k & 1].x, block[k >> 1 & 1].y, block[k >> 2].z);
            let point = place.point(corner);
            assert!((place.point_back(point) - corner).length() < 1e-15);
            assert!(point.cmpge(low - 1e-15).all() && point.cmple(high + 1e-15).all());
            for axis in 0..3 {
                met[axis] |= (point[axis] - low[axis]).abs() < 1e-15;
                met[axis + 3] |= (point[axis] - high[axis]).abs() < 1e-15;
            }
        }
        assert_eq!(met, [true; 6]);
    }
}
