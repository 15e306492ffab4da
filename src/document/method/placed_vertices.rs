//! Settings of the former method `placed_vertices` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, Setting, optional};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::two_stage::Settings;
use crate::plan::MethodRequest;

/// Former method that `two_stage` has replaced: documents that name it are computed by `two_stage`, as the plan states.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlacedVerticesMethod {
    /// Photons from sky and sun per pass, for all tubes together; default: as many as reach the requested accuracy in about 8
    /// passes.
    pub photons_per_pass: Option<u64>,
    /// Former setting that no longer has any effect.
    pub vertices_per_pass: Option<u64>,
}

impl MethodSettings for PlacedVerticesMethod {
    const NAME: &'static str = "placed_vertices";

    fn request(&self) -> MethodRequest {
        let settings = Settings { photons_per_pass: self.photons_per_pass, ..Settings::default() };
        MethodRequest::InPlaceOf(Self::NAME, Method::TwoStage(settings))
    }

    fn numbers(&self) -> Vec<Setting> {
        let number = |value: Option<u64>| value.map(|value| value as f64);
        vec![
            optional("photons_per_pass", number(self.photons_per_pass), PHOTONS_PER_PASS),
            optional("vertices_per_pass", number(self.vertices_per_pass), PHOTONS_PER_PASS),
        ]
    }
}
