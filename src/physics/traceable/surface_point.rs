//! A point at which light arrives: of a surface, or a sensor.

use glam::DVec3;

use super::SurfaceId;
use crate::optics::Spectrum;
use crate::scene::Sensor;

/// Point of a surface, or a sensor.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position in m.
    pub position: DVec3,
    /// Unit normal toward the room.
    pub normal: DVec3,
    /// Surface of the point; `None` for a sensor.
    pub surface: Option<SurfaceId>,
}

impl From<Sensor> for SurfacePoint {
    fn from(Sensor { position, normal }: Sensor) -> Self {
        Self { position, normal, surface: None }
    }
}

impl SurfacePoint {
    /// Returns the response of a sensor there to light from a direction, per sr: the cosine.
    pub fn cosine<const C: usize>(&self, toward: DVec3) -> Spectrum<C> {
        Spectrum::ONE * toward.dot(self.normal).max(0.0)
    }
}
