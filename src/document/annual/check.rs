//! Checks of the fields of a year.

use super::schedule::hours_of_day;
use super::{AnnualDocument, DimmingDocument, ScheduleDocument};
use crate::document::errors::Checks;
use crate::document::limits::{
    FILE_ID, MINIMUM_LIGHT, OUTPUTS, PERCENT, POWER_W_M2, RATIO, SUN_OFFSET_MINUTES, SUNS_PER_HOUR, THRESHOLD_LUX,
    THRESHOLDS, WEEKDAYS,
};

impl AnnualDocument {
    /// Adds a fault for each value that is out of its bounds.
    pub(in crate::document) fn check(&self, checks: &mut Checks) {
        self.weather.check(checks);
        if let Some(minutes) = self.sun_offset_minutes {
            checks.number("/annual/sun_offset_minutes", minutes, SUN_OFFSET_MINUTES);
        }
        checks.number("/annual/suns_per_hour", self.suns_per_hour, SUNS_PER_HOUR);
        if self.thresholds_lux.is_empty() {
            checks.refuse("/annual/thresholds_lux", "must name at least one illuminance");
        }
        checks.at_most("/annual/thresholds_lux", self.thresholds_lux.len(), &THRESHOLDS, "");
        checks.numbers("/annual/thresholds_lux", &self.thresholds_lux, THRESHOLD_LUX);
        for (index, lux) in self.thresholds_lux.iter().enumerate() {
            if self.thresholds_lux[..index].contains(lux) {
                checks.refuse(
                    format!("/annual/thresholds_lux/{index}"),
                    format!("must be unique, but {lux} is given before"),
                );
            }
        }
        let limits = checks.numbers("/annual/udi_lux", &self.udi_lux, THRESHOLD_LUX);
        if limits && !self.udi_lux.is_sorted_by(|one, next| one < next) {
            checks.refuse("/annual/udi_lux", "must ascend");
        }
        checks.number("/annual/sda/threshold_lux", self.sda.threshold_lux, THRESHOLD_LUX);
        checks.number("/annual/sda/time_percent", self.sda.time_percent, PERCENT);
        if let Some(dimming) = &self.dimming {
            check_dimming(dimming, checks);
        }
        checks.at_most("/annual/other_daylight", self.other_daylight.len(), &OUTPUTS, "");
        for (index, other) in self.other_daylight.iter().enumerate() {
            if !FILE_ID.contains(&other.file.chars().count()) {
                let detail = format!("must have {}..{} characters", FILE_ID.start(), FILE_ID.end());
                checks.refuse(format!("/annual/other_daylight/{index}/file"), detail);
            }
        }
        if !self.other_daylight.is_empty() && self.weather.with_pointers().count() > 1 {
            checks.refuse(
                "/annual/other_daylight",
                "must be left out with several weather files: it belongs to one year",
            );
        }
        if let Some(factors) = &self.maintenance {
            checks.numbers("/annual/maintenance", factors, RATIO);
        }
        self.check_schedule(checks);
    }

    fn check_schedule(&self, checks: &mut Checks) {
        match &self.schedule {
            ScheduleDocument::Lm83 | ScheduleDocument::DaylightHours => {}
            ScheduleDocument::Weekly(weekly) => {
                if weekly.days.is_empty() {
                    checks.refuse("/annual/schedule/days", "must name at least one day");
                }
                checks.at_most("/annual/schedule/days", weekly.days.len(), &WEEKDAYS, "");
                let mut read = |field: &str, text: &str| match hours_of_day(text) {
                    Ok(hours) => Some(hours),
                    Err(detail) => {
                        checks.refuse(format!("/annual/schedule/{field}"), detail);
                        None
                    }
                };
                if let (Some(from), Some(to)) = (read("from", &weekly.from), read("to", &weekly.to))
                    && from >= to
                {
                    checks.refuse("/annual/schedule/to", format!("must be later than `from`, {}", weekly.from));
                }
            }
            ScheduleDocument::Hours(hours) => {
                if let Some(index) = hours.occupied.iter().position(|occupied| *occupied > 1) {
                    checks.refuse(format!("/annual/schedule/occupied/{index}"), "must be 0 or 1");
                }
            }
        }
    }
}

fn check_dimming(dimming: &DimmingDocument, checks: &mut Checks) {
    checks.number("/annual/dimming/setpoint_lux", dimming.setpoint_lux, THRESHOLD_LUX);
    checks.number("/annual/dimming/power_w_m2", dimming.power_w_m2, POWER_W_M2);
    checks.number("/annual/dimming/minimum_power", dimming.minimum_power, RATIO);
    checks.number("/annual/dimming/minimum_light", dimming.minimum_light, MINIMUM_LIGHT);
}
