//! Fluxes of a tube without a room.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::coverage_factor;
use super::tube::FluxResult;
use crate::document::errors::Warning;
use crate::document::schema::shapes::PlaneOffset;
use crate::integrator::lamp::flux::PatchedFlux;

/// What a tube sends into a room, for every sky and time that was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeFluxResult {
    /// The patches of the opening that fluxes are told of: six sectors of each of four rings.
    pub patches: PatchesResult,
    /// Sky by sky, and of each sky time by time.
    pub fluxes: Vec<TubeFluxAt>,
}

/// Patches of equal area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PatchesResult {
    /// Their middles, from the centre of the opening: east and north in a room that is not turned.
    #[schema(value_type = Vec<PlaneOffset>)]
    pub centres_m: Vec<[f64; 2]>,
    /// Area of each.
    pub area_m2: f64,
}

/// The fluxes under one sky at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeFluxAt {
    /// Number of the sky in the request, from 0.
    pub sky: usize,
    /// Number of the time in the request, from 0; null where the sky has a `sun_position`.
    pub time: Option<usize>,
    /// Altitude of the sun, apparent; null where the sky does not say it.
    pub sun_altitude_deg: Option<f64>,
    /// Azimuth of the sun, clockwise from north.
    pub sun_azimuth_deg: Option<f64>,
    /// Unobstructed horizontal illuminance of the sky alone.
    pub sky_horizontal_illuminance_lux: f64,
    /// Unobstructed horizontal illuminance of the beam alone.
    pub sun_horizontal_illuminance_lux: f64,
    /// Light of the sky; null where there is none.
    pub of_sky: Option<SourceFlux>,
    /// Light of the sun's beam; null where there is none.
    pub of_sun: Option<SourceFlux>,
    /// Notes on the sky and the time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
}

/// Fluxes of the light of one source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SourceFlux {
    /// Times each standard error here is half an interval of 95 %: GUM's coverage factor, Student's quantile for one less than the
    /// passes of photons.
    #[serde(default)]
    pub coverage_factor: Option<f64>,
    /// Arrives at the collector from outside, as in a job's results.
    pub at_collector: FluxResult,
    /// Arrives at the diffuser's top.
    pub at_diffuser: FluxResult,
    /// Leaves the closure downward.
    pub into_room: FluxResult,
    /// That by patches; they add up to it.
    pub patches_lm: Vec<f64>,
    /// Standard errors of these.
    pub patch_standard_errors_lm: Vec<f64>,
    /// The part of `into_room` that leaves as from a Lambertian surface.
    pub into_room_evenly: FluxResult,
    /// That by patches: what the `responses` of grids are told for.
    pub patches_evenly_lm: Vec<f64>,
    /// Standard errors of these.
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
