//! Tubes as Lambertian secondary sources: the flux that leaves a diffuser is computed once per pass and used by the whole room.

pub mod cells;
pub mod closure_source;
mod directional;
pub mod flux;
pub mod light;
pub mod opening_visibility;
pub mod patches;
pub mod photon_counts;
mod room_balance;
pub mod visible_parts;
pub mod zone;
