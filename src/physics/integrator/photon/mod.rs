//! Light that is followed from its sources: photons from sky, sun and luminaires.

pub mod chunks;
pub mod close_points;
pub(crate) mod connect;
pub mod descent;
pub mod emission;
pub mod ledger;
pub mod path;
