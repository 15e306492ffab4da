//! Settings of the method `two_stage` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, SAMPLES_PER_PIXEL, SAMPLES_PER_SENSOR, Setting, optional, setting};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::two_stage::Settings;
use crate::plan::MethodRequest;

/// Two stages, split at the Lambertian diffusers: photons down the tubes find the light that leaves the diffusers, then backward
/// paths carry it to the sensors and the eye, with a coarse radiosity solution as a control variate. In grids the light through
/// the clear zones of mixed diffusers is traced separately. The fluxes of tubes are computed; the end of the light in the room is
/// estimated from a few photons, so that the energy balance is rough.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwoStageMethod {
    /// Photons from sky and sun per pass, for all tubes together; default: as many as reach the requested accuracy in about 8
    /// passes, and in jobs with views 8192 to 65536, by their pixels.
    pub photons_per_pass: Option<u64>,
    /// Backward paths per sensor and pass; default: as many as reach the requested accuracy in about 8 passes, estimated by a
    /// small trial in the room.
    pub samples_per_sensor: Option<u32>,
    /// Number of backward paths per pixel and pass.
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

    fn numbers(&self) -> Vec<Setting> {
        vec![
            optional("photons_per_pass", self.photons_per_pass.map(|photons| photons as f64), PHOTONS_PER_PASS),
            optional("samples_per_sensor", self.samples_per_sensor.map(f64::from), SAMPLES_PER_SENSOR),
            setting("samples_per_pixel", self.samples_per_pixel, SAMPLES_PER_PIXEL),
        ]
    }
}
