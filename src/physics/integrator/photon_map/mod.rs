//! Photon maps: density estimation from stored photons, at sensors and along eye rays.

pub mod domain;
pub mod grid;
mod lanes;
pub(crate) mod maps;
pub(crate) mod memory;
pub(crate) mod near_light;
pub(crate) mod outline;
pub mod progressive;
pub(crate) mod store;
pub(crate) mod strata;
pub mod surfaces;
pub(crate) mod trial;
pub(crate) mod visible_point;
