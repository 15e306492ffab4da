//! Target that a reader of a report, or of a figure of a year, asks for by the address.

use serde::Deserialize;
use serde_json::Value;
use utoipa::IntoParams;

use crate::document::annual::AnnualDocument;
use crate::document::limits::TARGET_LUX;
use crate::http::problem::Problem;
use crate::present::target::{TargetPart, WantedTarget};

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct TargetQuery {
    /// Illuminance in lux with which the first grid of a report, or the grid of a figure `autonomy.NAME`, is compared, in place of the
    /// `target_lux` of its document. For jobs with `annual` one of its `thresholds_lux` or of the targets of its grids, or its
    /// `sda.threshold_lux` for a part of the area.
    #[param(exclusive_minimum = 0, maximum = 1_000_000)]
    target_lux: Option<f64>,
    /// Part of the grid that should have `target_lux`: the mean, which is meant when absent, half of the area, or 95 % of it. It has
    /// no effect without `target_lux`.
    #[param(inline)]
    target_of: Option<TargetPart>,
}

impl TargetQuery {
    /// Returns the target that is asked for.
    pub(super) fn wanted(&self) -> Result<Option<WantedTarget>, Problem> {
        let Some(lux) = self.target_lux else { return Ok(None) };
        if !TARGET_LUX.contains(lux) {
            return Err(Problem::invalid_parameter("target_lux", format!("must be {TARGET_LUX}, but is {lux}")));
        }
        Ok(Some(WantedTarget { lux, part: self.target_of.unwrap_or_default() }))
    }
}

/// Checks that a job can be compared with a target: a year can with its illuminances alone.
pub(super) fn check(wanted: WantedTarget, document: &Value) -> Result<(), Problem> {
    let refused = |detail: String| Err(Problem::invalid_parameter("target_lux", detail));
    if !document["grids"][0].is_object() {
        return refused("is allowed only for jobs with a grid".to_owned());
    }
    let Ok(annual) = AnnualDocument::deserialize(&document["annual"]) else { return Ok(()) };
    // targets of the document are among the illuminances of its year
    let is_of_document = |grid: &Value| grid["target_lux"].as_f64() == Some(wanted.lux);
    let in_document = document["grids"].as_array().is_some_and(|grids| grids.iter().any(is_of_document));
    match wanted.part {
        TargetPart::Mean if !in_document && !annual.thresholds_lux.contains(&wanted.lux) => {
            refused(format!("must be one of `annual.thresholds_lux`, {:?}", annual.thresholds_lux))
        }
        TargetPart::Half | TargetPart::Most if annual.sda.threshold_lux != wanted.lux => {
            refused(format!("must be `annual.sda.threshold_lux`, {}, for a part of the area", annual.sda.threshold_lux))
        }
        _ => Ok(()),
    }
}
