//! Criteria of schemes for single moments, for which no year is needed.

use super::area::Area;
use super::schemes::{LEED_DAYS, LEED_HOURS, LEED_LUX, LEED_SHARES, NBR, NBR_MOMENTS};
use super::{Basis, Bounded, Value, Verdict};

/// A moment of a grid.
#[derive(Clone, Copy, Debug)]
pub struct GridAtMoment<'a> {
    /// Month, day of the month and hour of the day, as clocks show them.
    pub clock: (u8, u8, f64),
    /// True if the sky is clear.
    pub is_clear: bool,
    /// Points with their weights.
    pub area: Area<'a>,
    /// Illuminances of the points in lux.
    pub lux: &'a [Value],
    /// Number of the point in the middle of the room.
    pub middle: Option<usize>,
}

impl GridAtMoment<'_> {
    /// Compares the moment with the criteria that name it, alone or with others that must pass, too; none at most moments.
    pub fn verdicts(&self) -> Vec<Verdict> {
        let (month, day, hour) = self.clock;
        let mut verdicts = Vec::new();
        let is_leed_day = LEED_DAYS.iter().any(|[first, last]| (*first..=*last).contains(&(month, day)));
        if self.is_clear && is_leed_day && LEED_HOURS.contains(&hour) {
            let [low, high] = LEED_LUX;
            let within = |lux: &Value| Value { value: (lux.value - low).min(high - lux.value), ..*lux };
            let share = self.area.share_percent(&self.lux.iter().map(within).collect::<Vec<_>>(), 0.0);
            for (points, limit) in LEED_SHARES {
                let clause = format!(
                    "daylight, option 2, {points}: {low} to {high} lx at this moment, one of 9:00 and 15:00 of a clear day at the equinox"
                );
                verdicts.push(self.at_least("LEED v4.1", clause, (share, limit, "%"), Basis::Secondary));
            }
        }
        if let Some(middle) = self.middle.filter(|_| NBR_MOMENTS.contains(&self.clock)) {
            for (level, limit) in NBR {
                let clause = format!(
                    "{level}: lux in the middle at this moment, one of 23 April and 23 October at 9:30 and 15:30"
                );
                let value = (self.lux[middle].into(), limit, "lx");
                verdicts.push(self.at_least("ABNT NBR 15575", clause, value, Basis::Code));
            }
        }
        verdicts
    }

    fn at_least(
        &self,
        scheme: &'static str,
        clause: String,
        (value, limit, unit): (Bounded, f64, &'static str),
        basis: Basis,
    ) -> Verdict {
        let (outcome, points) = (value.at_least(limit), self.area.points());
        Verdict { scheme, clause, value, limit, unit, outcome, basis, points, hours: 1.0, is_of_tubes_alone: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Outcome::{Fail, Pass, Undecided};

    /// Judges three points, one too dark for LEED, and the one in the middle not surely bright enough for the highest level of the NBR.
    #[test]
    fn moments_are_judged_by_their_limits() {
        let lux = [400.0, 119.0, 3000.0].map(|value| Value { value, standard_error: 1.0 });
        let area = Area { weights: &[1.0, 1.0, 2.0] };
        let outcomes = |clock: (u8, u8, f64), is_clear: bool| -> Vec<_> {
            let moment = GridAtMoment { clock, is_clear, area, lux: &lux, middle: Some(1) };
            moment.verdicts().iter().map(|verdict| (verdict.limit, verdict.outcome)).collect()
        };
        // the brightest point may be above 3000 lx
        assert_eq!(outcomes((3, 21, 9.0), true), [(55.0, Undecided), (75.0, Undecided), (90.0, Fail)]);
        assert_eq!(outcomes((4, 23, 9.5), false), [(60.0, Pass), (90.0, Pass), (120.0, Undecided)]);
        for (clock, is_clear) in
            [((3, 21, 9.0), false), ((3, 21, 12.0), true), ((6, 21, 9.0), true), ((4, 24, 9.5), true)]
        {
            assert!(outcomes(clock, is_clear).is_empty());
        }
    }
}
