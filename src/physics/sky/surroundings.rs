//! Surroundings of a building: what is below its horizon, and the ground.

use glam::DVec3;

use super::Horizon;

/// Light at the upper end of a tube that comes from elsewhere than from the open sky: from below a horizon, and from the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    /// Horizon; `None` where no part of it is above 0.
    pub horizon: Option<Horizon>,
    /// Luminance toward directions below the horizon over the mean luminance of the unobstructed sky, under any daylight.
    pub luminance_ratio: f64,
    /// Reflectance of the ground.
    pub ground_reflectance: f64,
    /// Luminance in cd/m2 toward directions below the horizon and above the horizontal.
    pub luminance_cd_m2: f64,
    /// Luminance of the ground in cd/m2: that of all directions below the horizontal.
    pub ground_luminance_cd_m2: f64,
    /// Largest angle in radians by which the outlines of obstructions in the horizon shift across the upper end; 0 without any.
    pub parallax: f64,
}

impl Surroundings {
    /// Returns the luminance in cd/m2 toward a unit vector that does not point to the open sky; `None` for one that does.
    #[inline]
    pub fn luminance(&self, direction: DVec3) -> Option<f64> {
        if direction.z < 0.0 {
            return Some(self.ground_luminance_cd_m2);
        }
        self.horizon.as_ref().is_some_and(|horizon| horizon.hides(direction)).then_some(self.luminance_cd_m2)
    }
}
