//! Any valid job document, small enough to be rendered in a moment: its scene and outputs, without method and stop.
//!
//! Values are drawn as shares of what they have to fit into, so that each document is valid as it is made; smaller and
//! simpler ones are what proptest shrinks to.

use std::f64::consts::PI;
use std::sync::Arc;

use proptest::prelude::*;
use proptest::sample::select;
use serde_json::{Value, json};
use skyduct::document::MeshSource;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};

/// Sensors and blocks of pixels that a document has at most, and tubes.
pub const MOST_VALUES: usize = 2 * 9 + 4;
pub const MOST_TUBES: usize = 4;

/// What a document may contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Everything.
    Any,
    /// What all methods of grids compute, but for single exceptions: no views, mirrors, gloss or sun behind clear closures.
    Plain,
}

/// Units of meshes with their metres.
pub const UNITS: [(&str, f64); 5] = [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("ft", 0.3048)];

/// A valid document.
pub fn document(kind: Kind) -> impl Strategy<Value = Value> {
    let coloured = prop_oneof![4 => Just(false), 1 => Just(true)];
    coloured.prop_flat_map(move |coloured| {
        let everything =
            (room(kind, coloured), tubes(kind, coloured), sky(kind), outputs(kind), effects(kind), any::<u32>());
        everything.prop_map(move |(room, tubes, (sky, place), outputs, effects, seed)| {
            let size = sizes(&room);
            let lit = !room["luminaires"].as_array().unwrap().is_empty();
            let mut tubes: Vec<Value> = tubes
                .iter()
                .enumerate()
                .filter_map(|(quarter, tube)| Some(in_quarter(tube.as_ref()?, quarter, size)))
                .collect();
            if tubes.is_empty() && !lit {
                tubes.push(in_quarter(&simplest_tube(), 0, size));
            }
            let (grids, views) = outputs;
            let mut document = json!({
                "room": room, "tubes": tubes, "sky": sky, "effects": effects, "seed": seed,
                "grids": grids.iter().enumerate().map(|(k, grid)| in_room(grid, k, size)).collect::<Vec<_>>(),
                "views": views.iter().enumerate().map(|(k, view)| view_in(view, k, size)).collect::<Vec<_>>(),
            });
            if let Some((location, time)) = place {
                document["location"] = location;
                document["time"] = json!(time);
            }
            document
        })
    })
}

fn sizes(room: &Value) -> [f64; 3] {
    [0, 1, 2].map(|axis| room["size_m"][axis].as_f64().unwrap())
}

/// A coefficient of 0 to `most`: a number, or in coloured documents three.
fn coefficient(most: f64, coloured: bool) -> BoxedStrategy<Value> {
    let number = prop_oneof![1 => Just(0.0), 8 => 0.0..most];
    match coloured {
        true => proptest::array::uniform3(number).prop_map(|rgb| json!(rgb)).boxed(),
        false => number.prop_map(|value| json!(value)).boxed(),
    }
}

/// Two coefficients whose sum is at most `most`.
fn two(most: f64, coloured: bool) -> impl Strategy<Value = [Value; 2]> {
    (coefficient(0.6 * most, coloured), coefficient(0.4 * most, coloured)).prop_map(|(a, b)| [a, b])
}

fn surface(kind: Kind, coloured: bool) -> BoxedStrategy<Value> {
    let diffuse = coefficient(0.9, coloured).prop_map(|reflectance| json!({ "reflectance": reflectance }));
    if kind == Kind::Plain {
        return diffuse.boxed();
    }
    let with_lobe = |roughness: BoxedStrategy<f64>| {
        (two(0.9, coloured), roughness).prop_map(|([reflectance, specular], roughness)| {
            json!({ "reflectance": reflectance, "specular": specular, "roughness": roughness })
        })
    };
    let glossy = with_lobe((0.02..1.0f64).boxed());
    prop_oneof![10 => diffuse, 1 => glossy, 1 => with_lobe(Just(0.0).boxed())].boxed()
}

