//! Page on performance.

use std::thread::available_parallelism;

use super::measure::on_one_thread;
use super::service::{self, Latencies};
use super::settings::{Progress, Settings};
use super::whole::{self, Processes};
use super::{accuracy, growth, image, peers, rays, rooms};
use crate::page::{Report, ReportError, Section};
use skyduct::estimate::FilmEstimate;

/// Measures everything that one process can, and combines it with the measurements of other processes.
pub fn run(
    settings: &Settings,
    processes: &Processes,
    latencies: &Latencies,
    progress: Progress,
) -> Result<Report, ReportError> {
    progress.step(0, 1, "the Cornell box by path tracing, for reference");
    let reference = image::reference(settings)?;
    let mut sections = on_one_thread(|| in_this_process(settings, &reference, progress))?;
    sections.push(whole::section(processes));
    sections.push(service::section(latencies));
    let others = Section {
        title: "Other programs".to_owned(),
        text: peers::remark(settings.beside()).to_owned(),
        tables: peers::tables(settings.beside()),
        ..Section::default()
    };
    sections.insert(1, others);
    Ok(Report { name: "performance", title: "Performance", introduction: introduction(settings), sections })
}

fn in_this_process(
    settings: &Settings,
    reference: &FilmEstimate,
    progress: Progress,
) -> Result<Vec<Section>, ReportError> {
    let rooms = rooms::section(settings, progress.part(0.1, 0.5))?;
    let accuracy = accuracy::section(settings, progress.part(0.5, 0.65))?;
    let mut picture = image::section(settings, reference, progress.part(0.65, 0.75))?;
    progress.part(0.75, 0.78).step(0, 1, "the thesis room with its view");
    picture.tables.push(image::demo(settings)?);
    progress.part(0.78, 0.8).step(0, 1, "rays in a mesh");
    let rays = rays::section(settings)?;
    let growth = growth::section(settings, progress.part(0.8, 1.0))?;
    Ok(vec![rooms, accuracy, picture, rays, growth])
}

fn introduction(settings: &Settings) -> String {
    format!(
        "What accuracy costs, how cost grows, and where the time of a job goes. `cargo run --release -p skyduct-reports -- bench performance` measures everything anew \
         and writes this page: skyduct {}, {}.{}",
        skyduct::VERSION,
        machine(),
        settings.remark()
    )
}

/// Describes the date, the machine and the build.
pub fn machine() -> String {
    let processors = available_parallelism().map_or(1, std::num::NonZero::get);
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let build = if cfg!(debug_assertions) { ", **a build for development**" } else { "" };
    format!("{} on {processors} processors ({}){build}", jiff::Timestamp::now().strftime("%-d %B %Y"), model(&told))
}

/// Finds the name of the processor in `/proc/cpuinfo` of Linux.
fn model(told: &str) -> &str {
    let line = told.lines().find(|line| line.starts_with("model name"));
    line.and_then(|line| line.split_once(':')).map_or("of unknown kind", |(_, name)| name.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_named() {
        assert_eq!(model("processor\t: 0\nmodel name\t: Some CPU @ 2 GHz\n"), "Some CPU @ 2 GHz");
        assert_eq!(model(""), "of unknown kind");
    }
}
