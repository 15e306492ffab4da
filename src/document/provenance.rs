//! Provenance of results: the modelling choices by which correct answers to the same question can differ by factors of two.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::sky::zenith::ZenithFormula;

/// Modelling choices behind a result, by which correct answers to the same question can differ by factors of two; part of every
/// result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Provenance {
    /// Absolute level of the sky; null without a sky.
    pub zenith: Option<ZenithProvenance>,
    /// Position and illuminance of the sun; null without a sky.
    pub sun: Option<SunProvenance>,
    /// Refraction of the solar altitude; null without a sky.
    pub refraction: Option<RefractionProvenance>,
    /// True if light reflected between the room's surfaces is in the result.
    pub interreflection: bool,
    /// Representation of each tube's guide, in the order of the document.
    pub guides: Vec<GuideProvenance>,
}

/// Absolute level of the sky and the formula that it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ZenithProvenance {
    /// Formula, or the given quantity, that the level comes from.
    pub formula: ZenithFormulaName,
    /// Ratio of diffuse to extraterrestrial horizontal illuminance, given or typical of the sky type; only with the formulas
    /// `given_dv_ev` and `dv_ev`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dv_ev: Option<f64>,
    /// Luminous turbidity, given or typical of the sky type; only with the formula `luminous_turbidity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub luminous_turbidity: Option<f64>,
    /// Clearness of the all-weather sky of Perez, 1 (overcast) to 12; only with `perez`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearness: Option<f64>,
    /// Brightness of the all-weather sky of Perez, 0.01 to 0.6; only with `perez`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brightness: Option<f64>,
    /// Luminance of the zenith in cd/m2; 0 when the sun is below the horizon.
    pub zenith_luminance_cd_m2: f64,
    /// Unobstructed horizontal illuminance of the sky without the sun, in lux.
    pub horizontal_illuminance_lux: f64,
    /// Ratio of `horizontal_illuminance_lux` to the mean of measured overcast skies at the sun's altitude h, 300 + 21 000 sin h
    /// lux (IES 1984); only with the formula `dv_ev` under an overcast sky (types 1 to 5 and 16). Types 1 and 16 have 0.61 to
    /// 0.63 above 20 degrees. Absent when the sun is below the horizon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratio_to_mean_overcast: Option<f64>,
}

/// Source of a sky's absolute level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ZenithFormulaName {
    /// The document gives the luminance of the zenith.
    GivenZenithLuminance,
    /// The document gives the diffuse horizontal illuminance.
    GivenHorizontalIlluminance,
    /// The document gives the ratio of diffuse to extraterrestrial horizontal illuminance, which holds exactly.
    GivenDvEv,
    /// Kittler and Darula's fit by the ratio of diffuse to extraterrestrial horizontal illuminance that is typical of the sky
    /// type.
    DvEv,
    /// Kittler and Darula's fit by the luminous turbidity.
    LuminousTurbidity,
    /// Formula of the IES for the diffuse horizontal illuminance of its sky.
    IesHorizontalIlluminance,
    /// Diffuse horizontal irradiance times the luminous efficacy of Perez et al. (1990).
    LuminousEfficacy,
}

impl From<ZenithFormula> for ZenithFormulaName {
    fn from(formula: ZenithFormula) -> Self {
        match formula {
            ZenithFormula::GivenZenithLuminance => Self::GivenZenithLuminance,
            ZenithFormula::GivenHorizontalIlluminance => Self::GivenHorizontalIlluminance,
            ZenithFormula::GivenDiffuseRatio { .. } => Self::GivenDvEv,
            ZenithFormula::TypicalDiffuseRatio { .. } => Self::DvEv,
            ZenithFormula::Turbidity { .. } => Self::LuminousTurbidity,
            ZenithFormula::IesHorizontalIlluminance => Self::IesHorizontalIlluminance,
            ZenithFormula::LuminousEfficacy => Self::LuminousEfficacy,
        }
    }
}

/// Position of the sun and illuminance of its beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SunProvenance {
    /// True if the beam is in the result.
    pub on: bool,
    /// Source of the beam's illuminance.
    pub source: BeamSource,
    /// Illuminance in lux, by the beam alone, of a surface that faces the sun.
    pub normal_illuminance_lux: f64,
    /// Unobstructed horizontal illuminance of the beam alone, in lux.
    pub horizontal_illuminance_lux: f64,
    /// Apparent altitude of the sun in degrees; absent where the document gives no position, because the light does not depend on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub altitude_deg: Option<f64>,
    /// Azimuth of the sun in degrees, clockwise from north, 0..360; absent as the altitude is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub azimuth_deg: Option<f64>,
}

impl SunProvenance {
    /// Returns altitude and azimuth in degrees; `None` where the document gives no position.
    pub fn position_deg(&self) -> Option<[f64; 2]> {
        Some([self.altitude_deg?, self.azimuth_deg?])
    }
}

/// Source of the beam's illuminance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum BeamSource {
    /// The document gives the illuminance.
    Given,
    /// The sky type has no sun.
    SunlessType,
    /// Formula of the turbidity: 133.8 klx exp(-a m Tv).
    Turbidity {
        /// Luminous turbidity Tv, given or typical of the sky type.
        luminous_turbidity: f64,
    },
    /// Formula of the IES: 127.5 klx exp(-c / sin(altitude)).
    Ies {
        /// Extinction c per unit of air mass.
        extinction: f64,
    },
    /// Direct normal irradiance times the luminous efficacy of Perez et al. (1990).
    LuminousEfficacy,
}

/// Refraction of the solar altitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RefractionProvenance {
    /// The altitude is computed from location and time, with refraction at 1013.25 mbar and 15 C.
    Applied {
        /// Altitude in degrees without refraction.
        airless_altitude_deg: f64,
    },
    /// The document gives the sun's position, which is taken as the apparent one.
    Given,
    /// The document gives no position: the light does not depend on where the sun is.
    NotNeeded,
}

/// Representation of a tube's guide.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GuideProvenance {
    /// A straight cylinder, computed in closed form from end to end.
    ClosedFormStraight,
    /// Cylinders joined by elbows, computed in closed form between the elbows.
    ClosedFormBent,
    /// A mesh that was recognised as a straight cylinder and is computed in closed form.
    ClosedFormStraightRecognised,
    /// A mesh that was recognised as cylinders joined by elbows and is computed in closed form between the elbows.
    ClosedFormBentRecognised,
    /// A mesh whose facets are traced one by one.
    Mesh,
}
