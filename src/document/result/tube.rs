//! The fluxes through a tube.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::{coverage_factor, finite};
use crate::estimate::TubeEstimate;
use crate::scene::Daylight;
use crate::statistics::Moments;

/// A mean with its standard error (null before the second pass, and where nothing is known of it), in lm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FluxResult {
    /// Mean flux.
    pub flux_lm: f64,
    /// Standard error of the mean flux.
    pub standard_error_lm: Option<f64>,
    /// Times the standard error is half an interval of 95 %: GUM's coverage factor, Student's quantile for one less than the
    /// replicates; 1.96 of numerical errors.
    #[serde(default)]
    pub coverage_factor: Option<f64>,
}

impl From<&Moments> for FluxResult {
    fn from(moments: &Moments) -> Self {
        Self::new(moments, 1.0, false)
    }
}

impl FluxResult {
    /// `per_unit`: what one unit of the moments stands for, in lm; `numerical`: their spread is a solver's estimated error.
    pub fn new(moments: &Moments, per_unit: f64, numerical: bool) -> Self {
        Self {
            flux_lm: per_unit * moments.mean,
            standard_error_lm: finite(per_unit * moments.standard_error()),
            coverage_factor: coverage_factor(moments.count, numerical),
        }
    }

    /// Half of the interval of 95 % in lm, where it is known and above zero.
    pub fn half_interval_lm(&self) -> Option<f64> {
        Some(self.coverage_factor? * self.standard_error_lm?).filter(|half| *half > 0.0)
    }
}

/// Flux through one tube.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeResult {
    /// Arrives at the collector from outside: at the end of the tube, at the outer face of a `dielectric_dome`, which
    /// is larger, or at a mesh's collector.
    /// Null, as every flux, before the first pass and by methods that do not follow light from its sources.
    pub at_collector: Option<FluxResult>,
    /// Arrives at the diffuser's top.
    pub at_diffuser: Option<FluxResult>,
    /// Leaves the closure downward for the first time: light of the room that comes back does not count.
    pub into_room: Option<FluxResult>,
    /// The part of that which leaves as from a Lambertian surface: what the `responses` of grids speak of. All of it below a Lambertian
    /// closure, what passes the Lambertian zone of a mixed one, and of a measured one the largest Lambertian sheet that its table holds.
    #[serde(default)]
    pub into_room_evenly: Option<FluxResult>,
    /// Flux into the room over flux at the collector; null without light.
    pub transmission_efficiency: Option<f64>,
    /// Unobstructed horizontal illuminance times the area of the opening in the ceiling: what a level aperture of that
    /// size would receive without tube and collector.
    #[serde(default)]
    pub level_aperture_flux_lm: f64,
    /// Flux into the room over that: comparable between collectors; null without light.
    #[serde(default)]
    pub level_aperture_efficiency: Option<f64>,
}

impl TubeResult {
    /// `opening_radius` in metres; `numerical`: a solver found the fluxes.
    pub fn new(tube: &TubeEstimate, opening_radius: f64, daylight: Option<&Daylight>, numerical: bool) -> Self {
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        let flux = |moments: &Moments| (moments.count > 0.0).then(|| FluxResult::new(moments, 1.0, numerical));
        let level_aperture_flux_lm = (sky + sun) * PI * opening_radius * opening_radius;
        Self {
            at_collector: flux(&tube.at_collector),
            at_diffuser: flux(&tube.at_diffuser),
            into_room: flux(&tube.into_room),
            into_room_evenly: flux(&tube.evenly),
            transmission_efficiency: finite(tube.into_room.mean / tube.at_collector.mean),
            level_aperture_flux_lm,
            level_aperture_efficiency: flux(&tube.into_room)
                .and_then(|flux| finite(flux.flux_lm / level_aperture_flux_lm)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::zenith::ZenithFormula;

    #[test]
    fn darkness_is_null_and_not_nan() {
        let dark = Daylight { sky: None, sun: None, formula: ZenithFormula::GivenZenithLuminance };
        let tube = TubeResult::new(&TubeEstimate::default(), 0.1, Some(&dark), false);
        assert_eq!((tube.transmission_efficiency, tube.level_aperture_efficiency), (None, None));
    }
}
