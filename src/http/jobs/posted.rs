//! Posted documents: read, hashed, prepared.

use axum::extract::rejection::BytesRejection;
use axum::http::{HeaderMap, header};
use bytes::Bytes;
use serde_json::Value;

use crate::document::{DocumentErrors, FieldError, FieldErrorCode, JobDocument, read};
use crate::http::Service;
use crate::http::content::check_coding;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::Problem;
use crate::http::problem_kind::ProblemKind;
use crate::job::prepare::{Prepared, prepare_document};

/// A posted document: text that is JSON, its value, and the hash of its canonical form.
pub struct Posted {
    pub text: String,
    pub value: Value,
    pub hash: String,
}

impl Posted {
    pub fn read(headers: &HeaderMap, body: Result<Bytes, BytesRejection>) -> Result<Self, Problem> {
        let content_type = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
        let media_type = content_type.split(';').next().unwrap_or("").trim().to_ascii_lowercase();
        if media_type != "application/json" {
            return Err(Problem::unsupported_media_type("a document is sent as application/json"));
        }
        check_coding(headers)?;
        let text = read::json::text(&body?).map_err(|error| not_json(error.detail))?.into_owned();
        // a field that is given twice is refused before a key can compare its last value
        let value = read::json::value(text.as_bytes()).map_err(|error| match error.pointer.as_str() {
            "" => not_json(error.detail),
            _ => DocumentErrors(vec![error]).into(),
        })?;
        let mut hasher = blake3::Hasher::new();
        hash_canonical(&value, &mut hasher);
        Ok(Self { text, value, hash: hasher.finalize().to_hex().to_string() })
    }
}

fn not_json(detail: String) -> Problem {
    Problem::new(ProblemKind::NotJson, detail)
}

/// Equal for bodies that differ only in white space and in the order of fields.
fn hash_canonical(value: &Value, hasher: &mut blake3::Hasher) {
    match value {
        Value::Object(fields) => {
            hasher.update(format!("object {}\n", fields.len()).as_bytes());
            let mut sorted: Vec<_> = fields.iter().collect();
            sorted.sort_by_key(|(name, _)| *name);
            for (name, value) in sorted {
                hasher.update(format!("{}\n{name}", name.len()).as_bytes());
                hash_canonical(value, hasher);
            }
        }
        Value::Array(values) => {
            hasher.update(format!("array {}\n", values.len()).as_bytes());
            values.iter().for_each(|value| hash_canonical(value, hasher));
        }
        leaf => {
            hasher.update(format!("{leaf}\n").as_bytes());
        }
    }
}

/// Prepares a job off the async threads, because meshes can be large. Answers the uploaded meshes that it uses, too.
pub async fn prepare(app: &Service, document: Value) -> Result<(Prepared, Vec<String>), Problem> {
    let (meshes, runtime) = (app.meshes.clone(), tokio::runtime::Handle::current());
    let memory_limit = app.limits.memory_limit_bytes();
    let prepared = off_thread(permit(&app.permits.preparing).await?, move |cancel| {
        let meshes = meshes.for_document(runtime, cancel);
        let prepared = prepare_document(&JobDocument::from_value(document)?, &meshes)?;
        prepared.check_memory(memory_limit)?;
        Ok::<_, DocumentErrors>((prepared, meshes.loaded()))
    });
    let (prepared, meshes) = prepared.await??;
    let (asked, most) = (prepared.stop.max_seconds, app.limits.max_seconds);
    if asked > most {
        let detail = format!("must be <= {most} on this service, but is {asked}");
        let error = FieldError::new("/stop/max_seconds", detail).coded(FieldErrorCode::OutOfRange);
        return Err(DocumentErrors::from(error).into());
    }
    Ok((prepared, meshes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(text: &str) -> String {
        let mut hasher = blake3::Hasher::new();
        hash_canonical(&read::json::value(text.as_bytes()).unwrap(), &mut hasher);
        hasher.finalize().to_hex().to_string()
    }

    #[test]
    fn the_canonical_hash_sees_content_only() {
        let same =
            [r#"{"a":1,"b":[1,2.5,"x"]}"#, " { \"b\" : [1, 2.5, \"x\"],\n\"a\":1}", r#"{"a":1.0,"b":[1e0,2.50,"x"]}"#];
        assert!(same.iter().all(|text| hash(text) == hash(same[0])));
        let different = [
            r#"{"a":1,"b":[1,2.5]}"#,
            r#"{"a":1,"b":["1",2.5,"x"]}"#,
            r#"{"a":1,"b":[[1],2.5,"x"]}"#,
            r#"{"a":{"b":[1,2.5,"x"]}}"#,
            r#"[]"#,
            r#"{}"#,
            r#"null"#,
            r#""null""#,
        ];
        let mut hashes: Vec<String> = different.iter().chain(&same[..1]).map(|text| hash(text)).collect();
        hashes.sort();
        hashes.dedup();
        assert_eq!(hashes.len(), different.len() + 1);
    }
}
