//! The settings of `two_stage` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, SAMPLES_PER_PIXEL, SAMPLES_PER_SENSOR, Setting, optional, setting};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::two_stage::Settings;
use crate::plan::MethodRequest;

/// The path cut at a Lambertian diffuser: photons down the tubes, then backward paths around a coarse radiosity solution. Of grids the light
/// through the clear zones of mixed diffusers is traced beside. Fluxes of tubes are known; a few photons tell where the light
/// of the room ends, so that the balance of energy is rough.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwoStageMethod {
    /// Photons from sky and sun per pass, all tubes together; by default as many as reach the accuracy asked for in about 8 passes,
    /// and 8192 in jobs with views.
    pub photons_per_pass: Option<u64>,
    /// Backward paths per sensor and pass; by default as many as reach the accuracy asked for in about 8 passes, which a small
    /// trial in the room tells.
    pub samples_per_sensor: Option<u32>,
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
            optional("photons_per_pass", self.photons_per_pass.map(|photons| photons as f64), PHOTONS_PER_PASS),
            optional("samples_per_sensor", self.samples_per_sensor.map(f64::from), SAMPLES_PER_SENSOR),
            setting("samples_per_pixel", self.samples_per_pixel, SAMPLES_PER_PIXEL),
        ]
    }
}
