//! Verdict on a grid: whether it has the illuminance that its document asks for.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::{coverage_factor, finite};
use crate::estimate::GridEstimate;
use crate::estimate::grid_statistics::Statistic;

/// Comparison of a grid with its `target_lux`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TargetResult {
    /// Illuminance in lux that the document asks for.
    pub lux: f64,
    /// Verdict on the mean illuminance.
    pub verdict: Verdict,
    /// Percentage of the grid's area outside solids that has the target, 0..100.
    pub area_percent: f64,
    /// Unobstructed horizontal illuminance in lux, outdoors, with which the mean would be the target under the same distribution of the light;
    /// null without daylight, with electric light, and where no light arrives.
    pub external_lux: Option<f64>,
}

/// Verdict on a mean illuminance and its target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The mean is at least the target, and so is its interval of 95 %.
    Met,
    /// The mean is below the target, and so is its interval of 95 %.
    NotMet,
    /// The target lies within the interval of 95 % of the mean, or the interval is not known yet.
    Undecided,
}

impl Verdict {
    /// Compares an interval of 95 %, from its lower to its upper end, with the `least` value that is asked for, in the same unit.
    pub fn of_interval([from, to]: [f64; 2], least: f64) -> Self {
        if from >= least {
            Self::Met
        } else if to < least {
            Self::NotMet
        } else {
            Self::Undecided
        }
    }
}

impl TargetResult {
    /// Compares a grid of this `mean` with its target in lux. `external_lux` is the unobstructed horizontal illuminance, where it alone
    /// lights the room.
    pub fn new(lux: f64, estimate: &GridEstimate, mean: Statistic, external_lux: Option<f64>) -> Self {
        let half = coverage_factor(estimate.passes(), estimate.numerical).map(|factor| factor * mean.standard_error);
        let half = half.filter(|half| half.is_finite()).unwrap_or(f64::INFINITY);
        let verdict = Verdict::of_interval([mean.value - half, mean.value + half], lux);
        let external_lux = external_lux.and_then(|external| finite(external * lux / mean.value));
        Self { lux, verdict, area_percent: percent_at_least(estimate, lux), external_lux }
    }
}

/// Returns the percentage of a grid's area outside solids at or above an illuminance in lux, 0..100.
pub fn percent_at_least(estimate: &GridEstimate, lux: f64) -> f64 {
    let above = estimate.valued().filter(|sensor| estimate.illuminance_lux(*sensor) >= lux);
    let above: f64 = above.map(|sensor| estimate.weight(sensor)).sum();
    // the sum of nothing is -0
    (100.0 * above / estimate.total_weight().max(f64::MIN_POSITIVE)).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::Moments;

    /// Four sensors of 10, 20, 30 and 40 lux in three passes, the mean of which is 25 lux and its interval 4.303 times its error.
    #[test]
    fn a_target_is_met_missed_or_undecided() {
        let mut sensors = vec![Moments::default(); 4];
        for (index, sensor) in sensors.iter_mut().enumerate() {
            (0..3).for_each(|_| sensor.push(10.0 * (index as f64 + 1.0)));
        }
        let estimate = GridEstimate { sensors, ..GridEstimate::default() };
        let verdict = |lux: f64, standard_error: f64| {
            TargetResult::new(lux, &estimate, Statistic { value: 25.0, standard_error }, Some(5000.0))
        };
        assert_eq!(verdict(20.0, 1.0).verdict, Verdict::Met);
        assert_eq!(verdict(21.0, 1.0).verdict, Verdict::Undecided);
        assert_eq!(verdict(29.0, 1.0).verdict, Verdict::Undecided);
        assert_eq!(verdict(30.0, 1.0).verdict, Verdict::NotMet);
        assert_eq!(verdict(30.0, f64::INFINITY).verdict, Verdict::Undecided);
        assert_eq!((verdict(30.0, 1.0).area_percent, verdict(30.0, 1.0).external_lux), (50.0, Some(6000.0)));
        let dark = TargetResult::new(30.0, &estimate, Statistic { value: 0.0, standard_error: 0.0 }, Some(5000.0));
        assert_eq!((dark.verdict, dark.external_lux), (Verdict::NotMet, None));
    }
}
