//! Tubes as Lambertian secondary sources: the flux that leaves a diffuser is computed once per pass and used by the whole room.

pub mod beside;
mod books;
pub mod cells;
pub mod flux;
pub mod light;
pub mod sight;
pub mod sizes;
mod traced;
pub mod zone;
