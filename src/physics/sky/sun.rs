//! The sun: its position (NREL SPA), its beam consistent with the general sky, and its disc.

use std::f64::consts::PI;

use glam::DVec3;
use solar_positioning::time::JulianDate;
use solar_positioning::{Location, RefractionCorrection, SolarPositions, delta_t};

use super::zenith::EXTRATERRESTRIAL_LUX;

/// Half-angle of the solar disc, 959.63 arc seconds, in radians.
pub const HALF_ANGLE: f64 = 959.63 / 3600.0 * PI / 180.0;

/// The sun as a uniform disc of half-angle [`HALF_ANGLE`] around a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector toward the centre of the disc, z up.
    pub direction: DVec3,
    /// Illuminance of a surface that faces the sun, by the beam alone, in lux.
    pub normal_illuminance_lux: f64,
}

impl Sun {
    /// Returns the solid angle of the disc in sr: 4 pi sin^2(half-angle / 2), free of the cancellation of 1 - cos.
    ///
    /// ```
    /// assert!((skyduct_physics::sky::Sun::solid_angle_sr() - 6.79996e-5).abs() < 1e-10);
    /// ```
    pub fn solid_angle_sr() -> f64 {
        let s = libm::sin(0.5 * HALF_ANGLE);
        4.0 * PI * s * s
    }

    /// Computes the luminance of the disc in cd/m2: the normal illuminance over the disc's projected solid angle pi sin^2.
    ///
    /// The extraterrestrial sun of 133.8 klx has 1.97e9 cd/m2:
    ///
    /// ```
    /// use skyduct_physics::sky::Sun;
    ///
    /// let sun = Sun { direction: glam::DVec3::Z, normal_illuminance_lux: 133_800.0 };
    /// assert!((sun.luminance_cd_m2() / 1.9677e9 - 1.0).abs() < 1e-4);
    /// ```
    pub fn luminance_cd_m2(&self) -> f64 {
        let s = libm::sin(HALF_ANGLE);
        self.normal_illuminance_lux / (PI * s * s)
    }

    /// True if the unit vector `direction` points into the disc.
    #[inline]
    pub fn covers(&self, direction: DVec3) -> bool {
        // |direction - centre| = 2 sin(angle / 2): exact where 1 - cos would cancel
        let chord = 2.0 * libm::sin(0.5 * HALF_ANGLE);
        (direction - self.direction).length_squared() <= chord * chord
    }

    /// Computes the horizontal illuminance in lux; zero for a sun at or below the horizon.
    pub fn horizontal_illuminance_lux(&self) -> f64 {
        self.normal_illuminance_lux * self.direction.z.max(0.0)
    }
}

/// A moment of civil time in UTC; `second` may have a fraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UtcInstant {
    /// Year of the Gregorian calendar, also before 1582.
    pub year: i32,
    /// Month, 1..=12.
    pub month: u32,
    /// Day, from 1 to the length of the month.
    pub day: u32,
    /// Hour, 0..=23.
    pub hour: u32,
    /// Minute, 0..=59.
    pub minute: u32,
    /// Second, 0 <= second < 60: leap seconds are not represented.
    pub second: f64,
}

/// Solar position, angles in radians: azimuth clockwise from north, altitude above the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// Apparent altitude in radians, -pi/2..=pi/2, raised by the refraction of the air.
    pub altitude: f64,
    /// Azimuth in radians, 0..=2 pi, clockwise from north.
    pub azimuth: f64,
    /// Altitude without atmosphere in radians.
    pub airless_altitude: f64,
}

/// Error of a solar position: the date, latitude or elevation is out of the algorithm's range.
#[derive(Debug, thiserror::Error)]
#[error("solar position: {0}")]
pub struct SunPositionError(String);

impl From<solar_positioning::Error> for SunPositionError {
    fn from(error: solar_positioning::Error) -> Self {
        Self(error.to_string())
    }
}

/// Place from which the sun is seen, and the state of the air there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Latitude in degrees, -90..=90, north positive.
    pub latitude_deg: f64,
    /// Longitude in degrees, -180..=180, east positive.
    pub longitude_deg: f64,
    /// Height above sea level in metres.
    pub elevation_m: f64,
    /// Air pressure for the refraction, mbar.
    pub pressure_mbar: f64,
    /// Air temperature for the refraction, degrees Celsius.
    pub temperature_c: f64,
}

impl Site {
    /// Returns a site in the standard atmosphere, 1013.25 mbar and 15 C.
    pub fn standard(latitude_deg: f64, longitude_deg: f64, elevation_m: f64) -> Self {
        Self { latitude_deg, longitude_deg, elevation_m, pressure_mbar: 1013.25, temperature_c: 15.0 }
    }

    /// Returns a site with the pressure of its height in the standard atmosphere (ISO 2533: 6.5 K less per km) and 15 C.
    ///
    /// Its table has 898.76 mbar at 1000 m:
    ///
    /// ```
    /// use skyduct_physics::sky::sun::Site;
    ///
    /// assert!((Site::at_height(45.0, 8.0, 1000.0).pressure_mbar - 898.76).abs() < 0.05);
    /// ```
    pub fn at_height(latitude_deg: f64, longitude_deg: f64, elevation_m: f64) -> Self {
        let sea_level = Self::standard(latitude_deg, longitude_deg, elevation_m);
        let warmth = 1.0 - 0.0065 * elevation_m / 288.15;
        Self { pressure_mbar: sea_level.pressure_mbar * libm::pow(warmth, 5.25588), ..sea_level }
    }
}

