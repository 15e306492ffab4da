//! Pictures that a study is asked for, and the jobs that render them.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use super::documents::{End, document, method_of};
use crate::document::{FieldError, FieldErrorCode};

/// Factor by which the reference may take longer than the longest picture.
const LONGER: f64 = 10.0;

/// Factor by which the reference is more accurate than the most accurate picture.
const FINER: f64 = 4.0;

/// Relative error of the reference for pictures of equal time, whose errors cannot be predicted.
const OF_EQUAL_TIME: f64 = 0.0025;

/// Relative error requested for pictures of equal time, which none reaches, so that they end by their seconds.
const NO_ERROR: f64 = 1e-9;

/// Bytes of a pixel of a picture on a sheet; `BYTES_OF_FILMS` are those of a pixel of the films that are in memory at a time.
const BYTES_OF_A_TILE: f64 = 9.0;
const BYTES_OF_FILMS: f64 = 140.0;

/// Requested pictures of the views of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PicturesWanted {
    /// Seconds of rendering after which each method shows a picture of every view; no such pictures when absent.
    #[serde(default)]
    pub seconds: Vec<f64>,
    /// Relative errors of the blocks of 8 x 8 pixels at which the job's own method shows a picture of every view; default: 0.1,
    /// 0.05, 0.02 and 0.01.
    #[serde(default = "ten_five_two_and_one_percent")]
    pub relative_errors: Vec<f64>,
}

/// Returns the default relative errors of pictures.
pub fn ten_five_two_and_one_percent() -> Vec<f64> {
    vec![0.1, 0.05, 0.02, 0.01]
}

impl PicturesWanted {
    /// Adds the faults of the numbers, and of the job where it does not suit pictures, to `errors`; `at` is the pointer to these
    /// pictures in the request.
    pub fn check(&self, job: &Value, at: &str, errors: &mut Vec<FieldError>) {
        if job["views"].as_array().is_none_or(Vec::is_empty) {
            errors.push(FieldError::new(at, "pictures are made of views, and the job has none"));
        }
        let numbers = [("seconds", &self.seconds, f64::INFINITY), ("relative_errors", &self.relative_errors, 1.0)];
        for (name, values, most) in numbers {
            for (index, value) in values.iter().enumerate() {
                let detail = if !(*value > 0.0 && *value < most) {
                    format!("must be > 0 and < {most}, but is {value}")
                } else if values[..index].contains(value) {
                    format!("{value} is listed twice")
                } else {
                    continue;
                };
                let error = FieldError::new(format!("{at}/{name}/{index}"), detail);
                errors.push(error.coded(FieldErrorCode::OutOfRange));
            }
        }
        if self.seconds.is_empty() && self.relative_errors.is_empty() {
            errors.push(FieldError::new(at, "at least one value in `seconds` or `relative_errors` is needed"));
        }
    }
}

/// Request for pictures of the views of a job; its grids are left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureRequest {
    /// The job document.
    pub job: Value,
    /// Methods, by name, of the pictures of equal time.
    pub methods: Vec<String>,
    /// Requested pictures.
    #[serde(flatten)]
    pub wanted: PicturesWanted,
    /// Largest number of seconds of rendering for a picture at an accuracy, which is then shown as it is.
    pub most_seconds: f64,
    /// Method of the reference.
    pub reference: String,
    /// Largest number of seconds of rendering for the reference.
    pub reference_seconds: f64,
}

/// Key of a job: the pictures that it renders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PictureKey {
    /// Pictures of the reference, which all others are compared with.
    Reference,
    /// Pictures by a method after a number of seconds.
    EqualTime {
        /// Name of the method.
        method: String,
        /// Seconds of rendering.
        seconds: f64,
    },
    /// Pictures by the job's own method at a relative error.
    Accuracy {
        /// Relative error of the blocks of 8 x 8 pixels.
        relative_error: f64,
    },
}

impl PictureRequest {
    /// Returns a request for pictures of `job`; one at an accuracy may take `most_seconds`.
    pub fn new(
        job: Value,
        methods: Vec<String>,
        wanted: PicturesWanted,
        most_seconds: f64,
        reference: Option<&str>,
    ) -> Self {
        let longest = wanted.seconds.iter().copied().fold(most_seconds, f64::max);
        let reference = reference.unwrap_or("auto").to_owned();
        Self { job, methods, wanted, most_seconds, reference, reference_seconds: LONGER * longest }
    }

    /// Returns the keys of all jobs: the reference, then a row of pictures for each time in ascending order, then the accuracies.
    /// `able` are the methods that can render the views.
    pub fn keys(&self, able: &[String]) -> Vec<PictureKey> {
        let mut seconds = self.wanted.seconds.clone();
        seconds.sort_by(f64::total_cmp);
        let row =
            |seconds: f64| able.iter().map(move |method| PictureKey::EqualTime { method: method.clone(), seconds });
        let errors = self.wanted.relative_errors.iter();
        let accuracies = errors.map(|relative_error| PictureKey::Accuracy { relative_error: *relative_error });
        [PictureKey::Reference].into_iter().chain(seconds.into_iter().flat_map(row)).chain(accuracies).collect()
    }

