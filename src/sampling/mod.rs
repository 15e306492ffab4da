//! Random and low-discrepancy numbers by counter, and warps to the domains that light needs.

pub mod random;
pub mod sobol;
pub mod warp;

pub use random::{Key, PathRandom};
pub use sobol::Replicate;
