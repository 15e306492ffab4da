//! Skies of job documents: presets, levels, and what results say of them.

use crate::given::{self, SquarePipe, base, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, FieldErrorCode, Warning, WarningCode, to_scene};
use skyduct::scene::Daylight;

/// Daylight and its provenance under a sky, the sun at an altitude of 30 degrees unless `sky` says otherwise.
fn under(sky: Value) -> Result<(Daylight, Value), DocumentErrors> {
    let (daylight, _, provenance) = with_warnings(sky)?;
    Ok((daylight, provenance))
}

/// The same with the warnings between them.
fn with_warnings(sky: Value) -> Result<(Daylight, Vec<Warning>, Value), DocumentErrors> {
    let mut sky = sky;
    if sky.get("sun_position").is_none() {
        sky["sun_position"] = json!({ "altitude_deg": 30, "azimuth_deg": 180 });
    }
    let document = json!({
        "sky": sky,
        "room": { "size_m": [3, 3, 3] },
        "tubes": [{
            "centre_m": [1.5, 1.5], "diameter_m": 0.25, "reflectance": 0.98, "segments": [{ "length_m": 1 }],
            "collector": { "kind": "open" }, "diffuser": { "kind": "open" }
        }],
        "grids": [{ "name": "floor", "height_m": 0, "cells": [1, 1] }]
    });
    let document = parse(&document)?;
    let (scene, warnings, provenance) = to_scene(&document, &SquarePipe)?;
    Ok((scene.daylight.unwrap(), warnings, serde_json::to_value(provenance).unwrap()))
}

#[track_caller]
fn refused(sky: Value, pointer: &str, code: FieldErrorCode) {
    let errors = under(sky).unwrap_err().0;
    assert!(
        errors.iter().any(|error| error.pointer == pointer && error.code == code),
        "{pointer} {code:?}: {errors:?}"
    );
}

fn close(value: &Value, expected: f64) -> bool {
    (value.as_f64().unwrap() / expected - 1.0).abs() < 1e-11
}

/// The formulae of the IES at 30 degrees, where the sine is one half.
#[test]
fn presets_have_their_own_level_and_beam() {
    let (daylight, result) = under(json!({ "preset": "ies_clear" })).unwrap();
    assert_eq!(result["zenith"]["formula"], "ies_horizontal_illuminance");
    assert!(close(&result["zenith"]["horizontal_illuminance_lux"], 800.0 + 15_500.0 * 0.5f64.sqrt()));
    assert!(close(&result["sun"]["normal_illuminance_lux"], 127_500.0 * (-0.42f64).exp()));
    assert_eq!(result["sun"]["source"], json!({ "kind": "ies", "extinction": 0.21 }));
    assert!(daylight.sun.is_some());

    let (_, partly) = under(json!({ "preset": "ies_partly_cloudy" })).unwrap();
    assert!(close(&partly["zenith"]["horizontal_illuminance_lux"], 22_800.0));

    let (overcast, result) = under(json!({ "preset": "ies_overcast" })).unwrap();
    assert!(overcast.sun.is_none());
    assert_eq!(result["sun"]["source"], json!({ "kind": "sunless_type" }));
}

/// A given illuminance sets the level of a preset as of any sky.
#[test]
fn a_given_level_wins_over_the_presets() {
    let sky = json!({ "preset": "ies_overcast", "diffuse_horizontal_illuminance_lux": 5000 });
    let (_, result) = under(sky).unwrap();
    assert_eq!(result["zenith"]["formula"], "given_horizontal_illuminance");
    assert!(close(&result["zenith"]["horizontal_illuminance_lux"], 5000.0));
}

