//! Files that `render`, `submit` and `demo` save of a job: all numbers and pictures of views, and its figures in the requested formats.

use std::str::FromStr;

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use serde_json::{Value, json};

use super::convergence_files::convergence_files;
use super::report::{OVERVIEW, made_by, report};
use super::results::{GridFormat, Output, TubeFormat, ViewFormat, failed};
use super::site_figure::{SiteFacts, SiteFigure, site_figure};
use crate::engine::passes::{RenderError, Rendered};
use crate::engine::progress::{PassReport, StoppedBy};
use crate::estimate::Estimate;
use crate::figure::{Drawing, FigureFormat};
use crate::present::prepared::Prepared;

/// Name of the file with the report on one sheet, which is saved with figures as PDF.
pub const REPORT: &str = "report.pdf";

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
    pub fn has(&self, output: Output) -> bool {
        match output {
            Output::Grid(_, GridFormat::Figure(format))
            | Output::View(_, ViewFormat::FalseColour(format))
            | Output::Tube(_, TubeFormat::Figure(format)) => self.formats.contains(&format),
            Output::Grid(_, GridFormat::Json | GridFormat::Csv)
            | Output::View(_, ViewFormat::Exr | ViewFormat::Tone)
            | Output::Tube(_, TubeFormat::Json) => true,
        }
    }

    /// True if the report on one sheet is saved.
    pub fn has_report(&self) -> bool {
        self.formats.contains(&FigureFormat::Pdf)
    }
}

/// Returns a rendered job as the service would: its document, its plan and its results.
pub fn results(prepared: &Prepared, Rendered { estimate, spent, stopped_by }: &Rendered) -> Value {
    let status = if *stopped_by == StoppedBy::Cancelled { "cancelled" } else { "succeeded" };
    let mut results = json!({
        "document": prepared.document,
        "status": status,
        "stopped_by": stopped_by,
        "plan": prepared.plan_json(),
        "warnings": prepared.warnings,
    });
    if let Some(predictions) = &prepared.predictions {
        results["predictions"] = json!(predictions);
    }
    if let (Value::Object(results), Value::Object(summary)) =
        (&mut results, prepared.summary_json(estimate, *spent, *stopped_by))
    {
        results.extend(summary);
    }
    results
}

/// Job with results, from which its files are made.
#[derive(Clone, Copy)]
pub struct Saved<'a> {
    /// Prepared job.
    pub prepared: &'a Prepared,
    /// Estimate of all its passes.
    pub estimate: &'a Estimate,
    /// Passes that are reported.
    pub passes: &'a [PassReport],
    /// Results as [`results`] returns them.
    pub results: &'a Value,
}

/// Files that are made from one drawing, or a single file.
enum Part {
    Result(String, Output),
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
        let results = self.prepared.outputs().into_iter().filter(|(_, output)| figures.has(*output));
        let results = results.map(|(name, output)| Part::Result(name, output));
        let site = SiteFigure::of_job(&self.results["document"], self.results).into_iter().map(Part::Site);
        let facts = SiteFacts::of(self.results);
        // what takes longest first
        let parts: Vec<Part> = site.chain([Part::Report, Part::Convergence]).chain(results).collect();
        parts.into_par_iter().with_max_len(1).try_for_each(|part| {
            let files = self.make(part, &facts, figures)?;
            files.iter().try_for_each(|(name, bytes)| save(name, bytes))
        })
    }

    fn make(
        &self,
        part: Part,
        facts: &SiteFacts,
        figures: &SavedFigures,
    ) -> Result<Vec<(String, Vec<u8>)>, RenderError> {
        let subject = self.prepared.subject();
        Ok(match part {
            Part::Result(name, output) => {
                let file = self.prepared.make(name, output, self.estimate)?;
                vec![(file.name, file.bytes)]
            }
            Part::Site(figure) => match site_figure(figure, subject, facts) {
                Some(drawing) => drawn(&figure.name(), &drawing, figures)?,
                None => Vec::new(),
            },
            Part::Convergence => convergence_files(subject, self.passes, figures.formats())?,
            Part::Report => {
                let outputs = self.prepared.first_outputs(self.estimate);
                let sheet = outputs.and_then(|outputs| report(subject, self.results, &outputs, made_by(self.results)));
                let sheet = sheet.map_err(|error| failed(REPORT, error))?;
                let mut files = drawn(OVERVIEW, &sheet.overview(), figures)?;
                if figures.has_report() {
                    let pdf = FigureFormat::Pdf.write(&sheet.draw());
                    files.push((REPORT.to_owned(), pdf.map_err(|error| failed(REPORT, error))?));
                }
                files
            }
        })
    }
}

/// Writes a figure of the job in each format.
fn drawn(name: &str, drawing: &Drawing, figures: &SavedFigures) -> Result<Vec<(String, Vec<u8>)>, RenderError> {
    let written = figures.formats().map(|format| {
        let name = format!("figures/{name}.{}", format.suffix());
        let bytes = format.write(drawing).map_err(|error| failed(&name, error))?;
        Ok((name, bytes))
    });
    written.collect()
}
