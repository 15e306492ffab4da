//! Fluxes through a tube without a room.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::coverage_factor;
use super::tube::FluxResult;
use crate::document::errors::Warning;
use crate::document::schema::shapes::PlaneOffset;
use crate::integrator::diffuser_source::flux::PatchedFlux;

/// Fluxes that a tube sends into a room, for every requested sky and time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeFluxResult {
    /// Patches of the opening for which fluxes are reported: four rings of six sectors each, or four rows of six parts of a square.
    pub patches: PatchesResult,
    /// Fluxes in the order of skies and then of times.
    pub fluxes: Vec<TubeFluxAt>,
}

/// Patches of an opening, all of equal area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PatchesResult {
    /// Centres of the patches in metres, from the centre of the opening toward east and north (in a room with `rotation_deg` 0); of a tilted
    /// opening along its level direction, and up the slope or the wall.
    #[schema(value_type = Vec<PlaneOffset>)]
    pub centres_m: Vec<[f64; 2]>,
    /// Area of each patch in m2.
    pub area_m2: f64,
}

/// Fluxes under one sky at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeFluxAt {
    /// Number of the sky in the request, from 0.
    pub sky: usize,
    /// Number of the time in the request, from 0; null where the sky has a `sun_position`.
    pub time: Option<usize>,
    /// Apparent altitude of the sun in degrees; null where the sky does not say it.
    pub sun_altitude_deg: Option<f64>,
    /// Azimuth of the sun in degrees, clockwise from north.
    pub sun_azimuth_deg: Option<f64>,
    /// Unobstructed horizontal illuminance of the sky alone, in lux.
    pub sky_horizontal_illuminance_lux: f64,
    /// Unobstructed horizontal illuminance of the sun's beam alone, in lux.
    pub sun_horizontal_illuminance_lux: f64,
    /// Fluxes of the light of the sky; null where there is none.
    pub of_sky: Option<SourceFlux>,
    /// Fluxes of the light of the sun's beam; null where there is none.
    pub of_sun: Option<SourceFlux>,
    /// Warnings about the sky and the time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
}

/// Fluxes of the light of one source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SourceFlux {
    /// Coverage factor of GUM for each standard error here: this number of standard errors is half an interval of 95 %. It is
    /// Student's quantile for one degree of freedom less than passes of photons.
    #[serde(default)]
    pub coverage_factor: Option<f64>,
    /// Flux that arrives at the collector from outside, as in a job's results.
    pub at_collector: FluxResult,
    /// Flux that arrives at the upper side of the diffuser.
    pub at_diffuser: FluxResult,
    /// Flux that leaves the closure downward.
    pub into_room: FluxResult,
    /// Flux `into_room` by patches in lm; they add up to it.
    pub patches_lm: Vec<f64>,
    /// Standard errors of `patches_lm`.
    pub patch_standard_errors_lm: Vec<f64>,
    /// Part of `into_room` that leaves as from a Lambertian surface.
    pub into_room_evenly: FluxResult,
    /// Flux `into_room_evenly` by patches in lm, to which the `responses` of grids refer.
    pub patches_evenly_lm: Vec<f64>,
    /// Standard errors of `patches_evenly_lm`.
    pub patch_standard_errors_evenly_lm: Vec<f64>,
}

impl From<&PatchedFlux> for SourceFlux {
    fn from(flux: &PatchedFlux) -> Self {
        Self {
            coverage_factor: coverage_factor(flux.into_room.count, false),
            at_collector: (&flux.at_collector).into(),
            at_diffuser: (&flux.at_diffuser).into(),
            into_room: (&flux.into_room).into(),
            patches_lm: flux.patches.iter().map(|patch| patch.mean).collect(),
            patch_standard_errors_lm: flux.patches.iter().map(|patch| patch.standard_error()).collect(),
            into_room_evenly: (&flux.evenly).into(),
            patches_evenly_lm: flux.patches_evenly.iter().map(|patch| patch.mean).collect(),
            patch_standard_errors_evenly_lm: flux.patches_evenly.iter().map(|patch| patch.standard_error()).collect(),
        }
    }
}
