//! Settings of the method `sppm` in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{
    ALPHA, INITIAL_RADIUS_M, PHOTONS_PER_PASS, Setting, optional, photons, points_of_grids, points_of_views, setting,
};
use super::radius::RadiusKind;
use super::settings::MethodSettings;
use crate::document::errors::Checks;
use crate::document::outputs::{GridDocument, ViewDocument};
use crate::integrator::Method;
use crate::integrator::sppm::Settings;
use crate::plan::MethodRequest;

/// Stochastic progressive photon mapping: eye rays are new in every pass. The standard error includes the estimated bias.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SppmMethod {
    /// Photons emitted per pass, for all tubes and sources together.
    pub photons_per_pass: u64,
    /// Gather radius of the first pass in metres; default: a twentieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// Factor by which radii shrink, between 0 and 1: the squared radius by (i + alpha) / (i + 1) from pass to pass, or with the
    /// radius `per_point` by (N + alpha M) / (N + M), where N photons were kept and M are found.
    pub alpha: f64,
    /// Rule for the gather radius of a pass.
    pub radius: RadiusKind,
}

impl From<&Settings> for SppmMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass, initial_radius_m, alpha, radius } = *settings;
        Self { photons_per_pass, initial_radius_m, alpha, radius: radius.into() }
    }
}

impl Default for SppmMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for SppmMethod {
    const NAME: &'static str = "sppm";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, initial_radius_m, alpha, radius } = *self;
        MethodRequest::Method(Method::Sppm(Settings {
            photons_per_pass,
            initial_radius_m,
            alpha,
            radius: radius.into(),
        }))
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            photons(self.photons_per_pass, PHOTONS_PER_PASS),
            optional("initial_radius_m", self.initial_radius_m, INITIAL_RADIUS_M),
            setting("alpha", self.alpha, ALPHA),
        ]
    }

    fn check_outputs(&self, grids: &[GridDocument], views: &[ViewDocument], checks: &mut Checks) {
        self.radius.check_points(points_of_grids(grids, 1).saturating_add(points_of_views(views, 1)), checks);
    }
}
