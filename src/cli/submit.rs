//! `skyduct submit`: posts jobs to a service, follows them, and downloads their results.

use std::path::{Component, Path, PathBuf};

use anyhow::{Context, bail};
use serde::Deserialize;
use serde_json::Value;
use uuid::Uuid;

use crate::cli::client::{Client, News, Uploaded};
use crate::cli::figures::FiguresArgs;
use crate::cli::mesh_files::MeshFiles;
use crate::cli::progress::Progress;
use crate::cli::render::read_job;
use crate::cli::results_table::print_results;
use crate::document::read::json;
use crate::document::{DocumentErrors, FieldError};
use crate::estimate::StopRule;
use crate::present::convergence_files::convergence_names;
use crate::present::outputs::{Annual, Output, annual_outputs, result_outputs};
use crate::present::report::REPORT;
use crate::present::saved_files::SavedFigures;
use crate::queue::events::{EventData, Pass, Phase};

#[derive(Debug, clap::Args)]
pub struct SubmitArgs {
    /// Job documents (JSON); their meshes may be files at or below their folders. Several are queued together or not at all
    #[arg(value_name = "JOB.json", required = true)]
    pub jobs: Vec<PathBuf>,
    /// Address of the service
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8080")]
    pub server: String,
    /// Folder for the results; of several documents each has a folder there, named like its file
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Let the service try every method before, for less than 0.2 s of each processor beside the set-up of the planned one, and draw
    /// the predicted times beside the actual ones; of a single document only
    #[arg(long)]
    pub predict: bool,
    #[command(flatten)]
    pub figures: FiguresArgs,
}

/// Submits jobs and saves their results. Errors of documents are [`DocumentErrors`].
pub fn run(args: SubmitArgs) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let client = Client::new(&args.server)?;
        if let [job] = args.jobs.as_slice() {
            let document = read_job(job)?;
            let folder = job.parent().unwrap_or(Path::new(""));
            let figures = &args.figures.saved;
            let job = submit_and_download(&client, document, Some(folder), args.predict, &args.out, figures).await?;
            say_done(&job, &args.out);
            return Ok(());
        }
        if args.predict {
            bail!("--predict is for a single document");
        }
        submit_together(&client, &args).await
    })
}

fn say_done(job: &Value, out: &Path) {
    eprintln!("job {} is done; results are in {}", job["id"].as_str().unwrap_or("?"), out.display());
    print_results(job);
}

/// Submits several documents as one set, and saves the results of each below a folder of its own.
async fn submit_together(client: &Client, args: &SubmitArgs) -> anyhow::Result<()> {
    let mut documents = Vec::with_capacity(args.jobs.len());
    let mut folders: Vec<PathBuf> = Vec::with_capacity(args.jobs.len());
    for job in &args.jobs {
        let name = job.file_stem().with_context(|| format!("{} has no name of a file", job.display()))?;
        let out = args.out.join(name);
        if folders.contains(&out) {
            bail!("two documents are named {}, and so would be their folders", Path::new(name).display());
        }
        folders.push(out);
        let folder = job.parent().unwrap_or(Path::new(""));
        let document = with_uploaded_files(client, read_job(job)?, folder).await;
        let read = document.and_then(|document| Ok(json::value(&document).map_err(DocumentErrors::from)?));
        documents.push(read.map_err(|error| in_files(error, |pointer| Some((job, pointer))))?);
    }
    let request = serde_json::to_vec(&serde_json::json!({ "jobs": documents }))?;
    let set = client.submit("/v1/job_sets", request, &Uuid::new_v4().to_string()).await;
    let set = set.map_err(|error| in_files(error, |pointer| of_set(pointer, &args.jobs)))?;
    let links: Vec<&str> =
        set["jobs"].as_array().into_iter().flatten().filter_map(|job| job["link"].as_str()).collect();
    if links.len() != folders.len() {
        bail!("the service's answer has {} jobs, but {} were posted", links.len(), folders.len());
    }
    // a job that fails keeps no other from its results
    let mut failed = Vec::new();
    for ((link, out), file) in links.into_iter().zip(&folders).zip(&args.jobs) {
        match follow_and_download(client, client.json(link).await?, out, &args.figures.saved).await {
            Ok(job) => say_done(&job, out),
            Err(error) => failed.push(format!("{}: {error:#}", file.display())),
        }
    }
    if failed.is_empty() { Ok(()) } else { bail!("{}", failed.join("; ")) }
}

/// Names files in the errors of their documents: `file_of` finds the file of an error by its pointer, and the pointer in that file.
fn in_files<'a>(
    error: anyhow::Error,
    file_of: impl for<'p> Fn(&'p str) -> Option<(&'a Path, &'p str)>,
) -> anyhow::Error {
    let named = |error: FieldError| match file_of(&error.pointer) {
        Some((file, pointer)) => FieldError {
            pointer: pointer.to_owned(),
            detail: format!("{} (in {})", error.detail, file.display()),
            ..error
        },
        None => error,
    };
    match error.downcast::<DocumentErrors>() {
        Ok(DocumentErrors(errors)) => DocumentErrors(errors.into_iter().map(named).collect()).into(),
        Err(other) => other,
    }
}

