//! The validation report: closed forms, published tables and independent references against live runs.
//!
//! "Validated against" a case means: the values agree within their stated errors (deterministic ones), or within four
//! combined standard errors (random ones). The cases modelled on CIE 171 have references recomputed from closed forms.

mod interior;
mod reference;
mod scenes;
mod skies;
mod tubes;

use std::path::Path;

use crate::output::OutputError;
use crate::reports::page::{Check, Figure, Report, ReportError, Section, Table};

#[derive(Debug, thiserror::Error)]
pub enum ValidationError {
    #[error("{file}: {reason}")]
    Reference { file: String, reason: String },
    #[error(transparent)]
    Run(#[from] ReportError),
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
pub fn run(reference: &Path, progress: impl Fn(&str)) -> Result<Report, ValidationError> {
    type Run = fn(&Path) -> Result<Section, ValidationError>;
    let sections: [(&str, Run); 5] = [
        ("Skies and sun", skies::section),
        ("Tubes", tubes::section),
        ("Interiors: cases modelled on CIE 171", interior::section),
        ("The thesis' room", scenes::thesis),
        ("Whole scenes", scenes::section),
    ];
    let sections = sections.into_iter().map(|(title, run)| {
        progress(title);
        Ok(Section { title: title.to_owned(), ..run(reference)? })
    });
    let sections: Vec<Section> = sections.collect::<Result<_, ValidationError>>()?;
    let introduction = introduction(&sections);
    Ok(Report { name: "validation", title: "Validation", introduction, sections })
}

fn introduction(sections: &[Section]) -> String {
    let checks = || sections.iter().flat_map(|section| &section.checks);
    let compared: usize = checks().map(|check| check.compared).sum();
    let failed = checks().filter(|check| !check.passed()).count();
    format!(
        "skyduct {} validated against closed forms, published tables and independent programs. `skyduct validate` runs\n\
         every case anew and writes this page; nothing in it is typed by hand. {compared} comparisons in {} checks, of\n\
         which {failed} failed. \"Validated against\" means: deterministic values agree within the stated error of the\n\
         reference, random ones within the stated number of standard errors.",
        env!("CARGO_PKG_VERSION"),
        checks().count(),
    )
}
