//! Documents of a study's jobs: the study's own with another method, seed and stop.

use serde_json::{Value, json};

/// Returns the method for the document of a job of the study: the job's own settings if `name` is its method, or else the name
/// alone.
pub fn method_of(job: &Value, name: &str) -> Value {
    let own = &job["method"];
    if own["kind"] == name { own.clone() } else { json!(name) }
}

/// Returns the seed of a job of the study: the study's own plus `by`.
pub fn seed_of(job: &Value, by: u64) -> u64 {
    job["seed"].as_u64().unwrap_or(0).wrapping_add(by)
}

/// Accuracy and time at which a job of a study ends.
#[derive(Clone, Copy, Debug)]
pub struct End<'a> {
    /// Field of `stop` for the relative error of the outputs.
    pub error_field: &'a str,
    /// Relative error at which the job ends.
    pub relative_error: f64,
    /// Seconds of rendering after which the job ends in any case.
    pub seconds: f64,
}

/// Returns the document of `job` without some of its fields, by another method, with `seed` added to its seed and with the given
/// end, at the job's confidence.
pub fn document(job: &Value, without: &[&str], method: Value, seed: u64, end: End<'_>) -> Value {
    let mut document = job.clone();
    let confidence = document["stop"]["confidence"].take();
    let seed = seed_of(job, seed);
    if let Some(fields) = document.as_object_mut() {
        without.iter().for_each(|field| drop(fields.remove(*field)));
        fields.insert("method".to_owned(), if method.is_null() { json!("auto") } else { method });
        fields.insert("seed".to_owned(), json!(seed));
        let mut stop =
            json!({ end.error_field: end.relative_error, "max_seconds": end.seconds, "max_passes": 1_000_000 });
        if let Some(stop) = stop.as_object_mut().filter(|_| !confidence.is_null()) {
            stop.insert("confidence".to_owned(), confidence);
        }
        fields.insert("stop".to_owned(), stop);
    }
    document
}
