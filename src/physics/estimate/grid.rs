//! Illuminance grids.

use std::sync::Arc;

use super::residual::Residuals;
use crate::analytic::GridSolution;
use crate::integrator::{GridPass, PhotonCount};
use crate::scene::Grid;
use crate::statistics::Moments;

/// Illuminance of one grid in lux: one replicate a pass.
#[derive(Clone, Debug, Default)]
pub struct GridEstimate {
    /// One per sensor, row by row from the south, west to east.
    pub sensors: Vec<Moments>,
    /// Estimated bias per sensor; no replicates for unbiased methods.
    pub bias: Vec<Moments>,
    /// Contrasts among the points of each sensor, equally many of each, where points are the same in every pass; else empty.
    pub contrasts: Vec<Moments>,
    /// Photons that each sensor has found in all passes; zeros for methods that count none.
    pub photons: Vec<PhotonCount>,
    /// Parts of each sensor known from a coarse solution and beyond it, where the method tells them.
    pub residuals: Residuals,
    /// The grid's mean illuminance.
    pub mean: Moments,
    /// The values come from a solver: errors are numerical, and alike at neighbours.
    pub numerical: bool,
    /// The same grid in parts of the light and by another method, as passes have it.
    pub beside: Vec<GridEstimate>,
    /// As of [`Grid::free`]: values are those of the free part of a sensor, and of none there is no value.
    pub free: Option<Arc<[f64]>>,
}

/// Number of photons from which on the spread of the passes tells the error of what they add up to.
const ENOUGH_PHOTONS: f64 = 10.0;

impl GridEstimate {
    /// The estimate of no passes, for a number of sensors.
    pub fn empty(sensors: usize) -> Self {
        let none = vec![Moments::default(); sensors];
        Self {
            sensors: none.clone(),
            bias: none,
            contrasts: Vec::new(),
            photons: vec![PhotonCount::default(); sensors],
            residuals: Residuals::default(),
            mean: Moments::default(),
            numerical: false,
            beside: Vec::new(),
            free: None,
        }
    }

    /// The estimate of no passes of a grid.
    pub fn of(grid: &Grid) -> Self {
        Self { free: grid.free.clone(), ..Self::empty(grid.len()) }
    }

    /// True if a sensor has a value: it lies in no solid.
    #[inline]
    pub fn has_value(&self, sensor: usize) -> bool {
        self.free.as_ref().is_none_or(|free| free[sensor] > 0.0)
    }

