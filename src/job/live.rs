//! What running jobs have computed so far, for readers in the same process.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;
use uuid::Uuid;

use crate::estimate::Estimate;
use crate::job::run::Prepared;

/// The jobs that this process renders now.
#[derive(Default)]
pub struct LiveJobs {
    jobs: Mutex<HashMap<Uuid, Arc<LiveJob>>>,
}

/// A job that is rendered now. Copies of its estimate are made only when somebody waits for one: they can be large.
pub struct LiveJob {
    pub prepared: Arc<Prepared>,
    /// `None` once nothing comes any more.
    waiting: Mutex<Option<Vec<oneshot::Sender<Arc<Estimate>>>>>,
}

impl LiveJobs {
    pub fn start(&self, id: Uuid, prepared: Arc<Prepared>) -> Arc<LiveJob> {
        let live = Arc::new(LiveJob { prepared, waiting: Mutex::new(Some(Vec::new())) });
        lock(&self.jobs).insert(id, live.clone());
        live
    }

    /// Takes the job off the list; who waits for it is told that nothing comes any more.
    pub fn end(&self, id: Uuid) {
        if let Some(live) = lock(&self.jobs).remove(&id) {
            *lock(&live.waiting) = None;
        }
    }

    pub fn get(&self, id: Uuid) -> Option<Arc<LiveJob>> {
        lock(&self.jobs).get(&id).cloned()
    }
}

impl LiveJob {
    /// The estimate after the pass that runs now; `None` when the job ends before.
    pub async fn next_estimate(&self) -> Option<Arc<Estimate>> {
        let (sender, receiver) = oneshot::channel();
        lock(&self.waiting).as_mut()?.push(sender);
        receiver.await.ok()
    }

    /// Hands `merged` to everybody who waits for it.
    pub fn publish(&self, merged: &Estimate) {
        let waiting = lock(&self.waiting).as_mut().map(std::mem::take).unwrap_or_default();
        if waiting.iter().all(oneshot::Sender::is_closed) {
            return;
        }
        let copy = Arc::new(merged.clone());
        for sender in waiting {
            // an error means that the reader has gone away
            let _ = sender.send(copy.clone());
        }
    }
}

/// The data behind these locks is never left half changed, so that a panic elsewhere does not matter.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
