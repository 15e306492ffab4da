//! Photons from sky, sun and luminaires: emission, paths, connections and energy balance.

pub mod chunks;
pub mod close_points;
pub(crate) mod connect;
pub mod descent;
pub mod emission;
pub mod energy_balance;
pub mod events;
pub mod nearness;
pub mod path;
