//! Statistics of a grid and their errors.
//!
//! Sensors share the photons of their passes, so that their errors are correlated; the correlation is not stored. The error of the mean is
//! known nevertheless: the mean of every pass is a replicate. Minimum, median and maximum are order statistics: they never fall when a
//! value rises. So when every sensor's true value lies in its interval, the true statistic lies between that of all lower ends and that of
//! all upper ends, whatever the correlation. The intervals hold together with the requested confidence when each holds with 1 - alpha / k
//! (Bonferroni), k the number of sensors that the statistic could be that of. With one such sensor the error is that sensor's own; with
//! many it is larger, which covers the selection: the least of many noisy values is too low.
//!
//! See also docs/physics/statistics.md#minimum-median-maximum-uniformity.

use super::GridEstimate;
use crate::statistics::interval::{two_sided_normal_quantile, two_sided_student_quantile};

/// Confidence of the intervals from which the errors of order statistics are computed.
pub const CONFIDENCE: f64 = 0.95;

/// Value with its standard error: value +- t error is the interval of [`CONFIDENCE`], t Student's quantile with one degree of freedom less
/// than passes (1.96 after many); for an order statistic the interval has at least this confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistic {
    /// Estimate, in lux, or without unit for the uniformity.
    pub value: f64,
    /// Standard error in the unit of the value; infinite before the second pass, and if the error is unknown.
    pub standard_error: f64,
}

/// Statistics of the illuminances of a grid, in lux.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridStatistics {
    /// Mean over the sensors, by the weights of their cells.
    pub mean: Statistic,
    /// Median over the sensors, by the weights of their cells; where two values share the middle, their mean.
    pub median: Statistic,
    /// Least of the sensors.
    pub min: Statistic,
    /// Greatest of the sensors.
    pub max: Statistic,
    /// Minimum over mean, 0..1; not finite if all sensors are dark.
    pub uniformity: Statistic,
}

impl GridStatistics {
    /// Computes the statistics of the sensors that have values, with their errors; `None` without any.
    pub fn new(estimate: &GridEstimate) -> Option<Self> {
        let sensors = estimate.valued();
        let values: Vec<f64> = sensors.clone().map(|sensor| estimate.illuminance_lux(sensor)).collect();
        let errors: Vec<f64> = sensors.clone().map(|sensor| estimate.standard_error_lux(sensor)).collect();
        let weights: Vec<f64> = sensors.map(|sensor| estimate.weight(sensor)).collect();
        estimate.valued().next()?;
        let degrees = [estimate.passes() - 1.0, estimate.degrees_of_freedom()];
        let mean = mean(estimate);
        let of = |order: &dyn Fn(&[f64]) -> f64| order_statistic(&values, &errors, degrees, estimate.numerical, order);
        let min = of(&least);
        let uniformity = min.value / mean.value;
        Some(Self {
            mean,
            median: of(&|values| median(values, &weights)),
            min,
            max: of(&greatest),
            // whatever the correlation of minimum and mean, their errors together are at most their sum
            uniformity: Statistic {
                value: uniformity,
                standard_error: (min.standard_error + uniformity * mean.standard_error) / mean.value,
            },
        })
    }
}

/// Returns the mean of a grid.
pub fn mean(estimate: &GridEstimate) -> Statistic {
    let weighted = estimate.valued().map(|sensor| estimate.weight(sensor) * estimate.illuminance_lux(sensor));
    Statistic { value: weighted.sum::<f64>() / estimate.total_weight(), standard_error: error_of_mean(estimate) }
}

