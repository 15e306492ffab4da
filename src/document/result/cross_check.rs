//! Comparison of a job's grids with those of a second, independent method.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::finite;
use crate::estimate::Discrepancy;

/// Comparison of the grids with those of a second, independent method.
///
/// Discrepancies are in standard errors of the difference, with an allowance for few passes: 2 may be chance, 5 is not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CrossCheckResult {
    /// Name of the second method.
    pub method: String,
    /// Reason why this method was chosen, as a sentence.
    pub reason: String,
    /// Number of sensors that were compared.
    pub sensors: usize,
    /// Largest discrepancy of a sensor. Where both methods are right, the largest of 81 is about 2.5. Null where values without
    /// errors differ.
    pub worst_sigma: Option<f64>,
    /// Root mean square of the discrepancies, about 1 where both methods are right; null where values without errors differ.
    pub rms_sigma: Option<f64>,
    /// Largest discrepancy of a grid's mean.
    pub mean_sigma: Option<f64>,
    /// Relative standard error of the second method's values, RMS over the sensors as in `accuracy`; smaller discrepancies are
    /// not detected.
    pub relative_error: Option<f64>,
    /// False if the discrepancies are larger than chance explains for this number of sensors, so that one of the two methods is
    /// wrong.
    pub agrees: bool,
    /// Conclusion, as a sentence.
    pub verdict: String,
}

impl CrossCheckResult {
    /// Returns the result of a comparison with `method`, whose grids have `relative_error`.
    pub fn new(method: &str, reason: &str, discrepancy: &Discrepancy, relative_error: Option<f64>) -> Self {
        let Discrepancy { sensors, worst, rms, of_means } = *discrepancy;
        let seen = relative_error
            .map_or(String::new(), |error| format!(", at a relative standard error of {:.2} %", 100.0 * error));
        let verdict = if discrepancy.is_too_much() {
            format!(
                "{method} differs by more than the standard errors allow{seen}: one of the two methods is wrong here"
            )
        } else {
            format!("{method} agrees within the standard errors{seen}")
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
