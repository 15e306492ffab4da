//! One ray's way through a guide: where it enters, where it ends, and the share of its light that is left.

use glam::DVec3;

use crate::optics::Spectrum;

/// Place where a ray through a guide ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// In the opening (the plane z = 0), on its way down.
    Opening,
    /// Outside, through the collector.
    Top,
    /// Nowhere: absorbed, or outside without ever having passed the collector.
    Lost,
    /// The path was ended for its length.
    Cut,
}

/// A ray's way through a guide.
#[derive(Clone, Copy, Debug)]
pub struct Transit<const C: usize> {
    /// Where the way ended.
    pub end: End,
    /// Point of the end in the tube's frame, in m.
    pub position: DVec3,
    /// Unit direction in which the ray goes on from there.
    pub direction: DVec3,
    /// Share that passes the collector, of the light that reached it.
    pub collector: Spectrum<C>,
    /// Share that the mirrors leave.
    pub mirrors: Spectrum<C>,
    /// True if the ray reached the collector from outside; light that passes by a mesh never does.
    pub entered: bool,
    /// Ray segments computed; a closed form counts as one.
    pub rays: u32,
}

impl<const C: usize> Transit<C> {
    /// Share of the light that arrives at the end.
    #[inline]
    pub fn weight(&self) -> Spectrum<C> {
        self.collector * self.mirrors
    }
}

/// A point where parallel light may enter, and the area it stands for perpendicular to the light.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Start of the ray in the tube's frame, in m.
    pub position: DVec3,
    /// Area perpendicular to the light over which entry points are spread evenly, in m2.
    pub projected_area_m2: f64,
}
