//! Rooms given by their faces, and tubes that come through one of them by its name.

use proptest::prelude::*;
use serde_json::{Value, json};

use super::Kind;
use super::lies::Lie;

/// How a room is given by its faces.
#[derive(Clone, Copy, Debug)]
pub struct ByFaces {
    /// Faces that run the other way, bit by bit.
    reversed: u8,
    /// Whether tubes name the face that they come through.
    names_face: bool,
}

/// For some documents how their room is given by its faces.
pub fn by_faces(kind: Kind) -> impl Strategy<Value = Option<ByFaces>> {
    let some = (any::<u8>(), any::<bool>()).prop_map(|(reversed, names_face)| ByFaces { reversed, names_face });
    match kind {
        Kind::Plain => Just(None).boxed(),
        Kind::Any => proptest::option::weighted(0.3, some).boxed(),
    }
}

impl ByFaces {
    /// Makes a box a room of faces, whose ceiling rises toward the north where its openings lie below or in a slope.
    pub fn write(self, document: &mut Value, [x, y, z]: [f64; 3], lie: Lie) {
        let (face_of_tubes, rise) = match lie {
            Lie::Level => ("ceiling", 0.0),
            Lie::Slope { pitch_deg, .. } => ("ceiling", y * pitch_deg.to_radians().tan()),
            Lie::Wall(_) => ("wall_south", 0.0),
        };
        let high = z + rise;
        // surfaces have the names of the faces of boxes
        let faces = [
            ("floor", "floor", [[0.0, 0.0, 0.0], [0.0, y, 0.0], [x, y, 0.0], [x, 0.0, 0.0]]),
            ("wall_south", "wall", [[0.0, 0.0, 0.0], [x, 0.0, 0.0], [x, 0.0, z], [0.0, 0.0, z]]),
            ("wall_east", "wall", [[x, 0.0, 0.0], [x, y, 0.0], [x, y, high], [x, 0.0, z]]),
            ("wall_north", "wall", [[x, y, 0.0], [0.0, y, 0.0], [0.0, y, high], [x, y, high]]),
            ("wall_west", "wall", [[0.0, y, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, z], [0.0, y, high]]),
            ("ceiling", "ceiling", [[0.0, 0.0, z], [x, 0.0, z], [x, y, high], [0.0, y, high]]),
        ];
        let written = faces.iter().enumerate().map(|(number, (name, kind, corners))| {
            let mut boundary = corners.to_vec();
            if self.reversed >> number & 1 == 1 {
                boundary.reverse();
            }
            json!({ "name": name, "kind": kind, "boundary_m": boundary })
        });
        document["room"]["faces"] = written.collect();
        document["room"].as_object_mut().unwrap().remove("size_m");
        for tube in document["tubes"].as_array_mut().unwrap().iter_mut().filter(|_| self.names_face) {
            tube["face"] = json!(face_of_tubes);
        }
    }
}
