//! What an estimate says of its values and their errors.

use skyduct::estimate::GridEstimate;
use skyduct::statistics::Moments;

use skyduct::analytic::holigilm::REPLICATES;

use crate::judge::{Measured, Whole};

/// Degrees of freedom of an error that passes tell, or the replicates of a solver.
pub fn degrees(moments: &Moments, numerical: bool) -> f64 {
    if numerical { REPLICATES as f64 - 1.0 } else { moments.count - 1.0 }
}

/// The sensors of a grid, and its mean.
pub fn grid(grid: &GridEstimate) -> (Vec<Measured>, Whole) {
    let sensors = (0..grid.sensors.len()).map(|sensor| Measured {
        value: grid.illuminance_lux(sensor),
        error: grid.standard_error_lux(sensor),
        degrees: degrees(&grid.sensors[sensor], grid.numerical),
    });
    let n = grid.sensors.len() as f64;
    // every sensor chooses fixed points of its own
    let fixed: f64 = (0..grid.sensors.len()).map(|sensor| grid.fixed_point_variance(sensor)).sum();
    let whole = Whole {
        value: grid.mean.mean,
        noise: (grid.mean.variance_of_mean() + fixed / (n * n)).sqrt(),
        bias: mean_bias(&grid.bias),
        degrees: degrees(&grid.mean, grid.numerical),
    };
    (sensors.collect(), whole)
}

/// Biases of neighbours have a sign and may cancel.
pub fn mean_bias(bias: &[Moments]) -> f64 {
    let known = bias.iter().filter(|bias| bias.count >= 2.0).map(|bias| bias.mean);
    known.sum::<f64>() / bias.len().max(1) as f64
}
