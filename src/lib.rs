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

pub use skyduct_annual as annual;
pub use skyduct_physics::{
    analytic, estimate, geometry, guide, integrator, optics, plan, sampling, scene, sky, statistics, traceable,
};

/// Version of this program: the environment variable `SKYDUCT_VERSION` of its build, or the package's version, with the commit where a release
/// was built in a checkout (`src/build.rs`).
pub const VERSION: &str = env!("VERSION_OF_BUILD");

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
