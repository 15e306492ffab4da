//! What one client may ask for.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::http::problem::Problem;
use crate::job::cancel::CancelOnDrop;
use crate::job::memory::default_limit_bytes;

/// Limits of the service; `config/default.toml` has the defaults.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Longest job document, bytes.
    pub document_bytes: usize,
    /// Longest uploaded mesh, bytes.
    pub mesh_bytes: usize,
    /// Largest `stop.max_seconds` that a document may ask for.
    pub max_seconds: f64,
    /// Jobs that may wait; one more is answered 503.
    pub queued_jobs: u64,
    /// Connections at the same time; a few more are told that the service is busy, and then more wait to be accepted.
    pub connections: usize,
    /// Event streams at the same time; one more is answered 503.
    pub streams: usize,
    /// Documents that are checked at the same time, and files of running jobs that are made at the same time; more wait.
    pub preparing: usize,
    /// Meshes that are received and read at the same time; more wait.
    pub uploads: usize,
    /// Bytes that one job may take at its peak; a job that would take more is refused. Absent: three quarters of the memory
    /// that this process may have.
    pub memory_bytes: Option<u64>,
    /// Free space for artifacts below which the service is not ready.
    pub free_bytes: u64,
    /// Seconds within which a request's head must arrive.
    pub header_seconds: u64,
    /// Seconds within which a request must be answered (event streams must have begun).
    pub request_seconds: u64,
    /// Seconds within which a client must take some of its answer; one that does not is cut off.
    pub write_seconds: u64,
}

impl Limits {
    /// Bytes that one job may take at its peak.
    pub fn memory_limit_bytes(&self) -> u64 {
        self.memory_bytes.unwrap_or_else(default_limit_bytes)
    }
}

/// Permits for work that is done at the same time.
pub struct Permits {
    /// Documents that are prepared: each can hold meshes.
    pub preparing: Arc<Semaphore>,
    /// Pilots, each of which takes all threads for a moment.
    pub pilots: Arc<Semaphore>,
    /// Files of running jobs that are made: each can hold a large estimate.
    pub reading: Arc<Semaphore>,
    /// Meshes that are received and read.
    pub uploads: Arc<Semaphore>,
    /// Permits for open event streams.
    pub streams: Arc<Semaphore>,
}

impl Permits {
    pub fn new(limits: &Limits) -> Self {
        let permits = |count: usize| Arc::new(Semaphore::new(count));
        Self {
            preparing: permits(limits.preparing),
            pilots: permits(1),
            reading: permits(limits.preparing),
            uploads: permits(limits.uploads),
            streams: permits(limits.streams),
        }
    }
}

/// A permit of `permits`, when one is free.
pub async fn permit(permits: &Arc<Semaphore>) -> Result<OwnedSemaphorePermit, Problem> {
    // the semaphores are never closed
    permits.clone().acquire_owned().await.map_err(|_| Problem::internal())
}

/// Runs `work` off the async threads.
///
/// The work owns the permit: however the request ends, the permit is free only when the work has ended. When the request
/// ends first, the flag that the work is given becomes true.
pub async fn off_thread<T: Send + 'static>(
    permit: OwnedSemaphorePermit,
    work: impl FnOnce(Arc<AtomicBool>) -> T + Send + 'static,
) -> Result<T, Problem> {
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let done = tokio::task::spawn_blocking(move || {
        let _permit = permit;
        work(flag)
    });
    done.await.map_err(|error| {
        tracing::error!(%error, "work for a request panicked");
        Problem::internal()
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    use super::*;

    /// Requests come and go; their work ends when it sees the flag, and never more of it runs than is allowed.
    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn requests_that_are_dropped_leave_no_more_work_than_is_allowed() {
        const ALLOWED: usize = 2;
        let permits = Arc::new(Semaphore::new(ALLOWED));
        let [running, most, begun] = [(); 3].map(|()| Arc::new(AtomicUsize::new(0)));
        for _ in 0..16 {
            let (running, most, begun) = (running.clone(), most.clone(), begun.clone());
            let request = async {
                let permit = permit(&permits).await?;
                off_thread(permit, move |cancelled| {
                    begun.fetch_add(1, Ordering::SeqCst);
                    most.fetch_max(running.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    while !cancelled.load(Ordering::Relaxed) {
                        std::thread::sleep(Duration::from_millis(1));
                    }
                    // it does not look at the flag all the time
                    std::thread::sleep(Duration::from_millis(5));
                    running.fetch_sub(1, Ordering::SeqCst);
                })
                .await
            };
            // the client hangs up
            let _ = tokio::time::timeout(Duration::from_millis(3), request).await;
        }
        // all permits come back, so all work has ended
        let all = tokio::time::timeout(Duration::from_secs(60), permits.acquire_many(ALLOWED as u32)).await;
        drop(all.expect("work goes on for ever").unwrap());
        assert_eq!(running.load(Ordering::SeqCst), 0);
        assert!(begun.load(Ordering::SeqCst) >= ALLOWED);
        assert!(most.load(Ordering::SeqCst) <= ALLOWED);
    }
}
