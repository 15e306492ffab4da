//! Files of a study: JSON, CSV, a table in text and a figure.

use std::fmt::Write as _;

use serde::Serialize;
use utoipa::ToSchema;

use super::outcome::{Cell, Refused, RenderedReference, Run, Study};
use super::request::StudyRequest;
use crate::VERSION;
use crate::figure::curves::{Series, logarithmic};
use crate::figure::ticks::{duration, significant};
use crate::figure::{Drawing, FigureFormat, Heading};
use crate::output::OutputError;

/// Result of a study.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct StudyReport {
    /// Reference that the runs are compared with.
    pub reference: ReferenceReport,
    /// Confidence of relative errors and intervals.
    pub confidence: f64,
    /// Conclusions, as a paragraph of text.
    pub verdict: String,
    /// Runs grouped by method and error.
    pub cells: Vec<Cell>,
    /// Methods that cannot compute the job.
    pub refused: Vec<Refused>,
    /// Runs that gave values.
    pub runs: Vec<Run>,
}

/// Reference that the runs of a study are compared with.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct ReferenceReport {
    /// Methods that computed the reference; null if its values were given.
    pub method: Option<String>,
    /// Seconds of rendering the reference; null if its values were given.
    pub seconds: Option<f64>,
    /// Root mean square of the reference's relative standard errors; null if none are available.
    pub relative_standard_error: Option<f64>,
}

/// File with a study's request and result.
#[derive(Serialize)]
struct StudyFile<'a> {
    request: &'a StudyRequest,
    #[serde(flatten)]
    report: StudyReport,
}

impl Study {
    /// Returns the result of the study.
    pub fn report(&self) -> StudyReport {
        let of = |reference: &RenderedReference| (reference.method.clone(), reference.seconds);
        let (method, seconds) = self.reference.as_ref().map(of).unzip();
        StudyReport {
            reference: ReferenceReport { method, seconds, relative_standard_error: self.reference_error() },
            confidence: self.confidence,
            verdict: self.verdict(),
            cells: self.cells(),
            refused: self.refused.clone(),
            runs: self.runs.clone(),
        }
    }

    /// Returns a table of the runs, grouped by method and error, as CSV with one line for each group.
    pub fn csv(&self) -> String {
        let mut text =
            "method,asked_relative_error,cpu_seconds,cpu_seconds_lower,cpu_seconds_upper,seconds,reported_relative_error,\
                        actual_relative_error,covered,met,cheapest\n"
                .to_owned();
        let or_empty = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        for cell in self.cells() {
            let Cell { method, asked, cpu_seconds, seconds, reported, actual, covered, met, cheapest, .. } = cell;
            // writing to a string cannot fail
            let _ = writeln!(
                text,
                "{method},{asked},{},{},{},{},{},{actual},{},{met},{cheapest}",
                cpu_seconds.median,
                cpu_seconds.lower,
                cpu_seconds.upper,
                seconds.median,
                or_empty(reported),
                or_empty(covered)
            );
        }
        text
    }

    /// Returns a table of processor seconds by method and accuracy as text for a terminal: `*` marks the cheapest method, `-` an
    /// error that was not reached.
    pub fn table(&self) -> String {
        let cells = self.cells();
        let mut errors: Vec<f64> = cells.iter().map(|cell| cell.asked).collect();
        errors.sort_by(|a, b| b.total_cmp(a));
        errors.dedup();
        let mut methods: Vec<&str> = Vec::new();
        for cell in &cells {
            if !methods.contains(&cell.method.as_str()) {
                methods.push(&cell.method);
            }
        }
        let mut rows = vec![std::iter::once("processor seconds to reach".to_owned()).collect::<Vec<_>>()];
        rows[0].extend(errors.iter().map(|error| format!("{} %", significant(100.0 * error, 2))));
        for method in methods {
            let mut row = vec![method.to_owned()];
            row.extend(errors.iter().map(|error| {
                let cell = cells.iter().find(|cell| cell.method == method && cell.asked == *error);
                let mark = |cell: &Cell| if cell.cheapest { " *" } else { "" };
                let met = cell.filter(|cell| cell.met);
                met.map_or("-".to_owned(), |cell| format!("{}{}", duration(cell.cpu_seconds.median, 3), mark(cell)))
            }));
            rows.push(row);
        }
        let columns = errors.len() + 1;
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut text = String::new();
        for row in &rows {
            let line: Vec<String> = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
            let _ = writeln!(text, "{}", line.join("  ").trim_end());
        }
        text
    }

