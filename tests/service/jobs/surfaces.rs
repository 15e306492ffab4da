//! Light on the faces of a room, its model, and the verdict on a target.

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use crate::common::{TestService, problem, small_job};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// The faces and the opening absorb what comes into the room, to 4 %: the faces by midpoints of patches, the opening by the mean of the ceiling.
#[tokio::test]
async fn faces_absorb_the_flux_and_targets_have_verdicts() {
    let service = TestService::start().await;
    let mut document = small_job();
    document.as_object_mut().unwrap().remove("views");
    document["method"] = json!("auto");
    document["stop"] = json!({ "relative_error": 0.1, "max_passes": 64 });
    document["surfaces"] = json!(true);
    document["grids"][0]["target_lux"] = json!(90_000.0);
    let path = service.submit(&document).await;
    let job = service.finished(&path).await;
    assert_eq!(job["status"], "succeeded");
    assert_eq!(job["links"]["scene"], format!("{path}/scene.glb"));

    let surfaces = service.json(job["links"]["surfaces"].as_str().unwrap()).await;
    let faces = surfaces["faces"].as_array().unwrap();
    assert_eq!((faces.len(), job["grids"].as_array().map(Vec::len)), (6, Some(1)));
    let (mut absorbed, mut patches) = (0.0, 0);
    for face in faces {
        let lux = number(&face["mean_lux"]);
        absorbed += number(&face["area_m2"]) * lux * (1.0 - number(&face["reflectance"]));
        if face["name"] == "ceiling" {
            absorbed += std::f64::consts::PI * 0.127 * 0.127 * lux * number(&face["reflectance"]);
        }
        for patch in face["patches"].as_array().unwrap() {
            patches += 1;
            let luminance = number(&patch["illuminance_lux"]) * number(&face["reflectance"]) / std::f64::consts::PI;
            assert!((number(&patch["luminance_cd_m2"]) - luminance).abs() <= 1e-9 * luminance);
            assert!(number(&patch["standard_error_lux"]) > 0.0);
        }
    }
    let flux = number(&job["tubes"][0]["into_room"]["flux_lm"]);
    assert!((absorbed / flux - 1.0).abs() < 0.04, "{absorbed} lm of {flux} lm");
    assert!((900..1300).contains(&patches), "{patches}");

    let model = service.get(&format!("{path}/scene.glb")).send().await.unwrap();
    assert_eq!(model.headers()["content-type"], "model/gltf-binary");
    let model = model.bytes().await.unwrap();
    assert!(model.starts_with(b"glTF\x02\0\0\0") && model[8..12] == (model.len() as u32).to_le_bytes());

    let target = &job["grids"][0]["statistics"]["target"];
    assert_eq!((&target["verdict"], number(&target["area_percent"])), (&json!("not_met"), 0.0));
    let report = service.get(job["links"]["report"].as_str().unwrap()).send().await.unwrap().text().await.unwrap();
    assert!(report.contains("<p class=\"sentence bad\">The target of 90\u{a0}000 lx is not met"), "{report}");
    let path_of_report = job["links"]["report"].as_str().unwrap();
    let report = service
        .get(&format!("{path_of_report}?target_lux=1&target_of=most"))
        .send()
        .await
        .unwrap()
        .text()
        .await
        .unwrap();
    assert!(
        report.contains("<p class=\"sentence good\">The target of 1 lx on 95 % of the area is met: all of the area"),
        "{report}"
    );
    assert!(report.contains(&format!("{path}/report.pdf?target_lux=1&amp;target_of=most")), "{report}");
    for query in ["target_lux=0", "target_of=all", "target_lux=1&target_of=all"] {
        problem(service.get(&format!("{path}/report.pdf?{query}")).send().await.unwrap(), 422).await;
    }

    let table = service.get(&format!("{path}/grids/workplane.csv?decimal=comma")).send().await.unwrap();
    let table = table.text().await.unwrap();
    let head = "x_m;y_m;z_m;normal_x;normal_y;normal_z;area_m2;illuminance_lux;standard_error_lux\n";
    assert!(table.starts_with(&format!("{head}0,333333333;0,5;0,85;0;0;1;0,666666667;")), "{table}");
    problem(service.get(&format!("{path}/grids/workplane.json?decimal=comma")).send().await.unwrap(), 422).await;
    document.as_object_mut().unwrap().remove("surfaces");
    let without = service.submit(&document).await;
    assert!(service.finished(&without).await["links"]["scene"].is_null());
    let missing = problem(service.get(&format!("{without}/scene.glb")).send().await.unwrap(), 404).await;
    assert!(missing["detail"].as_str().is_some_and(|detail| detail.contains("surfaces")), "{missing}");
}

/// The triangles of a table stand where its object stands, in the model, too; they outlive the uploaded mesh.
#[tokio::test]
async fn meshes_of_a_job_outlive_their_files() {
    let service = TestService::start().await;
    let table = "v 0 0 0\nv 1 0 0\nv 1 0.5 0\nv 0 0.5 0\nusemtl top\nf 1 2 3 4\n";
    let upload = service.request(Method::POST, "/v1/meshes").header("content-type", "model/obj").body(table);
    let mesh: Value = upload.send().await.unwrap().json().await.unwrap();
    let id = mesh["id"].as_str().unwrap();
    let mut document = small_job();
    document.as_object_mut().unwrap().remove("views");
    document["method"] = json!("auto");
    document["stop"] = json!({ "relative_error": 0.5, "max_passes": 4 });
    document["surfaces"] = json!(true);
    document["room"]["objects"] = json!([{ "kind": "mesh", "mesh": id, "unit": "m", "position_m": [0.5, 0.75, 0.7],
                                           "surfaces": { "top": { "reflectance": 0.5 } } }]);
    let path = service.submit(&document).await;
    let job = service.finished(&path).await;
    let link = job["links"]["meshes"].as_str().unwrap();
    assert_eq!(link, format!("{path}/meshes.json"));
    let deleted = service.request(Method::DELETE, &format!("/v1/meshes/{id}")).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);

    let meshes = service.json(link).await;
    assert_eq!((&meshes["triangles"], &meshes["cell_m"]), (&json!(2), &Value::Null));
    let [mesh] = &meshes["meshes"].as_array().unwrap()[..] else { panic!("{meshes}") };
    let part = &mesh["parts"][0];
    assert_eq!((&mesh["pointer"], &part["role"]), (&json!("/room/objects/0"), &json!("object")));
    assert_eq!(part["corners_m"], json!([[0.5, 0.75, 0.7], [1.5, 0.75, 0.7], [1.5, 1.25, 0.7], [0.5, 1.25, 0.7]]));
    let model = service.get(&format!("{path}/scene.glb")).send().await.unwrap().bytes().await.unwrap();
    let text = String::from_utf8_lossy(&model);
    assert!(text.contains("\"name\":\"object 1\""), "{}", &text[..2000]);
    let plain = service.submit(&small_job()).await;
    assert!(service.finished(&plain).await["links"]["meshes"].is_null());
    problem(service.get(&format!("{plain}/meshes.json")).send().await.unwrap(), 404).await;
}
