//! Criteria of certification schemes for daylight over a year, one table.
//!
//! A space is judged as if the tubes were its only daylight. Whatever a scheme asks of other spaces, of windows and their blinds, or of a
//! building as a whole is not judged.

use super::area::Area;
use super::{Basis, Bounded, Value, Verdict};

/// Illuminances in lux whose shares of the occupied hours schemes ask for.
pub const OCCUPIED_LUX: [f64; 2] = [150.0, 300.0];

/// Illuminances in lux whose shares of the daylight hours schemes ask for.
pub const DAYLIGHT_LUX: [f64; 3] = [100.0, 200.0, 300.0];

/// Illuminances in lux whose hours in the year schemes ask for: of the mean, and of single points.
pub const YEAR_LUX: [f64; 5] = [30.0, 90.0, 100.0, 200.0, 300.0];

/// Share of the hours in percent in which a point must have its illuminance.
const HALF: f64 = 50.0;

/// Share of the area in percent with more than 250 h of direct sun of 1000 lx, above which the sun must be explained or flagged.
const SUN_LIMITS: [(&str, f64); 2] = [("LEED v4.1", 10.0), ("LEED v5", 20.0)];

/// Shares of the area in percent for numbers of points: scheme, clause, illuminance by its number, limit, source.
const OF_OCCUPIED: [(&str, &str, usize, f64, Basis); 10] = [
    ("LEED v4.1", "daylight, option 1, 1 point: sDA300,50", 1, 40.0, Basis::Text),
    ("LEED v4.1", "daylight, option 1, 2 points: sDA300,50", 1, 55.0, Basis::Text),
    ("LEED v4.1", "daylight, option 1, 3 points: sDA300,50", 1, 75.0, Basis::Text),
    ("LEED v5", "daylight, 1 point: sDA300,50", 1, 40.0, Basis::Secondary),
    ("LEED v5", "daylight, 2 points: sDA300,50", 1, 55.0, Basis::Secondary),
    ("LEED v5", "daylight, 3 points: sDA300,50", 1, 65.0, Basis::Secondary),
    ("LEED v5", "daylight, 4 points: sDA300,50", 1, 75.0, Basis::Secondary),
    ("WELL v2", "L01: sDA150,50", 0, 30.0, Basis::Code),
    ("WELL v2", "L06, 1 point: sDA300,50", 1, 55.0, Basis::Code),
    ("WELL v2", "L06, 2 points: sDA300,50", 1, 75.0, Basis::Code),
];

/// Shares of the area in percent with an illuminance, by its number, in half of the daylight hours.
const OF_DAYLIGHT: [(&str, &str, usize, f64); 3] = [
    ("WELL v2", "L01: 200 lx in half of the daylight hours", 1, 30.0),
    ("WELL v2", "L06, 1 point by EN 17037: 300 lx in half of the daylight hours", 2, 50.0),
    ("WELL v2", "L06, 1 point by EN 17037: 100 lx in half of the daylight hours", 0, 95.0),
];

/// Uses of buildings by BREEAM Hea 01: numbers in [`YEAR_LUX`] of the illuminances of the mean and of the darkest point, and hours.
const BREEAM: [(&str, usize, usize, f64); 5] = [
    ("offices, education", 4, 1, 2000.0),
    ("health care, 1 credit", 4, 1, 2000.0),
    ("health care, 2 credits", 4, 1, 2650.0),
    ("dwellings: kitchens, living rooms", 2, 0, 3450.0),
    ("shops: sales areas", 3, 3, 2650.0),
];

/// Illuminances in lux between which points must be at 9:00 and 15:00 of a clear day at the equinox by option 2 of LEED v4.1.
pub const LEED_LUX: [f64; 2] = [300.0, 3000.0];

/// Hours of the clear days of option 2 of LEED v4.1.
pub const LEED_HOURS: [f64; 2] = [9.0, 15.0];

/// First and last month and day among which the clearest day of each equinox is: 15 days before and after the 21st of March and September.
pub const LEED_DAYS: [[(u8, u8); 2]; 2] = [[(3, 6), (4, 5)], [(9, 6), (10, 6)]];

/// Shares of the area in percent for numbers of points.
pub(super) const LEED_SHARES: [(&str, f64); 3] = [("1 point", 55.0), ("2 points", 75.0), ("3 points", 90.0)];

