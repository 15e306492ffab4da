//! Light followed backward: paths from sensors and eyes to luminaires, sky and sun.

pub(super) mod chance;
pub mod clear_zones;
pub(super) mod daylight;
pub(super) mod meeting;
pub(super) mod next_event;
pub(super) mod opening;
pub(super) mod pass;
pub mod room_entry;
pub(super) mod sunlight;
pub mod through_opening;
pub mod unscattered;
pub mod up_guide;
pub(super) mod vertex;
mod walk;
