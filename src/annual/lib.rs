//! Daylight over a year: weather files, lumens of tubes by the hour, illuminance of sensors, metrics with errors and verdicts.

// tests compare with the system's functions
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod calendar;
pub mod eyes;
pub mod fluxes;
pub mod light;
pub mod metrics;
pub mod moment;
pub mod pattern;
pub mod response;
pub mod schedule;
pub mod sensors;
pub mod summary;
pub mod sun;
pub mod weather;
