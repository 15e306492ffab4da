//! Request for a study, and the jobs that it consists of.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use super::documents::{End, document, method_of, seed_of};
use super::picture_request::{PictureRequest, PicturesWanted};
use super::reference::ReferenceRequest;
use crate::document::errors::Checks;
use crate::document::read::shape;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, FileSource, JobDocument, MethodKind, method};

/// Study of the grids of a job: runs of each method at each relative error with each seed, compared with a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyRequest {
    /// Job document with at least one grid. Its views are left out, as is its `stop` except for the confidence; the settings of
    /// its method apply to the runs by that method.
    #[schema(value_type = JobDocument)]
    pub job: Value,
    /// Names of methods as in documents, each once; default: all methods. Methods that refuse the job are reported with their
    /// reason.
    #[serde(default = "all_methods")]
    #[schema(value_type = Vec<MethodKind>, min_items = 1)]
    pub methods: Vec<String>,
    /// Relative errors at which runs stop, at the job's confidence, each once; default: 0.05, 0.02 and 0.01.
    #[serde(default = "five_two_and_one_percent")]
    #[schema(min_items = 1)]
    pub relative_errors: Vec<f64>,
    /// Number of runs of each method at each error, each with its own seed.
    #[serde(default = "three")]
    #[schema(minimum = 1, maximum = 1000, default = 3)]
    pub seeds: u64,
    /// Reference that the runs are compared with.
    #[serde(default)]
    pub reference: ReferenceRequest,
    /// Seconds of rendering after which a run ends in any case.
    #[serde(default = "a_minute")]
    #[schema(exclusive_minimum = 0, default = 60.0)]
    pub seconds: f64,
    /// Pictures of the job's views, by each method after the same time and at several accuracies; no pictures when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pictures: Option<PicturesWanted>,
}

/// Largest number of runs of each method at each error.
pub const MOST_SEEDS: u64 = 1000;

/// Default factor by which the reference is more accurate than the most accurate run.
const FINER: f64 = 4.0;

/// Default factor by which the reference may take longer than a run.
const LONGER: f64 = 10.0;

fn all_methods() -> Vec<String> {
    method::names().map(str::to_owned).collect()
}

fn five_two_and_one_percent() -> Vec<f64> {
    vec![0.05, 0.02, 0.01]
}

fn three() -> u64 {
    3
}

fn a_minute() -> f64 {
    60.0
}

/// Key of a run among those of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunKey {
    /// Name of the requested method.
    pub method: String,
    /// Relative error at which the run stops, at the job's confidence.
    pub relative_error: f64,
    /// Number of the seed, from 0.
    pub seed: u64,
}

impl StudyRequest {
    /// Returns a study of `job` by `methods` with the default errors of 5, 2 and 1 percent, three seeds and a minute for each
    /// run. The settings of the job's own method apply to the runs by that method.
    pub fn new(job: Value, methods: Vec<String>) -> Self {
        Self {
            job,
            methods,
            relative_errors: five_two_and_one_percent(),
            seeds: three(),
            reference: ReferenceRequest::default(),
            seconds: a_minute(),
            pictures: None,
        }
    }

    /// Returns this study with other relative errors.
    pub fn to(self, relative_errors: Vec<f64>) -> Self {
        Self { relative_errors, ..self }
    }

    /// Checks a request that was read as JSON, its job included, whose room may be a model of `files`. Errors report every fault, with
    /// pointers into the request.
    pub fn from_value(value: Value, files: &dyn FileSource) -> Result<Self, DocumentErrors> {
        let mut checks = Checks::default();
        let Some((request, _)) = shape::read::<Self>(value, &mut checks) else {
            return Err(DocumentErrors(checks.errors));
        };
        let mut errors = checks.errors;
        if let Err(DocumentErrors(of_job)) = JobDocument::from_files(request.job.clone(), files) {
            let in_request = |error: FieldError| FieldError { pointer: format!("/job{}", error.pointer), ..error };
            errors.extend(of_job.into_iter().map(in_request));
        }
        if let Err(DocumentErrors(of_numbers)) = request.check() {
            errors.extend(of_numbers);
        }
        if errors.is_empty() { Ok(request) } else { Err(DocumentErrors(errors)) }
    }

