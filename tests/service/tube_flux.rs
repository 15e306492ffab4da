//! Fluxes of a tube under many skies, without a job.

use std::f64::consts::PI;

use reqwest::Method;
use serde_json::{Value, json};

use crate::common::{self, TestService};

const DIAMETER_M: f64 = 0.3;
const TRANSMITTANCE: f64 = 0.6;

fn tube() -> Value {
    json!({ "diameter_m": DIAMETER_M, "reflectance": 0.98, "segments": [{ "length_m": 4.0 * DIAMETER_M }],
            "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": TRANSMITTANCE } })
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Sky and sun of a straight tube, and its patches, against the closed forms of its transmission within 4 standard errors.
#[tokio::test]
async fn fluxes_are_those_of_the_closed_forms() {
    let service = TestService::start().await;
    let sky = |altitude: f64| {
        json!({ "cie_type": 1, "diffuse_horizontal_illuminance_lux": 500.0 * altitude, "direct_normal_illuminance_lux": 50_000,
                "sun_position": { "altitude_deg": altitude, "azimuth_deg": 140 } })
    };
    let request = json!({ "tube": tube(), "skies": [sky(20.0), sky(65.0)], "relative_error": 0.002 });
    let found: Value = service.post("/v1/tubes/flux", &request).send().await.unwrap().json().await.unwrap();
    let area = 0.25 * PI * DIAMETER_M * DIAMETER_M;
    let patches = found["patches"]["centres_m"].as_array().unwrap();
    assert!((patches.len() as f64 * number(&found["patches"]["area_m2"]) / area - 1.0).abs() < 1e-12);
    for (index, altitude) in [20.0, 65.0].into_iter().enumerate() {
        let path = format!(
            "/v1/tubes/transmission?reflectance=0.98&aspect_ratio=4&altitude_deg={altitude}&cie_type=1&sun_altitude_deg={altitude}"
        );
        let closed = service.json(&path).await;
        let at = &found["fluxes"][index];
        assert_eq!(at["sky"], index);
        assert!((number(&at["sun_altitude_deg"]) - altitude).abs() < 1e-9);
        let outside = [("of_sky", 500.0 * altitude), ("of_sun", 50_000.0 * altitude.to_radians().sin())];
        let through = [number(&closed["sky"]["transmission"]), number(&closed["beams"][0]["transmission"])];
        for ((source, lux), through) in outside.into_iter().zip(through) {
            let flux = &at[source];
            // the disc of the sun is half a degree wide, over which the transmission is all but straight
            for (place, truth) in [
                ("at_collector", lux * area),
                ("at_diffuser", lux * area * through),
                ("into_room", lux * area * through * TRANSMITTANCE),
            ] {
                let (mean, error) = (number(&flux[place]["flux_lm"]), number(&flux[place]["standard_error_lm"]));
                assert!(
                    (mean - truth).abs() < 4.0 * error + 1e-4 * truth,
                    "{source} {place}: {mean} +- {error}, {truth}"
                );
                assert!(error < 0.002 * truth, "{source} {place}: {error} of {truth}");
            }
            let sum: f64 = flux["patches_lm"].as_array().unwrap().iter().map(number).sum();
            assert!((sum / number(&flux["into_room"]["flux_lm"]) - 1.0).abs() < 1e-12);
        }
        // an overcast sky has no azimuth, so that the sectors of a ring get the same; mirrors gather the sun in patches
        let patches = |source: &str| -> Vec<[f64; 2]> {
            let list = |field: &str| at[source][field].as_array().unwrap().iter().map(number).collect::<Vec<_>>();
            list("patches_lm")
                .into_iter()
                .zip(list("patch_standard_errors_lm"))
                .map(|(flux, error)| [flux, error])
                .collect()
        };
        let worst = |patches: &[[f64; 2]]| {
            let mean = patches.iter().map(|[flux, _]| flux).sum::<f64>() / patches.len() as f64;
            patches.iter().map(|[flux, error]| (flux - mean).abs() / error).fold(0.0, f64::max)
        };
        let of_rings: Vec<f64> = patches("of_sky").chunks(6).map(worst).collect();
        println!("{altitude}: {of_rings:?} standard errors, of the sun {}", worst(&patches("of_sun")));
        assert!(of_rings.iter().all(|worst| *worst < 4.0) && worst(&patches("of_sun")) > 4.0);
    }
}

