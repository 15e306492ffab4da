//! Levels of accuracy: the numbers of rays and points of the rules at the first level, and limits of the last one.

/// Number of independent randomisations.
pub const REPLICATES: u64 = 8;

/// Number of rays per source, tube and randomisation at the first level; four times as many at each next one.
pub const FIRST_RAYS: u64 = 1 << 13;

/// Number of rays per point sensor and tube with a clear zone at the first level; four times as many at each next one.
pub const FIRST_SENSOR_RAYS: u64 = 1 << 8;

/// Number of rays of the first level, to all point sensors together and one tube, above which each sensor gets fewer: some seconds.
const FIRST_ANSWER_RAYS: u64 = 1 << 24;

/// Largest number of quarterings of the rays per sensor: 4 in each randomisation are left.
const MOST_QUARTERINGS: u32 = 3;

/// Returns the number of times that the rays per sensor are quartered, so that the first level of `sensors` sensors ends soon.
pub fn quarterings(sensors: usize) -> u32 {
    let rays = sensors as u64 * FIRST_SENSOR_RAYS * REPLICATES;
    (0..MOST_QUARTERINGS).find(|times| rays >> (2 * times) <= FIRST_ANSWER_RAYS).unwrap_or(MOST_QUARTERINGS)
}

/// Number of intervals of the solar disc for the sunlight at points: with fewer, bright edges between all of them can stay unseen.
pub const SUN_INTERVALS: usize = 32;

/// Error of the sunlight at points, relative to the requested standard error.
pub const SUN_TOLERANCE: f64 = 0.1;

/// Largest number of levels: 2^21 rays per source, tube and randomisation.
pub const LEVELS: u32 = 5;

/// Number of rays above which no level is begun.
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
