//! Sun over a site by hours of its standard time.

use glam::DVec3;
use skyduct_physics::sky::direction;
use skyduct_physics::sky::sun::{self, SunPositionError, UtcInstant};

use crate::calendar::date_of;
use crate::weather::Site;

/// Sine of 5 degrees: at lower altitudes of the sun, light on a level plane says little of the beam.
pub(crate) const SINE_OF_LOW_SUN: f64 = 0.087_155_742_747_658_17;

/// Sun over a site in one year, by NREL's SPA with the refraction of the standard atmosphere at the site's height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunOverSite {
    site: sun::Site,
    utc_offset_hours: f64,
    year: i32,
}

impl SunOverSite {
    /// Returns the sun over a site in a year.
    pub fn new(site: &Site, year: i32) -> Self {
        let Site { latitude_deg, longitude_deg, utc_offset_hours, elevation_m, .. } = *site;
        Self { site: sun::Site::at_height(latitude_deg, longitude_deg, elevation_m), utc_offset_hours, year }
    }

    /// Computes the unit vector toward the apparent centre of the sun, x east, y north, z up.
    ///
    /// `day_of_year` counts from 1, `hour` is in standard time; both may also lie outside of their year and day.
    pub fn at(&self, day_of_year: u16, hour: f64) -> Result<DVec3, SunPositionError> {
        let utc = hour - self.utc_offset_hours;
        let days = (utc / 24.0).floor();
        let (year, (month, day)) = date_of(self.year, i32::from(day_of_year) + days as i32);
        let seconds = (utc - 24.0 * days) * 3600.0;
        let hour = (seconds / 3600.0).floor().clamp(0.0, 23.0);
        let minute = ((seconds - 3600.0 * hour) / 60.0).floor().clamp(0.0, 59.0);
        let instant = UtcInstant {
            year,
            month: u32::from(month),
            day: u32::from(day),
            hour: hour as u32,
            minute: minute as u32,
            second: (seconds - 3600.0 * hour - 60.0 * minute).clamp(0.0, 59.999_999),
        };
        let position = sun::position_from(instant, self.site)?;
        Ok(direction(position.altitude, position.azimuth))
    }
}
