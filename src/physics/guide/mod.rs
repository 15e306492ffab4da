//! Guides: how light passes a tube, downward and upward.
//!
//! Coordinates are local to a tube: the origin is the centre of the opening in the ceiling plane, z points up. Weights are
//! deterministic: a ray that meets N mirrors keeps the share R^N; only at covers that reflect is one branch chosen.

pub mod beams;
pub mod bent;
pub mod dome;
pub mod equivalent_length;
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
pub mod straight;
pub mod sun_arcs;
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

use self::dome::Pipe;
use crate::sampling::{NestedCones, PathRandom};

/// One tube's guide and collector.
#[derive(Clone, Debug)]
pub enum Guide {
    /// One vertical cylinder, in closed form.
    Straight(StraightGuide),
    /// Cylinders with mitred elbows, in closed form between the elbows.
    Bent(BentGuide),
    /// Boxed: other guides need not be as large.
    Domed(Box<DomedGuide>),
    /// Triangles, met one by one.
    Mesh(MeshGuide),
}

/// Half-angle in radians below which light that a guide passes is drawn from a cone of its own: samplers of a sky have cells
/// of some 10 degrees about the zenith, and of the rays that leave a closure upward, as the cosine says, fewer than 1 in 10
/// have a way through the guide.
const NARROW: f64 = 0.32;

/// Half-angle in radians up to which cones about the axis of a guide are set apart.
const WIDEST_CONE: f64 = 0.5;

impl Guide {
    /// Facets that rays are tested against; none where the way through is in closed form.
    pub fn triangle_count(&self) -> usize {
        match self {
            Self::Straight(_) | Self::Bent(_) | Self::Domed(_) => 0,
            Self::Mesh(guide) => guide.triangle_count(),
        }
    }

    /// True if light passes both guides alike, as far as that is told by a few numbers: meshes are not compared.
    pub fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Straight(a), Self::Straight(b)) => a == b,
            (Self::Bent(a), Self::Bent(b)) => a == b,
            (Self::Domed(a), Self::Domed(b)) => a == b,
            _ => false,
        }
    }

    /// A point for light that travels along the unit vector `direction`, from a point of the unit square; `None` when
    /// such light cannot enter.
    #[inline]
    pub fn entry(&self, point: [f64; 2], direction: DVec3) -> Option<Entry> {
        match self {
            Self::Straight(guide) => guide.entry(point, direction),
            Self::Bent(guide) => guide.entry(point, direction),
            Self::Domed(guide) => guide.entry(point, direction),
            Self::Mesh(guide) => guide.entry(point, direction),
        }
    }

    /// Area perpendicular to light along `direction` on which [`Guide::entry`] puts its points, in m2.
    pub fn projected_area_m2(&self, direction: DVec3) -> f64 {
        self.entry([0.5, 0.5], direction).map_or(0.0, |entry| entry.projected_area_m2)
    }

    /// Half-angle in radians of the cone about the zenith from which next to all light comes that passes the guide, where that
    /// is narrow.
    pub fn narrow_cone(&self) -> Option<f64> {
        self.cone().filter(|half_angle| *half_angle < NARROW)
    }

    /// That cone and wider ones about it, for rays up; `None` for guides that pass more.
    pub fn cones(&self) -> Option<NestedCones> {
        self.narrow_cone().map(|half_angle| NestedCones::new(half_angle, WIDEST_CONE))
    }

    fn cone(&self) -> Option<f64> {
        match self {
            Self::Straight(guide) => guide.cone(),
            Self::Domed(guide) => match &guide.pipe {
                Pipe::Straight(guide) => guide.cone(),
                Pipe::Bent(_) => None,
            },
            Self::Bent(_) | Self::Mesh(_) => None,
        }
    }

    /// Follows light from an entry point down.
    #[inline]
    pub fn down<const C: usize>(&self, position: DVec3, direction: DVec3, random: &mut PathRandom) -> Transit<C> {
        match self {
            Self::Straight(guide) => guide.down(position, direction),
            Self::Bent(guide) => guide.down(position, direction),
            Self::Domed(guide) => guide.down(position, direction, random),
            Self::Mesh(guide) => guide.down(position, direction, random),
        }
    }

    /// The ways of light from entry points, each `(position, unit direction)`, down; the same as [`Guide::down`] has of each, in less
    /// time. `None` for guides that gain nothing by it.
    pub fn down_together<const C: usize>(&self, rays: &[(DVec3, DVec3)]) -> Option<Vec<Transit<C>>> {
        match self {
            Self::Bent(guide) => Some(guide.down_together(rays)),
            Self::Straight(_) | Self::Domed(_) | Self::Mesh(_) => None,
        }
    }

    /// Follows light from a point of the opening (z = 0, within the opening) up.
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
            Self::Domed(guide) => matches!(guide.pipe, dome::Pipe::Bent(_)) || guide.dome.index != 1.0,
            Self::Bent(_) | Self::Mesh(_) => true,
        }
    }
}
