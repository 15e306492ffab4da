//! Job documents: what is accepted, what is refused and with which words.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

#[path = "../shared/schema.rs"]
mod schema;

#[path = "../shared/given.rs"]
mod given;

#[path = "../../fuzz/src/lib.rs"]
mod fuzzed;

mod annual;
mod any;
mod bounds;
mod closure_shapes;
mod contract;
mod effects;
mod faces;
mod hints;
mod instances;
mod mesh_files;
mod methods;
mod models;
mod plans;
mod room;
mod seeds;
mod sheets;
mod sky;
mod surroundings;
mod text;
mod tilted;
mod tubes;
