//! Valid values that replace missing ones or ones of a wrong type, so that the rest of a document can be checked.

use serde_json::{Value, json};

/// Returns a valid value that removes the error at `pointer`, and the pointer to the place where it belongs; `None` if there is
/// none.
///
/// An object without a valid `kind` or `role` is replaced as a whole, because its other fields cannot be interpreted.
pub fn stand_in(pointer: &str) -> Option<(&str, Value)> {
    let (parent, token) = pointer.rsplit_once('/')?;
    if parent.ends_with("/closure_shape") {
        return Some((parent, Value::Null));
    }
    if token == "kind" || token == "role" {
        return Some((parent, whole(parent)?));
    }
    if parent.ends_with("/parts") {
        // its name is that of a material of the mesh
        return Some((pointer, whole(pointer)?));
    }
    if token.parse::<u32>().is_ok() {
        // for a vector or a colour, the whole of it
        return Some((parent, field(parent)?));
    }
    Some((pointer, field(pointer)?))
}

/// Returns the prefix of pointers whose errors are meaningless once the value at `pointer` is made up.
pub fn spoils(pointer: &str) -> &str {
    let parent = pointer.rsplit_once('/').map_or("", |(parent, _)| parent);
    let of_table = |name: &str| pointer.ends_with(name);
    // edges are checked together, and so are the rows of a table
    let together = parent.starts_with("/room/luminaires/")
        || ["incidence_deg", "exit_deg", "btdf_per_sr"].iter().any(|name| of_table(name));
    if together { parent } else { pointer }
}

/// Returns a valid object of the sort that belongs at `pointer`.
fn whole(pointer: &str) -> Option<Value> {
    let (parent, token) = pointer.rsplit_once('/')?;
    let list = parent.rsplit('/').next().unwrap_or("");
    match (list, token) {
        ("objects", _) => Some(json!({ "kind": "box", "size_m": [1e-6, 1e-6, 1e-6], "position_m": [1e-3, 1e-3, 0],
                                       "surface": { "reflectance": 0.5 } })),
        ("luminaires", _) => {
            Some(json!({ "kind": "rectangle", "corner_m": [1e-3, 1e-3, 1e-3], "edge_u_m": [1e-6, 0, 0],
                                          "edge_v_m": [0, 1e-6, 0], "luminance_cd_m2": 1 }))
        }
        ("parts", _) => Some(json!({ "role": "pipe", "reflectance": 0.5 })),
        (_, "collector" | "diffuser") => Some(json!({ "kind": "open" })),
        ("room", "ceiling") => Some(json!({ "kind": "flat", "height_m": 1000 })),
        (_, "method") => Some(json!("auto")),
        _ => None,
    }
}

/// Returns a valid value for the field at `pointer` that does not conflict with other fields.
fn field(pointer: &str) -> Option<Value> {
    let (parent, name) = pointer.rsplit_once('/')?;
    Some(match name {
        // its name is that of a face
        _ if parent == "/room/surfaces" => json!({ "reflectance": 0.5 }),
        // no object is too large for it
        "room" => json!({ "size_m": [1000, 1000, 1000] }),
        "size_m" if parent == "/room" => json!([1000, 1000, 1000]),
        "size_m" => json!([1e-6, 1e-6, 1e-6]),
        "position_m" | "corner_m" => json!([1e-3, 1e-3, 1e-3]),
        "edge_u_m" => json!([1e-6, 0, 0]),
        "edge_v_m" => json!([0, 1e-6, 0]),
        "eye_m" => json!([0.123, 0.456, 0.789]),
        "look_at_m" => json!([-0.321, 0.654, -0.987]),
        "up" if parent.starts_with("/views/") => json!([0, 0, 1]),
        "up" => json!("z"),
        "centre_m" | "from_m" => json!([1e-3, 1e-3]),
        "to_m" => json!([2e-3, 1e-3]),
        "outline_m" => json!([[0, 0], [1000, 0], [1000, 1000], [0, 1000]]),
        "plan" => json!({ "outline_m": [[0, 0], [1000, 0], [1000, 1000], [0, 1000]] }),
        "ceiling" if parent == "/room" => json!({ "kind": "flat", "height_m": 1000 }),
        "height_m" if parent == "/room/ceiling" || parent.starts_with("/room/partitions/") => json!(0.01),
        "point_m" => json!([0, 0, 1000]),
        "eaves_m" => json!(500),
        "ridge_m" => json!(1000),
        "spacing_m" => json!(1000),
        "diameter_m" | "opening_diameter_m" | "thickness_m" => json!(1e-6),
        "length_m" => json!(100),
        "segments" => json!([{ "length_m": 100 }]),
        "collector" | "diffuser" => json!({ "kind": "open" }),
        "closure_shape" => Value::Null,
        "surface" => json!({ "reflectance": 0.5 }),
        "surfaces" | "back_surfaces" | "parts" | "effects" => json!({}),
        "scale" => json!(1),
        "offset" => json!([0, 0, 0]),
        "cells" | "size_px" => json!([1, 1]),
        "name" | "mesh" | "weather" => json!("stands-in"),
        "unit" => json!("m"),
        "inner" => json!("clear"),
        "method" => json!("auto"),
        "refractive_index" | "luminance_cd_m2" => json!(1),
        "reflectance" if parent.ends_with("/reflectance") => json!([0, 0]),
        "incidence_deg" | "exit_deg" => json!([0, 90]),
        "btdf_per_sr" => json!([[0, 0], [0, 0]]),
        "transmittance" | "reflectance" | "lambertian_transmittance" | "clear_transmittance" => json!(0),
        "lambertian_radius_m" | "height_m" | "margin_m" => json!(0),
        "latitude_deg" | "longitude_deg" | "altitude_deg" | "azimuth_deg" | "tilt_deg" | "rotation_deg"
        | "rise_toward_deg" | "pitch_deg" | "ridge_azimuth_deg" | "drop_m" => json!(0),
        _ => return None,
    })
}
