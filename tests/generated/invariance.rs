//! What changes nothing: turning room and sun, moving a mesh in its file, its unit, the order of tubes and objects, grey as a
//! colour, other ways to write a mesh object, a room as a Honeybee model.

use proptest::prelude::*;
use serde_json::{Value, json};

use crate::generator::{self, Kind, MOST_TUBES, MOST_VALUES, MeshName, UNITS, three};
use crate::judge::{self, Measured, compare};
use crate::render::{Case, Effort, Found, cases, config, render};

/// Probability that a change of the random numbers alone lets any comparison of a run fail.
const FALSE_ALARM: f64 = 0.01;

const FIRST: Effort = Effort { passes: 16, size: 0.5, fixed: 1 };

/// Passes of renders that decide on a difference: what few passes tell misses what is rare and bright.
const AGAIN: Effort = Effort { passes: 256, size: 0.5, fixed: 16 };

/// Methods of different ways to move light.
const METHODS: [&str; 4] = ["light_tracing", "path_tracing", "bidirectional_path_tracing", "sppm"];

/// A change that must not change results.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// The room and the sun turn by an angle in degrees.
    Turn(f64),
    /// Meshes lie elsewhere in their files, by up to so many metres along each axis.
    Move([f64; 3]),
    /// Files have another unit.
    Unit(&'static str),
    /// Tubes, objects and luminaires stand in reverse order.
    Reverse,
    /// Mesh objects are written in another way.
    Written(Form),
    /// The box is a room of a Honeybee model.
    Model,
}

/// Another way to write a mesh object.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// A scale in place of the unit.
    Scale,
    /// An offset of the file's points in place of a far position.
    Offset,
    /// One copy of the mesh.
    Instance,
    /// Backs with the surfaces of the fronts.
    Backs,
}

/// How nearly equal results are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Equal {
    /// Random numbers are the same; but a rare photon goes elsewhere by rounding.
    ToRounding,
    WithinErrors,
}

/// Largest relative change by rounding: meshes that lie a million metres away have ten digits of a metre.
const ROUNDING: f64 = 1e-6;

/// Largest change by paths that rounding parts, relative to a value's standard error; with other random numbers the change is 1.4.
const PARTED: f64 = 0.25;

fn changed(document: &Value, change: Change) -> Option<(Value, Equal)> {
    let mut changed = document.clone();
    let equal = match change {
        Change::Turn(angle) => {
            let azimuth = document["sky"]["sun_position"]["azimuth_deg"].as_f64()?;
            let turned = |degrees: f64| json!((degrees + angle).rem_euclid(360.0));
            changed["room"]["rotation_deg"] = turned(document["room"]["rotation_deg"].as_f64()?);
            changed["sky"]["sun_position"]["azimuth_deg"] = turned(azimuth);
            Equal::ToRounding
        }
        Change::Move(by) => {
            each_mesh(&mut changed, |name| name.offset = by)?;
            Equal::ToRounding
        }
        Change::Unit(unit) => {
            each_mesh(&mut changed, |name| unit.clone_into(&mut name.unit))?;
            Equal::ToRounding
        }
        Change::Written(form) => {
            let objects = changed["room"]["objects"].as_array_mut()?.iter_mut();
            objects.filter(|object| object["kind"] == "mesh").for_each(|object| written(object, form));
            Equal::WithinErrors
        }
        Change::Model => {
            document["room"]["size_m"].as_array()?;
            let size = three(&document["room"]["size_m"]);
            let room = changed["room"].as_object_mut()?;
            room.remove("size_m");
            room.insert("hbjson".to_owned(), model(size));
            Equal::WithinErrors
        }
        Change::Reverse => {
            changed["tubes"].as_array_mut()?.reverse();
            changed["room"]["objects"].as_array_mut()?.reverse();
            changed["room"]["luminaires"].as_array_mut()?.reverse();
            Equal::WithinErrors
        }
    };
    (changed != *document).then_some((changed, equal))
}

