//! Settings of the method `light_tracing` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, Setting, optional};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::light_tracing::Settings;
use crate::plan::MethodRequest;

/// Light tracing: photons from the sources, whose vertices are connected to the sensors; grids only.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightTracingMethod {
    /// Photons emitted per pass, for all tubes and sources together; default: 128 to 8192, depending on the requested accuracy.
    pub photons_per_pass: Option<u64>,
}

impl From<&Settings> for LightTracingMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass } = *settings;
        Self { photons_per_pass }
    }
}

impl MethodSettings for LightTracingMethod {
    const NAME: &'static str = "light_tracing";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass } = *self;
        MethodRequest::Method(Method::LightTracing(Settings { photons_per_pass }))
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![optional("photons_per_pass", self.photons_per_pass.map(|photons| photons as f64), PHOTONS_PER_PASS)]
    }
}
