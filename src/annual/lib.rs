//! Daylight over a year: weather files, lumens of tubes by the hour, illuminance of sensors, metrics with errors and verdicts.

pub mod moment;
pub mod weather;
