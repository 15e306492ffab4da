//! Jobs that nobody wrote: documents are generated, and what must hold of every job is asked of each.
//!
//! `GENERATED_CASES` is the number of cases of each property; tests that are ignored take minutes, the others seconds.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

#[path = "../shared/judge.rs"]
mod judge;
#[path = "../shared/measured_values.rs"]
mod measured_values;
#[path = "../shared/schema.rs"]
mod schema;

mod agreement;
mod coverage;
mod far;
mod generator;
mod invariance;
mod kinds;
mod mutated;
mod render;
