//! Estimates of running jobs for readers in the same process, and prepared jobs that wait for a worker.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;
use uuid::Uuid;

use crate::estimate::Estimate;
use crate::present::prepared::Prepared;
use crate::present::reader::{Estimated, MadeFiles, made_files};

/// Largest number of prepared jobs that wait for the worker in memory, and their largest size in bytes together (estimated).
const MOST_WAITING: usize = 64;
const MOST_WAITING_BYTES: usize = 64 << 20;

/// Jobs that this process renders now, and those that it has prepared and will render.
#[derive(Default)]
pub struct LiveJobs {
    jobs: Mutex<HashMap<Uuid, Arc<LiveJob>>>,
    prepared: Mutex<HashMap<Uuid, Arc<Prepared>>>,
}

/// Job that is rendered now. Copies of its estimate, which can be large, are made only when a reader waits for one.
pub struct LiveJob {
    pub prepared: Arc<Prepared>,
    shown: Mutex<Shown>,
}

#[derive(Default)]
struct Shown {
    /// True once no further estimate comes.
    ended: bool,
    waiting: Vec<oneshot::Sender<Arc<LiveEstimate>>>,
    /// Estimate of all passes so far, if a reader waited for the last one.
    newest: Option<Arc<LiveEstimate>>,
}

/// Estimate of a running job after one of its passes, with the files that were made of it for readers.
pub struct LiveEstimate {
    prepared: Arc<Prepared>,
    pub estimate: Estimate,
    made: MadeFiles,
}

impl LiveJobs {
    pub fn start(&self, id: Uuid, prepared: Arc<Prepared>) -> Arc<LiveJob> {
        let live = Arc::new(LiveJob { prepared, shown: Mutex::default() });
        lock(&self.jobs).insert(id, live.clone());
        live
    }

    /// Takes the job off the list, unless it was started again since; readers that wait for it here get no estimate any more.
    pub fn end(&self, id: Uuid, live: &Arc<LiveJob>) {
        let mut jobs = lock(&self.jobs);
        if jobs.get(&id).is_some_and(|newest| Arc::ptr_eq(newest, live)) {
            jobs.remove(&id);
        }
        drop(jobs);
        *lock(&live.shown) = Shown { ended: true, ..Shown::default() };
    }

    pub fn get(&self, id: Uuid) -> Option<Arc<LiveJob>> {
        lock(&self.jobs).get(&id).cloned()
    }

    /// Keeps the prepared form of a job that is about to be queued, so that its worker need not prepare it again; does nothing when there
    /// is no room. The form must be taken or forgotten: jobs begin in any order, so that nothing else shows that it is not needed any more.
    pub fn hand_over(&self, id: Uuid, prepared: Arc<Prepared>) {
        let mut waiting = lock(&self.prepared);
        let bytes: usize = waiting.values().map(|prepared| prepared.bytes()).sum();
        if waiting.len() < MOST_WAITING && bytes + prepared.bytes() <= MOST_WAITING_BYTES {
            waiting.insert(id, prepared);
        }
    }

    /// Takes the form that was prepared when the job was posted, if it is still there.
    pub fn take_prepared(&self, id: Uuid) -> Option<Arc<Prepared>> {
        lock(&self.prepared).remove(&id)
    }

    /// Drops the prepared form of a job that will not begin: it was not queued, or was cancelled or deleted while it waited.
    pub fn forget(&self, id: Uuid) {
        lock(&self.prepared).remove(&id);
    }
}

impl LiveJob {
    /// Returns the estimate after the last pass, or, when there is no copy of that, waits for the one after the pass that runs now; `None`
    /// when the job ends before.
    pub async fn newest_estimate(&self) -> Option<Arc<LiveEstimate>> {
        let receiver = {
            let mut shown = lock(&self.shown);
            if let Some(newest) = &shown.newest {
                return Some(newest.clone());
            }
            if shown.ended {
                return None;
            }
            let (sender, receiver) = oneshot::channel();
            shown.waiting.retain(|waiting| !waiting.is_closed());
            shown.waiting.push(sender);
            receiver
        };
        receiver.await.ok()
    }

    /// Hands the estimate so far to all readers that wait for it, and drops the copy of the one before.
    pub fn publish(&self, so_far: &Estimate) {
        let waiting = {
            let mut shown = lock(&self.shown);
            shown.newest = None;
            std::mem::take(&mut shown.waiting)
        };
        if waiting.iter().all(oneshot::Sender::is_closed) {
            return;
        }
        let (prepared, made) = (self.prepared.clone(), made_files());
        let estimate = Arc::new(LiveEstimate { prepared, estimate: so_far.clone(), made });
        lock(&self.shown).newest = Some(estimate.clone());
        for sender in waiting {
            // an error means that the reader has gone away
            let _ = sender.send(estimate.clone());
        }
    }
}

impl LiveEstimate {
    /// Returns the results so far.
    pub fn results(&self) -> Estimated<'_> {
        Estimated { made: Some(&self.made), ..self.prepared.results(&self.estimate) }
    }
}

/// Locks a mutex, also after a panic of another thread: the data behind these locks is never left half changed.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::NoFiles;
    use crate::present::prepared::prepare;

    #[test]
    fn what_waits_is_bounded_and_begins_in_any_order() {
        let document = include_bytes!("../../examples/cornell_box.json");
        let prepared = Arc::new(prepare(document, &NoFiles).unwrap());
        assert!(prepared.bytes() < MOST_WAITING_BYTES / MOST_WAITING);
        let live = LiveJobs::default();
        let ids: Vec<Uuid> = (1..=MOST_WAITING as u128 + 1).map(Uuid::from_u128).collect();
        ids.iter().for_each(|id| live.hand_over(*id, prepared.clone()));
        assert!(live.take_prepared(ids[MOST_WAITING]).is_none(), "there was no room");
        for begun in [3, 60, 0] {
            assert!(live.take_prepared(ids[begun]).is_some_and(|taken| Arc::ptr_eq(&taken, &prepared)));
            assert!(live.take_prepared(ids[begun]).is_none(), "it is given once");
        }
        live.forget(ids[1]);
        assert!(live.take_prepared(ids[1]).is_none(), "it was forgotten");
        assert_eq!(lock(&live.prepared).len(), MOST_WAITING - 4, "all others wait");
    }
}
