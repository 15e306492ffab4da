//! Light transport through guides, downward and upward.
//!
//! Coordinates are local to a tube: the origin is the centre of the opening, axes are those of the room, z points up. Only bent guides and
//! meshes may have openings that are not level. Weights are deterministic: a ray with N reflections keeps the fraction R^N; only at covers
//! that reflect is one branch chosen.

pub mod beams;
pub mod bent;
pub mod delivery;
pub mod dome;
pub mod equivalent_length;
pub mod exit_moment;
pub mod inner_materials;
mod inner_side;
pub mod mesh;
mod mouth;
pub mod patches;
pub mod performance;
pub mod recognise;
mod recognise_bend;
pub mod skies;
pub mod sky_moments;
pub mod sky_rings;
pub mod straight;
pub mod sun_arcs;
pub mod sun_disc;
#[cfg(test)]
mod test_pipes;
pub mod throughput;
mod transit;
pub mod transmittance;

use glam::DVec3;

pub use bent::BentGuide;
pub use dome::{Dome, DomedGuide};
pub use mesh::{MeshGuide, MeshGuideError};
pub use recognise::{RecognisedCylinder, Section};
pub use straight::StraightGuide;
pub use transit::{End, Entry, RayCount, Transit};

use self::dome::PipeBelow;
use crate::sampling::{NestedCones, PathRandom};

/// Guide and collector of one tube.
#[derive(Clone, Debug)]
pub enum Guide {
    /// One vertical cylinder, in closed form.
    Straight(StraightGuide),
    /// Cylinders with mitred elbows, in closed form between the elbows.
    Bent(BentGuide),
    /// A straight or bent guide under a dielectric dome; boxed, so that other guides need not be as large.
    Domed(Box<DomedGuide>),
    /// Triangles that rays are tested against.
    Mesh(MeshGuide),
}

/// Half-angle in radians below which directions of light that passes a guide are sampled in a cone of their own: samplers of a sky have
/// cells of some 10 degrees about the zenith, and fewer than 1 in 10 of the cosine-distributed rays that leave a closure upward would pass
/// the guide.
const NARROW: f64 = 0.32;

/// Half-angle in radians of the widest of the nested cones about the axis of a guide in which rays up are sampled.
const WIDEST_CONE: f64 = 0.5;

impl Guide {
    /// Returns the number of triangles that rays are tested against; 0 for guides in closed form.
    pub fn triangle_count(&self) -> usize {
        match self {
            Self::Straight(_) | Self::Bent(_) | Self::Domed(_) => 0,
            Self::Mesh(guide) => guide.triangle_count(),
        }
    }

    /// True if both guides are known to pass light alike; meshes are not compared, so false for them.
    pub fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Straight(a), Self::Straight(b)) => a == b,
            (Self::Bent(a), Self::Bent(b)) => a == b,
            (Self::Domed(a), Self::Domed(b)) => a == b,
            _ => false,
        }
    }

    /// Samples an entry point for light that travels along the unit vector `direction`, from a point of the unit square; `None` if such
    /// light cannot enter.
    #[inline]
    pub fn entry(&self, point: [f64; 2], direction: DVec3) -> Option<Entry> {
        match self {
            Self::Straight(guide) => guide.entry(point, direction),
            Self::Bent(guide) => guide.entry(point, direction),
            Self::Domed(guide) => guide.entry(point, direction),
            Self::Mesh(guide) => guide.entry(point, direction),
        }
    }

    /// Returns the area in m2, perpendicular to light along `direction`, over which [`Guide::entry`] distributes its points.
    pub fn projected_area_m2(&self, direction: DVec3) -> f64 {
        self.entry([0.5, 0.5], direction).map_or(0.0, |entry| entry.projected_area_m2)
    }

    /// Returns the half-angle in radians of the cone about the zenith from which nearly all light comes that passes the guide, if that cone
    /// is narrow.
    pub fn narrow_cone(&self) -> Option<f64> {
        self.cone().filter(|half_angle| *half_angle < NARROW)
    }

    /// Returns the nested cones, from that of [`Guide::narrow_cone`] outward, in which rays up are sampled; `None` for guides without a
    /// narrow cone.
    pub fn cones(&self) -> Option<NestedCones> {
        self.narrow_cone().map(|half_angle| NestedCones::new(half_angle, WIDEST_CONE))
    }

    fn cone(&self) -> Option<f64> {
        match self {
            Self::Straight(guide) => guide.cone(),
            Self::Domed(guide) => match &guide.pipe {
                PipeBelow::Straight(guide) => guide.cone(),
                PipeBelow::Bent(_) => None,
            },
            Self::Bent(_) | Self::Mesh(_) => None,
        }
    }

    /// Follows light downward from an entry point.
    #[inline]
    pub fn down<const C: usize>(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Transit<C> {
        match self {
            Self::Straight(guide) => guide.down(position, direction),
            Self::Bent(guide) => guide.down(position, direction),
            Self::Domed(guide) => guide.down(position, direction, random),
            Self::Mesh(guide) => guide.down(position, direction, random),
        }
    }

    /// Follows light upward from a point of the opening (in a level one, z = 0).
    #[inline]
    pub fn up<const C: usize>(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Transit<C> {
        match self {
            Self::Straight(guide) => guide.up(position, direction),
            Self::Bent(guide) => guide.up(position, direction),
            Self::Domed(guide) => guide.up(position, direction, random),
            Self::Mesh(guide) => guide.up(position, direction, random),
        }
    }

    /// True if light that goes up from the opening can come back down.
    pub fn returns_light(&self) -> bool {
        match self {
            Self::Straight(_) => false,
            Self::Domed(guide) => matches!(guide.pipe, dome::PipeBelow::Bent(_)) || guide.dome.index != 1.0,
            Self::Bent(_) | Self::Mesh(_) => true,
        }
    }
}
