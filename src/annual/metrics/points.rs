//! Metrics of a point: daylight autonomy and its kin.

use std::f64::consts::{PI, SQRT_2};

use super::Value;
use crate::response::LitRow;

/// Records of a year that count for a point, and its illuminance in them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Illuminances {
    /// Illuminances in lux of the records with light that count.
    pub lit_lux: Vec<f64>,
    /// Standard errors of these in lux that are independent from record to record; empty where there are none.
    pub noise_lux: Vec<f64>,
    /// Number of all records that count, those without light included.
    pub records: usize,
    /// Relative standard error of the sum of the illuminances.
    pub relative_error: f64,
    /// Relative standard error of the illuminances that is the same in all records.
    pub common_error: f64,
}

/// Shares of the records by the illuminance: the useful daylight illuminance of Mardaljevic, with bounds `low`, `middle`, `high`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Useful {
    /// Share in percent below the lowest bound.
    pub below_percent: Value,
    /// Share in percent from the lowest bound to below the middle one.
    pub supplementary_percent: Value,
    /// Share in percent from the middle bound up to the highest one.
    pub autonomous_percent: Value,
    /// Share in percent above the highest bound.
    pub above_percent: Value,
}

impl Illuminances {
    /// Selects the records that count: `row` has the illuminances of the lit records with these numbers, `counts` tells of every record
    /// of the year whether it counts.
    pub fn new(row: &LitRow, records: &[usize], counts: &[bool]) -> Self {
        let counting = |lux: &[f64]| {
            let counting = lux.iter().zip(records).filter(|(_, record)| counts.get(**record) == Some(&true));
            counting.map(|(lux, _)| *lux).collect()
        };
        Self {
            lit_lux: counting(&row.lux),
            noise_lux: counting(&row.noise_lux),
            records: counts.iter().filter(|counts| **counts).count(),
            relative_error: row.relative_error,
            common_error: row.common_error,
        }
    }

    /// Computes the daylight autonomy: the share in percent of the records with at least `threshold_lux` (> 0).
    pub fn autonomy_percent(&self, threshold_lux: f64) -> Value {
        self.share_percent(|lux| lux >= threshold_lux, 0.0)
    }

    /// Computes the continuous daylight autonomy: the mean over the records of the illuminance over `threshold_lux`, at most 1, in percent.
    pub fn continuous_autonomy_percent(&self, threshold_lux: f64) -> Value {
        self.mean_percent(|lux| (lux / threshold_lux).min(1.0), 0.0)
    }

    /// Computes the useful daylight illuminance for bounds in lux; the four shares add up to 100 %.
    pub fn useful(&self, [low, middle, high]: [f64; 3]) -> Useful {
        Useful {
            // records without light are below
            below_percent: self.share_percent(|lux| lux < low, 1.0),
            supplementary_percent: self.share_percent(|lux| lux >= low && lux < middle, 0.0),
            autonomous_percent: self.share_percent(|lux| lux >= middle && lux <= high, 0.0),
            above_percent: self.share_percent(|lux| lux > high, 0.0),
        }
    }

    /// Computes the median illuminance in lux; the mean of the two in the middle of an even number of records.
    ///
    /// Few records decide on it, so that their independent noise does not average out: the interval of the share of the records above the median is
    /// turned into one of illuminances (Woodruff 1952).
    pub fn median_lux(&self) -> Value {
        let mut lux = self.lit_lux.clone();
        lux.sort_unstable_by(f64::total_cmp);
        let dark = self.records.saturating_sub(lux.len());
        let at = |place: usize| place.checked_sub(dark).and_then(|place| lux.get(place)).copied().unwrap_or(0.0);
        let last = self.records.saturating_sub(1);
        let quantile = |share: f64| {
            let place = share.clamp(0.0, 1.0) * last as f64;
            let [below, above] = [place.floor(), place.ceil()].map(|place| at(place as usize));
            below + place.fract() * (above - below)
        };
        let value = quantile(0.5);
        let of_sum = value * self.relative_error;
        if self.noise_lux.is_empty() {
            return Value { value, standard_error: of_sum };
        }
        let share = 0.01 * self.autonomy_percent(value).standard_error;
        let by_share = 0.5 * (quantile(0.5 + share) - quantile(0.5 - share));
        Value { value, standard_error: by_share.max(of_sum) }
    }

