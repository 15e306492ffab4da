//! Jobs that were rendered lately, so that a job whose turn comes again need not be loaded.

use std::collections::VecDeque;
use std::sync::Arc;

use uuid::Uuid;

use crate::estimate::Estimate;
use crate::job::forecast::Forecaster;
use crate::job::live::LiveJob;
use crate::job::prepare::Prepared;
use crate::job::spent::Spent;

/// Largest number of jobs that are kept.
const MOST_JOBS: usize = 4;
/// Largest number of bytes of estimates that are kept, not counting the job that was rendered last.
const MOST_BYTES: u64 = 256 << 20;

/// A job with everything that was computed before its next chunk.
pub(super) struct Current {
    pub job: Uuid,
    pub prepared: Arc<Prepared>,
    pub live: Arc<LiveJob>,
    /// Everything up to the last pass.
    pub merged: Estimate,
    /// Size of `merged` in bytes.
    pub bytes: u64,
    /// Render time of `merged`.
    pub spent: Spent,
    pub next_chunk: u64,
    /// What foretells the job's end; it has heard the passes that were told.
    pub forecaster: Forecaster,
}

/// The jobs that were rendered last, newest first.
#[derive(Default)]
pub(super) struct KeptJobs {
    jobs: VecDeque<Current>,
}

impl KeptJobs {
    /// Takes the job out; nothing when it is not there, or not where this chunk begins.
    pub fn take(&mut self, job: Uuid, chunk: u64) -> Option<Current> {
        let place = self.jobs.iter().position(|kept| kept.job == job)?;
        self.jobs.remove(place).filter(|kept| kept.next_chunk == chunk)
    }

    pub fn keep(&mut self, current: Current) {
        self.jobs.push_front(current);
        while self.jobs.len() > 1 && (self.jobs.len() > MOST_JOBS || self.bytes() > MOST_BYTES) {
            self.jobs.pop_back();
        }
    }

    pub fn clear(&mut self) {
        self.jobs.clear();
    }

    fn bytes(&self) -> u64 {
        self.jobs.iter().map(|kept| kept.bytes).sum()
    }
}
