//! A tube as a lamp: what leaves its diffuser as from a Lambertian surface, found once a pass and used by all of the room.

pub mod beside;
mod books;
pub mod cells;
pub mod flux;
pub mod light;
pub mod sight;
pub mod sizes;
mod traced;
pub mod zone;
