//! Shares of an area whose points reach a limit.

use skyduct_physics::estimate::grid_statistics::{Statistic, greatest, least, of_order};

use super::{Bounded, CONFIDENT, Value};

/// Points of a grid with their weights.
///
/// A point's weight is the area that it stands for; points inside solids or outside the room have none and are in no statistic.
#[derive(Clone, Copy, Debug)]
pub struct Area<'a> {
    /// Weight of each point, >= 0.
    pub weights: &'a [f64],
}

impl Area<'_> {
    /// Returns the number of points that count.
    pub fn points(&self) -> usize {
        self.weights.iter().filter(|weight| **weight > 0.0).count()
    }

    /// Computes the share of the area in percent whose points have at least `limit`: low counts the points that reach it surely, high all
    /// that may reach it, at 95 % for each point.
    pub fn share_percent(&self, values: &[Value], limit: f64) -> Bounded {
        let whole: f64 = self.weights.iter().sum();
        if whole <= 0.0 {
            return Bounded::default();
        }
        let share = |errors: f64| {
            let reaches = |value: &Value| value.value + errors * value.standard_error >= limit;
            let reached = values.iter().zip(self.weights).filter(|(value, _)| reaches(value));
            // the sum of nothing is -0
            100.0 * ((0.0 + reached.map(|(_, weight)| weight).sum::<f64>()) / whole).min(1.0)
        };
        Bounded { value: share(0.0), low: share(-CONFIDENT), high: share(CONFIDENT) }
    }

    /// Computes the mean over the area, where the errors of any two points have this correlation, 0..1; zero without area.
    pub fn mean(&self, values: &[Value], correlation: f64) -> Value {
        let whole: f64 = self.weights.iter().sum();
        if whole <= 0.0 {
            return Value::default();
        }
        let sum: f64 = values.iter().zip(self.weights).map(|(value, weight)| weight * value.value).sum();
        let [alike, apart] = self.variances(values);
        let variance = correlation * alike + (1.0 - correlation) * apart;
        Value { value: sum / whole, standard_error: variance.sqrt() / whole }
    }

    /// Returns the correlation of the errors of points, 0..1, with which the mean of their values has a standard error of so much; 1 where they
    /// have none.
    pub fn correlation(&self, values: &[Value], error_of_mean: f64) -> f64 {
        let [alike, apart] = self.variances(values);
        let found = (error_of_mean * self.weights.iter().sum::<f64>()).powi(2);
        if alike > apart { ((found - apart) / (alike - apart)).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Returns the variances of the weighted sum of values if their errors are the same, and if they are independent.
    fn variances(&self, values: &[Value]) -> [f64; 2] {
        let errors = values.iter().zip(self.weights).map(|(value, weight)| weight * value.standard_error);
        [errors.clone().sum::<f64>().powi(2), errors.map(|error| error * error).sum()]
    }

    /// Returns the smallest and the largest value; `None` without points. Their errors cover the choice of the point: the least of many noisy
    /// values is too low.
    pub fn extremes(&self, values: &[Value]) -> Option<[Value; 2]> {
        let counting = values.iter().zip(self.weights).filter(|(_, weight)| **weight > 0.0);
        let (values, errors): (Vec<f64>, Vec<f64>) =
            counting.map(|(value, _)| (value.value, value.standard_error)).unzip();
        let of = |order: fn(&[f64]) -> f64| {
            let Statistic { value, standard_error } = of_order(&values, &errors, order);
            Value { value, standard_error }
        };
        (!values.is_empty()).then(|| [of(least), of(greatest)])
    }
}

#[cfg(test)]
mod tests {
    use skyduct_physics::sampling::{Key, PathRandom};

    use super::*;

    fn values(values: &[(f64, f64)]) -> Vec<Value> {
        values.iter().map(|(value, standard_error)| Value { value: *value, standard_error: *standard_error }).collect()
    }

    /// Checks shares by area, ties at the limit, and a point without weight.
    #[test]
    fn shares_are_those_of_areas() {
        let area = Area { weights: &[1.0, 2.0, 1.0, 0.0] };
        let exact = values(&[(50.0, 0.0), (49.9, 0.0), (60.0, 0.0), (99.0, 0.0)]);
        assert_eq!(area.share_percent(&exact, 50.0), Bounded { value: 50.0, low: 50.0, high: 50.0 });
        assert_eq!(area.points(), 3);
        assert_eq!(area.mean(&exact, 1.0).value, 0.25 * (50.0 + 2.0 * 49.9 + 60.0));
        assert_eq!(area.extremes(&exact).map(|[least, most]| (least.value, most.value)), Some((49.9, 60.0)));
        let unsure = values(&[(50.0, 0.1), (49.9, 0.1), (60.0, 0.1), (50.0, 9.0)]);
        assert_eq!(area.share_percent(&unsure, 50.0), Bounded { value: 50.0, low: 25.0, high: 100.0 });
        // with one point that may be the least its own error holds, with many more
        let [far, _] = area.extremes(&values(&[(50.0, 0.1), (30.0, 0.1), (60.0, 0.1)])).unwrap();
        let [near, _] = area.extremes(&values(&[(50.0, 0.1), (49.99, 0.1), (50.02, 0.1)])).unwrap();
        assert!((far.standard_error - 0.1).abs() < 1e-9 && near.standard_error > 0.11, "{far:?} {near:?}");
        let none = Area { weights: &[0.0; 4] };
        assert_eq!((none.share_percent(&exact, 50.0), none.extremes(&exact)), (Bounded::default(), None));
    }

    /// Checks by hand that errors which go together add up, that independent ones add up in squares, and that an error of the mean between
    /// these tells the correlation, with which the mean of others has one of its own.
    #[test]
    fn errors_of_means_follow_their_correlation() {
        let area = Area { weights: &[1.0, 2.0, 1.0] };
        let some = values(&[(1.0, 0.4), (2.0, 0.1), (3.0, 0.0)]);
        let error = |correlation: f64| area.mean(&some, correlation).standard_error;
        assert!((error(1.0) - 0.6 / 4.0).abs() < 1e-12 && (error(0.0) - 0.2f64.sqrt() / 4.0).abs() < 1e-12);
        assert!((area.correlation(&some, error(0.3)) - 0.3).abs() < 1e-12);
        assert_eq!([1.0, 0.0].map(|error| area.correlation(&some, error)), [1.0, 0.0]);
        assert_eq!(area.correlation(&values(&[(1.0, 0.0); 3]), 0.0), 1.0);
        assert_eq!(Area { weights: &[0.0; 3] }.mean(&some, 1.0), Value::default());
        // one point alone has its whole error
        let one = values(&[(0.0, 0.0), (5.0, 0.2), (0.0, 0.0)]);
        assert!((area.mean(&one, 0.3).standard_error - 0.1).abs() < 1e-12);
    }

    /// Draws the least and the greatest of 25 equal points 2000 times: intervals of 95 % hold the truth at least that often (four binomial
    /// standard deviations below); those of the points that were chosen do so in less than a third of the cases.
    #[test]
    fn intervals_of_extremes_hold_the_truth() {
        const DRAWS: usize = 2000;
        let area = Area { weights: &[1.0; 25] };
        let mut random = PathRandom::new(Key::new(5));
        let mut normal = || {
            let [radius, turn] = [random.uniform(), random.uniform()];
            libm::sqrt(-2.0 * libm::log(1.0 - radius)) * libm::cos(2.0 * std::f64::consts::PI * turn)
        };
        let mut held = [0; 2];
        for _ in 0..DRAWS {
            let drawn: Vec<(f64, f64)> = (0..25).map(|_| (100.0 + 4.0 * normal(), 4.0)).collect();
            for (held, extreme) in held.iter_mut().zip(area.extremes(&values(&drawn)).unwrap()) {
                let [low, high] = extreme.interval();
                *held += usize::from(low <= 100.0 && 100.0 <= high);
            }
        }
        assert!(held.iter().all(|held| *held as f64 >= 0.93 * DRAWS as f64), "{held:?}");
    }
}
