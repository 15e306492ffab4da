//! Threads that render.

use tokio::sync::oneshot;

use super::interrupted::Interrupted;

/// Rayon pool for work that the async side waits for.
pub(super) struct RenderPool(rayon::ThreadPool);

impl RenderPool {
    /// Creates a pool of `RAYON_NUM_THREADS` threads, or as many as there are processors.
    pub fn new() -> Result<Self, rayon::ThreadPoolBuildError> {
        rayon::ThreadPoolBuilder::new().thread_name(|index| format!("render-{index}")).build().map(Self)
    }

    /// Creates a pool of threads of this name, half as many as this one has, for passes that are rendered beside it.
    pub fn beside(&self, name: &'static str) -> Result<Self, rayon::ThreadPoolBuildError> {
        let threads = (self.threads() / 2).max(1);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(move |index| format!("{name}-{index}"))
            .build()
            .map(Self)
    }

    pub fn threads(&self) -> usize {
        self.0.current_num_threads()
    }

    /// Runs work on the render pool; a panic there is returned as an error.
    pub async fn run<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Result<T, Interrupted> {
        let (sender, receiver) = oneshot::channel();
        self.0.spawn(move || {
            // what a panic leaves half done is dropped with it
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
            let _ = sender.send(result.map_err(|panic| panic_message(panic.as_ref())));
        });
        match receiver.await {
            Ok(result) => result.map_err(Interrupted::Panicked),
            Err(_) => Err(Interrupted::Panicked("the render thread ended unexpectedly".into())),
        }
    }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    if let Some(text) = panic.downcast_ref::<&str>() {
        (*text).to_owned()
    } else if let Some(text) = panic.downcast_ref::<String>() {
        text.clone()
    } else {
        "a panic without message".to_owned()
    }
}
