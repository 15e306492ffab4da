//! Page on the cost of accuracy by each method, and on the validity of reported errors.

use std::path::Path;

use serde_json::{Value, json};

use super::case::Case;
use super::coverage::{self, known};
use super::measure::{on_one_thread, percent, time};
use super::performance::machine;
use super::settings::{Progress, Settings};
use super::{peers, scenes};
use crate::page::{Figure, Report, ReportError, Section, Table};
use skyduct::document::method;
use skyduct::engine::cancel::Stop;
use skyduct::figure::Heading;
use skyduct::figure::curves::logarithmic;
use skyduct::figure::svg::svg;
use skyduct::study::outcome::Cell;
use skyduct::study::reference::ReferenceRequest;
use skyduct::study::run::{Step, StudyError, run as run_study};
use skyduct::study::{Study, StudyRequest};

/// Requested relative errors, at 95 % confidence.
const ASKED: [f64; 5] = [0.1, 0.05, 0.02, 0.01, 0.005];

/// Largest number of methods in a figure: the cheapest ones.
const MOST_SERIES: usize = 6;

/// Scene that is studied.
struct Subject {
    name: &'static str,
    file: &'static str,
    what: &'static str,
    case: Case,
    reference: ReferenceRequest,
}

/// Runs all studies, and counts how often the confidence intervals of jobs with up to `seeds` seeds contain the truth.
pub fn run(settings: &Settings, seeds: u64, progress: Progress) -> Result<Report, ReportError> {
    let subjects = subjects(settings)?;
    let all = subjects.len();
    let studies = progress.part(0.0, 0.6);
    let mut sections = on_one_thread(|| {
        let section = |(number, subject): (usize, &Subject)| {
            let share = |number: usize| number as f64 / all as f64;
            section(settings, subject, studies.part(share(number), share(number + 1)))
        };
        subjects.iter().enumerate().map(section).collect::<Result<Vec<_>, ReportError>>()
    })?;
    sections.push(coverage::section(settings, seeds, progress.part(0.6, 1.0))?);
    let introduction = format!(
        "What accuracy costs by each method, against references, and whether the errors that jobs report are true. \
         `cargo run --release -p skyduct-reports -- bench accuracy` measures everything anew and writes this page: \
         skyduct {}, {}. Studies run on one thread; times are processor seconds of the passes, medians of {} runs \
         with seeds of their own. A run ends after {} s in any case. Other programs were measured once: {}. `skyduct \
         study` and `POST /v1/studies` make such studies of any job.{}",
        skyduct::VERSION,
        machine(),
        settings.study_seeds(),
        settings.study_seconds(),
        peers::MEASURED,
        settings.remark()
    );
    Ok(Report {
        name: "accuracy",
        title: "What accuracy costs, and whether reported errors are true",
        introduction,
        sections,
    })
}

impl Settings {
    /// Returns the number of runs of each method to each error.
    fn study_seeds(&self) -> u64 {
        self.either(3, 2)
    }

    /// Returns the seconds after which a run of a study ends.
    fn study_seconds(&self) -> f64 {
        self.either(1.5, 0.1)
    }
}

fn subjects(settings: &Settings) -> Result<Vec<Subject>, ReportError> {
    let given = |file: &str| {
        Ok::<_, ReportError>(ReferenceRequest {
            grids: Some(vec![known(settings, file)?]),
            ..ReferenceRequest::default()
        })
    };
    let long = |method: &str, relative_error: f64| ReferenceRequest {
        method: Some(method.to_owned()),
        relative_error: Some(settings.either(relative_error, 0.02)),
        seconds: Some(settings.either(60.0, 2.0)),
        grids: None,
    };
    let stored = |name: &str| scenes::stored(settings, name);
    let mut cornell = stored("S4")?;
    cornell.document["grids"] =
        json!([{ "name": "floor", "height_m": 0.0, "cells": [9, 9], "estimate": "cell_average" }]);
    let subject = |name, file, what, case, reference| Subject { name, file, what, case, reference };
    Ok(vec![
        subject(
            "S1",
            "s1.svg",
            "The thesis' room, 81 points on the floor: a straight tube with a Lambertian diffuser under a clear sky.",
            stored("S1")?,
            given("S1.exact.point")?,
        ),
        subject(
            "S2",
            "s2.svg",
            "The same room with the sun through a clear sheet.",
            stored("S2")?,
            given("S2.exact.point")?,
        ),
        subject(
            "S3",
            "s3.svg",
            "The same room with two bends in the tube and a dome on it; the reference has its tube as a mesh.",
            stored("S3")?,
            given("S3.mesh.point")?,
        ),
        subject(
            "The Cornell box",
            "cornell.svg",
            "Averages over 9 x 9 cells of its floor, some of them below its blocks. Other programs were measured by a \
             picture of it ([performance](performance.md)), which cannot be compared with a grid.",
            cornell,
            long("path_tracing", 0.004),
        ),
        subject(
            "A furnished room",
            "furnished.svg",
            "S1 with 20 boxes between its points.",
            scenes::boxes(settings, 20)?,
            long("light_tracing", 0.001),
        ),
        subject(
            "An office with four tubes",
            "office.svg",
            "7.5 x 5 x 2.8 m with two desks, 12 x 8 points at their height, four tubes with domes under a clear sky with sun.",
            Case::beside(office(), Path::new(".")),
            long("light_tracing", 0.001),
        ),
    ])
}

