//! Rooms whose openings are not all level in a level ceiling: below a slope, in its plane, and in a wall.

use proptest::prelude::*;
use serde_json::{Value, json};

use super::Kind;
use super::faces::ByFaces;
use super::values::three;

/// Where the openings of a document are.
#[derive(Clone, Copy, Debug)]
pub enum Lie {
    /// Level, in a level ceiling.
    Level,
    /// In a ceiling that rises toward the north by an angle in degrees.
    Slope { pitch_deg: f64, is_hanging: bool },
    /// In the southern wall, at a share of its height; there is one tube alone.
    Wall(f64),
}

pub fn lie(kind: Kind) -> BoxedStrategy<Lie> {
    if kind == Kind::Plain {
        return Just(Lie::Level).boxed();
    }
    let slope = (3.0..25.0f64, any::<bool>()).prop_map(|(pitch_deg, is_hanging)| Lie::Slope { pitch_deg, is_hanging });
    prop_oneof![5 => Just(Lie::Level), 2 => slope, 2 => (0.0..=1.0f64).prop_map(Lie::Wall)].boxed()
}

/// Moves the openings of a document to where they are; its room is a box until then, and is given by its faces afterwards where it is to be.
pub fn place(document: &mut Value, lie: Lie, by_faces: Option<ByFaces>) {
    let size = three(&document["room"]["size_m"]);
    let tubes = document["tubes"].as_array_mut().unwrap();
    match lie {
        Lie::Level => {}
        Lie::Slope { pitch_deg, is_hanging } => {
            let several = tubes.len() > 1;
            for tube in tubes {
                if is_hanging {
                    // so far that no rim cuts the slope
                    tube["drop_m"] = json!(1.001 * radius(tube) * pitch_deg.to_radians().tan());
                    continue;
                }
                tube["normal"] = json!("face");
                // bends of tubes that lean alike could cross
                if let Some(segments) = tube["segments"].as_array_mut().filter(|_| several) {
                    segments.truncate(1);
                }
            }
            if by_faces.is_none() {
                slope(&mut document["room"], size, pitch_deg);
            }
        }
        Lie::Wall(share) => {
            tubes.truncate(1);
            let Some(tube) = tubes.first_mut() else { return };
            let radius = radius(tube);
            let height = radius + 0.01 * size[2] + share * (0.98 * size[2] - 2.0 * radius);
            let along = tube["centre_m"][0].clone();
            tube["normal"] = json!("face");
            tube["centre_m"] = json!([along, 0.0, height]);
            // away from the wall
            for segment in tube["segments"].as_array_mut().into_iter().flatten().skip(1) {
                let azimuth = segment["azimuth_deg"].as_f64().unwrap();
                segment["azimuth_deg"] = json!(90.0 + azimuth.rem_euclid(180.0));
            }
        }
    }
    if let Some(by_faces) = by_faces {
        by_faces.write(document, size, lie);
    }
}

/// Largest distance in m of the rim of a tube's opening from its centre: squares lie in that circle.
fn radius(tube: &Value) -> f64 {
    let side = tube["closure_shape"]["side_m"].as_f64().map(|side| side * std::f64::consts::FRAC_1_SQRT_2);
    let pipe = ["diameter_m", "opening_diameter_m"].iter().find_map(|name| tube[*name].as_f64());
    side.unwrap_or(0.5 * pipe.unwrap())
}

/// Makes a box a plan below a slope, which is as high as the box in the south.
fn slope(room: &mut Value, [x, y, z]: [f64; 3], pitch_deg: f64) {
    let fields = room.as_object_mut().unwrap();
    fields.remove("size_m");
    fields.insert("plan".to_owned(), json!({ "outline_m": [[0, 0], [x, 0], [x, y], [0, y]] }));
    let ceiling = json!({ "kind": "sloped", "point_m": [0, 0, z], "rise_toward_deg": 0, "pitch_deg": pitch_deg });
    fields.insert("ceiling".to_owned(), ceiling);
    let surfaces = fields["surfaces"].as_object_mut().unwrap();
    for (name, edge) in [("wall_east", "wall_1"), ("wall_north", "wall_2")] {
        if let Some(surface) = surfaces.remove(name) {
            surfaces.insert(edge.to_owned(), surface);
        }
    }
}
