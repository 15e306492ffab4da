//! Turns of jobs: a job's turn is over after a while, and so is the time in which first chunks go before later ones.

use std::time::Duration;

use tokio::time::Instant;
use uuid::Uuid;

use crate::queue::store::{Lease, MAX_DEATHS, Turn};

/// Render time of a job after which it yields to the next one, at the end of its chunk.
const TURN: Duration = Duration::from_secs(2);
/// Time after which a later chunk gets a turn, however many first chunks wait: a client that posts job after job must not stop those that
/// have begun.
const LATER_AFTER: Duration = Duration::from_secs(8);
/// Age of a process from which on it takes a chunk over which one process, or two in a row, have died.
const STEADY_AFTER: [Duration; MAX_DEATHS as usize - 1] = [Duration::from_secs(2), Duration::from_secs(10)];

/// Turns of a worker.
pub(super) struct Turns {
    started: Instant,
    /// Job whose turn it is, and the start of its turn.
    job: Option<(Uuid, Instant)>,
    /// Time at which a turn was last offered to later chunks first.
    later: Instant,
    /// True in the short lane.
    short: bool,
}

impl Turns {
    pub fn new(now: Instant, short: bool) -> Self {
        Self { started: now, job: None, later: now, short }
    }

    /// Returns the preferences of the next claim.
    pub fn next(&self, now: Instant) -> Turn {
        let stay_with = self.job.filter(|(_, since)| now - *since < TURN).map(|(job, _)| job);
        let age = now - self.started;
        // a chunk that may kill the process is not rendered beside another one
        let most_deaths = match self.short {
            true => 0,
            false => STEADY_AFTER.iter().filter(|after| age >= **after).count() as u64,
        };
        Turn { stay_with, later_first: now - self.later >= LATER_AFTER, short: self.short, most_deaths }
    }

    /// Records that a claim has taken a chunk.
    pub fn taken(&mut self, turn: Turn, lease: &Lease, now: Instant) {
        if turn.stay_with == Some(lease.job) {
            return;
        }
        self.job = Some((lease.job, now));
        if turn.later_first {
            self.later = now;
        }
    }

    /// Returns the time until this process takes chunks that it leaves alone for now; `None` where it leaves none.
    pub fn until_steadier(&self, now: Instant) -> Option<Duration> {
        STEADY_AFTER.iter().find_map(|after| after.checked_sub(now - self.started))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lease(job: Uuid) -> Lease {
        Lease {
            job,
            chunk: 0,
            owner: String::new(),
            attempt: 1,
            failures: 0,
            slices: 0,
            others_wait: true,
            cancel_requested: false,
        }
    }

    /// First chunks of jobs that come one after the other, each taking 3 s.
    #[test]
    fn later_chunks_get_a_turn_however_many_first_ones_come() {
        let start = Instant::now();
        let mut turns = Turns::new(start, false);
        let mut later_first = Vec::new();
        for begun in 0..9 {
            let now = start + Duration::from_secs(3 * begun);
            let turn = turns.next(now);
            assert_eq!(turn.stay_with, None, "the turn of the one before is over");
            later_first.push(turn.later_first);
            turns.taken(turn, &lease(Uuid::from_u128(begun.into())), now);
        }
        assert_eq!(later_first, [false, false, false, true, false, false, true, false, false]);
    }

    #[test]
    fn a_turn_is_its_jobs_until_it_is_over() {
        let (start, job) = (Instant::now(), Uuid::from_u128(1));
        let mut turns = Turns::new(start, false);
        let at = |seconds| start + Duration::from_secs_f64(seconds);
        turns.taken(turns.next(start), &lease(job), start);
        for (seconds, stay_with) in [(0.5, Some(job)), (1.9, Some(job)), (2.1, None)] {
            let turn = turns.next(at(seconds));
            assert_eq!(turn.stay_with, stay_with, "after {seconds} s");
            turns.taken(turn, &lease(job), at(seconds));
        }
        assert_eq!(turns.next(at(3.0)).stay_with, Some(job), "nobody else was there: the next turn is its own, too");
    }
}