/// Finds the document that an error of a set of documents is in, by a pointer that begins with `/jobs/INDEX`.
fn of_set<'a, 'p>(pointer: &'p str, files: &'a [PathBuf]) -> Option<(&'a Path, &'p str)> {
    let rest = pointer.strip_prefix("/jobs/")?;
    let (index, rest) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
    Some((files.get(index.parse::<usize>().ok()?)?, rest))
}

/// Uploads the meshes, posts the document (with `predict` asking for predicted times), follows the job and writes its results
/// below `out`; returns the job.
pub async fn submit_and_download(
    client: &Client,
    document: Vec<u8>,
    mesh_folder: Option<&Path>,
    predict: bool,
    out: &Path,
    figures: &SavedFigures,
) -> anyhow::Result<Value> {
    let document = match mesh_folder {
        Some(folder) => with_uploaded_files(client, document, folder).await?,
        None => document,
    };
    let path = if predict { "/v1/jobs?predict=true" } else { "/v1/jobs" };
    let job = client.submit(path, document, &Uuid::new_v4().to_string()).await?;
    follow_and_download(client, job, out, figures).await
}

/// Follows a job to its end and writes its results below `out`; returns the job as it is then.
async fn follow_and_download(client: &Client, job: Value, out: &Path, figures: &SavedFigures) -> anyhow::Result<Value> {
    let path = job["links"]["self"].as_str().context("the service's answer has no path of the job")?.to_owned();
    let events =
        job["links"]["events"].as_str().context("the service's answer has no path of the job's events")?.to_owned();
    let progress = Progress::new(stop_rule(&job)?);
    let last = client.follow(&events, |news| match news {
        News::Event(event) => {
            if event.name == "pass"
                && let Ok(pass) = Pass::deserialize(&event.data)
            {
                progress.pass_done(&pass.report, &pass.forecast);
            }
            if event.name == Phase::NAME {
                progress.phase("adding up the hours of the year");
            }
        }
        News::Lost => progress.note("connection lost, reconnecting"),
        News::Back(event) => match event.data["passes"].as_u64() {
            Some(passes) => progress.note(&format!("reconnected at pass {passes}")),
            None => progress.note("back"),
        },
    });
    let last = last.await;
    progress.finish();
    let last = last?;
    if last.name == "failed" {
        let detail = last.data["problem"]["detail"].as_str().unwrap_or("the service gave no reason");
        bail!("the job failed: {detail}");
    }
    let job = client.json(&path).await?;
    download(client, &job, out, figures).await?;
    if last.name == "cancelled" {
        bail!("the job was cancelled; the results so far are in {}", out.display());
    }
    Ok(job)
}

/// Returns the document with file names of meshes, models and weather replaced by the ids of the uploaded files.
async fn with_uploaded_files(client: &Client, document: Vec<u8>, folder: &Path) -> anyhow::Result<Vec<u8>> {
    // faults of the document are reported by the service
    let Ok(mut value) = serde_json::from_slice::<Value>(&document) else { return Ok(document) };
    let tubes = (0..value["tubes"].as_array().map_or(0, Vec::len)).map(|index| format!("/tubes/{index}/mesh"));
    let objects =
        (0..value["room"]["objects"].as_array().map_or(0, Vec::len)).map(|index| format!("/room/objects/{index}/mesh"));
    let files = MeshFiles::below(folder);
    let mut replaced = false;
    let weather =
        (0..value["annual"]["weather"].as_array().map_or(0, Vec::len)).map(|file| format!("/annual/weather/{file}"));
    let weather = weather.chain(["/annual/weather".to_owned()]);
    let others = value["annual"]["other_daylight"].as_array().map_or(0, Vec::len);
    let others = (0..others).map(|other| format!("/annual/other_daylight/{other}/file"));
    let model = ["/room/hbjson".to_owned()];
    for pointer in tubes.chain(objects).chain(weather).chain(others).chain(model).collect::<Vec<_>>() {
        let Some(field) = value.pointer_mut(&pointer) else { continue };
        let Some(name) = field.as_str() else { continue };
        // any other name is an id, or refused by the service
        let Ok(file) = files.path(name) else { continue };
        let bytes = std::fs::read(&file)
            .map_err(|error| bad_document(&pointer, format!("{} cannot be read: {error}", file.display())))?;
        let kind = match pointer.as_str() {
            "/room/hbjson" => Uploaded::Model,
            pointer if pointer.starts_with("/annual/weather") => Uploaded::Weather,
            pointer if pointer.starts_with("/annual") => Uploaded::Array,
            _ => Uploaded::Mesh,
        };
        *field = client.upload(kind, bytes, &pointer).await?.into();
        replaced = true;
    }
    // written anew only if it changed: otherwise the service gets the very bytes of the file
    if replaced { Ok(serde_json::to_vec(&value)?) } else { Ok(document) }
}

