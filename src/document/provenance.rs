//! What explains results: the choices by which "correct" answers differ by factors of two.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::sky::zenith::ZenithFormula;

/// The choices that explain factors of two between "correct" answers; part of every result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Provenance {
    /// Null without a sky.
    pub zenith: Option<ZenithProvenance>,
    /// Null without a sky.
    pub sun: Option<SunProvenance>,
    /// Null without a sky.
    pub refraction: Option<RefractionProvenance>,
    /// Whether light reflected between the room's surfaces is in the result.
    pub interreflection: bool,
    /// One per tube.
    pub guides: Vec<GuideProvenance>,
}

/// How the absolute level of the sky was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ZenithProvenance {
    /// Formula, or the given number, that the level comes from.
    pub formula: ZenithFormulaName,
    /// Of the formulas `given_dv_ev` and `dv_ev`: the ratio of diffuse to extraterrestrial horizontal illuminance, given or
    /// typical of the type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dv_ev: Option<f64>,
    /// Of the formula `luminous_turbidity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub luminous_turbidity: Option<f64>,
    /// Luminance of the zenith.
    pub zenith_luminance_cd_m2: f64,
    /// Unobstructed, of the sky alone.
    pub horizontal_illuminance_lux: f64,
    /// Of the formula `dv_ev` under an overcast sky (types 1 to 5 and 16): `horizontal_illuminance_lux` over the mean of
    /// measured overcast skies at the sun's altitude h, 300 + 21 000 sin h lux (IES 1984). Types 1 and 16 have 0.61 to 0.63
    /// above 20 degrees. Absent when the sun is down.
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
    /// Kittler and Darula's fit by the ratio of diffuse to extraterrestrial illuminance that is typical of the type.
    DvEv,
    /// Kittler and Darula's fit by the luminous turbidity.
    LuminousTurbidity,
    /// The diffuse horizontal illuminance of a sky of the IES.
    IesHorizontalIlluminance,
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
        }
    }
}

/// The sun's beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SunProvenance {
    /// True if the beam is in the result.
    pub on: bool,
    /// What the beam's illuminance comes from.
    pub source: BeamSource,
    /// Illuminance of a surface that faces the sun, by the beam alone.
    pub normal_illuminance_lux: f64,
    /// Unobstructed, of the beam alone.
    pub horizontal_illuminance_lux: f64,
    /// Apparent.
    pub altitude_deg: f64,
    /// Clockwise from north, 0..360.
    pub azimuth_deg: f64,
}

/// Where the beam's illuminance comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum BeamSource {
    /// The document.
    Given,
    /// The type of the sky has no sun.
    SunlessType,
    /// 133.8 klx exp(-a m Tv).
    Turbidity {
        /// Luminous turbidity Tv, given or typical of the type.
        luminous_turbidity: f64,
    },
    /// 127.5 klx exp(-c / sin(altitude)).
    Ies {
        /// Extinction c per unit of air mass.
        extinction: f64,
    },
}

/// Refraction of the solar altitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RefractionProvenance {
    /// The altitude comes from place and time, with refraction at 1013.25 mbar and 15 C.
    Applied {
        /// Altitude without refraction.
        airless_altitude_deg: f64,
    },
    /// The document gives the sun's position, which counts as apparent.
    Given,
}

/// How a tube's guide is represented.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GuideProvenance {
    /// A straight cylinder, in closed form from end to end.
    ClosedFormStraight,
    /// Cylinders with elbows, in closed form between the elbows.
    ClosedFormBent,
    /// A mesh that was recognised as a cylinder and is computed in closed form.
    ClosedFormStraightRecognised,
    /// A mesh that was recognised as cylinders with elbows and is computed in closed form between these.
    ClosedFormBentRecognised,
    /// Traced facet by facet.
    Mesh,
}
