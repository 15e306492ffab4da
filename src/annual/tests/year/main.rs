//! A year of light from sky to metrics, against numbers that were computed independently; see `tests/reference/README.md`.

mod coverage;
mod fluxes;
mod given;
mod metrics;
mod skies;
