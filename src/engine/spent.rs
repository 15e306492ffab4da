//! Wall-clock and processor time of passes.

use std::cell::OnceCell;
use std::time::Instant;

/// Time that passes took to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spent {
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Processor seconds of the threads of the render pool, and of the one that calls it, while these passes were rendered; one job renders
    /// at a time, so that nothing else counts. `None` where the system does not report the time of another thread.
    pub cpu_seconds: Option<f64>,
}

impl Spent {
    /// Time of no passes.
    pub const NOTHING: Self = Self { seconds: 0.0, cpu_seconds: Some(0.0) };

    /// Returns the processor seconds, or the wall-clock seconds where the former are not known.
    pub fn cpu(self) -> f64 {
        self.cpu_seconds.unwrap_or(self.seconds)
    }

    /// Returns the time of these passes and of later ones together.
    pub fn and(self, later: Self) -> Self {
        let cpu_seconds = self.cpu_seconds.zip(later.cpu_seconds).map(|(before, later)| before + later);
        Self { seconds: self.seconds + later.seconds, cpu_seconds }
    }
}

/// Wall clock and processor clocks that are started together.
pub struct Clocks {
    start: Instant,
    threads: Vec<ThreadClock>,
    cpu_start: Option<f64>,
}

impl Clocks {
    /// Starts the clocks of the current rayon pool and of this thread. A call from outside the pool, and the first call on each of its
    /// threads, wakes every thread of the pool to get its clock; reading the clocks wakes none.
    pub fn start() -> Self {
        thread_local! {
            // a thread of a pool stays in it
            static OF_POOL: OnceCell<Vec<ThreadClock>> = const { OnceCell::new() };
        }
        let of_pool = || rayon::broadcast(|_| ThreadClock::of_this()).into_iter().flatten().collect::<Vec<_>>();
        let threads = match rayon::current_thread_index() {
            Some(_) => OF_POOL.with(|known| known.get().cloned()).unwrap_or_else(|| {
                // this thread may do other work of the pool while it waits for the others
                let threads = of_pool();
                OF_POOL.with(|known| known.get_or_init(|| threads).clone())
            }),
            None => of_pool().into_iter().chain(ThreadClock::of_this()).collect(),
        };
        let mut clocks = Self { start: Instant::now(), threads, cpu_start: None };
        clocks.cpu_start = clocks.cpu_seconds();
        clocks
    }

    /// Returns the time since the start.
    pub fn spent(&self) -> Spent {
        let cpu_seconds = self.cpu_start.and_then(|start| Some((self.cpu_seconds()? - start).max(0.0)));
        Spent { seconds: self.start.elapsed().as_secs_f64(), cpu_seconds }
    }

    fn cpu_seconds(&self) -> Option<f64> {
        if self.threads.is_empty() { None } else { self.threads.iter().map(|clock| clock.seconds()).sum() }
    }
}

/// Processor clock of one thread, which any thread of the process may read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct ThreadClock(i32);

#[cfg(target_os = "linux")]
impl ThreadClock {
    fn of_this() -> Option<Self> {
        // the kernel's number of the clock of a thread: its complement, and the bits of one thread (4) and the scheduler (2)
        Some(Self((!nix::unistd::gettid().as_raw() << 3) | 6))
    }

    fn seconds(self) -> Option<f64> {
        let time = nix::time::ClockId::from_raw(self.0).now().ok()?;
        Some(time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64)
    }
}

#[cfg(not(target_os = "linux"))]
impl ThreadClock {
    fn of_this() -> Option<Self> {
        None
    }

    fn seconds(self) -> Option<f64> {
        None
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn times_add_up_as_far_as_they_are_known() {
        let one = Spent { seconds: 1.0, cpu_seconds: Some(2.0) };
        assert_eq!(Spent::NOTHING.and(one), one);
        assert_eq!(one.and(one), Spent { seconds: 2.0, cpu_seconds: Some(4.0) });
        assert_eq!(one.and(Spent { cpu_seconds: None, ..one }).cpu_seconds, None);
    }

    /// Sleep takes wall-clock time only; work on another thread of the pool counts as processor time.
    #[cfg(target_os = "linux")]
    #[test]
    fn work_counts_on_whichever_thread_and_sleep_does_not() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        pool.install(|| {
            let clocks = Clocks::start();
            let seconds = |clocks: &Clocks| clocks.spent().cpu_seconds.unwrap();
            let before = seconds(&clocks);
            std::thread::sleep(Duration::from_millis(100));
            assert!(seconds(&clocks) - before < 0.09, "asleep");
            // each thread works until the clock of its own has gone on
            rayon::broadcast(|_| {
                let own = ThreadClock::of_this().unwrap();
                let until = own.seconds().unwrap() + 0.05;
                while own.seconds().unwrap() < until {}
            });
            assert!(seconds(&clocks) >= before + 0.1);
        });
    }
}
