//! What keeps a chunk from being committed.

use crate::job::artifacts::ArtifactError;
use crate::job::store::{JobProblem, StoreError};

/// Reason why a chunk was not committed.
pub(super) enum Interrupted {
    /// Somebody else has it, or the job is gone.
    LeaseLost,
    Shutdown,
    /// Other chunks go first; so many slices are counted.
    PutAside(u64),
    Store(StoreError),
    Artifact(ArtifactError),
    /// The stored state of the job is of no use, for this reason.
    Damaged(&'static str),
    /// The job cannot be rendered, now or ever.
    Hopeless(JobProblem),
    Panicked(String),
}

impl From<StoreError> for Interrupted {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl From<ArtifactError> for Interrupted {
    fn from(error: ArtifactError) -> Self {
        Self::Artifact(error)
    }
}

/// A job that cannot be rendered, for this reason.
pub(super) fn hopeless(title: &str, detail: String) -> Interrupted {
    Interrupted::Hopeless(JobProblem { title: title.to_owned(), detail })
}