fn bad_document(pointer: &str, detail: String) -> DocumentErrors {
    FieldError::new(pointer, detail).into()
}

async fn download(client: &Client, job: &Value, out: &Path, figures: &SavedFigures) -> anyhow::Result<()> {
    // a job that was cancelled before its first pass has no other files
    if job["progress"]["passes"].as_u64() == Some(0) {
        return write(out, "result.json", &serde_json::to_vec_pretty(job)?);
    }
    let this = job["links"]["self"].as_str().context("the service's answer has no path of the job")?;
    let names = |outputs: &str| -> Vec<&str> {
        let outputs = job["document"][outputs].as_array().into_iter().flatten();
        outputs.filter_map(|output| output["name"].as_str()).collect()
    };
    let tubes = job["document"]["tubes"].as_array().map_or(0, Vec::len);
    let surfaces = job["document"]["surfaces"] == true;
    let mut outputs = result_outputs(names("grids"), names("views"), tubes, surfaces);
    outputs.extend(job["links"]["meshes"].is_string().then_some(Output::Meshes));
    if job["document"]["annual"].is_object() {
        let dimming = job["document"]["annual"]["dimming"].is_object();
        outputs.extend(annual_outputs(names("grids"), dimming));
    }
    for output in outputs.into_iter().filter(|output| figures.has(output)) {
        let file = output.file();
        let path = match &output {
            Output::Grid(grid, format) => format!("grids/{grid}?format={}", format.suffix()),
            Output::FalseColours(view, format) => format!("views/{view}.{}?style=false_colour", format.suffix()),
            Output::Annual(Annual::Summary, _) => "annual".to_owned(),
            Output::View(..) | Output::Tube(..) | Output::Annual(..) | Output::Surfaces(_) | Output::Meshes => {
                file.clone()
            }
        };
        write(out, &file, &client.bytes(&format!("{this}/{path}")).await?)?;
    }
    for (name, links) in job["links"]["figures"].as_object().into_iter().flatten() {
        for format in figures.formats() {
            let suffix = format.suffix();
            let path = links[suffix].as_str().context("the service's answer has no path of a figure")?;
            write(out, &format!("figures/{name}.{suffix}"), &client.bytes(path).await?)?;
        }
    }
    let report = figures.has_report().then(|| REPORT.to_owned());
    for file in report.into_iter().chain(convergence_names(figures.formats())) {
        write(out, &file, &client.bytes(&format!("{this}/{file}")).await?)?;
    }
    // last, as in `render`: once it exists, all other files do
    write(out, "result.json", &serde_json::to_vec_pretty(job)?)
}

/// Writes a file below `out`; an error if its name, which comes from the service, leads elsewhere.
fn write(out: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let relative = Path::new(name);
    if !relative.components().all(|component| matches!(component, Component::Normal(_))) {
        bail!("the service named a file outside the output folder: {name:?}");
    }
    let file = out.join(relative);
    let folder = file.parent().unwrap_or(out);
    std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be created", folder.display()))?;
    std::fs::write(&file, bytes).with_context(|| format!("{} cannot be written", file.display()))
}

/// Returns the stop rule of the job, for the progress bar.
fn stop_rule(job: &Value) -> anyhow::Result<StopRule> {
    let stop = &job["document"]["stop"];
    let number =
        |name: &str| stop[name].as_f64().with_context(|| format!("the service's answer has no stop.{name} of the job"));
    Ok(StopRule {
        relative_error: number("relative_error")?,
        view_relative_error: number("view_relative_error")?,
        confidence: number("confidence")?,
        max_passes: number("max_passes")? as u64,
        max_seconds: number("max_seconds")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mesh_files_stay_below_the_folder() {
        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path().join("jobs");
        std::fs::create_dir_all(folder.join("meshes")).unwrap();
        std::fs::write(folder.join("meshes/a.obj"), "x").unwrap();
        std::fs::write(directory.path().join("secret.obj"), "x").unwrap();
        std::os::unix::fs::symlink(directory.path().join("secret.obj"), folder.join("link.obj")).unwrap();
        assert!(MeshFiles::below(&folder).path("meshes/a.obj").is_ok());
        assert!(MeshFiles::below(&folder).path("./meshes/a.obj").is_ok());
        for name in ["../secret.obj", "link.obj", "meshes", "none.obj", "", "/etc/hostname", "meshes/../../secret.obj"]
        {
            assert!(MeshFiles::below(&folder).path(name).is_err(), "{name}");
        }
    }

    #[test]
    fn results_stay_below_the_folder() {
        let directory = tempfile::tempdir().unwrap();
        write(directory.path(), "grids/a.json", b"1").unwrap();
        for name in ["../a", "/tmp/a", "grids/../../a"] {
            assert!(write(directory.path(), name, b"1").is_err(), "{name}");
        }
    }
}
