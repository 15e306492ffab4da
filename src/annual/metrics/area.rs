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

    /// Computes the mean over the area.
    pub fn mean(&self, values: &[Value]) -> Value {
        Value::mean(values.iter().zip(self.weights.iter().copied()))
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
        assert_eq!(area.mean(&exact).value, 0.25 * (50.0 + 2.0 * 49.9 + 60.0));
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
