//! Estimates of the illuminances of grids.

use std::sync::Arc;

use super::residual::Residuals;
use crate::analytic::GridSolution;
use crate::integrator::{GridPass, PhotonCount};
use crate::scene::{Grid, Responses};
use crate::statistics::Moments;

/// Illuminance of one grid in lux, with one replicate per pass.
#[derive(Clone, Debug, Default)]
pub struct GridEstimate {
    /// Illuminance of each sensor, row by row from the south, west to east.
    pub sensors: Vec<Moments>,
    /// Estimated bias per sensor; no replicates for unbiased methods.
    pub bias: Vec<Moments>,
    /// Contrasts among the points of each sensor, equally many for each, if points are the same in every pass; else empty.
    pub contrasts: Vec<Moments>,
    /// Number of photons that each sensor has found in all passes; zeros for methods that count none.
    pub photons: Vec<PhotonCount>,
    /// Part of each sensor's illuminance from a coarse solution, and the residual beyond it, if the method separates them.
    pub residuals: Residuals,
    /// True for a part of the light of another grid, with which it pools its residuals.
    pub is_part: bool,
    /// The grid's mean illuminance.
    pub mean: Moments,
    /// True if the values come from a solver: errors are then numerical, and similar for neighbours.
    pub numerical: bool,
    /// Illuminance in lx of each sensor at many moments, with what is summed over them, sensor by sensor; else empty.
    pub moments: Vec<Moments>,
    /// Estimates of the same grid by parts of the light and by another method, in the order of [`GridPass::companions`].
    pub companions: Vec<GridEstimate>,
    /// True if the relative error of the first companion counts as that of the grid where it is larger: the response to all tubes, of which a
    /// year is made.
    pub judges_companion: bool,
    /// Fraction of each sensor that no solid covers, as in [`Grid::free`]: the value of a sensor is that of its free part, and a sensor
    /// without such a part has no value.
    pub free: Option<Arc<[f64]>>,
    /// Fraction of each sensor's cell that lies in the room, as in [`Grid::area`]: its weight in statistics.
    pub area: Option<Arc<[f64]>>,
}

/// Number of photons from which on the spread of the passes is a good estimate of the error.
const ENOUGH_PHOTONS: f64 = 10.0;

impl GridEstimate {
    /// Creates the estimate of no passes, for a number of sensors.
    pub fn empty(sensors: usize) -> Self {
        let none = vec![Moments::default(); sensors];
        Self {
            sensors: none.clone(),
            bias: none,
            contrasts: Vec::new(),
            photons: vec![PhotonCount::default(); sensors],
            residuals: Residuals::default(),
            is_part: false,
            mean: Moments::default(),
            numerical: false,
            moments: Vec::new(),
            companions: Vec::new(),
            judges_companion: false,
            free: None,
            area: None,
        }
    }

    /// Creates the estimate of no passes of a grid.
    pub fn of(grid: &Grid) -> Self {
        let (free, area) = (grid.free.clone(), grid.area.clone());
        let judges_companion = grid.responses == Responses::ToTubes;
        Self { free, area, judges_companion, ..Self::empty(grid.len()) }
    }

    /// True if a sensor has a value: some part of it lies in no solid.
    #[inline]
    pub fn has_value(&self, sensor: usize) -> bool {
        self.free.as_ref().is_none_or(|free| free[sensor] > 0.0)
    }

