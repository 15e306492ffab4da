//! Sky and sun of one of many moments, such as those of a year.

use glam::DVec3;

use super::SkyDistribution;

/// Sky and sun of a moment, in the room's frame.
#[derive(Clone, Debug)]
pub struct SkyMoment {
    /// Luminance of the sky relative to its zenith.
    pub distribution: SkyDistribution,
    /// Horizontal illuminance of the sky in lux.
    pub diffuse_horizontal_lux: f64,
    /// Unit vector toward the sun.
    pub sun: DVec3,
    /// Illuminance of the sun in lux, normal to its light.
    pub direct_normal_lux: f64,
    /// Hours for which the moment stands.
    pub hours: f64,
    /// Hours of these in which the room is occupied.
    pub occupied_hours: f64,
}

/// Moments of several years at which grids are computed.
#[derive(Clone, Debug, Default)]
pub struct Moments {
    /// Moments of each year.
    pub years: Vec<Vec<SkyMoment>>,
    /// True for the light of the closures alone that let some pass with its direction: that of Lambertian ones is known by responses.
    pub of_directional_alone: bool,
    /// True if ground and buildings around give light, as they do below a sky.
    pub surroundings_shine: bool,
}
