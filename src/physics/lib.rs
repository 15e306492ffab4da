//! Light through tubes into rooms: what stands left of the job document.
//!
//! A **scene** calls for **effects** (the plan), the plan picks an **integrator**, the integrator runs **passes**, passes add
//! up to **estimates** with errors. Everything is f64, in SI units, radians and the room frame (x = east, y = north,
//! z = up), and knows no HTTP, SQL, serde, files or clocks: the manifest has none of their crates. Same input, same bits:
//! random numbers are keyed by (seed, pass, path, dimension), and sums are folded in a fixed order.

// tests compare with the system's functions
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod sampling;
pub mod statistics;

pub mod geometry;
pub mod optics;
pub mod sky;

pub mod guide;

pub mod scene;

pub mod traceable;

pub mod analytic;

pub mod integrator;
pub mod plan;

pub mod estimate;