/// A given ratio of the horizontal illuminances is that of the result, whatever the type; without one, types 7 to 15 take the
/// turbidity, and the result names the choice.
#[test]
fn a_given_ratio_is_that_of_the_result() {
    let sun = json!({ "altitude_deg": 60, "azimuth_deg": 180 });
    let (_, ratio) = under(json!({ "cie_type": 12, "dv_ev": 0.1, "sun_position": sun })).unwrap();
    let (_, turbidity) = under(json!({ "cie_type": 12, "sun_position": sun })).unwrap();
    assert_eq!(ratio["zenith"]["formula"], "given_dv_ev");
    assert_eq!(ratio["zenith"]["dv_ev"], 0.1);
    assert_eq!(turbidity["zenith"]["formula"], "luminous_turbidity");
    assert_eq!(turbidity["zenith"]["luminous_turbidity"], 2.5);
    let lux = ratio["zenith"]["horizontal_illuminance_lux"].as_f64().unwrap();
    let outside = 133_800.0 * 60f64.to_radians().sin();
    assert!((lux / (0.1 * outside) - 1.0).abs() < 1e-12, "{lux}");
}

/// The mean of measured overcast skies is 300 + 21 000 sin h lux (IES 1984): 10 800 at 30 degrees. The typical level of type
/// 16 is a tenth of 133.8 sin h klx exactly, that of type 1 by Kittler and Darula's fit, 54.63 times D/Lz = 2.449540874
/// (docs/physics/sky_and_sun.md#absolute-level).
#[test]
fn an_overcast_sky_without_a_level_tells_its_ratio_to_the_mean() {
    for (number, dv_ev, lux) in [(1, 0.10, 54.63 * 2.449_540_874), (16, 0.10, 133.8)] {
        let (_, warnings, result) = with_warnings(json!({ "cie_type": number })).unwrap();
        let [warning] = &warnings[..] else { panic!("{warnings:?}") };
        assert_eq!(warning.code, WarningCode::TypicalOvercastLevel);
        assert_eq!(result["zenith"]["dv_ev"], dv_ev);
        let ratio = result["zenith"]["ratio_to_mean_overcast"].as_f64().unwrap();
        assert!((ratio / (dv_ev * 1000.0 * 0.5 * lux / 10_800.0) - 1.0).abs() < 1e-8, "{ratio}");
    }
    // type 3 has 0.93 of the mean, type 4 is 1.37 times as bright; the partly cloudy types are not compared
    let (_, warnings, result) = with_warnings(json!({ "cie_type": 3 })).unwrap();
    assert!(warnings.is_empty() && (result["zenith"]["ratio_to_mean_overcast"].as_f64().unwrap() - 0.92).abs() < 0.02);
    assert_eq!(with_warnings(json!({ "cie_type": 4 })).unwrap().1[0].code, WarningCode::TypicalOvercastLevel);
    for number in [6, 7, 12] {
        let (_, warnings, result) = with_warnings(json!({ "cie_type": number })).unwrap();
        assert!(warnings.is_empty() && result["zenith"].get("ratio_to_mean_overcast").is_none(), "{number}");
    }
}

#[test]
fn an_overcast_sky_with_a_level_is_not_warned_of() {
    let levels = [
        ("diffuse_horizontal_illuminance_lux", json!(5000)),
        ("dv_ev", json!(0.1)),
        ("zenith_luminance_cd_m2", json!(3000)),
    ];
    for number in [1, 16] {
        for (field, value) in &levels {
            let (_, warnings, result) = with_warnings(json!({ "cie_type": number, *field: value })).unwrap();
            assert!(warnings.is_empty(), "{number} {field}: {warnings:?}");
            assert!(result["zenith"].get("ratio_to_mean_overcast").is_none());
        }
    }
    assert!(with_warnings(json!({ "preset": "ies_overcast" })).unwrap().1.is_empty());
    let (_, warnings, result) =
        with_warnings(json!({ "cie_type": 1, "sun_position": { "altitude_deg": -1, "azimuth_deg": 0 } })).unwrap();
    assert_eq!(warnings[0].code, WarningCode::SunBelowHorizon);
    assert!(warnings.len() == 1 && result["zenith"].get("ratio_to_mean_overcast").is_none());
}

