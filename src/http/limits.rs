//! Limits on requests, in all and for each client.

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::engine::cancel::CancelOnDrop;
use crate::engine::memory::default_limit_bytes;
use crate::http::places::Places;
use crate::http::problem::Problem;
use crate::http::turns::{Line, Turn};
use crate::queue::store::MostWaiting;

/// Range of [`Limits::max_seconds`]; NaN is outside of it.
const MAX_SECONDS: RangeInclusive<f64> = 1e-3..=1e9;

const COUNT: RangeInclusive<u64> = 1..=1_000_000;
const COUNT_OR_NONE: RangeInclusive<u64> = 0..=1_000_000;
const BYTES: RangeInclusive<u64> = 1024..=1 << 40;
const SECONDS: RangeInclusive<u64> = 1..=24 * 60 * 60;

/// Ranges of all other limits.
const RANGES: [(&str, RangeInclusive<u64>); 27] = [
    ("document_bytes", BYTES),
    ("mesh_bytes", BYTES),
    ("queued_jobs", COUNT),
    ("queued_jobs_per_client", COUNT),
    ("connections", COUNT),
    ("connections_per_client", COUNT),
    ("streams", COUNT),
    ("streams_per_client", COUNT),
    ("waits", COUNT_OR_NONE),
    ("waits_per_client", COUNT_OR_NONE),
    ("body_bytes", BYTES),
    ("body_bytes_per_client", BYTES),
    ("preparing", 1..=1000),
    ("uploads", COUNT),
    ("uploads_per_client", COUNT),
    ("upload_bytes", BYTES),
    ("upload_bytes_per_client", BYTES),
    ("upload_bytes_per_second", 1..=1 << 40),
    ("upload_grace_seconds", SECONDS),
    ("mesh_readers", 1..=1000),
    ("memory_bytes", 1 << 20..=1 << 50),
    ("open_chunks_per_job", 1..=16),
    ("free_bytes", 0..=1 << 50),
    ("header_seconds", SECONDS),
    ("request_seconds", SECONDS),
    ("flux_seconds", SECONDS),
    ("write_seconds", SECONDS),
];

/// Limits of the service; `config/default.toml` has the defaults.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Largest size of a job document in bytes.
    pub document_bytes: usize,
    /// Largest size of an uploaded mesh in bytes.
    pub mesh_bytes: usize,
    /// Largest `stop.max_seconds` that a document may ask for.
    pub max_seconds: f64,
    /// Largest number of jobs that wait; one more is answered 503.
    pub queued_jobs: u64,
    /// Largest number of jobs of one client that wait; one more is answered 429.
    pub queued_jobs_per_client: u64,
    /// Largest number of open connections; a few more are answered that the service is busy, and all others wait to be accepted.
    pub connections: usize,
    /// Largest number of open connections of one client; more are answered 429, or closed.
    pub connections_per_client: usize,
    /// Largest number of open event streams; one more is answered 503.
    pub streams: usize,
    /// Largest number of open event streams of one client; one more is answered 429.
    pub streams_per_client: usize,
    /// Largest number of posts that wait for the end of their jobs at the same time; others are answered without a wait.
    pub waits: usize,
    /// Largest number of posts of one client that wait for the end of their jobs at the same time.
    pub waits_per_client: usize,
    /// Largest number of bytes of posted documents that are held at the same time, from before they are read until they are
    /// checked; a further document is refused.
    pub body_bytes: usize,
    /// Largest number of bytes of one client's posted documents that are held at the same time.
    pub body_bytes_per_client: usize,
    /// Largest number of documents of each kind (jobs, plans, sets of jobs, fluxes) that are checked and computed at the same time, and
    /// of files that are made at the same time; more wait, and clients take turns.
    pub preparing: usize,
    /// Largest number of files that are received, or wait to be read, at the same time; one more is answered 503.
    pub uploads: usize,
    /// Largest number of files of one client that are received, or wait to be read; one more is answered 429.
    pub uploads_per_client: usize,
    /// Largest number of bytes of received files in memory; at least [`Self::mesh_bytes`].
    pub upload_bytes: usize,
    /// Largest number of bytes of one client's received files in memory; at least [`Self::mesh_bytes`].
    pub upload_bytes_per_client: usize,
    /// Least average rate of an upload in bytes per second, after [`Self::upload_grace_seconds`]; slower ones are answered 408.
    pub upload_bytes_per_second: u64,
    /// Seconds that an upload may be behind [`Self::upload_bytes_per_second`].
    pub upload_grace_seconds: u64,
    /// Largest number of uploaded files that are read at the same time; more wait, and clients take turns.
    pub mesh_readers: usize,
    /// Largest number of bytes that one job may take at its peak; a job that would take more is refused. Absent: three quarters of
    /// the memory that this process may have.
    pub memory_bytes: Option<u64>,
    /// Largest number of chunks of one job that are open at the same time: one whose passes are added to the job, and others whose passes
    /// are computed ahead.
    pub open_chunks_per_job: usize,
    /// Least free space for artifacts in bytes; with less, the service is not ready.
    pub free_bytes: u64,
    /// Seconds within which a request's head must arrive.
    pub header_seconds: u64,
    /// Seconds within which a request must be answered (event streams must have begun).
    pub request_seconds: u64,
    /// Seconds within which fluxes of a tube must be answered; a request that is predicted to take longer is refused.
    pub flux_seconds: u64,
    /// Seconds within which a client must accept some of its answer; a slower client is disconnected.
    pub write_seconds: u64,
}