/// Writes a mesh object of this generator in another way.
fn written(object: &mut Value, form: Form) {
    let Some(name) = object["mesh"].as_str().and_then(MeshName::read) else { return };
    let metres = UNITS.iter().find(|(unit, _)| *unit == name.unit).unwrap().1;
    let fields = object.as_object_mut().unwrap();
    match form {
        Form::Scale => {
            fields.remove("unit");
            fields.insert("scale".to_owned(), json!(metres));
        }
        Form::Offset => {
            let turned = generator::turned(name.offset, fields["rotation_deg"].as_f64().unwrap());
            let position = three(&fields["position_m"]);
            let base: Vec<f64> = (0..3).map(|axis| position[axis] + turned[axis]).collect();
            fields.insert("position_m".to_owned(), json!(base));
            fields.insert("offset".to_owned(), json!(name.offset.map(|part| part / metres)));
        }
        Form::Instance => {
            let place = ["position_m", "rotation_deg"].map(|field| (field, fields.remove(field).unwrap()));
            fields.insert(
                "instances".to_owned(),
                json!([place.into_iter().collect::<std::collections::BTreeMap<_, _>>()]),
            );
        }
        Form::Backs => {
            let surfaces = fields["surfaces"].clone();
            fields.insert("back_surfaces".to_owned(), surfaces);
        }
    }
}

/// A Honeybee model with one room, a box whose faces have the names that boxes have here.
fn model([x, y, z]: [f64; 3]) -> Value {
    let face = |identifier: &str, face_type: &str, boundary: [[f64; 3]; 4]| json!({ "type": "Face", "identifier": identifier, "face_type": face_type, "geometry": { "type": "Face3D", "boundary": boundary } });
    let wall = |name: &str, [a, b]: [[f64; 2]; 2]| {
        face(name, "Wall", [[a[0], a[1], 0.0], [b[0], b[1], 0.0], [b[0], b[1], z], [a[0], a[1], z]])
    };
    let faces = [
        face("floor", "Floor", [[0.0, 0.0, 0.0], [0.0, y, 0.0], [x, y, 0.0], [x, 0.0, 0.0]]),
        wall("wall_south", [[0.0, 0.0], [x, 0.0]]),
        wall("wall_east", [[x, 0.0], [x, y]]),
        wall("wall_north", [[x, y], [0.0, y]]),
        wall("wall_west", [[0.0, y], [0.0, 0.0]]),
        face("ceiling", "RoofCeiling", [[0.0, 0.0, z], [x, 0.0, z], [x, y, z], [0.0, y, z]]),
    ];
    json!({ "type": "Model", "identifier": "box", "units": "Meters", "rooms": [{ "type": "Room", "identifier": "box", "faces": faces }] })
}

/// Edits the names of all meshes, and keeps the objects where they are; `None` without meshes.
fn each_mesh(document: &mut Value, edit: impl Fn(&mut MeshName)) -> Option<()> {
    let mut any = None;
    for object in document["room"]["objects"].as_array_mut()? {
        let Some(mut name) = object["mesh"].as_str().and_then(MeshName::read) else { continue };
        let turn = object["rotation_deg"].as_f64()?;
        let position = three(&object["position_m"]);
        let turned = generator::turned(name.offset, turn);
        let base = [0, 1, 2].map(|axis| position[axis] + turned[axis]);
        edit(&mut name);
        *object = generator::placed(name, base, turn, &object["surfaces"]["all"]);
        any = Some(());
    }
    for tube in document["tubes"].as_array_mut()? {
        let Some(mut name) = tube["mesh"].as_str().and_then(MeshName::read) else { continue };
        edit(&mut name);
        // a tube has its own origin, in the middle of its opening
        name.offset = [0.0; 3];
        tube["unit"] = json!(name.unit);
        tube["mesh"] = json!(name.text());
        any = Some(());
    }
    any
}

