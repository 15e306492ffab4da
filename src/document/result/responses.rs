//! Responses of a grid's sensors to the patches of openings.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::{error, finite, rows, value};
use crate::estimate::GridEstimate;
use crate::integrator::radiosity::MOMENTS;
use crate::integrator::room_matrix::PATCHES;

/// Illuminance of a grid's sensors per lumen of white light that leaves one patch of an opening, uniformly over the patch and as
/// from a Lambertian surface; direct and interreflected light together. Of a mixed closure only the part of the patch in the
/// Lambertian zone emits; if there is none, all values are 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PatchResponse {
    /// Number of the tube in the document, from 0.
    pub tube: usize,
    /// Number of the patch, from 0, in the order of `patches` of `POST /v1/tubes/flux`.
    pub patch: usize,
    /// Response of each sensor in lux per lumen, row by row; null inside solids.
    pub lux_per_lumen: Vec<Vec<Option<f64>>>,
    /// Standard errors of `lux_per_lumen`; null inside solids, and before the second pass.
    pub standard_error: Vec<Vec<Option<f64>>>,
}

impl PatchResponse {
    /// Returns all responses of an estimate, which has `columns` sensors in a row and `tubes` openings.
    pub fn all(estimate: &GridEstimate, columns: usize, tubes: usize) -> Vec<Self> {
        let of = |(number, part): (usize, &GridEstimate)| {
            let sensors = 0..part.sensors.len();
            let values: Vec<Option<f64>> = sensors.clone().map(|sensor| value(part, sensor)).collect();
            let errors: Vec<Option<f64>> = sensors.map(|sensor| error(part, sensor)).collect();
            let (tube, patch) = (number / PATCHES, number % PATCHES);
            Self { tube, patch, lux_per_lumen: rows(&values, columns), standard_error: rows(&errors, columns) }
        };
        estimate.companions.iter().take(tubes * PATCHES).enumerate().map(of).collect()
    }
}

/// Illuminance of a grid's sensors per lumen of white light that leaves an opening evenly, as from a Lambertian surface; direct and
/// interreflected light together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeResponse {
    /// Number of the tube in the document, from 0; null for one lumen from every tube.
    pub tube: Option<usize>,
    /// Response of each sensor in lux per lumen, row by row; null inside solids and outside the room.
    pub lux_per_lumen: Vec<Vec<Option<f64>>>,
    /// Standard errors of `lux_per_lumen`; null where it is, and before the second pass.
    pub standard_error: Vec<Vec<Option<f64>>>,
    /// First moments of the response along x and y in lux per lumen and radius of the opening; empty for all tubes. Light whose centroid is
    /// c radii away from the centre gives 4 (c_x m_x + c_y m_y) more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moments: Vec<Vec<Vec<Option<f64>>>>,
    /// Standard error of the mean of `lux_per_lumen` over the area of the grid, for all tubes together; left out for one tube, and before the
    /// second pass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_standard_error: Option<f64>,
}

/// Values of the sensors of a grid, row by row.
type Rows = Vec<Vec<Option<f64>>>;

impl TubeResponse {
    /// Returns the responses of an estimate, which has `columns` sensors in a row, to `tubes` openings, and that to all of them.
    pub fn all(estimate: &GridEstimate, columns: usize, tubes: usize) -> Vec<Self> {
        let values = |part: &GridEstimate| -> Rows {
            rows(&(0..part.sensors.len()).map(|sensor| value(part, sensor)).collect::<Vec<_>>(), columns)
        };
        let errors = |part: &GridEstimate| -> Rows {
            rows(&(0..part.sensors.len()).map(|sensor| error(part, sensor)).collect::<Vec<_>>(), columns)
        };
        let Some((to_all, moments)) = estimate.companions.split_first() else { return Vec::new() };
        let moments = moments.chunks(MOMENTS - 1).map(|of_tube| of_tube.iter().map(values).collect());
        let of_tube = |((tube, part), moments): ((usize, &GridEstimate), Vec<Rows>)| Self {
            tube: Some(tube),
            lux_per_lumen: values(part),
            standard_error: errors(part),
            moments,
            mean_standard_error: None,
        };
        let of_tubes = to_all.companions.iter().take(tubes).enumerate().zip(moments).map(of_tube);
        let (lux_per_lumen, standard_error) = (values(to_all), errors(to_all));
        let mean_standard_error = finite(to_all.mean.standard_error());
        let of_all = Self { lux_per_lumen, standard_error, mean_standard_error, ..Self::default() };
        of_tubes.chain([of_all]).collect()
    }
}
