//! Files that `render`, `submit` and `demo` save of a job: all numbers and pictures of views, and its figures in the requested formats.

use std::str::FromStr;

use bytes::Bytes;
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use serde_json::{Value, json};

use super::convergence_files::convergence_files;
use super::outputs::Output;
use super::reader::{Estimated, ResultReader, failed};
use super::report::{OVERVIEW, REPORT, report};
use super::site_figure::{SiteFigure, site_figure};
use crate::engine::passes::{RenderError, Rendered};
use crate::engine::progress::{PassReport, StoppedBy};
use crate::figure::pdf::pdf;
use crate::figure::{Drawing, FigureFormat};
use crate::present::prepared::Prepared;

/// Formats in which figures are saved, written as `svg,png,pdf`, or as `none`. SVG costs a tenth of the others.
///
/// ```
/// use skyduct::present::saved_files::SavedFigures;
///
/// let figures: SavedFigures = "pdf,svg".parse().unwrap();
/// assert!(figures.formats().map(|format| format.suffix()).eq(["svg", "pdf"]) && figures.has_report());
/// assert_eq!("none".parse::<SavedFigures>().unwrap().formats().count(), 0);
/// assert!("svg,gif".parse::<SavedFigures>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedFigures {
    /// Formats, in the order of [`FigureFormat::ALL`].
    formats: Vec<FigureFormat>,
}

impl SavedFigures {
    /// Formats that commands save by default.
    pub const USUAL: &str = "svg";
}

impl FromStr for SavedFigures {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names: Vec<&str> = if text == "none" { Vec::new() } else { text.split(',').collect() };
        let known = FigureFormat::ALL;
        match names.iter().find(|name| known.iter().all(|format| format.suffix() != **name)) {
            Some(unknown) => Err(format!(
                "{unknown:?} is not a format of figures: give svg, png or pdf, separated by commas, or none"
            )),
            None => Ok(Self { formats: known.into_iter().filter(|format| names.contains(&format.suffix())).collect() }),
        }
    }
}

impl SavedFigures {
    /// Returns the formats, each once.
    pub fn formats(&self) -> impl Iterator<Item = FigureFormat> {
        self.formats.iter().copied()
    }

    /// True if a file of the results is saved: all but figures in formats that are not requested.
    pub fn has(&self, output: &Output) -> bool {
        output.figure().is_none_or(|format| self.formats.contains(&format))
    }

    /// True if the report is saved.
    pub fn has_report(&self) -> bool {
        self.formats.contains(&FigureFormat::Pdf)
    }
}

/// Returns a rendered job as the service would: its document, its plan and its results.
pub fn results(prepared: &Prepared, Rendered { estimate, spent, stopped_by }: &Rendered) -> Value {
    let status = if *stopped_by == StoppedBy::Cancelled { "cancelled" } else { "succeeded" };
    let mut results = prepared.summary_json(estimate, *spent, *stopped_by);
    results["document"] = prepared.document.clone();
    results["status"] = status.into();
    results["stopped_by"] = json!(stopped_by);
    results["plan"] = prepared.plan_json();
    results["warnings"] = json!(prepared.warnings);
    if let Some(predictions) = &prepared.predictions {
        results["predictions"] = json!(predictions);
    }
    results
}

/// Job with results, from which its files are made.
#[derive(Clone, Copy)]
pub struct Saved<'a> {
    /// Results of all its passes.
    pub reader: Estimated<'a>,
    /// Passes that are reported.
    pub passes: &'a [PassReport],
    /// Results as [`results`] returns them.
    pub results: &'a Value,
}

/// Files that are made from one drawing, or a single file.
enum Part {
    Result(Output),
    Site(SiteFigure),
    Convergence,
    Report,
}

impl Saved<'_> {
    /// Makes all files but `result.json`, in parallel on the current pool, and hands each with its name to `save`.
    pub fn files<E>(&self, figures: &SavedFigures, save: impl Fn(&str, &[u8]) -> Result<(), E> + Sync) -> Result<(), E>
    where
        E: From<RenderError> + Send,
    {
        let results = self.reader.prepared.outputs().into_iter().filter(|output| figures.has(output));
        let results = results.map(Part::Result);
        let site = SiteFigure::of_job(&self.results["document"], self.results).into_iter().map(Part::Site);
        // what takes longest first
        let parts: Vec<Part> = site.chain([Part::Report, Part::Convergence]).chain(results).collect();
        // on all threads, and not under a lock for which one of them would wait that takes part in it
        self.reader.year()?;
        parts.into_par_iter().with_max_len(1).try_for_each(|part| {
            let files = self.make(part, figures)?;
            files.iter().try_for_each(|(name, bytes)| save(name, bytes))
        })
    }

    fn make(&self, part: Part, figures: &SavedFigures) -> Result<Vec<(String, Bytes)>, RenderError> {
        let subject = self.reader.subject();
        Ok(match part {
            Part::Result(output) => {
                self.reader.file(&output)?.map(|file| (file.name, file.bytes)).into_iter().collect()
            }
            Part::Site(figure) => match site_figure(figure, subject, self.results) {
                Some(drawing) => drawn(&figure.name(), &drawing, figures)?,
                None => Vec::new(),
            },
            Part::Convergence => convergence_files(subject, self.passes, figures.formats())?,
            Part::Report => {
                let sheet = report(&self.reader, self.results, None, self.reader.subject().origin.clone())?;
                let mut files = drawn(OVERVIEW, &sheet.overview(), figures)?;
                if figures.has_report() {
                    let pdf = pdf(&sheet.draw());
                    files.push((REPORT.to_owned(), pdf.map_err(|error| failed(REPORT, error))?.into()));
                }
                files
            }
        })
    }
}

/// Writes a figure of the job in each format.
fn drawn(name: &str, drawing: &Drawing, figures: &SavedFigures) -> Result<Vec<(String, Bytes)>, RenderError> {
    let written = figures.formats().map(|format| {
        let name = format!("figures/{name}.{}", format.suffix());
        let bytes = format.write(drawing).map_err(|error| failed(&name, error))?;
        Ok((name, bytes.into()))
    });
    written.collect()
}
