//! Two lanes: one renders all jobs, and a second one renders waiting jobs while the first is in a long pass.
//!
//! A pass counts whole or not at all, and may take hours. The main lane renders every pass to its end, so that each job gets further. When
//! its chunk takes longer than three quarters of a second, the short lane begins on the others. There a chunk has a slice of some seconds:
//! one that needs more is put aside, and its unfinished pass is dropped, for a pass is a function of its number and can be rendered again.
//! The job's next slice there is longer, comes behind all jobs with fewer slices, and ends when another job is posted; after the last slice
//! only the main lane renders the job.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{Notify, watch};
use tokio::time::{Instant, sleep_until};
use tokio_util::sync::CancellationToken;

use crate::queue::store::MOST_SLICES;

/// Time that a chunk of the main lane takes before the short lane begins: a small job then waits less than a second.
const LONG: Duration = Duration::from_millis(750);
/// First slice of a job in the short lane: a few times the intended time of a chunk.
const SLICE: Duration = Duration::from_secs(8);
/// Ratio of a slice to the one before it: together they are hardly longer than the last one.
const GROWTH: u32 = 4;
/// Fraction of the memory limit of a job that a job in the short lane may take, beside that of the main lane, and that all passes ahead
/// may take.
pub(super) const SHARE_OF_MEMORY: f64 = 0.125;

/// Lane of a worker.
pub(super) enum Lane {
    Main(Main),
    Short(Short),
}

/// Main lane, which announces when it renders.
pub(super) struct Main {
    /// Time at which it began to render its chunk; `None` where it has none.
    since: watch::Sender<Option<Instant>>,
    left: Arc<Notify>,
}

/// Short lane, which follows the announcements of the main lane.
pub(super) struct Short {
    since: watch::Receiver<Option<Instant>>,
    left: Arc<Notify>,
    /// Largest memory of a job in this lane, in bytes.
    most_memory: f64,
}

/// Returns the main lane and the short lane, where one job may take `memory_bytes`.
pub(super) fn lanes(memory_bytes: u64) -> (Lane, Lane) {
    let (sender, since) = watch::channel(None);
    let left = Arc::new(Notify::new());
    let most_memory = SHARE_OF_MEMORY * memory_bytes as f64;
    (Lane::Main(Main { since: sender, left: left.clone() }), Lane::Short(Short { since, left, most_memory }))
}

impl Lane {
    pub fn is_short(&self) -> bool {
        matches!(self, Self::Short(_))
    }

    /// Announces that a chunk is rendered from now on.
    pub fn renders(&self) {
        if let Self::Main(main) = self {
            main.since.send_replace(Some(Instant::now()));
        }
    }

    /// Announces that no chunk is rendered any more. The short lane wakes the main lane then, which may sleep beside a chunk that was put
    /// aside, or that waited for the end of its job.
    pub fn has_rendered(&self) {
        match self {
            Self::Main(main) => {
                main.since.send_replace(None);
            }
            Self::Short(short) => short.left.notify_one(),
        }
    }

    /// Returns when there may be a chunk to claim that no hint of the store announces.
    pub async fn stirs(&mut self) {
        match self {
            Self::Main(main) => main.left.notified().await,
            // where the main lane is gone, so is the reason to wake
            Self::Short(short) => {
                if short.since.changed().await.is_err() {
                    std::future::pending().await
                }
            }
        }
    }

    /// True if this lane may claim a chunk now.
    pub fn may_claim(&self) -> bool {
        match self {
            Self::Main(_) => true,
            Self::Short(short) => short.since.borrow().is_some_and(|since| since.elapsed() >= LONG),
        }
    }

    /// Returns when this lane may claim a chunk, or the service shuts down.
    pub async fn until_it_may_claim(&mut self, shutdown: &CancellationToken) {
        let Self::Short(short) = self else { return };
        while !shutdown.is_cancelled() {
            let since = *short.since.borrow_and_update();
            let long = since.map(|since| since + LONG);
            if long.is_some_and(|long| long <= Instant::now()) {
                return;
            }
            tokio::select! {
                () = shutdown.cancelled() => {}
                () = sleep_until(long.unwrap_or_else(Instant::now)), if long.is_some() => {}
                changed = short.since.changed() => if changed.is_err() {
                    shutdown.cancelled().await;
                },
            }
        }
    }

    /// Returns the time after which a chunk is put aside, of a job that has had this number of slices; `None` where it is rendered to its
    /// end.
    pub fn slice(&self, slices: u64) -> Option<Duration> {
        self.is_short().then(|| SLICE * GROWTH.pow(slices.min(MOST_SLICES) as u32))
    }

    /// Returns the largest memory of a job in this lane, in bytes.
    pub fn most_memory(&self) -> f64 {
        match self {
            Self::Main(_) => f64::INFINITY,
            Self::Short(short) => short.most_memory,
        }
    }
}
