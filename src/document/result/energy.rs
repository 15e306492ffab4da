//! Energy balance of the emitted flux as JSON.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::estimate::EnergyBalance;

/// Energy balance: flux by the place where it ended, in lm, the mean over passes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EnergyResult {
    /// Flux that reaches the collectors from outside.
    pub emitted_lm: f64,
    /// Flux that leaves the luminaires.
    #[serde(default)]
    pub luminaires_lm: f64,
    /// Flux that collectors reflect or absorb on the way in, or that passes through a dome and leaves on its far side.
    pub collector_lm: f64,
    /// Flux absorbed by the mirrors of guides.
    pub guide_lm: f64,
    /// Flux that leaves through the upper end of a guide.
    pub guide_top_lm: f64,
    /// Flux absorbed by diffusers, or scattered upward by them into a guide from which no light returns.
    pub diffuser_lm: f64,
    /// Flux absorbed by the surfaces of the room, its objects and luminaires.
    pub room_lm: f64,
    /// Flux that leaves through open surfaces of the room.
    pub open_surfaces_lm: f64,
    /// Flux of paths that were cut off at the maximum length.
    pub cut_lm: f64,
    /// Flux that left guides through gaps in their meshes.
    #[serde(default)]
    pub lost_lm: f64,
    /// Relative error of the balance: (emitted + luminaires - all others) / (emitted + luminaires); zero without light.
    pub relative_closure_error: f64,
}

impl EnergyResult {
    /// Returns the mean over `passes` of the sums in `energy`; zeros before the first pass.
    pub fn new(energy: &EnergyBalance, passes: u64) -> Self {
        let EnergyBalance {
            emitted,
            luminaires,
            collector,
            guide,
            guide_top,
            diffuser,
            room,
            open_surfaces,
            cut,
            lost,
        } = *energy;
        let per_pass = |sum: f64| {
            if passes == 0 { 0.0 } else { sum / passes as f64 }
        };
        Self {
            emitted_lm: per_pass(emitted),
            luminaires_lm: per_pass(luminaires),
            collector_lm: per_pass(collector),
            guide_lm: per_pass(guide),
            guide_top_lm: per_pass(guide_top),
            diffuser_lm: per_pass(diffuser),
            room_lm: per_pass(room),
            open_surfaces_lm: per_pass(open_surfaces),
            cut_lm: per_pass(cut),
            lost_lm: per_pass(lost),
            relative_closure_error: energy.relative_closure_error(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_light_nothing_is_missing() {
        assert_eq!(EnergyResult::new(&EnergyBalance::default(), 0).relative_closure_error, 0.0);
    }
}
