//! What keeps the validation report from being made.

use crate::page::ReportError;
use skyduct::output::OutputError;

/// Why the validation report cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ValidationError {
    #[error("{file}: {reason}")]
    Reference { file: String, reason: String },
    #[error(transparent)]
    Run(#[from] ReportError),
    #[error(transparent)]
    Plot(#[from] OutputError),
}
