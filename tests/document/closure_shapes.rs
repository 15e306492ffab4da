//! Square closures: fields, bounds, and the places where a square does not fit.

use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, to_scene};
use skyduct::scene::OpeningShape;

use crate::given::{SquarePipe, errors, refused, with};
use crate::schema::parse;

/// A room of 6 m x 4 m with two square closures below pipes of 0.5 m.
fn squares() -> Value {
    let tube = |x: f64| {
        json!({ "centre_m": [x, 2.0], "diameter_m": 0.5, "reflectance": 0.98, "segments": [{ "length_m": 1.0 }],
                "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 },
                "closure_shape": { "kind": "square", "side_m": 0.6 } })
    };
    json!({
        "sky": { "cie_type": 5, "sun_position": { "altitude_deg": 45, "azimuth_deg": 180 } },
        "room": { "size_m": [6, 4, 3] },
        "tubes": [tube(1.5), tube(4.5)],
        "grids": [{ "name": "desk", "height_m": 0.85, "cells": [3, 2] }]
    })
}

fn shape(document: &Value) -> OpeningShape {
    to_scene(&parse(document).unwrap(), &SquarePipe).unwrap().0.tubes[0].opening()
}

#[test]
fn squares_have_the_side_and_the_turn_that_they_state() {
    let OpeningShape::Square { side, along } = shape(&squares()) else { panic!("no square") };
    assert_eq!((side, along.x, along.y), (0.6, 1.0, 0.0));
    let turned = with(squares(), "/tubes/0/closure_shape/rotation_deg", json!(30));
    let OpeningShape::Square { along, .. } = shape(&turned) else { panic!("no square") };
    // clockwise seen from above
    assert!((along.x - 0.75f64.sqrt()).abs() < 1e-15 && (along.y + 0.5).abs() < 1e-15);
    let parsed = parse(&squares()).unwrap();
    let echoed: Value = serde_json::to_value(&parsed.tubes).unwrap();
    assert_eq!(echoed[0]["closure_shape"]["transition_transmittance"], json!(1.0));
    let mut round = squares();
    round["tubes"][0].as_object_mut().unwrap().remove("closure_shape");
    assert_eq!(shape(&round), OpeningShape::Disc { radius: 0.25 });
    let echoed: Value = serde_json::to_value(&parse(&round).unwrap().tubes).unwrap();
    assert!(echoed[0].get("closure_shape").is_none());
}

#[test]
fn bounds_are_named() {
    let at = |field: &str, value: Value| with(squares(), &format!("/tubes/1/closure_shape/{field}"), value);
    for (field, value) in [
        ("side_m", json!(0.0)),
        ("side_m", json!(100.5)),
        ("rotation_deg", json!(361)),
        ("transition_transmittance", json!(1.01)),
        ("transition_transmittance", json!(-0.1)),
    ] {
        refused(&at(field, value), &format!("/tubes/1/closure_shape/{field}"), FieldErrorCode::OutOfRange);
    }
    // the square holds the end of the pipe
    let narrow = refused(&at("side_m", json!(0.49)), "/tubes/1/closure_shape/side_m", FieldErrorCode::Invalid);
    assert!(narrow.detail.contains(">= 0.5"), "{narrow:?}");
    parse(&at("side_m", json!(0.5))).unwrap();
    for diffuser in [json!({ "kind": "open" }), json!({ "kind": "clear", "transmittance": 0.9 })] {
        let document = with(squares(), "/tubes/1/diffuser", diffuser);
        refused(&document, "/tubes/1/diffuser/kind", FieldErrorCode::Invalid);
    }
    // faults beside a wrong kind are found, and no fault follows from it
    let mut document = at("kind", json!("hexagon"));
    document["tubes"][0]["reflectance"] = json!(2);
    let mut pointers: Vec<_> = errors(&document).0.into_iter().map(|error| error.pointer).collect();
    pointers.sort();
    assert_eq!(pointers, ["/tubes/0/reflectance", "/tubes/1/closure_shape/kind"]);
}

