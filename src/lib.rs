//! Daylight simulation for tubular daylight devices, as an HTTP render service with a job queue.
//!
//! A job document comes in, becomes a **scene**, the scene calls for **effects** (the plan), the plan picks an
//! **integrator**, the integrator runs **passes**, passes add up to **estimates** with errors, estimates become **files
//! and events**. Nothing goes back up: `tests/house/architecture.rs` fails when an import climbs.
//!
//! ```text
//! http ─┐                                                             ┌─> db (jobs, chunks, events)
//! cli  ─┴─> document ─> scene ─> plan ─> integrator ─> estimate ─> output ─┴─> artifacts (object store)
//!                                 └─ engine: passes ─ predict ─ present: files ─ queue: the worker ─┘
//! ```
//!
//! Physics (everything left of `document`) is f64, in SI units, radians and the room frame (x = east, y = north,
//! z = up), and knows no HTTP, SQL, serde, files or clocks. Same input, same bits: random numbers are keyed by
//! (seed, pass, path, dimension), and sums are folded in a fixed order.

// tests compare with the system's functions
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub use skyduct_physics::{
    analytic, estimate, geometry, guide, integrator, optics, plan, sampling, scene, sky, statistics, traceable,
};

/// Version of this program: what its builder says by the environment variable `SKYDUCT_VERSION`, such as `git describe` tells it, or that of
/// the package.
pub const VERSION: &str = match option_env!("SKYDUCT_VERSION") {
    Some(version) if !version.is_empty() => version,
    _ => env!("CARGO_PKG_VERSION"),
};

pub mod output;

pub mod figure;

pub mod document;

pub mod engine;

pub mod predict;

pub mod present;

pub mod queue;

pub mod study;

pub mod cli;
pub mod db;
pub mod http;
