//! Means, standard errors, confidence intervals, and the law by which errors fall with time.

pub mod interval;
pub mod moments;
pub mod power_law;

pub use moments::Moments;