#[test]
fn squares_must_lie_in_the_ceiling_and_apart() {
    let place = |x: f64, y: f64, turn: f64| {
        let document = with(squares(), "/tubes/0/centre_m", json!([x, y]));
        with(document, "/tubes/0/closure_shape/rotation_deg", json!(turn))
    };
    // to the walls, to the other square, and corner to side
    for (x, y, turn) in [(0.3, 0.3, 0.0), (3.9, 2.0, 0.0), (3.77, 2.0, 45.0), (0.43, 0.43, 45.0), (3.9, 2.6, 90.0)] {
        parse(&place(x, y, turn)).unwrap();
    }
    for (x, y, turn, pointer) in [
        (0.29, 2.0, 0.0, "/tubes/0/centre_m/0"),
        (2.0, 0.4, 45.0, "/tubes/0/centre_m/1"),
        (3.95, 2.0, 0.0, "/tubes/1/centre_m"),
        (3.79, 2.0, 45.0, "/tubes/1/centre_m"),
        (3.95, 2.55, 0.0, "/tubes/1/centre_m"),
    ] {
        refused(&place(x, y, turn), pointer, FieldErrorCode::Invalid);
    }
    let mut round = place(3.96, 2.0, 0.0);
    round["tubes"][0].as_object_mut().unwrap().remove("closure_shape");
    refused(&round, "/tubes/1/centre_m", FieldErrorCode::Invalid);
    round["tubes"][0]["centre_m"] = json!([3.94, 2.0]);
    parse(&round).unwrap();
    let mut narrow = with(squares(), "/room/size_m", json!([6, 0.55, 3]));
    narrow["tubes"].as_array_mut().unwrap().truncate(1);
    refused(&narrow, "/tubes/0/closure_shape/side_m", FieldErrorCode::Invalid);
    // beyond the inner corner of an L, though its centre is farther from the walls than half of its side
    let l = json!({ "plan": { "outline_m": [[0, 0], [6, 0], [6, 2], [3, 2], [3, 4], [0, 4]] },
                    "ceiling": { "kind": "flat", "height_m": 3 } });
    let in_l = |x: f64, y: f64| {
        let mut document = with(with(squares(), "/room", l.clone()), "/tubes/0/centre_m", json!([x, y]));
        document["tubes"].as_array_mut().unwrap().truncate(1);
        document
    };
    parse(&in_l(2.7, 2.3)).unwrap();
    let beyond = refused(&in_l(2.75, 1.75), "/tubes/0/closure_shape/side_m", FieldErrorCode::Invalid);
    assert!(beyond.detail.contains("its rim is 0.05"), "{beyond:?}");
}

#[test]
fn a_square_below_a_slope_hangs_by_its_extent_uphill() {
    let mut attic = squares();
    attic["room"] = json!({ "plan": { "outline_m": [[0, 0], [6, 0], [6, 4], [0, 4]] },
        "ceiling": { "kind": "sloped", "point_m": [0, 0, 2.2], "rise_toward_deg": 0, "pitch_deg": 30 } });
    let hung = |turn: f64, drop: f64| {
        let mut attic = attic.clone();
        let tubes = attic["tubes"].as_array_mut().unwrap();
        tubes.truncate(1);
        (tubes[0]["drop_m"], tubes[0]["closure_shape"]["rotation_deg"]) = (json!(drop), json!(turn));
        attic
    };
    let rise = 30f64.to_radians().tan();
    for (turn, extent) in [(0.0, 0.3), (45.0, 0.3 * 2f64.sqrt())] {
        parse(&hung(turn, extent * rise + 1e-6)).unwrap();
        refused(&hung(turn, extent * rise - 1e-6), "/tubes/0/drop_m", FieldErrorCode::Invalid);
    }
}

#[test]
fn nothing_covers_a_square() {
    let corner = |object: Value| with(squares(), "/room/objects", json!([object]));
    let board = |x: f64| {
        corner(
            json!({ "kind": "box", "size_m": [0.2, 0.2, 1.0], "position_m": [x, 2.35, 2.0], "surface": { "reflectance": 0.5 } }),
        )
    };
    // a disc of that width would leave this corner free
    refused(&board(1.85), "/room/objects/0", FieldErrorCode::Invalid);
    parse(&board(1.91)).unwrap();
    let lamp = |x: f64| {
        with(
            squares(),
            "/room/luminaires",
            json!([{ "kind": "rectangle", "corner_m": [x, 2.2, 3.0], "edge_u_m": [0, 0.3, 0],
            "edge_v_m": [0.3, 0, 0], "luminance_cd_m2": 1000 }]),
        )
    };
    refused(&lamp(1.75), "/room/luminaires/0", FieldErrorCode::Invalid);
    parse(&lamp(1.8)).unwrap();
    let sheet = |x: f64| {
        with(
            squares(),
            "/room/partitions",
            json!([{ "from_m": [x, 2.25], "to_m": [x, 3.0], "height_m": 2.95,
            "surface": { "reflectance": 0.5 } }]),
        )
    };
    let mut cut = sheet(1.75);
    cut["room"] = json!({ "plan": { "outline_m": [[0, 0], [6, 0], [6, 4], [0, 4]] }, "ceiling": { "kind": "flat", "height_m": 3 },
                          "partitions": cut["room"]["partitions"] });
    for tube in cut["tubes"].as_array_mut().unwrap() {
        tube["drop_m"] = json!(0.2);
    }
    refused(&cut, "/room/partitions/0", FieldErrorCode::Invalid);
    cut["room"]["partitions"][0] = sheet(1.8)["room"]["partitions"][0].clone();
    parse(&cut).unwrap();
}
