//! Inputs of a job in words for people: its room, its surfaces, its tubes, and the light outdoors.

use serde_json::Value;

use super::phrases::{in_words, list, text};
use super::subject::Subject;
use crate::figure::sheet::SheetPart;
use crate::figure::ticks::{fixed, short, significant};
use crate::geometry::covered::{enclosed_area, polygon};

/// Largest number of kinds of tubes, and of places of each, that a report lists: a hundred tubes would fill it.
const MOST: usize = 6;

/// Describes room, surfaces, contents, tubes and the light outdoors. `job` is the job as the service returns it.
pub fn inputs(subject: &Subject, job: &Value) -> SheetPart {
    let room = &job["document"]["room"];
    let mut facts = vec![("room".to_owned(), shape(subject, room)), ("reflectances".to_owned(), surfaces(room))];
    let names = [("partitions", "partition"), ("objects", "object"), ("luminaires", "luminaire")];
    let counts = names.iter().map(|(name, noun)| (list(&room[*name]).len(), noun)).filter(|(count, _)| *count > 0);
    let counts: Vec<String> =
        counts.map(|(count, noun)| format!("{count} {noun}{}", if count == 1 { "" } else { "s" })).collect();
    if !counts.is_empty() {
        facts.push(("in the room".to_owned(), counts.join(", ")));
    }
    facts.extend(tubes(list(&job["document"]["tubes"])));
    let outdoors = &job["external_horizontal_illuminance_lux"];
    if let (Some(sky), Some(sun)) = (outdoors["sky"].as_f64(), outdoors["sun"].as_f64())
        && sky + sun > 0.0
    {
        let [whole, sky, sun] = [sky + sun, sky, sun].map(|lux| significant(lux, 3));
        let words = format!("{whole} lx on level ground: {sky} lx of the sky, {sun} lx of the sun");
        facts.push(("outdoors".to_owned(), words));
    }
    SheetPart::Facts { title: "What was computed".to_owned(), facts }
}

fn shape(subject: &Subject, room: &Value) -> String {
    let Some(document) = &subject.document else { return "not known".to_owned() };
    let [low, high] = document.room.bounds_m();
    let [x, y, z] = (high - low).to_array().map(|length| short((length * 100.0).round() / 100.0));
    let floor: f64 = document.room.rings().iter().map(|ring| enclosed_area(&polygon(ring))).sum();
    let corners = list(&room["plan"]["outline_m"]).len();
    let plan = if corners > 4 { format!(", with {corners} corners") } else { String::new() };
    let ceiling = match text(&room["ceiling"]["kind"]) {
        "" | "flat" => format!("{z} m high"),
        kind => format!("{kind} ceiling up to {z} m"),
    };
    format!("floor of {} m², {x} m × {y} m{plan}, {ceiling}", short((floor * 10.0).round() / 10.0))
}

fn surfaces(room: &Value) -> String {
    let all = room["surfaces"].as_object().into_iter().flatten();
    let of_one = |(name, surface): (&String, &Value)| {
        let name = wall_between(name, room).unwrap_or_else(|| name.replace('_', " "));
        match (surface["open"].as_bool(), surface["reflectance"].as_f64()) {
            (Some(true), _) => format!("{name} open"),
            (_, Some(reflectance)) => {
                let glossy = surface["specular"].as_f64().filter(|share| *share > 0.0);
                let glossy = glossy.map_or_else(String::new, |share| format!(", {} % of it glossy", percent(share)));
                format!("{name} {} %{glossy}", percent(reflectance))
            }
            _ => format!("{name} {}", in_words(surface)),
        }
    };
    all.map(of_one).collect::<Vec<_>>().join("; ")
}

/// Names a wall of a plan, `wall_2`, by its corners; `None` of other surfaces.
fn wall_between(name: &str, room: &Value) -> Option<String> {
    let edge: usize = name.strip_prefix("wall_")?.parse().ok()?;
    let corners = list(&room["plan"]["outline_m"]);
    let [from, to] = [corners.get(edge)?, corners.get((edge + 1) % corners.len())?].map(point);
    Some(format!("wall from {from} to {to}"))
}

/// Writes a point in metres.
fn point(of: &Value) -> String {
    format!("({})", list(of).iter().filter_map(Value::as_f64).map(metres).collect::<Vec<_>>().join(", "))
}