fn office() -> Value {
    let tube = |x: f64, y: f64| {
        json!({ "centre_m": [x, y], "diameter_m": 0.53, "reflectance": 0.98, "segments": [{ "length_m": 1.0 }],
                "collector": { "kind": "dome", "transmittance": 0.92 }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 } })
    };
    let desk = |x: f64| json!({ "kind": "box", "size_m": [1.6, 0.8, 0.72], "position_m": [x, 2.1, 0.0], "surface": { "reflectance": 0.4 } });
    json!({
        "name": "office",
        "sky": { "cie_type": 12, "sun_position": { "altitude_deg": 40, "azimuth_deg": 160 } },
        "room": { "size_m": [7.5, 5.0, 2.8], "objects": [desk(1.2), desk(4.7)],
                  "surfaces": { "floor": { "reflectance": 0.3 }, "walls": { "reflectance": 0.5 }, "ceiling": { "reflectance": 0.8 } } },
        "tubes": [tube(1.9, 1.4), tube(1.9, 3.6), tube(5.6, 1.4), tube(5.6, 3.6)],
        "grids": [{ "name": "workplane", "height_m": 0.75, "cells": [12, 8] }],
    })
}

fn section(settings: &Settings, subject: &Subject, progress: Progress) -> Result<Section, ReportError> {
    // the method that `auto` chooses is among the others
    let methods = method::names().filter(|name| *name != "auto").map(str::to_owned).collect();
    let request = StudyRequest {
        seeds: settings.study_seeds(),
        seconds: settings.study_seconds(),
        reference: subject.reference.clone(),
        ..StudyRequest::new(subject.case.document.clone(), methods)
    };
    let request = request.to(settings.either(&ASKED[..], &ASKED[..3]).to_vec());
    let mut heard = |step: &Step| progress.step(step.done, step.of, &format!("{}: {}", subject.name, step.next));
    let study = run_study(&request, subject.case.meshes.as_ref(), &Stop::default(), &mut heard);
    let study = study.map_err(|error| match error {
        StudyError::Document(errors) => ReportError::Document(errors),
        other => ReportError::Case(format!("{}: {other}", subject.name)),
    })?;
    Ok(Section {
        title: subject.name.to_owned(),
        text: format!(
            "{} Reported errors are half-widths of 95 % intervals, actual ones root mean squares, which are about half of \
             reported errors that are true.",
            subject.what
        ),
        tables: vec![table(&study)],
        figures: vec![figure(settings, subject, &study)?],
        conclusion: study.verdict(),
        ..Section::default()
    })
}

/// Formats the table of methods by requested errors: time, reported error, actual error.
fn table(study: &Study) -> Table {
    let cells = study.cells();
    let asked: Vec<f64> = ASKED.into_iter().filter(|asked| cells.iter().any(|cell| cell.asked == *asked)).collect();
    let words = |cell: &Cell| {
        let seconds = time(cell.cpu_seconds.median);
        let seconds = match (cell.met || cell.formula, cell.cheapest) {
            (true, true) => format!("**{seconds}**"),
            (true, false) => seconds,
            (false, _) => "not met".to_owned(),
        };
        let told = cell.reported.map_or("unknown".to_owned(), percent);
        format!("{seconds}; {told}, {}", percent(cell.actual))
    };
    let mut rows: Vec<Vec<String>> = Vec::new();
    for cell in &cells {
        if rows.iter().all(|row| row[0] != cell.method) {
            let of = |asked: &f64| cells.iter().find(|other| other.method == cell.method && other.asked == *asked);
            let row = asked.iter().map(|asked| of(asked).map_or(String::new(), words));
            rows.push(std::iter::once(cell.method.clone()).chain(row).collect());
        }
    }
    Table {
        caption: "Processor time; error reported at 95 %, actual root mean square error".to_owned(),
        head: std::iter::once("method".to_owned()).chain(asked.iter().map(|asked| percent(*asked))).collect(),
        rows,
    }
}

fn figure(settings: &Settings, subject: &Subject, study: &Study) -> Result<Figure, ReportError> {
    let mut series = study.series();
    // time times squared error, a figure of merit
    let price =
        |line: &[(f64, f64)]| line.iter().map(|(seconds, error)| seconds * error * error).fold(f64::INFINITY, f64::min);
    series.sort_by(|a, b| price(&a.line).total_cmp(&price(&b.line)));
    series.truncate(MOST_SERIES);
    series.extend(peers::series(subject.name, settings.beside()));
    let heading = Heading::of(format!("{}: actual error and processor time", subject.name));
    let drawing = logarithmic(&heading, &series, "processor seconds of one core", "actual error in percent");
    let others =
        if peers::series(subject.name, settings.beside()).is_empty() { "" } else { "; dashed: other programs" };
    let caption = format!(
        "{}: actual error, root mean square over the points, against processor seconds, of the cheapest methods{others}",
        subject.name
    );
    Ok(Figure { file: subject.file, caption, bytes: svg(&drawing)?.into_bytes() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_can_be_studied() {
        let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference");
        let settings = Settings { quick: true, reference, beside: None };
        for subject in subjects(&settings).unwrap() {
            assert!(subject.case.prepare().is_ok(), "{}", subject.name);
            let request = StudyRequest {
                reference: subject.reference,
                ..StudyRequest::new(subject.case.document, vec!["auto".to_owned()])
            };
            assert_eq!(request.check(), Ok(()), "{}", subject.name);
        }
    }
}
