//! Skies and suns, and the place and time that say where the sun is.

use proptest::prelude::*;
use proptest::sample::select;
use serde_json::{Value, json};

use super::Kind;

/// A sky, and place and time where these say where the sun is.
pub fn sky(kind: Kind) -> impl Strategy<Value = (Value, Option<(Value, String)>)> {
    let cie = || 1..=16u8;
    let kinds = prop_oneof![
        6 => (cie(), level()).prop_map(|(cie_type, level)| {
            let mut sky = json!({ "cie_type": cie_type });
            let (name, value) = match level {
                ("luminous_turbidity", _) if !(7..=15).contains(&cie_type) => ("dv_ev", 0.3),
                other => other,
            };
            sky[name] = json!(value);
            sky
        }),
        1 => (select(vec!["ies_overcast", "ies_partly_cloudy", "ies_clear"]), 100.0..30_000.0f64).prop_map(
            |(preset, level)| json!({ "preset": preset, "diffuse_horizontal_illuminance_lux": level })
        ),
        1 => select(vec!["ies_overcast", "ies_partly_cloudy", "ies_clear"]).prop_map(|preset| json!({ "preset": preset })),
        1 => cie().prop_map(|cie_type| json!({ "cie_type": cie_type })),
    ];
    let beam = match kind {
        Kind::Plain => Just(Some(0.0)).boxed(),
        Kind::Any => {
            prop_oneof![2 => Just(Some(0.0)), 1 => Just(None), 2 => (1.0..100_000.0f64).prop_map(Some)].boxed()
        }
    };
    let altitude = match kind {
        Kind::Plain => (5.0..90.0f64).boxed(),
        Kind::Any => prop_oneof![1 => -3.0..3.0f64, 1 => Just(90.0), 10 => 3.0..90.0f64].boxed(),
    };
    let azimuth = 0.0..=360.0f64;
    // midday of any day in middle latitudes
    let by_time = prop_oneof![12 => Just(None), 1 => (1..=12u32, 1..=28u32, -50.0..50.0f64).prop_map(Some)];
    (kinds, beam, altitude, azimuth, by_time).prop_map(|(mut sky, beam, altitude, azimuth, by_time)| {
        if let Some(beam) = beam {
            sky["direct_normal_illuminance_lux"] = json!(beam);
        }
        let place = by_time.map(|(month, day, latitude)| {
            (json!({ "latitude_deg": latitude, "longitude_deg": 0 }), format!("2024-{month:02}-{day:02}T12:00:00Z"))
        });
        if place.is_none() {
            sky["sun_position"] = json!({ "altitude_deg": altitude, "azimuth_deg": azimuth });
        }
        (sky, place)
    })
}

/// Ground, and a horizon that is the same all round, so that rooms can turn; `None` in three of four documents.
pub fn surroundings(kind: Kind) -> impl Strategy<Value = Option<Value>> {
    let ring = match kind {
        Kind::Plain => Just(None).boxed(),
        Kind::Any => proptest::option::weighted(0.7, 0.0..60.0f64).boxed(),
    };
    let some = (ring, 0.0..=1.0f64, 0.0..=1.0f64).prop_map(|(ring, luminance_ratio, ground_reflectance)| {
        let mut some = json!({ "luminance_ratio": luminance_ratio, "ground_reflectance": ground_reflectance });
        if let Some(altitude) = ring {
            some["horizon"] = json!([[0, altitude]]);
        }
        some
    });
    proptest::option::weighted(0.25, some)
}

fn level() -> impl Strategy<Value = (&'static str, f64)> {
    prop_oneof![
        (100.0..20_000.0f64).prop_map(|value| ("zenith_luminance_cd_m2", value)),
        (100.0..30_000.0f64).prop_map(|value| ("diffuse_horizontal_illuminance_lux", value)),
        (0.05..0.5f64).prop_map(|value| ("dv_ev", value)),
        (2.0..10.0f64).prop_map(|value| ("luminous_turbidity", value)),
    ]
}
