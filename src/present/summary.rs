//! Summary of a job's results, and the warnings that came up while they were computed.

use serde_json::Value;

use crate::VERSION;
use crate::document::canonical::canonical_hash;
use crate::document::errors::{Warning, WarningCode};
use crate::document::outputs::SURFACES;
use crate::document::result::{
    AccuracyResult, CrossCheckResult, EnergyResult, ExternalIlluminance, GridInShort, GridStatistics, JobResults,
    Known, PlanResult, TimingResult, TubeResult, ViewInShort,
};
use crate::document::stop::StopDocument;
use crate::engine::progress::StoppedBy;
use crate::engine::spent::Spent;
use crate::estimate::stopping::{grid_error, grid_without_light};
use crate::estimate::{Accuracy, Discrepancy, Estimate};
use crate::plan::EffectKind;
use crate::present::prepared::Prepared;
use crate::scene::Daylight;

/// Fraction of the rays that may leave tubes through gaps in their meshes without a warning: rounding loses fewer.
const MOST_LOST: f64 = 1e-6;

impl Prepared {
    /// Returns the field `plan` of results and of `POST /v1/plan`.
    pub fn plan_json(&self) -> Value {
        to_value(&PlanResult::from(&self.plan))
    }

    /// Returns the results that are known when a job is planned, under their names in the summary.
    pub fn known(&self) -> Known {
        let daylight = self.scene.daylight.as_ref();
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        Known::new(self.provenance.clone(), ExternalIlluminance { sky, sun })
    }

    /// Makes the summary for the job resource and for `result.json` of a job that `stopped_by` ended; it is merged into the job's JSON
    /// object.
    pub fn summary(&self, merged: &Estimate, spent: Spent, stopped_by: StoppedBy) -> JobResults {
        let daylight = self.scene.daylight.as_ref();
        let electric = self.plan.effects.is_on(EffectKind::Luminaires);
        let grids = self.scene.grids.iter().zip(&merged.grids).filter(|(grid, _)| grid.name != SURFACES);
        let grids = grids.map(|(grid, estimate)| {
            let statistics = GridStatistics::new(grid, estimate, daylight, electric);
            let mean_standard_error_lux = statistics.mean_lux_standard_error;
            let verdicts = self.moment_verdicts(grid, estimate);
            GridInShort { name: grid.name.clone(), statistics, mean_standard_error_lux, verdicts }
        });
        let tubes = self.scene.tubes.iter().zip(&merged.tubes);
        let numerical = merged.grids.iter().any(|grid| grid.numerical);
        let tubes = tubes.map(|(tube, estimate)| TubeResult::new(estimate, tube.opening_radius, daylight, numerical));
        let views = self.scene.views.iter();
        let views = views.map(|view| ViewInShort { name: view.name.clone(), size_px: view.size_px });
        let Known { provenance, switches, external_horizontal_illuminance_lux } = self.known();
        JobResults {
            accuracy: Some(self.accuracy_result(merged, stopped_by)),
            engine: Some(format!("skyduct {VERSION}")),
            document_hash: canonical_hash(&self.document).ok(),
            timing: Some(TimingResult::new(merged, spent.seconds, spent.cpu_seconds)),
            provenance: Some(provenance),
            switches: Some(switches),
            external_horizontal_illuminance_lux: Some(external_horizontal_illuminance_lux),
            grids: Some(grids.collect()),
            views: Some(views.collect()),
            tubes: Some(tubes.collect()),
            cross_check: self.cross_check(merged),
            energy: self.knows_energy().then(|| EnergyResult::new(&merged.energy, merged.passes_of_energy())),
            computed_by: None,
            render_warnings: Some(self.render_warnings(merged)),
        }
    }

    /// Returns the errors of a job that was ended by `stopped_by`, and the reasons why its grids and its views ended.
    fn accuracy_result(&self, merged: &Estimate, stopped_by: StoppedBy) -> AccuracyResult {
        // an output with fewer passes than the job was as accurate as requested before
        let of = |passes: u64| if passes < merged.passes { StoppedBy::RelativeError } else { stopped_by };
        let grids = (!merged.grids.is_empty()).then(|| of(merged.passes_of_grids()).name().to_owned());
        let views = (!merged.views.is_empty()).then(|| of(merged.passes_of_views()).name().to_owned());
        AccuracyResult::new(self.accuracy(merged), merged, self.stop.confidence, [grids, views])
    }

