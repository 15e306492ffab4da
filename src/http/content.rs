//! Files as answers, with strong entity tags, conditional requests and single ranges (RFC 9110).
//!
//! They are never compressed in transit: a compressed body may not have the strong tag of the plain one.

use std::ops::Range;

use axum::body::Body;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use utoipa::ToSchema;

use crate::http::problem::Problem;
use crate::http::problem_kind::ProblemKind;
use crate::queue::artifacts::Artifacts;
use crate::queue::store::Artifact;

/// Content of a binary file.
#[derive(ToSchema)]
#[schema(value_type = String, format = Binary, min_length = 1)]
pub struct Binary(#[expect(dead_code, reason = "stands for a schema")] String);

/// Answers a request with these headers with a stored artifact.
pub async fn stored(headers: &HeaderMap, artifacts: &Artifacts, artifact: &Artifact) -> Result<Response, Problem> {
    let answer = Answer::new(headers, &artifact.hash, artifact.size)?;
    if !matches!(answer, Answer::NotModified) {
        artifacts.check(artifact).await?;
    }
    let body = match &answer {
        Answer::NotModified => Body::empty(),
        Answer::Whole => Body::from_stream(artifacts.stream(artifact, None).await?),
        Answer::Part(range) => Body::from_stream(artifacts.stream(artifact, Some(range.clone())).await?),
    };
    answer.with_body(body, &artifact.hash, artifact.size, &artifact.media_type)
}

/// Answers a request with bytes that were made for it; equal bytes have equal tags.
pub fn made(headers: &HeaderMap, bytes: impl Into<Bytes>, media_type: &str) -> Result<Response, Problem> {
    let bytes = bytes.into();
    let hash = blake3::hash(&bytes).to_hex();
    made_as(headers, &hash, bytes, media_type)
}

/// Answers a request as [`made`] does, with a tag chosen by the caller; no other bytes may have this tag.
pub fn made_as(headers: &HeaderMap, tag: &str, bytes: impl Into<Bytes>, media_type: &str) -> Result<Response, Problem> {
    let bytes = bytes.into();
    let size = bytes.len() as u64;
    let answer = Answer::new(headers, tag, size)?;
    let body = match &answer {
        Answer::NotModified => Body::empty(),
        Answer::Whole => Body::from(bytes),
        Answer::Part(range) => {
            let at = |position: u64| usize::try_from(position).unwrap_or(usize::MAX).min(bytes.len());
            Body::from(bytes.slice(at(range.start)..at(range.end)))
        }
    };
    answer.with_body(body, tag, size, media_type)
}

enum Answer {
    NotModified,
    Whole,
    Part(Range<u64>),
}

impl Answer {
    fn new(headers: &HeaderMap, hash: &str, size: u64) -> Result<Self, Problem> {
        let tag = format!("\"{hash}\"");
        if none_match(headers, &tag) {
            return Ok(Self::NotModified);
        }
        // a range of another version is of no use: then the whole file
        let same_version = headers.get(header::IF_RANGE).is_none_or(|value| value.as_bytes() == tag.as_bytes());
        let range = headers.get(header::RANGE).filter(|_| same_version).and_then(|value| value.to_str().ok());
        match range.map_or(Requested::Whole, |range| requested(range, size)) {
            Requested::Whole => Ok(Self::Whole),
            Requested::Part(range) => Ok(Self::Part(range)),
            Requested::Unsatisfiable => Err(Problem::new(
                ProblemKind::Range,
                format!("the range lies beyond the end of the file, which has {size} bytes"),
            )),
        }
    }

    fn with_body(self, body: Body, hash: &str, size: u64, media_type: &str) -> Result<Response, Problem> {
        let mut response = body.into_response();
        let headers = response.headers_mut();
        let mut set = |name: HeaderName, value: String| match HeaderValue::try_from(value) {
            Ok(value) => {
                headers.insert(name, value);
                Ok(())
            }
            Err(_) => Err(Problem::internal()),
        };
        set(header::ETAG, format!("\"{hash}\""))?;
        set(header::CACHE_CONTROL, "no-cache".into())?;
        set(header::ACCEPT_RANGES, "bytes".into())?;
        let (status, length) = match self {
            Self::NotModified => (StatusCode::NOT_MODIFIED, None),
            Self::Whole => (StatusCode::OK, Some(size)),
            Self::Part(range) => {
                set(header::CONTENT_RANGE, format!("bytes {}-{}/{size}", range.start, range.end - 1))?;
                (StatusCode::PARTIAL_CONTENT, Some(range.end - range.start))
            }
        };
        if let Some(length) = length {
            set(header::CONTENT_TYPE, media_type.to_owned())?;
            set(header::CONTENT_LENGTH, length.to_string())?;
        }
        *response.status_mut() = status;
        Ok(response)
    }
}

/// Refuses a body with a `Content-Encoding` other than `identity`.
pub fn check_coding(headers: &HeaderMap) -> Result<(), Problem> {
    let coding = headers.get(header::CONTENT_ENCODING).map(|value| String::from_utf8_lossy(value.as_bytes()));
    match coding.as_deref().map(str::trim) {
        None | Some("" | "identity") => Ok(()),
        Some(coding) => Err(Problem::unsupported_media_type(format!(
            "the body is sent with `Content-Encoding: {coding}`, which this service does not decode: send the body \
             without encoding"
        ))),
    }
}

/// True if `If-None-Match` names `tag` (quotes included); weak tags compare like strong ones here.
pub fn none_match(headers: &HeaderMap, tag: &str) -> bool {
    let strong = |tag: &str| tag.trim().trim_start_matches("W/").to_owned();
    headers
        .get_all(header::IF_NONE_MATCH)
        .iter()
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .any(|candidate| candidate.trim() == "*" || strong(candidate) == strong(tag))
}

#[derive(Debug, PartialEq)]
enum Requested {
    Whole,
    Part(Range<u64>),
    Unsatisfiable,
}

/// Reads the range of a `Range` header; several ranges, or one that cannot be read, mean the whole file.
fn requested(header: &str, size: u64) -> Requested {
    let Some((first, last)) = header.strip_prefix("bytes=").and_then(|range| range.split_once('-')) else {
        return Requested::Whole;
    };
    let number = |text: &str| {
        let text = text.trim();
        text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse::<u64>().unwrap_or(u64::MAX))
    };
    let range = match (first.trim().is_empty(), last.trim().is_empty()) {
        (true, true) => return Requested::Whole,
        (true, false) => number(last).map(|length| size.saturating_sub(length)..size),
        (false, true) => number(first).map(|first| first..size),
        (false, false) => match (number(first), number(last)) {
            (Some(first), Some(last)) if last < first => return Requested::Whole,
            (Some(first), Some(last)) => Some(first..last.saturating_add(1).min(size)),
            _ => None,
        },
    };
    match range {
        None => Requested::Whole,
        Some(range) if range.start >= range.end => Requested::Unsatisfiable,
        Some(range) => Requested::Part(range),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges() {
        for (header, expected) in [
            ("bytes=0-0", Requested::Part(0..1)),
            ("bytes=2-3", Requested::Part(2..4)),
            ("bytes=2-99", Requested::Part(2..10)),
            ("bytes=2-", Requested::Part(2..10)),
            ("bytes=-1", Requested::Part(9..10)),
            ("bytes=-99", Requested::Part(0..10)),
            ("bytes=10-", Requested::Unsatisfiable),
            ("bytes=10-12", Requested::Unsatisfiable),
            ("bytes=-0", Requested::Unsatisfiable),
            ("bytes=5-2", Requested::Whole),
            ("bytes=0-1,4-5", Requested::Whole),
            ("bytes=-", Requested::Whole),
            ("bytes=a-b", Requested::Whole),
            ("lines=0-1", Requested::Whole),
            ("bytes=99999999999999999999-", Requested::Unsatisfiable),
        ] {
            assert_eq!(requested(header, 10), expected, "{header}");
        }
        assert_eq!(requested("bytes=0-", 0), Requested::Unsatisfiable);
    }

    #[test]
    fn tags() {
        let headers =
            |value: &'static str| HeaderMap::from_iter([(header::IF_NONE_MATCH, HeaderValue::from_static(value))]);
        assert!(none_match(&headers("\"a\""), "\"a\""));
        assert!(none_match(&headers("\"b\", W/\"a\""), "\"a\""));
        assert!(none_match(&headers("*"), "\"a\""));
        assert!(!none_match(&headers("\"b\""), "\"a\""));
        assert!(!none_match(&HeaderMap::new(), "\"a\""));
    }
}
