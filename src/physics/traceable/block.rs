//! An upright block: a box, or the bounds of something else that stands or hangs in a room.

use glam::DVec2;

/// Fraction of a segment, at its end, within which a box counts as touched, not as in between: a sensor on a table sees the room.
pub const ON_TARGET: f64 = 1e-9;

/// An upright block, turned about the vertical. All lengths are in m.
#[derive(Clone, Debug)]
pub struct Block {
    pub centre: DVec2,
    pub half: DVec2,
    /// Unit vector along its first side.
    pub along: DVec2,
    pub low: f64,
    pub high: f64,
    /// Number of the box that this block is; `None` if it bounds something else.
    pub of_box: Option<usize>,
}

impl Block {
    /// True if the block is only the bounds of an obstacle, not the obstacle itself.
    pub fn is_bound(&self) -> bool {
        self.of_box.is_none()
    }
}
