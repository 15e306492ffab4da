//! Rooms with their surfaces, objects and luminaires.

use proptest::prelude::*;
use proptest::sample::select;
use serde_json::{Value, json};

use super::Kind;
use super::meshes::{MeshName, UNITS};
use super::values::{coefficient, three, two};

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

pub fn room(kind: Kind, coloured: bool) -> impl Strategy<Value = Value> {
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