    /// The sensors that have a value, in their order: those that statistics are of.
    pub fn valued(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.sensors.len()).filter(|sensor| self.has_value(*sensor))
    }

    /// True if no pass has brought light to any sensor that has a value.
    pub fn is_dark(&self) -> bool {
        let mut valued = self.valued().peekable();
        valued.peek().is_some() && self.mean.count > 0.0 && valued.all(|sensor| self.sensors[sensor].mean == 0.0)
    }

    /// Makes room for what passes give beside values; `start`: a pass of no light.
    pub fn begin(&mut self, start: &GridPass) {
        self.contrasts = vec![Moments::default(); start.contrasts.len()];
        self.residuals = Residuals::of_sensors(start.residual.len());
        let sensors = self.sensors.len();
        let begun = |start: &GridPass| {
            let mut estimate = Self { free: self.free.clone(), ..Self::empty(sensors) };
            estimate.begin(start);
            estimate
        };
        self.beside = start.beside.iter().map(begun).collect();
    }

    /// Adds one pass of the same grid.
    pub fn push(&mut self, pass: &GridPass) {
        let beside = &pass.beside;
        let of_free_parts = self.free.as_ref().map(|free| pass.of_free_parts(free));
        let pass = of_free_parts.as_ref().unwrap_or(pass);
        self.sensors.iter_mut().zip(&pass.illuminance).for_each(|(sensor, value)| sensor.push(*value));
        self.bias.iter_mut().zip(&pass.bias).for_each(|(sensor, value)| sensor.push(*value));
        push_each(&mut self.contrasts, &pass.contrasts);
        self.residuals.push(pass);
        self.photons.iter_mut().zip(&pass.photons).for_each(|(all, of_pass)| all.add(of_pass));
        self.mean.push(self.mean_of(&pass.illuminance));
        self.beside.iter_mut().zip(beside).for_each(|(beside, pass)| beside.push(pass));
    }

    /// Adds the result of a solver: as two replicates whose spread is the numerical error, or as one where nothing is
    /// known of it.
    pub fn push_solution(&mut self, solution: &GridSolution) {
        self.numerical = true;
        let values = solution.illuminance.iter();
        let errors = solution.error.iter().map(|error| Some(*error)).chain(std::iter::repeat(None));
        self.sensors.iter_mut().zip(values.zip(errors)).for_each(|(sensor, (value, error))| {
            push_with_error(sensor, *value, error);
        });
        // the errors of neighbours are alike: their mean, not less
        let error = (!solution.error.is_empty()).then(|| self.mean_of(&solution.error));
        let mean = self.mean_of(&solution.illuminance);
        push_with_error(&mut self.mean, mean, error);
    }

    /// Mean of the values of the sensors that have one.
    fn mean_of(&self, values: &[f64]) -> f64 {
        match &self.free {
            None => values.iter().sum::<f64>() / values.len() as f64,
            Some(_) => {
                let valued = self.valued();
                valued.clone().map(|sensor| values[sensor]).sum::<f64>() / valued.count() as f64
            }
        }
    }

    /// Illuminance of a sensor in lux: the mean over the passes, or by a coarse solution and what sensors have in common beyond it; zero
    /// without any pass.
    pub fn illuminance_lux(&self, sensor: usize) -> f64 {
        if self.residuals.is_empty() { self.sensors[sensor].mean } else { self.residuals.value_and_variance(sensor).0 }
    }

    /// Standard error in lux, the estimated bias and the error of fixed points included, and not below that of few photons, nor below
    /// what one bright photon more would add; infinite with fewer than two passes.
    pub fn standard_error_lux(&self, sensor: usize) -> f64 {
        let error = match self.residuals.is_empty() {
            true => error_with_bias(&self.sensors[sensor], self.bias.get(sensor)),
            false => self.residuals.value_and_variance(sensor).1.sqrt(),
        };
        let error = libm::hypot(error, self.fixed_point_variance(sensor).sqrt());
        error.max(self.error_of_few_photons_lux(sensor)).max(self.brightest_photon_lux(sensor))
    }

    /// Standard error in lux by Poisson's distribution while a sensor has found few photons, and at least what one would add:
    /// passes that find nothing agree to the last digit, whatever light they miss. 0 with enough photons, and where no light
    /// can come.
    pub fn error_of_few_photons_lux(&self, sensor: usize) -> f64 {
        let passes = self.sensors[sensor].count;
        match self.photons.get(sensor) {
            Some(PhotonCount { found, one_lux, .. }) if *found < ENOUGH_PHOTONS && passes > 0.0 => {
                // the mean over the passes of one more in one of them
                found.max(1.0).sqrt() * one_lux / (passes * passes)
            }
            _ => 0.0,
        }
    }

    /// Lux by which one photon more, of the brightest, would raise a sensor's value.
    fn brightest_photon_lux(&self, sensor: usize) -> f64 {
        let passes = self.sensors[sensor].count;
        match self.photons.get(sensor) {
            Some(PhotonCount { brightest_lux, .. }) if passes > 0.0 => brightest_lux / (passes * passes),
            _ => 0.0,
        }
    }

    /// Variance of a sensor's value by the choice of its points, where they are the same in every pass.
    pub fn fixed_point_variance(&self, sensor: usize) -> f64 {
        sampling_variance(contrasts_of(&self.contrasts, self.sensors.len(), sensor)).max(0.0)
    }

    /// Gives `f` every number in a fixed order, to read or to replace: checkpoints store them so.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        let Self { sensors, bias, contrasts, photons, residuals, mean, numerical: _, beside, free: _ } = self;
        sensors.iter_mut().chain(bias).chain(contrasts).chain([mean]).for_each(|moments| moments.for_each_value(f));
        photons
            .iter_mut()
            .flat_map(|PhotonCount { found, one_lux, brightest_lux }| [found, one_lux, brightest_lux])
            .for_each(&mut *f);
        residuals.for_each_value(f);
        beside.iter_mut().for_each(|grid| grid.for_each_value(f));
    }
}

