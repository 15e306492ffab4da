//! The room of job documents: its surfaces and its electric light.

use crate::given::{SquarePipe, base, refused, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, WarningCode, to_scene};
use skyduct::scene::{Channels, Face};

/// The base room with one panel of 0.2 m x 0.1 m in the ceiling.
fn electric() -> Value {
    let panel = json!({ "kind": "rectangle", "corner_m": [0.3, 0.3, 2.032], "edge_u_m": [0, 0.1, 0],
                        "edge_v_m": [0.2, 0, 0], "luminance_cd_m2": 15000 });
    with(base(), "/room/luminaires", json!([panel]))
}

#[test]
fn luminaires() {
    let document = parse(&electric()).unwrap();
    let (scene, ..) = to_scene(&document, &SquarePipe).unwrap();
    assert_eq!(scene.room.luminaires[0].luminance, [15000.0; 3]);
    assert_eq!(scene.channels, Channels::Photopic);
    let coloured = with(electric(), "/room/luminaires/0/luminance_cd_m2", json!([1, 2, 3]));
    let document = parse(&coloured).unwrap();
    assert_eq!(to_scene(&document, &SquarePipe).unwrap().0.channels, Channels::Rgb);

    let panel = "/room/luminaires/0";
    for (field, value, at, code, named) in [
        ("corner_m/2", json!(2.04), "corner_m/2", FieldErrorCode::Invalid, ""),
        ("corner_m/0", json!(1.9), "corner_m/0", FieldErrorCode::Invalid, ""),
        ("corner_m/0", json!(1e9), "corner_m/0", FieldErrorCode::OutOfRange, ""),
        ("edge_u_m", json!([0, 0, 0]), "edge_u_m", FieldErrorCode::Invalid, ""),
        ("edge_u_m", json!([0.1, 0.1, 0]), "edge_v_m", FieldErrorCode::Invalid, ""),
        ("edge_u_m", json!([0, -0.1, 0]), "edge_v_m", FieldErrorCode::Invalid, ""),
        ("luminance_cd_m2", json!(-1), "luminance_cd_m2", FieldErrorCode::OutOfRange, ""),
        ("luminance_cd_m2", json!([1, 1e10, 1]), "luminance_cd_m2/1", FieldErrorCode::OutOfRange, ""),
        ("kind", json!("disc"), "kind", FieldErrorCode::Invalid, ""),
        ("flux_lm", json!(1), "flux_lm", FieldErrorCode::UnknownField, ""),
        // the opening has the radius 0.127 around (1.016, 1.016): 0.126 from its centre is covered, 0.128 is not
        ("corner_m", json!([1.142, 1.0, 2.032]), "", FieldErrorCode::Invalid, "/tubes/0"),
        // the box stands on (0.2, 0.2)..(0.8, 0.8) and is 0.75 high
        ("corner_m", json!([0.75, 0.4, 0.3]), "", FieldErrorCode::Invalid, "/room/objects/0"),
        ("corner_m", json!([0.3, 0.3, 0.75]), "", FieldErrorCode::Invalid, "/room/objects/0"),
    ] {
        let pointer = if at.is_empty() { panel.to_owned() } else { format!("{panel}/{at}") };
        let error = refused(&with(electric(), &format!("{panel}/{field}"), value), &pointer, code);
        assert!(error.detail.contains(named), "{error}");
    }
    let good = [json!([1.144, 1.0, 2.032]), json!([1.142, 1.0, 2.03]), json!([0.81, 0.4, 0.3])];
    for corner in good {
        let document = with(electric(), "/room/luminaires/0/corner_m", corner);
        assert!(parse(&document).is_ok(), "{document}");
    }

    // back to back is a panel that emits on both sides; face on face is a mistake
    let twice = |document: Value, edge_u: Value| {
        let mut second = document["room"]["luminaires"][0].clone();
        second["corner_m"] = json!([
            0.4,
            if edge_u[1] == json!(-0.1) { 0.4 } else { 0.3 },
            document["room"]["luminaires"][0]["corner_m"][2]
        ]);
        second["edge_u_m"] = edge_u;
        with(document, "/room/luminaires/-", second)
    };
    refused(&twice(electric(), json!([0, 0.1, 0])), "/room/luminaires/1", FieldErrorCode::Invalid);
    let hanging = with(electric(), "/room/luminaires/0/corner_m/2", json!(1.5));
    assert!(parse(&twice(hanging, json!([0, -0.1, 0]))).is_ok());
}

/// Electric light alone needs neither sky nor place; what explains daylight is null then.
#[test]
fn rooms_without_tubes() {
    let mut document = electric();
    document["tubes"] = json!([]);
    document = with(document, "/sky", Value::Null);
    let parsed = parse(&document).unwrap();
    let (scene, warnings, provenance) = to_scene(&parsed, &SquarePipe).unwrap();
    assert!(scene.daylight.is_none() && scene.tubes.is_empty() && warnings.is_empty());
    let json = serde_json::to_value(&provenance).unwrap();
    assert!(json["zenith"].is_null() && json["sun"].is_null() && json["refraction"].is_null());
    assert_eq!(json["guides"], json!([]));

    document["location"] = json!({ "latitude_deg": 55.77, "longitude_deg": 12.5 });
    document["time"] = json!("2011-09-15T15:00:00+02:00");
    let parsed = parse(&document).unwrap();
    assert_eq!(to_scene(&parsed, &SquarePipe).unwrap().1[0].code, WarningCode::PlaceWithoutSky);
    refused(&with(electric(), "/sky", Value::Null), "/sky", FieldErrorCode::Invalid);
}

#[test]
fn walls_colours_and_open_faces() {
    let mut document = base();
    document["room"]["surfaces"]["wall_north"] = json!({ "reflectance": [0.8, 0.1, 0.1] });
    document["room"]["surfaces"]["wall_south"] = json!({ "open": true });
    let (scene, ..) = to_scene(&parse(&document).unwrap(), &SquarePipe).unwrap();
    assert_eq!(scene.channels, Channels::Rgb);
    let surfaces = scene.room.enclosure.as_box().unwrap().surfaces;
    assert_eq!(surfaces[Face::North as usize].unwrap().reflectance, [0.8, 0.1, 0.1]);
    assert_eq!(surfaces[Face::South as usize], None);
    assert_eq!(surfaces[Face::East as usize].unwrap().reflectance, [0.5; 3]);
    assert_eq!(surfaces[Face::Ceiling as usize].unwrap().reflectance, [0.7; 3]);
}
