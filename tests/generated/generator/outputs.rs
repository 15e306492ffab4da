//! Grids and views.

use proptest::prelude::*;
use proptest::sample::select;
use serde_json::{Value, json};

use super::Kind;
use super::meshes::MeshName;
use super::room::turned;
use super::values::three;

/// One or two grids, and at most one view.
pub fn outputs(kind: Kind) -> impl Strategy<Value = (Vec<Value>, Vec<Value>)> {
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

pub fn in_room(grid: &Value, number: usize, [x, y, z]: [f64; 3]) -> Value {
    let share = |name: &str| grid[name].as_f64().unwrap();
    json!({ "name": format!("grid-{number}"), "height_m": share("height") * z, "cells": grid["cells"],
            "margin_m": share("margin") * 0.5 * x.min(y), "estimate": grid["estimate"] })
}

/// The view in a room of this `size`; an eye that may be in one of the objects is lifted above all of them.
pub fn view_in(view: &Value, number: usize, size: [f64; 3], objects: &[Value]) -> Value {
    let point = |name: &str| {
        let shares = three(&view[name]);
        [0, 1, 2].map(|axis| shares[axis] * size[axis])
    };
    let (mut eye, mut look_at) = (point("eye"), point("look_at"));
    if objects.iter().any(|object| is_around(object, eye)) {
        eye[2] = (0.76 + 0.2 * eye[2] / size[2]) * size[2];
    }
    // never straight up
    if (look_at[0] - eye[0]).abs() < 0.01 {
        look_at[0] += 0.01;
    }
    json!({ "name": format!("view-{number}"), "eye_m": eye, "look_at_m": look_at, "vertical_fov_deg": view["fov"],
            "size_px": view["size_px"] })
}

/// True if an object may hold a point below its top: its width and depth reach there, however it is turned.
fn is_around(object: &Value, [x, y, _]: [f64; 3]) -> bool {
    let place = three(&object["position_m"]);
    let (size, offset) = match object["mesh"].as_str().and_then(MeshName::read) {
        Some(mesh) => (mesh.size, turned(mesh.offset, object["rotation_deg"].as_f64().unwrap())),
        None => (three(&object["size_m"]), [0.0; 3]),
    };
    let away = (x - place[0] - offset[0]).hypot(y - place[1] - offset[1]);
    away <= 0.5 * size[0].hypot(size[1])
}