fn room(kind: Kind, coloured: bool) -> impl Strategy<Value = Value> {
    let edges = (1.0..6.0f64, 1.0..6.0f64, 1.5..5.0f64);
    let face = || surface(kind, coloured);
    let may_be_open = || prop_oneof![12 => face(), 1 => Just(json!({ "open": true }))];
    let surfaces =
        (may_be_open(), face(), proptest::option::of(may_be_open()), proptest::option::of(may_be_open()), face())
            .prop_map(|(floor, walls, north, east, ceiling)| {
                let mut faces = json!({ "floor": floor, "walls": walls, "ceiling": ceiling });
                [("wall_north", north), ("wall_east", east)].into_iter().for_each(|(name, wall)| {
                    if let Some(wall) = wall {
                        faces[name] = wall;
                    }
                });
                faces
            });
    let objects = proptest::collection::vec(object(kind, coloured), 0..=3);
    let luminaires = proptest::collection::vec(luminaire(coloured), 0..=1);
    (edges, -360.0..=360.0f64, surfaces, objects, luminaires).prop_map(|((x, y, z), turn, surfaces, objects, luminaires)| {
        let size = [x, y, z];
        json!({
            "size_m": size, "rotation_deg": turn, "surfaces": surfaces,
            "objects": objects.iter().enumerate().map(|(quarter, object)| on_floor(object, quarter, size)).collect::<Vec<_>>(),
            "luminaires": luminaires.iter().map(|luminaire| luminaire_in(luminaire, size)).collect::<Vec<_>>(),
        })
    })
}

/// An object with its size and place as shares of a quarter of the room.
fn object(kind: Kind, coloured: bool) -> impl Strategy<Value = Value> {
    let size = [0.05..0.6f64, 0.05..0.6f64, 0.05..0.6f64];
    let place = (0.0..=1.0f64, 0.0..=1.0f64, prop_oneof![2 => Just(0.0), 1 => 0.02..1.0f64]);
    let turn = prop_oneof![1 => Just(0.0), 2 => -360.0..=360.0f64];
    let shape = select(vec!["box", "tetrahedron", "sheet", "pipe"]);
    let file = (select(UNITS.to_vec()), proptest::array::uniform3(-1.0..=1.0f64), any::<bool>());
    (shape, size, place, turn, surface(kind, coloured), file).prop_map(
        |(shape, size, place, turn, surface, ((unit, _), offset, far))| {
            // so far that a coordinate has ten digits left of a metre
            let offset = offset.map(|part| if far { (part * 5e5f64).round() } else { 0.0 });
            json!({ "shape": shape, "size": size, "place": [place.0, place.1, place.2], "rotation_deg": turn,
                    "surface": surface, "unit": unit, "offset": offset })
        },
    )
}

/// Three numbers of a field.
pub fn three(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|axis| value[axis].as_f64().unwrap())
}

/// The object on or above the floor of its own quarter, lower than luminaires hang.
fn on_floor(object: &Value, quarter: usize, [x, y, z]: [f64; 3]) -> Value {
    let half = [0.5 * x, 0.5 * y];
    let shares = three(&object["size"]);
    let size = [shares[0] * half[0], shares[1] * half[1], shares[2] * z];
    let turn = object["rotation_deg"].as_f64().unwrap();
    let (sin, cos) = turn.to_radians().sin_cos();
    let reach = [0.5 * (size[0] * cos.abs() + size[1] * sin.abs()), 0.5 * (size[0] * sin.abs() + size[1] * cos.abs())];
    // what does not fit is made smaller
    let shrink = (0..2).map(|axis| 0.499 * half[axis] / reach[axis]).fold(1.0, f64::min);
    let [w, d, h] = [size[0] * shrink, size[1] * shrink, size[2]];
    let place = three(&object["place"]);
    let along = |axis: usize| {
        let from = if axis == 0 { quarter % 2 } else { quarter / 2 } as f64 * half[axis];
        let reach = reach[axis] * shrink;
        from + reach + place[axis] * (half[axis] - 2.0 * reach)
    };
    let base = [along(0), along(1), place[2] * (0.75 * z - h)];
    if object["shape"] == "box" {
        return json!({ "kind": "box", "size_m": [w, d, h], "position_m": base, "rotation_deg": turn,
                       "surface": object["surface"] });
    }
    let shape = object["shape"].as_str().unwrap();
    // nothing open stands on the floor: kernels are not clipped there
    let lift = if shape == "tetrahedron" { 0.0 } else { 0.02 * z };
    let offset = three(&object["offset"]);
    let unit = object["unit"].as_str().unwrap();
    let mesh = MeshName { shape: shape.to_owned(), size: [w, d, h], unit: unit.to_owned(), offset };
    placed(mesh, [base[0], base[1], base[2] + lift], turn, &object["surface"])
}

