//! How far a render is: a bar on a terminal, lines elsewhere.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::estimate::StopRule;
use crate::job::progress::PassReport;

/// Number of steps of the progress bar.
const STEPS: u64 = 1000;

/// Shows the passes of one job on standard error.
pub struct Progress {
    stop: StopRule,
    bar: Option<ProgressBar>,
}

impl Progress {
    pub fn new(stop: StopRule) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(STEPS);
            if let Ok(style) = ProgressStyle::with_template("{elapsed_precise} {bar:30} {msg}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        Self { stop, bar }
    }

    /// Lines are for passes 1, 2, 4, 8 and so on only.
    pub fn pass_done(&self, report: &PassReport) {
        match &self.bar {
            Some(bar) => {
                bar.set_position((share_done(&self.stop, report) * STEPS as f64) as u64);
                bar.set_message(describe(report));
            }
            None if report.passes.is_power_of_two() => {
                eprintln!("{:8.2} s  {}", report.seconds, describe(report));
            }
            None => {}
        }
    }

    /// A line for people, above the bar.
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

fn describe(report: &PassReport) -> String {
    let mut text = format!("pass {}", report.passes);
    if let Some(lux) = report.mean_lux {
        text += &format!("  mean {lux:.4} lux");
    }
    for (name, error) in [("grids", report.relative_error), ("views", report.view_relative_error)] {
        if let Some(error) = error {
            text += &format!("  {name} {:.2} %", 100.0 * error);
        }
    }
    text
}

/// The share 0..1 of the job that is done, by the limit that is nearest.
///
/// Errors of independent passes fall with the root of their number, so that (asked / achieved)^2 is the share done.
fn share_done(stop: &StopRule, report: &PassReport) -> f64 {
    let share = |asked: f64, achieved: Option<f64>| achieved.map(|achieved| (asked / achieved).powi(2));
    let outputs = [
        share(stop.relative_error, report.relative_error),
        share(stop.view_relative_error, report.view_relative_error),
    ];
    let accuracy = outputs.into_iter().flatten().fold(f64::INFINITY, f64::min);
    let accuracy = if accuracy.is_finite() { accuracy } else { 0.0 };
    let passes = report.passes as f64 / stop.max_passes as f64;
    let seconds = report.seconds / stop.max_seconds;
    accuracy.max(passes).max(seconds).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(error: Option<f64>, view_error: Option<f64>) -> PassReport {
        PassReport {
            passes: 10,
            seconds: 6.0,
            photons: 1,
            rays: 1,
            relative_error: error,
            view_relative_error: view_error,
            mean_lux: Some(70.0),
        }
    }

    #[test]
    fn the_nearest_limit_counts() {
        let stop = StopRule {
            relative_error: 0.02,
            view_relative_error: 0.05,
            confidence: 0.95,
            max_passes: 1000,
            max_seconds: 600.0,
        };
        assert_eq!(share_done(&stop, &report(None, None)), 0.01);
        assert_eq!(share_done(&stop, &report(Some(0.04), None)), 0.25);
        // both must hold
        assert_eq!(share_done(&stop, &report(Some(0.01), Some(0.1))), 0.25);
        assert_eq!(share_done(&stop, &report(Some(0.0), None)), 0.01);
        assert_eq!(share_done(&stop, &report(Some(0.001), None)), 1.0);
    }
}