    /// Computes the sum of the illuminance over the records, of `hours` each, in klx h.
    pub fn exposure_klxh(&self, hours: f64) -> Value {
        // the sum of nothing is -0
        let value = 1e-3 * hours * (0.0 + self.lit_lux.iter().sum::<f64>());
        Value { value, standard_error: value * self.relative_error }
    }

    /// Computes the share of the records within bounds of the illuminance in percent; `dark` of those without light are.
    ///
    /// Records are counted: between the true illuminance at a bound and that which was found, in lux apart by an error of the standard deviation
    /// s in records, there are as many as of a Poisson distribution, whose mean is sqrt(2 / pi) s on average. Its variance is added to that of s.
    fn share_percent(&self, is_in: impl Fn(f64) -> bool, dark: f64) -> Value {
        let share = self.mean_percent(|lux| f64::from(u8::from(is_in(lux))), dark);
        let record = 100.0 / self.records.max(1) as f64;
        let variance = share.standard_error * (share.standard_error + (2.0 / PI).sqrt() * record);
        Value { standard_error: variance.sqrt(), ..share }
    }

    /// Computes the mean over the records of a function of the illuminance in percent; it is `dark` in those without light.
    fn mean_percent(&self, of: impl Fn(f64) -> f64, dark: f64) -> Value {
        if self.records == 0 {
            return Value::default();
        }
        let without_light = dark * self.records.saturating_sub(self.lit_lux.len()) as f64;
        let share = self.sum_over_lit(of).times(100.0 / self.records as f64);
        let share = share.plus(100.0 * without_light / self.records as f64);
        Value { value: share.value.clamp(0.0, 100.0), ..share }
    }

