//! How much two estimates of the same grid differ, in their standard errors.

use super::GridEstimate;
use super::grid_statistics::{self, Statistic};
use crate::statistics::interval::deviation_of_student;

/// Share of a value by which rounding may change it: closed forms summed in another order.
const ROUNDING: f64 = 1e-9;

/// A discrepancy of one sensor at which two estimates are said to differ, in standard errors, were it the only one.
const TOO_MUCH: f64 = 5.0;

/// Discrepancies of two independent estimates of some grids.
///
/// Each is in standard errors of the difference of the two, as that of a normal distribution which is as likely: errors of few
/// passes are themselves uncertain, and their quotients spread more (degrees of freedom: Welch 1947).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Discrepancy {
    /// Number of sensors that were compared.
    pub sensors: usize,
    /// The largest of all sensors, without its sign; infinite where exact values differ.
    pub worst: f64,
    /// Root of the mean square; about 1 where both are right.
    pub rms: f64,
    /// The largest of the means of the grids, without its sign.
    pub of_means: f64,
}

impl Discrepancy {
    /// Compares each grid with the estimate that `check` picks of it; `None` where no grid has two values with errors.
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

    /// True if the two estimates cannot both be right: a sensor or a mean is further off than 5 standard errors make one alone,
    /// the choice of the worst of many allowed for.
    pub fn is_too_much(&self) -> bool {
        self.worst > most_of(self.sensors) || self.of_means > TOO_MUCH
    }
}

/// Size of the largest of `count` deviations that is as unlikely as [`TOO_MUCH`] is of one, by the tail of the normal
/// distribution: exp(-z^2 / 2) falls to the part of it that is one of the count.
fn most_of(count: usize) -> f64 {
    (TOO_MUCH * TOO_MUCH + 2.0 * libm::log(count.max(1) as f64)).sqrt()
}

/// The difference of two values that have as many passes, in standard errors.
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

    /// Grids of as many sensors, whose passes spread by 1 about `mean`.
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
        grid.beside.push(check);
        Discrepancy::of(&[grid], |grid| grid.beside.last()).unwrap()
    }

    /// 4000 sensors of 8 passes: the root mean square is 1 within 4 of its errors 1 / sqrt(2 n), the worst is what normal
    /// numbers give, and Student's wide tails make no alarm.
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

    /// A sensor that is 20 standard errors off is found among many, and a mean that is where no sensor is.
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

    /// Values without errors agree to rounding or differ without bound; one pass says nothing.
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
        one.beside.push(one.clone());
        assert_eq!(Discrepancy::of(&[one], |grid| grid.beside.last()), None);
    }
}
