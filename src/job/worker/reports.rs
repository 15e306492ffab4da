//! What a running chunk tells, gathered for one transaction.

use std::time::Duration;

use tokio::time::Instant;

use crate::job::store::Report;

/// Passes are reported together, at most this late.
const REPORT_DELAY: Duration = Duration::from_millis(100);

/// Reports that wait to be written together.
#[derive(Default)]
pub(super) struct Reports {
    pub waiting: Vec<Report>,
    /// Files that were written but may not be on the disk yet: the chunk's commit waits for them.
    pub files: Vec<String>,
    due: Option<Instant>,
}

impl Reports {
    pub fn push(&mut self, report: Report) {
        self.waiting.push(report);
        self.due.get_or_insert_with(|| Instant::now() + REPORT_DELAY);
    }

    pub fn is_waiting(&self) -> bool {
        self.due.is_some()
    }

    pub fn due(&self) -> Instant {
        self.due.unwrap_or_else(Instant::now)
    }

    pub fn clear(&mut self) {
        self.waiting.clear();
        self.due = None;
    }

    pub fn postpone(&mut self, by: Duration) {
        self.due = Some(Instant::now() + by);
    }
}
