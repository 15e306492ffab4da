//! Means, standard errors, intervals, and how errors fall with time.

pub mod interval;
pub mod moments;
pub mod power_law;

pub use moments::Moments;
