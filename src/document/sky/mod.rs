//! Location and sky of a job document: sky and sun ([`daylight`]), times ([`time`]), and time zones ([`time_zone`]).

pub(super) mod check;
pub mod daylight;
pub mod perez;
pub mod time;
pub mod time_zone;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::sky::{CieType, IesSky, SkyType};

pub use perez::PerezDocument;

/// A location on Earth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LocationDocument {
    /// Latitude in degrees, north positive.
    pub latitude_deg: f64,
    /// Longitude in degrees, east positive.
    pub longitude_deg: f64,
    /// Height above sea level in metres; default: 0.
    #[serde(default)]
    pub elevation_m: f64,
}

/// The sky, its absolute level and the sun; exactly one of `cie_type`, `preset` and `perez` selects the sky.
///
/// At most one of `zenith_luminance_cd_m2`, `diffuse_horizontal_illuminance_lux`, `dv_ev` and `luminous_turbidity` sets the
/// level. With none of them it follows from the typical Dv/Ev for types 1 to 6 and 16, from the typical turbidity for types 7 to
/// 15, from their own formulae for the presets, and from the luminous efficacy for `perez`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SkyDocument {
    /// Number of the CIE sky type: 1..15 for the CIE general sky, 16 for the traditional overcast sky.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cie_type: Option<u8>,
    /// Sky of the IES, in place of a CIE type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<SkyPreset>,
    /// All-weather sky of Perez, in place of a CIE type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perez: Option<PerezDocument>,
    /// Position of the sun, in place of `location` and `time`. None of them is needed under a sky whose luminances are the same wherever the
    /// sun is (`cie_type` 1, 3, 5 and 16, preset `ies_overcast`), with a given luminance or illuminance and without a beam.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun_position: Option<SunPositionDocument>,
    /// Luminance of the zenith in cd/m2, 0..1e9.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zenith_luminance_cd_m2: Option<f64>,
    /// Unobstructed horizontal illuminance of the sky without the sun in lux, 0..1e9.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diffuse_horizontal_illuminance_lux: Option<f64>,
    /// Ratio of diffuse horizontal to extraterrestrial horizontal illuminance (133.8 klx times the sine of the sun's altitude);
    /// only for CIE types.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dv_ev: Option<f64>,
    /// Luminous turbidity, only for types 7 to 15.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub luminous_turbidity: Option<f64>,
    /// Normal illuminance of the sun's beam (a disc of half-angle 0.26656 degrees) in lux; 0 for no sun. Default: by the
    /// turbidity, but 0 for types 1 to 6, 9 and 16; for presets by the extinction of the IES; for `perez` by the luminous efficacy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direct_normal_illuminance_lux: Option<f64>,
}

/// Sky of the IES recommended practice of 1984.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SkyPreset {
    /// Overcast sky without sun, nearly three times as bright at the zenith as at the horizon.
    IesOvercast,
    /// Partly cloudy sky with a weak sun.
    IesPartlyCloudy,
    /// Clear sky with a strong sun.
    IesClear,
}

impl SkyPreset {
    /// Returns the sky that the preset names.
    pub fn sky(self) -> IesSky {
        match self {
            Self::IesOvercast => IesSky::Overcast,
            Self::IesPartlyCloudy => IesSky::PartlyCloudy,
            Self::IesClear => IesSky::Clear,
        }
    }
}

impl SkyDocument {
    /// CIE standard overcast sky of 10 000 lx, under which jobs with a year compute daylight factors; its sun gives no light.
    pub(super) const OF_DAYLIGHT_FACTORS: Self = Self {
        cie_type: Some(1),
        preset: None,
        perez: None,
        sun_position: Some(SunPositionDocument { altitude_deg: 45.0, azimuth_deg: 180.0 }),
        zenith_luminance_cd_m2: None,
        diffuse_horizontal_illuminance_lux: Some(10_000.0),
        dv_ev: None,
        luminous_turbidity: None,
        direct_normal_illuminance_lux: Some(0.0),
    };

    /// True if the light depends on where the sun is: unless the sky has no indicatrix, its level is given, and there is no beam.
    pub fn needs_sun(&self) -> bool {
        let has_level = self.zenith_luminance_cd_m2.is_some() || self.diffuse_horizontal_illuminance_lux.is_some();
        let has_beam = self.direct_normal_illuminance_lux.is_some_and(|beam| beam > 0.0);
        // parameters of measurements follow from the sun's altitude
        let depends = self.perez.is_some() || self.sky_type(DVec3::Z, None).is_none_or(SkyType::depends_on_sun);
        !has_level || has_beam || depends
    }

    /// Returns the sky's type under a sun at the unit vector `sun`, at `time` in RFC 3339; `None` if the document names none, two, or one that
    /// does not exist.
    pub fn sky_type(&self, sun: DVec3, time: Option<&str>) -> Option<SkyType> {
        match (self.cie_type, self.preset, &self.perez) {
            (Some(number), None, None) => CieType::new(number).map(SkyType::Cie),
            (None, Some(preset), None) => Some(SkyType::Ies(preset.sky())),
            (None, None, Some(perez)) => Some(perez.state(sun, time).sky_type()),
            _ => None,
        }
    }
}

/// Apparent position of the sun's centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SunPositionDocument {
    /// Altitude in degrees above the horizon, -90..90.
    pub altitude_deg: f64,
    /// Azimuth in degrees, clockwise from north.
    pub azimuth_deg: f64,
}