/// Adds one value to each; the first values make room.
pub fn push_each(moments: &mut Vec<Moments>, values: &[f64]) {
    if moments.len() < values.len() {
        moments.resize(values.len(), Moments::default());
    }
    moments.iter_mut().zip(values).for_each(|(moments, value)| moments.push(*value));
}

/// Contrasts of sensor or pixel `index`, where `contrasts` holds those of `count` sensors or pixels.
pub fn contrasts_of(contrasts: &[Moments], count: usize, index: usize) -> &[Moments] {
    let each = contrasts.len() / count.max(1);
    &contrasts[index * each..(index + 1) * each]
}

/// Variance by the choice of fixed points: the sum of squared contrasts minus what the noise of passes adds to them. It
/// may come out negative; it is 0 before the second pass.
pub fn sampling_variance(contrasts: &[Moments]) -> f64 {
    contrasts.iter().filter(|contrast| contrast.count >= 2.0).map(square_without_noise).sum()
}

fn square_without_noise(moments: &Moments) -> f64 {
    moments.mean * moments.mean - moments.variance_of_mean()
}

/// Two values around `value` whose mean has the standard error `error`; one value without it.
pub fn push_with_error(moments: &mut Moments, value: f64, error: Option<f64>) {
    match error {
        None => moments.push(value),
        Some(error) => [value - error, value + error].into_iter().for_each(|value| moments.push(value)),
    }
}

/// Root of the variance of the mean plus the squared bias, from which the bias' own sampling variance is subtracted.
pub fn error_with_bias(value: &Moments, bias: Option<&Moments>) -> f64 {
    let bias = bias.filter(|bias| bias.count >= 2.0);
    let bias_squared = bias.map_or(0.0, |bias| square_without_noise(bias).max(0.0));
    (value.variance_of_mean() + bias_squared).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Passes of one sensor that found photons of 4 lux each, in equal parts of 16 passes.
    fn found(photons: &[f64]) -> GridEstimate {
        let mut estimate = GridEstimate::empty(1);
        for found in photons {
            let count = PhotonCount { found: *found, one_lux: 4.0, brightest_lux: 4.0 };
            let illuminance = vec![4.0 * found];
            estimate.push(&GridPass { illuminance, photons: vec![count], ..GridPass::default() });
        }
        estimate
    }

    /// Nothing found in 16 passes: one photon more would add 4 lux to one of them, 0.25 lux to their mean. Four found, one in
    /// every pass of the first four, are told by their spread and by Poisson's distribution, the larger of which counts;
    /// enough of them by their spread, or by what one more would add.
    #[test]
    fn few_photons_have_the_error_of_their_number() {
        assert!((found(&[0.0; 16]).standard_error_lux(0) - 0.25).abs() < 1e-12);
        let even = found(&[0.5; 16]);
        assert_eq!(even.sensors[0].variance_of_mean(), 0.0);
        assert!((even.standard_error_lux(0) - 8f64.sqrt() * 0.25).abs() < 1e-12);
        assert!((found(&[1.0; 16]).standard_error_lux(0) - 0.25).abs() < 1e-12);
        let spread: Vec<f64> = (0..16).map(|pass| if pass == 0 { 4.0 } else { 0.0 }).collect();
        let bunched = found(&spread);
        assert_eq!(bunched.standard_error_lux(0), bunched.sensors[0].standard_error());
        assert!(found(&[0.0]).standard_error_lux(0).is_infinite());
    }

    /// Where it is known that no light can come, and where a method counts nothing, the spread is all.
    #[test]
    fn what_is_dark_stays_exact() {
        let mut dark = GridEstimate::empty(2);
        for _ in 0..4 {
            let photons = vec![PhotonCount::default(); 2];
            dark.push(&GridPass { illuminance: vec![0.0; 2], photons, ..GridPass::default() });
        }
        assert_eq!((dark.standard_error_lux(0), dark.standard_error_lux(1)), (0.0, 0.0));
        let mut uncounted = GridEstimate::empty(1);
        (0..4).for_each(|_| uncounted.push(&GridPass { illuminance: vec![3.0], ..GridPass::default() }));
        assert_eq!(uncounted.standard_error_lux(0), 0.0);
    }
}
