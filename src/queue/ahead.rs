//! Ranges of passes that are computed ahead of their job's chunk: the types by which they are leased and kept.
//!
//! A job has one chunk, which alone writes its state. When it ends, it opens the next ranges; other workers claim these and keep the
//! outcomes of their passes. The chunk takes the outcomes in order, and computes what is not there: no failure of others can stop it.

use uuid::Uuid;

use super::records::StateFile;
use crate::engine::ahead::RangeAhead;

/// Claimed range of passes. `owner` fences it, who has one range at a time: once the lease is lost, nothing can be written with it.
#[derive(Clone, Debug, PartialEq)]
pub struct AheadLease {
    /// Job that the passes belong to.
    pub job: Uuid,
    /// Passes to be computed.
    pub range: RangeAhead,
    /// Name of the worker that has it.
    pub owner: String,
}

/// Ranges ahead of a claimed chunk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ahead {
    /// Outcomes of the chunk's next passes, if they were computed.
    pub outcomes: Option<StateFile>,
    /// First pass of the next range after that: the chunk ends before it.
    pub until: Option<u64>,
}

/// Place to which a range is given back undone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GivenBack {
    /// Another worker may claim it.
    ToWorkers,
    /// Its job's chunk computes it, with the count of failures that chunks have.
    ToChunk,
}