impl Limits {
    /// Checks all limits; the error names one that is out of range, and its range.
    pub fn check(&self) -> Result<(), String> {
        // a field without a range is refused with every value
        let fields = serde_json::to_value(self).unwrap_or_default();
        for (name, value) in fields.as_object().into_iter().flatten().filter(|(name, _)| *name != "max_seconds") {
            let range = RANGES.iter().find(|(known, _)| known == name).map_or(&(0..=0), |(_, range)| range);
            if let Some(value) = value.as_u64().filter(|value| !range.contains(value)) {
                return Err(format!("{name}: must be {} to {}, but is {value}", range.start(), range.end()));
            }
        }
        let &Self { document_bytes, mesh_bytes, max_seconds, body_bytes, body_bytes_per_client, .. } = self;
        let &Self { upload_bytes, upload_bytes_per_client, .. } = self;
        if !MAX_SECONDS.contains(&max_seconds) {
            return Err(format!(
                "max_seconds: must be {} to {}, but is {max_seconds}",
                MAX_SECONDS.start(),
                MAX_SECONDS.end()
            ));
        }
        // else the longest one that is allowed would never be let in
        let at_least = [
            ("body_bytes", body_bytes, "document_bytes", document_bytes),
            ("body_bytes_per_client", body_bytes_per_client, "document_bytes", document_bytes),
            ("upload_bytes", upload_bytes, "mesh_bytes", mesh_bytes),
            ("upload_bytes_per_client", upload_bytes_per_client, "mesh_bytes", mesh_bytes),
        ];
        for (name, value, of, least) in at_least {
            if value < least {
                return Err(format!("{name}: must be at least {of} ({least}), but is {value}"));
            }
        }
        Ok(())
    }

    /// Returns the largest number of jobs that may wait, in all and for each client.
    pub fn most_waiting(&self) -> MostWaiting {
        MostWaiting { jobs: self.queued_jobs, of_client: self.queued_jobs_per_client }
    }

    /// Returns the largest number of bytes that one job may take at its peak.
    pub fn memory_limit_bytes(&self) -> u64 {
        self.memory_bytes.unwrap_or_else(default_limit_bytes)
    }
}

/// Limits on the work that is done for requests at the same time. Each kind of work has a line of its own: a posted job does not
/// wait behind another kind.
pub struct Permits {
    /// Bytes of posted documents.
    pub bodies: Arc<Places>,
    /// Posts of jobs: each can hold meshes.
    pub jobs: Arc<Line>,
    /// Plans without a job.
    pub plans: Arc<Line>,
    /// Posts of sets of jobs, studies included.
    pub sets: Arc<Line>,
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
    /// Uploaded files that are read.
    pub mesh_readers: Arc<Line>,
    /// Files that are received, or wait to be read.
    pub uploads: Arc<Places>,
    /// Bytes of files that are received, or wait to be read.
    pub upload_bytes: Arc<Places>,
    /// Open event streams.
    pub streams: Arc<Places>,
    /// Posts that wait for the end of their jobs.
    pub waits: Arc<Places>,
}

impl Permits {
    pub fn new(limits: &Limits) -> Self {
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
            sets: line(),
            fluxes: line(),
            transmissions: line(),
            pilots_of_jobs: Line::new(1),
            pilots_of_plans: Line::new(1),
            reading: line(),
            mesh_readers: Line::new(limits.mesh_readers),
            uploads: Places::new("uploads", "uploads", limits.uploads, limits.uploads_per_client),
            upload_bytes: Places::new(
                "upload_bytes",
                "bytes of uploads",
                limits.upload_bytes,
                limits.upload_bytes_per_client,
            ),
            streams: Places::new("streams", "event streams", limits.streams, limits.streams_per_client),
            waits: Places::new("waits", "posts that wait for their job", limits.waits, limits.waits_per_client),
        }
    }
}

/// Waits for a turn in a line.
pub async fn permit(line: &Arc<Line>) -> Result<Turn, Problem> {
    line.turn().await
}

/// Runs `work` off the async threads.
///
/// The work owns the turn: however the request ends, the turn ends only when the work has ended. When the request ends first, the
/// flag passed to `work` becomes true.
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
    done.await.map_err(|error| Problem::failed("work for a request panicked", &error))
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
