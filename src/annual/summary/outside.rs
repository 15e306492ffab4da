//! Light outside over a year.

use crate::light::{LitMoment, by_record};

use super::input::Hours;
use crate::metrics::points::Illuminances;

/// Light outside over a year.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outside {
    /// Diffuse horizontal illuminance in klx h.
    pub diffuse_klxh: f64,
    /// Horizontal illuminance of the sun in klx h.
    pub direct_klxh: f64,
    /// Median of the diffuse horizontal illuminance over the daylight hours of EN 17037, in lux.
    pub median_diffuse_lux: f64,
}

impl Outside {
    /// Adds up the moments of a year.
    pub(super) fn new(lit: &[LitMoment], hours: &Hours) -> Self {
        // the sum of nothing is -0
        let sum =
            |of: fn(&LitMoment) -> f64| 1e-3 * hours.each * (0.0 + lit.iter().map(|at| at.share * of(at)).sum::<f64>());
        let (diffuse, _) = by_record(lit, hours.daylight.len());
        let counting = diffuse.iter().zip(hours.daylight).filter(|(_, counts)| **counts);
        let counting: Vec<f64> = counting.map(|(lux, _)| *lux).collect();
        let counting = Illuminances { records: counting.len(), lit_lux: counting, ..Illuminances::default() };
        Self {
            diffuse_klxh: sum(|moment| moment.diffuse_horizontal_lux),
            direct_klxh: sum(LitMoment::direct_horizontal_lux),
            median_diffuse_lux: counting.median_lux().value,
        }
    }
}
