//! A second opinion on the grids of a job.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::finite;
use crate::estimate::Discrepancy;

/// What a second, independent method found of the same grids.
///
/// Discrepancies are in standard errors of the difference, few passes allowed for: 2 is chance, 5 is not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CrossCheckResult {
    /// Name of the second method.
    pub method: String,
    /// Why it was taken, for people.
    pub reason: String,
    /// Number of sensors that were compared.
    pub sensors: usize,
    /// Largest discrepancy of a sensor; the largest of n is about 2.5 for 81 where both are right. Null where values without errors
    /// differ.
    pub worst_sigma: Option<f64>,
    /// Root mean square of the discrepancies, about 1 where both are right; null as the largest one.
    pub rms_sigma: Option<f64>,
    /// Largest discrepancy of the mean of a grid.
    pub mean_sigma: Option<f64>,
    /// Relative standard error of the second method's values, RMS over the sensors as in `accuracy`: what it could see.
    pub relative_error: Option<f64>,
    /// False where the discrepancies are more than chance makes of that many sensors: one of the two methods is wrong.
    pub agrees: bool,
    /// What follows, for people.
    pub verdict: String,
}

impl CrossCheckResult {
    /// The result of comparing with `method`, whose grids have `relative_error`.
    pub fn new(method: &str, reason: &str, discrepancy: &Discrepancy, relative_error: Option<f64>) -> Self {
        let Discrepancy { sensors, worst, rms, of_means } = *discrepancy;
        let seen = relative_error
            .map_or(String::new(), |error| format!(", at a relative standard error of {:.2} %", 100.0 * error));
        let verdict = if discrepancy.is_too_much() {
            format!("{method} finds other values{seen}: one of the two methods is wrong here")
        } else {
            format!("{method} finds the same within the standard errors{seen}")
        };
        Self {
            method: method.to_owned(),
            reason: reason.to_owned(),
            sensors,
            worst_sigma: finite(worst),
            rms_sigma: finite(rms),
            mean_sigma: finite(of_means),
            relative_error,
            agrees: !discrepancy.is_too_much(),
            verdict,
        }
    }
}
