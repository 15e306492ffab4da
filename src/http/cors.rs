//! Cross-origin requests (CORS): only web pages of the origins listed in the configuration may call the service.

use std::time::Duration;

use axum::Router;
use axum::http::{HeaderName, HeaderValue, Method, Uri, header};
use tower_http::cors::{AllowOrigin, CorsLayer};

/// Time for which a browser may remember that a request is allowed, before it asks again.
const ASK_AGAIN: Duration = Duration::from_secs(600);

/// Lets pages of these origins call the service and read its answers; `*` stands for all.
///
/// No cookies are involved: a page gets the same answers as any client.
pub fn around(router: Router, origins: &[String]) -> Router {
    if origins.is_empty() {
        return router;
    }
    let listed = if origins.iter().any(|origin| origin == "*") {
        AllowOrigin::any()
    } else {
        AllowOrigin::list(origins.iter().filter_map(|origin| HeaderValue::try_from(origin).ok()))
    };
    let layer = CorsLayer::new()
        .allow_origin(listed)
        .allow_methods([Method::GET, Method::HEAD, Method::POST, Method::DELETE])
        .allow_headers([
            header::CONTENT_TYPE,
            HeaderName::from_static("idempotency-key"),
            HeaderName::from_static("last-event-id"),
            HeaderName::from_static("prefer"),
        ])
        .expose_headers([
            header::LOCATION,
            header::RETRY_AFTER,
            header::ETAG,
            header::CONTENT_DISPOSITION,
            HeaderName::from_static("preference-applied"),
            HeaderName::from_static("idempotency-replayed"),
            HeaderName::from_static("x-request-id"),
        ])
        .max_age(ASK_AGAIN);
    router.layer(layer)
}

/// Checks that `origin` is written as browsers send it, since it is compared letter by letter; the error says how to write it.
pub fn check_origin(origin: &str) -> Result<(), String> {
    if origin.contains('@') {
        // not repeated: it has a password
        return Err(
            "an origin must not contain a user name or password: write scheme://host or scheme://host:port".to_owned()
        );
    }
    let uri: Option<Uri> = origin.parse().ok();
    let rebuilt = uri.and_then(|uri| Some(format!("{}://{}", uri.scheme_str()?, uri.authority()?)));
    if origin == "*" || rebuilt.is_some_and(|rebuilt| rebuilt == origin && origin == origin.to_ascii_lowercase()) {
        Ok(())
    } else {
        Err(format!(
            "{origin:?} is not a valid origin: write scheme://host or scheme://host:port in lower case, without a path"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::check_origin;

    #[test]
    fn origins_are_written_as_browsers_send_them() {
        for origin in ["https://design.example", "http://localhost:5173", "http://[::1]:8000", "*"] {
            assert!(check_origin(origin).is_ok(), "{origin}");
        }
        for origin in ["https://design.example/", "design.example", "https://Design.example", "https://", "", "null"] {
            assert!(check_origin(origin).is_err(), "{origin}");
        }
    }
}
