//! Rules between fields, each written as the `not` of a schema that an invalid document matches; the checks of a document enforce
//! them, too.

use serde_json::{Value, json};

use crate::document::limits::TURBID_TYPES;
use crate::document::method;
use crate::sky::{CieType, IesSky, SkyType};

/// Returns the rules between fields that a schema can express, each with the name of its component.
pub fn rules() -> Vec<(&'static str, Value)> {
    let sun_position = |kind: &str| json!({ "properties": { "sun_position": { "type": kind } } });
    let with_sky = |rule: Value| json!({ "required": ["sky"], "properties": { "sky": { "allOf": [{ "type": "object" }, rule] } } });
    let tubes = || json!({ "required": ["tubes"], "properties": { "tubes": { "minItems": 1 } } });
    let outputs = |list: &str, least: u32| json!({ "required": [list], "properties": { list: { "minItems": least } } });
    let is_set = |field: &str| json!({ "required": [field], "properties": { field: { "const": true } } });
    let grid_in_parts = json!({ "required": ["grids"], "properties": { "grids": {
        "type": "array", "contains": any([is_set("components"), is_set("responses")]) } } });
    let no_outputs = |list: &str| json!({ "properties": { list: { "maxItems": 0 } } });
    let grids_only = json!({ "anyOf": [
        { "enum": method::grids_only() },
        { "type": "object", "required": ["kind"], "properties": { "kind": { "enum": method::grids_only() } } },
    ] });
    let open_ceiling = json!({ "properties": { "surfaces": { "required": ["ceiling"], "properties": { "ceiling": {
        "required": ["open"], "properties": { "open": { "const": true } } } } } }, "required": ["surfaces"] });
    let independent = json!({ "anyOf": [
        { "required": ["cie_type"], "properties": { "cie_type": { "enum": independent_types() } } },
        { "required": ["preset"], "properties": { "preset": { "const": IesSky::Overcast.name() } } },
    ] });
    let no_beam = any([
        absent("direct_normal_illuminance_lux"),
        json!({ "properties": { "direct_normal_illuminance_lux": { "const": 0 } } }),
    ]);
    let level = any([given("zenith_luminance_cd_m2"), given("diffuse_horizontal_illuminance_lux")]);
    let needs_sun = json!({ "not": all([independent, no_beam, level]) });
    let job = [
        // at least one output
        json!({ "properties": { "grids": { "maxItems": 0 }, "views": { "maxItems": 0 } } }),
        // at least one source of light
        json!({ "properties": {
            "tubes": { "maxItems": 0 }, "room": { "properties": { "luminaires": { "maxItems": 0 } } } } }),
        // tubes need a sky or a year, and nothing needs both
        all([tubes(), absent("sky"), absent("annual")]),
        all([
            given("annual"),
            any([
                given("sky"),
                given("time"),
                outputs("views", 1),
                no_outputs("grids"),
                no_outputs("tubes"),
                grid_in_parts,
            ]),
        ]),
        // tubes need a closed ceiling
        all([tubes(), json!({ "properties": { "room": open_ceiling } })]),
        // the sun's position is given by the sky, or by location and time, and not by both
        all([
            with_sky(all([json!({ "required": ["sun_position"] }), sun_position("object")])),
            any([given("location"), given("time")]),
        ]),
        all([with_sky(all([sun_position("null"), needs_sun])), any([absent("location"), absent("time")])]),
        // some methods make no pictures
        json!({ "required": ["method", "views"],
                "properties": { "method": grids_only, "views": { "minItems": 1 } } }),
    ];
    let levels = ["zenith_luminance_cd_m2", "diffuse_horizontal_illuminance_lux", "dv_ev", "luminous_turbidity"];
    let mut sky = vec![
        all([given("cie_type"), given("preset")]),
        all([given("perez"), any([given("cie_type"), given("preset")])]),
        all([absent("cie_type"), absent("preset"), absent("perez")]),
        all([
            given("luminous_turbidity"),
            given("cie_type"),
            json!({ "properties": { "cie_type": {
            "not": { "minimum": TURBID_TYPES.start(), "maximum": TURBID_TYPES.end() } } } }),
        ]),
        all([any([given("preset"), given("perez")]), any([given("dv_ev"), given("luminous_turbidity")])]),
    ];
    for (index, one) in levels.iter().enumerate() {
        sky.extend(levels[..index].iter().map(|other| all([given(one), given(other)])));
    }
    let open = json!({ "required": ["open"], "properties": { "open": { "const": true } } });
    let surface = [
        all([open, given("reflectance")]),
        all([json!({ "properties": { "open": { "const": false } } }), absent("reflectance")]),
    ];
    let room = [
        all([given("size_m"), given("plan")]),
        all([given("faces"), any([given("size_m"), given("plan")])]),
        all([given("hbjson"), any([given("size_m"), given("plan"), given("faces")])]),
        all([given("identifier"), absent("hbjson")]),
        all([absent("size_m"), absent("plan"), absent("faces"), absent("hbjson")]),
        all([given("plan"), absent("ceiling")]),
        all([given("ceiling"), absent("plan")]),
    ];
    let other_than = |field: &str, value: Value| json!({ "required": [field], "properties": { field: { "not": { "const": value } } } });
    let grid = [
        all([given("cells"), given("spacing_m")]),
        all([any([given("cells"), given("spacing_m")]), given("points_m")]),
        all([absent("cells"), absent("spacing_m"), absent("points_m")]),
        all([absent("height_m"), absent("points_m")]),
        all([
            given("points_m"),
            any([given("height_m"), other_than("margin_m", json!(0)), other_than("estimate", json!("point"))]),
        ]),
    ];
    let mesh_object = [
        all([absent("unit"), absent("scale")]),
        all([absent("position_m"), absent("instances")]),
        all([given("position_m"), given("instances")]),
    ];
    vec![
        ("JobDocument", any(job)),
        ("SkyDocument", any(sky)),
        ("SurroundingsDocument", all([given("horizon"), given("horizon_pvgis")])),
        ("FlatCollector", all([given("azimuth_deg"), absent("tilt_deg")])),
        ("SurfaceDocument", any(surface)),
        ("RoomDocument", any(room)),
        ("MeshObject", any(mesh_object)),
        ("GridDocument", any(grid)),
    ]
}

/// Lists the numbers of the types whose luminances are the same wherever the sun is.
fn independent_types() -> Vec<u8> {
    CieType::all().filter(|cie_type| !SkyType::Cie(*cie_type).depends_on_sun()).map(CieType::number).collect()
}

fn given(field: &str) -> Value {
    json!({ "required": [field], "properties": { field: { "not": { "type": "null" } } } })
}

fn absent(field: &str) -> Value {
    json!({ "properties": { field: { "type": "null" } } })
}

fn all(rules: impl IntoIterator<Item = Value>) -> Value {
    json!({ "allOf": rules.into_iter().collect::<Vec<_>>() })
}

fn any(rules: impl IntoIterator<Item = Value>) -> Value {
    json!({ "anyOf": rules.into_iter().collect::<Vec<_>>() })
}
