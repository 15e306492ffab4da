//! Light that is followed backward: paths from sensors and eyes to luminaires, sky and sun.

pub(super) mod daylight;
pub(super) mod pass;
pub mod unscattered;
pub(super) mod walk;
