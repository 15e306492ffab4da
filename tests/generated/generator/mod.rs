//! Any valid job document, small enough to be rendered in a moment: its scene and outputs, without method and stop.
//!
//! Values are drawn as shares of what they have to fit into, so that each document is valid as it is made; smaller and
//! simpler ones are what proptest shrinks to.

mod faces;
mod lies;
mod meshes;
mod outputs;
mod room;
mod sky;
mod tubes;
mod values;

use proptest::prelude::*;
use proptest::sample::select;
use serde_json::{Value, json};

pub use meshes::{MeshName, Meshes, UNITS};
pub use room::{placed, turned};
pub use values::three;

use faces::by_faces;
use lies::{lie, place};
use outputs::{in_room, outputs, view_in};
use room::room;
use sky::{sky, surroundings};
use tubes::{in_quarter, simplest_tube, tubes};

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

/// A valid document.
pub fn document(kind: Kind) -> impl Strategy<Value = Value> {
    let coloured = prop_oneof![4 => Just(false), 1 => Just(true)];
    coloured.prop_flat_map(move |coloured| {
        let everything = (
            room(kind, coloured),
            tubes(kind, coloured),
            (sky(kind), surroundings(kind), lie(kind), by_faces(kind)),
            outputs(kind),
            effects(kind),
            any::<u32>(),
        );
        everything.prop_map(move |(room, tubes, ((sky, located), surroundings, lie, by_faces), outputs, effects, seed)| {
            let size = sizes(&room);
            let objects = room["objects"].as_array().unwrap();
            let lit = !room["luminaires"].as_array().unwrap().is_empty();
            let several = tubes.iter().flatten().count() > 1;
            let mut tubes: Vec<Value> = tubes
                .iter()
                .enumerate()
                .filter_map(|(quarter, tube)| Some(in_quarter(tube.as_ref()?, quarter, size, several)))
                .collect();
            if tubes.is_empty() && !lit {
                tubes.push(in_quarter(&simplest_tube(), 0, size, false));
            }
            let (grids, views) = outputs;
            let mut document = json!({
                "room": room, "tubes": tubes, "sky": sky, "effects": effects, "seed": seed,
                "grids": grids.iter().enumerate().map(|(k, grid)| in_room(grid, k, size)).collect::<Vec<_>>(),
                "views": views.iter().enumerate().map(|(k, view)| view_in(view, k, size, objects)).collect::<Vec<_>>(),
            });
            if let Some(surroundings) = surroundings {
                document["surroundings"] = surroundings;
            }
            if let Some((location, time)) = located {
                document["location"] = location;
                document["time"] = json!(time);
            }
            place(&mut document, lie, by_faces);
            document
        })
    })
}

fn sizes(room: &Value) -> [f64; 3] {
    [0, 1, 2].map(|axis| room["size_m"][axis].as_f64().unwrap())
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

/// Values of a strategy, without a test that shrinks them.
pub fn drawn<S: Strategy>(cases: u32, strategy: S) -> impl Iterator<Item = S::Value> {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::new(crate::render::config(cases));
    (0..cases).map(move |_| strategy.new_tree(&mut runner).unwrap().current())
}
