//! Predictions: the time and the error of a job before it runs, and its end while it runs.

pub mod forecast;
pub mod pilot;
mod pilot_outcome;
pub(crate) mod pilot_passes;
mod pilot_run;
pub(crate) mod pilot_sample;
pub mod predictions;