    /// Computes the sum over the lit records of a function of the illuminance.
    ///
    /// Independent noise smooths the function, which shifts the sum by what smoothing it once more changes, to first order in the variance:
    /// this is taken off. Smoothed by noise e the function is about the mean of its values at x - e and x + e. The noise of what is left is
    /// half its difference between these places; its variance times the root of 2 is that of a threshold within 1 %, and more than that of
    /// any linear function.
    pub fn sum_over_lit(&self, of: impl Fn(f64) -> f64) -> Value {
        let corrected = |lux: f64, noise: f64| {
            let [low, high] = [-noise, noise].map(|away| of((lux + away).max(0.0)));
            2.0 * of(lux.max(0.0)) - 0.5 * (low + high)
        };
        let sum = Value::by_delta(self.common_error, |factor| match self.noise_lux.is_empty() {
            true => self.lit_lux.iter().map(|lux| of(factor * lux)).sum(),
            false => {
                let noisy = self.lit_lux.iter().zip(&self.noise_lux);
                noisy.map(|(lux, noise)| corrected(factor * lux, factor * noise)).sum()
            }
        });
        let difference =
            |(lux, noise): (&f64, &f64)| 0.5 * (corrected(lux + noise, *noise) - corrected(lux - noise, *noise));
        let squares: f64 = self.lit_lux.iter().zip(&self.noise_lux).map(difference).map(|half| half * half).sum();
        Value { standard_error: libm::hypot(sum.standard_error, (SQRT_2 * squares).sqrt()), ..sum }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a year of `records` records, of which the first have these illuminances.
    fn year(lit_lux: &[f64], records: usize) -> Illuminances {
        Illuminances { lit_lux: lit_lux.to_vec(), records, ..Illuminances::default() }
    }

    #[test]
    fn a_year_of_equal_records() {
        let year = year(&[300.0; 3650], 3650);
        assert_eq!(year.autonomy_percent(300.0).value, 100.0);
        assert_eq!(year.autonomy_percent(300.1).value, 0.0);
        assert_eq!(year.continuous_autonomy_percent(600.0).value, 50.0);
        assert_eq!((year.median_lux().value, year.exposure_klxh(1.0).value), (300.0, 1095.0));
    }

    #[test]
    fn dark_records_count() {
        let bright = year(&[1000.0], 8784);
        assert_eq!(bright.autonomy_percent(300.0).value, 100.0 / 8784.0);
        assert_eq!(bright.continuous_autonomy_percent(300.0).value, 100.0 / 8784.0);
        assert_eq!(bright.median_lux().value, 0.0);
        assert_eq!(bright.useful([100.0, 300.0, 3000.0]).below_percent.value, 100.0 * 8783.0 / 8784.0);
        assert_eq!(year(&[], 8760).median_lux().value, 0.0);
        assert_eq!(year(&[], 0).autonomy_percent(300.0).value, 0.0);
        assert_eq!(year(&[], 8760).exposure_klxh(1.0).value.to_bits(), 0.0f64.to_bits());
    }

    /// Checks records at the bounds: 100 is supplementary, 300 and 3000 are autonomous.
    #[test]
    fn bounds_belong_to_useful_light() {
        let useful = year(&[99.9, 100.0, 299.9, 300.0, 3000.0, 3000.1], 10).useful([100.0, 300.0, 3000.0]);
        let shares =
            [useful.below_percent, useful.supplementary_percent, useful.autonomous_percent, useful.above_percent];
        assert_eq!(shares.map(|share| share.value), [50.0, 20.0, 20.0, 10.0]);
    }

    /// Noise of 20 lx in each of 200 records, one for each lux, leaves the median with an error of some lux, which is more than
    /// that of the sum.
    #[test]
    fn medians_keep_the_noise_of_records() {
        let lit_lux: Vec<f64> = (0..200).map(|record| 100.0 + f64::from(record)).collect();
        let noise_lux = vec![20.0; 200];
        let noisy = Illuminances { lit_lux, noise_lux, records: 200, relative_error: 0.005, common_error: 0.0 };
        let median = noisy.median_lux();
        // records within the noise of the median cross it by chance: about sqrt(20 / sqrt(pi)) of them, one for each lux
        assert!(median.value == 199.5 && (2.5..7.0).contains(&median.standard_error), "{median:?}");
    }

    #[test]
    fn medians_of_odd_and_even_numbers() {
        assert_eq!(year(&[5.0, 1.0, 3.0], 3).median_lux().value, 3.0);
        assert_eq!(year(&[5.0, 1.0, 3.0, 9.0], 4).median_lux().value, 4.0);
        assert_eq!(year(&[5.0, 7.0], 4).median_lux().value, 2.5);
        assert_eq!(year(&[5.0, 7.0], 3).median_lux().value, 5.0);
    }

    #[test]
    fn only_records_that_count_are_selected() {
        let row = LitRow { lux: vec![10.0, 20.0, 30.0], noise_lux: Vec::new(), relative_error: 0.1, common_error: 0.1 };
        let selected = Illuminances::new(&row, &[1, 2, 5], &[true, true, false, false, false, true]);
        assert_eq!((selected.lit_lux, selected.records), (vec![10.0, 30.0], 3));
    }

    /// Checks that autonomy falls with the threshold, and that the order of records is of no effect.
    #[test]
    fn autonomy_is_monotone_and_has_no_order() {
        let lux: Vec<f64> = (0..1000).map(|k| 0.7 * f64::from(k * 619 % 1000)).collect();
        let mut turned = lux.clone();
        turned.reverse();
        let mut last = 100.0;
        for threshold in 1..700 {
            let autonomy = year(&lux, 1500).autonomy_percent(f64::from(threshold));
            assert_eq!(autonomy, year(&turned, 1500).autonomy_percent(f64::from(threshold)));
            assert!(autonomy.value <= last);
            last = autonomy.value;
        }
    }
}
