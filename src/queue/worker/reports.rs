//! Reports of a running chunk, gathered for one transaction.

use std::time::Duration;

use tokio::time::Instant;

use crate::queue::store::Report;

/// Time within which the passes of a chunk are reported together.
pub(super) const REPORT_DELAY: Duration = Duration::from_millis(100);

/// Reports that wait to be written together.
#[derive(Default)]
pub(super) struct Reports {
    pub waiting: Vec<Report>,
    /// Files that were written but may not be on the disk yet: the chunk's commit waits for them.
    pub files: Vec<String>,
    not_before: Option<Instant>,
}

impl Reports {
    pub fn push(&mut self, report: Report) {
        self.waiting.push(report);
    }

    /// True if there is something to write, and no reason to wait any longer.
    pub fn are_due(&self) -> bool {
        !self.waiting.is_empty() && self.not_before.is_none_or(|time| Instant::now() >= time)
    }

    pub fn clear(&mut self) {
        self.waiting.clear();
        self.not_before = None;
    }

    pub fn postpone(&mut self, by: Duration) {
        self.not_before = Some(Instant::now() + by);
    }
}
