//! Web page at `/`: files of `web/`, which are embedded in the binary.

use axum::extract::Path;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::Response;
use bytes::Bytes;
use rust_embed::RustEmbed;

use crate::http::content;
use crate::http::problem::Problem;

/// Files of the page. A release build embeds them, a debug build reads them from the source.
#[derive(RustEmbed)]
#[folder = "web/"]
struct Files;

/// Synthetic year among the examples, for visitors who want to try a year at once, and its name among the page's files.
const SYNTHETIC_YEAR: (&str, &[u8]) = ("synthetic.epw", include_bytes!("../../examples/synthetic.epw"));

/// Content security policy of the page: it runs its own files only, without inline scripts and styles, and calls this service. It
/// may show pictures that it has made itself.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
    connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Answers `/`, and `/jobs/ID` for one job, with the same document, whose script reads the address.
pub async fn index(headers: HeaderMap) -> Result<Response, Problem> {
    answer(&headers, "index.html")
}

/// Answers `/web/FILE` with a file that the document loads.
pub async fn file(headers: HeaderMap, Path(file): Path<String>) -> Result<Response, Problem> {
    answer(&headers, &file)
}

fn answer(headers: &HeaderMap, file: &str) -> Result<Response, Problem> {
    let nothing = || Problem::not_found("there is nothing at this path");
    let media_type = media_type(file).ok_or_else(nothing)?;
    let found = match file == SYNTHETIC_YEAR.0 {
        true => Bytes::from_static(SYNTHETIC_YEAR.1),
        false => Files::get(file).ok_or_else(nothing)?.data.into_owned().into(),
    };
    let mut response = content::made(headers, found, media_type)?;
    let policy = HeaderValue::from_static(CONTENT_SECURITY_POLICY);
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, policy);
    Ok(response)
}

/// Returns the media type of a file of the page by its suffix; `None` for suffixes that no file of the page has.
fn media_type(file: &str) -> Option<&'static str> {
    let (_, suffix) = file.rsplit_once('.')?;
    Some(match suffix {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "json" => "application/json",
        "svg" => "image/svg+xml",
        "epw" | "LICENSE" => "text/plain; charset=utf-8",
        _ => return None,
    })
}
