//! The sky types that a document can ask for.

use axum::Json;
use serde::Serialize;
use utoipa::ToSchema;

use crate::sky::CieType;

#[derive(Serialize, ToSchema)]
pub struct Skies {
    pub skies: Vec<SkyType>,
}

/// A sky type of CIE S 011, or the traditional overcast sky.
#[derive(Serialize, ToSchema)]
pub struct SkyType {
    /// `sky.cie_type` of a document.
    #[schema(minimum = 1, maximum = 16)]
    pub cie_type: u8,
    pub description: &'static str,
    /// Null for the traditional overcast sky, which has none.
    pub parameters: Option<SkyParameters>,
    /// Types without a direct beam unless the document gives one.
    pub sunless: bool,
    /// Types under which results have daylight factors.
    pub daylight_factor: bool,
}

/// L/Lz = f(chi) phi(Z) / (f(Zs) phi(0)), phi = 1 + a exp(b / cos Z), f = 1 + c (exp(d chi) - exp(d pi/2)) + e cos^2 chi.
#[derive(Serialize, ToSchema)]
pub struct SkyParameters {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub d: f64,
    pub e: f64,
}

/// All sky types with their parameters.
#[utoipa::path(get, path = "/v1/skies", operation_id = "list_skies", tag = "skies",
    responses((status = 200, description = "The sky types in order", body = Skies)))]
pub async fn skies() -> Json<Skies> {
    let skies = CieType::all()
        .map(|cie_type| SkyType {
            cie_type: cie_type.number(),
            description: cie_type.description(),
            parameters: cie_type.parameters().map(|[a, b, c, d, e]| SkyParameters { a, b, c, d, e }),
            sunless: cie_type.is_sunless(),
            daylight_factor: cie_type.is_standard_overcast(),
        })
        .collect();
    Json(Skies { skies })
}
