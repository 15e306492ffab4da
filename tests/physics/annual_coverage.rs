//! Intervals of a year's values by many seeds: how often they hold the value of a long run.

use serde_json::{Value, json};
use skyduct::present::outputs::{Annual, Format};

use crate::annual::{classroom, file, prepared};

/// Number of jobs whose intervals are counted.
const SEEDS: u64 = 100;

/// Value of a sensor with the standard error that its job reports.
type Estimated = (f64, f64);

/// Returns the columns of the daylight autonomy of 300 lx and of the exposure of all sensors, after so many passes.
fn columns(document: &Value, seed: u64, passes: u64) -> [Vec<Estimated>; 2] {
    let mut document = document.clone();
    document["seed"] = json!(seed);
    let points = file(&prepared(&document), passes, Annual::Points("desks".to_owned()), Format::Json);
    let points: Value = serde_json::from_slice(&points).unwrap();
    ["da_300_percent", "exposure_klxh"].map(|name| {
        let columns = points["columns"].as_array().unwrap();
        let column = columns.iter().find(|column| column["name"] == name);
        let column = column.unwrap();
        let [values, errors] = ["values", "standard_errors"].map(|field| column[field].as_array().unwrap());
        let number = |value: &Value| value.as_f64().unwrap();
        values.iter().map(number).zip(errors.iter().map(number)).collect()
    })
}

/// Counts the intervals of 95 % of `passes` passes that hold what a job of `long` passes found, over all seeds and sensors.
fn holds(document: &Value, passes: u64, long: u64) -> [f64; 2] {
    let truth = columns(document, 1 << 40, long);
    let mut held = [0.0; 2];
    for seed in 0..SEEDS {
        let found = columns(document, seed, passes);
        for ((held, found), truth) in held.iter_mut().zip(&found).zip(&truth) {
            let is_held = |((value, error), (expected, other)): &(&Estimated, &Estimated)| {
                (value - expected).abs() <= 1.96 * error.hypot(*other)
            };
            *held += found.iter().zip(truth).filter(is_held).count() as f64 / found.len() as f64;
        }
    }
    println!("{held:?} of {SEEDS}");
    held.map(|held| 100.0 * held / SEEDS as f64)
}

/// Fails unless a share of intervals is 95 % within four standard errors of so many independent jobs, of which sensors are no more.
#[track_caller]
fn assert_held([autonomy, exposure]: [f64; 2]) {
    let spread = 4.0 * (95.0 * 5.0 / SEEDS as f64).sqrt();
    assert!((exposure - 95.0).abs() < spread, "exposure: {exposure} %");
    assert!((autonomy - 95.0).abs() < spread, "autonomy: {autonomy} %");
}

#[test]
#[ignore = "minutes"]
fn intervals_of_responses_hold() {
    let mut document = classroom();
    document["grids"][0]["cells"] = json!([4, 3]);
    document["stop"] = json!({ "relative_error": 0.02 });
    assert_held(holds(&document, 12, 600));
}

#[test]
#[ignore = "minutes"]
fn intervals_of_traced_moments_hold() {
    let mut document = classroom();
    document["tubes"] = json!([document["tubes"][0]]);
    document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
    document["grids"][0]["cells"] = json!([2, 2]);
    document["annual"]["period"] = json!({ "from": "05-10", "to": "06-20" });
    document["stop"] = json!({ "relative_error": 0.0001 });
    assert_held(holds(&document, 12, 300));
}
