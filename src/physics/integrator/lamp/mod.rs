//! A tube as a lamp: what leaves its Lambertian diffuser, found once a pass and used by all of the room.

mod books;
pub mod cells;
pub mod flux;
mod in_box;
pub mod light;
pub mod sight;
pub mod sizes;
