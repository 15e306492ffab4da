//! Readiness of the service, checked by trying to write.

use std::time::{Duration, Instant};

use tokio::sync::Mutex;

use crate::queue::artifacts::Artifacts;
use crate::queue::store::Store;

/// Time for which the result of a successful check is valid.
const LOOK_AGAIN: Duration = Duration::from_secs(5);
/// Time for which the result of a failed check is valid.
const LOOK_AGAIN_AFTER_TROUBLE: Duration = Duration::from_secs(1);

/// Result of the last check that the service can write; simultaneous requests share it.
#[derive(Default)]
pub struct Readiness {
    last: Mutex<Option<(Instant, Result<(), String>)>>,
}

impl Readiness {
    /// Checks that both stores can be written to and `least_free_bytes` of the disk are free; the error is the reason in words for
    /// clients. The result of a recent check is returned again.
    pub async fn look(&self, store: &dyn Store, artifacts: &Artifacts, least_free_bytes: u64) -> Result<(), String> {
        let mut last = self.last.lock().await;
        if let Some((when, found)) = last.as_ref() {
            let good_for = if found.is_ok() { LOOK_AGAIN } else { LOOK_AGAIN_AFTER_TROUBLE };
            if when.elapsed() < good_for {
                return found.clone();
            }
        }
        let found = try_to_write(store, artifacts, least_free_bytes).await;
        *last = Some((Instant::now(), found.clone()));
        found
    }
}

/// Checks the free space of the disk and writes to both stores; the error is the reason, without the machine's paths.
async fn try_to_write(store: &dyn Store, artifacts: &Artifacts, least: u64) -> Result<(), String> {
    match artifacts.free_bytes() {
        Ok(free) if free < least => {
            tracing::error!(free, least, "not ready: the disk is nearly full");
            return Err(format!("the disk is nearly full: {} MB are free, {} MB are needed", free >> 20, least >> 20));
        }
        Ok(_) => {}
        Err(error) => tracing::warn!(%error, "the free space of the disk cannot be read"),
    }
    store.ready().await.map_err(|error| {
        tracing::error!(%error, "not ready");
        "the database cannot be written to".to_owned()
    })?;
    artifacts.ready().await.map_err(|error| {
        tracing::error!(%error, "not ready");
        "result files cannot be written to the disk".to_owned()
    })
}