#[test]
fn bad_skies_name_their_field() {
    refused(json!({}), "/sky/cie_type", FieldErrorCode::Invalid);
    refused(json!({ "cie_type": 12, "preset": "ies_clear" }), "/sky/preset", FieldErrorCode::Invalid);
    refused(json!({ "cie_type": 17 }), "/sky/cie_type", FieldErrorCode::OutOfRange);
    refused(
        json!({ "preset": "ies_clear", "luminous_turbidity": 3 }),
        "/sky/luminous_turbidity",
        FieldErrorCode::Invalid,
    );
    refused(json!({ "preset": "ies_clear", "dv_ev": 0.3 }), "/sky/dv_ev", FieldErrorCode::Invalid);
    refused(json!({ "cie_type": 12, "dv_ev": 0 }), "/sky/dv_ev", FieldErrorCode::OutOfRange);
    refused(
        json!({ "cie_type": 12, "dv_ev": 0.2, "zenith_luminance_cd_m2": 100 }),
        "/sky/dv_ev",
        FieldErrorCode::Invalid,
    );
}

#[test]
fn place_and_time() {
    let located = |time: Value| {
        let mut document = with(base(), "/sky/sun_position", Value::Null);
        document["location"] = json!({ "latitude_deg": 55.7667, "longitude_deg": 12.5 });
        document["time"] = time;
        document
    };
    given::refused(&located(json!("2011-09-15T15:00:00")), "/time", FieldErrorCode::Invalid);
    given::refused(&located(json!("2011-02-30T15:00:00Z")), "/time", FieldErrorCode::Invalid);
    given::refused(&located(json!("+006001-01-01T12:00:00Z")), "/time", FieldErrorCode::OutOfRange);
    given::refused(&located(json!("-002001-06-01T12:00:00Z")), "/time", FieldErrorCode::OutOfRange);
    given::refused(
        &with(located(json!("2011-09-15T15:00:00Z")), "/location/latitude_deg", json!(90.0001)),
        "/location/latitude_deg",
        FieldErrorCode::OutOfRange,
    );
    given::refused(
        &with(located(json!("2011-09-15T15:00:00Z")), "/location/longitude_deg", json!(181)),
        "/location/longitude_deg",
        FieldErrorCode::OutOfRange,
    );
    given::refused(
        &with(located(json!("2011-09-15T15:00:00Z")), "/location/elevation_m", json!(1e5)),
        "/location/elevation_m",
        FieldErrorCode::OutOfRange,
    );
    given::refused(&with(base(), "/time", json!("2011-09-15T15:00:00Z")), "/sky/sun_position", FieldErrorCode::Invalid);
    let mut no_place = with(base(), "/sky/sun_position", Value::Null);
    no_place["time"] = json!("2011-09-15T15:00:00Z");
    given::refused(&no_place, "/location", FieldErrorCode::Invalid);

    // the apparent altitude, as in tests/reference/sun_positions.csv
    let document = parse(&located(json!("2011-09-15T15:00:00+02:00"))).unwrap();
    let (_, _, provenance) = to_scene(&document, &SquarePipe).unwrap();
    assert!((provenance.sun.unwrap().altitude_deg.unwrap() - 32.4806).abs() < 1e-3);
    assert!((provenance.sun.unwrap().azimuth_deg.unwrap() - 214.6021).abs() < 1e-3);
    // a leap second is not a panic
    let _ = parse(&located(json!("2016-12-31T23:59:60Z")));
}

