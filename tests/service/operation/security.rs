//! Who may call the service, and what its answers tell.

use crate::common::{TestService, problem, raw, small_job};
use reqwest::{Method, StatusCode};

#[tokio::test]
async fn requests_for_other_hosts_are_refused() {
    let service = TestService::start_with(|config| config.allowed_hosts = vec!["render.example".to_owned()]).await;
    let address = service.running.address;
    let port = address.port();
    let get =
        async |lines: &str| raw(address, &format!("GET /v1/jobs HTTP/1.1\r\n{lines}connection: close\r\n\r\n")).await;
    for host in [address.to_string(), format!("localhost:{port}"), format!("[::1]:{port}"), "render.example".to_owned()]
    {
        let answer = get(&format!("host: {host}\r\n")).await;
        assert!(answer.starts_with("HTTP/1.1 200"), "{host}: {answer}");
    }
    for host in ["evil.example".to_owned(), format!("evil.example:{port}"), "127.0.0.1:1".to_owned()] {
        let answer = get(&format!("host: {host}\r\n")).await;
        assert!(answer.starts_with("HTTP/1.1 421") && answer.contains("/problems/unknown-host"), "{host}: {answer}");
    }
    for lines in ["", "host: a b\r\n", "host: me@localhost\r\n", "host: localhost\r\nhost: localhost\r\n"] {
        let answer = get(lines).await;
        assert!(answer.starts_with("HTTP/1.1 400"), "{lines}: {answer}");
    }
    // HTTP/1.0 has no Host
    assert!(raw(address, "GET /livez HTTP/1.0\r\n\r\n").await.starts_with("HTTP/1.0 200"));
    let other =
        raw(address, "GET http://evil.example/livez HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n").await;
    assert!(other.starts_with("HTTP/1.1 421"), "{other}");
}

#[tokio::test]
async fn pages_elsewhere_change_nothing() {
    let service =
        TestService::start_with(|config| config.cors_origins = vec!["https://design.example".to_owned()]).await;
    let post = |path: &str, body: &str, origin: &str| {
        let request = service.request(Method::POST, path).header("content-type", "text/plain").body(body.to_owned());
        request.header("origin", origin).header("sec-fetch-site", "cross-site").send()
    };
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    problem(post("/v1/meshes", triangle, "https://evil.example").await.unwrap(), 403).await;
    assert_eq!(post("/v1/meshes", triangle, "https://design.example").await.unwrap().status(), StatusCode::CREATED);
    let job = service.submit(&small_job()).await;
    problem(post(&format!("{job}/cancel"), "", "https://evil.example").await.unwrap(), 403).await;
    let delete = service.request(Method::DELETE, &job).header("sec-fetch-site", "cross-site").send();
    problem(delete.await.unwrap(), 403).await;
    // reading needs no more than CORS
    let read = service.get(&job).header("sec-fetch-site", "cross-site").send().await.unwrap();
    assert_eq!(read.status(), StatusCode::OK);
    assert_eq!(service.finished(&job).await["status"], "succeeded");
}

#[tokio::test]
async fn every_answer_says_what_a_browser_may_do_with_it() {
    let service = TestService::start().await;
    for path in
        ["/v1/jobs", "/metrics", "/livez", "/v1/skies", "/openapi.yaml", "/docs/", "/docs/swagger-ui-bundle.js", "/no"]
    {
        let response = service.get(path).send().await.unwrap();
        let header = |name: &str| response.headers().get(name).map_or("", |value| value.to_str().unwrap()).to_owned();
        assert_eq!(header("x-content-type-options"), "nosniff", "{path}");
        assert_eq!(header("x-frame-options"), "DENY", "{path}");
        assert_eq!(header("referrer-policy"), "no-referrer", "{path}");
        assert!(["no-cache", "no-store"].contains(&header("cache-control").as_str()), "{path}");
        let policy = header("content-security-policy");
        assert!(
            policy.starts_with("default-src 'none'") && policy.contains("frame-ancestors 'none'"),
            "{path}: {policy}"
        );
        assert!(!policy.contains("unsafe-eval") && !policy.contains("script-src 'unsafe"), "{path}: {policy}");
        // the page of the documentation has scripts, and nothing else has
        assert_eq!(policy.contains("script-src 'self'"), path.starts_with("/docs/"), "{path}: {policy}");
    }
}