    /// Returns the actual error in percent over processor seconds: a line for each method, in the order of processor seconds.
    pub fn series(&self) -> Vec<Series> {
        let mut series: Vec<Series> = Vec::new();
        for cell in self.cells() {
            let point = (cell.cpu_seconds.median, 100.0 * cell.actual);
            match series.iter_mut().find(|series| series.name == cell.method) {
                Some(series) => series.line.push(point),
                None => series.push(Series { name: cell.method, line: vec![point], ..Series::default() }),
            }
        }
        for series in &mut series {
            series.line.sort_by(|a, b| a.0.total_cmp(&b.0));
            series.marks.clone_from(&series.line);
        }
        series
    }

    /// Returns the figure of the study's series over two logarithmic axes.
    pub fn figure(&self, name: Option<&str>) -> Drawing {
        let words = |method: &str| method.replace('_', " ");
        let series: Vec<Series> =
            self.series().into_iter().map(|one| Series { name: words(&one.name), ..one }).collect();
        let of = name.map_or(String::new(), |name| format!(": {name}"));
        let reference = match &self.reference {
            Some(reference) => format!("reference by {}", words(&reference.method)),
            None => "given reference".to_owned(),
        };
        let error =
            self.reference_error().map_or("unknown".to_owned(), |error| format!("{} %", significant(100.0 * error, 2)));
        let reference = format!("{reference}, standard error {error}");
        let title = format!("Error against time{of}");
        let heading = Heading { title, lines: vec![reference], origin: format!("skyduct {VERSION}") };
        logarithmic(
            &heading,
            &series,
            "processor seconds",
            "actual error in percent, root mean square over the sensors",
        )
    }

    /// Returns all files of the study, as names and contents.
    pub fn files(&self, request: &StudyRequest) -> Result<Vec<(String, Vec<u8>)>, OutputError> {
        let figure = self.figure(request.job["name"].as_str());
        // our own types always serialise
        let json = serde_json::to_value(StudyFile { request, report: self.report() }).unwrap_or_default();
        let mut json = json.to_string().into_bytes();
        json.push(b'\n');
        let mut files = vec![("study.json".to_owned(), json), ("study.csv".to_owned(), self.csv().into_bytes())];
        for format in FigureFormat::ALL {
            files.push((format!("study.{}", format.suffix()), format.write(&figure)?));
        }
        Ok(files)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::super::outcome::tests::run;
    use super::*;

    fn study() -> Study {
        let mut late = run("b", 0.01, 9.0, 0.02);
        late.met = false;
        let runs = vec![run("a", 0.05, 0.25, 0.025), run("b", 0.05, 0.5, 0.02), run("a", 0.01, 1.0, 0.005), late];
        Study { runs, ..Study::default() }
    }

    #[test]
    fn the_table_has_a_row_for_each_method() {
        let table = study().table();
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines.len(), 3);
        assert!(
            lines[0].ends_with("1.0 %") && lines[1].starts_with("a ") && lines[1].matches('*').count() == 2,
            "{table}"
        );
        assert!(lines[2].starts_with("b ") && lines[2].ends_with('-'), "{table}");
    }

    #[test]
    fn the_figure_has_words_for_methods() {
        let study = Study { runs: vec![run("path_tracing", 0.05, 0.25, 0.025)], ..Study::default() };
        let figure = study.figure(None);
        assert!(figure.texts().any(|text| text == "path tracing"), "{:?}", figure.texts().collect::<Vec<_>>());
    }

    #[test]
    fn files_are_whole() {
        let request = StudyRequest::new(json!({ "name": "room" }), vec!["a".to_owned()]);
        let files = study().files(&request).unwrap();
        let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["study.json", "study.csv", "study.svg", "study.png", "study.pdf"]);
        let json: Value = serde_json::from_slice(&files[0].1).unwrap();
        assert_eq!((json["cells"].as_array().unwrap().len(), json["runs"].as_array().unwrap().len()), (4, 4));
        let csv = String::from_utf8(files[1].1.clone()).unwrap();
        assert!(csv.lines().count() == 5 && csv.lines().all(|line| line.split(',').count() == 11), "{csv}");
        let svg = String::from_utf8(files[2].1.clone()).unwrap();
        assert!(svg.contains("Error against time: room"), "{svg}");
    }
}
