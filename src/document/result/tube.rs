//! Fluxes through a tube.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::{coverage_factor, finite};
use crate::estimate::TubeEstimate;
use crate::scene::Daylight;
use crate::statistics::Moments;

/// Mean flux in lm with its standard error, which is null before the second pass, and where the method has no estimate of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FluxResult {
    /// Mean flux in lm.
    pub flux_lm: f64,
    /// Standard error of the mean flux in lm.
    pub standard_error_lm: Option<f64>,
    /// Coverage factor of GUM: this number of standard errors is half an interval of 95 %. It is Student's quantile for one
    /// degree of freedom less than replicates, or 1.96 for numerical errors.
    #[serde(default)]
    pub coverage_factor: Option<f64>,
}

impl From<&Moments> for FluxResult {
    fn from(moments: &Moments) -> Self {
        Self::new(moments, 1.0, false)
    }
}

impl FluxResult {
    /// Returns the flux of `moments`, one unit of which is `per_unit` lm; with `numerical` their spread is the estimated error of
    /// a solver.
    pub fn new(moments: &Moments, per_unit: f64, numerical: bool) -> Self {
        Self {
            flux_lm: per_unit * moments.mean,
            standard_error_lm: finite(per_unit * moments.standard_error()),
            coverage_factor: coverage_factor(moments.count, numerical),
        }
    }

    /// Returns half of the interval of 95 % in lm; `None` if it is not available or zero.
    pub fn half_interval_lm(&self) -> Option<f64> {
        Some(self.coverage_factor? * self.standard_error_lm?).filter(|half| *half > 0.0)
    }
}

/// Fluxes through one tube.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TubeResult {
    /// Flux that arrives at the collector from outside: at the end of the tube, at the outer face of a `dielectric_dome`, which
    /// is larger, or at a mesh's collector. Null, as every flux, before the first pass and with methods that do not follow light
    /// from its sources.
    pub at_collector: Option<FluxResult>,
    /// Flux that arrives at the upper side of the diffuser.
    pub at_diffuser: Option<FluxResult>,
    /// Flux that leaves the closure downward for the first time; light that returns to it from the room does not count.
    pub into_room: Option<FluxResult>,
    /// Part of `into_room` that leaves as from a Lambertian surface, to which the `responses` of grids refer: all of it below a
    /// Lambertian closure, the light through the Lambertian zone of a mixed one, and for a measured one the largest Lambertian
    /// part of its table.
    #[serde(default)]
    pub into_room_evenly: Option<FluxResult>,
    /// Ratio of `into_room` to `at_collector`; null without light.
    pub transmission_efficiency: Option<f64>,
    /// Standard error of `transmission_efficiency`, smaller than those of the fluxes, whose errors cancel in part; its coverage factor is that of
    /// `into_room`.
    #[serde(default)]
    pub transmission_efficiency_standard_error: Option<f64>,
    /// Unobstructed horizontal illuminance times the area of the opening in the ceiling, in lm: the flux that a level aperture of
    /// that size would receive without tube and collector.
    #[serde(default)]
    pub level_aperture_flux_lm: f64,
    /// Ratio of `into_room` to `level_aperture_flux_lm`, by which different collectors can be compared; null without light.
    #[serde(default)]
    pub level_aperture_efficiency: Option<f64>,
    /// Standard error of `level_aperture_efficiency`; its coverage factor is that of `into_room`.
    #[serde(default)]
    pub level_aperture_efficiency_standard_error: Option<f64>,
}

impl TubeResult {
    /// Returns the fluxes of a tube whose opening has a radius of `opening_radius` metres; with `numerical` a deterministic
    /// solver computed them.
    pub fn new(tube: &TubeEstimate, opening_radius: f64, daylight: Option<&Daylight>, numerical: bool) -> Self {
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        let flux = |moments: &Moments| (moments.count > 0.0).then(|| FluxResult::new(moments, 1.0, numerical));
        let level_aperture_flux_lm = (sky + sun) * PI * opening_radius * opening_radius;
        let into_room = flux(&tube.into_room);
        let over_level_aperture = |lm: Option<f64>| lm.and_then(|lm| finite(lm / level_aperture_flux_lm));
        Self {
            at_collector: flux(&tube.at_collector),
            at_diffuser: flux(&tube.at_diffuser),
            into_room,
            into_room_evenly: flux(&tube.evenly),
            transmission_efficiency: finite(tube.into_room.mean / tube.at_collector.mean),
            transmission_efficiency_standard_error: finite(tube.transmission.standard_error()),
            level_aperture_flux_lm,
            level_aperture_efficiency: over_level_aperture(into_room.map(|flux| flux.flux_lm)),
            level_aperture_efficiency_standard_error: over_level_aperture(
                into_room.and_then(|flux| flux.standard_error_lm),
            ),
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