#[tokio::test]
async fn what_clients_send_does_not_grow_in_logs_and_numbers() {
    let service = TestService::start().await;
    let with_id = async |id: String| {
        let response = service.get("/livez").header("x-request-id", id).send().await.unwrap();
        response.headers()["x-request-id"].to_str().unwrap().to_owned()
    };
    assert_eq!(with_id("mine".to_owned()).await, "mine");
    assert_eq!(with_id("x".repeat(128)).await, "x".repeat(128));
    let id = with_id("x".repeat(129)).await;
    assert!(id.len() <= 128 && !id.starts_with("xx"), "{id}");

    for number in 0..20 {
        let method = Method::from_bytes(format!("INVENTED{number}").as_bytes()).unwrap();
        service.request(method, "/livez").send().await.unwrap();
    }
    let metrics = service.get("/metrics").send().await.unwrap().text().await.unwrap();
    assert!(!metrics.contains("INVENTED") && metrics.contains("method=\"other\""), "{metrics}");
}

/// Documents and meshes with a byte order mark, or in UTF-16; a coding of the body is refused by its name.
#[tokio::test]
async fn bodies_in_other_encodings() {
    let service = TestService::start().await;
    let coding = |path: &str, content_type: &str, body: Vec<u8>, coding: &str| {
        let request = service.request(Method::POST, path).header("content-type", content_type).body(body);
        if coding.is_empty() { request } else { request.header("content-encoding", coding) }
    };
    let documents = ["/v1/plan", "/v1/jobs"].map(|path| (path, "application/json", small_job().to_string()));
    let mesh = ("/v1/meshes", "model/obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned());
    for (path, content_type, text) in documents.into_iter().chain([mesh]) {
        let marked = format!("\u{feff}{text}");
        let wide: Vec<u8> = marked.encode_utf16().flat_map(u16::to_le_bytes).collect();
        for body in [marked.clone().into_bytes(), wide] {
            let answer = coding(path, content_type, body, "identity").send().await.unwrap();
            assert!(answer.status().is_success(), "{path}: {}", answer.text().await.unwrap());
        }
        let refused =
            problem(coding(path, content_type, b"\x1f\x8b\x08".to_vec(), "gzip").send().await.unwrap(), 415).await;
        assert_eq!(refused["type"], "/problems/unsupported-media-type", "{refused}");
        let (status, kind) = if path == "/v1/meshes" { (422, "invalid-mesh") } else { (400, "not-json") };
        let refused =
            problem(coding(path, content_type, b"\x1f\x8b\x08".to_vec(), "").send().await.unwrap(), status).await;
        assert_eq!(refused["type"], format!("/problems/{kind}"), "{refused}");
    }
}

/// Where the service keeps its files is nobody's business.
#[tokio::test]
async fn no_answer_names_a_path_of_the_machine() {
    let service = TestService::start().await;
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let upload = service.request(Method::POST, "/v1/meshes").header("content-type", "model/obj").body(mesh);
    let mesh: serde_json::Value = upload.send().await.unwrap().json().await.unwrap();
    let job = service.submit(&small_job()).await;
    service.finished(&job).await;
    // a disk that loses its files
    std::fs::remove_dir_all(service.data.path().join("artifacts")).unwrap();
    let mut document = small_job();
    document["room"]["objects"] = serde_json::json!([{ "kind": "mesh", "mesh": mesh["id"], "unit": "m", "position_m": [1, 1, 0],
        "rotation_deg": 0, "surfaces": { "": { "reflectance": 0.5 } } }]);
    let service_again = service.request(Method::POST, "/v1/plan").json(&document);
    let folder = service.data.path().to_str().unwrap().to_owned();
    let mut answers = vec![service_again.send().await.unwrap()];
    for path in ["/grids/workplane", "/views/room.png", "/views/room.png?pass=1", "/tubes/0.json", ""] {
        answers.push(service.get(&format!("{job}{path}")).send().await.unwrap());
    }
    for answer in answers {
        let (url, text) = (answer.url().clone(), answer.text().await.unwrap());
        assert!(!text.contains(&folder) && !text.contains("artifacts/"), "{url}: {text}");
    }
}
