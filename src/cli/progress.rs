//! Progress of a render: a bar on a terminal, lines elsewhere.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::engine::progress::PassReport;
use crate::estimate::StopRule;
use crate::figure::ticks::foretold_duration;
use crate::predict::forecast::{Forecast, WaitingFor};

/// Number of steps of the progress bar.
const STEPS: u64 = 1000;

/// Display of the passes of one job on standard error.
pub struct Progress {
    stop: StopRule,
    bar: Option<ProgressBar>,
}

impl Progress {
    pub fn new(stop: StopRule) -> Self {
        Self { stop, bar: bar(STEPS) }
    }

    /// Shows a pass and the forecast after it; without a terminal only for passes 1, 2, 4, 8 and so on.
    pub fn pass_done(&self, report: &PassReport, forecast: &Forecast) {
        match &self.bar {
            Some(bar) => {
                bar.set_position((share_done(&self.stop, report, forecast) * STEPS as f64) as u64);
                bar.set_message(describe(report, forecast));
            }
            None if report.passes.is_power_of_two() => {
                eprintln!("{:8.2} s  {}", report.seconds, describe(report, forecast));
            }
            None => {}
        }
    }

    /// Says that the passes are done, and what is computed now.
    pub fn phase(&self, words: &str) {
        if let Some(bar) = &self.bar {
            bar.set_position(STEPS);
            bar.set_message(words.to_owned());
        }
    }

    /// Prints a line above the bar.
    pub fn note(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => eprintln!("{text}"),
        }
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Starts a bar of some steps on standard error; `None` where that is no terminal.
pub(super) fn bar(steps: u64) -> Option<ProgressBar> {
    std::io::stderr().is_terminal().then(|| {
        let bar = ProgressBar::new(steps);
        if let Ok(style) = ProgressStyle::with_template("{elapsed_precise} {bar:30} {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    })
}

fn describe(report: &PassReport, forecast: &Forecast) -> String {
    let mut text = format!("pass {}", report.passes);
    if let Some(lux) = report.mean_lux {
        text += &format!("  mean {lux:.4} lux");
    }
    for (name, error) in [("grids", report.relative_error), ("views", report.view_relative_error)] {
        if let Some(error) = error {
            text += &format!("  {name} {:.2} %", 100.0 * error);
        }
    }
    if let Some(left) = forecast.seconds_left.filter(|left| *left > 0.0) {
        text += &format!("  {} left", foretold_duration(left));
    }
    if forecast.waiting_for == Some(WaitingFor::LeastPasses) {
        text += ", until there are enough passes to estimate the error";
    }
    text
}

/// Returns the fraction 0..1 of the job that is done: by the predicted time left, or, before there is a prediction, by the
/// nearer of the limits of passes and of seconds.
fn share_done(stop: &StopRule, report: &PassReport, forecast: &Forecast) -> f64 {
    let share = match forecast.seconds_left {
        Some(left) => report.seconds / (report.seconds + left),
        None => (report.passes as f64 / stop.max_passes as f64).max(report.seconds / stop.max_seconds),
    };
    // 0 / 0 s is not a number
    if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STOP: StopRule = StopRule {
        relative_error: 0.02,
        view_relative_error: 0.05,
        confidence: 0.95,
        max_passes: 1000,
        max_seconds: 600.0,
    };

    fn report() -> PassReport {
        let relative_error = Some(0.04);
        PassReport { passes: 10, seconds: 6.0, relative_error, mean_lux: Some(70.0), ..PassReport::default() }
    }

    fn left(seconds_left: Option<f64>, waiting_for: Option<WaitingFor>) -> Forecast {
        Forecast { seconds_left, waiting_for, ..Forecast::default() }
    }

    #[test]
    fn the_share_is_that_of_the_time_or_of_the_nearest_limit() {
        assert_eq!(share_done(&STOP, &report(), &left(None, None)), 0.01);
        assert_eq!(share_done(&STOP, &report(), &left(Some(18.0), None)), 0.25);
        assert_eq!(share_done(&STOP, &report(), &left(Some(0.0), None)), 1.0);
        let begun = PassReport { seconds: 0.0, ..report() };
        assert_eq!(share_done(&STOP, &begun, &left(Some(0.0), None)), 0.0);
    }

    #[test]
    fn people_read_the_time_left_and_what_is_waited_for() {
        let errors = "pass 10  mean 70.0000 lux  grids 4.00 %";
        assert_eq!(describe(&report(), &left(None, None)), errors);
        assert_eq!(
            describe(&report(), &left(Some(18.0), Some(WaitingFor::RelativeError))),
            format!("{errors}  about 18 s left")
        );
        assert_eq!(describe(&report(), &left(Some(2e83), None)), format!("{errors}  > 1 h left"));
        let floor = describe(&report(), &left(Some(0.5), Some(WaitingFor::LeastPasses)));
        assert!(
            floor.starts_with(errors) && floor.ends_with(" left, until there are enough passes to estimate the error"),
            "{floor}"
        );
    }
}
