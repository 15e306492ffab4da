//! Generated documents have openings of all kinds: those of tubes that are meshes, too, and in rooms of faces.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::generator::{self, Kind};

/// Place of a tube's opening in words: the room, the plane of the opening, and whether the face is named.
fn opening(document: &Value, tube: &Value) -> String {
    let room = if document["room"]["faces"].is_array() { "faces" } else { "box or plan" };
    let wall = tube["centre_m"].as_array().is_some_and(|centre| centre.len() == 3);
    let plane = match tube["normal"].as_str() {
        Some("face") if wall => "in a wall",
        Some("face") => "in a ceiling",
        _ if tube["drop_m"].is_number() => "hanging",
        _ => "level",
    };
    let named = if tube["face"].is_string() { ", named" } else { "" };
    let mesh = if tube["mesh"].is_string() { ", a mesh" } else { "" };
    format!("{room}, {plane}{named}{mesh}")
}

#[test]
fn openings_are_of_all_kinds() {
    let documents: Vec<Value> = generator::drawn(600, generator::document(Kind::Any)).collect();
    let tubes = |document: &Value| document["tubes"].as_array().cloned().unwrap_or_default();
    let found: BTreeSet<String> = documents
        .iter()
        .flat_map(|document| tubes(document).into_iter().map(|tube| opening(document, &tube)))
        .collect();
    for plane in ["level", "hanging", "in a ceiling", "in a wall"] {
        for kind in [format!("box or plan, {plane}"), format!("faces, {plane}"), format!("faces, {plane}, named")] {
            assert!(found.contains(&kind), "{kind}: {found:?}");
        }
    }
    assert!(found.iter().any(|kind| kind.starts_with("faces") && kind.ends_with("a mesh")), "{found:?}");
}