/// A mesh object whose own origin comes to `base`.
pub fn placed(mesh: MeshName, base: [f64; 3], turn: f64, surface: &Value) -> Value {
    let turned = turned(mesh.offset, turn);
    let position: Vec<f64> = (0..3).map(|axis| base[axis] - turned[axis]).collect();
    json!({ "kind": "mesh", "mesh": mesh.text(), "unit": mesh.unit, "position_m": position, "rotation_deg": turn,
            "surfaces": { "all": surface } })
}

/// A point of a mesh after a turn in degrees, clockwise seen from above.
pub fn turned([x, y, z]: [f64; 3], turn: f64) -> [f64; 3] {
    let (sin, cos) = turn.to_radians().sin_cos();
    [cos * x + sin * y, cos * y - sin * x, z]
}

/// A luminaire with its place as shares of the room.
fn luminaire(coloured: bool) -> impl Strategy<Value = Value> {
    let luminance = prop_oneof![1 => Just(0.0), 6 => 10.0..20_000.0f64];
    let luminance = match coloured {
        true => proptest::array::uniform3(luminance).prop_map(|rgb| json!(rgb)).boxed(),
        false => luminance.prop_map(|value| json!(value)).boxed(),
    };
    let shares = proptest::array::uniform4(0.05..0.9f64);
    (select(vec!["down", "up", "wall"]), shares, luminance)
        .prop_map(|(side, shares, luminance)| json!({ "side": side, "shares": shares, "luminance": luminance }))
}

/// Above all objects; without tubes it could lie in the ceiling, which is left to the tests of luminaires.
fn luminaire_in(luminaire: &Value, [x, y, z]: [f64; 3]) -> Value {
    let share = |k: usize| luminaire["shares"][k].as_f64().unwrap();
    let (w, d) = (share(0) * x, share(1) * y);
    let corner = [share(2) * (x - w), share(3) * (y - d)];
    let (corner, u, v) = match luminaire["side"].as_str() {
        Some("down") => ([corner[0], corner[1], 0.9 * z], [0.0, d, 0.0], [w, 0.0, 0.0]),
        Some("up") => ([corner[0], corner[1], 0.85 * z], [w, 0.0, 0.0], [0.0, d, 0.0]),
        _ => ([0.0, corner[1], 0.8 * z], [0.0, d, 0.0], [0.0, 0.0, 0.15 * z]),
    };
    json!({ "kind": "rectangle", "corner_m": corner, "edge_u_m": u, "edge_v_m": v,
            "luminance_cd_m2": luminaire["luminance"] })
}

/// For each quarter of the ceiling a tube or none.
fn tubes(kind: Kind, coloured: bool) -> impl Strategy<Value = Vec<Option<Value>>> {
    let tube = move || prop_oneof![6 => parametric(kind, coloured), 1 => mesh_tube(kind, coloured)];
    (
        proptest::option::weighted(0.9, tube()),
        proptest::collection::vec(proptest::option::weighted(0.25, tube()), 0..MOST_TUBES),
    )
        .prop_map(|(first, others)| std::iter::once(first).chain(others).take(MOST_TUBES).collect())
}