/// Where neither the luminances nor their level depend on the sun, its position may be left out: the light is the same as with any position, and
/// results tell none. A beam, an indicatrix, or a level that follows from the altitude needs it.
#[test]
fn a_sky_that_does_not_depend_on_the_sun_needs_no_position() {
    let scene = |document: &Value| to_scene(&parse(document).unwrap(), &SquarePipe).unwrap();
    let lux = json!({ "diffuse_horizontal_illuminance_lux": 9000 });
    let of = |name: &str, sky: Value| {
        let mut fields = lux.clone();
        fields[name] = sky;
        fields
    };
    let mut independent: Vec<Value> = [1, 3, 5, 16].map(|number| of("cie_type", json!(number))).to_vec();
    independent.push(of("preset", json!("ies_overcast")));
    independent.push(json!({ "cie_type": 1, "zenith_luminance_cd_m2": 4000, "direct_normal_illuminance_lux": 0 }));
    for sky in independent {
        let (scene_of_none, warnings, provenance) = scene(&with(base(), "/sky", sky.clone()));
        assert!(warnings.is_empty(), "{warnings:?}");
        let provenance = serde_json::to_value(provenance).unwrap();
        assert_eq!(provenance["refraction"], json!({ "kind": "not_needed" }));
        let sun = &provenance["sun"];
        assert!(sun.get("altitude_deg").is_none() && sun.get("azimuth_deg").is_none() && sun["on"] == false, "{sun}");
        for (altitude, azimuth) in [(8, 10), (45, 200), (80, 300)] {
            let mut located = with(base(), "/sky", sky.clone());
            located["sky"]["sun_position"] = json!({ "altitude_deg": altitude, "azimuth_deg": azimuth });
            let (scene, ..) = scene(&located);
            let [one, other] = [&scene_of_none, &scene].map(|of| of.daylight.as_ref().unwrap().sky.as_ref().unwrap());
            for toward in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [-0.5, 0.7, 0.3]] {
                let toward = glam::DVec3::from(toward).normalize();
                assert_eq!(one.luminance(toward), other.luminance(toward), "{sky}");
            }
        }
    }
    let mut dependent: Vec<Value> =
        (2..16).filter(|number| ![3, 5].contains(number)).map(|number| of("cie_type", json!(number))).collect();
    dependent.push(json!({ "cie_type": 1 }));
    dependent.push(json!({ "cie_type": 1, "dv_ev": 0.3 }));
    dependent.push(json!({ "preset": "ies_overcast" }));
    dependent.push(of("preset", json!("ies_clear")));
    dependent.push(json!({ "cie_type": 1, "zenith_luminance_cd_m2": 4000, "direct_normal_illuminance_lux": 1 }));
    for sky in dependent {
        given::refused(&with(base(), "/sky", sky), "/sky/sun_position", FieldErrorCode::Invalid);
    }
}

#[test]
fn sun_levels_and_warnings() {
    let scene = |document: &Value| to_scene(&parse(document).unwrap(), &SquarePipe).unwrap();
    let night = with(base(), "/sky/sun_position/altitude_deg", json!(-5));
    let (dark, warnings, _) = scene(&night);
    let dark = dark.daylight.unwrap();
    assert!(dark.sky.is_none() && dark.sun.is_none());
    assert_eq!(warnings[0].code, WarningCode::SunBelowHorizon);

    // D is given: the sky integrates back to it
    let mut diffuse = with(base(), "/sky/zenith_luminance_cd_m2", Value::Null);
    diffuse["sky"]["diffuse_horizontal_illuminance_lux"] = json!(12000);
    let (given, warnings, _) = scene(&diffuse);
    assert!((given.daylight.unwrap().horizontal_illuminance_lux().0 - 12000.0).abs() < 1e-8);
    assert!(warnings.is_empty());
    let bright = with(diffuse.clone(), "/sky/diffuse_horizontal_illuminance_lux", json!(80000));
    assert_eq!(scene(&bright).1[0].code, WarningCode::ImplausibleIlluminance);

    // type 12 at 35 degrees has 86.510 klx at its typical turbidity (docs/physics/sky_and_sun.md#the-sun); types 1, 9 and 16
    // have no beam
    let free = with(base(), "/sky/direct_normal_illuminance_lux", Value::Null);
    assert!((scene(&free).0.daylight.unwrap().sun.unwrap().normal_illuminance_lux - 86_510.0).abs() < 0.5);
    for number in [1, 6, 9, 16] {
        assert!(
            scene(&with(free.clone(), "/sky/cie_type", json!(number))).0.daylight.unwrap().sun.is_none(),
            "type {number}"
        );
    }

    // the room turns, so the sun turns the other way
    let turned = scene(&with(free.clone(), "/room/rotation_deg", json!(225))).0;
    assert!(turned.daylight.unwrap().sun.unwrap().direction.x.abs() < 1e-12);
    let mut overcast = with(base(), "/sky/cie_type", json!(3));
    overcast = with(overcast, "/sky/zenith_luminance_cd_m2", Value::Null);
    overcast["sky"]["luminous_turbidity"] = json!(4);
    given::refused(&overcast, "/sky/luminous_turbidity", FieldErrorCode::Invalid);
}

