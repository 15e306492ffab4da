//! Whether the service can write, looked at from time to time.

use std::time::{Duration, Instant};

use tokio::sync::Mutex;

use crate::job::artifacts::Artifacts;
use crate::job::store::Store;

/// Time for which a look at whether the service can write is good.
const LOOK_AGAIN: Duration = Duration::from_secs(5);
/// Time for which a look is good that found that the service cannot write.
const LOOK_AGAIN_AFTER_TROUBLE: Duration = Duration::from_secs(1);

/// The last look at whether the service can write; whoever asks at the same time shares it.
#[derive(Default)]
pub struct Readiness {
    last: Mutex<Option<(Instant, Result<(), String>)>>,
}

impl Readiness {
    /// Tells whether both stores can be written to and `least_free_bytes` of the disk are free; otherwise why not, in words
    /// for clients. A look a short time ago is good enough.
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

/// Writes to both stores; the reason why that does not work, without the machine's paths.
async fn try_to_write(store: &dyn Store, artifacts: &Artifacts, least: u64) -> Result<(), String> {
    match artifacts.free_bytes() {
        Ok(free) if free < least => {
            tracing::error!(free, least, "not ready: the disk is nearly full");
            return Err(format!("the disk is nearly full: {} MB are free, {} MB are needed", free >> 20, least >> 20));
        }
        Ok(_) => {}
        Err(error) => tracing::warn!(%error, "the free space of the disk is not known"),
    }
    store.ready().await.map_err(|error| {
        tracing::error!(%error, "not ready");
        "the database cannot be written to".to_owned()
    })?;
    artifacts.ready().await.map_err(|error| {
        tracing::error!(%error, "not ready");
        "artifacts cannot be written".to_owned()
    })
}
