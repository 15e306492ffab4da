//! Passage of one ray through a guide: where it enters, where it ends, and its throughput.

use std::iter::Sum;
use std::ops::{Add, AddAssign};

use glam::DVec3;

use crate::optics::Spectrum;

/// Place where a ray through a guide ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Opening, reached on the way down.
    Opening,
    /// Exterior, reached through the collector.
    Top,
    /// No place: absorbed, or outside without ever having passed the collector.
    Absorbed,
    /// Exterior, reached through a gap in the mesh.
    Lost,
    /// No place: the path was truncated for its length.
    Cut,
}

/// Passage of a ray through a guide, with its throughput.
#[derive(Clone, Copy, Debug)]
pub struct Transit<const C: usize> {
    /// Place of the end.
    pub end: End,
    /// Point of the end in the tube's frame, in m.
    pub position: DVec3,
    /// Unit direction of the ray at the end.
    pub direction: DVec3,
    /// Transmittance of the collector for the light that reached it.
    pub collector: Spectrum<C>,
    /// Product of the mirrors' reflectances along the path.
    pub mirrors: Spectrum<C>,
    /// True if the ray reached the collector from outside; light that passes by a mesh never does.
    pub entered: bool,
    /// Number of ray segments computed; a closed form counts as one.
    pub rays: u32,
}

impl<const C: usize> Transit<C> {
    /// Returns the throughput: the fraction of the light that arrives at the end.
    #[inline]
    pub fn weight(&self) -> Spectrum<C> {
        self.collector * self.mirrors
    }
}

impl<const C: usize> Transit<C> {
    /// Returns the number of ray segments of this passage.
    pub fn ray_count(&self) -> RayCount {
        RayCount { followed: u64::from(self.rays), lost: u64::from(self.end == End::Lost) }
    }
}

/// Number of ray segments that were followed, and of rays that were lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCount {
    /// Number of ray segments; a closed form through a guide counts as one.
    pub followed: u64,
    /// Number of rays that left a guide through a gap in its mesh ([`End::Lost`]).
    pub lost: u64,
}

impl Add for RayCount {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { followed: self.followed + other.followed, lost: self.lost + other.lost }
    }
}

impl AddAssign for RayCount {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Adds segments of which none was lost.
impl AddAssign<u64> for RayCount {
    fn add_assign(&mut self, followed: u64) {
        self.followed += followed;
    }
}

impl Sum for RayCount {
    fn sum<I: Iterator<Item = Self>>(counts: I) -> Self {
        counts.fold(Self::default(), Add::add)
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
