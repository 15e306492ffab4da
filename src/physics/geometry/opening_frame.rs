//! Frames of openings: each is turned about its centre into one in which the opening is level.

use glam::{DMat3, DVec3};

/// Distance of unit vectors within which an opening is level, for rounding.
const LEVEL: f64 = 1e-12;

/// Frame of an opening. Closed forms and densities are written for level openings that face down: points and directions are levelled before,
/// which changes no bit of those of a level opening.
///
/// ```
/// use glam::DVec3;
/// use skyduct_physics::geometry::OpeningFrame;
///
/// // below a slope of 45 degrees that rises toward y, whose outer side faces -y and up
/// let frame = OpeningFrame::facing_from(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, -1.0, 1.0).normalize());
/// let below = DVec3::new(1.0, 3.0, 2.0);
/// assert!((frame.depth(below) - 2f64.sqrt()).abs() < 1e-15);
/// assert!(frame.levelled(below).distance(DVec3::new(1.0, 2.0, 3.0 - 2f64.sqrt())) < 1e-15);
/// assert!(frame.in_room(frame.levelled(below)).distance(below) < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpeningFrame {
    /// Centre of the opening in m.
    pub origin: DVec3,
    /// Matrix that turns directions of the room into those of the levelled frame; `None` for a level opening.
    turn: Option<DMat3>,
}

impl OpeningFrame {
    /// Makes the frame of a level opening.
    pub const fn level(origin: DVec3) -> Self {
        Self { origin, turn: None }
    }

    /// Makes the frame of an opening whose unit normal out of the room is `outward`, away from straight down. The x axis of the frame is
    /// level, and y points up the slope.
    pub fn facing_from(origin: DVec3, outward: DVec3) -> Self {
        let across = DVec3::Z.cross(outward);
        let turn = || {
            let x = across.normalize_or(DVec3::X);
            DMat3::from_cols(x, outward.cross(x), outward).transpose()
        };
        Self { origin, turn: (outward.distance(DVec3::Z) > LEVEL).then(turn) }
    }

    /// Returns the matrix that levels directions; `None` for a level opening.
    #[inline]
    pub fn turn(&self) -> Option<&DMat3> {
        self.turn.as_ref()
    }

    /// True if the opening is level.
    #[inline]
    pub fn is_level(&self) -> bool {
        self.turn.is_none()
    }

    /// Returns the unit normal into the room.
    #[inline]
    pub fn normal(&self) -> DVec3 {
        if self.is_level() { DVec3::NEG_Z } else { -self.outward() }
    }

    /// Returns the unit normal out of the room.
    #[inline]
    pub fn outward(&self) -> DVec3 {
        self.direction_in_room(DVec3::Z)
    }

    /// Returns the component of a vector along the normal out of the room.
    #[inline(always)]
    pub fn up(&self, vector: DVec3) -> f64 {
        levelled(self.turn.as_ref(), vector).z
    }

    /// Returns the distance in m of a point before the plane of the opening; negative behind it.
    #[inline(always)]
    pub fn depth(&self, point: DVec3) -> f64 {
        match &self.turn {
            None => self.origin.z - point.z,
            Some(_) => self.up(self.origin - point),
        }
    }

    /// Returns a direction in the levelled frame.
    #[inline(always)]
    pub fn levelled_direction(&self, direction: DVec3) -> DVec3 {
        levelled(self.turn.as_ref(), direction)
    }

    /// Returns a direction of the levelled frame in the room.
    #[inline(always)]
    pub fn direction_in_room(&self, direction: DVec3) -> DVec3 {
        unlevelled(self.turn.as_ref(), direction)
    }

    /// Returns the place of a point in the levelled frame, in m.
    #[inline(always)]
    pub fn levelled(&self, point: DVec3) -> DVec3 {
        match &self.turn {
            None => point,
            Some(turn) => self.origin + *turn * (point - self.origin),
        }
    }

    /// Returns the place in the room of a point of the levelled frame, in m.
    #[inline(always)]
    pub fn in_room(&self, point: DVec3) -> DVec3 {
        match &self.turn {
            None => point,
            Some(turn) => self.origin + turn.transpose() * (point - self.origin),
        }
    }

    /// Projects a point onto the plane of the opening.
    #[inline]
    pub fn onto(&self, point: DVec3) -> DVec3 {
        match &self.turn {
            None => point.with_z(self.origin.z),
            Some(_) => point + self.outward() * self.depth(point),
        }
    }
}

/// Turns a direction of the room by the matrix of [`OpeningFrame::turn`].
#[inline(always)]
pub fn levelled(turn: Option<&DMat3>, direction: DVec3) -> DVec3 {
    turn.map_or(direction, |turn| *turn * direction)
}

/// Turns a direction back by the matrix of [`OpeningFrame::turn`].
#[inline(always)]
pub fn unlevelled(turn: Option<&DMat3>, direction: DVec3) -> DVec3 {
    turn.map_or(direction, |turn| turn.transpose() * direction)
}
