//! The validation report: closed forms, published tables and independent references against live runs.
//!
//! "Validated against" a case means: the values agree within their stated errors (deterministic ones), or within four
//! combined standard errors (random ones). The cases modelled on CIE 171 have references recomputed from closed forms.

mod interior;
mod markdown;
mod reference;
mod run;
mod scenes;
mod skies;
mod tubes;

use std::path::Path;

use crate::document::DocumentErrors;
use crate::job::run::RenderError;
use crate::output::OutputError;

pub use markdown::write;

/// One subject of the report.
#[derive(Clone, Debug, Default)]
pub struct Section {
    pub title: String,
    /// What is compared with what.
    pub text: String,
    pub checks: Vec<Check>,
    pub tables: Vec<Table>,
    pub figures: Vec<Figure>,
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

/// A table of the report.
#[derive(Clone, Debug)]
pub struct Table {
    pub caption: String,
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// A figure of the report.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of the file, without folder.
    pub file: &'static str,
    pub caption: String,
    pub svg: String,
}

#[derive(Debug, thiserror::Error)]
pub enum ValidationError {
    #[error("{file}: {reason}")]
    Reference { file: String, reason: String },
    #[error("a document of the report was refused: {0}")]
    Document(#[from] DocumentErrors),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Plot(#[from] OutputError),
}

/// Deviations collected into one check.
struct Deviations {
    name: String,
    compared: usize,
    worst: f64,
}

impl Deviations {
    fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), compared: 0, worst: 0.0 }
    }

    /// `deviation` of any sign; one that is not a number counts as infinite.
    fn add(&mut self, deviation: f64) {
        self.compared += 1;
        self.worst = if deviation.is_nan() { f64::INFINITY } else { self.worst.max(deviation.abs()) };
    }

    fn check(self, limit: f64, unit: &'static str) -> Check {
        let Self { name, compared, worst } = self;
        Check { name, compared, worst, limit, unit }
    }
}

/// Runs all cases with the references in the folder `reference`; `progress` hears the title of each section before it
/// runs.
pub fn run(reference: &Path, progress: impl Fn(&str)) -> Result<Vec<Section>, ValidationError> {
    type Run = fn(&Path) -> Result<Section, ValidationError>;
    let sections: [(&str, Run); 5] = [
        ("Skies and sun", skies::section),
        ("Tubes", tubes::section),
        ("Interiors: cases modelled on CIE 171", interior::section),
        ("The thesis' room", scenes::thesis),
        ("Whole scenes", scenes::section),
    ];
    sections
        .into_iter()
        .map(|(title, run)| {
            progress(title);
            Ok(Section { title: title.to_owned(), ..run(reference)? })
        })
        .collect()
}
