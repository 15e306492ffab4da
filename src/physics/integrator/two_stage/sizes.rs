//! Sizes of a pass: photons, the paths of each grid and of pixels; of a trial before it; and of patches.

use super::sample_counts::{SampleCounts, TIME_BEYOND};
use super::variances::{PASSES, RelativeVariances};
use crate::integrator::pass::LEAST_SENSORS;

/// Time of a trial of every sensor as a fraction of that of the passes, and its fewest and most passes: with fewer than the first the job
/// is too short to gain by it.
const SHARE_OF_TRIAL: f64 = 0.1;
const TRIAL_PASSES: [f64; 2] = [4.0, 64.0];

/// Rays of a coarse solution as a fraction of those of all passes of views.
const SHARE_OF_PATCHES: f64 = 0.25;

/// Time of a ray or connection of a coarse solution, in that of a sensor's ray that ends at the first surface.
const TIME_OF_EXCHANGE: f64 = 1.5;

/// Smallest factor by which edges of patches get shorter than at first, and the number of factors that are compared.
const FINEST: f64 = 0.15;
const FACTORS: u32 = 16;

/// Numbers of photons, paths and connections of a pass.
#[derive(Clone, Debug)]
pub struct Sizes {
    /// Number of photons down the tubes.
    pub photons: u64,
    /// Numbers of each grid: each must reach the accuracy, and sensors of one grid do not serve another.
    pub grids: Vec<SampleCounts>,
    /// Number of paths from each pixel.
    pub per_pixel: u32,
}

impl Sizes {
    /// Returns the time of a pass of grids of these numbers of sensors, in that of a ray that ends at the first surface.
    fn time(&self, sensors: &[usize]) -> f64 {
        self.grids.iter().zip(sensors).map(|(counts, sensors)| counts.time_of_sensor() * *sensors as f64).sum()
    }

    /// Returns the number of passes of a trial of every sensor; `None` where jobs with these sizes are too short for it.
    pub fn trial_of_all(&self, sensors: &[usize]) -> Option<u64> {
        let [fewest, most] = TRIAL_PASSES;
        let trial = SampleCounts::TRIAL.time_of_sensor() * sensors.iter().sum::<usize>() as f64;
        let passes = SHARE_OF_TRIAL * PASSES * self.time(sensors) / trial;
        (passes >= fewest).then_some(passes.min(most) as u64)
    }

    /// Returns the factor, at most 1, by which edges of patches should be shorter than those of a coarse solution that took `rays` rays, so
    /// that a job with these numbers of sensors and pixels takes the least time: with the edges e the rays grow by e^-2, and the expected
    /// spread of residuals falls by e^2. For pixels, and where no spread is known, the coarse solution has a fraction of the time.
    pub fn finer(
        &self,
        target: f64,
        variances: &[Option<RelativeVariances>],
        rays: f64,
        (sensors, pixels): (&[usize], usize),
    ) -> f64 {
        let grids = || variances.iter().zip(sensors);
        let is_known = |(variances, sensors): (&Option<RelativeVariances>, &usize)| {
            variances.is_some_and(|variances| variances.spread.is_finite() || *sensors < LEAST_SENSORS)
        };
        let is_known = !variances.is_empty() && grids().all(is_known);
        let of_pixels = f64::from(self.per_pixel) * TIME_BEYOND * pixels as f64;
        let of_sensors = if is_known { 0.0 } else { self.time(sensors) };
        let factors = (0..FACTORS).map(|step| libm::pow(FINEST, f64::from(step) / f64::from(FACTORS - 1)));
        let by_share = (rays / (SHARE_OF_PATCHES * PASSES * (of_pixels + of_sensors))).sqrt();
        let by_share = factors.clone().take_while(|factor| *factor >= by_share).last().unwrap_or(1.0);
        if !is_known {
            return by_share;
        }
        let time = |finer: &f64| {
            let squared = finer * finer;
            let of_grid = |(variances, sensors): (&Option<RelativeVariances>, &usize)| {
                let finer = variances.map(|of| RelativeVariances { spread: of.spread * squared, ..of })?;
                Some(SampleCounts::tried(target, finer, *sensors).time_of_sensor() * *sensors as f64)
            };
            TIME_OF_EXCHANGE * rays / squared + PASSES * grids().filter_map(of_grid).sum::<f64>()
        };
        factors.min_by(|one, other| time(one).total_cmp(&time(other))).unwrap_or(1.0).min(by_share)
    }
}
