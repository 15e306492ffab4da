//! Two lanes: one renders all jobs, and a second one what waits while the first is in a pass that takes long.
//!
//! A pass is whole or nothing, and may take hours. The main lane renders every pass to its end, so that each job gets further. When its
//! chunk takes longer than three quarters of a second, the short lane begins on the others. There a chunk has a slice of some seconds:
//! one that needs more is put aside, and what it has computed of its pass is dropped, for a pass is a function of its number and can be
//! rendered again. Its next slice there is longer, comes behind all jobs with fewer, and ends when another job is posted; after the last
//! slice the job is the main lane's alone.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{Notify, watch};
use tokio::time::{Instant, sleep_until};
use tokio_util::sync::CancellationToken;

use crate::job::memory::default_limit_bytes;
use crate::job::store::MOST_SLICES;

/// Time that a chunk of the main lane takes before the short lane begins: who has posted a small job then waits less than a second.
const LONG: Duration = Duration::from_millis(750);
/// First slice of a job in the short lane: a few times what a chunk is meant to take.
const SLICE: Duration = Duration::from_secs(8);
/// Growth of slices: together they are hardly longer than the last one.
const GROWTH: u32 = 4;
/// Share of the memory of a job that one in the short lane may take, beside that of the main lane.
const SHARE_OF_MEMORY: f64 = 0.125;

/// The lane of a worker.
pub(super) enum Lane {
    Main(Main),
    Short(Short),
}

/// The main lane tells what it does.
pub(super) struct Main {
    /// Since when it has rendered its chunk; `None` where it has none.
    since: watch::Sender<Option<Instant>>,
    left: Arc<Notify>,
}

/// The short lane hears of it.
pub(super) struct Short {
    since: watch::Receiver<Option<Instant>>,
    left: Arc<Notify>,
}

pub(super) fn lanes() -> (Lane, Lane) {
    let (sender, since) = watch::channel(None);
    let left = Arc::new(Notify::new());
    (Lane::Main(Main { since: sender, left: left.clone() }), Lane::Short(Short { since, left }))
}

impl Lane {
    pub fn is_short(&self) -> bool {
        matches!(self, Self::Short(_))
    }

    /// Says that a chunk is rendered from now on.
    pub fn renders(&self) {
        if let Self::Main(main) = self {
            main.since.send_replace(Some(Instant::now()));
        }
    }

    /// Says that it is no more. What the short lane leaves, or what has waited for the end of its job, is the main lane's, lest it sleeps.
    pub fn has_rendered(&self) {
        match self {
            Self::Main(main) => {
                main.since.send_replace(None);
            }
            Self::Short(short) => short.left.notify_one(),
        }
    }

    /// Returns when there may be something to claim of which no hint of the store tells.
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

    /// Time after which a chunk is put aside of a job that has had so many slices; `None` where it is rendered to its end.
    pub fn slice(&self, slices: u64) -> Option<Duration> {
        self.is_short().then(|| SLICE * GROWTH.pow(slices.min(MOST_SLICES) as u32))
    }

    /// Largest memory of a job in bytes.
    pub fn most_memory(&self) -> f64 {
        if self.is_short() { SHARE_OF_MEMORY * default_limit_bytes() as f64 } else { f64::INFINITY }
    }
}
