//! A page of a report: sections with checks, tables and figures.

use skyduct::document::DocumentErrors;
use skyduct::job::passes::RenderError;
use skyduct::output::OutputError;

/// A page and its figures.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Name of the page without `.md`, and of the folder of its figures.
    pub name: &'static str,
    pub title: &'static str,
    /// Introduction of one or more paragraphs.
    pub introduction: String,
    pub sections: Vec<Section>,
}

/// One subject of a report.
#[derive(Clone, Debug, Default)]
pub struct Section {
    pub title: String,
    /// Text that says what is compared with what.
    pub text: String,
    pub checks: Vec<Check>,
    pub tables: Vec<Table>,
    pub figures: Vec<Figure>,
    /// Text that says what follows from the section; may be empty.
    pub conclusion: String,
}

/// A set of comparisons.
#[derive(Clone, Debug)]
pub struct Check {
    pub name: String,
    pub compared: usize,
    /// The largest deviation, in the unit of `limit`.
    pub worst: f64,
    pub limit: f64,
    pub unit: &'static str,
}

impl Check {
    pub fn passed(&self) -> bool {
        self.worst <= self.limit
    }
}

/// A table of a report.
#[derive(Clone, Debug)]
pub struct Table {
    pub caption: String,
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// A value with its standard error, in `decimals`: `0.8712 (s.e. 0.0004)`.
pub fn with_standard_error(value: f64, error: f64, decimals: usize) -> String {
    format!("{value:.decimals$} (s.e. {error:.decimals$})")
}

/// A figure of a report.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of the file, without folder.
    pub file: &'static str,
    pub caption: String,
    /// Content of an SVG or PNG file.
    pub bytes: Vec<u8>,
}

impl Report {
    pub fn checks(&self) -> impl Iterator<Item = &Check> {
        self.sections.iter().flat_map(|section| &section.checks)
    }
}

#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    #[error("a document of the report was refused: {0}")]
    Document(#[from] DocumentErrors),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{0}")]
    Case(String),
}
