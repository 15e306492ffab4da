//! A year of light from sky to metrics, against numbers that were computed independently; see `tests/reference/README.md`.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

mod coverage;
mod fluxes;
mod given;
mod metrics;
mod skies;
mod surroundings;