/// Describes the tubes, numbered from 1; those that differ by their places only are described once.
fn tubes(tubes: &[Value]) -> Vec<(String, String)> {
    let mut kinds: Vec<(Value, Vec<usize>)> = Vec::new();
    for (index, tube) in tubes.iter().enumerate() {
        let mut kind = tube.clone();
        if let Some(fields) = kind.as_object_mut() {
            fields.remove("centre_m");
        }
        match kinds.iter_mut().find(|(other, _)| *other == kind) {
            Some((_, numbers)) => numbers.push(index),
            None => kinds.push((kind, vec![index])),
        }
    }
    let place = |index: &usize| point(&tubes[*index]["centre_m"]);
    let told = kinds.iter().take(MOST).map(|(kind, numbers)| {
        let places = numbers.iter().take(MOST).map(place).collect::<Vec<_>>().join(", ");
        let more = numbers.len().saturating_sub(MOST);
        let more = if more > 0 { format!(" and {more} more places") } else { String::new() };
        let name = match numbers[..] {
            [one] => format!("tube {}", one + 1),
            [one, other] => format!("tubes {} and {}", one + 1, other + 1),
            _ => format!("{} tubes", numbers.len()),
        };
        (name, format!("{}; at {places} m{more}", tube_in_words(kind)))
    });
    told.collect()
}

fn tube_in_words(tube: &Value) -> String {
    let segments = list(&tube["segments"]);
    let Some(diameter) = tube["diameter_m"].as_f64().filter(|_| !segments.is_empty()) else { return in_words(tube) };
    let lengths = segments.iter().map(|segment| {
        let length = format!("{} m", metres(segment["length_m"].as_f64().unwrap_or_default()));
        match segment["tilt_deg"].as_f64().filter(|tilt| *tilt != 0.0) {
            Some(tilt) => {
                let toward = short(segment["azimuth_deg"].as_f64().unwrap_or_default());
                format!("{length} leaning by {}° toward azimuth {toward}°", short(tilt))
            }
            None => length,
        }
    });
    let mirror = match tube["reflectance"].as_f64() {
        Some(reflectance) => format!("mirror of {} %", percent(reflectance)),
        None => format!("mirror of {}", in_words(&tube["reflectance"])),
    };
    let lengths: Vec<String> = lengths.collect();
    let long = if lengths.len() == 1 { " long" } else { "" };
    let top = part(&tube["collector"], &[("open", "open at the top"), ("flat", "flat pane"), ("dome", "dome")]);
    let names = [("lambertian", "opal diffuser"), ("clear", "clear pane"), ("open", "open at the ceiling")];
    let end = part(&tube["diffuser"], &names);
    let plane = if tube["normal"] == "face" { "; in the plane of its face" } else { "" };
    let drop = tube["drop_m"].as_f64().filter(|drop| *drop > 0.0);
    let drop = drop.map_or_else(String::new, |drop| format!("; hangs {} m below the ceiling", metres(drop)));
    format!("{} m wide, {}{long}; {mirror}; {top}; {end}{plane}{drop}", metres(diameter), lengths.join(" + "))
}

/// Describes a collector or a diffuser by the name of its kind and what it passes; one of another kind by all its fields.
fn part(of: &Value, names: &[(&str, &str)]) -> String {
    let name = names.iter().find(|(kind, _)| of["kind"] == *kind).map(|(_, name)| *name);
    match (name, &of["transmittance"]) {
        (Some(name), Value::Null) => name.to_owned(),
        (Some(name), Value::Number(passes)) => {
            format!("{name} that passes {} %", percent(passes.as_f64().unwrap_or_default()))
        }
        _ => in_words(of),
    }
}

fn metres(length: f64) -> String {
    short((length * 1000.0).round() / 1000.0)
}

fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    short(fixed(percent, 1).parse().unwrap_or(percent))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn walls_are_named_by_their_corners() {
        let room = json!({ "plan": { "outline_m": [[0, 0], [8, 0], [8, 3.125]] },
                           "surfaces": { "floor": { "reflectance": 0.2 }, "wall_2": { "reflectance": 0.5 }, "wall_9": { "reflectance": 0.4 } } });
        assert_eq!(surfaces(&room), "floor 20 %; wall from (8, 3.125) to (0, 0) 50 %; wall 9 40 %");
    }
}
