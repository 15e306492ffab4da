//! The page for people.

use reqwest::header;

use crate::common::*;

/// The page, its modules and its presets come with their types, a policy that lets nothing else run, and tags that spare a second
/// transfer.
#[tokio::test]
async fn the_page_is_served_with_its_policy_and_tags() {
    let service = TestService::start().await;
    let id = uuid::Uuid::now_v7();
    for (path, media_type) in [
        ("/".to_owned(), "text/html; charset=utf-8"),
        (format!("/jobs/{id}"), "text/html; charset=utf-8"),
        ("/web/main.js".to_owned(), "text/javascript; charset=utf-8"),
        ("/web/vendor/lit-html.js".to_owned(), "text/javascript; charset=utf-8"),
        ("/web/vendor/lit-html.LICENSE".to_owned(), "text/plain; charset=utf-8"),
        ("/web/style.css".to_owned(), "text/css; charset=utf-8"),
        ("/web/icon.svg".to_owned(), "image/svg+xml"),
        ("/web/presets/bathroom.json".to_owned(), "application/json"),
        ("/web/synthetic.epw".to_owned(), "text/plain; charset=utf-8"),
    ] {
        let answer = service.get(&path).send().await.unwrap();
        assert_eq!(answer.status(), 200, "{path}");
        assert_eq!(answer.headers()[header::CONTENT_TYPE], media_type, "{path}");
        let policy = answer.headers()[header::CONTENT_SECURITY_POLICY].to_str().unwrap();
        assert!(policy.starts_with("default-src 'none'; script-src 'self';") && !policy.contains("unsafe"), "{policy}");
        let tag = answer.headers()[header::ETAG].clone();
        let length = answer.content_length();
        let bytes = answer.bytes().await.unwrap();
        assert!(!bytes.is_empty() && length == Some(bytes.len() as u64), "{path}");

        let again = service.get(&path).header(header::IF_NONE_MATCH, &tag).send().await.unwrap();
        assert_eq!((again.status().as_u16(), again.headers()[header::ETAG].clone()), (304, tag.clone()), "{path}");
        let head = service.request(reqwest::Method::HEAD, &path).send().await.unwrap();
        assert_eq!((head.status().as_u16(), head.headers()[header::ETAG].clone()), (200, tag), "{path}");
        assert!(head.bytes().await.unwrap().is_empty());
    }
    for path in ["/web/", "/web/none.js", "/web/vendor/lit-html.d.ts", "/web/..%2fexamples%2fthesis_room.json"] {
        assert_eq!(service.get(path).send().await.unwrap().status(), 404, "{path}");
    }
}

/// The rooms that the page opens with are documents that the service takes.
#[tokio::test]
async fn the_rooms_of_the_page_are_valid() {
    let service = TestService::start().await;
    for preset in std::fs::read_dir("web/presets").unwrap() {
        let text = std::fs::read_to_string(preset.unwrap().path()).unwrap();
        let preset: serde_json::Value = serde_json::from_str(&text).unwrap();
        let answer = service.request(reqwest::Method::POST, "/v1/plan").json(&preset["draft"]).send().await.unwrap();
        assert_eq!(answer.status(), 200, "{}", answer.text().await.unwrap());
    }
}
