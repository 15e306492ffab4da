//! Counter-based random and low-discrepancy numbers, warps to the domains of light transport, and Russian roulette of faint paths.

pub mod cones;
pub mod lattice;
pub mod path_samples;
pub mod random;
pub mod roulette;
pub mod sobol;
pub mod streams;
pub mod warp;

pub use cones::{CONES_SHARE, NestedCones};
pub use path_samples::PathSamples;
pub use random::{Key, PathRandom};
pub use sobol::{Replicate, power_of_two};
pub use streams::Stream;
