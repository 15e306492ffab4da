//! Illuminance grids.

use crate::statistics::Moments;

/// Illuminance of one grid in lux: one replicate a pass.
#[derive(Clone, Debug, Default)]
pub struct GridEstimate {
    /// One per sensor, row by row from the south, west to east.
    pub sensors: Vec<Moments>,
    /// Estimated bias per sensor; empty for unbiased methods.
    pub bias: Vec<Moments>,
    /// The grid's mean illuminance.
    pub mean: Moments,
}

impl GridEstimate {
    pub fn illuminance_lux(&self, sensor: usize) -> f64 {
        self.sensors[sensor].mean
    }

    /// Standard error in lux, the estimated bias included; infinite with fewer than two passes.
    pub fn standard_error_lux(&self, sensor: usize) -> f64 {
        error_with_bias(&self.sensors[sensor], self.bias.get(sensor))
    }
}

/// Root of the variance of the mean plus the squared bias, the latter less its own sampling variance.
pub fn error_with_bias(value: &Moments, bias: Option<&Moments>) -> f64 {
    let variance = value.variance_of_mean();
    let bias_squared = bias.map_or(0.0, |bias| (bias.mean * bias.mean - bias.variance_of_mean()).max(0.0));
    (variance + bias_squared).sqrt()
}
