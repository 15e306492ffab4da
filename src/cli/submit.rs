//! `skyduct submit`: posts a job to a service, follows it, downloads what it computed.

use std::path::{Component, Path, PathBuf};

use anyhow::{Context, bail};
use serde::Deserialize;
use serde_json::Value;
use uuid::Uuid;

use crate::cli::client::Client;
use crate::cli::mesh_files::MeshFiles;
use crate::cli::progress::Progress;
use crate::document::{DocumentErrors, FieldError};
use crate::estimate::StopRule;
use crate::job::run::PassReport;

#[derive(Debug, clap::Args)]
pub struct SubmitArgs {
    /// Job document (JSON); its meshes may be files at or below its folder
    #[arg(value_name = "JOB.json")]
    pub job: PathBuf,
    /// Address of the service
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8080")]
    pub server: String,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Errors that are the document's own are [`DocumentErrors`].
pub fn run(args: SubmitArgs) -> anyhow::Result<()> {
    let document = std::fs::read(&args.job)
        .map_err(|error| bad_document("", format!("{} cannot be read: {error}", args.job.display())))?;
    let folder = args.job.parent().unwrap_or(Path::new("")).to_owned();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let client = Client::new(&args.server)?;
        let job = submit_and_download(&client, document, Some(&folder), &args.out).await?;
        println!("job {} is done; results are in {}", job["id"].as_str().unwrap_or("?"), args.out.display());
        Ok(())
    })
}

/// Uploads the meshes, posts the document, follows the job and writes its results below `out`; answers the job.
pub async fn submit_and_download(
    client: &Client,
    document: Vec<u8>,
    mesh_folder: Option<&Path>,
    out: &Path,
) -> anyhow::Result<Value> {
    let document = match mesh_folder {
        Some(folder) => with_uploaded_meshes(client, document, folder).await?,
        None => document,
    };
    let job = client.submit(document, &Uuid::new_v4().to_string()).await?;
    let path = job["links"]["self"].as_str().context("the service gave the job no path")?.to_owned();
    let events = job["links"]["events"].as_str().context("the service gave the job no events")?.to_owned();
    let progress = Progress::new(stop_rule(&job)?);
    let last = client.follow(&events, |event| {
        if event.name == "pass"
            && let Ok(report) = PassReport::deserialize(&event.data)
        {
            progress.pass_done(&report);
        }
    });
    let last = last.await;
    progress.finish();
    let last = last?;
    if last.name == "failed" {
        let detail = last.data["problem"]["detail"].as_str().unwrap_or("the service gave no reason");
        bail!("the job failed: {detail}");
    }
    let job = client.json(&path).await?;
    download(client, &job, out).await?;
    if last.name == "cancelled" {
        bail!("the job was cancelled; what it had computed is in {}", out.display());
    }
    Ok(job)
}

/// The document with file names of meshes replaced by the ids of the uploaded files.
async fn with_uploaded_meshes(client: &Client, document: Vec<u8>, folder: &Path) -> anyhow::Result<Vec<u8>> {
    // what is wrong with a document is for the service to say
    let Ok(mut value) = serde_json::from_slice::<Value>(&document) else { return Ok(document) };
    let tubes = (0..value["tubes"].as_array().map_or(0, Vec::len)).map(|index| format!("/tubes/{index}/mesh"));
    let objects =
        (0..value["room"]["objects"].as_array().map_or(0, Vec::len)).map(|index| format!("/room/objects/{index}/mesh"));
    let files = MeshFiles::below(folder);
    let mut replaced = false;
    for pointer in tubes.chain(objects).collect::<Vec<_>>() {
        let Some(field) = value.pointer_mut(&pointer) else { continue };
        let Some(name) = field.as_str() else { continue };
        // any other name is an id, or for the service to refuse
        let Ok(file) = files.path(name) else { continue };
        let bytes = std::fs::read(&file)
            .map_err(|error| bad_document(&pointer, format!("{} cannot be read: {error}", file.display())))?;
        *field = client.upload_mesh(bytes, &pointer).await?.into();
        replaced = true;
    }
    // written anew only when needed: the service then judges the very bytes of the file
    if replaced { Ok(serde_json::to_vec(&value)?) } else { Ok(document) }
}

fn bad_document(pointer: &str, detail: String) -> DocumentErrors {
    DocumentErrors(vec![FieldError { pointer: pointer.to_owned(), detail }])
}

async fn download(client: &Client, job: &Value, out: &Path) -> anyhow::Result<()> {
    write(out, "result.json", &serde_json::to_vec_pretty(job)?)?;
    // a job that was cancelled before its first pass has no files
    if job["progress"]["passes"].as_u64() == Some(0) {
        return Ok(());
    }
    for (name, path) in entries(&job["links"]["grids"]) {
        let path = path.as_str().context("a grid has no path")?;
        for format in ["json", "csv"] {
            let bytes = client.bytes(&format!("{path}?format={format}")).await?;
            write(out, &format!("grids/{name}.{format}"), &bytes)?;
        }
    }
    for (name, paths) in entries(&job["links"]["views"]) {
        for (link, suffix) in [("exr", "exr"), ("png", "png"), ("false_colour_png", "false_colour.png")] {
            let path = paths[link].as_str().context("a view has no path")?;
            write(out, &format!("views/{name}.{suffix}"), &client.bytes(path).await?)?;
        }
    }
    for (tube, paths) in job["links"]["tubes"].as_array().into_iter().flatten().enumerate() {
        for suffix in ["json", "svg"] {
            let path = paths[suffix].as_str().context("a tube has no path")?;
            write(out, &format!("tubes/{tube}.{suffix}"), &client.bytes(path).await?)?;
        }
    }
    Ok(())
}

fn entries(links: &Value) -> impl Iterator<Item = (&String, &Value)> {
    links.as_object().into_iter().flatten()
}

/// Writes below `out`; the name comes from the service and must not lead elsewhere.
fn write(out: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let relative = Path::new(name);
    if !relative.components().all(|component| matches!(component, Component::Normal(_))) {
        bail!("the service named a file {name:?}");
    }
    let file = out.join(relative);
    let folder = file.parent().unwrap_or(out);
    std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    std::fs::write(&file, bytes).with_context(|| format!("{} cannot be written", file.display()))
}

/// The job's limits, for the progress bar.
fn stop_rule(job: &Value) -> anyhow::Result<StopRule> {
    let stop = &job["document"]["stop"];
    let number = |name: &str| stop[name].as_f64().with_context(|| format!("the service gave the job no stop.{name}"));
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
