//! Settings of the method `bidirectional_path_tracing` in documents.

use std::ops::Bound;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{PHOTONS_PER_PASS, SAMPLES_PER_PIXEL, SAMPLES_PER_SENSOR, Setting, optional, setting};
use super::settings::MethodSettings;
use crate::document::limits::Range;
use crate::integrator::Method;
use crate::integrator::bidirectional::Settings;
use crate::plan::MethodRequest;

/// Bidirectional path tracing: paths from the light sources and from sensors or eye, connected at every pair of vertices;
/// unbiased.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BidirectionalPathTracingMethod {
    /// Photons emitted per pass, for all tubes and sources together; 64 to 1 048 576, because a pass keeps their vertices.
    /// Default: as many as reach the requested accuracy in some ten passes, 256 to 16 384, and 16 384 in jobs with views.
    pub photons_per_pass: Option<u64>,
    /// Eye paths per sensor and pass; default: a 64th of the number of photons.
    pub samples_per_sensor: Option<u32>,
    /// Eye paths per pixel and pass.
    pub samples_per_pixel: u32,
}

impl From<&Settings> for BidirectionalPathTracingMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass, samples_per_sensor, samples_per_pixel } = *settings;
        Self { photons_per_pass, samples_per_sensor, samples_per_pixel }
    }
}

impl Default for BidirectionalPathTracingMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for BidirectionalPathTracingMethod {
    const NAME: &'static str = "bidirectional_path_tracing";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, samples_per_sensor, samples_per_pixel } = *self;
        MethodRequest::Method(Method::Bidirectional(Settings {
            photons_per_pass,
            samples_per_sensor,
            samples_per_pixel,
        }))
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            optional("photons_per_pass", self.photons_per_pass.map(|photons| photons as f64), KEPT_PHOTONS_PER_PASS),
            optional("samples_per_sensor", self.samples_per_sensor.map(f64::from), SAMPLES_PER_SENSOR),
            setting("samples_per_pixel", self.samples_per_pixel, SAMPLES_PER_PIXEL),
        ]
    }
}

/// Range of the photons of a pass, which keeps their vertices in memory.
const KEPT_PHOTONS_PER_PASS: Range = Range { highest: Bound::Included(1_048_576.0), ..PHOTONS_PER_PASS };