    /// Limits the study to jobs of at most `most` seconds: an error if it asks for more; a reference without seconds of its own
    /// gets no more.
    pub fn within(mut self, most: f64) -> Result<Self, DocumentErrors> {
        let asked =
            [("/seconds".to_owned(), Some(self.seconds)), ("/reference/seconds".to_owned(), self.reference.seconds)];
        let of_pictures = self.pictures.iter().flat_map(|wanted| wanted.seconds.iter().enumerate());
        let of_pictures = of_pictures.map(|(index, seconds)| (format!("/pictures/seconds/{index}"), Some(*seconds)));
        let too_many = asked
            .into_iter()
            .chain(of_pictures)
            .filter_map(|(pointer, asked)| Some((pointer, asked.filter(|asked| *asked > most)?)));
        let errors: Vec<FieldError> = too_many
            .map(|(pointer, asked)| {
                let detail = format!("must be <= {most} on this service, but is {asked}");
                FieldError::new(pointer, detail).coded(FieldErrorCode::OutOfRange)
            })
            .collect();
        if !errors.is_empty() {
            return Err(DocumentErrors(errors));
        }
        if self.reference.grids.is_none() {
            self.reference.seconds.get_or_insert((LONGER * self.seconds).min(most));
        }
        Ok(self)
    }

    /// Checks the study except for its job, which is checked when it is prepared.
    pub fn check(&self) -> Result<(), DocumentErrors> {
        let mut errors = Vec::new();
        self.reference.check(&self.job, &mut errors);
        if let Some(wanted) = &self.pictures {
            wanted.check(&self.job, "/pictures", &mut errors);
        }
        let mut refuse = |code: FieldErrorCode, pointer: String, detail: String| {
            errors.push(FieldError::new(pointer, detail).coded(code));
        };
        let (bad, too_far) = (FieldErrorCode::Invalid, FieldErrorCode::OutOfRange);
        if self.methods.is_empty() {
            refuse(bad, "/methods".to_owned(), "at least one method is needed".to_owned());
        }
        let named = self.methods.iter().map(|name| ("/methods", name));
        let of_reference = self.reference.method.iter().map(|name| ("/reference/method", name));
        let mut seen = BTreeSet::new();
        for (index, (field, name)) in named.enumerate().chain(of_reference.enumerate()) {
            let pointer = if field == "/methods" { format!("{field}/{index}") } else { field.to_owned() };
            if !method::names().any(|known| known == name) {
                let known: Vec<&str> = method::names().collect();
                refuse(bad, pointer, format!("must be one of {}, but is {name:?}", known.join(", ")));
            } else if field == "/methods" && !seen.insert(name) {
                refuse(bad, pointer, format!("{name} is listed twice"));
            }
        }
        if self.relative_errors.is_empty() {
            refuse(bad, "/relative_errors".to_owned(), "at least one relative error is needed".to_owned());
        }
        for (index, error) in self.relative_errors.iter().enumerate() {
            if !(*error > 0.0 && *error < 1.0) {
                refuse(too_far, format!("/relative_errors/{index}"), format!("must be > 0 and < 1, but is {error}"));
            } else if self.relative_errors[..index].contains(error) {
                refuse(bad, format!("/relative_errors/{index}"), format!("{error} is listed twice"));
            }
        }
        if !(1..=MOST_SEEDS).contains(&self.seeds) {
            refuse(too_far, "/seeds".to_owned(), format!("must be within 1..{MOST_SEEDS}, but is {}", self.seeds));
        }
        if !(self.seconds > 0.0 && self.seconds.is_finite()) {
            refuse(too_far, "/seconds".to_owned(), format!("must be > 0, but is {}", self.seconds));
        }
        if self.job["grids"].as_array().is_none_or(Vec::is_empty) {
            refuse(bad, "/job/grids".to_owned(), "a study compares grids, and the job has none".to_owned());
        }
        if errors.is_empty() { Ok(()) } else { Err(DocumentErrors(errors)) }
    }

    /// Returns all runs by the given methods. Methods alternate, so that other load on the machine affects them alike.
    pub fn runs<'a>(&'a self, methods: &'a [String]) -> impl Iterator<Item = RunKey> + 'a {
        let errors = move |seed| self.relative_errors.iter().map(move |error| (seed, *error));
        let keys = (0..self.seeds).flat_map(errors);
        keys.flat_map(move |(seed, relative_error)| {
            methods.iter().map(move |method| RunKey { method: method.clone(), relative_error, seed })
        })
    }

    /// Returns the study's pictures as a request of their own, with no job of more than `most` seconds; `None` if none are
    /// requested.
    pub fn pictures(&self, most: f64) -> Option<PictureRequest> {
        let (methods, wanted) = (self.methods.clone(), self.pictures.clone()?);
        let reference = self.reference.method.as_deref();
        let mut request = PictureRequest::new(self.job.clone(), methods, wanted, self.seconds, reference);
        request.reference_seconds = request.reference_seconds.min(most);
        Some(request)
    }