    /// Returns the document of a job.
    pub fn document(&self, key: &PictureKey) -> Value {
        match key {
            PictureKey::Reference => {
                let least = self.wanted.relative_errors.iter().map(|error| error / FINER);
                let of_equal_time = (!self.wanted.seconds.is_empty()).then_some(OF_EQUAL_TIME);
                let error = least.chain(of_equal_time).reduce(f64::min).unwrap_or(OF_EQUAL_TIME);
                self.document_of(method_of(&self.job, &self.reference), error, self.reference_seconds, 0)
            }
            PictureKey::EqualTime { method, seconds } => {
                self.document_of(method_of(&self.job, method), NO_ERROR, *seconds, 1)
            }
            PictureKey::Accuracy { relative_error } => {
                self.document_of(self.job["method"].clone(), *relative_error, self.most_seconds, 1)
            }
        }
    }

    /// Returns the approximate number of bytes needed to put the pictures of the largest view side by side, for jobs with these
    /// keys: for each picture, as shown, on the sheet and in the file; and for two films with their sources.
    pub fn most_bytes(&self, keys: &[PictureKey]) -> f64 {
        let views = self.job["views"].as_array().into_iter().flatten();
        let pixels = views.map(|view| [0, 1].map(|axis| view["size_px"][axis].as_f64().unwrap_or(0.0)));
        let pixels = pixels.map(|[width, height]| width * height).fold(0.0, f64::max);
        let tiles = keys.iter().filter(|key| matches!(key, PictureKey::EqualTime { .. })).count() + 1;
        pixels * (BYTES_OF_A_TILE * tiles as f64 + BYTES_OF_FILMS)
    }

    /// Returns the document by which it is tested whether a method can render the views at all.
    pub fn trial(&self, method: &str) -> Value {
        self.document_of(method_of(&self.job, method), 0.5, 1.0, 1)
    }

    /// Returns the largest number of seconds of rendering for a job.
    pub fn most_seconds_of(&self, key: &PictureKey) -> f64 {
        match key {
            PictureKey::Reference => self.reference_seconds,
            PictureKey::EqualTime { seconds, .. } => *seconds,
            PictureKey::Accuracy { .. } => self.most_seconds,
        }
    }

    fn document_of(&self, method: Value, relative_error: f64, seconds: f64, seed: u64) -> Value {
        let end = End { error_field: "view_relative_error", relative_error, seconds };
        // pictures need neither grids nor what depends on them
        document(&self.job, &["grids", "cross_check"], method, seed, end)
    }

    /// Returns the name of a view.
    pub fn view(&self, index: usize) -> String {
        self.job["views"][index]["name"].as_str().unwrap_or_default().to_owned()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn wanted(seconds: Vec<f64>, relative_errors: Vec<f64>) -> PictureRequest {
        let job = json!({ "grids": [{}], "views": [{ "name": "a" }], "method": "sppm", "stop": { "confidence": 0.9 } });
        let methods = vec!["auto".to_owned(), "sppm".to_owned()];
        PictureRequest::new(job, methods, PicturesWanted { seconds, relative_errors }, 30.0, None)
    }

    #[test]
    fn each_picture_is_a_job_without_grids() {
        let request = wanted(vec![2.0, 0.5], vec![0.1]);
        let keys = request.keys(&request.methods);
        let equal_time = |method: &str, seconds| PictureKey::EqualTime { method: method.to_owned(), seconds };
        assert_eq!(keys[..3], [PictureKey::Reference, equal_time("auto", 0.5), equal_time("sppm", 0.5)]);
        assert_eq!(keys[5..], [PictureKey::Accuracy { relative_error: 0.1 }]);
        let stop = |key: &PictureKey| request.document(key)["stop"].clone();
        let of = |error: f64, seconds: f64| json!({ "view_relative_error": error, "max_seconds": seconds, "max_passes": 1_000_000, "confidence": 0.9 });
        assert_eq!(stop(&keys[0]), of(0.0025, 300.0));
        assert_eq!((stop(&keys[1]), stop(&keys[5])), (of(1e-9, 0.5), of(0.1, 30.0)));
        let document = request.document(&keys[5]);
        assert_eq!(
            (&document["method"], &document["grids"], &document["seed"]),
            (&json!("sppm"), &json!(null), &json!(1))
        );
    }

    #[test]
    fn wrong_wishes_are_named() {
        let pointers = |wanted: PicturesWanted, job: Value| {
            let mut errors = Vec::new();
            wanted.check(&job, "/pictures", &mut errors);
            errors.into_iter().map(|error| error.pointer).collect::<Vec<_>>()
        };
        let job = json!({ "views": [{}] });
        let of = |seconds: &[f64], relative_errors: &[f64]| PicturesWanted {
            seconds: seconds.to_vec(),
            relative_errors: relative_errors.to_vec(),
        };
        assert_eq!(pointers(of(&[1.0], &[0.1]), job.clone()), [""; 0]);
        assert_eq!(
            pointers(of(&[0.0, 1.0], &[0.1, 0.1, 1.0]), job.clone()),
            ["/pictures/seconds/0", "/pictures/relative_errors/1", "/pictures/relative_errors/2"]
        );
        assert_eq!(pointers(of(&[], &[]), job), ["/pictures"]);
        assert_eq!(pointers(of(&[1.0], &[]), json!({})), ["/pictures"]);
    }
}
