//! What must not change a result: turning the room and the sky together.

use crate::documents::{prepare, render};
use serde_json::{Value, json};

/// A tube that leans to the east, under the sun, above a box.
fn leaning(document: &mut Value) {
    document["tubes"][0]["segments"] =
        json!([{ "length_m": 0.5 }, { "length_m": 0.5, "tilt_deg": 45, "azimuth_deg": 90 }]);
    document["sky"]["direct_normal_illuminance_lux"] = json!(60000);
    document["room"]["objects"] = json!([{ "kind": "box", "size_m": [0.3, 0.4, 0.5], "position_m": [0.5, 0.6, 0],
        "rotation_deg": 10, "surface": { "reflectance": 0.4 } }]);
    document["stop"] = json!({ "relative_error": 0.15 });
}

/// A bent tube, a box and the sun: room and sun turned by the same angle give the same illuminance in the room's frame. The
/// random numbers are the same, so that all but rounding (and the rare photon that rounding sends elsewhere) is equal.
#[test]
fn room_and_sky_turn_together() {
    let turned = |angle: f64| {
        let prepared = prepare("S3", |document| {
            document["room"]["rotation_deg"] = json!(angle);
            let azimuth = document["sky"]["sun_position"]["azimuth_deg"].as_f64().unwrap();
            document["sky"]["sun_position"]["azimuth_deg"] = json!((azimuth + angle).rem_euclid(360.0));
            leaning(document);
        });
        render(&prepared)
    };
    let [a, b] = [turned(0.0), turned(137.0)];
    assert_eq!(a.passes, b.passes);
    for (a, b) in a.grids[0].sensors.iter().zip(&b.grids[0].sensors) {
        // sensors under the box are dark
        assert!((a.mean - b.mean).abs() <= 1e-6 * a.mean, "{} {}", a.mean, b.mean);
    }
}

/// Turning the room alone under the sun does change it: the test above could fail.
#[test]
fn a_room_that_turns_alone_changes() {
    let turned = |angle: f64| {
        let prepared = prepare("S3", |document| {
            document["room"]["rotation_deg"] = json!(angle);
            leaning(document);
        });
        render(&prepared)
    };
    let [a, b] = [turned(0.0), turned(137.0)];
    let mean = |estimate: &skyduct::estimate::Estimate| estimate.grids[0].mean.mean;
    assert!((mean(&a) / mean(&b) - 1.0).abs() > 0.02, "{} {}", mean(&a), mean(&b));
}
