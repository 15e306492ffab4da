//! Settings of the method `photon_mapping` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{INITIAL_RADIUS_M, PHOTONS_PER_PASS, SAMPLES_PER_SENSOR, Setting, optional};
use super::settings::MethodSettings;
use crate::integrator::Method;
use crate::integrator::photon_mapping::Settings;
use crate::plan::MethodRequest;

/// Photon mapping with a fixed gather radius and final gathering. The bias of the radius does not shrink with passes; its
/// estimate is part of the standard error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PhotonMappingMethod {
    /// Photons emitted per pass, for all tubes and sources together; default: as many as reach the requested accuracy in some ten
    /// passes, 2048 to 65 536, and 65 536 in jobs with views.
    pub photons_per_pass: Option<u64>,
    /// Gather radius of every pass in metres; default: a fortieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// Final gather rays per pass, for each sensor and for each point that a pixel's ray meets. Default: 256 for a sensor (with
    /// more than 4096 sensors a million in all, but at least 16 for each) and 16 for a point.
    pub gather_rays: Option<u32>,
}

impl From<&Settings> for PhotonMappingMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass, initial_radius_m, gather_rays } = *settings;
        Self { photons_per_pass, initial_radius_m, gather_rays }
    }
}

impl MethodSettings for PhotonMappingMethod {
    const NAME: &'static str = "photon_mapping";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, initial_radius_m, gather_rays } = *self;
        MethodRequest::Method(Method::PhotonMapping(Settings { photons_per_pass, initial_radius_m, gather_rays }))
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            optional("photons_per_pass", self.photons_per_pass.map(|photons| photons as f64), PHOTONS_PER_PASS),
            optional("initial_radius_m", self.initial_radius_m, INITIAL_RADIUS_M),
            optional("gather_rays", self.gather_rays.map(f64::from), SAMPLES_PER_SENSOR),
        ]
    }
}
