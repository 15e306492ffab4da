//! What pictures a study is asked for, and the jobs that these make.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use super::documents::{End, document, method_of};
use crate::document::{FieldError, FieldErrorCode};

/// The reference may take so many times as long as the longest picture.
const LONGER: f64 = 10.0;

/// How much more accurate the reference is than the most accurate picture.
const FINER: f64 = 4.0;

/// Error that a reference is to have where pictures of equal time are compared with it, whose errors nobody knows before.
const OF_EQUAL_TIME: f64 = 0.0025;

/// An error that no picture of equal time has: its seconds end it.
const NO_ERROR: f64 = 1e-9;

/// Bytes of a pixel of a picture on a sheet, and of the films that are there at a time.
const BYTES_OF_A_TILE: f64 = 9.0;
const BYTES_OF_FILMS: f64 = 140.0;

/// Pictures of the views of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PicturesWanted {
    /// Seconds of rendering after which each method shows a picture of every view; none when absent.
    #[serde(default)]
    pub seconds: Vec<f64>,
    /// Relative errors of the blocks of 8 x 8 pixels at which the job's own method shows a picture of every view.
    #[serde(default = "ten_five_two_and_one_percent")]
    pub relative_errors: Vec<f64>,
}

/// Relative errors of pictures unless others are asked for.
pub fn ten_five_two_and_one_percent() -> Vec<f64> {
    vec![0.1, 0.05, 0.02, 0.01]
}

impl PicturesWanted {
    /// What is wrong with the numbers or with the job for them, with pointers into a request that has them at `at`.
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
                    format!("{value} stands there twice")
                } else {
                    continue;
                };
                let error = FieldError::new(format!("{at}/{name}/{index}"), detail);
                errors.push(error.coded(FieldErrorCode::OutOfRange));
            }
        }
        if self.seconds.is_empty() && self.relative_errors.is_empty() {
            errors.push(FieldError::new(at, "neither seconds nor relative errors of pictures are named"));
        }
    }
}

/// What pictures are made of the views of a job; its grids are left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureRequest {
    /// The job document.
    pub job: Value,
    /// Methods by name, for pictures of equal time.
    pub methods: Vec<String>,
    /// The pictures.
    #[serde(flatten)]
    pub wanted: PicturesWanted,
    /// Seconds after which a picture of an accuracy is shown as it is.
    pub most_seconds: f64,
    /// Method of the reference.
    pub reference: String,
    /// Seconds that the reference may take.
    pub reference_seconds: f64,
}

/// Which pictures a job makes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PictureKey {
    /// Those that all others are compared with.
    Reference,
    /// Those by a method after so many seconds.
    EqualTime {
        /// Name of the method.
        method: String,
        /// Seconds of rendering.
        seconds: f64,
    },
    /// Those by the job's own method with a relative error.
    Accuracy {
        /// Relative error of the blocks.
        relative_error: f64,
    },
}

impl PictureRequest {
    /// Pictures of `job`, the longest of which may take `most_seconds`.
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

    /// All jobs, the reference first, where `able` are the methods that can show the views: rows of equal time, then accuracies.
    pub fn keys(&self, able: &[String]) -> Vec<PictureKey> {
        let mut seconds = self.wanted.seconds.clone();
        seconds.sort_by(f64::total_cmp);
        let row =
            |seconds: f64| able.iter().map(move |method| PictureKey::EqualTime { method: method.clone(), seconds });
        let errors = self.wanted.relative_errors.iter();
        let accuracies = errors.map(|relative_error| PictureKey::Accuracy { relative_error: *relative_error });
        [PictureKey::Reference].into_iter().chain(seconds.into_iter().flat_map(row)).chain(accuracies).collect()
    }

    /// The document of a job.
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

    /// About how many bytes it takes to put pictures of the largest view side by side, where the study's jobs have these keys: each
    /// as it is shown, once more on the sheet and in the file, and two films with what they are read from.
    pub fn most_bytes(&self, keys: &[PictureKey]) -> f64 {
        let views = self.job["views"].as_array().into_iter().flatten();
        let pixels = views.map(|view| [0, 1].map(|axis| view["size_px"][axis].as_f64().unwrap_or(0.0)));
        let pixels = pixels.map(|[width, height]| width * height).fold(0.0, f64::max);
        let tiles = keys.iter().filter(|key| matches!(key, PictureKey::EqualTime { .. })).count() + 1;
        pixels * (BYTES_OF_A_TILE * tiles as f64 + BYTES_OF_FILMS)
    }

    /// The document that shows whether a method can show the views at all.
    pub fn trial(&self, method: &str) -> Value {
        self.document_of(method_of(&self.job, method), 0.5, 1.0, 1)
    }

    /// Seconds that a job may take at most.
    pub fn most_seconds_of(&self, key: &PictureKey) -> f64 {
        match key {
            PictureKey::Reference => self.reference_seconds,
            PictureKey::EqualTime { seconds, .. } => *seconds,
            PictureKey::Accuracy { .. } => self.most_seconds,
        }
    }

    fn document_of(&self, method: Value, relative_error: f64, seconds: f64, seed: u64) -> Value {
        let end = End { error_field: "view_relative_error", relative_error, seconds };
        // what checks grids, or is told of them, is not of pictures
        document(&self.job, &["grids", "cross_check"], method, seed, end)
    }

    /// Name of a view.
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
