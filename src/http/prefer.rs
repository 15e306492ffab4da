//! Header `Prefer` (RFC 7240), by which a client prefers to wait for an answer.

use std::time::Duration;

use axum::http::HeaderMap;

/// Names of the header with a client's preferences, and of the header with those that were applied.
pub const PREFER: &str = "prefer";
pub const PREFERENCE_APPLIED: &str = "preference-applied";

/// Reads the seconds of the first `wait` in the headers `Prefer`; `None` without one that is a whole number. Preferences that are
/// not understood are ignored, as RFC 7240, section 2 asks for.
pub fn wait(headers: &HeaderMap) -> Option<Duration> {
    let lines = headers.get_all(PREFER).iter().filter_map(|line| line.to_str().ok());
    // a preference may have parameters behind a semicolon, of which `wait` has none
    let mut preferences = lines.flat_map(|line| line.split(',')).filter_map(|it| it.split(';').next());
    let seconds = preferences.find_map(|preference| {
        let (name, value) = preference.split_once('=')?;
        name.trim().eq_ignore_ascii_case("wait").then(|| value.trim().trim_matches('"').trim())
    })?;
    seconds.parse().ok().map(Duration::from_secs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(lines: &[&str]) -> Option<u64> {
        let mut headers = HeaderMap::new();
        for line in lines {
            headers.append(PREFER, line.parse().unwrap());
        }
        wait(&headers).map(|wait| wait.as_secs())
    }

    #[test]
    fn waits_are_read_as_the_standard_has_them() {
        assert_eq!(of(&[]), None);
        assert_eq!(of(&["respond-async"]), None);
        assert_eq!(of(&["wait=10"]), Some(10));
        assert_eq!(of(&["respond-async, Wait = \"7\"; x=1, wait=9"]), Some(7));
        assert_eq!(of(&["handling=lenient", "wait=3"]), Some(3));
        assert_eq!(of(&["wait=soon"]), None);
        assert_eq!(of(&["wait=-1"]), None);
        assert_eq!(of(&["wait"]), None);
    }
}
