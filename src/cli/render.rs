//! `skyduct render`: renders a job without a server.

use std::fs::File;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use anyhow::{Context, bail};
use serde_json::{Map, Value, json};
use tokio::signal::unix::{SignalKind, signal};

use super::figures::FiguresArgs;
use super::mesh_files::MeshFiles;
use super::predictions_table::predictions_table;
use super::progress::Progress;
use super::results_table::print_results;
use super::year_table::print_year;
use crate::document::read::json as read_json;
use crate::document::{DocumentErrors, FieldError};
use crate::engine::cancel::{Stop, StopReason};
use crate::engine::convergence::is_kept;
use crate::engine::memory::default_limit_bytes;
use crate::engine::passes::{Rendered, warm_up};
use crate::engine::progress::{PassReport, StoppedBy};
use crate::predict::forecast::Forecast;
use crate::predict::pilot;
use crate::present::prepared::{Prepared, prepare};
use crate::present::reader::ResultReader as _;
use crate::present::saved_files::{Saved, SavedFigures, results};

#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    /// Job document (JSON); its meshes may be files at or below its folder
    #[arg(value_name = "JOB.json")]
    pub job: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Method to use instead of the document's
    #[arg(long, value_name = "M")]
    pub method: Option<String>,
    /// Try every method before, for less than 0.2 s of each processor beside the set-up of the planned one, print the predicted time
    /// of each, and draw it beside the actual one
    #[arg(long)]
    pub predict: bool,
    /// Weather file (EPW or WEA) of a year of daylight, in place of the document's sky or of the file that it names
    #[arg(long, value_name = "FILE")]
    pub weather: Option<PathBuf>,
    #[command(flatten)]
    pub figures: FiguresArgs,
}

/// Renders a job and writes its results. Errors of the document are [`DocumentErrors`].
pub fn run(args: RenderArgs) -> anyhow::Result<()> {
    warm_up();
    let document = with_weather(with_method(read_job(&args.job)?, args.method.as_deref()), args.weather.as_deref());
    let mut prepared = prepare(&document, &MeshFiles::beside(&args.job).with_weather(args.weather))?;
    prepared.check_memory(default_limit_bytes())?;
    for warning in &prepared.warnings {
        eprintln!("warning: {}: {}", warning.code, warning.detail);
    }
    if args.predict {
        let predictions = pilot::predict(&prepared, &AtomicBool::new(false));
        eprintln!("{}", predictions_table(&predictions).trim_matches('\n'));
        prepared.foretell(predictions);
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("{} cannot be created", args.out.display()))?;

    let stop = cancel_on_interrupt()?;
    let (rendered, passes) = std::thread::scope(|scope| {
        scope.spawn(|| prepared.look_ahead());
        render(&prepared, &stop)
    })?;
    let result = write_results(&args.out, &prepared, &rendered, &passes, &args.figures.saved)?;
    let Rendered { estimate, spent, stopped_by } = &rendered;
    if *stopped_by == StoppedBy::Cancelled {
        bail!("cancelled after {} passes; the results so far are in {}", estimate.passes, args.out.display());
    }
    eprintln!(
        "{} passes in {:.2} s, stopped by {}; results are in {}",
        estimate.passes,
        spent.seconds,
        stopped_by.name(),
        args.out.display()
    );
    for warning in prepared.render_warnings(estimate) {
        eprintln!("warning: {}: {}", warning.code, warning.detail);
    }
    print_results(&result);
    if let Some(year) = prepared.results(estimate).year()? {
        print_year(&year.summary());
    }
    Ok(())
}

/// Reads a job file as text in UTF-8.
pub fn read_job(job: &Path) -> Result<Vec<u8>, DocumentErrors> {
    let bytes = std::fs::read(job).map_err(|error| {
        let detail = format!("{} cannot be read: {error}", job.display());
        FieldError::new("", detail)
    })?;
    Ok(read_json::text(&bytes)?.into_owned().into_bytes())
}

/// Returns the document with changed fields; one that is not a JSON object is returned unchanged, for the parser to refuse.
fn changed(document: Vec<u8>, change: impl FnOnce(&mut Map<String, Value>)) -> Vec<u8> {
    match serde_json::from_slice::<Value>(&document) {
        Ok(Value::Object(mut fields)) => {
            change(&mut fields);
            Value::Object(fields).to_string().into_bytes()
        }
        _ => document,
    }
}

/// Returns the document with another method.
fn with_method(document: Vec<u8>, method: Option<&str>) -> Vec<u8> {
    match method {
        Some(method) => changed(document, |fields| drop(fields.insert("method".to_owned(), method.into()))),
        None => document,
    }
}

/// Returns the document with a year by a weather file. Its fields of a year stay; sky, time and views are removed.
fn with_weather(document: Vec<u8>, weather: Option<&Path>) -> Vec<u8> {
    let Some(weather) = weather else { return document };
    changed(document, |fields| {
        if !fields.contains_key("annual") {
            for other in ["sky", "time", "location", "views"] {
                fields.remove(other);
            }
        }
        let annual = fields.entry("annual").or_insert_with(|| json!({}));
        if let Some(annual) = annual.as_object_mut() {
            annual.insert("weather".to_owned(), weather.to_string_lossy().into());
        }
    })
}