/// Illuminances in lux at the middle of a room by ABNT NBR 15575, at four moments.
pub(super) const NBR: [(&str, f64); 3] = [("minimum", 60.0), ("intermediate", 90.0), ("superior", 120.0)];

/// Month, day and hour of these moments.
pub const NBR_MOMENTS: [(u8, u8, f64); 4] = [(4, 23, 9.5), (4, 23, 15.5), (10, 23, 9.5), (10, 23, 15.5)];

/// Space as schemes see it.
#[derive(Clone, Copy, Debug)]
pub struct Space<'a> {
    /// Points with their weights.
    pub area: Area<'a>,
    /// Share of the area in percent with more than 250 occupied hours of direct sunlight; `None` where it is not known.
    pub sun_exposure_percent: Option<Bounded>,
    /// Shares of the occupied hours in percent in which each point has each of [`OCCUPIED_LUX`].
    pub occupied_percent: &'a [[Value; OCCUPIED_LUX.len()]],
    /// Shares of the daylight hours in percent in which each point has each of [`DAYLIGHT_LUX`].
    pub daylight_percent: &'a [[Value; DAYLIGHT_LUX.len()]],
    /// Hours of the year in which each point has each of [`YEAR_LUX`].
    pub hours: &'a [[Value; YEAR_LUX.len()]],
    /// Hours of the year in which the mean has each of [`YEAR_LUX`].
    pub mean_hours: [Value; YEAR_LUX.len()],
    /// Least illuminance in lux of [`NBR_MOMENTS`] at the point in the middle; `None` if there is no such point or moment.
    pub middle_lux: Option<Value>,
    /// Lux by which each point is within [`LEED_LUX`] at the worse of [`LEED_HOURS`], negative outside; `None` without such days.
    pub within_leed_lux: Option<&'a [Value]>,
    /// Number of occupied hours, of daylight hours and of all hours.
    pub number_of_hours: [f64; 3],
}

