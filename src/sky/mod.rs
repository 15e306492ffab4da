//! The CIE general sky and the sun, in absolute luminance.

pub mod cie;
pub mod sampler;
pub mod sun;
pub mod zenith;

use glam::DVec3;

pub use cie::{CieType, SkyDistribution};
pub use sun::Sun;

/// A CIE general sky of absolute luminance.
#[derive(Clone, Debug)]
pub struct Sky {
    pub distribution: SkyDistribution,
    pub zenith_luminance_cd_m2: f64,
}

impl Sky {
    /// Luminance in cd/m2 seen toward the unit vector `direction` (z up); zero below the horizon.
    #[inline]
    pub fn luminance(&self, direction: DVec3) -> f64 {
        self.zenith_luminance_cd_m2 * self.distribution.relative_luminance(direction)
    }

    /// Unobstructed horizontal illuminance in lux.
    pub fn horizontal_illuminance_lux(&self) -> f64 {
        self.zenith_luminance_cd_m2 * self.distribution.horizontal_ratio()
    }
}

/// Unit vector toward `altitude` above the horizon and `azimuth` clockwise from +y (both radians), z up.
pub fn direction(altitude: f64, azimuth: f64) -> DVec3 {
    let (sin_altitude, cos_altitude) = altitude.sin_cos();
    let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
    DVec3::new(sin_azimuth * cos_altitude, cos_azimuth * cos_altitude, sin_altitude)
}
