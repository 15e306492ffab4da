//! What patches of the room's surfaces know of reflected light, and how sensors gather it.
//!
//! - [`gathering`]: what comes to a point from all around, by rays whose ends send what patches know.
//! - [`known`]: what patches know of the places where rays end.
//! - [`indirect`]: the light on patches, and what it may have wrong.
//! - [`radiosity`]: the equations between patches, by rays.
//! - [`patches`]: the surfaces in patches.

pub mod gathering;
pub mod indirect;
pub mod known;
mod patches;
mod radiosity;
