//! Years of daylight over HTTP: weather, job, results and files.

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use crate::common::{TestService, problem, small_job};

const SYNTHETIC: &str = include_str!("../../../examples/synthetic.epw");

/// A small room with a year of the given weather.
fn year(weather: &str) -> Value {
    let mut job = small_job();
    let fields = job.as_object_mut().unwrap();
    ["sky", "time", "location", "views", "method"].iter().for_each(|field| drop(fields.remove(*field)));
    job["annual"] = json!({ "weather": weather });
    job["stop"] = json!({ "relative_error": 0.05 });
    job
}

#[tokio::test]
async fn a_year_from_weather_to_files() {
    let service = TestService::start().await;
    let upload = service.request(Method::POST, "/v1/weather").header("content-type", "text/plain").body(SYNTHETIC);
    let weather: Value = upload.send().await.unwrap().json().await.unwrap();
    let id = weather["id"].as_str().unwrap();
    let mut document = year(id);
    document["grids"][0]["target_lux"] = json!(250.0);
    let path = service.submit(&document).await;
    let job = service.finished(&path).await;
    assert_eq!(job["status"], "succeeded", "{job}");

    let links: Vec<&str> =
        job["links"]["annual"].as_array().unwrap().iter().map(|link| link.as_str().unwrap()).collect();
    assert_eq!(links[0], format!("{path}/annual"));
    let summary = service.json(links[0]).await;
    assert_eq!(summary["site"]["name"], "Synthetic");
    assert_eq!(summary["conventions"]["occupied_hours"], 3650.0);
    assert!(summary["tubes"][0]["klm_h"]["value"].as_f64().unwrap() > 0.0);
    let verdicts = summary["grids"][0]["verdicts"].as_array().unwrap();
    assert!(verdicts.len() > 10 && verdicts.iter().all(|verdict| verdict["basis"].is_string()));
    for link in &links[1..] {
        let answer = service.get(link).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{link}");
        assert!(!answer.bytes().await.unwrap().is_empty(), "{link}");
    }
    let points = links.iter().find(|link| link.ends_with(".csv") && link.contains("/points.")).unwrap();
    let table = service.get(points).send().await.unwrap().text().await.unwrap();
    assert!(table.starts_with("x_m,y_m,z_m,normal_x,normal_y,normal_z,"), "{table}");
    assert!(table.lines().nth(1).unwrap().split(',').skip(3).take(3).eq(["0", "0", "1"]), "{table}");
    problem(service.get(&format!("{path}/annual/points.none.csv")).send().await.unwrap(), 404).await;
    let events = service.events_after(&path, 0).await;
    let names: Vec<&str> = events.iter().map(|event| event.name.as_str()).collect();
    let phase = names.iter().position(|name| *name == "phase").expect("no phase");
    assert!(names[..phase].contains(&"pass") && names[phase..].ends_with(&["succeeded"]), "{names:?}");
    assert_eq!(events[phase].data["phase"], "year");
    let report = service.get(&format!("{}/report", job["links"]["page"].as_str().unwrap()));
    let report = report.send().await.unwrap().text().await.unwrap();
    for words in [
        "target of 250 lx in 50 % of the occupied hours is ",
        " over the year at Synthetic",
        "The year with the weather of Synthetic, 3650 occupied hours; ",
        "LEED v4.1",
        "/annual/autonomy.",
        "responses: every closure is Lambertian",
        "simulated: the year has the sun of every moment",
    ] {
        assert!(report.contains(words), "{words}: {report}");
    }
    assert!(
        !report.contains("250 lx: "),
        "the light of an overcast sky is compared with the target of a year: {report}"
    );
    judges_targets(&service, &path, &summary["grids"][0]).await;
    other_hours(&service, &path, links[1]).await;

    // files are made of the weather as long as the job is there
    let weather = format!("/v1/weather/{id}");
    problem(service.request(Method::DELETE, &weather).send().await.unwrap(), 409).await;
    assert_eq!(service.request(Method::DELETE, &path).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    assert_eq!(service.request(Method::DELETE, &weather).send().await.unwrap().status(), StatusCode::NO_CONTENT);
}

/// The report judges a target by the autonomy, which the mean over the area has, or by the part of the area; others are refused.
async fn judges_targets(service: &TestService, path: &str, grid: &Value) {
    let page = path.trim_start_matches("/v1");
    let autonomies = grid["autonomies"].as_array().unwrap();
    let of = |lux: f64| &autonomies.iter().find(|autonomy| autonomy["lux"] == lux).unwrap()["da_percent"];
    let judged = |found: &Value, least: f64| match (found["low"].as_f64().unwrap(), found["high"].as_f64().unwrap()) {
        (low, _) if low >= least => ("good", "The", "is met"),
        (_, high) if high < least => ("bad", "The", "is not met"),
        _ => ("plain", "Whether the", "is met"),
    };
    for (query, of, found, least) in [
        ("target_lux=100", "", of(100.0), 50.0),
        // that of the document
        ("target_lux=250", "", of(250.0), 50.0),
        ("target_lux=300&target_of=most", " on 95 % of the area", &grid["sda_percent"], 95.0),
    ] {
        let report = service.get(&format!("{page}/report?{query}")).send().await.unwrap().text().await.unwrap();
        let (tone, begins, is) = judged(found, least);
        let lux = &query[11..14];
        let words =
            format!("<p class=\"sentence {tone}\">{begins} target of {lux} lx{of} in 50 % of the occupied hours {is} ");
        assert!(report.contains(&words), "{words}: {report}");
    }
    for query in ["target_lux=301", "target_lux=100&target_of=half"] {
        problem(service.get(&format!("{path}/report.pdf?{query}")).send().await.unwrap(), 422).await;
    }
    maps_targets(service, path, grid).await;
}

/// The map of a year is that of the target: of the address, else of the document; the report shows it.
async fn maps_targets(service: &TestService, path: &str, grid: &Value) {
    let name = grid["name"].as_str().unwrap();
    for (query, lux, words) in [
        ("", 250, "250 lx in "),
        ("?target_lux=100", 100, "100 lx in "),
        ("?target_lux=300&target_of=half", 300, "300 lx in 50 % of the occupied hours on "),
    ] {
        let figure = service.get(&format!("{path}/annual/autonomy.{name}.svg{query}")).send().await.unwrap();
        let figure = figure.text().await.unwrap();
        assert!(
            figure.contains(&format!("Daylight autonomy {lux} lx, ")) && figure.contains(words),
            "{query}: {figure}"
        );
        let page = path.trim_start_matches("/v1");
        let report = service.get(&format!("{page}/report{query}")).send().await.unwrap().text().await.unwrap();
        let shown = format!("src=\"{path}/annual/autonomy.{name}.svg{}\"", query.replace('&', "&amp;"));
        assert!(report.contains(&shown), "{shown}: {report}");
    }
    for file in [format!("autonomy.{name}.svg?target_lux=301"), "hours.csv?target_lux=100".to_owned()] {
        problem(service.get(&format!("{path}/annual/{file}")).send().await.unwrap(), 422).await;
    }
}

/// Numbers of an array of float32.
fn numbers(bytes: &[u8]) -> (String, Vec<f32>) {
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let values = bytes[10 + length..].chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()));
    (String::from_utf8(bytes[10..10 + length].to_vec()).unwrap(), values.collect())
}

