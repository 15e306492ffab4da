//! Whole jobs in processes of their own: the times of their parts, and their memory.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::case::Case;
use super::measure::{Quartiles, as_time, mebibytes, percent, processor_seconds, time};
use super::scenes;
use super::settings::Settings;
use crate::page::{ReportError, Section, Table};
use skyduct::engine::cancel::Stop;
use skyduct::engine::passes::RenderError;
use skyduct::present::outputs::{Format, Output};
use skyduct::present::saved_files::{Saved, SavedFigures, results};

/// Job of a table, to be measured in a process of its own.
pub struct WholeJob {
    pub name: &'static str,
    pub document: Value,
}

/// Cost of the parts of a job in one process, in processor seconds of all its threads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parts {
    /// Time from the document to the first pass.
    pub set_up: f64,
    pub passes: f64,
    /// Time of the reports on tubes.
    pub reports: f64,
    /// Time of all other files that `render` saves.
    pub files: f64,
    /// Peak memory of the process in bytes; 0 where the system does not report it.
    pub peak_bytes: u64,
}

/// Measurements of other processes.
pub struct Processes {
    /// Jobs by name, each measured several times.
    pub jobs: Vec<(&'static str, Vec<Parts>)>,
    /// Wall-clock seconds of `skyduct render` of S1 to 1 %.
    pub render: Quartiles,
}

/// Returns the jobs that are measured; their meshes are in the folder `scenes` of the references.
pub fn jobs(settings: &Settings) -> Result<Vec<WholeJob>, ReportError> {
    let seconds = settings.longest_job();
    let mut jobs: Vec<(&'static str, Case)> = Vec::new();
    for name in ["S1", "S2", "S3", "S3_mesh"] {
        jobs.push((name, scenes::stored(settings, name)?.to(0.01, seconds)));
    }
    let long = serde_json::json!([{ "length_m": 12.7 }, { "length_m": 12.7, "tilt_deg": 45, "azimuth_deg": 90 }]);
    jobs.push(("S1, bent tube of 100 diameters", scenes::with_tube(settings, scenes::tube(long))?.to(0.01, seconds)));
    jobs.push(("hall with 64 tubes", scenes::tubes(settings, 8)?.to(0.01, seconds)));
    jobs.push(("S1, 10 000 points", scenes::points(settings, 100)?.to(0.01, seconds)));
    jobs.push(("S4, 8 passes", scenes::stored(settings, "S4")?.passes(8, seconds)));
    Ok(jobs.into_iter().map(|(name, Case { document, .. })| WholeJob { name, document }).collect())
}

/// Renders a job, makes the files that `render` saves, and returns the cost of both; this process must do nothing else.
pub fn measure(document: Value, meshes: &Path) -> Result<Parts, ReportError> {
    let (prepared, set_up) =
        processor_seconds(|| Case::beside(document, meshes).prepare().inspect(|prepared| prepared.make_ready()));
    let prepared = prepared?;
    let mut passes = Vec::new();
    let rendered = prepared.render(&Stop::default(), &mut |pass, _| passes.push(*pass))?;
    let estimate = &rendered.estimate;
    if let Some(reason) = prepared.no_results(rendered.stopped_by, estimate) {
        return Err(ReportError::Case(reason));
    }
    // the reports on a tube are computed for the first file that needs them
    let reader = prepared.results(estimate);
    let (reports, of_reports) =
        processor_seconds(|| reader.files(|output| matches!(output, Output::Tube(_, Format::Json))));
    reports?;
    let figures = SavedFigures::USUAL.parse().map_err(ReportError::Case)?;
    let (files, of_files) = processor_seconds(|| {
        let saved = Saved { reader, passes: &passes, results: &results(&prepared, &rendered) };
        saved.files(&figures, |_, _| Ok::<(), RenderError>(()))
    });
    files?;
    let passes = rendered.spent.cpu_seconds.unwrap_or(rendered.spent.seconds);
    Ok(Parts { set_up, passes, reports: of_reports, files: of_files, peak_bytes: peak_bytes() })
}

/// Returns the peak memory of this process so far in bytes; 0 where the system does not report it.
fn peak_bytes() -> u64 {
    std::fs::read_to_string("/proc/self/status").map_or(0, |status| peak_in(&status))
}

/// Finds the largest resident size in bytes in `/proc/self/status` of Linux; 0 if it is not there.
fn peak_in(status: &str) -> u64 {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kibibytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok());
    kibibytes.unwrap_or(0) * 1024
}

/// Returns the fraction of a job's time that its reports take.
fn share_of_reports(Parts { set_up, passes, reports, files, .. }: &Parts) -> f64 {
    reports / (set_up + passes + reports + files)
}

pub fn section(processes: &Processes) -> Section {
    let share = |parts: &[Parts]| Quartiles::of(parts.iter().map(share_of_reports)).median;
    let row = |(name, parts): &(&'static str, Vec<Parts>)| {
        let median = |of: fn(&Parts) -> f64| Quartiles::of(parts.iter().map(of)).median;
        vec![
            (*name).to_owned(),
            time(median(|parts| parts.set_up)),
            time(median(|parts| parts.passes)),
            time(median(|parts| parts.reports)),
            time(median(|parts| parts.files)),
            percent(share(parts)),
            mebibytes(median(|parts| parts.peak_bytes as f64) as u64),
        ]
    };
    Section {
        title: "Whole jobs and memory".to_owned(),
        text: format!(
            "Jobs to 1 %, each in a process of its own that uses all processors: processor seconds from the document \
             to the first pass, of the passes, of the reports on all tubes (transmission by altitude, under the sky, \
             in the sun), and of all other files; the reports' share of the total; and the largest memory of the \
             process. Medians of processes. `skyduct render` of S1 to 1 % with all its files takes {} of wall-clock \
             time, from the start of the process to its end.",
            as_time(&processes.render)
        ),
        tables: vec![Table {
            caption: "Where the time of a job goes".to_owned(),
            head: ["job", "set-up", "passes", "tube reports", "other files", "share of the reports", "memory"]
                .map(str::to_owned)
                .into(),
            rows: processes.jobs.iter().map(row).collect(),
        }],
        ..Section::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_from_the_status() {
        assert_eq!(peak_in("Name:\tskyduct\nVmPeak:\t  999 kB\nVmHWM:\t    2048 kB\nVmRSS:\t 1 kB\n"), 2 << 20);
        assert_eq!(peak_in("Name:\tskyduct\n"), 0);
    }

    #[test]
    fn the_share_of_reports_is_that_in_all_parts() {
        let parts = Parts { set_up: 1.0, passes: 5.0, reports: 1.0, files: 3.0, peak_bytes: 0 };
        assert_eq!(share_of_reports(&parts), 0.1);
        let processes = Processes { jobs: vec![("a", vec![parts])], render: Quartiles::of([0.02]) };
        let section = section(&processes);
        assert_eq!(section.tables[0].rows[0][5], "10.0 %");
    }
}
