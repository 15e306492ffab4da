//! `skyduct study`: what accuracy costs by several methods on one job.

use std::path::PathBuf;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

use super::mesh_files::MeshFiles;
use super::render::{cancel_on_interrupt, read_job, write};
use crate::document::{DocumentErrors, FieldError, method};
use crate::study::StudyRequest;
use crate::study::picture_request::{PictureRequest, PicturesWanted, ten_five_two_and_one_percent};
use crate::study::reference::ReferenceRequest;
use crate::study::run::{Step, StudyError, run as run_study};
use crate::study::views;

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
    /// Relative errors to stop at, with commas; 0.05, 0.02 and 0.01 by default, of pictures 0.1, too
    #[arg(long, value_delimiter = ',', value_name = "E,E")]
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
    /// Study the job's views in place of its grids: pictures by each method after the same time, and crops at each error
    #[arg(long)]
    views: bool,
    /// Seconds after which each method shows a picture, with commas
    #[arg(long, value_delimiter = ',', value_name = "S,S", default_values_t = [0.5, 2.0], requires = "views")]
    seconds_each: Vec<f64>,
}

/// Runs a study and writes its files; errors that are the document's own are [`DocumentErrors`].
pub fn run(args: StudyArgs) -> anyhow::Result<()> {
    let unreadable = |error| DocumentErrors::from(FieldError::new("", format!("no JSON: {error}")));
    let job: Value = serde_json::from_slice(&read_job(&args.job)?).map_err(unreadable)?;
    let methods = match args.methods.is_empty() {
        true => method::names().map(str::to_owned).collect(),
        false => args.methods.clone(),
    };
    let bar = ProgressBar::new(1);
    if let Ok(style) = ProgressStyle::with_template("{bar:32} {pos}/{len} {msg}") {
        bar.set_style(style);
    }
    let heard = |done: usize, of: usize, next: &str| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
        bar.set_message(next.to_owned());
    };
    std::fs::create_dir_all(&args.out).with_context(|| format!("{} cannot be made", args.out.display()))?;
    let told = if args.views { of_views(&args, job, methods, heard)? } else { of_grids(&args, job, methods, heard)? };
    bar.finish_and_clear();
    println!("{told}");
    Ok(())
}

/// Studies the grids, writes the files, and says what follows.
fn of_grids(
    args: &StudyArgs,
    job: Value,
    methods: Vec<String>,
    heard: impl Fn(usize, usize, &str),
) -> anyhow::Result<String> {
    let mut request = StudyRequest {
        seeds: args.seeds,
        reference: ReferenceRequest { method: Some(args.reference.clone()), ..ReferenceRequest::default() },
        seconds: args.seconds,
        ..StudyRequest::new(job, methods)
    };
    if !args.errors.is_empty() {
        request = request.to(args.errors.clone());
    }
    let mut heard = |step: &Step| heard(step.done, step.of, &step.next);
    let study = run_study(&request, &MeshFiles::beside(&args.job), &cancel_on_interrupt()?, &mut heard);
    let study = study.map_err(of_document)?;
    for (name, bytes) in study.files(&request)? {
        write(&args.out, &name, &bytes)?;
    }
    let refused = study.refused.iter().map(|refused| format!("\n{}: {}", refused.method, refused.reason));
    Ok(format!("{}\n{}{}", study.table(), study.verdict(), refused.collect::<String>()))
}

/// Makes pictures of the views, writes the files, and says what they are.
fn of_views(
    args: &StudyArgs,
    job: Value,
    methods: Vec<String>,
    heard: impl Fn(usize, usize, &str),
) -> anyhow::Result<String> {
    let relative_errors = match args.errors.as_slice() {
        [] => ten_five_two_and_one_percent(),
        errors => errors.to_vec(),
    };
    let wanted = PicturesWanted { seconds: args.seconds_each.clone(), relative_errors };
    let request = PictureRequest::new(job, methods, wanted, args.seconds, Some(&args.reference));
    let mut heard = |done: usize, of: usize, next: &str| heard(done, of, next);
    let pictures = views::run(&request, &MeshFiles::beside(&args.job), &cancel_on_interrupt()?, &mut heard);
    let pictures = pictures.map_err(of_document)?;
    for (name, bytes) in pictures.files(&request)? {
        write(&args.out, &name, &bytes)?;
    }
    let told = pictures.pictures.iter().map(|picture| format!("{} {}\n", picture.view, picture.title()));
    let refused = pictures.refused.iter().map(|refused| format!("{}: {}\n", refused.method, refused.reason));
    Ok(told.chain(refused).collect::<String>())
}

/// Errors of the document are the document's own.
fn of_document(error: StudyError) -> anyhow::Error {
    match error {
        StudyError::Document(errors) => errors.into(),
        error => error.into(),
    }
}
