//! Progress of a study: a bar on a terminal, a line for each run elsewhere.

use indicatif::ProgressBar;

use super::progress::bar;
use crate::figure::ticks::duration;
use crate::study::run::{Left, Step};

/// Display of the runs of a study on standard error.
pub struct StudyProgress(Option<ProgressBar>);

impl StudyProgress {
    pub fn new() -> Self {
        Self(bar(1))
    }

    /// Shows the number of runs done, the next run, and the time left if there is an estimate of it.
    pub fn step(&self, step: &Step<'_>) {
        let (done, of) = (step.done, step.of);
        let line = line(done, of, &step.next, step.left);
        match &self.0 {
            Some(bar) => {
                bar.set_length(of as u64);
                bar.set_position(done as u64);
                bar.set_message(line);
            }
            None => eprintln!("{line}"),
        }
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

fn line(done: usize, of: usize, next: &str, left: Option<Left>) -> String {
    let left = match left {
        Some(Left::About(seconds)) if seconds > 0.0 => format!(", about {} left", duration(seconds, 2)),
        Some(Left::AtMost(seconds)) if seconds > 0.0 => format!(", at most {} left", duration(seconds, 2)),
        _ => String::new(),
    };
    format!("{done} of {of} runs{left}: {next}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_tell_runs_method_and_time() {
        let next = "path_tracing to 2.0 %";
        assert_eq!(
            line(12, 60, next, Some(Left::About(200.0))),
            "12 of 60 runs, about 3.3 min left: path_tracing to 2.0 %"
        );
        assert_eq!(line(1, 9, next, Some(Left::AtMost(30.0))), "1 of 9 runs, at most 30 s left: path_tracing to 2.0 %");
        assert_eq!(line(0, 60, "reference", None), "0 of 60 runs: reference");
        assert_eq!(line(60, 60, "done", Some(Left::About(0.0))), "60 of 60 runs: done");
    }
}
