//! What the sensors of a grid get per lumen of the patches of openings.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::{error, rows, value};
use crate::estimate::GridEstimate;
use crate::integrator::room_matrix::PATCHES;

/// Illuminance of the sensors of a grid per lumen of white light that leaves one patch of an opening, evenly over the patch and as
/// from a Lambertian surface: straight, and by way of the room. Of a mixed closure the part of the patch shines that lies in the
/// Lambertian zone; where it has none, all is 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PatchResponse {
    /// Number of the tube in the document, from 0.
    pub tube: usize,
    /// Number of the patch, from 0: as of `patches` of `POST /v1/tubes/flux`.
    pub patch: usize,
    /// Lux per lumen of each sensor, row by row; null inside solids.
    pub lux_per_lumen: Vec<Vec<Option<f64>>>,
    /// Standard errors of these; null inside solids, and before the second pass.
    pub standard_error: Vec<Vec<Option<f64>>>,
}

impl PatchResponse {
    /// The responses that stand beside a grid, which has `columns` sensors in a row and `tubes` above it.
    pub fn all(estimate: &GridEstimate, columns: usize, tubes: usize) -> Vec<Self> {
        let of = |(number, part): (usize, &GridEstimate)| {
            let sensors = 0..part.sensors.len();
            let values: Vec<Option<f64>> = sensors.clone().map(|sensor| value(part, sensor)).collect();
            let errors: Vec<Option<f64>> = sensors.map(|sensor| error(part, sensor)).collect();
            let (tube, patch) = (number / PATCHES, number % PATCHES);
            Self { tube, patch, lux_per_lumen: rows(&values, columns), standard_error: rows(&errors, columns) }
        };
        estimate.beside.iter().take(tubes * PATCHES).enumerate().map(of).collect()
    }
}
