//! The settings of `two_stage` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, SAMPLES_PER_PIXEL, SAMPLES_PER_SENSOR, Setting, photons, setting};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::two_stage::Settings;
use crate::plan::MethodRequest;

/// The path cut at a Lambertian diffuser: photons down the tubes, then backward paths in the room; unbiased. Fluxes of
/// tubes are known, the balance of energy is not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwoStageMethod {
    /// Photons from sky and sun per pass, all tubes together.
    pub photons_per_pass: u64,
    /// Backward paths per sensor and pass.
    pub samples_per_sensor: u32,
    /// Backward paths per pixel and pass.
    pub samples_per_pixel: u32,
}

impl From<&Settings> for TwoStageMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass, samples_per_sensor, samples_per_pixel } = *settings;
        Self { photons_per_pass, samples_per_sensor, samples_per_pixel }
    }
}

impl Default for TwoStageMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for TwoStageMethod {
    const NAME: &'static str = "two_stage";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, samples_per_sensor, samples_per_pixel } = *self;
        MethodRequest::Method(Method::TwoStage(Settings { photons_per_pass, samples_per_sensor, samples_per_pixel }))
    }

    fn of(method: &Method) -> Option<Self> {
        match method {
            Method::TwoStage(settings) => Some(settings.into()),
            _ => None,
        }
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            photons(self.photons_per_pass, PHOTONS_PER_PASS),
            setting("samples_per_sensor", self.samples_per_sensor, SAMPLES_PER_SENSOR),
            setting("samples_per_pixel", self.samples_per_pixel, SAMPLES_PER_PIXEL),
        ]
    }
}
