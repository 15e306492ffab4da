//! Criteria of schemes for the moment of a job without a year.

use crate::annual::metrics::area::Area;
use crate::annual::metrics::moment::GridAtMoment;
use crate::annual::metrics::{CONFIDENT, Value};
use crate::document::result::annual::VerdictResult;
use crate::document::result::number::coverage_factor_of_sensors;
use crate::document::sky::time::clock;
use crate::document::sky::{SkyDocument, SkyPreset};
use crate::estimate::GridEstimate;
use crate::present::prepared::Prepared;
use crate::scene::Grid;

/// Smallest CIE type of clear skies, and smallest clearness of Perez of them (his sixth of eight classes).
const CLEAR_TYPES: std::ops::RangeInclusive<u8> = 11..=15;
const LEAST_CLEARNESS: f64 = 2.8;

impl Prepared {
    /// Compares a grid with the criteria that name the job's moment; none at most moments, of jobs with a year, of
    /// sensors that do not look straight up, and before an error is known.
    pub(super) fn moment_verdicts(&self, grid: &Grid, estimate: &GridEstimate) -> Vec<VerdictResult> {
        let document = self.subject().document.as_ref();
        let document = document.filter(|document| document.annual.is_none() && grid.is_level());
        let moment = document.and_then(|document| Some((document.sky.as_ref()?, clock(document.time.as_deref()?)?)));
        let (Some((sky, clock)), Some(factor)) = (moment, coverage_factor_of_sensors(estimate)) else {
            return Vec::new();
        };
        let value = |sensor: usize| Value {
            value: estimate.illuminance_lux(sensor),
            standard_error: factor / CONFIDENT * estimate.standard_error_lux(sensor),
        };
        let weights: Vec<f64> = (0..grid.len())
            .map(|sensor| if estimate.has_value(sensor) { estimate.weight(sensor) } else { 0.0 })
            .collect();
        let lux: Vec<Value> = (0..grid.len()).map(value).collect();
        let [low, high] = self.scene.room.enclosure.bounds();
        let middle = grid.nearest(low.midpoint(high).truncate(), |sensor| weights[sensor] > 0.0);
        let area = Area { weights: &weights };
        let moment = GridAtMoment { clock, is_clear: self.is_clear(sky), area, lux: &lux, middle };
        moment.verdicts().iter().map(VerdictResult::from).collect()
    }

    fn is_clear(&self, sky: &SkyDocument) -> bool {
        let by_type = sky.cie_type.is_some_and(|cie_type| CLEAR_TYPES.contains(&cie_type));
        let clearness = self.provenance.zenith.as_ref().and_then(|zenith| zenith.clearness);
        by_type || sky.preset == Some(SkyPreset::IesClear) || clearness.is_some_and(|of| of >= LEAST_CLEARNESS)
    }
}
