//! Cache of jobs that were rendered lately, so that a job whose turn comes again need not be loaded.

use std::collections::VecDeque;
use std::sync::Arc;

use uuid::Uuid;

use crate::engine::spent::Spent;
use crate::estimate::Estimate;
use crate::predict::forecast::Forecaster;
use crate::present::prepared::Prepared;
use crate::queue::live::LiveJob;

/// Largest number of jobs that are kept.
const MOST_JOBS: usize = 4;
/// Largest number of bytes of estimates and prepared jobs that are kept; the job that was rendered last is always kept.
const MOST_BYTES: u64 = 256 << 20;

/// Job with everything that was computed before its next chunk.
pub(super) struct Current {
    pub job: Uuid,
    pub prepared: Arc<Prepared>,
    pub live: Arc<LiveJob>,
    /// Estimate of all passes so far.
    pub merged: Estimate,
    /// Size of `merged` in bytes.
    pub bytes: u64,
    /// Render time of the passes in `merged`.
    pub spent: Spent,
    pub next_chunk: u64,
    /// True until a chunk of it was committed since it was loaded.
    pub is_loaded: bool,
    /// Forecaster of the job's end, which has taken the passes that were reported.
    pub forecaster: Forecaster,
}

/// Jobs that were rendered last, newest first.
#[derive(Default)]
pub(super) struct KeptJobs {
    jobs: VecDeque<Current>,
}

impl KeptJobs {
    /// Takes the job out; `None` when it is not there, or when its next chunk is not this one.
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
        self.jobs.iter().map(|kept| kept.bytes + kept.prepared.bytes() as u64).sum()
    }
}