/// Hours of the weather file itself, at their moments, have the illuminances of the year; what is not valid is refused.
async fn other_hours(service: &TestService, path: &str, hours_csv: &str) {
    assert!(hours_csv.ends_with("/annual/hours.csv"));
    let hours = service.get(hours_csv).send().await.unwrap().text().await.unwrap();
    let grid = service.json(path).await["document"]["grids"][0]["name"].as_str().unwrap().to_owned();
    let array = service.get(&format!("{path}/annual/points.{grid}.npy")).send().await.unwrap().bytes().await.unwrap();
    let (_, year) = numbers(&array);
    // noons, whose sun is up for the whole hour; the file's own hours are of the year that SPA takes for typical years
    let noons: Vec<Vec<f64>> = hours
        .lines()
        .skip(1)
        .filter(|row| row.split(',').nth(2) == Some("12.5"))
        .step_by(40)
        .map(|row| row.split(',').map(|field| field.parse().unwrap()).collect())
        .collect();
    let records: Vec<&str> = SYNTHETIC.lines().filter(|line| line.split(',').count() > 30).collect();
    let of_hour = |noon: &Vec<f64>| {
        let [month, day] = [noon[0] as u32, noon[1] as u32];
        let record = records.iter().position(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            [fields[1], fields[2], fields[3]] == [month.to_string(), day.to_string(), "13".to_owned()]
        });
        let record = record.unwrap();
        let field = |number: usize| records[record].split(',').nth(number).unwrap().parse::<f64>().unwrap();
        let hour = json!({
            "time": format!("2017-{month:02}-{day:02}T12:30:00+01:00"), "dew_point_c": field(7),
            "direct_normal_irradiance_w_m2": field(14), "diffuse_horizontal_irradiance_w_m2": field(15)
        });
        (record, hour)
    };
    let (places, hours): (Vec<usize>, Vec<Value>) = noons.iter().map(of_hour).unzip();
    let post = |grid: &str, body: Value| {
        service.request(Method::POST, &format!("{path}/annual/hours/{grid}")).json(&body).send()
    };
    let answer = post(&grid, json!({ "hours": hours })).await.unwrap();
    assert_eq!(
        (answer.status(), answer.headers()["content-type"].to_str().unwrap()),
        (StatusCode::OK, "application/octet-stream")
    );
    let (header, found) = numbers(&answer.bytes().await.unwrap());
    let sensors = year.len() / 8760;
    assert!(places.len() > 8 && header.contains(&format!("'shape': ({sensors}, {})", places.len())), "{header}");
    for sensor in 0..sensors {
        for (number, place) in places.iter().enumerate() {
            let [found, expected] = [found[sensor * places.len() + number], year[sensor * 8760 + place]];
            assert!((found / expected - 1.0).abs() < 1e-4, "{sensor} {place}: {found} {expected}");
        }
    }
    let mut night = hours[0].clone();
    night["time"] = json!("2017-01-15T00:30:00+01:00");
    let (_, dark) = numbers(&post(&grid, json!({ "hours": [night] })).await.unwrap().bytes().await.unwrap());
    assert!(dark.len() == sensors && dark.iter().all(|lux| *lux == 0.0));
    let mut wrong = hours[0].clone();
    wrong["dew_point_c"] = json!(1e4);
    let refused = problem(post(&grid, json!({ "hours": [hours[0], wrong] })).await.unwrap(), 422).await;
    assert_eq!(refused["errors"][0]["pointer"], "/hours/1/dew_point_c");
    // a leap year with all fields, indented: more than a document of a job may have
    let leap_year = serde_json::to_string_pretty(&json!({ "hours": vec![hours[0].clone(); 8784] })).unwrap();
    let url = format!("{path}/annual/hours/{grid}");
    let post_text =
        |text: String| service.request(Method::POST, &url).header("content-type", "application/json").body(text).send();
    assert!(leap_year.len() > 1 << 20);
    assert_eq!(post_text(leap_year).await.unwrap().status(), StatusCode::OK);
    let longer = problem(post_text(" ".repeat(2_248_705)).await.unwrap(), 413).await;
    assert!(longer["detail"].as_str().unwrap().contains("at most 2248704 bytes"), "{longer}");
    problem(post(&grid, json!({ "hours": [] })).await.unwrap(), 422).await;
    problem(post("none", json!({ "hours": [hours[0]] })).await.unwrap(), 404).await;
}

