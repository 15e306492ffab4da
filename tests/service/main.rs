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

mod clients;
mod commands;
mod contract_answers;
mod durability_backup;
mod durability_folder;
mod durability_panic;
mod durability_process;
mod durability_queue;
mod durability_restart;
mod durability_store;
mod equal_jobs;
mod events;
mod idempotency;
mod jobs;
mod limits;
mod long_passes;
mod memory;
mod meshes;
mod operation;
mod operation_log;
mod owners;
mod page;
mod predictions;
mod queue_clients;
mod result_files;
mod retention;
mod security;
mod storm;
mod studies;
mod study_storage;
mod tube_flux;
mod turns;