fn simplest_tube() -> Value {
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
    let parts = (place_of_tube(), mirror(coloured), segments, collector(coloured), diffuser(kind, coloured));
    parts
        .prop_map(|(place, reflectance, segments, collector, diffuser)| {
            json!({ "place": place, "tube": { "reflectance": reflectance, "segments": segments,
                    "collector": collector, "diffuser": diffuser } })
        })
        .boxed()
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

/// A tube in its quarter of the ceiling; lengths are radii until then.
fn in_quarter(drawn: &Value, quarter: usize, [x, y, _]: [f64; 3]) -> Value {
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
        }
        tube["centre_m"] = json!(centre);
        tube["diameter_m"] = json!(2.0 * radius);
        tube["diffuser"] = sized(&tube["diffuser"]);
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

/// A sky, and place and time where these say where the sun is.
fn sky(kind: Kind) -> impl Strategy<Value = (Value, Option<(Value, String)>)> {
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

fn level() -> impl Strategy<Value = (&'static str, f64)> {
    prop_oneof![
        (100.0..20_000.0f64).prop_map(|value| ("zenith_luminance_cd_m2", value)),
        (100.0..30_000.0f64).prop_map(|value| ("diffuse_horizontal_illuminance_lux", value)),
        (0.05..0.5f64).prop_map(|value| ("dv_ev", value)),
        (2.0..10.0f64).prop_map(|value| ("luminous_turbidity", value)),
    ]
}

/// One or two grids, and at most one view.
fn outputs(kind: Kind) -> impl Strategy<Value = (Vec<Value>, Vec<Value>)> {
    let grid = (
        prop_oneof![1 => Just(0.0), 3 => 0.0..0.95f64],
        [1..=3u32, 1..=3u32],
        prop_oneof![1 => Just(0.0), 2 => 0.0..0.9f64],
        select(vec!["point", "cell_average"]),
    );
    let grid = grid.prop_map(|(height, cells, margin, estimate)| {
        json!({ "height": height, "cells": cells, "margin": margin, "estimate": estimate })
    });
    let grids = proptest::collection::vec(grid, 1..=2);
    let point = || proptest::array::uniform3(0.02..0.98f64);
    let view = (point(), point(), 20.0..120.0f64, [4..=12u32, 4..=12u32]).prop_map(
        |(eye, look_at, fov, size_px)| json!({ "eye": eye, "look_at": look_at, "fov": fov, "size_px": size_px }),
    );
    let views = match kind {
        Kind::Plain => Just(Vec::new()).boxed(),
        Kind::Any => prop_oneof![3 => Just(Vec::new()), 1 => proptest::collection::vec(view, 1)].boxed(),
    };
    (grids, views)
}

fn in_room(grid: &Value, number: usize, [x, y, z]: [f64; 3]) -> Value {
    let share = |name: &str| grid[name].as_f64().unwrap();
    json!({ "name": format!("grid-{number}"), "height_m": share("height") * z, "cells": grid["cells"],
            "margin_m": share("margin") * 0.5 * x.min(y), "estimate": grid["estimate"] })
}

fn view_in(view: &Value, number: usize, size: [f64; 3]) -> Value {
    let point = |name: &str| {
        let shares = three(&view[name]);
        [0, 1, 2].map(|axis| shares[axis] * size[axis])
    };
    let (eye, mut look_at) = (point("eye"), point("look_at"));
    // never straight up
    if (look_at[0] - eye[0]).abs() < 0.01 {
        look_at[0] += 0.01;
    }
    json!({ "name": format!("view-{number}"), "eye_m": eye, "look_at_m": look_at, "vertical_fov_deg": view["fov"],
            "size_px": view["size_px"] })
}

/// Effects that are switched off, of those that other results have without them.
fn effects(kind: Kind) -> impl Strategy<Value = Value> {
    let names = match kind {
        Kind::Plain => vec![],
        Kind::Any => vec!["interreflection", "guide_return", "objects", "glossy", "sun", "luminaires"],
    };
    let none = Just(json!({}));
    if names.is_empty() {
        return none.boxed();
    }
    prop_oneof![6 => none, 1 => select(names).prop_map(|name| json!({ name: "off" }))].boxed()
}

/// What a mesh's id says: its shape, its size in metres, its unit and where its own origin lies, in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshName {
    pub shape: String,
    pub size: [f64; 3],
    pub unit: String,
    pub offset: [f64; 3],
}

impl MeshName {
    pub fn text(&self) -> String {
        let Self { shape, size, unit, offset } = self;
        let numbers = size.iter().chain(offset).map(f64::to_string).collect::<Vec<_>>();
        format!("{shape} {unit} {}", numbers.join(" "))
    }

    pub fn read(text: &str) -> Option<Self> {
        let words: Vec<&str> = text.split(' ').collect();
        let [shape, unit, numbers @ ..] = &words[..] else { return None };
        let numbers: Vec<f64> = numbers.iter().map(|word| word.parse()).collect::<Result<_, _>>().ok()?;
        let [a, b, c, x, y, z] = numbers[..] else { return None };
        Some(Self { shape: (*shape).to_owned(), size: [a, b, c], unit: (*unit).to_owned(), offset: [x, y, z] })
    }

    /// The OBJ file, in the mesh's own unit.
    fn obj(&self) -> Option<String> {
        let [w, d, h] = self.size;
        let (x, y) = (0.5 * w, 0.5 * d);
        let (corners, faces) = match self.shape.as_str() {
            "tetrahedron" => {
                let corners = vec![[-x, -y, 0.0], [x, -y, 0.0], [-x, y, 0.0], [0.2 * x, 0.1 * y, h]];
                (corners, "usemtl all\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n".to_owned())
            }
            // two slanting quadrilaterals that share an edge
            "sheet" => {
                let corners =
                    vec![[-x, -y, 0.0], [0.0, -y, h], [0.0, y, h], [-x, y, 0.0], [x, -y, 0.5 * h], [x, y, 0.5 * h]];
                (corners, "usemtl all\nf 1 2 3 4\nf 2 5 6 3\n".to_owned())
            }
            // four walls without ends
            "pipe" => (prism(4, x.min(y), h), format!("usemtl all\n{}", sides(4))),
            shape => {
                let open = shape.strip_prefix("open-tube");
                let count: usize = open.or(shape.strip_prefix("tube"))?.parse().ok()?;
                let polygon = |from: usize| (from..from + count).map(|k| format!(" {k}")).collect::<String>();
                let mut faces = format!("usemtl closure\nf{}\nusemtl pipe\n{}", polygon(1), sides(count));
                if open.is_none() {
                    faces += &format!("usemtl cover\nf{}\n", polygon(count + 1));
                }
                (prism(count, w, h), faces)
            }
        };
        let metres = UNITS.iter().find(|(name, _)| *name == self.unit)?.1;
        let vertices = corners.iter().map(|corner: &[f64; 3]| {
            let [a, b, c] = [0, 1, 2].map(|axis| (corner[axis] + self.offset[axis]) / metres);
            format!("v {a} {b} {c}\n")
        });
        Some(vertices.collect::<String>() + &faces)
    }
}

/// Corners of two regular polygons, the second `height` above the first.
fn prism(count: usize, radius: f64, height: f64) -> Vec<[f64; 3]> {
    let corner = |k: usize, z: f64| {
        let (sin, cos) = (2.0 * PI * k as f64 / count as f64).sin_cos();
        [radius * cos, radius * sin, z]
    };
    (0..count).map(|k| corner(k, 0.0)).chain((0..count).map(|k| corner(k, height))).collect()
}

fn sides(count: usize) -> String {
    (0..count)
        .map(|k| format!("f {} {} {} {}\n", k + 1, (k + 1) % count + 1, (k + 1) % count + count + 1, k + count + 1))
        .collect()
}

/// The meshes that documents of this generator name.
pub struct Meshes;

impl MeshSource for Meshes {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let text = MeshName::read(id).and_then(|name| name.obj()).ok_or(format!("no mesh has the id {id:?}"))?;
        parse_obj(text.as_bytes(), ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// Values of a strategy, without a test that shrinks them.
pub fn drawn<S: Strategy>(cases: u32, strategy: S) -> impl Iterator<Item = S::Value> {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::new(crate::render::config(cases));
    (0..cases).map(move |_| strategy.new_tree(&mut runner).unwrap().current())
}