impl Space<'_> {
    /// Compares the space with all criteria.
    pub fn verdicts(&self) -> Vec<Verdict> {
        let [occupied, daylight, all] = self.number_of_hours;
        let mut verdicts = Vec::new();
        for (scheme, clause, number, limit, basis) in OF_OCCUPIED {
            let share = self.share(self.occupied_percent, number);
            verdicts.push(self.at_least(scheme, clause.to_owned(), (share, limit, "%"), basis, occupied));
        }
        for (share, (scheme, limit)) in
            self.sun_exposure_percent.iter().flat_map(|share| SUN_LIMITS.map(|limit| (share, limit)))
        {
            let clause = "ASE1000,250: at most".to_owned();
            let verdict = self.at_least(scheme, clause, (*share, limit, "%"), Basis::Reading, occupied);
            verdicts.push(Verdict { outcome: share.at_most(limit), ..verdict });
        }
        for (scheme, clause, number, limit) in OF_DAYLIGHT {
            let share = self.share(self.daylight_percent, number);
            verdicts.push(self.at_least(scheme, clause.to_owned(), (share, limit, "%"), Basis::Code, daylight));
        }
        for (of, mean, darkest, hours) in BREEAM {
            let clause = format!("Hea 01, {of}: hours with a mean of {} lx", YEAR_LUX[mean]);
            let value = (self.mean_hours[mean].into(), hours, "h");
            verdicts.push(self.at_least("BREEAM", clause, value, Basis::Secondary, all));
            let of_points: Vec<Value> = self.hours.iter().map(|hours| hours[darkest]).collect();
            if let Some([least, _]) = self.area.extremes(&of_points) {
                let clause = format!("Hea 01, {of}: hours with {} lx at the darkest point", YEAR_LUX[darkest]);
                let value = (least.into(), hours, "h");
                verdicts.push(self.at_least("BREEAM", clause, value, Basis::Secondary, all));
            }
        }
        for (points, limit) in LEED_SHARES {
            let Some(within) = self.within_leed_lux else { break };
            let [low, high] = LEED_LUX;
            let clause = format!(
                "daylight, option 2, {points}: {low} to {high} lx at 9:00 and 15:00 of a clear day at the equinox"
            );
            let share = (self.area.share_percent(within, 0.0), limit, "%");
            verdicts.push(self.at_least("LEED v4.1", clause, share, Basis::Secondary, LEED_HOURS.len() as f64));
        }
        for (level, limit) in NBR.into_iter().filter(|_| self.middle_lux.is_some()) {
            let clause = format!("{level}: lux in the middle on 23 April and 23 October at 9:30 and 15:30");
            let value = (self.middle_lux.unwrap_or_default().into(), limit, "lx");
            verdicts.push(self.at_least("ABNT NBR 15575", clause, value, Basis::Code, NBR_MOMENTS.len() as f64));
        }
        verdicts
    }

    fn share<const N: usize>(&self, of_points: &[[Value; N]], number: usize) -> Bounded {
        let values: Vec<Value> = of_points.iter().map(|of_point| of_point[number]).collect();
        self.area.share_percent(&values, HALF)
    }

    fn at_least(
        &self,
        scheme: &'static str,
        clause: String,
        (value, limit, unit): (Bounded, f64, &'static str),
        basis: Basis,
        hours: f64,
    ) -> Verdict {
        let outcome = value.at_least(limit);
        let points = self.area.points();
        Verdict { scheme, clause, value, limit, unit, outcome, basis, points, hours, is_of_tubes_alone: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Outcome;

    fn value(value: f64) -> Value {
        Value { value, standard_error: 0.0 }
    }

    /// Judges a space of two equal points that has exactly what some criteria ask for, and less than others ask for.
    #[test]
    fn spaces_are_judged_by_their_limits() {
        let space = Space {
            area: Area { weights: &[1.0, 1.0] },
            sun_exposure_percent: Some(Bounded { value: 20.0, low: 0.0, high: 20.0 }),
            occupied_percent: &[[50.0, 50.0].map(value), [50.0, 49.9].map(value)],
            daylight_percent: &[[100.0, 50.0, 0.0].map(value); 2],
            hours: &[[3450.0, 2000.0, 0.0, 2650.0, 0.0].map(value), [4000.0, 1999.0, 0.0, 2650.0, 0.0].map(value)],
            mean_hours: [4000.0, 3000.0, 3450.0, 2650.0, 2000.0].map(value),
            middle_lux: Some(value(90.0)),
            within_leed_lux: Some(&[value(0.0), value(-1.0)]),
            number_of_hours: [3650.0, 4380.0, 8760.0],
        };
        let verdicts = space.verdicts();
        let option_2 = verdicts.iter().filter(|verdict| verdict.clause.contains("option 2"));
        assert!(option_2.map(|verdict| verdict.value.value).eq([50.0; 3]));
        let passed: Vec<String> = verdicts
            .iter()
            .filter(|verdict| verdict.outcome == Outcome::Pass)
            .map(|verdict| format!("{} {}", verdict.scheme, verdict.clause))
            .collect();
        let expected = [
            "LEED v4.1 daylight, option 1, 1 point: sDA300,50",
            "LEED v5 daylight, 1 point: sDA300,50",
            "WELL v2 L01: sDA150,50",
            "LEED v5 ASE1000,250: at most",
            "WELL v2 L01: 200 lx in half of the daylight hours",
            "WELL v2 L06, 1 point by EN 17037: 100 lx in half of the daylight hours",
            "BREEAM Hea 01, offices, education: hours with a mean of 300 lx",
            "BREEAM Hea 01, health care, 1 credit: hours with a mean of 300 lx",
            "BREEAM Hea 01, dwellings: kitchens, living rooms: hours with a mean of 100 lx",
            "BREEAM Hea 01, dwellings: kitchens, living rooms: hours with 30 lx at the darkest point",
            "BREEAM Hea 01, shops: sales areas: hours with a mean of 200 lx",
            "BREEAM Hea 01, shops: sales areas: hours with 200 lx at the darkest point",
            "ABNT NBR 15575 minimum: lux in the middle on 23 April and 23 October at 9:30 and 15:30",
            "ABNT NBR 15575 intermediate: lux in the middle on 23 April and 23 October at 9:30 and 15:30",
        ];
        assert_eq!(passed, expected);
        let undecided: Vec<&str> = verdicts
            .iter()
            .filter(|verdict| verdict.outcome == Outcome::Undecided)
            .map(|verdict| verdict.scheme)
            .collect();
        assert_eq!(undecided, ["LEED v4.1"]);
        assert!(verdicts.iter().all(|verdict| verdict.points == 2));
    }
}
