//! The settings of `placed_vertices` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, Setting, optional};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::placed_vertices::Settings;
use crate::plan::MethodRequest;

/// Photons down the tubes, then points placed on the surfaces of the room, where these are bright and near to sensors, each
/// connected to all sensors; unbiased. Where boxes stand in the room, sensors gather light by rays from a coarse radiosity solution,
/// and the points send the residual. Points of grids in rooms of diffuse surfaces, below Lambertian diffusers; light through the
/// clear zones of mixed ones is traced beside. Fluxes of tubes are known; a few photons tell where the light of the room ends, so that the balance of energy is rough.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlacedVerticesMethod {
    /// Photons from sky and sun per pass, all tubes together; by default as many as reach the accuracy asked for in about 8
    /// passes.
    pub photons_per_pass: Option<u64>,
    /// Points on the surfaces of the room per pass; by default as many as reach the accuracy asked for in about 8 passes.
    pub vertices_per_pass: Option<u64>,
}

impl From<&Settings> for PlacedVerticesMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass, vertices_per_pass } = *settings;
        Self { photons_per_pass, vertices_per_pass }
    }
}

impl Default for PlacedVerticesMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for PlacedVerticesMethod {
    const NAME: &'static str = "placed_vertices";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, vertices_per_pass } = *self;
        MethodRequest::Method(Method::PlacedVertices(Settings { photons_per_pass, vertices_per_pass }))
    }

    fn of(method: &Method) -> Option<Self> {
        match method {
            Method::PlacedVertices(settings) => Some(settings.into()),
            _ => None,
        }
    }

    fn numbers(&self) -> Vec<Setting> {
        let number = |value: Option<u64>| value.map(|value| value as f64);
        vec![
            optional("photons_per_pass", number(self.photons_per_pass), PHOTONS_PER_PASS),
            optional("vertices_per_pass", number(self.vertices_per_pass), PHOTONS_PER_PASS),
        ]
    }
}
