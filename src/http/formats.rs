//! Representations of a resource, requested by a suffix, by `?format=`, or by `Accept` (RFC 9110, 12.5.1).

use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::Response;
use headers::HeaderMapExt;
use headers_accept::Accept;
use mediatype::MediaType;

use crate::figure::paint::Scale;
use crate::http::problem::Problem;
pub use crate::present::outputs::Format;

/// Chooses the representation among `available` that `Accept` prefers; the first one if it prefers none, or is absent.
pub fn accepted(headers: &HeaderMap, available: &[Format]) -> Format {
    let first = available.first().copied().unwrap_or(Format::Json);
    let Some(accept) = headers.typed_get::<Accept>() else { return first };
    let media_types: Vec<_> =
        available.iter().filter_map(|format| MediaType::parse(format.media_type()).ok()).collect();
    let best = accept.negotiate(&media_types).map(ToString::to_string);
    available.iter().copied().find(|format| best.as_deref() == Some(format.media_type())).unwrap_or(first)
}

/// Splits a file's name into the name before the suffix and the representation of the suffix, if that is one of `available`.
pub fn by_suffix<'a>(file: &'a str, available: &[Format]) -> Option<(&'a str, Format)> {
    let (name, suffix) = file.rsplit_once('.').filter(|(name, _)| !name.is_empty())?;
    let format = Format::ALL.into_iter().find(|format| format.suffix() == suffix && available.contains(format))?;
    Some((name, format))
}

/// Returns the scale of a PNG from the parameter `density`.
pub fn scale(density: Option<u8>) -> Result<Scale, Problem> {
    match density {
        None | Some(1) => Ok(Scale::Single),
        Some(2) => Ok(Scale::Double),
        Some(other) => Err(Problem::invalid_parameter("density", format!("must be 1 or 2, but is {other}"))),
    }
}

/// Adds the header `Vary` to an answer whose representation was chosen by `Accept`.
pub fn vary_by_accept(mut response: Response) -> Response {
    response.headers_mut().insert(header::VARY, HeaderValue::from_static("accept"));
    response
}

/// Names the file for a browser that saves it; a browser that can show it does so.
pub fn named(mut response: Response, file: &str) -> Response {
    // names of outputs have letters, digits, `.`, `_` and `-` only
    let name = file.rsplit('/').next().unwrap_or(file);
    if let Ok(value) = HeaderValue::try_from(format!("inline; filename=\"{name}\"")) {
        response.headers_mut().insert(header::CONTENT_DISPOSITION, value);
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quality_and_wildcards_count() {
        let all = [Format::Json, Format::Csv, Format::Png];
        for (accept, expected) in [
            ("text/csv", Format::Csv),
            ("text/csv;q=0.1, application/json", Format::Json),
            ("application/json;q=0.5, text/*;q=0.6", Format::Csv),
            ("image/*", Format::Png),
            ("*/*", Format::Json),
            ("text/html, */*;q=0.1", Format::Json),
            ("application/json;q=0, text/csv;q=0.1, */*;q=0.1", Format::Csv),
            ("text/html", Format::Json),
            ("TEXT/CSV", Format::Csv),
            ("nonsense", Format::Json),
            ("", Format::Json),
        ] {
            let headers = HeaderMap::from_iter([(header::ACCEPT, HeaderValue::from_static(accept))]);
            assert_eq!(accepted(&headers, &all), expected, "{accept}");
        }
        assert_eq!(accepted(&HeaderMap::new(), &all), Format::Json);
        let svg =
            HeaderMap::from_iter([(header::ACCEPT, HeaderValue::from_static("image/svg+xml, application/json;q=0.9"))]);
        assert_eq!(accepted(&svg, &[Format::Json, Format::Svg]), Format::Svg);
    }

    #[test]
    fn suffixes() {
        let all = [Format::Json, Format::Csv];
        assert_eq!(by_suffix("floor.csv", &all), Some(("floor", Format::Csv)));
        assert_eq!(by_suffix("floor.v2.json", &all), Some(("floor.v2", Format::Json)));
        assert_eq!(by_suffix("floor.png", &all), None);
        assert_eq!(by_suffix("floor", &all), None);
        assert_eq!(by_suffix(".csv", &all), None);
    }
}
