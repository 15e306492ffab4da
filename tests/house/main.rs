//! The walls of the house, and what its comments and pages point to.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

#[path = "../shared/source_files.rs"]
mod source_files;

mod architecture;
mod circles;
mod citations;
mod openings;
