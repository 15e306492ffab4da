//! Cancellation of work on another thread: its result is no longer wanted, or it must not continue.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::thread::{Thread, park_timeout, scope};
use std::time::{Duration, Instant};

/// Guard that tells work on another thread to stop when it is dropped: held by the request that waits for the result.
#[derive(Default)]
pub struct CancelOnDrop(Arc<AtomicBool>);

impl CancelOnDrop {
    /// Returns the flag that the work polls.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.0.clone()
    }
}

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Reason why a render ends within a pass. If two are raised, the later variant counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum StopReason {
    /// The seconds of the job are used up; passes that were done count.
    OutOfTime = 1,
    /// A user cancelled the job; passes that were done count.
    Cancelled = 2,
    /// The work was abandoned; nothing that was computed counts.
    Abandoned = 3,
}

/// Stop signal that the caller who may end a render shares with the code that renders.
#[derive(Clone, Default)]
pub struct Stop(Arc<Signal>);

#[derive(Default)]
struct Signal {
    raised: AtomicBool,
    /// Reason, written before `raised`; 0 for none.
    reason: AtomicU8,
}

impl Stop {
    /// Ends the running pass, whose results are dropped.
    pub fn raise(&self, reason: StopReason) {
        self.0.reason.fetch_max(reason as u8, Ordering::Relaxed);
        self.0.raised.store(true, Ordering::Release);
    }

    /// Returns the reason why the render must end; `None` while it may continue.
    pub fn reason(&self) -> Option<StopReason> {
        if !self.0.raised.load(Ordering::Acquire) {
            return None;
        }
        Some(match self.0.reason.load(Ordering::Relaxed) {
            1 => StopReason::OutOfTime,
            2 => StopReason::Cancelled,
            _ => StopReason::Abandoned,
        })
    }

    /// Returns the flag that a running pass polls.
    pub fn flag(&self) -> &AtomicBool {
        &self.0.raised
    }

    /// Does `work`, and raises [`StopReason::OutOfTime`] once it has taken `seconds`: for callers without a timer of their own.
    pub fn within<T>(&self, seconds: f64, work: impl FnOnce() -> T) -> T {
        let ended = AtomicBool::new(false);
        // a deadline beyond the end of the clock never comes
        let Some(deadline) = deadline(seconds) else { return work() };
        scope(|scope| {
            let timer = scope.spawn(|| {
                while !ended.load(Ordering::Acquire) {
                    let left = deadline.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        self.raise(StopReason::OutOfTime);
                        return;
                    }
                    park_timeout(left);
                }
            });
            // also when the work panics: the scope waits for the timer before the panic goes on
            let _ends = EndsTimer { ended: &ended, timer: timer.thread() };
            work()
        })
    }
}

/// Returns the time that is `seconds` from now; `None` when it is beyond the end of the clock.
pub fn deadline(seconds: f64) -> Option<Instant> {
    Instant::now().checked_add(Duration::try_from_secs_f64(seconds.max(0.0)).ok()?)
}

/// Guard that tells the timer of [`Stop::within`] that the work is done.
struct EndsTimer<'a> {
    ended: &'a AtomicBool,
    timer: &'a Thread,
}

impl Drop for EndsTimer<'_> {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        self.timer.unpark();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_reasons_the_stronger_counts_in_any_order() {
        for reasons in [[StopReason::Cancelled, StopReason::Abandoned], [StopReason::Abandoned, StopReason::Cancelled]]
        {
            let stop = Stop::default();
            assert_eq!(stop.reason(), None);
            reasons.into_iter().for_each(|reason| stop.raise(reason));
            assert_eq!(stop.reason(), Some(StopReason::Abandoned));
        }
    }

    #[test]
    fn work_within_seconds_is_told_when_they_are_over() {
        let stop = Stop::default();
        stop.within(0.01, || while !stop.flag().load(Ordering::Relaxed) {});
        assert_eq!(stop.reason(), Some(StopReason::OutOfTime));
        let stop = Stop::default();
        assert_eq!(stop.within(f64::MAX, || 5), 5);
        assert_eq!(stop.within(3600.0, || 6), 6);
        assert_eq!(stop.reason(), None);
    }
}
