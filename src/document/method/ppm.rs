//! Settings of the method `ppm` in documents.

use std::ops::Bound;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::{
    ALPHA, INITIAL_RADIUS_M, PHOTONS_PER_PASS, SAMPLES_PER_PIXEL, SAMPLES_PER_SENSOR, Setting, optional, photons,
    points_of_grids, points_of_views, setting,
};
use super::radius::RadiusKind;
use super::settings::MethodSettings;
use crate::document::errors::Checks;
use crate::document::limits::Range;
use crate::document::outputs::{GridDocument, ViewDocument};
use crate::integrator::Method;
use crate::integrator::ppm::Settings;
use crate::plan::MethodRequest;

/// Progressive photon mapping: eye rays and points of cells are the same in every pass. The standard error includes the error of
/// this choice of points and the estimated bias.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PpmMethod {
    /// Photons emitted per pass, for all tubes and sources together.
    pub photons_per_pass: u64,
    /// Gather radius of the first pass in metres; default: a twentieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// Factor by which radii shrink, between 0 and 1: the squared radius by (i + alpha) / (i + 1) from pass to pass, or with the
    /// radius `per_point` by (N + alpha M) / (N + M), where N photons were kept and M are found.
    pub alpha: f64,
    /// Rule for the gather radius of a pass.
    pub radius: RadiusKind,
    /// Number of fixed points of each cell, for cell averages.
    pub samples_per_sensor: u32,
    /// Number of fixed eye rays of each pixel.
    pub samples_per_pixel: u32,
}

impl From<&Settings> for PpmMethod {
    fn from(settings: &Settings) -> Self {
        let Settings { photons_per_pass, initial_radius_m, alpha, radius, samples_per_sensor, samples_per_pixel } =
            *settings;
        Self { photons_per_pass, initial_radius_m, alpha, radius: radius.into(), samples_per_sensor, samples_per_pixel }
    }
}

impl Default for PpmMethod {
    fn default() -> Self {
        Self::from(&Settings::default())
    }
}

impl MethodSettings for PpmMethod {
    const NAME: &'static str = "ppm";

    fn request(&self) -> MethodRequest {
        let Self { photons_per_pass, initial_radius_m, alpha, radius, samples_per_sensor, samples_per_pixel } = *self;
        MethodRequest::Method(Method::Ppm(Settings {
            photons_per_pass,
            initial_radius_m,
            alpha,
            radius: radius.into(),
            samples_per_sensor,
            samples_per_pixel,
        }))
    }

    fn numbers(&self) -> Vec<Setting> {
        vec![
            photons(self.photons_per_pass, PHOTONS_PER_PASS),
            optional("initial_radius_m", self.initial_radius_m, INITIAL_RADIUS_M),
            setting("alpha", self.alpha, ALPHA),
            setting("samples_per_sensor", self.samples_per_sensor, FIXED_PER_CELL),
            setting("samples_per_pixel", self.samples_per_pixel, FIXED_PER_PIXEL),
        ]
    }

    fn check_outputs(&self, grids: &[GridDocument], views: &[ViewDocument], checks: &mut Checks) {
        let of_grids = points_of_grids(grids, self.samples_per_sensor);
        let of_views = points_of_views(views, self.samples_per_pixel);
        for (name, points) in [("samples_per_sensor", of_grids), ("samples_per_pixel", of_views)] {
            if points > MOST_FIXED_POINTS {
                let detail = format!(
                    "must give at most {MOST_FIXED_POINTS} samples over all sensors or pixels, but gives {points}"
                );
                checks.refuse(format!("/method/{name}"), detail);
            }
        }
        self.radius.check_points(of_grids.saturating_add(of_views), checks);
    }
}

/// Range of the number of fixed points of a cell: at least two, because their error is estimated from their spread.
const FIXED_PER_CELL: Range = Range { lowest: Bound::Included(2.0), ..SAMPLES_PER_SENSOR };
const FIXED_PER_PIXEL: Range = Range { lowest: Bound::Included(2.0), ..SAMPLES_PER_PIXEL };

/// Largest number of fixed points of pixels and cells: their spread takes 6 bytes each, in a few copies.
const MOST_FIXED_POINTS: u64 = 67_108_864;
