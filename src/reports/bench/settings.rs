//! Settings of benchmarks: the amount of measurement, and a callback for its progress.

use std::path::PathBuf;
use std::sync::Arc;

use super::measure::Repeats;
use super::peers::Beside;

/// Amount of measurement.
#[derive(Clone, Debug)]
pub struct Settings {
    /// True for a trial, which takes about a minute.
    pub quick: bool,
    /// Folder of the scenes and of their references, `tests/reference`.
    pub reference: PathBuf,
    /// Results of other programs that ran before this benchmark, if any were to run.
    pub beside: Option<Arc<Beside>>,
}

impl Settings {
    /// Returns `full` for the whole benchmark, `quick` for a trial.
    pub fn either<T>(&self, full: T, quick: T) -> T {
        if self.quick { quick } else { full }
    }

    /// Returns the results of other programs that ran before this benchmark, if any were to run.
    pub fn beside(&self) -> Option<&Beside> {
        self.beside.as_deref()
    }

    /// Returns the limits for repeating a measurement.
    pub fn repeats(&self) -> Repeats {
        self.either(Repeats { most: 15, seconds: 6.0 }, Repeats { most: 2, seconds: 0.2 })
    }

    /// Returns the limits for repeating jobs that run to an accuracy: their number of passes is random, and the median of 15
    /// may be a fifth off.
    pub fn repeats_to_accuracy(&self) -> Repeats {
        self.either(Repeats { most: 61, ..self.repeats() }, self.repeats())
    }

    /// Returns the seconds after which a job ends, accurate or not.
    pub fn longest_job(&self) -> f64 {
        self.either(20.0, 1.0)
    }

    /// Returns the sentence that marks the page of a trial; empty for the whole benchmark.
    pub fn remark(&self) -> &'static str {
        self.either(
            "",
            " **This is a short run, for a trial: its numbers are rough, and the largest cases are missing.**",
        )
    }
}

/// Progress of a benchmark, or of a part of it: a callback with the fraction 0..1 that is done and the name of the next
/// measurement.
#[derive(Clone, Copy)]
pub struct Progress<'a> {
    hear: &'a (dyn Fn(f64, &str) + Sync),
    from: f64,
    to: f64,
}

impl<'a> Progress<'a> {
    /// Creates the progress of the whole benchmark.
    pub fn new(hear: &'a (dyn Fn(f64, &str) + Sync)) -> Self {
        Self { hear, from: 0.0, to: 1.0 }
    }

    /// Returns the progress of a part of this, between two fractions 0..1.
    pub fn part(&self, from: f64, to: f64) -> Self {
        let at = |share: f64| self.from + share * (self.to - self.from);
        Self { from: at(from), to: at(to), ..*self }
    }

    /// Reports that step `done` of `all` begins, counted from 0.
    pub fn step(&self, done: usize, all: usize, what: &str) {
        let share = done as f64 / all.max(1) as f64;
        (self.hear)(self.from + share * (self.to - self.from), what);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn parts_of_parts_have_their_shares() {
        let heard = Mutex::new(Vec::new());
        let hear = |share: f64, what: &str| heard.lock().unwrap().push((share, what.to_owned()));
        let all = Progress::new(&hear);
        all.step(0, 2, "a");
        all.part(0.5, 1.0).part(0.0, 0.5).step(1, 2, "b");
        assert_eq!(*heard.lock().unwrap(), [(0.0, "a".to_owned()), (0.625, "b".to_owned())]);
    }
}
