//! Settings of the method `jenkins` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{Setting, optional, setting};
use super::settings::MethodSettings;
use crate::analytic::jenkins::Settings;
use crate::document::limits::{RATIO, Range, above};
use crate::integrator::Method;
use crate::plan::MethodRequest;

/// Semi-empirical formula of Jenkins, Muneer and Kubie, in which the reflections of a room are included; grids only, without an
/// estimate of the error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JenkinsMethod {
    /// Coefficient c of E = c Phi cos^4(theta) / V^2; 1/pi corresponds to a Lambertian disc far away.
    pub coefficient: f64,
    /// Transmission of a pipe with an aspect ratio of 1. Default: the exact transmission, for the daylight of the job, of a
    /// straight tube with this aspect ratio and the tube's reflectance.
    pub pipe_transmittance: Option<f64>,
    /// Factor per bend; required for a tube with bends.
    pub bend_factor: Option<f64>,
}

impl From<&Settings> for JenkinsMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { coefficient, pipe_transmittance, bend_factor } = *settings;
        Self { coefficient, pipe_transmittance, bend_factor }
    }
}

impl Default for JenkinsMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for JenkinsMethod {
    const NAME: &'static str = "jenkins";

    fn request(&self) -> MethodRequest {
        let Self { coefficient, pipe_transmittance, bend_factor } = *self;
        MethodRequest::Method(Method::Jenkins(Settings { coefficient, pipe_transmittance, bend_factor }))
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            setting("coefficient", self.coefficient, COEFFICIENT),
            optional("pipe_transmittance", self.pipe_transmittance, RATIO),
            optional("bend_factor", self.bend_factor, RATIO),
        ]
    }
}

const COEFFICIENT: Range = above(0.0, 10.0);
