//! `skyduct study`: what accuracy costs by several methods on one job.

use std::path::PathBuf;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

use super::mesh_files::MeshFiles;
use super::render::{cancel_on_interrupt, read_job, write};
use crate::document::{DocumentErrors, FieldError, method};
use crate::study::StudyRequest;
use crate::study::reference::ReferenceRequest;
use crate::study::run::{Step, StudyError, run as run_study};

#[derive(Debug, clap::Args)]
pub struct StudyArgs {
    /// Job document (JSON) whose grids are studied; its meshes may be files at or below its folder
    #[arg(value_name = "JOB.json")]
    job: PathBuf,
    /// Folder for study.json, study.csv and the figures
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Methods by name, with commas; all that there are by default
    #[arg(long, value_delimiter = ',', value_name = "M,M")]
    methods: Vec<String>,
    /// Relative errors to stop at, with commas
    #[arg(long, value_delimiter = ',', value_name = "E,E", default_values_t = [0.05, 0.02, 0.01])]
    errors: Vec<f64>,
    /// Runs of each method to each error
    #[arg(long, value_name = "N", default_value_t = 3)]
    seeds: u64,
    /// Method of the reference
    #[arg(long, value_name = "M", default_value = "auto")]
    reference: String,
    /// Seconds after which a run ends in any case
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    seconds: f64,
}

/// Runs a study and writes its files; errors that are the document's own are [`DocumentErrors`].
pub fn run(args: StudyArgs) -> anyhow::Result<()> {
    let unreadable = |error| DocumentErrors::from(FieldError::new("", format!("no JSON: {error}")));
    let job: Value = serde_json::from_slice(&read_job(&args.job)?).map_err(unreadable)?;
    let methods = match args.methods.is_empty() {
        true => method::names().map(str::to_owned).collect(),
        false => args.methods,
    };
    let request = StudyRequest {
        seeds: args.seeds,
        reference: ReferenceRequest { method: Some(args.reference), ..ReferenceRequest::default() },
        seconds: args.seconds,
        ..StudyRequest::new(job, methods).to(args.errors)
    };
    let bar = ProgressBar::new(1);
    if let Ok(style) = ProgressStyle::with_template("{bar:32} {pos}/{len} {msg}") {
        bar.set_style(style);
    }
    let mut heard = |step: &Step| {
        bar.set_length(step.of as u64);
        bar.set_position(step.done as u64);
        bar.set_message(step.next.clone());
    };
    let study = run_study(&request, &MeshFiles::beside(&args.job), &cancel_on_interrupt()?, &mut heard);
    bar.finish_and_clear();
    let study = match study {
        Err(StudyError::Document(errors)) => return Err(errors.into()),
        study => study?,
    };
    std::fs::create_dir_all(&args.out).with_context(|| format!("{} cannot be made", args.out.display()))?;
    for (name, bytes) in study.files(&request)? {
        write(&args.out, &name, &bytes)?;
    }
    println!("{}\n{}", study.table(), study.verdict());
    for refused in &study.refused {
        println!("{}: {}", refused.method, refused.reason);
    }
    Ok(())
}
