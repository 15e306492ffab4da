//! `skyduct-reports bench`: measures the cost of accuracy and of effects on this machine.

mod peers;
mod processes;
mod service;

use std::io::{IsTerminal, Read};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

use self::peers::PeersArgs;
use crate::bench::{Progress, Settings, effects, performance, studied, whole};
use crate::markdown;
use crate::page::Report;

/// Number of steps of the progress bar.
const STEPS: f64 = 1000.0;

#[derive(Debug, clap::Args)]
pub struct BenchArgs {
    #[command(subcommand)]
    subject: Subject,
}

#[derive(Debug, clap::Subcommand)]
enum Subject {
    /// Measure the time to an accuracy, the growth of cost, and the parts of a job's time: performance.md, in at most half an
    /// hour
    Performance(PerformanceArgs),
    /// Measure the cost of accuracy by each method against references, and how often confidence intervals contain the truth:
    /// accuracy.md, in about half an hour on two processors
    Accuracy(AccuracyArgs),
    /// Measure the cost of each effect of light: effects.md, in some minutes
    Effects(PageArgs),
    /// Render the document on standard input and print its cost as JSON
    #[command(hide = true)]
    Job(JobArgs),
}

#[derive(Debug, clap::Args)]
struct PageArgs {
    /// Folder for the page and its figures
    #[arg(long, default_value = "docs")]
    out: PathBuf,
    /// Folder of the scenes and their references
    #[arg(long, default_value = "tests/reference")]
    reference: PathBuf,
    /// Measure less, and less often, in about a minute, for a trial
    #[arg(long)]
    quick: bool,
}

#[derive(Debug, clap::Args)]
struct PerformanceArgs {
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    peers: PeersArgs,
}

#[derive(Debug, clap::Args)]
struct AccuracyArgs {
    #[command(flatten)]
    page: PageArgs,
    /// Largest number of seeds of each method to each error, over which intervals are counted
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(2..))]
    seeds: u64,
}

#[derive(Debug, clap::Args)]
struct JobArgs {
    /// Folder of the document's meshes
    #[arg(long, default_value = ".")]
    meshes: PathBuf,
}

pub fn run(args: BenchArgs) -> anyhow::Result<()> {
    match args.subject {
        Subject::Performance(PerformanceArgs { page: args, peers }) => page(args, |settings, progress| {
            let others = if peers.any() { 0.6 } else { 0.0 };
            let beside = peers::measure(&peers, settings, progress.part(0.0, others))?;
            let progress = progress.part(others, 1.0);
            let settings = &Settings { beside: beside.map(Arc::new), ..settings.clone() };
            let processes = processes::measure(settings, progress.part(0.0, 0.1))?;
            let latencies = service::measure(settings, progress.part(0.1, 0.15))?;
            Ok(performance::run(settings, &processes, &latencies, progress.part(0.15, 1.0))?)
        }),
        Subject::Accuracy(AccuracyArgs { page: args, seeds }) => {
            page(args, |settings, progress| Ok(studied::run(settings, seeds, progress)?))
        }
        Subject::Effects(args) => page(args, |settings, progress| Ok(effects::run(settings, progress)?)),
        Subject::Job(JobArgs { meshes }) => {
            let mut document = String::new();
            std::io::stdin().read_to_string(&mut document).context("the document cannot be read")?;
            let document = serde_json::from_str(&document).context("the document is not JSON")?;
            println!("{}", serde_json::to_string(&whole::measure(document, &meshes)?)?);
            Ok(())
        }
    }
}

/// Measures a page and writes it.
fn page(
    PageArgs { out, reference, quick }: PageArgs,
    measure: impl FnOnce(&Settings, Progress) -> anyhow::Result<Report>,
) -> anyhow::Result<()> {
    let bar = std::io::stderr().is_terminal().then(bar);
    let hear = |share: f64, what: &str| match &bar {
        Some(bar) => {
            bar.set_position((share * STEPS) as u64);
            bar.set_message(what.to_owned());
        }
        None => eprintln!("{:3.0} %  {what}", 100.0 * share),
    };
    let report = measure(&Settings { quick, reference, beside: None }, Progress::new(&hear))?;
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    markdown::write(&report, &out).with_context(|| format!("the page cannot be written to {}", out.display()))?;
    eprintln!("the page is {}", out.join(report.name).with_extension("md").display());
    Ok(())
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(STEPS as u64);
    if let Ok(style) = ProgressStyle::with_template("{elapsed_precise} {bar:30} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
