//! Daylight provision by EN 17037:2018+A1:2021, by hours of the year and by daylight factors.

use super::area::Area;
use super::{Basis, Bounded, Value, Verdict};

/// Illuminances in lux that levels ask for, in rising order.
pub const THRESHOLDS_LUX: [f64; 4] = [100.0, 300.0, 500.0, 750.0];

/// Share of the daylight hours in percent in which a point must have its illuminance.
const HALF: f64 = 50.0;

/// Levels of recommendation: name, and numbers of the target and of the minimum target in [`THRESHOLDS_LUX`].
const LEVELS: [(&str, usize, usize); 3] = [("minimum", 1, 0), ("medium", 2, 1), ("high", 3, 2)];

/// Parts of the area in percent: all but the edges, and half.
const NEARLY_ALL: f64 = 95.0;
const HALF_OF_AREA: f64 = 50.0;

/// Route by daylight factors, which are those of the tubes.
const BY_FACTORS: &str = "daylight factors";

/// Shares of an area in percent with each of [`THRESHOLDS_LUX`] in half of the daylight hours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Provision {
    /// Shares by the illuminances of all daylight hours.
    pub by_hours_percent: [Bounded; THRESHOLDS_LUX.len()],
    /// Shares by the daylight factors that the site asks for.
    pub by_factors_percent: [Bounded; THRESHOLDS_LUX.len()],
    /// Daylight factors in percent that the site asks for.
    pub factors_percent: [f64; THRESHOLDS_LUX.len()],
}

/// Points of an area as the standard sees them.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// Points with their weights.
    pub area: Area<'a>,
    /// Shares of the daylight hours in percent in which each point has each of [`THRESHOLDS_LUX`].
    pub autonomies_percent: &'a [[Value; THRESHOLDS_LUX.len()]],
    /// Daylight factors of the points in percent.
    pub factors_percent: &'a [Value],
}

impl Provision {
    /// Computes the shares at a site where the median of the diffuse illuminance over the daylight hours is `median_diffuse_lux`.
    pub fn new(points: &Points, median_diffuse_lux: f64) -> Self {
        let by_hours = |number: usize| {
            let autonomies: Vec<Value> = points.autonomies_percent.iter().map(|of_point| of_point[number]).collect();
            points.area.share_percent(&autonomies, HALF)
        };
        let factors_percent = THRESHOLDS_LUX.map(|lux| 100.0 * lux / median_diffuse_lux);
        Self {
            by_hours_percent: std::array::from_fn(by_hours),
            by_factors_percent: factors_percent.map(|factor| points.area.share_percent(points.factors_percent, factor)),
            factors_percent,
        }
    }

    /// Compares the shares by hours and by factors with the criteria for openings in walls, and with those for horizontal openings, which
    /// ask for the target nearly everywhere and for no minimum.
    pub fn verdicts(&self, points: usize, hours: f64) -> Vec<Verdict> {
        let mut verdicts = Vec::new();
        for (route, shares) in [("hours", &self.by_hours_percent), (BY_FACTORS, &self.by_factors_percent)] {
            for (level, target, minimum) in LEVELS {
                let mut verdict = |openings: &str, threshold: usize, limit: f64| {
                    let (lux, value) = (THRESHOLDS_LUX[threshold], shares[threshold]);
                    verdicts.push(Verdict {
                        scheme: "EN 17037",
                        clause: format!("{level}, {openings} openings, {lux} lx by {route} on {limit} % of the area"),
                        value,
                        limit,
                        unit: "%",
                        outcome: value.at_least(limit),
                        basis: Basis::Secondary,
                        points,
                        hours,
                        is_of_tubes_alone: route == BY_FACTORS,
                    });
                };
                verdict("horizontal", target, NEARLY_ALL);
                verdict("vertical", target, HALF_OF_AREA);
                verdict("vertical", minimum, NEARLY_ALL);
            }
        }
        verdicts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Outcome;

    /// Checks twenty points, of which one falls short of 300 lx, under a median of 15 klx: 2 % are needed for 300 lx.
    #[test]
    fn levels_and_openings_have_their_limits() {
        let value = |value: f64| Value { value, standard_error: 0.0 };
        let autonomies: Vec<_> =
            (0..20).map(|k| [100.0, if k == 0 { 49.9 } else { 50.0 }, 10.0, 0.0].map(value)).collect();
        let factors: Vec<Value> = (0..20).map(|k| value(if k < 10 { 2.0 } else { 1.99 })).collect();
        let area = Area { weights: &[1.0; 20] };
        let points = Points { area, autonomies_percent: &autonomies, factors_percent: &factors };
        let provision = Provision::new(&points, 15_000.0);
        assert_eq!(provision.by_hours_percent.map(|share| share.value), [100.0, 95.0, 0.0, 0.0]);
        assert_eq!(provision.by_factors_percent.map(|share| share.value), [100.0, 50.0, 0.0, 0.0]);
        assert_eq!(provision.factors_percent[1], 2.0);
        let outcomes: Vec<Outcome> = provision.verdicts(20, 4380.0).iter().map(|verdict| verdict.outcome).collect();
        // level by level: horizontal, vertical target, vertical minimum
        let (pass, fail) = (Outcome::Pass, Outcome::Fail);
        let by_hours = [[pass; 3], [fail, fail, pass], [fail; 3]].concat();
        let by_factors = [[fail, pass, pass], [fail, fail, fail], [fail; 3]].concat();
        assert_eq!(outcomes, [by_hours, by_factors].concat());
    }
}
