//! Discrepancies of two estimates of the same grid, in their standard errors.

use super::GridEstimate;
use super::grid_statistics::{self, Statistic};
use crate::statistics::interval::deviation_of_student;

/// Fraction of a value by which rounding may change it: closed forms may be summed in another order.
const ROUNDING: f64 = 1e-9;

/// Discrepancy of a single sensor, in standard errors, at which two estimates are said to differ.
const TOO_MUCH: f64 = 5.0;

/// Discrepancies of two independent estimates of some grids.
///
/// Each is a difference in standard errors of the difference, converted to the deviation of a normal distribution that is as likely: with
/// few passes standard errors are uncertain themselves, and the quotients spread more (degrees of freedom: Welch 1947).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Discrepancy {
    /// Number of sensors that were compared.
    pub sensors: usize,
    /// Largest absolute discrepancy of all sensors; infinite if exact values differ.
    pub worst: f64,
    /// Root mean square over the sensors; about 1 if both estimates are right.
    pub rms: f64,
    /// Largest absolute discrepancy of the means of the grids.
    pub of_means: f64,
}

impl Discrepancy {
    /// Compares each grid with the estimate that `check` selects for it; `None` if no grid has two values with errors.
    pub fn of<'a>(
        grids: &'a [GridEstimate],
        check: impl Fn(&'a GridEstimate) -> Option<&'a GridEstimate>,
    ) -> Option<Self> {
        let mut all = Self::default();
        let mut squares = 0.0;
        for (grid, check) in grids.iter().filter_map(|grid| Some((grid, check(grid)?))) {
            let passes = grid.mean.count.min(check.mean.count);
            if passes < 2.0 {
                continue;
            }
            let of = |grid: &GridEstimate, sensor| Statistic {
                value: grid.illuminance_lux(sensor),
                standard_error: grid.standard_error_lux(sensor),
            };
            for sensor in grid.valued() {
                let deviation = deviation([of(grid, sensor), of(check, sensor)], passes);
                all.sensors += 1;
                all.worst = all.worst.max(deviation);
                squares += deviation * deviation;
            }
            let means = [grid, check].map(grid_statistics::mean);
            all.of_means = all.of_means.max(deviation(means, passes));
        }
        all.rms = (squares / all.sensors as f64).sqrt();
        (all.sensors > 0).then_some(all)
    }

    /// True if the two estimates cannot both be right: the largest discrepancy of a sensor is less likely, allowing for the number of
    /// sensors, than one of 5 standard errors of a single sensor, or that of a grid's mean is larger than 5.
    pub fn is_too_much(&self) -> bool {
        self.worst > most_of(self.sensors) || self.of_means > TOO_MUCH
    }
}

/// Returns the size of the largest of `count` deviations that is as unlikely as [`TOO_MUCH`] is for a single one, by the tail of the normal
/// distribution: exp(-z^2 / 2) falls to one over the count of it.
fn most_of(count: usize) -> f64 {
    (TOO_MUCH * TOO_MUCH + 2.0 * libm::log(count.max(1) as f64)).sqrt()
}

/// Returns the difference of two values with equal numbers of passes, in standard errors.
fn deviation([a, b]: [Statistic; 2], passes: f64) -> f64 {
    let difference = (a.value - b.value).abs() - ROUNDING * a.value.abs().max(b.value.abs());
    if difference <= 0.0 {
        return 0.0;
    }
    let variances = [a, b].map(|statistic| statistic.standard_error * statistic.standard_error);
    let sum: f64 = variances.iter().sum();
    if !sum.is_finite() {
        return 0.0;
    }
    if sum == 0.0 {
        return f64::INFINITY;
    }
    let degrees = sum * sum / variances.iter().map(|variance| variance * variance / (passes - 1.0)).sum::<f64>();
    deviation_of_student(difference / sum.sqrt(), degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};
    use crate::statistics::Moments;
    use crate::statistics::interval::tests::normal;

    /// Returns an estimate of `sensors` sensors whose passes spread by 1 about `mean`.
    fn estimate(random: &mut PathRandom, sensors: usize, passes: usize, mean: f64) -> GridEstimate {
        let mut grid = GridEstimate::empty(sensors);
        for _ in 0..passes {
            let values: Vec<f64> = (0..sensors).map(|_| mean + normal(random.uniform())).collect();
            grid.sensors.iter_mut().zip(&values).for_each(|(sensor, value)| sensor.push(*value));
            grid.mean.push(values.iter().sum::<f64>() / sensors as f64);
        }
        grid
    }

    fn compared(mut grid: GridEstimate, check: GridEstimate) -> Discrepancy {
        grid.companions.push(check);
        Discrepancy::of(&[grid], |grid| grid.companions.last()).unwrap()
    }

    /// For 4000 sensors of 8 passes the root mean square is 1 within 4 of its errors 1 / sqrt(2 n), the worst is that of normal numbers,
    /// and Student's wide tails raise no alarm.
    #[test]
    fn what_chance_does_is_no_discrepancy() {
        let mut random = PathRandom::new(Key::new(5));
        let (sensors, passes) = (4000, 8);
        let [grid, check] = [(); 2].map(|()| estimate(&mut random, sensors, passes, 100.0));
        let found = compared(grid, check);
        assert_eq!(found.sensors, sensors);
        assert!((found.rms - 1.0).abs() < 4.0 / (2.0 * sensors as f64).sqrt(), "{found:?}");
        assert!(found.worst > 2.5 && found.worst < 5.0 && !found.is_too_much(), "{found:?}");
    }

    /// A sensor that is 20 standard errors off is found among many, and so is a mean that is off where no single sensor is.
    #[test]
    fn what_chance_does_not_do_is_found() {
        let mut random = PathRandom::new(Key::new(6));
        let [mut grid, check] = [(); 2].map(|()| estimate(&mut random, 100, 64, 10.0));
        // each sensor has the error 1 / 8, and the difference of two sqrt(2) times that
        grid.sensors[17].mean += 20.0 * 2.0_f64.sqrt() / 8.0;
        let found = compared(grid, check);
        assert!(found.worst > 9.0 && found.is_too_much(), "{found:?}");
        let [grid, check] = [10.0, 10.1].map(|mean| estimate(&mut random, 1000, 64, mean));
        let found = compared(grid, check);
        assert!(found.worst < 6.0 && found.of_means > 10.0 && found.is_too_much(), "{found:?}");
    }

    /// Values without errors agree to rounding or differ without bound; one pass gives no discrepancy.
    #[test]
    fn exact_values_agree_or_not() {
        let exact = |value: f64| {
            let mut grid = GridEstimate::empty(1);
            [value; 2].iter().for_each(|value| {
                grid.sensors[0].push(*value);
                grid.mean.push(*value);
            });
            grid
        };
        assert_eq!(compared(exact(3.0), exact(3.0 + 1e-12)).worst, 0.0);
        assert!(compared(exact(3.0), exact(3.1)).worst.is_infinite());
        let mut one = GridEstimate::empty(1);
        one.sensors = vec![Moments::default()];
        one.sensors[0].push(1.0);
        one.mean.push(1.0);
        one.companions.push(one.clone());
        assert_eq!(Discrepancy::of(&[one], |grid| grid.companions.last()), None);
    }
}
