//! Shares of an area whose points reach a limit.

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

    /// Returns the smallest and the largest value; `None` without points.
    pub fn extremes(&self, values: &[Value]) -> Option<[Value; 2]> {
        let counting = || values.iter().zip(self.weights).filter(|(_, weight)| **weight > 0.0).map(|(value, _)| *value);
        let by_value = |a: &Value, b: &Value| a.value.total_cmp(&b.value);
        Some([counting().min_by(by_value)?, counting().max_by(by_value)?])
    }
}

#[cfg(test)]
mod tests {
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
        let none = Area { weights: &[0.0; 4] };
        assert_eq!((none.share_percent(&exact, 50.0), none.extremes(&exact)), (Bounded::default(), None));
    }
}
