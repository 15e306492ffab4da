//! Page of a report: sections with checks, tables and figures.

use skyduct::document::DocumentErrors;
use skyduct::engine::passes::RenderError;
use skyduct::output::OutputError;

/// Page of a report with its figures.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Name of the page without `.md`, and of the folder of its figures.
    pub name: &'static str,
    pub title: &'static str,
    /// Introduction of one or more paragraphs.
    pub introduction: String,
    pub sections: Vec<Section>,
}

/// Section of a report.
#[derive(Clone, Debug, Default)]
pub struct Section {
    pub title: String,
    /// Text that states what is compared with what.
    pub text: String,
    pub checks: Vec<Check>,
    pub tables: Vec<Table>,
    pub figures: Vec<Figure>,
    /// Text that states the conclusions of the section; may be empty.
    pub conclusion: String,
}

/// Set of comparisons with its largest deviation.
#[derive(Clone, Debug)]
pub struct Check {
    pub name: String,
    pub compared: usize,
    /// Largest deviation, in the unit of `limit`.
    pub worst: f64,
    pub limit: f64,
    pub unit: &'static str,
}

impl Check {
    pub fn passed(&self) -> bool {
        self.worst <= self.limit
    }
}

/// Table of a report.
#[derive(Clone, Debug)]
pub struct Table {
    pub caption: String,
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// Formats a value with its standard error to a number of decimals: `0.8712 (s.e. 0.0004)`.
pub fn with_standard_error(value: f64, error: f64, decimals: usize) -> String {
    format!("{value:.decimals$} (s.e. {error:.decimals$})")
}

/// Figure of a report.
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
