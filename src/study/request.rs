//! What a study is asked for, and the jobs that it is made of.

use serde::Serialize;
use serde_json::{Value, json};

use crate::document::{DocumentErrors, FieldError};

/// A study of the grids of a job; its views are left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyRequest {
    /// The job document.
    pub job: Value,
    /// Methods by the names that documents have for them.
    pub methods: Vec<String>,
    /// Relative errors to stop at, at the job's confidence, each above 0 and below 1.
    pub relative_errors: Vec<f64>,
    /// Runs of each method to each error, with seeds of their own.
    pub seeds: u64,
    /// Method of the reference.
    pub reference_method: String,
    /// Relative error of the reference, at the job's confidence.
    pub reference_relative_error: f64,
    /// Seconds after which a run ends in any case, and a tenth of those of the reference.
    pub most_seconds: f64,
}

/// Most runs of each method to each error.
pub const MOST_SEEDS: u64 = 1000;

/// How much more accurate the reference is than the most accurate run, by default.
const FINER: f64 = 4.0;

/// The reference may take so many times as long as a run.
const LONGER: f64 = 10.0;

impl StudyRequest {
    /// A study of `job` by all `methods`, which the job's own method is among where it is no other: 5, 2 and 1 percent, three
    /// seeds, a minute for each run.
    pub fn new(job: Value, methods: Vec<String>) -> Self {
        Self {
            job,
            methods,
            relative_errors: vec![0.05, 0.02, 0.01],
            seeds: 3,
            reference_method: "auto".to_owned(),
            reference_relative_error: 0.01 / FINER,
            most_seconds: 60.0,
        }
    }

    /// The same study to other errors, with a reference that is four times as accurate as the most accurate run.
    pub fn to(self, relative_errors: Vec<f64>) -> Self {
        let least = relative_errors.iter().copied().fold(f64::INFINITY, f64::min);
        Self { reference_relative_error: least / FINER, relative_errors, ..self }
    }

    /// What is wrong with the numbers of the study, if anything is; jobs are judged when they are prepared.
    pub fn check(&self) -> Result<(), DocumentErrors> {
        let mut errors = Vec::new();
        let mut refuse = |pointer: String, detail: String| errors.push(FieldError::new(pointer, detail));
        if self.methods.is_empty() {
            refuse("/methods".to_owned(), "at least one method is needed".to_owned());
        }
        if self.relative_errors.is_empty() {
            refuse("/relative_errors".to_owned(), "at least one relative error is needed".to_owned());
        }
        let errors_asked = self.relative_errors.iter().enumerate();
        for (index, error) in errors_asked.filter(|(_, error)| !(**error > 0.0 && **error < 1.0)) {
            refuse(format!("/relative_errors/{index}"), format!("must be above 0 and below 1, but is {error}"));
        }
        if !(1..=MOST_SEEDS).contains(&self.seeds) {
            refuse("/seeds".to_owned(), format!("must be within 1..{MOST_SEEDS}, but is {}", self.seeds));
        }
        if !(self.most_seconds > 0.0 && self.most_seconds.is_finite()) {
            refuse("/seconds".to_owned(), format!("must be above 0, but is {}", self.most_seconds));
        }
        if self.job["grids"].as_array().is_none_or(Vec::is_empty) {
            refuse("/job/grids".to_owned(), "a study compares grids, and the job has none".to_owned());
        }
        if errors.is_empty() { Ok(()) } else { Err(DocumentErrors(errors)) }
    }

    /// The document of a run: `seed` counts from 0.
    pub fn run(&self, method: &str, relative_error: f64, seed: u64) -> Value {
        // that of the reference is another one
        self.document(self.method(method), relative_error, self.most_seconds, seed.wrapping_add(1))
    }

    /// The document of the reference.
    pub fn reference(&self) -> Value {
        let method = self.method(&self.reference_method);
        self.document(method, self.reference_relative_error, LONGER * self.most_seconds, 0)
    }

    /// A method as the document of a run has it: with the job's own settings where it is the job's.
    fn method(&self, name: &str) -> Value {
        let own = &self.job["method"];
        if own["kind"] == name { own.clone() } else { json!(name) }
    }

    fn document(&self, method: Value, relative_error: f64, seconds: f64, seed: u64) -> Value {
        let mut document = self.job.clone();
        let confidence = document["stop"]["confidence"].take();
        let own = document["seed"].as_u64().unwrap_or(0);
        if let Some(fields) = document.as_object_mut() {
            fields.remove("views");
            fields.insert("method".to_owned(), method);
            fields.insert("seed".to_owned(), json!(own.wrapping_add(seed)));
            let mut stop = json!({ "relative_error": relative_error, "max_seconds": seconds, "max_passes": 1_000_000 });
            if let Some(stop) = stop.as_object_mut().filter(|_| !confidence.is_null()) {
                stop.insert("confidence".to_owned(), confidence);
            }
            fields.insert("stop".to_owned(), stop);
        }
        document
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request() -> StudyRequest {
        let job = json!({ "grids": [{}], "views": [{}], "seed": 5, "method": { "kind": "sppm", "photons_per_pass": 9 },
                          "stop": { "relative_error": 0.1, "confidence": 0.9, "max_passes": 3 } });
        StudyRequest::new(job, vec!["auto".to_owned(), "sppm".to_owned()])
    }

    #[test]
    fn runs_differ_in_method_error_and_seed_alone() {
        let request = request().to(vec![0.05, 0.02]);
        let run = request.run("sppm", 0.02, 1);
        let expected = json!({ "grids": [{}], "seed": 7, "method": { "kind": "sppm", "photons_per_pass": 9 },
            "stop": { "relative_error": 0.02, "confidence": 0.9, "max_seconds": 60.0, "max_passes": 1_000_000 } });
        assert_eq!(run, expected);
        assert_eq!(request.run("auto", 0.02, 1)["method"], "auto");
        let reference = request.reference();
        assert_eq!(reference["seed"], 5);
        assert_eq!(
            (&reference["stop"]["relative_error"], &reference["stop"]["max_seconds"]),
            (&json!(0.005), &json!(600.0))
        );
    }

    #[test]
    fn numbers_have_bounds() {
        let pointers = |request: &StudyRequest| -> Vec<String> {
            request.check().err().map_or(Vec::new(), |errors| errors.0.into_iter().map(|error| error.pointer).collect())
        };
        assert_eq!(pointers(&request()), [""; 0]);
        let bad = StudyRequest {
            job: json!({}),
            methods: Vec::new(),
            relative_errors: vec![0.1, 1.0, f64::NAN],
            seeds: 0,
            most_seconds: f64::INFINITY,
            ..request()
        };
        let expected = ["/methods", "/relative_errors/1", "/relative_errors/2", "/seeds", "/seconds", "/job/grids"];
        assert_eq!(pointers(&bad), expected);
    }
}
