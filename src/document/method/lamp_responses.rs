//! Settings of the former method `lamp_responses` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, SAMPLES_PER_SENSOR, Setting, optional};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::two_stage::Settings;
use crate::plan::MethodRequest;

/// Former method that `two_stage` has replaced: documents that name it are computed by `two_stage`, as the plan states.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LampResponsesMethod {
    /// Photons from sky and sun per pass, for all tubes together; default: as many as the requested accuracy needs.
    pub photons_per_pass: Option<u64>,
    /// Backward paths per sensor and pass; default: as many as the requested accuracy needs.
    pub samples_per_sensor: Option<u32>,
}

impl MethodSettings for LampResponsesMethod {
    const NAME: &'static str = "lamp_responses";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, samples_per_sensor } = *self;
        let settings = Settings { photons_per_pass, samples_per_sensor, ..Settings::default() };
        MethodRequest::InPlaceOf(Self::NAME, Method::TwoStage(settings))
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            optional("photons_per_pass", self.photons_per_pass.map(|photons| photons as f64), PHOTONS_PER_PASS),
            optional("samples_per_sensor", self.samples_per_sensor.map(f64::from), SAMPLES_PER_SENSOR),
        ]
    }
}