/// Returns the standard error of the grid's mean: the spread of the passes' means, the mean of the sensors' biases (signed: they may
/// cancel), the choice of fixed points, which is independent for every sensor, and where sensors found few photons, the mean of their
/// errors by that, which sensors may share.
fn error_of_mean(estimate: &GridEstimate) -> f64 {
    let total = if estimate.valued().next().is_some() { estimate.total_weight() } else { 1.0 };
    // sensors without a value contribute nothing to any of these
    let all = || (0..estimate.sensors.len()).map(|sensor| (sensor, estimate.weight(sensor)));
    let known = estimate.bias.iter().zip(all()).filter(|(bias, _)| bias.count >= 2.0);
    let bias = known.map(|(bias, (_, weight))| weight * bias.mean).sum::<f64>() / total;
    let fixed_points: f64 = all().map(|(sensor, weight)| weight * weight * estimate.fixed_point_variance(sensor)).sum();
    let few_photons: f64 = all().map(|(sensor, weight)| weight * estimate.error_of_few_photons_lux(sensor)).sum();
    let few_photons = few_photons / total;
    (estimate.mean.variance_of_mean() + bias * bias + fixed_points / (total * total) + few_photons * few_photons).sqrt()
}

/// Returns the statistic `order` of values, such as the least, with an error that covers its interval. `errors` are standard errors of many
/// degrees of freedom, whose correlation is not known.
pub fn of_order(values: &[f64], errors: &[f64], order: impl Fn(&[f64]) -> f64) -> Statistic {
    order_statistic(values, errors, [MANY; 2], false, &order)
}

/// Returns the least of some values; infinite of none.
pub fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Returns the greatest of some values; infinite below zero of none.
pub fn greatest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Returns the statistic `order` of the values, with an error that covers its interval; the degrees of freedom are those of the statistic's
/// error, and of the `errors` of the values.
fn order_statistic(
    values: &[f64],
    errors: &[f64],
    [reported, degrees]: [f64; 2],
    numerical: bool,
    order: &dyn Fn(&[f64]) -> f64,
) -> Statistic {
    let value = order(values);
    if errors.iter().any(|error| !error.is_finite()) {
        return Statistic { value, standard_error: f64::INFINITY };
    }
    let ends = |t: f64| -> [f64; 2] {
        [-t, t].map(|t| order(&values.iter().zip(errors).map(|(value, error)| value + t * error).collect::<Vec<_>>()))
    };
    let (single, joint) = if numerical {
        // the errors of neighbours are similar: all values move together
        (1.0, 1.0)
    } else {
        let quantile = |sensors: usize, degrees: f64| {
            let confidence = 1.0 - (1.0 - CONFIDENCE) / sensors as f64;
            if degrees >= MANY {
                two_sided_normal_quantile(confidence)
            } else {
                two_sided_student_quantile(confidence, degrees)
            }
        };
        let all = quantile(values.len(), degrees);
        let [low, high] = ends(all);
        let reaches = |(value, error): &(&f64, &f64)| *value - all * *error <= high && *value + all * *error >= low;
        let candidates = values.iter().zip(errors).filter(reaches).count();
        (quantile(1, reported), quantile(candidates.max(1), degrees))
    };
    let [low, high] = ends(joint);
    Statistic { value, standard_error: (value - low).max(high - value) / single }
}

/// Degrees of freedom from which on Student's quantiles are the normal ones, to a thousandth at any confidence that is used here.
const MANY: f64 = 10_000.0;

