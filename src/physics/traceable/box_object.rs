//! Boxes in a room as rays meet them.

use glam::{DMat2, DVec2, DVec3};

use crate::geometry::turn::rotation;
use crate::scene::BoxObject;

/// A box in its own frame: rotated about its base's centre.
#[derive(Clone, Debug)]
pub struct TraceableBox {
    base: DVec3,
    half: DVec2,
    height: f64,
    /// Rotation from the room's frame to the box'.
    turn: DMat2,
}

impl TraceableBox {
    /// Compiles a box of the scene.
    pub fn new(object: &BoxObject) -> Self {
        Self {
            base: object.base,
            half: 0.5 * object.size.truncate(),
            height: object.size.z,
            // clockwise seen from above turns the box by -rotation in x-y
            turn: rotation(object.rotation),
        }
    }

    /// Finds the first point at which `origin + t direction` enters the box: t >= 0, the number of the face, and its outward normal.
    #[inline]
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<(f64, usize, DVec3)> {
        let to_local = |v: DVec3| (self.turn * v.truncate()).extend(v.z);
        let (p, d) = (to_local(origin - self.base), to_local(direction));
        let low = DVec3::new(-self.half.x, -self.half.y, 0.0);
        let high = DVec3::new(self.half.x, self.half.y, self.height);
        let (mut enter, mut leave, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
        for k in 0..3 {
            if d[k] == 0.0 {
                if p[k] <= low[k] || p[k] >= high[k] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low[k] - p[k]) / d[k], (high[k] - p[k]) / d[k]);
            let (near, far) = if a < b { (a, b) } else { (b, a) };
            if near > enter {
                (enter, axis) = (near, k);
            }
            leave = leave.min(far);
        }
        if enter < 0.0 || enter >= leave {
            return None;
        }
        let toward_high = d[axis] < 0.0;
        let mut normal = DVec3::ZERO;
        normal[axis] = if toward_high { 1.0 } else { -1.0 };
        let normal = (self.turn.transpose() * normal.truncate()).extend(normal.z);
        Some((enter, 2 * axis + usize::from(toward_high), normal))
    }

    /// Returns the four corners of the outline seen from above, counter-clockwise.
    pub fn outline(&self) -> [DVec2; 4] {
        let back = self.turn.transpose();
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| self.base.truncate() + back * DVec2::new(x * self.half.x, y * self.half.y))
    }

    /// True if a point is inside the box or on its underside: a box covers what it stands on.
    pub fn contains(&self, point: DVec3) -> bool {
        let local = self.turn * (point - self.base).truncate();
        let (low, high) = self.span();
        local.abs().cmplt(self.half).all() && point.z >= low && point.z < high
    }

    /// Returns the distance in m of a point outside the box to a side or the underside; infinite at and above the height of the top.
    pub fn horizontal_distance(&self, point: DVec3) -> f64 {
        let (low, high) = self.span();
        if point.z >= high {
            return f64::INFINITY;
        }
        let across = (self.turn * (point - self.base).truncate()).abs() - self.half;
        across.extend(low - point.z).max(DVec3::ZERO).length()
    }

    /// Returns the lower and upper height in m.
    pub fn span(&self) -> (f64, f64) {
        (self.base.z, self.base.z + self.height)
    }

    /// Returns the lowest and highest corner, in m, of the block along the room's axes around the box.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        let outline = self.outline();
        let (low, high) = self.span();
        let corner = |least: fn(DVec2, DVec2) -> DVec2, z: f64| {
            outline.iter().copied().reduce(least).unwrap_or_default().extend(z)
        };
        [corner(DVec2::min, low), corner(DVec2::max, high)]
    }

    /// Returns the unit normal of a face, pointing away from the box.
    pub fn normal(&self, face: usize) -> DVec3 {
        let along = if face % 2 == 1 { 1.0 } else { -1.0 };
        let own = DVec3::AXES[face / 2] * along;
        (self.turn.transpose() * own.truncate()).extend(own.z)
    }

    /// Returns a corner of a face and the two edges that span it, in the room frame; `face` is numbered as [`Face`](crate::scene::Face)
    /// is.
    pub fn face(&self, face: usize) -> [DVec3; 3] {
        let back = self.turn.transpose();
        let world = |v: DVec3| (back * v.truncate()).extend(v.z);
        let low = DVec3::new(-self.half.x, -self.half.y, 0.0);
        let extent = DVec3::new(2.0 * self.half.x, 2.0 * self.half.y, self.height);
        let axis = face / 2;
        let mut corner = low;
        if face % 2 == 1 {
            corner[axis] += extent[axis];
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let edge = |k: usize| world(DVec3::AXES[k] * extent[k]);
        [self.base + world(corner), edge(u), edge(v)]
    }
}