#[tokio::test]
async fn years_without_weather_and_jobs_without_years() {
    let service = TestService::start().await;
    let refused = service.request(Method::POST, "/v1/jobs").json(&year("none")).send().await.unwrap();
    let refused = problem(refused, 422).await;
    assert_eq!(refused["errors"][0]["pointer"], "/annual/weather", "{refused}");
    let path = service.submit(&small_job()).await;
    let job = service.finished(&path).await;
    assert!(job["links"]["annual"].is_null());
    problem(service.get(&format!("{path}/annual")).send().await.unwrap(), 404).await;
    problem(service.get(&format!("{path}/annual/hours.csv")).send().await.unwrap(), 404).await;
}

#[tokio::test]
async fn other_daylight_from_upload_to_deletion() {
    let service = TestService::start().await;
    let upload = service.request(Method::POST, "/v1/weather").header("content-type", "text/plain").body(SYNTHETIC);
    let weather: Value = upload.send().await.unwrap().json().await.unwrap();
    let mut job = year(weather["id"].as_str().unwrap());
    let grid = &job["grids"][0];
    let cells = grid["cells"].as_array().unwrap().iter().map(|cells| cells.as_u64().unwrap() as usize).product();
    let post = |body: Vec<u8>| service.request(Method::POST, "/v1/arrays").body(body).send();
    problem(post(b"x".to_vec()).await.unwrap(), 422).await;
    let array = skyduct::output::npy::encode([cells, 8760], std::iter::repeat_n(400.0, cells * 8760));
    let posted = post(array).await.unwrap();
    assert_eq!(posted.status(), StatusCode::CREATED);
    let path = posted.headers()["location"].to_str().unwrap().to_owned();
    let array: Value = posted.json().await.unwrap();
    assert_eq!((&array["rows"], &array["columns"]), (&json!(cells), &json!(8760)));
    assert_eq!(service.json(&path).await, array);
    job["annual"]["other_daylight"] = json!([{ "grid": grid["name"], "file": array["id"] }]);
    let of_job = service.submit(&job).await;
    assert_eq!(service.finished(&of_job).await["status"], "succeeded");
    let summary = service.json(&format!("{of_job}/annual")).await;
    assert!(summary["grids"][0]["mean_lux"]["value"].as_f64().unwrap() > 300.0);
    problem(service.request(Method::DELETE, &path).send().await.unwrap(), 409).await;
    service.request(Method::DELETE, &of_job).send().await.unwrap();
    assert_eq!(service.request(Method::DELETE, &path).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    problem(service.get(&path).send().await.unwrap(), 404).await;
}
