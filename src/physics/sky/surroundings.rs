//! Surroundings of a building: what is below its horizon, and the ground.

use glam::DVec3;

use super::{Horizon, Sun};

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

/// Part of what the upper end of a tube sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutsidePart {
    /// The sky.
    Sky,
    /// Ground and buildings between the horizontal and the horizon.
    BelowHorizon,
    /// The ground.
    Ground,
}

impl Surroundings {
    /// Returns surroundings that hide as much but give no light.
    pub fn dark(&self) -> Self {
        Self {
            luminance_ratio: 0.0,
            ground_reflectance: 0.0,
            luminance_cd_m2: 0.0,
            ground_luminance_cd_m2: 0.0,
            ..self.clone()
        }
    }

    /// Returns the part that is seen toward a unit vector.
    #[inline]
    pub fn part(&self, direction: DVec3) -> OutsidePart {
        if direction.z < 0.0 {
            OutsidePart::Ground
        } else if self.horizon.as_ref().is_some_and(|horizon| horizon.hides(direction)) {
            OutsidePart::BelowHorizon
        } else {
            OutsidePart::Sky
        }
    }

    /// Returns the luminance of a part relative to that of the sky there, of a uniform sky of the same illuminance, or of white ground.
    pub fn share(&self, part: OutsidePart) -> f64 {
        match part {
            OutsidePart::Sky => 1.0,
            OutsidePart::BelowHorizon => self.luminance_ratio,
            OutsidePart::Ground => self.ground_reflectance,
        }
    }

    /// Returns the sun dimmed as a whole to the fraction of its disc that is above the horizon; `None` where that is 0.
    pub fn dimmed(&self, sun: Sun) -> Option<Sun> {
        let uncovered = self.horizon.as_ref().map_or(1.0, |horizon| horizon.uncovered(&sun));
        let dimmed = Sun { normal_illuminance_lux: uncovered * sun.normal_illuminance_lux, ..sun };
        (dimmed.normal_illuminance_lux > 0.0).then_some(dimmed)
    }

    /// Returns the luminance in cd/m2 toward a unit vector that does not point to the open sky; `None` for one that does.
    #[inline]
    pub fn luminance(&self, direction: DVec3) -> Option<f64> {
        match self.part(direction) {
            OutsidePart::Sky => None,
            OutsidePart::BelowHorizon => Some(self.luminance_cd_m2),
            OutsidePart::Ground => Some(self.ground_luminance_cd_m2),
        }
    }
}