/// Times of a day at a place: none at night, and the same bits again.
#[tokio::test]
async fn a_day_of_fluxes() {
    let service = TestService::start().await;
    let times = ["2011-06-21T00:00:00+02:00", "2011-06-21T12:00:00+02:00", "2011-06-21T18:00:00+02:00"];
    let request = json!({
        "tube": tube(), "location": { "latitude_deg": 55.77, "longitude_deg": 12.5 }, "skies": [{ "cie_type": 12 }, { "cie_type": 5 }],
        "times": times
    });
    let post =
        async || -> Value { service.post("/v1/tubes/flux", &request).send().await.unwrap().json().await.unwrap() };
    let found = post().await;
    let fluxes = found["fluxes"].as_array().unwrap();
    assert_eq!(fluxes.len(), 6);
    for (index, at) in fluxes.iter().enumerate() {
        assert_eq!((&at["sky"], &at["time"]), (&json!(index / 3), &json!(index % 3)));
        let night = index % 3 == 0;
        assert_eq!(at["of_sky"].is_null(), night);
        // the fifth type has no beam
        assert_eq!(at["of_sun"].is_null(), night || index > 3);
        assert_eq!(night, at["warnings"][0]["code"] == "sun_below_horizon", "{at}");
    }
    assert_eq!(post().await, found);
}

/// A horizon of the tube hides the same under every sky of a request.
#[tokio::test]
async fn every_sky_has_the_horizon_of_the_tube() {
    let service = TestService::start().await;
    let sky = json!({ "cie_type": 5, "diffuse_horizontal_illuminance_lux": 10_000.0 });
    let mut behind = tube();
    behind["horizon"] = json!([[0, 40], [180, 40]]);
    let request = json!({ "tube": behind, "skies": [sky, sky] });
    let found: Value = service.post("/v1/tubes/flux", &request).send().await.unwrap().json().await.unwrap();
    let [one, other] = [0, 1].map(|sky| &found["fluxes"][sky]["of_sky"]);
    assert_eq!(one, other);
    // 1 - sin^2 40 of a uniform sky is left, and a tenth of the luminance below
    let area = 0.25 * PI * DIAMETER_M * DIAMETER_M;
    let hidden = 40f64.to_radians().sin().powi(2);
    let truth = 10_000.0 * area * (1.0 - 0.9 * hidden);
    let flux = &one["at_collector"];
    let [mean, error] = ["flux_lm", "standard_error_lm"].map(|of| number(&flux[of]));
    assert!((mean - truth).abs() < 4.0 * error + 1e-4 * truth, "{mean} +- {error}, {truth}");
}

/// A cylinder of `DIAMETER_M` and four times this length as a mesh of 32 sides, open above, in the words of an OBJ file.
fn pipe_of_facets() -> String {
    const SIDES: usize = 32;
    let mut text = String::new();
    for z in [0.0, 4.0 * DIAMETER_M] {
        for k in 0..SIDES {
            let (sin, cos) = (2.0 * PI * k as f64 / SIDES as f64).sin_cos();
            text += &format!("v {} {} {z}\n", 0.5 * DIAMETER_M * cos, 0.5 * DIAMETER_M * sin);
        }
    }
    text += "usemtl pipe\n";
    for k in 0..SIDES {
        let next = (k + 1) % SIDES;
        text += &format!("f {} {} {} {}\n", k + 1, next + 1, next + SIDES + 1, k + SIDES + 1);
    }
    let closure: String = (0..SIDES).map(|k| format!(" {}", k + 1)).collect();
    text + "usemtl closure\nf" + &closure + "\n"
}

