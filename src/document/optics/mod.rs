//! Optical properties in documents: coefficients, mirrors, measured diffusers.

pub mod coefficient;
pub mod measured;
pub mod mirror;
pub mod table;

pub use coefficient::Coefficient;
