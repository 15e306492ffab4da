//! What one client may ask for.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use tokio::sync::Semaphore;

use crate::http::places::Places;
use crate::http::problem::Problem;
use crate::http::turns::{Line, Turn};
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
    /// Bytes of posted documents that are held at the same time, from before they are read until they are checked; one more
    /// document is refused.
    pub body_bytes: usize,
    /// Bytes of these that are one client's.
    pub body_bytes_per_client: usize,
    /// Documents of each kind (jobs, plans, studies, fluxes) that are checked and computed at the same time, and files that are made at
    /// the same time; more wait, and clients take turns.
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
    /// Seconds within which fluxes of a tube must be answered; what is foreseen to take longer is refused.
    pub flux_seconds: u64,
    /// Seconds within which a client must take some of its answer; one that does not is cut off.
    pub write_seconds: u64,
}

impl Limits {
    /// Bytes that one job may take at its peak.
    pub fn memory_limit_bytes(&self) -> u64 {
        self.memory_bytes.unwrap_or_else(default_limit_bytes)
    }
}

/// Work that is done for requests at the same time, each kind in a line of its own: a job's post waits behind no other kind.
pub struct Permits {
    /// Bytes of posted documents.
    pub bodies: Arc<Places>,
    /// Posts of jobs: each can hold meshes.
    pub jobs: Arc<Line>,
    /// Plans without a job.
    pub plans: Arc<Line>,
    /// Posts of studies.
    pub studies: Arc<Line>,
    /// Fluxes of tubes.
    pub fluxes: Arc<Line>,
    /// Transmissions in closed form.
    pub transmissions: Arc<Line>,
    /// Pilots for posts of jobs, each of which takes all threads for a moment.
    pub pilots_of_jobs: Arc<Line>,
    /// Pilots for plans.
    pub pilots_of_plans: Arc<Line>,
    /// Files of jobs and studies that are made: each can hold a large estimate.
    pub reading: Arc<Line>,
    /// Meshes that are received and read.
    pub uploads: Arc<Semaphore>,
    /// Permits for open event streams.
    pub streams: Arc<Semaphore>,
}

impl Permits {
    pub fn new(limits: &Limits) -> Self {
        let permits = |count: usize| Arc::new(Semaphore::new(count));
        let line = || Line::new(limits.preparing);
        Self {
            bodies: Places::new(
                "body_bytes",
                "bytes of posted documents",
                limits.body_bytes,
                limits.body_bytes_per_client,
            ),
            jobs: line(),
            plans: line(),
            studies: line(),
            fluxes: line(),
            transmissions: line(),
            pilots_of_jobs: Line::new(1),
            pilots_of_plans: Line::new(1),
            reading: line(),
            uploads: permits(limits.uploads),
            streams: permits(limits.streams),
        }
    }
}

/// A turn at the work of a line, when it comes to it.
pub async fn permit(line: &Arc<Line>) -> Result<Turn, Problem> {
    line.turn().await
}

/// Runs `work` off the async threads.
///
/// The work owns the turn: however the request ends, the turn ends only when the work has ended. When the request
/// ends first, the flag that the work is given becomes true.
pub async fn off_thread<T: Send + 'static>(
    turn: Turn,
    work: impl FnOnce(Arc<AtomicBool>) -> T + Send + 'static,
) -> Result<T, Problem> {
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let done = tokio::task::spawn_blocking(move || {
        let _turn = turn;
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
        let line = Line::new(ALLOWED);
        let [running, most, begun] = [(); 3].map(|()| Arc::new(AtomicUsize::new(0)));
        for _ in 0..16 {
            let (running, most, begun) = (running.clone(), most.clone(), begun.clone());
            let request = async {
                off_thread(permit(&line).await?, move |cancelled| {
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
        // all turns end, so all work has ended
        let all = futures::future::join_all((0..ALLOWED).map(|_| permit(&line)));
        let all = tokio::time::timeout(Duration::from_secs(60), all).await.expect("work goes on for ever");
        assert!(all.iter().all(Result::is_ok));
        assert_eq!(running.load(Ordering::SeqCst), 0);
        assert!(begun.load(Ordering::SeqCst) >= ALLOWED);
        assert!(most.load(Ordering::SeqCst) <= ALLOWED);
    }
}