/// Tubes through roofs and walls, of cylinders and as meshes: a uniform sky and the ground on a tilted plane, and the sun, which a pipe that
/// points toward it does not reflect, within 4 standard errors of closed forms.
#[tokio::test]
async fn tubes_through_roofs_and_walls_see_their_part_of_the_sky() {
    let service = TestService::start().await;
    let posted = service.request(Method::POST, "/v1/meshes").header("content-type", "model/obj").body(pipe_of_facets());
    let mesh: Value = posted.send().await.unwrap().json().await.unwrap();
    let closure = json!({ "role": "diffuser", "kind": "lambertian", "transmittance": TRANSMITTANCE });
    let meshed = json!({ "mesh": mesh["id"], "unit": "m", "opening_diameter_m": DIAMETER_M, "normal": "face",
                         "parts": { "pipe": { "role": "pipe", "reflectance": 0.98 }, "closure": closure } });
    let mut cylinder = tube();
    cylinder["normal"] = json!("face");
    let (sky_lux, beam_lux, ground) = (10_000.0, 50_000.0, 0.3);
    let area = 0.25 * PI * DIAMETER_M * DIAMETER_M;
    for (tube, tilt_deg, altitude_deg) in [
        (&cylinder, 35.0f64, 55.0f64),
        (&cylinder, 90.0, 30.0),
        (&meshed, 0.0, 90.0),
        (&meshed, 35.0, 55.0),
        (&meshed, 90.0, 30.0),
    ] {
        let sky = json!({ "cie_type": 5, "diffuse_horizontal_illuminance_lux": sky_lux, "direct_normal_illuminance_lux": beam_lux,
                          "sun_position": { "altitude_deg": altitude_deg, "azimuth_deg": 200 } });
        // the second sky is computed without the tube's own document
        let request = json!({
            "tube": tube, "face": { "tilt_deg": tilt_deg, "azimuth_deg": 200 }, "surroundings": { "ground_reflectance": ground },
            "skies": [sky, sky], "relative_error": 0.005
        });
        let found: Value = service.post("/v1/tubes/flux", &request).send().await.unwrap().json().await.unwrap();
        let what = format!("{tilt_deg} degrees, {}", if tube == &meshed { "mesh" } else { "cylinder" });
        let cos_tilt = tilt_deg.to_radians().cos();
        let on_ground = sky_lux + beam_lux * altitude_deg.to_radians().sin();
        let of_sky = area * 0.5 * (sky_lux * (1.0 + cos_tilt) + ground * on_ground * (1.0 - cos_tilt));
        let across = (90.0 - altitude_deg - tilt_deg).to_radians().cos();
        for at in found["fluxes"].as_array().unwrap_or_else(|| panic!("{what}: {found}")) {
            let mut truths =
                vec![("of_sky", "at_collector", of_sky), ("of_sun", "at_collector", area * beam_lux * across)];
            if across > 1.0 - 1e-9 {
                truths.push(("of_sun", "into_room", area * beam_lux * TRANSMITTANCE));
            }
            for (source, place, truth) in truths {
                let flux = &at[source][place];
                let (mean, error) = (number(&flux["flux_lm"]), number(&flux["standard_error_lm"]));
                println!("{what}: {source} {place} {mean} +- {error}, {truth}");
                // the disc of the sun is half a degree wide: a fiftieth of it meets the mirror
                assert!((mean - truth).abs() < 4.0 * error + 1e-3 * truth, "{what}: {source} {place} {mean}, {truth}");
                assert!(error < 0.005 * truth, "{what}: {source} {place}: {error} of {truth}");
            }
        }
    }
}

/// Everything that is wrong is named by its place in the request.
#[tokio::test]
async fn what_is_wrong_is_named() {
    let service = TestService::start().await;
    let good = || {
        json!({ "tube": tube(), "location": { "latitude_deg": 55.0, "longitude_deg": 12.5 }, "skies": [{ "cie_type": 12 }],
                "times": ["2011-06-21T12:00:00Z"] })
    };
    let cases: [(&str, Value, &str); 9] = [
        ("/tube/reflectance", json!(1.5), "/tube/reflectance"),
        ("/tube/length", json!(1.5), "/tube/length"),
        ("/skies/0/cie_type", json!(17), "/skies/0/cie_type"),
        ("/skies", json!([]), "/skies"),
        ("/times/0", json!("noon"), "/times/0"),
        ("/times", json!(vec!["2011-06-21T12:00:00Z"; 1001]), "/times"),
        ("/location/latitude_deg", json!(91), "/location/latitude_deg"),
        ("/relative_error", json!(0), "/relative_error"),
        ("/rooms", json!([]), "/rooms"),
    ];
    for (place, value, pointer) in cases {
        let mut request = good();
        let (parent, field) = place.rsplit_once('/').unwrap();
        match request.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[field.parse::<usize>().unwrap()] = value,
            object => object[field] = value,
        }
        let answer = service.post("/v1/tubes/flux", &request).send().await.unwrap();
        let problem = common::problem(answer, 422).await;
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{problem}");
    }
    let mut request = good();
    request["tube"]["normal"] = json!("face");
    let answer = service.post("/v1/tubes/flux", &request).send().await.unwrap();
    assert_eq!(common::problem(answer, 422).await["errors"][0]["pointer"], "/face");
    let mut request = good();
    request["times"] = json!([]);
    let answer = service.post("/v1/tubes/flux", &request).send().await.unwrap();
    let refused = common::problem(answer, 422).await;
    assert_eq!(refused["errors"][0]["pointer"], "/times");
    assert!(!refused.to_string().contains("`time`"), "a request has `times`: {refused}");
}
