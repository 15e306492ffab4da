//! What each method would take: `?predict=true` of `POST /v1/plan` and `POST /v1/jobs`, `--predict` of `plan` and `render`.

use std::process::Command;

use crate::common::{TestService, problem, small_job};
use crate::schema::DESCRIPTION;
use reqwest::Method;
use serde_json::{Value, json};

/// All rows of a table: refused with a code, or with a time or a reason for every accuracy.
fn check_table(table: &Value, planned: &str) {
    let names: Vec<&Value> = table["methods"].as_array().unwrap().iter().map(|row| &row["method"]).collect();
    let all = DESCRIPTION["components"]["schemas"]["MethodKind"]["enum"].as_array().unwrap();
    // a former method is not offered
    let is_offered = |name: &&Value| !["auto", "placed_vertices", "lamp_responses"].map(Value::from).contains(name);
    assert_eq!(names, all.iter().filter(is_offered).collect::<Vec<_>>());
    let mut cheapest = [0; 6];
    for row in table["methods"].as_array().unwrap() {
        assert_eq!(row["planned"], row["method"] == planned, "{row}");
        let accuracies = row["accuracies"].as_array().unwrap();
        if !row["refusal"].is_null() {
            assert!(row["asked"].is_null() && accuracies.is_empty() && row["refusal"]["detail"].is_string(), "{row}");
            continue;
        }
        let errors: Vec<&Value> = accuracies.iter().map(|time| &time["relative_error"]).collect();
        assert_eq!(errors, [0.1, 0.05, 0.02, 0.01, 0.005, 0.001]);
        let mut before = 0.0;
        for (count, time) in cheapest.iter_mut().zip(accuracies) {
            assert_eq!(time["seconds"].is_null(), time["reason"].is_string(), "{time}");
            if let Some(seconds) = time["seconds"].as_f64() {
                assert!(seconds > 0.0 && time["seconds_from"].as_f64().unwrap() <= seconds, "{time}");
                assert!(time["seconds_to"].as_f64().is_none_or(|to| to >= seconds), "{time}");
                assert!(time["passes"].as_u64().is_none_or(|passes| passes >= 8), "{time}");
                assert!(seconds >= before, "{row}");
                before = seconds;
            }
            *count += i32::from(time["cheapest"] == true);
        }
    }
    assert!(cheapest.iter().all(|count| *count <= 1), "{table}");
}

#[tokio::test]
async fn a_plan_predicts_when_it_is_asked_to() {
    let service = TestService::start().await;
    let plan = async |query: &str, document: &Value| -> Value {
        let request = service.request(Method::POST, &format!("/v1/plan{query}")).json(document);
        request.send().await.unwrap().json().await.unwrap()
    };
    let mut document = small_job();
    document["stop"] = json!({ "relative_error": 0.03, "view_relative_error": 0.2 });
    document["grids"][0]["cells"] = json!([6, 5]);
    let bare = plan("", &document).await;
    assert!(bare["plan"].is_object() && bare.get("predictions").is_none(), "{bare}");
    assert_eq!(plan("?predict=false", &document).await, bare);
    let mut predicted = plan("?predict=true", &document).await;
    let predictions = predicted.as_object_mut().unwrap().remove("predictions").unwrap();
    assert_eq!(predicted, bare);
    assert!(predictions["threads"].as_u64().unwrap() >= 1 && predictions["pilot_seconds"].as_f64().unwrap() > 0.0);
    assert_eq!(predictions["confidence"], 0.95);
    for (output, asked) in [("grids", 0.03), ("views", 0.2)] {
        check_table(&predictions[output], "sppm");
        assert_eq!(predictions[output]["asked_relative_error"], asked);
    }
    let views = predictions["views"]["methods"].as_array().unwrap();
    let refused = views.iter().find(|row| row["method"] == "light_tracing").unwrap();
    assert_eq!(refused["refusal"]["code"], "grids_only");
    // grids alone, through a clear closure: refused with the reason that a job would be refused with
    document.as_object_mut().unwrap().remove("views");
    document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
    document["method"] = json!("auto");
    let clear = plan("?predict=true", &document).await;
    let (predictions, planned) = (&clear["predictions"], &clear["plan"]["methods"]["grids"]["name"]);
    assert!(predictions["views"].is_null(), "{predictions}");
    check_table(&predictions["grids"], planned.as_str().unwrap());
    let rows = predictions["grids"]["methods"].as_array().unwrap();
    let refused = rows.iter().find(|row| row["method"] == "two_stage").unwrap();
    assert_eq!(refused["refusal"]["code"], "clear_closures");
}

