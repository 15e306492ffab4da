//! Years of daylight in documents: what they need, what they exclude, and their bounds.

use crate::given::{SquarePipe, base, errors, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::FieldErrorCode::{self, Invalid, Missing, NotSupported, OutOfRange, TooMany, UnknownField};
use skyduct::document::errors::WarningCode;
use skyduct::document::to_scene;
use skyduct::document::weather::read_weather;
use skyduct::scene::Responses;

/// Number of lines before the records of an EPW.
const HEADER_LINES: usize = 8;

/// The base document with a year in place of its sky.
fn year() -> Value {
    let mut document = base();
    let fields = document.as_object_mut().unwrap();
    ["sky", "time", "location", "views"].iter().for_each(|field| drop(fields.remove(*field)));
    document["room"]["luminaires"] = json!([]);
    document["annual"] = json!({ "weather": "0123" });
    document
}

#[test]
fn a_year_is_computed_by_responses_under_an_overcast_sky() {
    let document = parse(&year()).unwrap();
    let (scene, warnings, provenance) = to_scene(&document, &SquarePipe).unwrap();
    assert_eq!(warnings, vec![]);
    assert!(scene.grids.iter().all(|grid| grid.responses == Responses::ToTubes));
    let daylight = scene.daylight.unwrap();
    assert!((daylight.horizontal_illuminance_lux().0 / 10_000.0 - 1.0).abs() < 1e-12 && daylight.sun.is_none());
    assert_eq!(daylight.sky.unwrap().distribution.sky_type().to_string(), "CIE type 1");
    assert!(!provenance.sun.unwrap().on);

    // what is left out has its default
    let annual = document.annual.as_ref().unwrap();
    assert_eq!((annual.thresholds_lux.len(), annual.udi_lux, annual.suns_per_hour), (4, [100.0, 300.0, 3000.0], 1));
}

#[test]
fn the_kinds_of_fields_are_read() {
    let mut document = year();
    document["annual"] = json!({
        "weather": "year.epw", "period": { "from": "09-01", "to": "06-30" }, "illuminance": "file",
        "schedule": { "kind": "weekly", "days": ["mon", "fri"], "from": "08:00", "to": "24:00" },
        "daylight_saving": { "kind": "days", "start": "03-29", "end": "10-25" },
        "dimming": { "setpoint_lux": 300 }, "maintenance": [1, 1, 1, 1, 1, 1, 1, 1, 1, 0.9, 0.8, 0.7]
    });
    assert_eq!(serde_json::to_value(&*parse(&document).unwrap()).unwrap()["annual"]["period"]["to"], "06-30");
    for schedule in [json!({ "kind": "daylight_hours" }), json!({ "kind": "hours", "occupied": [0, 1] })] {
        parse(&with(document.clone(), "/annual/schedule", schedule)).unwrap();
    }
}

#[test]
fn every_bound_names_its_field() {
    let cases: [(&str, Value, FieldErrorCode); 36] = [
        ("/annual/weather", json!(""), Invalid),
        ("/annual/weather", json!([]), Invalid),
        ("/annual/weather", json!(vec!["a"; 33]), TooMany),
        ("/annual/weather", Value::Null, Missing),
        ("/annual/sun_offset_minutes", json!(61), OutOfRange),
        ("/annual/other_daylight", json!([{ "grid": "none", "file": "a" }]), Invalid),
        ("/annual/other_daylight", json!([{ "grid": "none", "file": "" }]), Invalid),
        ("/annual/other_daylight", json!([{ "grid": "none" }]), Missing),
        ("/annual/suns_per_hour", json!(0), OutOfRange),
        ("/annual/suns_per_hour", json!(13), OutOfRange),
        ("/annual/thresholds_lux", json!([]), Invalid),
        ("/annual/thresholds_lux", json!((100..117).collect::<Vec<_>>()), TooMany),
        ("/annual/thresholds_lux", json!([300, 300]), Invalid),
        ("/annual/thresholds_lux", json!([0]), OutOfRange),
        ("/annual/udi_lux", json!([300, 100, 3000]), Invalid),
        ("/annual/udi_lux", json!([0, 100, 3000]), OutOfRange),
        ("/annual/sda", json!({ "time_percent": 101 }), OutOfRange),
        ("/annual/sda", json!({ "threshold_lux": 0 }), OutOfRange),
        ("/annual/dimming", json!({ "setpoint_lux": 0 }), OutOfRange),
        ("/annual/dimming", json!({ "power_w_m2": -1 }), OutOfRange),
        ("/annual/dimming", json!({ "minimum_power": 1.5 }), OutOfRange),
        ("/annual/dimming", json!({ "minimum_light": 1 }), OutOfRange),
        ("/annual/maintenance", json!(vec![1.0; 11]), Invalid),
        ("/annual/maintenance", json!(vec![1.1; 12]), OutOfRange),
        ("/annual/period", json!({ "from": "02-30", "to": "03-01" }), Invalid),
        ("/annual/schedule", json!({ "kind": "always" }), Invalid),
        ("/annual/schedule", json!({ "kind": "lm83", "days": [] }), UnknownField),
        ("/annual/schedule", json!({ "kind": "weekly", "days": [], "from": "08:00", "to": "18:00" }), Invalid),
        ("/annual/schedule", json!({ "kind": "weekly", "days": ["mon"], "from": "18:00", "to": "08:00" }), Invalid),
        ("/annual/schedule", json!({ "kind": "weekly", "days": ["mon"], "from": "8", "to": "18:00" }), Invalid),
        ("/annual/schedule", json!({ "kind": "hours", "occupied": [0, 2] }), Invalid),
        ("/annual/daylight_saving", json!({ "kind": "summer" }), Invalid),
        ("/sky", json!({ "cie_type": 5, "sun_position": { "altitude_deg": 45, "azimuth_deg": 180 } }), Invalid),
        ("/time", json!("2011-09-15T15:00:00+02:00"), Invalid),
        ("/tubes", json!([]), Invalid),
        ("/grids/0/responses", json!(true), Invalid),
    ];
    for (pointer, value, code) in cases {
        let found = parse(&with(year(), pointer, value.clone())).unwrap_err();
        let is_here = found.0.iter().any(|error| error.pointer.starts_with(pointer) && error.code == code);
        assert!(is_here, "{pointer} {value}: {found}");
    }
    // a schema says so, too
    let found = errors(&with(year(), "/views", base()["views"].clone()));
    assert_eq!((found.0[0].pointer.as_str(), found.0[0].code), ("/views", NotSupported));
}

/// Weather files whose light cannot be that of the site and its hours say so, and so does one without any; the synthetic year has nothing to
/// tell.
#[test]
fn doubtful_weather_is_told() {
    let text = include_str!("../../examples/synthetic.epw");
    let codes = |edit: &dyn Fn(usize, &mut Vec<String>)| -> Vec<WarningCode> {
        let line = |(number, line): (usize, &str)| {
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            edit(number, &mut fields);
            fields.join(",")
        };
        let edited: Vec<String> = text.lines().enumerate().map(line).collect();
        let (_, report) = read_weather(edited.join("\n").as_bytes()).unwrap();
        report.warnings.into_iter().map(|warning| warning.code).collect()
    };
    assert_eq!(codes(&|_, _| {}), []);
    let dark = |number: usize, fields: &mut Vec<String>| {
        if number >= HEADER_LINES {
            fields[13..16].fill("0".to_owned());
        }
    };
    assert_eq!(codes(&dark), [WarningCode::WeatherWithoutLight]);
    let southern = |number: usize, fields: &mut Vec<String>| {
        if number == 0 {
            fields[6] = "-55.77".to_owned();
        }
    };
    assert_eq!(codes(&southern), [WarningCode::WeatherSunOffset, WarningCode::WeatherLightWithoutSun]);
}