/// Computes the position of the sun by NREL's SPA (Reda and Andreas 2004) in the standard atmosphere.
///
/// `latitude_deg` -90..=90, `longitude_deg` -180..=180 (east positive), `elevation_m` above sea level. Terrestrial minus universal time
/// is estimated from the date, for years -500..=2999. Fails for a year beyond these, a date that the calendar does not have, and a place
/// out of range.
pub fn position(
    instant: UtcInstant,
    latitude_deg: f64,
    longitude_deg: f64,
    elevation_m: f64,
) -> Result<SunPosition, SunPositionError> {
    position_from(instant, Site::standard(latitude_deg, longitude_deg, elevation_m))
}

/// Computes the position of the sun as [`position`] does, in the air of a site.
pub fn position_from(instant: UtcInstant, site: Site) -> Result<SunPosition, SunPositionError> {
    position_at(instant, delta_t::estimate_from_date(instant.year, instant.month)?, site)
}

/// Computes the position of the sun by NREL's SPA (Reda and Andreas 2004) with a given `delta_t_s`, terrestrial minus universal time in
/// seconds, for years -2000..=6000; the errors are those of [`position`].
///
/// The example that Reda and Andreas (2004) print, zenith angle 50.11162 and azimuth 194.34024 degrees:
///
/// ```
/// use skyduct_physics::sky::sun::{Site, UtcInstant, position_at};
///
/// let instant = UtcInstant { year: 2003, month: 10, day: 17, hour: 19, minute: 30, second: 30.0 };
/// let site = Site {
///     latitude_deg: 39.742476,
///     longitude_deg: -105.1786,
///     elevation_m: 1830.14,
///     pressure_mbar: 820.0,
///     temperature_c: 11.0,
/// };
/// let sun = position_at(instant, 67.0, site)?;
/// assert!((90.0 - sun.altitude.to_degrees() - 50.11162).abs() < 1e-5);
/// assert!((sun.azimuth.to_degrees() - 194.34024).abs() < 1e-5);
/// # Ok::<(), skyduct_physics::sky::sun::SunPositionError>(())
/// ```
pub fn position_at(instant: UtcInstant, delta_t_s: f64, site: Site) -> Result<SunPosition, SunPositionError> {
    let UtcInstant { year, month, day, hour, minute, second } = instant;
    let julian = JulianDate::from_utc(year, month, day, hour, minute, second, delta_t_s)?;
    let location = Location { latitude: site.latitude_deg, longitude: site.longitude_deg };
    let refraction = RefractionCorrection::new(site.pressure_mbar, site.temperature_c)?;
    let then = SolarPositions::new().for_time_from_julian(julian)?;
    let airless = then.at(location, site.elevation_m, None)?;
    let apparent = then.at(location, site.elevation_m, Some(refraction))?;
    Ok(SunPosition {
        altitude: (90.0 - apparent.zenith_angle()).to_radians(),
        azimuth: apparent.azimuth().to_radians(),
        airless_altitude: (90.0 - airless.zenith_angle()).to_radians(),
    })
}

/// Computes the relative optical air mass (Kasten and Young 1989) at an apparent solar altitude in radians, >= 0.
///
/// Their table has 37.92 at the horizon and 0.9997 at the zenith:
///
/// ```
/// use skyduct_physics::sky::sun::air_mass;
///
/// assert!((air_mass(0.0) - 37.92).abs() < 0.005);
/// assert!((air_mass(std::f64::consts::FRAC_PI_2) - 0.9997).abs() < 1e-4);
/// ```
pub fn air_mass(altitude: f64) -> f64 {
    1.0 / (libm::sin(altitude) + 0.50572 * libm::pow(altitude.to_degrees() + 6.07995, -1.6364))
}

/// Computes the normal illuminance of the beam in lux: 133.8 klx exp(-a_v m Tv), a_v = 1 / (9.9 + 0.043 m) with the air mass m.
///
/// `altitude` in radians, the apparent one; zero for a sun at or below the horizon. Source: Kittler, Perez and Darula 1998
/// (docs/physics/sky_and_sun.md#the-sun).
///
/// Air of turbidity 0 dims nothing; type 12 at its typical turbidity has 86.510 klx at 35 degrees:
///
/// ```
/// use skyduct_physics::sky::sun::beam_normal_illuminance_lux;
///
/// let altitude = 35f64.to_radians();
/// assert_eq!(beam_normal_illuminance_lux(altitude, 0.0), 133_800.0);
/// assert!((beam_normal_illuminance_lux(altitude, 2.5) - 86_510.0).abs() < 0.5);
/// ```
pub fn beam_normal_illuminance_lux(altitude: f64, luminous_turbidity: f64) -> f64 {
    if altitude <= 0.0 {
        return 0.0;
    }
    let mass = air_mass(altitude);
    let extinction = 1.0 / (9.9 + 0.043 * mass);
    EXTRATERRESTRIAL_LUX * libm::exp(-extinction * mass * luminous_turbidity)
}
