//! The settings of `lamp_responses`, a former method, in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, SAMPLES_PER_SENSOR, Setting, optional};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::two_stage::Settings;
use crate::plan::MethodRequest;

/// A former method, of which `two_stage` has taken the place: documents that name it are computed by that, and the plan says so.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LampResponsesMethod {
    /// Photons from sky and sun per pass, all tubes together; by default as many as the accuracy asked for needs.
    pub photons_per_pass: Option<u64>,
    /// Backward paths per sensor and pass; by default as many as the accuracy asked for needs.
    pub samples_per_sensor: Option<u32>,
}

impl MethodSettings for LampResponsesMethod {
    const NAME: &'static str = "lamp_responses";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, samples_per_sensor } = *self;
        let settings = Settings { photons_per_pass, samples_per_sensor, ..Settings::default() };
        MethodRequest::InPlaceOf(Self::NAME, Method::TwoStage(settings))
    }

    fn of(_: &Method) -> Option<Self> {
        None
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            optional("photons_per_pass", self.photons_per_pass.map(|photons| photons as f64), PHOTONS_PER_PASS),
            optional("samples_per_sensor", self.samples_per_sensor.map(f64::from), SAMPLES_PER_SENSOR),
        ]
    }
}
