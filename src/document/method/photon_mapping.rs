//! The settings of `photon_mapping` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{INITIAL_RADIUS_M, PHOTONS_PER_PASS, SAMPLES_PER_SENSOR, Setting, optional};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::photon_mapping::Settings;
use crate::plan::MethodRequest;

/// Photon maps of one gather radius with final gathering. The bias of the radius does not shrink with passes; its
/// estimate is part of the standard error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PhotonMappingMethod {
    /// Photons emitted per pass, all tubes and sources together; by default as many as reach the accuracy asked for in some ten
    /// passes, 2048 to 65 536, and 65 536 in jobs with views.
    pub photons_per_pass: Option<u64>,
    /// Gather radius of every pass in metres; by default a fortieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// Final gather rays per pass of each sensor and of each point that a pixel's ray meets; by default 256 of a sensor (of
    /// more than 4096 sensors as many as make a million in all, at least 16) and 16 of a point.
    pub gather_rays: Option<u32>,
}

impl From<&Settings> for PhotonMappingMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass, initial_radius_m, gather_rays } = *settings;
        Self { photons_per_pass, initial_radius_m, gather_rays }
    }
}

impl Default for PhotonMappingMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for PhotonMappingMethod {
    const NAME: &'static str = "photon_mapping";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, initial_radius_m, gather_rays } = *self;
        MethodRequest::Method(Method::PhotonMapping(Settings { photons_per_pass, initial_radius_m, gather_rays }))
    }

    fn of(method: &Method) -> Option<Self> {
        match method {
            Method::PhotonMapping(settings) => Some(settings.into()),
            _ => None,
        }
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            optional("photons_per_pass", self.photons_per_pass.map(|photons| photons as f64), PHOTONS_PER_PASS),
            optional("initial_radius_m", self.initial_radius_m, INITIAL_RADIUS_M),
            optional("gather_rays", self.gather_rays.map(f64::from), SAMPLES_PER_SENSOR),
        ]
    }
}
