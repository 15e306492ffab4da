//! Settings of bidirectional path tracing, and the numbers of a pass that follow from them.

use crate::integrator::pass_size::PassSize;

/// Settings of bidirectional path tracing.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of photons emitted per pass, all tubes and sources together; 64..=1_048_576: a pass stores their vertices. `None`: by the
    /// requested accuracy.
    pub photons_per_pass: Option<u64>,
    /// Number of eye paths per sensor and pass; 1..=65_536; `None`: in proportion to the photons.
    pub samples_per_sensor: Option<u32>,
    /// Number of eye paths per pixel and pass; 1..=4_096.
    pub samples_per_pixel: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: None, samples_per_sensor: None, samples_per_pixel: 1 }
    }
}

/// Largest number of photons of a pass, unless the document sets it, and their number with views.
pub const MOST: f64 = 16_384.0;

/// Number of photons of a pass of grids alone, unless the document sets it.
const PHOTONS: PassSize = PassSize { for_one_percent: 1024.0, growth: 1.7, fewest: 256.0, most: MOST };

/// Number of photons of a pass for each path of a sensor: both then contribute about equally to the errors.
const PHOTONS_TO_A_SAMPLE: u64 = 64;

/// Numbers of photons and paths of a pass.
#[derive(Clone, Copy, Debug)]
pub struct PathCounts {
    /// Number of photons of all tubes and sources together.
    pub photons: u64,
    /// Number of eye paths of each sensor.
    pub per_sensor: u32,
    /// Number of eye paths of each pixel.
    pub per_pixel: u32,
}

impl Settings {
    /// Returns the numbers of a pass for a relative standard error `target` of grids, or with views.
    pub fn path_counts(&self, target: f64, views: bool) -> PathCounts {
        let wanted = if views { MOST as u64 } else { PHOTONS.power_of_two(target) };
        let photons = self.photons_per_pass.unwrap_or(wanted);
        let samples = (photons / PHOTONS_TO_A_SAMPLE).max(1);
        PathCounts {
            photons,
            per_sensor: self.samples_per_sensor.unwrap_or(samples as u32),
            per_pixel: self.samples_per_pixel,
        }
    }
}
