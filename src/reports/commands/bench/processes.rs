//! Measurements of processes of this program: jobs with the times of their parts and memory, and `skyduct render` from start to
//! end.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, bail};

use crate::bench::whole::{Parts, Processes, WholeJob, jobs};
use crate::bench::{Progress, Quartiles, Settings, service};
use skyduct::cli::temporary_folder::TemporaryFolder;

pub fn measure(settings: &Settings, progress: Progress) -> anyhow::Result<Processes> {
    let program = std::env::current_exe().context("the path of this program cannot be found")?;
    let skyduct = program.with_file_name("skyduct");
    if !skyduct.exists() {
        bail!("{} is not there: build it first, by `cargo build --release`", skyduct.display());
    }
    let meshes = settings.reference.join("scenes");
    let runs = settings.either(5, 1);
    let mut measured = Vec::new();
    let jobs = jobs(settings)?;
    let all = jobs.len() + 1;
    for (number, job) in jobs.iter().enumerate() {
        progress.step(number, all, &format!("processes: {}", job.name));
        let parts = (0..runs).map(|_| parts(&program, &meshes, job)).collect::<Result<Vec<_>, _>>()?;
        measured.push((job.name, parts));
    }
    progress.step(jobs.len(), all, "processes: skyduct render");
    Ok(Processes { jobs: measured, render: render(&skyduct, settings)? })
}

fn parts(program: &Path, meshes: &Path, job: &WholeJob) -> anyhow::Result<Parts> {
    let mut command = Command::new(program);
    command.args(["bench", "job", "--meshes"]).arg(meshes).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().context("a process of this program cannot be started")?;
    // the end of the input is the end of the document
    let written = child.stdin.take().map(|mut input| input.write_all(job.document.to_string().as_bytes()));
    let output = child.wait_with_output().context("a process of this program cannot be waited for")?;
    if !output.status.success() {
        bail!("the process of {} failed", job.name);
    }
    written.transpose().context("a document cannot be passed to the process")?;
    serde_json::from_slice(&output.stdout).with_context(|| format!("the process of {} printed no numbers", job.name))
}

/// Measures the wall-clock seconds of `skyduct render` of S1 to 1 %.
fn render(program: &Path, settings: &Settings) -> anyhow::Result<Quartiles> {
    let folder = TemporaryFolder::new("bench")?;
    let job = folder.path().join("job.json");
    std::fs::write(&job, service::small_job(settings, 0)?.to_string()).context("a job cannot be written")?;
    let runs = settings.either(21, 3);
    let once = |_| {
        let mut command = Command::new(program);
        command.arg("render").arg(&job).arg("--out").arg(folder.path().join("out"));
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let start = Instant::now();
        let status = command.status().context("a process of this program cannot be started")?;
        let seconds = start.elapsed().as_secs_f64();
        if status.success() { Ok(seconds) } else { bail!("`skyduct render` failed") }
    };
    Ok(Quartiles::of((0..runs).map(once).collect::<Result<Vec<f64>, _>>()?))
}
