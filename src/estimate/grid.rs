//! Illuminance grids.

use crate::analytic::GridSolution;
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

    /// Adds the result of a solver: as two replicates whose spread is the numerical error, or as one where nothing is
    /// known of it.
    pub fn push_solution(&mut self, solution: &GridSolution) {
        let values = solution.illuminance.iter();
        let errors = solution.error.iter().map(|error| Some(*error)).chain(std::iter::repeat(None));
        self.sensors.iter_mut().zip(values.zip(errors)).for_each(|(sensor, (value, error))| {
            push_with_error(sensor, *value, error);
        });
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        // the errors of neighbours are alike: their mean, not less
        let error = (!solution.error.is_empty()).then(|| mean(&solution.error));
        push_with_error(&mut self.mean, mean(&solution.illuminance), error);
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

/// Two values around `value` whose mean has the standard error `error`; one value without it.
pub fn push_with_error(moments: &mut Moments, value: f64, error: Option<f64>) {
    match error {
        None => moments.push(value),
        Some(error) => [value - error, value + error].into_iter().for_each(|value| moments.push(value)),
    }
}

/// Root of the variance of the mean plus the squared bias, the latter less its own sampling variance.
pub fn error_with_bias(value: &Moments, bias: Option<&Moments>) -> f64 {
    let bias = bias.filter(|bias| bias.count >= 2.0);
    let bias_squared = bias.map_or(0.0, |bias| (bias.mean * bias.mean - bias.variance_of_mean()).max(0.0));
    (value.variance_of_mean() + bias_squared).sqrt()
}
