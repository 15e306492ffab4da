//! Reports on a job's tubes: fluxes that its passes estimate, and the performance of each tube by itself.

use std::sync::Arc;

use super::tube_performance::{ERROR_OF_REPORTS, LARGEST_ERROR, TubePerformance};
use crate::document::result::TubeResult;
use crate::document::result::number::coverage_factor;
use crate::document::result::tube_report::TubeReport;
use crate::guide::performance::REPLICATES;
use crate::present::prepared::Prepared;
use crate::statistics::interval::two_sided_normal_quantile;

impl Prepared {
    /// Computes the parts of tube reports and figures that do not depend on the passes, so that writing the files need not: for a thread of
    /// its own.
    pub fn look_ahead(&self) {
        self.subject();
        for tube in 0..self.scene.tubes.len() {
            self.performance_of(tube);
        }
    }

    fn performance_of(&self, tube: usize) -> Arc<TubePerformance> {
        let of_process =
            || TubePerformance::of(&self.traceable, tube, &self.scene.tubes[tube], self.error_of_reports());
        // a mesh takes some time to hash
        self.performances[tube].get_or_init(of_process).clone()
    }

    /// Makes the report on a tube; `flux`: the fluxes that the passes estimate.
    pub(super) fn tube_report(&self, tube: usize, flux: TubeResult) -> TubeReport {
        let performance = self.performance_of(tube);
        TubeReport {
            coverage_factor: coverage_factor(REPLICATES as f64, false),
            tube,
            guide: self.plan.guides[tube].kind.code().to_owned(),
            flux,
            beam: performance.beam.clone(),
            uniform_sky: performance.uniform_sky,
            sky: performance.sky,
            sun: performance.sun,
            equivalent_straight: performance.equivalent_straight,
        }
    }

    /// Returns the standard error of transmissions at which a report costs little beside the job.
    fn error_of_reports(&self) -> f64 {
        let asked = if self.grids().is_empty() { self.stop.view_relative_error } else { self.stop.relative_error };
        (ERROR_OF_REPORTS * asked / two_sided_normal_quantile(self.stop.confidence)).min(LARGEST_ERROR)
    }
}
