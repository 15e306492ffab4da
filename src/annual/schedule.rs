//! Hours of a year that metrics count.

use crate::calendar::{Date, day_of_year};
use crate::weather::{Represented, Weather};

/// Hours during which a room is occupied.
#[derive(Clone, Debug, PartialEq)]
pub enum Schedule {
    /// Hours of some days of the week, by local clock time.
    Weekly {
        /// Days from Monday.
        days: [bool; 7],
        /// First hour of the day, 0..24.
        from_hour: f64,
        /// End of the last hour, later than the first, up to 24.
        to_hour: f64,
    },
    /// One value for each hour of the file, in standard time.
    Hours(Vec<bool>),
}

impl Schedule {
    /// Returns 8 to 18 h of all days (IES LM-83-12).
    pub fn lm83() -> Self {
        Self::Weekly { days: [true; 7], from_hour: 8.0, to_hour: 18.0 }
    }
}

/// Returns for each record whether a schedule has the time that it stands for.
///
/// `sun_offset_minutes` are those from stamps to represented times. Between the days of `summer_time` clocks are an hour ahead; the first day
/// has it, the last one does not. Hours beyond the end of a list are not occupied.
pub fn occupied(
    weather: &Weather,
    schedule: &Schedule,
    summer_time: Option<[Date; 2]>,
    sun_offset_minutes: f64,
) -> Vec<bool> {
    let per_day = weather.records_per_day();
    let number = |date: Date| day_of_year(weather.year_of_sun, date);
    let summer = summer_time.map(|days| days.map(number));
    let is_summer = |day: u16| match summer {
        Some([first, last]) if first <= last => (first..last).contains(&day),
        // south of the equator it is summer when the year begins
        Some([first, last]) => day >= first || day < last,
        None => false,
    };
    let days_of_file = (weather.records.len() / per_day.max(1)) as i32;
    let is_occupied = |(k, record)| {
        let Represented { days_later, day_of_year, hour } = weather.represented(record, sun_offset_minutes);
        let day = (k / per_day) as i32 + days_later;
        match schedule {
            Schedule::Weekly { days: weekly, from_hour, to_hour } => {
                let clock = hour + f64::from(u8::from(is_summer(day_of_year)));
                let weekday = (i32::from(weather.first_weekday) + day + (clock / 24.0) as i32).rem_euclid(7);
                weekly[weekday as usize] && (*from_hour..*to_hour).contains(&(clock % 24.0))
            }
            Schedule::Hours(hours) => {
                let place = 24 * day.rem_euclid(days_of_file) + hour as i32;
                hours.get(place as usize).is_some_and(|occupied| *occupied)
            }
        }
    };
    weather.records.iter().enumerate().map(is_occupied).collect()
}

/// Returns for each record whether it is one of the daylight hours of EN 17037: half of the records, those with most diffuse horizontal
/// illuminance (in lux, one for each record); among equal ones those with the higher sun (by the sine of its altitude), then the earlier ones.
pub fn daylight_hours(diffuse_lux: &[f64], sun_sines: &[f64]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..diffuse_lux.len()).collect();
    let sine = |k: usize| sun_sines.get(k).copied().unwrap_or(-1.0);
    // the sort is stable: the earlier of equal ones stays first
    order.sort_by(|a, b| diffuse_lux[*b].total_cmp(&diffuse_lux[*a]).then(sine(*b).total_cmp(&sine(*a))));
    let mut is_daylight = vec![false; diffuse_lux.len()];
    order.iter().take(diffuse_lux.len() / 2).for_each(|k| is_daylight[*k] = true);
    is_daylight
}