    /// Returns the sensors that have a value, in their order; statistics are taken over these.
    pub fn valued(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.sensors.len()).filter(|sensor| self.has_value(*sensor))
    }

    /// True if no pass has brought light to any sensor that has a value.
    pub fn is_dark(&self) -> bool {
        let mut valued = self.valued().peekable();
        valued.peek().is_some() && self.mean.count > 0.0 && valued.all(|sensor| self.sensors[sensor].mean == 0.0)
    }

    /// Allocates the values that passes compute in addition to illuminances; `start` is a pass without light.
    pub fn begin(&mut self, start: &GridPass) {
        self.contrasts = vec![Moments::default(); start.contrasts.len()];
        self.moments = vec![Moments::default(); start.moments.len()];
        self.residuals = Residuals::of_sensors(start.residual.len(), &start.expected_spreads);
        self.is_part = start.is_part;
        let sensors = self.sensors.len();
        let begun = |start: &GridPass| {
            let mut estimate = Self { free: self.free.clone(), area: self.area.clone(), ..Self::empty(sensors) };
            estimate.begin(start);
            estimate
        };
        self.companions = start.companions.iter().map(begun).collect();
    }

    /// Adds one pass of the same grid.
    pub fn push(&mut self, pass: &GridPass) {
        let companions = &pass.companions;
        let of_free_parts = self.free.as_ref().map(|free| pass.of_free_parts(free));
        let pass = of_free_parts.as_ref().unwrap_or(pass);
        self.sensors.iter_mut().zip(&pass.illuminance).for_each(|(sensor, value)| sensor.push(*value));
        self.bias.iter_mut().zip(&pass.bias).for_each(|(sensor, value)| sensor.push(*value));
        push_each(&mut self.contrasts, &pass.contrasts);
        push_each(&mut self.moments, &pass.moments);
        self.residuals.push(pass);
        self.photons.iter_mut().zip(&pass.photons).for_each(|(all, of_pass)| all.add(of_pass));
        self.mean.push(self.mean_of(&pass.illuminance));
        self.companions.iter_mut().zip(companions).for_each(|(companions, pass)| companions.push(pass));
        self.pool();
    }

    /// Updates the residuals that sensors have in common, and those of parts of the light with them.
    fn pool(&mut self) {
        // a part waits for its whole
        if self.is_part {
            return;
        }
        let pooled = self.residuals.pool(None);
        for part in self.companions.iter_mut().filter(|companion| companion.is_part) {
            part.residuals.pool(Some(pooled));
        }
    }

    /// Adds the result of a solver: as two replicates whose spread is the numerical error, or as one if the error is unknown.
    pub fn push_solution(&mut self, solution: &GridSolution) {
        self.numerical = true;
        let values = solution.illuminance.iter();
        let errors = solution.error.iter().map(|error| Some(*error)).chain(std::iter::repeat(None));
        self.sensors.iter_mut().zip(values.zip(errors)).for_each(|(sensor, (value, error))| {
            push_with_error(sensor, *value, error);
        });
        // the errors of neighbours are similar: that of the mean is their mean, not less
        let error = (!solution.error.is_empty()).then(|| self.mean_of(&solution.error));
        let mean = self.mean_of(&solution.illuminance);
        push_with_error(&mut self.mean, mean, error);
    }

    /// Returns the weight of a sensor in statistics: the fraction of its cell that lies in the room.
    #[inline]
    pub fn weight(&self, sensor: usize) -> f64 {
        self.area.as_ref().map_or(1.0, |area| area[sensor])
    }

    /// Returns the sum of the weights of the sensors that have a value.
    pub fn total_weight(&self) -> f64 {
        self.valued().map(|sensor| self.weight(sensor)).sum()
    }

    /// Returns the mean of the values of the sensors that have one, by their weights.
    fn mean_of(&self, values: &[f64]) -> f64 {
        let weighted = self.valued().map(|sensor| self.weight(sensor) * values[sensor]);
        weighted.sum::<f64>() / self.total_weight()
    }

    /// Returns the illuminance of a sensor in lux: the mean over the passes, or a coarse solution plus a residual that is pooled over
    /// sensors, or 0 where the noise of a residual would make light negative; zero without any pass. A part of the light keeps its noise, so
    /// that parts add up to the whole.
    pub fn illuminance_lux(&self, sensor: usize) -> f64 {
        if self.residuals.is_empty() {
            return self.sensors[sensor].mean;
        }
        let (lux, _) = self.residuals.value_and_variance(sensor);
        if self.is_part { lux } else { lux.max(0.0) }
    }

    /// Returns the standard error in lux, including the estimated bias and the error of fixed points. It is not below that of few photons,
    /// nor below the effect of one more bright photon; infinite with fewer than two passes.
    pub fn standard_error_lux(&self, sensor: usize) -> f64 {
        let error = match self.residuals.is_empty() {
            true => error_with_bias(&self.sensors[sensor], self.bias.get(sensor)),
            false => self.residuals.value_and_variance(sensor).1.sqrt(),
        };
        let error = libm::hypot(error, self.fixed_point_variance(sensor).sqrt());
        error.max(self.error_of_few_photons_lux(sensor)).max(self.brightest_photon_lux(sensor))
    }

    /// Returns the degrees of freedom of the sensors' standard errors, for Student's quantiles: one less than passes; or, where sensors share
    /// a residual, the harmonic mean of those of their variances.
    pub fn degrees_of_freedom(&self) -> f64 {
        let of_passes = self.passes() - 1.0;
        if self.residuals.is_empty() { of_passes } else { of_passes / self.residuals.share_of_few(self.valued()) }
    }

    /// Returns the number of passes that computed the grid.
    pub fn passes(&self) -> f64 {
        self.sensors.first().map_or(0.0, |sensor| sensor.count)
    }

    /// Returns the standard error in lux by Poisson's distribution while a sensor has found few photons, and at least the effect of one
    /// photon: passes that find nothing agree to the last digit, whatever light they miss. Returns 0 with enough photons, and where no
    /// light can come.
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

    /// Returns the lux by which one more photon, of the brightest, would raise a sensor's value.
    fn brightest_photon_lux(&self, sensor: usize) -> f64 {
        let passes = self.sensors[sensor].count;
        match self.photons.get(sensor) {
            Some(PhotonCount { brightest_lux, .. }) if passes > 0.0 => brightest_lux / (passes * passes),
            _ => 0.0,
        }
    }

    /// Returns the variance of a sensor's value by the choice of its points, if they are the same in every pass.
    pub fn fixed_point_variance(&self, sensor: usize) -> f64 {
        sampling_variance(contrasts_of(&self.contrasts, self.sensors.len(), sensor)).max(0.0)
    }

    /// Calls `f` on every number in a fixed order, to read or to replace them, as checkpoints do.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        let Self {
            sensors,
            bias,
            contrasts,
            photons,
            residuals,
            is_part: _,
            mean,
            numerical: _,
            moments,
            companions,
            judges_companion: _,
            free: _,
            area: _,
        } = self;
        sensors
            .iter_mut()
            .chain(bias)
            .chain(contrasts)
            .chain(moments)
            .chain([mean])
            .for_each(|moments| moments.for_each_value(f));
        photons
            .iter_mut()
            .flat_map(|PhotonCount { found, one_lux, brightest_lux }| [found, one_lux, brightest_lux])
            .for_each(&mut *f);
        residuals.for_each_value(f);
        companions.iter_mut().for_each(|grid| grid.for_each_value(f));
        self.pool();
    }
}

