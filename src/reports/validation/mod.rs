//! Validation report: closed forms, published formulae and independent references against live runs.
//!
//! "Validated against" a case means: the values agree within their stated errors (deterministic ones), or within four
//! combined standard errors (random ones). The cases modelled on CIE 171 have references recomputed from closed forms.

mod deviations;
mod error;
mod interior;
mod published;
mod reference;
mod scenes;
mod skies;
mod tubes;

use std::path::Path;

use crate::page::{Report, Section};

pub use error::ValidationError;

/// Runs all cases with the references in the folder `reference`; `progress` is called with the title of each section before it
/// runs.
pub fn run(reference: &Path, progress: impl Fn(&str)) -> Result<Report, ValidationError> {
    type Run = fn(&Path) -> Result<Section, ValidationError>;
    let sections: [(&str, Run); 6] = [
        ("Skies and sun", skies::section),
        ("Tubes", tubes::section),
        ("Interiors: cases modelled on CIE 171", interior::section),
        ("The thesis' room", scenes::thesis),
        ("Whole scenes", scenes::section),
        ("Published and measured numbers", published::section),
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
        "skyduct {} validated against closed forms, published formulae and independent programs. `cargo run --release -p skyduct-reports -- validate` runs\n\
         every case anew and writes this page; nothing in it is typed by hand. {compared} comparisons in {} checks, of\n\
         which {failed} failed. \"Validated against\" means: deterministic values agree within the stated error of the\n\
         reference, random ones within the stated number of standard errors, s.e. for short.",
        skyduct::VERSION,
        checks().count(),
    )
}
