//! Chunks of one job that are open at the same time: how many there may be, and what a chunk takes of those ahead of it.

use bytes::Bytes;

use super::lanes::SHARE_OF_MEMORY;
use crate::present::prepared::Prepared;

/// Limits on the jobs of a worker.
#[derive(Clone, Copy, Debug)]
pub struct WorkerLimits {
    /// Bytes that one job may take at its peak.
    pub memory_bytes: u64,
    /// Largest number of chunks of one job that are open at the same time, from 1; with 1 its passes are computed one after the other.
    pub open_chunks: usize,
}

/// Bound of the chunks of one job that are open at the same time.
#[derive(Clone, Copy)]
pub(super) struct OpenChunks {
    /// Number of ranges that may be open beside the chunk that folds them.
    beside: usize,
    /// Largest memory in bytes of a job with such ranges.
    most_memory: f64,
}

impl OpenChunks {
    pub fn new(limits: WorkerLimits) -> Self {
        let beside = limits.open_chunks.saturating_sub(1);
        Self { beside, most_memory: SHARE_OF_MEMORY * limits.memory_bytes as f64 / beside as f64 }
    }

    /// True if a job may have ranges beside its chunk.
    pub fn are_several(self) -> bool {
        self.beside > 0
    }

    /// Returns the number of ranges that a job may have beside its chunk.
    pub fn beside(self, prepared: &Prepared) -> usize {
        if prepared.memory().total() <= self.most_memory { self.beside } else { 0 }
    }
}

/// Outcomes and end of a chunk.
#[derive(Default)]
pub(super) struct AheadOfChunk {
    /// Stored outcomes of the first passes of the chunk.
    pub outcomes: Option<Bytes>,
    /// Number of passes before which the chunk ends.
    pub until: Option<u64>,
}
