//! Levels of accuracy: how many rays and points the rules take at the first one, and where the last one is.

/// Independent randomisations.
pub const REPLICATES: u64 = 8;

/// Rays per source, tube and randomisation at the first level; four times as many at each next one.
pub const FIRST_RAYS: u64 = 1 << 13;

/// Rays per point sensor and tube with a clear zone at the first level; four times as many at each next one.
pub const FIRST_SENSOR_RAYS: u64 = 1 << 8;

/// Nodes over the solar disc, and steps along the arc of each, at the first level; twice as many at each next one.
pub const FIRST_SUN_NODES: usize = 16;
pub const FIRST_SUN_STEPS: usize = 64;

/// Levels at most: 2^21 rays per source, tube and randomisation.
pub const LEVELS: u32 = 5;

/// No level is begun that would take more rays than this.
pub const MOST_RAYS: u64 = 2_000_000_000;