/// Returns the median of at least one value: the least of which the values up to it have half of all weights; where they have exactly half,
/// the mean of it and the next.
fn median(values: &[f64], weights: &[f64]) -> f64 {
    let mut sorted: Vec<(f64, f64)> = values.iter().copied().zip(weights.iter().copied()).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * weights.iter().sum::<f64>();
    let mut so_far = 0.0;
    for (number, (value, weight)) in sorted.iter().enumerate() {
        so_far += weight;
        match sorted.get(number + 1) {
            Some((next, _)) if so_far == half => return 0.5 * (value + next),
            Some(_) if so_far < half => {}
            _ => return *value,
        }
    }
    f64::NAN
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::GridPass;
    use crate::sampling::{Key, PathRandom};

    fn estimate(passes: &[Vec<f64>]) -> GridEstimate {
        let mut estimate = GridEstimate::empty(passes[0].len());
        for pass in passes {
            estimate.push(&GridPass { illuminance: pass.clone(), ..GridPass::default() });
        }
        estimate
    }

    #[test]
    fn medians_of_odd_and_even_numbers() {
        assert_eq!(median(&[3.0], &[1.0]), 3.0);
        assert_eq!(median(&[3.0, 1.0], &[1.0; 2]), 2.0);
        assert_eq!(median(&[9.0, 3.0, 1.0], &[1.0; 3]), 3.0);
        assert_eq!(median(&[9.0, 3.0, 1.0, 4.0], &[1.0; 4]), 3.5);
        assert_eq!(median(&[9.0, 3.0, 1.0], &[1.0, 0.25, 0.25]), 9.0);
        assert_eq!(median(&[9.0, 3.0, 1.0], &[0.5, 0.25, 0.25]), 6.0);
    }

    /// Two sensors far apart, one pass up and one down, computed by hand.
    #[test]
    fn where_one_sensor_is_meant_its_error_is_that_of_the_statistic() {
        let statistics = GridStatistics::new(&estimate(&[vec![9.0, 101.0], vec![11.0, 99.0]])).unwrap();
        // both errors are 1; the passes' means are all 55
        assert_eq!(statistics.mean, Statistic { value: 55.0, standard_error: 0.0 });
        let Statistic { value, standard_error } = statistics.min;
        assert_eq!(value, 10.0);
        assert!(standard_error > 1.0 - 1e-9, "two passes tell hardly anything apart: {standard_error}");
        let many: Vec<Vec<f64>> =
            (0..100).map(|k| if k % 2 == 0 { vec![9.0, 101.0] } else { vec![11.0, 99.0] }).collect();
        let statistics = GridStatistics::new(&estimate(&many)).unwrap();
        let error = (100.0f64 / 99.0 / 100.0).sqrt();
        for (statistic, value) in [(statistics.min, 10.0), (statistics.max, 100.0)] {
            assert_eq!(statistic.value, value);
            assert!((statistic.standard_error - error).abs() < 1e-9, "{statistic:?}");
        }
        assert!((statistics.uniformity.value - 10.0 / 55.0).abs() < 1e-12);
        assert!((statistics.uniformity.standard_error - error / 55.0).abs() < 1e-9);
        // the mean of two: either of them may move it
        assert!(statistics.median.value == 55.0 && statistics.median.standard_error > error - 1e-9);
    }

    #[test]
    fn one_pass_has_no_error_and_darkness_no_uniformity() {
        let statistics = GridStatistics::new(&estimate(&[vec![1.0, 2.0, 3.0]])).unwrap();
        for statistic in [statistics.mean, statistics.median, statistics.min, statistics.max, statistics.uniformity] {
            assert!(statistic.value.is_finite() && statistic.standard_error.is_infinite(), "{statistic:?}");
        }
        let dark = GridStatistics::new(&estimate(&[vec![0.0; 3], vec![0.0; 3]])).unwrap();
        assert_eq!((dark.max.value, dark.max.standard_error), (0.0, 0.0));
        assert!(!dark.uniformity.value.is_finite());
        assert_eq!(GridStatistics::new(&GridEstimate::default()), None);
    }

    /// Errors include the bias and the choice of fixed points, also where passes agree to the last digit.
    #[test]
    fn bias_and_fixed_points_are_inside_the_errors() {
        let mut estimate = GridEstimate::empty(4);
        for _ in 0..32 {
            estimate.push(&GridPass {
                illuminance: vec![10.0, 20.0, 30.0, 40.0],
                bias: vec![0.5, 0.5, 0.5, -0.1],
                contrasts: vec![0.3, 0.0, 0.0, 0.4],
                ..GridPass::default()
            });
        }
        let statistics = GridStatistics::new(&estimate).unwrap();
        let mean = (0.35f64.powi(2) + (0.3f64.powi(2) + 0.4f64.powi(2)) / 16.0).sqrt();
        assert!((statistics.mean.standard_error - mean).abs() < 1e-9, "{:?}", statistics.mean);
        assert!((statistics.min.standard_error - 0.5f64.hypot(0.3)).abs() < 1e-9, "{:?}", statistics.min);
        assert!((statistics.max.standard_error - 0.1f64.hypot(0.4)).abs() < 1e-9, "{:?}", statistics.max);
    }

    /// Returns the true illuminances of 36 sensors: all equal, in groups by symmetry, and all different.
    fn rooms() -> [Vec<f64>; 3] {
        let symmetric = (0..36).map(|k| [100.0, 101.0, 102.0, 110.0][k % 4]).collect();
        [vec![100.0; 36], symmetric, (0..36).map(|k| 50.0 + 3.0 * f64::from(k)).collect()]
    }

    fn normal(random: &mut PathRandom) -> f64 {
        crate::statistics::interval::tests::normal(random.uniform())
    }

    /// In 400 simulated jobs of 12 passes each, for three rooms and four correlations of the sensors (0: none, 1: they move together), the
    /// interval of 95 % contains the truth.
    ///
    /// Exact coverage of 0.95 misses in 20 of 400 on average; more than 40 misses have probability 1.8e-5 then (binomial),
    /// and there are 60 such counts: false alarm below 1.1e-3. Also, errors are not made large without need: a statistic's
    /// error stays below three times the largest of a sensor.
    #[test]
    fn intervals_cover_the_truth_whatever_the_correlation() {
        let (jobs, passes) = (400u64, 12);
        let t = two_sided_student_quantile(CONFIDENCE, f64::from(passes) - 1.0);
        for (room, truth) in rooms().iter().enumerate() {
            let of = |order: fn(&[f64]) -> f64| order(truth);
            let mean = truth.iter().sum::<f64>() / truth.len() as f64;
            let least = of(|values| values.iter().copied().fold(f64::INFINITY, f64::min));
            let most = of(|values| values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
            let truths = [mean, median(truth, &vec![1.0; truth.len()]), least, most, least / mean];
            for (number, correlation) in [0.0f64, 0.3, 0.9, 1.0].into_iter().enumerate() {
                let mut misses = [0; 5];
                for job in 0..jobs {
                    let mut random = PathRandom::new(Key::new(17).child(room as u64).child(number as u64).child(job));
                    let pass = |random: &mut PathRandom| {
                        let common = normal(random);
                        let one = |value: &f64| {
                            let noise = correlation.sqrt() * common + (1.0 - correlation).sqrt() * normal(random);
                            value * (1.0 + 0.05 * noise)
                        };
                        truth.iter().map(one).collect::<Vec<_>>()
                    };
                    let passes: Vec<_> = (0..passes).map(|_| pass(&mut random)).collect();
                    let estimate = estimate(&passes);
                    let GridStatistics { mean, median, min, max, uniformity } = GridStatistics::new(&estimate).unwrap();
                    for (index, statistic) in [mean, median, min, max, uniformity].into_iter().enumerate() {
                        let miss = (statistic.value - truths[index]).abs() > t * statistic.standard_error;
                        misses[index] += u32::from(miss);
                    }
                    let largest = (0..36).map(|sensor| estimate.standard_error_lux(sensor)).fold(0.0, f64::max);
                    for statistic in [median, min, max] {
                        assert!(statistic.standard_error < 3.0 * largest, "{statistic:?} {largest}");
                    }
                }
                println!("room {room}, correlation {correlation}: misses of 20 expected: {misses:?}");
                assert!(
                    misses.iter().all(|misses| *misses <= 40),
                    "room {room}, correlation {correlation}: {misses:?}"
                );
            }
        }
    }
}
