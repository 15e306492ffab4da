//! Levels of accuracy: how many rays and points the rules take at the first one, and where the last one is.

/// Independent randomisations.
pub const REPLICATES: u64 = 8;

/// Rays per source, tube and randomisation at the first level; four times as many at each next one.
pub const FIRST_RAYS: u64 = 1 << 13;

/// Rays per point sensor and tube with a clear zone at the first level; four times as many at each next one.
pub const FIRST_SENSOR_RAYS: u64 = 1 << 8;

/// Rays of the first level to all point sensors together and one tube above which each sensor gets fewer: some seconds.
const FIRST_ANSWER_RAYS: u64 = 1 << 24;

/// Quarterings of the rays per sensor at most: 4 in each randomisation are left.
const MOST_QUARTERINGS: u32 = 3;

/// Number of times that the rays per sensor are quartered, so that the first level of `sensors` sensors ends soon.
pub fn quarterings(sensors: usize) -> u32 {
    let rays = sensors as u64 * FIRST_SENSOR_RAYS * REPLICATES;
    (0..MOST_QUARTERINGS).find(|times| rays >> (2 * times) <= FIRST_ANSWER_RAYS).unwrap_or(MOST_QUARTERINGS)
}

/// Nodes over the solar disc, and steps along the arc of each, at the first level; twice as many at each next one.
pub const FIRST_SUN_NODES: usize = 16;
pub const FIRST_SUN_STEPS: usize = 64;

/// Levels at most: 2^21 rays per source, tube and randomisation.
pub const LEVELS: u32 = 5;

/// No level is begun that would take more rays than this.
pub const MOST_RAYS: u64 = 2_000_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_sensors_begin_with_fewer_rays_each() {
        assert_eq!([1, 81, 8192].map(quarterings), [0; 3]);
        assert_eq!([8193, 90_000, 1_000_000].map(quarterings), [1, 2, 3]);
    }
}
