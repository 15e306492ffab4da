//! The service as its users meet it: the API, the command line, what faults and crashes may do.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

mod common;
mod process;
#[path = "../shared/schema.rs"]
mod schema;

mod durability;
mod job_sets;
mod jobs;
mod limits;
mod meshes;
mod models;
mod operation;
mod owners;
mod studies;
mod tube_flux;
mod weather;
