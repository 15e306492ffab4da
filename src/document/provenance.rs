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
    pub formula: ZenithFormulaName,
    /// Of the formula `dv_ev`: the ratio of diffuse to extraterrestrial illuminance, given or typical of the type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dv_ev: Option<f64>,
    /// Of the formula `luminous_turbidity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub luminous_turbidity: Option<f64>,
    pub zenith_luminance_cd_m2: f64,
    /// Unobstructed, of the sky alone.
    pub horizontal_illuminance_lux: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ZenithFormulaName {
    GivenZenithLuminance,
    GivenHorizontalIlluminance,
    DvEv,
    LuminousTurbidity,
    IesHorizontalIlluminance,
}

impl From<ZenithFormula> for ZenithFormulaName {
    fn from(formula: ZenithFormula) -> Self {
        match formula {
            ZenithFormula::GivenZenithLuminance => Self::GivenZenithLuminance,
            ZenithFormula::GivenHorizontalIlluminance => Self::GivenHorizontalIlluminance,
            ZenithFormula::DiffuseRatio { .. } => Self::DvEv,
            ZenithFormula::Turbidity { .. } => Self::LuminousTurbidity,
            ZenithFormula::IesHorizontalIlluminance => Self::IesHorizontalIlluminance,
        }
    }
}

/// The sun's beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SunProvenance {
    pub on: bool,
    pub source: BeamSource,
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
    Turbidity { luminous_turbidity: f64 },
    /// 127.5 klx exp(-c / sin(altitude)).
    Ies { extinction: f64 },
}

/// Refraction of the solar altitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RefractionProvenance {
    /// The altitude comes from place and time, with refraction at 1013.25 mbar and 15 C.
    Applied { airless_altitude_deg: f64 },
    /// The document gives the sun's position, which counts as apparent.
    Given,
}

/// How a tube's guide is represented.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GuideProvenance {
    ClosedFormStraight,
    ClosedFormBent,
    /// A mesh that was recognised as a cylinder and is computed in closed form.
    ClosedFormStraightRecognised,
    /// Traced facet by facet.
    Mesh,
}
