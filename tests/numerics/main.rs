//! Numerically hard cases: inputs at which what is right on paper goes wrong in floating point, or at a bound.
//!
//! docs/numerics.md lists them, each with the tests that show it; cases that tests elsewhere show are not repeated here.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

#[expect(dead_code, reason = "each test binary uses its part")]
#[path = "../shared/given.rs"]
mod given;
#[expect(dead_code, reason = "each test binary uses its part")]
#[path = "../shared/reference.rs"]
mod reference;
#[expect(dead_code, reason = "each test binary uses its part")]
#[path = "../shared/scenes.rs"]
mod scenes;
#[path = "../shared/schema.rs"]
mod schema;
#[path = "../shared/source_files.rs"]
mod source_files;

mod forms;
mod jobs;

mod dielectrics_and_diffusers;
mod geometry;
mod page;
mod placed_tubes;
mod room_and_estimators;
mod sky_and_sun;

mod tube;