/// Renders chunk after chunk until the job is done or cancelled; returns the reports of all passes, too.
fn render(prepared: &Prepared, stop: &Stop) -> anyhow::Result<(Rendered, Vec<PassReport>)> {
    let progress = Progress::new(prepared.stop);
    let (mut forecaster, mut forecast) = (prepared.forecaster(), Forecast::default());
    let mut passes = Vec::new();
    let rendered = prepared.render_on_pool(stop, &mut |report, so_far| {
        if is_kept(report.passes) {
            forecast = forecaster.after(report, so_far.waiting_for);
        }
        progress.pass_done(report, &forecast);
        passes.push(*report);
    })?;
    progress.finish();
    if let Some(reason) = prepared.no_results(rendered.stopped_by, &rendered.estimate) {
        bail!(reason);
    }
    Ok((rendered, passes))
}

/// Returns a token that is cancelled by the first interrupt (or termination) signal; the second exits the process.
pub fn cancel_on_interrupt() -> anyhow::Result<Stop> {
    let stop = Stop::default();
    let interrupted = stop.clone();
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().context("cannot listen for signals")?;
    std::thread::spawn(move || {
        runtime.block_on(async {
            while next_interrupt().await.is_ok() {
                if interrupted.reason() == Some(StopReason::Cancelled) {
                    std::process::exit(1);
                }
                interrupted.raise(StopReason::Cancelled);
            }
        });
    });
    Ok(stop)
}

async fn next_interrupt() -> std::io::Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::select! {
        interrupt = tokio::signal::ctrl_c() => interrupt,
        _ = terminate.recv() => Ok(()),
    }
}

/// Writes the files of the job, and `result.json` last: once it exists, all other files do. Returns its content.
fn write_results(
    out: &Path,
    prepared: &Prepared,
    rendered: &Rendered,
    passes: &[PassReport],
    figures: &SavedFigures,
) -> anyhow::Result<Value> {
    let (estimate, result) = (&rendered.estimate, results(prepared, rendered));
    // a job that was cancelled before its first pass has no results
    if estimate.passes > 0 {
        // the passes that the service keeps of the same job
        let is_last = |pass: &PassReport| pass.passes == estimate.passes;
        let passes: Vec<_> = passes.iter().filter(|pass| is_kept(pass.passes) || is_last(pass)).copied().collect();
        let saved = Saved { reader: prepared.results(estimate), passes: &passes, results: &result };
        saved.files(figures, |name, bytes| write(out, name, bytes))?;
    }
    write(out, "result.json", &serde_json::to_vec_pretty(&result)?)?;
    Ok(result)
}

/// Writes a file below a folder. An existing file is overwritten in place: truncating it first would free its space on the
/// disk, which takes time on some disks.
pub fn write(out: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let file = out.join(name);
    let folder = file.parent().unwrap_or(out);
    let open = || File::options().write(true).create(true).truncate(false).open(&file);
    let opened = match open() {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be created", folder.display()))?;
            open()
        }
        opened => opened,
    };
    let written = opened.and_then(|mut opened| {
        opened.write_all(bytes)?;
        // truncated only if it was longer
        if opened.metadata()?.len() > bytes.len() as u64 { opened.set_len(bytes.len() as u64) } else { Ok(()) }
    });
    written.with_context(|| format!("{} cannot be written", file.display()))
}

#[cfg(test)]
mod tests {

    use super::*;

    #[test]
    fn the_method_is_replaced_in_objects_only() {
        let changed =
            with_method(br#"{"method": {"kind": "sppm"}, "seed": 18446744073709551615}"#.to_vec(), Some("auto"));
        let changed: Value = serde_json::from_slice(&changed).unwrap();
        assert_eq!(changed, json!({ "method": "auto", "seed": u64::MAX }));
        assert_eq!(with_method(b"[".to_vec(), Some("auto")), b"[");
        assert_eq!(with_method(b"{ }".to_vec(), None), b"{ }");
    }

    #[test]
    fn job_files_in_other_encodings() {
        let folder = tempfile::tempdir().unwrap();
        let job = folder.path().join("job.json");
        let text = "\u{feff}{\"name\": \"\u{e9}\"}";
        for bytes in [text.as_bytes().to_vec(), text.encode_utf16().flat_map(u16::to_be_bytes).collect()] {
            std::fs::write(&job, bytes).unwrap();
            let document = read_job(&job).unwrap();
            assert_eq!(document, "{\"name\": \"\u{e9}\"}".as_bytes());
            let changed: Value = serde_json::from_slice(&with_method(document, Some("auto"))).unwrap();
            assert_eq!(changed, json!({ "name": "\u{e9}", "method": "auto" }));
        }
        std::fs::write(&job, b"PK\x03\x04").unwrap();
        assert!(read_job(&job).unwrap_err().to_string().contains("ZIP"));
    }

    #[test]
    fn nothing_is_left_of_a_file_that_is_written_over() {
        let folder = tempfile::tempdir().unwrap();
        for content in ["a long text", "short", "a longer text than before", ""] {
            write(folder.path(), "some/folder/file", content.as_bytes()).unwrap();
            assert_eq!(std::fs::read_to_string(folder.path().join("some/folder/file")).unwrap(), content);
        }
    }
}