/// Checks the level and the beam by luminous efficacies that were computed independently (tests/reference/annual/perez_points.csv: 35 degrees,
/// 500 and 120 W/m2), and the state in the provenance.
#[test]
fn irradiances_make_an_all_weather_sky() {
    let perez = |direct: f64, diffuse: f64| json!({ "direct_normal_irradiance_w_m2": direct, "diffuse_horizontal_irradiance_w_m2": diffuse });
    let sun = json!({ "altitude_deg": 35, "azimuth_deg": 180 });
    let mut sky = json!({ "perez": perez(500.0, 120.0), "sun_position": sun });
    // two centimetres of water
    sky["perez"]["dew_point_c"] = json!((2f64.ln() + 0.075) / 0.07);
    let (daylight, result) = under(sky.clone()).unwrap();
    assert_eq!(result["zenith"]["formula"], "luminous_efficacy");
    assert_eq!(result["sun"]["source"], json!({ "kind": "luminous_efficacy" }));
    let number = |value: &Value| value.as_f64().unwrap();
    assert!((number(&result["zenith"]["clearness"]) - 3.1692).abs() < 1e-4);
    // the table has the distance of the sun at the turn of the year, where it is 1.035020 times as bright as at the mean distance
    assert!((number(&result["zenith"]["brightness"]) / (1.035020 * 0.147_474_7) - 1.0).abs() < 1e-6);
    let beam = number(&result["sun"]["normal_illuminance_lux"]);
    assert!((beam - 49059.7).abs() < 0.2, "{beam}");
    let level = number(&result["zenith"]["horizontal_illuminance_lux"]);
    assert!((level / 120.0 - 147.5364).abs() < 1e-3, "{level}");
    assert!(daylight.sun.is_some() && daylight.sky.is_some());

    // levels that are given go first
    sky["direct_normal_illuminance_lux"] = json!(0);
    sky["diffuse_horizontal_illuminance_lux"] = json!(10_000);
    let (daylight, result) = under(sky.clone()).unwrap();
    assert!(daylight.sun.is_none() && close(&result["zenith"]["horizontal_illuminance_lux"], 10_000.0));
    // without any light there is none
    let (daylight, _) = under(json!({ "perez": perez(0.0, 0.0), "sun_position": sun })).unwrap();
    assert_eq!(daylight.horizontal_illuminance_lux(), (0.0, 0.0));

    for (direct, diffuse, field) in
        [(1451.0, 100.0, "direct_normal_irradiance_w_m2"), (800.0, -1.0, "diffuse_horizontal_irradiance_w_m2")]
    {
        refused(json!({ "perez": perez(direct, diffuse) }), &format!("/sky/perez/{field}"), FieldErrorCode::OutOfRange);
    }
    let mut twice = json!({ "perez": perez(500.0, 120.0), "cie_type": 1 });
    refused(twice.clone(), "/sky/perez", FieldErrorCode::Invalid);
    twice["preset"] = json!("ies_clear");
    refused(twice, "/sky/preset", FieldErrorCode::Invalid);
    refused(json!({ "perez": perez(500.0, 120.0), "dv_ev": 0.2 }), "/sky/dv_ev", FieldErrorCode::Invalid);
}
