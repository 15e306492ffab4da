//! Estimates of density from photons that are kept: what sensors and eyes gather from them.

pub mod domain;
pub mod grid;
pub mod maps;
pub mod memory;
pub mod near_light;
pub mod progressive;
pub mod store;
pub mod visible_point;