/// The first difference of two results, in words.
fn difference(a: &Found, b: &Found, change: Change, equal: Equal, limit: f64) -> Option<String> {
    let mut tubes = b.tubes.clone();
    if matches!(change, Change::Reverse) {
        tubes.reverse();
    }
    let of_a = || a.values.iter().chain(&a.means).chain(&a.tubes);
    let of_b = || b.values.iter().chain(&b.means).chain(&tubes);
    let pairs: Vec<(Measured, Measured)> = of_a().copied().zip(of_b().copied()).collect();
    let beyond = pairs.iter().position(|(a, b)| compare(*a, *b, ROUNDING).probability < limit);
    if let Some(place) = beyond {
        return Some(format!("place {place}: {:?} is not {:?}", pairs[place].0, pairs[place].1));
    }
    // where surfaces touch, rounding decides which of them a ray meets: paths of the same random numbers part, a few of many
    let is_same = |(a, b): &&(Measured, Measured)| {
        let apart = (a.value - b.value).abs();
        apart <= ROUNDING * a.value.abs() || apart <= PARTED * a.error
    };
    let same = pairs.iter().filter(is_same).count();
    (equal == Equal::ToRounding && 2 * same < pairs.len())
        .then(|| format!("only {same} of {} values are the same: {pairs:?}", pairs.len()))
}

fn changes() -> impl Strategy<Value = Change> {
    let far = -5e5..5e5f64;
    prop_oneof![
        (0.0..360.0f64).prop_map(Change::Turn),
        proptest::array::uniform3(far).prop_map(Change::Move),
        proptest::sample::select(UNITS.map(|(name, _)| name).to_vec()).prop_map(Change::Unit),
        Just(Change::Reverse),
        proptest::sample::select(vec![Form::Scale, Form::Offset, Form::Instance, Form::Backs])
            .prop_map(Change::Written),
        Just(Change::Model),
    ]
}

/// What a change changes in a document by a method, if it does.
fn judged(document: &Value, change: Change, method: &str, limit: f64) -> Option<String> {
    let (changed, equal) = changed(document, change)?;
    let by = |effort: Effort, seed: u64| {
        let [a, b] = [document, &changed].map(|document| render(document, method, effort, seed));
        match (&a, &b) {
            (Ok(a), Ok(b)) => difference(a, b, change, equal, limit),
            (Err(a), Err(b)) if a == b => None,
            (a, b) => Some(format!("{:?} and {:?}", a.as_ref().err(), b.as_ref().err())),
        }
    };
    by(FIRST, 1).and_then(|_| by(AGAIN, 2)).map(|words| format!("{method}, {change:?}: {words}\n{changed}"))
}

fn limit(cases: u32) -> f64 {
    judge::each(FALSE_ALARM, cases as usize * (MOST_VALUES + 2 + MOST_TUBES))
}

fn methods() -> impl Strategy<Value = &'static str> {
    proptest::sample::select(METHODS.to_vec())
}

proptest! {
    #![proptest_config(config(cases(32)))]

    #[test]
    fn what_changes_nothing(case in generator::document(Kind::Any).prop_map(Case), change in changes(), method in methods()) {
        let difference = judged(&case.0, change, method, limit(cases(32)));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

/// All differences are told at the end, each with its document.
#[test]
#[ignore = "minutes: 2000 documents"]
fn what_changes_nothing_in_many_documents() {
    let cases = cases(2000);
    let drawn = generator::drawn(cases, (generator::document(Kind::Any), changes(), methods()));
    let mut failures = Vec::new();
    for (number, (document, change, method)) in drawn.enumerate() {
        let attempt = std::panic::catch_unwind(|| judged(&document, change, method, limit(cases)));
        if let Some(difference) = attempt.unwrap_or_else(|_| Some("it panicked".to_owned())) {
            println!("case {number}: {difference}\n{document}");
            failures.push(number);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}
