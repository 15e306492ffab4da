//! Sky types that a document can ask for.

use axum::Json;
use serde::Serialize;
use utoipa::ToSchema;

use crate::sky::{CieType, IesSky};

#[derive(Serialize, ToSchema)]
pub struct Skies {
    pub skies: Vec<SkyType>,
    pub presets: Vec<PresetSky>,
}

/// A sky of the IES recommended practice of 1984: a member of the same family of distributions.
#[derive(Serialize, ToSchema)]
pub struct PresetSky {
    /// Value of `sky.preset` in a document.
    pub preset: &'static str,
    pub parameters: SkyParameters,
    /// Extinction of the beam per unit of air mass; null without a beam.
    pub extinction: Option<f64>,
}

/// A sky type of CIE S 011, or the traditional overcast sky.
#[derive(Serialize, ToSchema)]
pub struct SkyType {
    /// Value of `sky.cie_type` in a document.
    #[schema(minimum = 1, maximum = 16)]
    pub cie_type: u8,
    pub description: &'static str,
    /// Parameters of the luminance distribution; null for the traditional overcast sky, which has none.
    pub parameters: Option<SkyParameters>,
    /// True for a type without a direct beam unless the document gives one.
    pub sunless: bool,
    /// True for a type under which results have daylight factors.
    pub daylight_factor: bool,
}

/// Parameters of the luminance L relative to that of the zenith Lz: L/Lz = f(chi) phi(Z) / (f(Zs) phi(0)), phi = 1 + a exp(b / cos
/// Z), f = 1 + c (exp(d chi) - exp(d pi/2)) + e cos^2 chi.
#[derive(Serialize, ToSchema)]
pub struct SkyParameters {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub d: f64,
    pub e: f64,
}

impl From<[f64; 5]> for SkyParameters {
    fn from([a, b, c, d, e]: [f64; 5]) -> Self {
        Self { a, b, c, d, e }
    }
}

/// Lists all sky types and presets with their parameters.
#[utoipa::path(get, path = "/v1/skies", operation_id = "list_skies", tag = "skies",
    responses((status = 200, description = "The sky types in order", body = Skies)))]
pub async fn skies() -> Json<Skies> {
    let skies = CieType::all()
        .map(|cie_type| SkyType {
            cie_type: cie_type.number(),
            description: cie_type.description(),
            parameters: cie_type.parameters().map(SkyParameters::from),
            sunless: cie_type.is_sunless(),
            daylight_factor: cie_type.is_sunless(),
        })
        .collect();
    let presets = IesSky::ALL
        .map(|sky| PresetSky { preset: sky.name(), parameters: sky.parameters().into(), extinction: sky.extinction() })
        .into();
    Json(Skies { skies, presets })
}
