//! The settings of `lamp_responses` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, SAMPLES_PER_SENSOR, Setting, optional, setting};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::lamp_responses::Settings;
use crate::plan::MethodRequest;

/// Photons down the tubes tell the lumens of the patches of each opening, and backward paths in the room what each sensor gets per
/// lumen of each; the latter is kept, and used again where only sky, sun or what is above the openings is another. Below
/// diffusers that are Lambertian at least in part: the rest of the light is traced and added in every pass. Fluxes of tubes are known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LampResponsesMethod {
    /// Photons from sky and sun per pass, all tubes together; by default as many as the accuracy asked for needs.
    pub photons_per_pass: Option<u64>,
    /// Backward paths per sensor and pass.
    pub samples_per_sensor: u32,
}

impl From<&Settings> for LampResponsesMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass, samples_per_sensor, .. } = *settings;
        Self { photons_per_pass, samples_per_sensor }
    }
}

impl Default for LampResponsesMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for LampResponsesMethod {
    const NAME: &'static str = "lamp_responses";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, samples_per_sensor } = *self;
        let settings = Settings { photons_per_pass, samples_per_sensor, ..Settings::default() };
        MethodRequest::Method(Method::LampResponses(settings))
    }

    fn of(method: &Method) -> Option<Self> {
        match method {
            Method::LampResponses(settings) => Some(settings.into()),
            _ => None,
        }
    }

    fn numbers(&self) -> Vec<Setting> {
        let photons = self.photons_per_pass.map(|photons| photons as f64);
        vec![
            optional("photons_per_pass", photons, PHOTONS_PER_PASS),
            setting("samples_per_sensor", self.samples_per_sensor, SAMPLES_PER_SENSOR),
        ]
    }
}