    /// Returns the document of a run.
    pub fn run(&self, key: &RunKey) -> Value {
        self.document(method_of(&self.job, &key.method), key.relative_error, self.seconds, seed_after_reference(key))
    }

    /// Returns the seed in the document of a run.
    pub fn seed(&self, key: &RunKey) -> u64 {
        seed_of(&self.job, seed_after_reference(key))
    }

    /// Returns the document of the reference.
    pub fn reference(&self) -> Value {
        let method = method_of(&self.job, self.reference.method.as_deref().unwrap_or("auto"));
        let least = self.relative_errors.iter().copied().fold(f64::INFINITY, f64::min);
        let relative_error = self.reference.relative_error.unwrap_or(least / FINER);
        self.document(method, relative_error, self.reference.seconds.unwrap_or(LONGER * self.seconds), 0)
    }

    fn document(&self, method: Value, relative_error: f64, seconds: f64, seed: u64) -> Value {
        let end = End { error_field: "relative_error", relative_error, seconds };
        document(&self.job, &["views"], method, seed, end)
    }
}

/// Returns the number that is added to the job's seed for a run; the reference has the job's seed itself.
fn seed_after_reference(key: &RunKey) -> u64 {
    key.seed.wrapping_add(1)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::document::NoFiles;

    fn request() -> StudyRequest {
        let job = json!({ "grids": [{}], "views": [{}], "seed": 5, "method": { "kind": "sppm", "photons_per_pass": 9 },
                          "stop": { "relative_error": 0.1, "confidence": 0.9, "max_passes": 3 } });
        StudyRequest::new(job, vec!["auto".to_owned(), "sppm".to_owned()])
    }

    #[test]
    fn runs_differ_in_method_error_and_seed_alone() {
        let request = request().to(vec![0.05, 0.02]);
        let key = |method: &str| RunKey { method: method.to_owned(), relative_error: 0.02, seed: 1 };
        let run = request.run(&key("sppm"));
        let expected = json!({ "grids": [{}], "seed": 7, "method": { "kind": "sppm", "photons_per_pass": 9 },
            "stop": { "relative_error": 0.02, "confidence": 0.9, "max_seconds": 60.0, "max_passes": 1_000_000 } });
        assert_eq!(run, expected);
        assert_eq!(request.run(&key("auto"))["method"], "auto");
        assert_eq!(request.seed(&key("auto")), 7);
        let reference = request.reference();
        assert_eq!(reference["seed"], 5);
        assert_eq!(
            (&reference["stop"]["relative_error"], &reference["stop"]["max_seconds"]),
            (&json!(0.005), &json!(600.0))
        );
        let runs: Vec<RunKey> = request.runs(&request.methods).collect();
        assert_eq!((runs.len(), runs[0].method.as_str(), runs[1].method.as_str()), (12, "auto", "sppm"));
        assert_eq!((runs[2].relative_error, runs[4].seed), (0.02, 1));
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
            relative_errors: vec![0.1, 1.0, f64::NAN, 0.1],
            seeds: 0,
            seconds: f64::INFINITY,
            ..request()
        };
        let expected = [
            "/methods",
            "/relative_errors/1",
            "/relative_errors/2",
            "/relative_errors/3",
            "/seeds",
            "/seconds",
            "/job/grids",
        ];
        assert_eq!(pointers(&bad), expected);
        let mut bad = request();
        bad.methods.extend(["nobody".to_owned(), "auto".to_owned()]);
        bad.reference.method = Some("none".to_owned());
        assert_eq!(pointers(&bad), ["/methods/2", "/methods/3", "/reference/method"]);
    }

    #[test]
    fn what_is_absent_has_a_default() {
        let job: Value = serde_json::from_str(include_str!("../../examples/two_tubes.json")).unwrap();
        let request = StudyRequest::from_value(json!({ "job": job }), &NoFiles).unwrap();
        assert_eq!(request, StudyRequest::new(job, method::names().map(str::to_owned).collect()));
        let asked = json!({ "job": { "grids": [] }, "seed": 1, "seeds": 0 });
        let errors = StudyRequest::from_value(asked, &NoFiles).unwrap_err();
        let pointers: Vec<&str> = errors.0.iter().map(|error| error.pointer.as_str()).collect();
        for pointer in ["/seed", "/job/room", "/seeds", "/job/grids"] {
            assert!(pointers.contains(&pointer), "{pointer}: {pointers:?}");
        }
    }
}