/// Adds one value to each of the moments; the first call extends the list.
pub fn push_each(moments: &mut Vec<Moments>, values: &[f64]) {
    if moments.len() < values.len() {
        moments.resize(values.len(), Moments::default());
    }
    moments.iter_mut().zip(values).for_each(|(moments, value)| moments.push(*value));
}

/// Returns the contrasts of sensor or pixel `index` from `contrasts`, which holds those of `count` sensors or pixels.
pub fn contrasts_of(contrasts: &[Moments], count: usize, index: usize) -> &[Moments] {
    let each = contrasts.len() / count.max(1);
    &contrasts[index * each..(index + 1) * each]
}

/// Returns the variance by the choice of fixed points: the sum of squared contrasts minus the part by the noise of passes. It may come out
/// negative; it is 0 before the second pass.
pub fn sampling_variance(contrasts: &[Moments]) -> f64 {
    contrasts.iter().filter(|contrast| contrast.count >= 2.0).map(square_without_noise).sum()
}

fn square_without_noise(moments: &Moments) -> f64 {
    moments.mean * moments.mean - moments.variance_of_mean()
}

/// Adds two values around `value` whose mean has the standard error `error`, or one value if there is no error.
pub fn push_with_error(moments: &mut Moments, value: f64, error: Option<f64>) {
    match error {
        None => moments.push(value),
        Some(error) => [value - error, value + error].into_iter().for_each(|value| moments.push(value)),
    }
}

/// Returns the root of the variance of the mean plus the squared bias, from which the bias' own sampling variance is subtracted.
pub fn error_with_bias(value: &Moments, bias: Option<&Moments>) -> f64 {
    let bias = bias.filter(|bias| bias.count >= 2.0);
    let bias_squared = bias.map_or(0.0, |bias| square_without_noise(bias).max(0.0));
    (value.variance_of_mean() + bias_squared).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the estimate of one sensor after passes that found the given numbers of photons of 4 lux each.
    fn found(photons: &[f64]) -> GridEstimate {
        let mut estimate = GridEstimate::empty(1);
        for found in photons {
            let count = PhotonCount { found: *found, one_lux: 4.0, brightest_lux: 4.0 };
            let illuminance = vec![4.0 * found];
            estimate.push(&GridPass { illuminance, photons: vec![count], ..GridPass::default() });
        }
        estimate
    }

    /// Checks that a dark sensor, whose residual is -0.25 lx by its noise, has no negative light, and an interval that holds darkness; its
    /// parts are noise of either sign, which add up.
    #[test]
    fn no_light_is_negative() {
        let pass = |beyond: f64| {
            let (illuminance, residual, gathered) = (vec![0.5 + beyond], vec![beyond], vec![0.5]);
            GridPass { illuminance, residual, gathered, ..GridPass::default() }
        };
        let part = GridPass { residual: vec![0.0], is_part: true, ..GridPass::default() };
        let companions = vec![part; 2];
        let mut estimate = GridEstimate::empty(1);
        estimate.begin(&GridPass { residual: vec![0.0], companions, ..GridPass::default() });
        for beyond in [-3.0, 1.0, -2.0, 1.0] {
            estimate.push(&GridPass { companions: vec![pass(beyond), pass(2.0)], ..pass(beyond) });
        }
        assert_eq!(estimate.illuminance_lux(0), 0.0);
        assert!(estimate.standard_error_lux(0) > 1.0);
        assert_eq!([0, 1].map(|part| estimate.companions[part].illuminance_lux(0)), [-0.25, 2.5]);
    }

    /// With nothing found in 16 passes, one more photon would add 4 lux to one of them, 0.25 lux to their mean. Of eight found, half a
    /// photon in every pass, the error is the larger one of their spread and Poisson's; of enough photons it is their spread, or the effect
    /// of one more.
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

    /// Sensors that no light can reach, and those of a method that counts no photons, have the spread of the passes as their only error.
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
