//! Reasons why a chunk is not committed.

use crate::queue::files::FileError;
use crate::queue::store::{JobProblem, StoreError};

/// Reason why a chunk was not committed.
#[derive(Debug)]
pub(super) enum Interrupted {
    /// Another worker has the chunk, or the job is gone.
    LeaseLost,
    Shutdown,
    /// Other chunks go first; this number of slices is counted.
    PutAside(u64),
    Store(StoreError),
    Artifact(FileError),
    /// Stored state of the job that is of no use, for this reason.
    Damaged(&'static str),
    /// Job that cannot be rendered, now or ever.
    Hopeless(JobProblem),
    Panicked(String),
}

impl From<StoreError> for Interrupted {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl From<FileError> for Interrupted {
    fn from(error: FileError) -> Self {
        Self::Artifact(error)
    }
}

/// Returns the reason for a job that can never be rendered, with the words of its problem.
pub(super) fn hopeless(title: &str, detail: String) -> Interrupted {
    Interrupted::Hopeless(JobProblem { title: title.to_owned(), detail })
}
