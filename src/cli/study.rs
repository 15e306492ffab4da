//! `skyduct study`: measures the cost of accuracy by several methods on one job.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use serde_json::Value;

use super::mesh_files::MeshFiles;
use super::render::{cancel_on_interrupt, read_job, write};
use super::study_progress::StudyProgress;
use crate::document::{DocumentErrors, FieldError, method};
use crate::engine::cancel::{Stop, StopReason};
use crate::study::StudyRequest;
use crate::study::picture_request::{PictureRequest, PicturesWanted, ten_five_two_and_one_percent};
use crate::study::pictures::PICTURES_JSON;
use crate::study::reference::ReferenceRequest;
use crate::study::run::{Step, StudyError, run as run_study, run_pictures};

#[derive(Debug, clap::Args)]
pub struct StudyArgs {
    /// Job document (JSON) whose grids are studied; its meshes may be files at or below its folder
    #[arg(value_name = "JOB.json")]
    job: PathBuf,
    /// Folder for study.json, study.csv and the figures
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Names of methods, separated by commas; all methods by default
    #[arg(long, value_delimiter = ',', value_name = "M,M")]
    methods: Vec<String>,
    /// Relative errors to stop at, separated by commas; 0.05, 0.02 and 0.01 by default, for pictures also 0.1
    #[arg(long, value_delimiter = ',', value_name = "E,E")]
    errors: Vec<f64>,
    /// Number of runs of each method to each error
    #[arg(long, value_name = "N", default_value_t = 3)]
    seeds: u64,
    /// Method of the reference
    #[arg(long, value_name = "M", default_value = "auto")]
    reference: String,
    /// Seconds after which a run ends in any case
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    seconds: f64,
    /// Study the job's views instead of its grids: pictures by each method after equal times, and crops at each error
    #[arg(long)]
    views: bool,
    /// Seconds after which a picture of each method is taken, separated by commas
    #[arg(long, value_delimiter = ',', value_name = "S,S", default_values_t = [0.5, 2.0], requires = "views")]
    seconds_each: Vec<f64>,
}

/// Runs a study and writes its files. Errors of the document are [`DocumentErrors`].
pub fn run(args: StudyArgs) -> anyhow::Result<()> {
    let unreadable = |error| DocumentErrors::from(FieldError::new("", format!("not JSON: {error}")));
    let job: Value = serde_json::from_slice(&read_job(&args.job)?).map_err(unreadable)?;
    let methods = match args.methods.is_empty() {
        true => method::names().map(str::to_owned).collect(),
        false => args.methods.clone(),
    };
    std::fs::create_dir_all(&args.out).with_context(|| format!("{} cannot be created", args.out.display()))?;
    let progress = StudyProgress::new();
    let told =
        if args.views { of_views(&args, job, methods, &progress) } else { of_grids(&args, job, methods, &progress) };
    progress.finish();
    println!("{}", told?);
    Ok(())
}

/// Studies the grids, writes the files, and returns the table with its verdict. The file of the table is rewritten after each
/// run.
fn of_grids(args: &StudyArgs, job: Value, methods: Vec<String>, progress: &StudyProgress) -> anyhow::Result<String> {
    let mut request = StudyRequest {
        seeds: args.seeds,
        reference: ReferenceRequest { method: Some(args.reference.clone()), ..ReferenceRequest::default() },
        seconds: args.seconds,
        ..StudyRequest::new(job, methods)
    };
    if !args.errors.is_empty() {
        request = request.to(args.errors.clone());
    }
    let stop = cancel_on_interrupt()?;
    let mut growing = Growing { out: &args.out, file: None, written: Ok(()), stop: &stop };
    let mut heard = |step: &Step<'_>| {
        // runs that are reported as done are in the file
        if let Some(study) = step.so_far.study().filter(|study| !study.runs.is_empty()) {
            growing.write("study.csv", study.csv().as_bytes());
        }
        progress.step(step);
    };
    let study = run_study(&request, &MeshFiles::beside(&args.job), &stop, &mut heard);
    let study = growing.ended(study)?;
    for (name, bytes) in study.files(&request)? {
        write(&args.out, &name, &bytes)?;
    }
    let refused = study.refused.iter().map(|refused| format!("\n{}: {}", refused.method, refused.reason));
    Ok(format!("{}\n{}{}", study.table(), study.verdict(), refused.collect::<String>()))
}

/// Makes pictures of the views, writes the files, and returns a list of the pictures. The file of their numbers is rewritten as
/// they are made.
fn of_views(args: &StudyArgs, job: Value, methods: Vec<String>, progress: &StudyProgress) -> anyhow::Result<String> {
    let relative_errors = match args.errors.as_slice() {
        [] => ten_five_two_and_one_percent(),
        errors => errors.to_vec(),
    };
    let wanted = PicturesWanted { seconds: args.seconds_each.clone(), relative_errors };
    let request = PictureRequest::new(job, methods, wanted, args.seconds, Some(&args.reference));
    let stop = cancel_on_interrupt()?;
    let mut growing = Growing { out: &args.out, file: None, written: Ok(()), stop: &stop };
    let mut heard = |step: &Step<'_>| {
        // the reference alone is no picture
        if let Some(json) = step.so_far.pictures_json(&request).filter(|_| step.done > 1) {
            growing.write(PICTURES_JSON, &json);
        }
        progress.step(step);
    };
    let pictures = run_pictures(&request, &MeshFiles::beside(&args.job), &stop, &mut heard);
    let pictures = growing.ended(pictures)?;
    let entries = pictures.outcomes.pictures(&request).into_iter();
    let told = entries.map(|picture| format!("{} {}\n", picture.view, picture.title()));
    let refused = pictures.outcomes.refused.iter().map(|refused| format!("{}: {}\n", refused.method, refused.reason));
    let told = told.chain(refused).collect();
    for (name, bytes) in pictures.files(&request)? {
        write(&args.out, &name, &bytes)?;
    }
    Ok(told)
}

/// File that is rewritten after each run.
struct Growing<'a> {
    out: &'a Path,
    /// Name of the file, once it has been written.
    file: Option<String>,
    /// Result of the last write; a failure cancels the study.
    written: anyhow::Result<()>,
    stop: &'a Stop,
}

impl Growing<'_> {
    fn write(&mut self, name: &str, bytes: &[u8]) {
        self.written = write(self.out, name, bytes);
        match self.written {
            Ok(()) => self.file = Some(name.to_owned()),
            Err(_) => self.stop.raise(StopReason::Cancelled),
        }
    }

    /// Returns the result of the study; the error of a study that was cut short names the file with the runs so far.
    fn ended<T>(self, study: Result<T, StudyError>) -> anyhow::Result<T> {
        self.written?;
        study.map_err(|error| match (&error, self.file) {
            (StudyError::Cancelled { .. } | StudyError::Render(_), Some(file)) => {
                anyhow!("{error}; the results so far are in {}", self.out.join(file).display())
            }
            _ => of_document(error),
        })
    }
}

/// Converts an error; errors of the document become [`DocumentErrors`].
fn of_document(error: StudyError) -> anyhow::Error {
    match error {
        StudyError::Document(errors) => errors.into(),
        error => error.into(),
    }
}