    /// Compares the grids with those of the second method, if there is one and it has found anything.
    fn cross_check(&self, merged: &Estimate) -> Option<CrossCheckResult> {
        let check = self.plan.methods.check.as_ref()?;
        let discrepancy = Discrepancy::of(&merged.grids, |grid| grid.companions.last())?;
        let errors = merged.grids.iter().filter_map(|grid| grid.companions.last()).map(grid_error);
        let error = errors.reduce(f64::max).filter(|error| error.is_finite());
        Some(CrossCheckResult::new(check.method.name(), &check.reason, &discrepancy, error))
    }

    /// Returns the warnings that came up while an estimate was made.
    pub fn render_warnings(&self, merged: &Estimate) -> Vec<Warning> {
        let disagree = self.cross_check(merged).filter(|check| !check.agrees);
        let disagree = disagree.map(|check| Warning { code: WarningCode::MethodsDisagree, detail: check.verdict });
        let others = disagree.into_iter().chain(self.no_light(merged)).chain(self.accuracy_not_reached(merged));
        self.lost_rays(merged).into_iter().chain(others).collect()
    }

    /// Warns of the output that is least accurate, relative to what was requested, in a job that was ended by the default number of passes.
    fn accuracy_not_reached(&self, merged: &Estimate) -> Option<Warning> {
        let (stop, Accuracy { grids, views, .. }) = (&self.stop, self.accuracy(merged));
        if merged.passes < stop.max_passes || stop.max_passes != StopDocument::default().max_passes {
            return None;
        }
        let outputs = [("grids", grids, stop.relative_error), ("views", views, stop.view_relative_error)];
        let missed = outputs.into_iter().filter_map(|(of, reached, asked)| Some((of, reached?, asked)));
        let missed = missed.filter(|(_, reached, asked)| reached > asked);
        let (of, reached, asked) = missed.max_by(|(_, a, of_a), (_, b, of_b)| (a / of_a).total_cmp(&(b / of_b)))?;
        let detail = format!(
            "the job ended after {} passes, the default of /stop/max_passes, with a relative error of the {of} of {:.2} %; {} % was \
             requested: allow more passes, or let auto choose a faster method",
            merged.passes,
            100.0 * reached,
            100.0 * asked,
        );
        Some(Warning { code: WarningCode::AccuracyNotReached, detail })
    }

    /// Warns of the first grid that no light has reached in many passes, in a scene that has light.
    fn no_light(&self, merged: &Estimate) -> Option<Warning> {
        let grid = grid_without_light(merged).filter(|_| !self.is_dark())?;
        let (estimate, passes) = (&merged.grids[grid], merged.passes_of_grids());
        let most = estimate.valued().map(|sensor| estimate.standard_error_lux(sensor)).fold(0.0, f64::max);
        let bound =
            if most > 0.0 { format!("; one more photon would add at most {most:.2e} lx") } else { String::new() };
        let detail = format!(
            "{passes} passes brought no light to any sensor of the grid {:?}{bound}: either no light can reach it \
             (something blocks it, or nothing reflects), or so rarely that this method does not find it; the job did \
             not wait for its relative error",
            self.scene.grids[grid].name
        );
        Some(Warning { code: WarningCode::NoLight, detail })
    }

    /// Warns of rays that left tubes through gaps, if they are more than rounding loses.
    fn lost_rays(&self, merged: &Estimate) -> Option<Warning> {
        let Estimate { rays, lost_rays, energy, .. } = merged;
        let passes = merged.passes_of_energy();
        if *lost_rays as f64 <= MOST_LOST * *rays as f64 {
            return None;
        }
        let flux = match self.knows_energy() {
            true => format!(", carrying {} lm", energy.lost / passes as f64),
            false => String::new(),
        };
        let detail = format!(
            "{lost_rays} of {rays} rays{flux} left a tube through gaps in its mesh instead of its opening or \
             collector: close the gaps between pipe, collector and ceiling, or weld the vertices"
        );
        Some(Warning { code: WarningCode::LostRays, detail })
    }

    /// Returns [`Self::summary`] as a JSON object.
    pub fn summary_json(&self, merged: &Estimate, spent: Spent, stopped_by: StoppedBy) -> Value {
        to_value(&self.summary(merged, spent, stopped_by))
    }

    /// True if the method that keeps the energy balance (that of the grids, or else of the views) follows light from its sources to its
    /// end.
    fn knows_energy(&self) -> bool {
        let methods = &self.plan.methods;
        self.is_dark()
            || methods
                .grids
                .as_ref()
                .or(methods.views.as_ref())
                .is_none_or(|choice| choice.method.described().outputs().energy)
    }
}

/// Converts a result to JSON. The types of this program always serialise: their keys are strings and their numbers finite or null.
fn to_value(result: &impl serde::Serialize) -> Value {
    serde_json::to_value(result).unwrap_or(Value::Null)
}
