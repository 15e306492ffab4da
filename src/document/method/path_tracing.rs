//! Settings of the method `path_tracing` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{SAMPLES_PER_PIXEL, SAMPLES_PER_SENSOR, Setting, setting};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::path_tracing::Settings;
use crate::plan::MethodRequest;

/// Path tracing: paths from the sensors and the eye backward to the light; unbiased. It computes neither fluxes of tubes nor the
/// energy balance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PathTracingMethod {
    /// Number of paths per sensor and pass.
    pub samples_per_sensor: u32,
    /// Number of paths per pixel and pass.
    pub samples_per_pixel: u32,
}

impl From<&Settings> for PathTracingMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { samples_per_sensor, samples_per_pixel } = *settings;
        Self { samples_per_sensor, samples_per_pixel }
    }
}

impl Default for PathTracingMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for PathTracingMethod {
    const NAME: &'static str = "path_tracing";

    fn request(&self) -> MethodRequest {
        let Self { samples_per_sensor, samples_per_pixel } = *self;
        MethodRequest::Method(Method::PathTracing(Settings { samples_per_sensor, samples_per_pixel }))
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            setting("samples_per_sensor", self.samples_per_sensor, SAMPLES_PER_SENSOR),
            setting("samples_per_pixel", self.samples_per_pixel, SAMPLES_PER_PIXEL),
        ]
    }
}