/// A job that is posted with `predict` has the table, and its convergence the times of its own method beside those that passes took,
/// the same bits of results as without.
#[tokio::test]
async fn what_was_foretold_stays_with_the_job() {
    let service = TestService::start().await;
    let document = small_job();
    let finished = async |query: &str| -> Value {
        let response = service.post(&format!("/v1/jobs{query}"), &document).send().await.unwrap();
        let job: Value = response.json().await.unwrap();
        assert_eq!(job.get("predictions").is_some(), query.contains("true"), "{job}");
        let path = job["links"]["self"].as_str().unwrap();
        service.finished(path).await;
        service.json(path).await
    };
    let (bare, predicted) = (finished("").await, finished("?predict=true").await);
    assert_eq!(bare["grids"], predicted["grids"]);
    check_table(&predicted["predictions"]["grids"], "sppm");
    let told = |job: &Value, part: &str| job["links"][part].as_str().unwrap().to_owned();
    let history = service.json(&told(&predicted, "convergence")).await;
    for output in ["grids", "views"] {
        let rows = predicted["predictions"][output]["methods"].as_array().unwrap();
        let own = rows.iter().find(|row| row["planned"] == true).unwrap();
        let foretold = history[output]["predicted_times"].as_array().unwrap();
        let (asked, accuracies) = foretold.split_last().unwrap();
        assert_eq!((accuracies, asked), (&own["accuracies"].as_array().unwrap()[..], &own["asked"]));
        assert_eq!(asked["relative_error"], history[output]["asked_relative_error"]);
    }
    assert_eq!(service.json(&told(&bare, "convergence")).await["grids"]["predicted_times"], json!([]));
    for (job, is_drawn) in [(&predicted, true), (&bare, false)] {
        let svg = service.get(&told(job, "convergence_svg")).send().await.unwrap().text().await.unwrap();
        assert_eq!(svg.contains("predicted before"), is_drawn);
    }
}

#[tokio::test]
async fn a_wrong_wish_for_predictions_is_named() {
    let service = TestService::start().await;
    for (query, name) in [("predict=maybe", "predict"), ("predict=", "predict"), ("foretell=true", "foretell")] {
        let request = service.request(Method::POST, &format!("/v1/plan?{query}")).json(&small_job());
        let of_plan = problem(request.send().await.unwrap(), 422).await;
        assert_eq!(of_plan["errors"][0]["parameter"], name, "{of_plan}");
        let request = service.post(&format!("/v1/jobs?{query}"), &small_job());
        assert_eq!(problem(request.send().await.unwrap(), 422).await["errors"], of_plan["errors"]);
    }
}

/// At night nothing is lit, and every time is 0.
#[tokio::test]
async fn in_the_dark_nothing_takes_time() {
    let service = TestService::start().await;
    let mut document = small_job();
    document["sky"]["sun_position"]["altitude_deg"] = json!(-10);
    let request = service.request(Method::POST, "/v1/plan?predict=true").json(&document);
    let plan: Value = request.send().await.unwrap().json().await.unwrap();
    let row = &plan["predictions"]["grids"]["methods"][0];
    assert_eq!(
        (&row["seconds_to_first_number"], &row["accuracies"][5]["seconds"]),
        (&json!(0.0), &json!(0.0)),
        "{row}"
    );
}

#[test]
fn the_command_prints_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("job.json");
    std::fs::write(&job, small_job().to_string()).unwrap();
    let plan = |arguments: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_skyduct")).arg("plan").arg(&job).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let (bare, table) = (plan(&[]), plan(&["--predict"]));
    let added = table.strip_prefix(&bare).unwrap();
    for piece in [
        "seconds to each relative error (at 95 % confidence)",
        "0.1 %",
        "sppm (planned)",
        "light_tracing, ",
        ": refused (grids_only)",
    ] {
        assert!(added.contains(piece), "{piece}: {added}");
    }
    let json: Value = serde_json::from_str(&plan(&["--predict", "--json"])).unwrap();
    check_table(&json["predictions"]["views"], "sppm");
    assert!(serde_json::from_str::<Value>(&plan(&["--json"])).unwrap().get("predictions").is_none());
}

#[test]
fn a_rendered_job_keeps_what_was_foretold() {
    let folder = tempfile::tempdir().unwrap();
    let (job, out) = (folder.path().join("job.json"), folder.path().join("out"));
    std::fs::write(&job, small_job().to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
    let output = command.arg("render").arg(&job).arg("--out").arg(&out).arg("--predict").output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("sppm (planned)"), "{said}");
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let result: Value = serde_json::from_str(&read("result.json")).unwrap();
    check_table(&result["predictions"]["grids"], "sppm");
    assert!(read("convergence.svg").contains("predicted before"));
    let history: Value = serde_json::from_str(&read("convergence.json")).unwrap();
    assert_eq!(history["grids"]["predicted_times"].as_array().unwrap().len(), 7);
}
