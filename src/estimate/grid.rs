//! Illuminance grids.

use crate::integrator::GridPass;
use crate::statistics::Moments;

/// Illuminance of one grid in lux: one replicate a pass.
#[derive(Clone, Debug, Default)]
pub struct GridEstimate {
    /// One per sensor, row by row from the south, west to east.
    pub sensors: Vec<Moments>,
    /// Estimated bias per sensor; no replicates for unbiased methods.
    pub bias: Vec<Moments>,
    /// The grid's mean illuminance.
    pub mean: Moments,
}

impl GridEstimate {
    pub fn empty(sensors: usize) -> Self {
        let none = vec![Moments::default(); sensors];
        Self { sensors: none.clone(), bias: none, mean: Moments::default() }
    }

    pub fn push(&mut self, pass: &GridPass) {
        self.sensors.iter_mut().zip(&pass.illuminance).for_each(|(sensor, value)| sensor.push(*value));
        self.bias.iter_mut().zip(&pass.bias).for_each(|(sensor, value)| sensor.push(*value));
        self.mean.push(pass.illuminance.iter().sum::<f64>() / pass.illuminance.len() as f64);
    }

    pub fn merge(&mut self, later: &Self) {
        self.sensors.iter_mut().zip(&later.sensors).for_each(|(all, part)| all.merge(part));
        self.bias.iter_mut().zip(&later.bias).for_each(|(all, part)| all.merge(part));
        self.mean.merge(&later.mean);
    }

    pub fn illuminance_lux(&self, sensor: usize) -> f64 {
        self.sensors[sensor].mean
    }

    /// Standard error in lux, the estimated bias included; infinite with fewer than two passes.
    pub fn standard_error_lux(&self, sensor: usize) -> f64 {
        error_with_bias(&self.sensors[sensor], self.bias.get(sensor))
    }

    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        self.sensors.iter_mut().chain(&mut self.bias).chain([&mut self.mean]).for_each(|m| m.for_each_value(f));
    }
}

/// Root of the variance of the mean plus the squared bias, the latter less its own sampling variance.
pub fn error_with_bias(value: &Moments, bias: Option<&Moments>) -> f64 {
    let bias = bias.filter(|bias| bias.count >= 2.0);
    let bias_squared = bias.map_or(0.0, |bias| (bias.mean * bias.mean - bias.variance_of_mean()).max(0.0));
    (value.variance_of_mean() + bias_squared).sqrt()
}
