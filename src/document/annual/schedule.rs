//! Occupied hours of a year, and the summer time of their clock.

use std::fmt;
use std::str::FromStr;

use jiff::civil::{Date, Time};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::ToSchema;

use crate::document::read::tagged::{self, Reader, Tagged};
use crate::document::schema::shapes::IsOccupied;

/// Hours in which a room is occupied.
#[derive(Clone, Debug, Default, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ScheduleDocument {
    /// 8:00 to 18:00 of every day, the hours of IES LM-83.
    #[default]
    Lm83,
    /// Half of the year with most diffuse horizontal illuminance, the hours of EN 17037.
    DaylightHours,
    /// Hours of some days of every week.
    Weekly(WeeklyDocument),
    /// Hours by a list.
    Hours(HoursDocument),
}

/// Hours of some days of every week.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WeeklyDocument {
    /// Days of the week; the year begins with the day that the weather file names.
    pub days: Vec<Weekday>,
    /// Local time from which the room is occupied, "HH:MM".
    #[schema(example = "08:00")]
    pub from: String,
    /// Local time up to which the room is occupied, "HH:MM", later than `from`; "24:00" is midnight.
    #[schema(example = "18:00")]
    pub to: String,
}

/// Occupied hours by a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct HoursDocument {
    /// 1 for each occupied hour of the weather file and 0 for each other one, in standard time and in its order.
    #[schema(value_type = Vec<IsOccupied>)]
    pub occupied: Vec<u8>,
}

/// Day of the week.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "each is its name")]
pub enum Weekday {
    Mon,
    Tue,
    Wed,
    Thu,
    Fri,
    Sat,
    Sun,
}

impl WeeklyDocument {
    /// Returns the hours of the day from and up to which the room is occupied; zeros for times that a check refuses.
    pub fn hours(&self) -> [f64; 2] {
        [&self.from, &self.to].map(|text| hours_of_day(text).unwrap_or_default())
    }
}

impl Tagged for ScheduleDocument {
    const TAG: &'static str = "kind";
    const WHAT: &'static str = "a schedule";
    const KINDS: &'static [(&'static str, Reader<Self>)] = &[
        ("lm83", |fields, of| fields.none(of).map(|()| Self::Lm83)),
        ("daylight_hours", |fields, of| fields.none(of).map(|()| Self::DaylightHours)),
        ("weekly", |fields, of| fields.read(of).map(Self::Weekly)),
        ("hours", |fields, of| fields.read(of).map(Self::Hours)),
    ];
}

impl<'de> Deserialize<'de> for ScheduleDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        tagged::deserialize(deserializer)
    }
}

/// Part of the year, both days included; it may go over the end of the year.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PeriodDocument {
    /// First day, "MM-DD".
    #[schema(value_type = String, example = "01-01")]
    pub from: DayOfYear,
    /// Last day, "MM-DD".
    #[schema(value_type = String, example = "12-31")]
    pub to: DayOfYear,
}

impl PeriodDocument {
    /// True if a day of the year is in the period.
    pub fn contains(&self, month: u8, day: u8) -> bool {
        let [from, to] = [self.from, self.to].map(|day| (day.month, day.day));
        let day = (month, day);
        if from <= to { (from..=to).contains(&day) } else { day >= from || day <= to }
    }
}

/// Summer time of a schedule's clock, one hour ahead of standard time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum DaylightSavingDocument {
    /// None.
    #[default]
    None,
    /// By the weather file's header.
    File,
    /// Between two days of every year, from their midnights on.
    Days(SummerDocument),
}

/// Days between which clocks are one hour ahead.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SummerDocument {
    /// First day, "MM-DD".
    #[schema(value_type = String, example = "03-29")]
    pub start: DayOfYear,
    /// Day on which it ends, "MM-DD"; earlier in the year than `start` on the southern hemisphere.
    #[schema(value_type = String, example = "10-25")]
    pub end: DayOfYear,
}

impl Tagged for DaylightSavingDocument {
    const TAG: &'static str = "kind";
    const WHAT: &'static str = "a summer time";
    const KINDS: &'static [(&'static str, Reader<Self>)] = &[
        ("none", |fields, of| fields.none(of).map(|()| Self::None)),
        ("file", |fields, of| fields.none(of).map(|()| Self::File)),
        ("days", |fields, of| fields.read(of).map(Self::Days)),
    ];
}

impl<'de> Deserialize<'de> for DaylightSavingDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        tagged::deserialize(deserializer)
    }
}

/// Day of any year, "MM-DD"; 29 February is one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DayOfYear {
    /// Month, 1..=12.
    pub month: u8,
    /// Day of the month, from 1.
    pub day: u8,
}

impl FromStr for DayOfYear {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let fault = || format!("must be a day of the year as \"MM-DD\", but is {text:?}");
        // a leap year has every day
        let date = Date::strptime("%Y-%m-%d", format!("2016-{text}")).map_err(|_| fault())?;
        let day = Self { month: date.month().unsigned_abs(), day: date.day().unsigned_abs() };
        if day.to_string() == text { Ok(day) } else { Err(fault()) }
    }
}

impl fmt::Display for DayOfYear {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{:02}-{:02}", self.month, self.day)
    }
}

impl Serialize for DayOfYear {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for DayOfYear {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Reads a time of day, "HH:MM" from "00:00" to "24:00", in hours.
pub(super) fn hours_of_day(text: &str) -> Result<f64, String> {
    if text == "24:00" {
        return Ok(24.0);
    }
    match Time::strptime("%H:%M", text) {
        Ok(time) if text.len() == 5 => Ok(f64::from(time.hour()) + f64::from(time.minute()) / 60.0),
        _ => Err(format!("must be a time of day as \"HH:MM\", but is {text:?}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_and_times_are_read() {
        assert_eq!("02-29".parse(), Ok(DayOfYear { month: 2, day: 29 }));
        assert_eq!(DayOfYear { month: 12, day: 1 }.to_string(), "12-01");
        for text in ["2-29", "02-30", "13-01", "00-01", "02-29 ", ""] {
            assert!(text.parse::<DayOfYear>().is_err(), "{text}");
        }
        assert_eq!([hours_of_day("08:30"), hours_of_day("24:00")], [Ok(8.5), Ok(24.0)]);
        for text in ["8:30", "24:01", "08:60", "08:30:00", ""] {
            assert!(hours_of_day(text).is_err(), "{text}");
        }
    }
}
