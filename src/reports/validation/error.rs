//! Errors of the validation report.

use crate::page::ReportError;
use skyduct::output::OutputError;

/// Error that prevents the validation report.
#[derive(Debug, thiserror::Error)]
pub enum ValidationError {
    #[error("{file}: {reason}")]
    Reference { file: String, reason: String },
    #[error(transparent)]
    Run(#[from] ReportError),
    #[error(transparent)]
    Plot(#[from] OutputError),
}
