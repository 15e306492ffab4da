//! Tubes: straight, bent, of meshes, with all collectors and closures.

use std::f64::consts::{PI, SQRT_2};

use proptest::prelude::*;
use proptest::sample::select;
use serde_json::{Value, json};

use super::meshes::{MeshName, UNITS};
use super::values::{coefficient, three, two};
use super::{Kind, MOST_TUBES};

/// For each quarter of the ceiling a tube or none.
pub fn tubes(kind: Kind, coloured: bool) -> impl Strategy<Value = Vec<Option<Value>>> {
    let tube = move || prop_oneof![6 => parametric(kind, coloured), 1 => mesh_tube(kind, coloured)];
    (
        proptest::option::weighted(0.9, tube()),
        proptest::collection::vec(proptest::option::weighted(0.25, tube()), 0..MOST_TUBES),
    )
        .prop_map(|(first, others)| std::iter::once(first).chain(others).take(MOST_TUBES).collect())
}

pub fn simplest_tube() -> Value {
    json!({ "place": [0.5, 0.5, 0.5], "tube": { "reflectance": 0.95, "segments": [{ "length": 4.0 }],
            "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 } } })
}

fn place_of_tube() -> impl Strategy<Value = [f64; 3]> {
    [0.0..=1.0f64, 0.0..=1.0f64, 0.1..=0.9f64]
}

fn parametric(kind: Kind, coloured: bool) -> BoxedStrategy<Value> {
    let segment = (0.05..8.0f64, prop_oneof![1 => Just(0.0), 2 => 1.0..60.0f64], -360.0..=360.0f64);
    let bends =
        prop_oneof![2 => proptest::collection::vec(segment.clone(), 0), 1 => proptest::collection::vec(segment, 1..=2)];
    let segments = (0.05..12.0f64, bends).prop_map(|(first, bends)| {
        // room for the mitres of two bends of at most 120 degrees
        let spare = if bends.is_empty() { 0.0 } else { 4.0 };
        let others = bends.iter().map(
            |(length, tilt, azimuth)| json!({ "length": length + spare, "tilt_deg": tilt, "azimuth_deg": azimuth }),
        );
        std::iter::once(json!({ "length": first + spare })).chain(others).collect::<Vec<_>>()
    });
    let closure = (diffuser(kind, coloured), square(kind));
    let parts = (place_of_tube(), mirror(coloured), segments, collector(coloured), closure);
    parts
        .prop_map(|(place, reflectance, segments, collector, (diffuser, square))| {
            let square = square.filter(|_| diffuser["kind"] == "lambertian");
            json!({ "place": place, "square": square, "tube": { "reflectance": reflectance, "segments": segments,
                    "collector": collector, "diffuser": diffuser } })
        })
        .boxed()
}

/// For some tubes the turn of a square closure, the transmittance of its transition, and the diameter of the pipe in its sides.
fn square(kind: Kind) -> impl Strategy<Value = Option<[f64; 3]>> {
    let transmittance = prop_oneof![1 => Just(1.0), 1 => 0.0..=1.0f64];
    let square = (-360.0..=360.0f64, transmittance, 0.3..=1.0f64).prop_map(<[f64; 3]>::from);
    match kind {
        Kind::Plain => Just(None).boxed(),
        Kind::Any => proptest::option::weighted(0.3, square).boxed(),
    }
}

fn mirror(coloured: bool) -> impl Strategy<Value = Value> {
    let table = (1.0..89.0f64, proptest::array::uniform3(coefficient(1.0, coloured)))
        .prop_map(|(angle, values)| json!({ "incidence_deg": [0, angle, 90], "reflectance": values }));
    prop_oneof![2 => (0.8..=1.0f64).prop_map(|value| json!(value)), 2 => coefficient(1.0, coloured), 1 => table]
}

fn collector(coloured: bool) -> impl Strategy<Value = Value> {
    let thin = (select(vec!["flat", "dome"]), coefficient(1.0, coloured))
        .prop_map(|(kind, transmittance)| json!({ "kind": kind, "transmittance": transmittance }));
    let dielectric = (1.0..2.5f64, 0.001..0.05f64, prop_oneof![Just(0.0), 0.0..10.0f64]).prop_map(
        |(refractive_index, thickness_m, absorption_per_m)| {
            json!({ "kind": "dielectric_dome", "refractive_index": refractive_index, "thickness_m": thickness_m,
                    "absorption_per_m": absorption_per_m })
        },
    );
    prop_oneof![2 => Just(json!({ "kind": "open" })), 2 => thin, 1 => dielectric]
}

fn diffuser(kind: Kind, coloured: bool) -> BoxedStrategy<Value> {
    let lambertian = two(1.0, coloured).prop_map(|[transmittance, reflectance]| {
        json!({ "kind": "lambertian", "transmittance": transmittance, "reflectance": reflectance })
    });
    if kind == Kind::Plain {
        return lambertian.boxed();
    }
    let clear =
        coefficient(1.0, coloured).prop_map(|transmittance| json!({ "kind": "clear", "transmittance": transmittance }));
    let mixed = (0.0..=1.0f64, any::<bool>(), two(1.0, coloured), coefficient(1.0, coloured)).prop_map(
        |(radius, inside, [transmittance, reflectance], clear)| {
            json!({ "kind": "mixed", "radius": radius, "inner": if inside { "lambertian" } else { "clear" },
                    "lambertian_transmittance": transmittance, "lambertian_reflectance": reflectance,
                    "clear_transmittance": clear })
        },
    );
    prop_oneof![4 => lambertian, 1 => Just(json!({ "kind": "open" })), 1 => clear, 1 => mixed, 1 => measured()].boxed()
}

/// A table of 3 x 4 values that gives no more light than it gets.
fn measured() -> impl Strategy<Value = Value> {
    let values = || proptest::array::uniform3(proptest::array::uniform4(prop_oneof![1 => Just(0.0), 4 => 0.0..1.0f64]));
    (1.0..89.0f64, 1.0..60.0f64, 0.1..20.0f64, values(), proptest::option::of(values()), 0.1..=1.0f64).prop_map(
        |(incidence, exit, further, through, back, share)| {
            // a row of the largest value everywhere would send out pi times that
            let largest = |table: &[[f64; 4]; 3]| table.iter().flatten().copied().fold(1e-9, f64::max);
            let scale = share / (PI * (largest(&through) + back.as_ref().map_or(0.0, largest)));
            let scaled = |table: &[[f64; 4]; 3]| json!(table.map(|row| row.map(|value| value * scale)));
            let mut table = json!({ "kind": "measured", "incidence_deg": [0, incidence, 90],
                                    "exit_deg": [0, exit, exit + further, 90], "btdf_per_sr": scaled(&through) });
            if let Some(back) = &back {
                table["brdf_per_sr"] = scaled(back);
            }
            table
        },
    )
}

fn mesh_tube(kind: Kind, coloured: bool) -> BoxedStrategy<Value> {
    let cover = proptest::option::of(two(1.0, coloured));
    let shape = (prop_oneof![1 => Just(4usize), 1 => 16..=24usize], 0.5..8.0f64, select(UNITS.to_vec()), any::<bool>());
    let turn = -360.0..=360.0f64;
    (place_of_tube(), shape, cover, mirror(coloured), diffuser(kind, coloured), turn)
        .prop_map(|(place, (sides, length, (unit, _), recognise), cover, mirror, diffuser, turn)| {
            json!({ "place": place, "mesh_tube": { "sides": sides, "length": length, "unit": unit, "cover": cover,
                    "mirror": mirror, "diffuser": diffuser, "rotation_deg": turn, "recognise": recognise } })
        })
        .boxed()
}

/// A tube in its quarter of the ceiling; lengths are radii until then. One of several leans away from the others, so that none crosses
/// another.
pub fn in_quarter(drawn: &Value, quarter: usize, [x, y, _]: [f64; 3], several: bool) -> Value {
    let (w, d) = (0.5 * x, 0.5 * y);
    let place = three(&drawn["place"]);
    let radius = (place[2] * 0.5 * w.min(d)).min(0.5);
    let along = |axis: usize, from: f64, width: f64| from + radius + place[axis] * (width - 2.0 * radius);
    let centre = [along(0, (quarter % 2) as f64 * w, w), along(1, (quarter / 2) as f64 * d, d)];
    let sized = |diffuser: &Value| {
        let mut diffuser = diffuser.clone();
        if let Some(share) = diffuser.as_object_mut().unwrap().remove("radius") {
            diffuser["lambertian_radius_m"] = json!(share.as_f64().unwrap() * radius);
        }
        diffuser
    };
    let mesh = &drawn["mesh_tube"];
    if mesh.is_null() {
        let mut tube = drawn["tube"].clone();
        for segment in tube["segments"].as_array_mut().unwrap() {
            let length = segment.as_object_mut().unwrap().remove("length").unwrap();
            segment["length_m"] = json!(length.as_f64().unwrap() * radius);
            if let Some(azimuth) = segment["azimuth_deg"].as_f64().filter(|_| several) {
                let clockwise = [180.0, 90.0, 270.0, 0.0][quarter];
                segment["azimuth_deg"] = json!(clockwise + azimuth.rem_euclid(90.0));
            }
        }
        tube["centre_m"] = json!(centre);
        tube["diameter_m"] = json!(2.0 * radius);
        tube["diffuser"] = sized(&tube["diffuser"]);
        if let Some([turn, transmittance, diameter]) = drawn["square"].as_array().map(|_| three(&drawn["square"])) {
            // as large as fits into the circle
            let side = SQRT_2 * radius;
            tube["closure_shape"] = json!({ "kind": "square", "side_m": side, "rotation_deg": turn,
                                            "transition_transmittance": transmittance });
            tube["diameter_m"] = json!(diameter * side);
        }
        return tube;
    }
    let cover = &mesh["cover"];
    let shape = format!("{}{}", if cover.is_null() { "open-tube" } else { "tube" }, mesh["sides"]);
    let length = mesh["length"].as_f64().unwrap() * radius;
    let unit = mesh["unit"].as_str().unwrap().to_owned();
    let name = MeshName { shape, size: [radius, radius, length], unit: unit.clone(), offset: [0.0; 3] };
    let mut closure = sized(&mesh["diffuser"]);
    closure["role"] = json!("diffuser");
    let mut parts = json!({ "pipe": { "role": "pipe", "reflectance": mesh["mirror"] }, "closure": closure });
    if !cover.is_null() {
        parts["cover"] = json!({ "role": "collector", "transmittance": cover[0], "reflectance": cover[1] });
    }
    json!({ "mesh": name.text(), "unit": unit, "centre_m": centre, "opening_diameter_m": 2.0 * radius,
            "rotation_deg": mesh["rotation_deg"], "recognise": mesh["recognise"], "parts": parts })
}
