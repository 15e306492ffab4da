//! Means, standard errors, intervals.

pub mod interval;
pub mod moments;

pub use moments::Moments;
