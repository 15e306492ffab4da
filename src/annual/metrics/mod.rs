//! Metrics of a year of daylight, with errors and verdicts.
//!
//! Errors of responses are the same in all records. So the standard error of a metric is its change between all illuminances raised and
//! lowered by a small fraction, per that fraction, times the relative error: the delta method.

pub mod area;
pub mod dimming;
pub mod en17037;
pub mod glare;
pub mod moment;
pub mod points;
pub mod schemes;

/// Number with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// Number.
    pub value: f64,
    /// Standard error of `value`.
    pub standard_error: f64,
}

/// Standard errors on either side of a value within which it is with a confidence of 95 %.
pub const CONFIDENT: f64 = 1.959_963_984_540_054;

/// Smallest fraction by which illuminances are raised and lowered: smaller steps would hang on single records.
const LEAST_STEP: f64 = 0.002;

impl Value {
    /// Computes a metric, a function of the factor by which all illuminances are multiplied, at the factor 1, with its standard error if
    /// all illuminances have the same `relative_error`.
    pub fn by_delta(relative_error: f64, metric: impl Fn(f64) -> f64) -> Self {
        let value = metric(1.0);
        if relative_error <= 0.0 {
            return Self { value, standard_error: 0.0 };
        }
        let step = relative_error.max(LEAST_STEP);
        let slope = (metric(1.0 + step) - metric(1.0 - step)) / (2.0 * step);
        Self { value, standard_error: slope.abs() * relative_error }
    }

    /// Returns the value in another unit.
    pub fn times(self, factor: f64) -> Self {
        Self { value: factor * self.value, standard_error: factor * self.standard_error }
    }

    /// Returns the value with a number added.
    pub fn plus(self, added: f64) -> Self {
        Self { value: self.value + added, ..self }
    }

    /// Returns the ends of the interval that holds the value with a confidence of 95 %.
    pub fn interval(&self) -> [f64; 2] {
        let half = CONFIDENT * self.standard_error;
        [self.value - half, self.value + half]
    }
}

/// Value between bounds within which it is with confidence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounded {
    /// Value.
    pub value: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

impl From<Value> for Bounded {
    fn from(value: Value) -> Self {
        let [low, high] = value.interval();
        // what the year brings is never less than nothing
        Self { value: value.value, low: low.max(0.0), high }
    }
}

/// Outcome of a comparison with a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The limit is reached, at the lower bound, too.
    Pass,
    /// The limit is not reached, at the upper bound neither.
    Fail,
    /// The limit is between the bounds.
    Undecided,
}

impl Bounded {
    /// Compares with a limit that must be reached.
    pub fn at_least(&self, limit: f64) -> Outcome {
        if self.low >= limit {
            Outcome::Pass
        } else if self.high < limit {
            Outcome::Fail
        } else {
            Outcome::Undecided
        }
    }

    /// Compares with a limit that must not be exceeded.
    pub fn at_most(&self, limit: f64) -> Outcome {
        if self.high <= limit {
            Outcome::Pass
        } else if self.low > limit {
            Outcome::Fail
        } else {
            Outcome::Undecided
        }
    }
}

/// Source of a criterion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// Text of the standard.
    Text,
    /// Publications that quote the standard.
    Secondary,
    /// Programs that compute it.
    Code,
    /// Own reading where the standard says nothing of tubes.
    Reading,
}

/// Criterion of a standard or a scheme, and whether a space meets it.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Standard or scheme, such as `LEED v4.1`.
    pub scheme: &'static str,
    /// Criterion in words.
    pub clause: String,
    /// Value, with bounds of 95 % confidence.
    pub value: Bounded,
    /// Limit.
    pub limit: f64,
    /// Unit of value and limit: `%`, `h` or `lx`.
    pub unit: &'static str,
    /// Outcome of the comparison.
    pub outcome: Outcome,
    /// Source of the criterion.
    pub basis: Basis,
    /// Number of points that count.
    pub points: usize,
    /// Hours that count.
    pub hours: f64,
    /// True if the value is of the light of the tubes alone, which says too little where other daylight is added.
    pub is_of_tubes_alone: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_between_the_bounds_are_undecided() {
        let bounded = Bounded { value: 50.0, low: 48.0, high: 52.0 };
        let at_least = [48.0, 48.1, 52.0, 52.1].map(|limit| bounded.at_least(limit));
        assert_eq!(at_least, [Outcome::Pass, Outcome::Undecided, Outcome::Undecided, Outcome::Fail]);
        let at_most = [47.9, 48.0, 51.9, 52.0].map(|limit| bounded.at_most(limit));
        assert_eq!(at_most, [Outcome::Fail, Outcome::Undecided, Outcome::Undecided, Outcome::Pass]);
        // without an error both bounds are the value
        let exact = Bounded::from(Value { value: 50.0, standard_error: 0.0 });
        assert_eq!([exact.at_least(50.0), exact.at_most(50.0)], [Outcome::Pass; 2]);
        assert_eq!(Bounded::from(Value { value: 1.0, standard_error: 1.0 }).low, 0.0);
    }

    /// Checks a metric in proportion to the light, and a constant one.
    #[test]
    fn errors_are_slopes_times_errors() {
        let proportional = Value::by_delta(0.01, |factor| 40.0 * factor);
        assert!((proportional.standard_error - 0.4).abs() < 1e-12 && proportional.value == 40.0);
        assert_eq!(Value::by_delta(0.01, |_| 7.0), Value { value: 7.0, standard_error: 0.0 });
    }
}
