//! Documents that were valid until something was done to them: they are refused with places and words, or rendered.

use proptest::prelude::*;
use proptest::sample::Index;
use serde_json::{Map, Value, json};
use skyduct::document::{DocumentErrors, to_scene};
use skyduct::engine::cancel::Stop;
use skyduct::present::prepared::prepare_document;

use crate::generator::{self, Kind, Meshes};
use crate::render::{Case, METHODS, cases, config, sound};
use crate::schema::parse_any;

/// Something done to one place of a document; places are drawn among all that there are.
#[derive(Clone, Debug)]
enum Mutation {
    Remove(Index),
    /// An item of a list is there twice, or a field has a list of two of its value.
    Double(Index),
    Swap(Index, Index),
    /// One place gets a copy of another.
    Graft(Index, Index),
    /// A number times a power of ten, either sign.
    Scale(Index, i32, bool),
    /// A number that is a bound, or beyond one.
    Edge(Index, f64),
    /// A field that nobody knows.
    Unknown(Index),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let edges = vec![
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-300,
        1e300,
        1e-9,
        0.02,
        0.5,
        90.0,
        180.0,
        360.0,
        -360.0,
        1e4,
        1e6,
        1e9,
        16.0,
        64.0,
        0.999_999_999_999,
        1.000_000_000_001,
        9_007_199_254_740_993.0,
    ];
    let place = any::<Index>;
    prop_oneof![
        1 => place().prop_map(Mutation::Remove),
        1 => place().prop_map(Mutation::Double),
        1 => (place(), place()).prop_map(|(a, b)| Mutation::Swap(a, b)),
        1 => (place(), place()).prop_map(|(a, b)| Mutation::Graft(a, b)),
        3 => (place(), -12..=12i32, any::<bool>()).prop_map(|(place, power, minus)| Mutation::Scale(place, power, minus)),
        3 => (place(), proptest::sample::select(edges)).prop_map(|(place, edge)| Mutation::Edge(place, edge)),
        1 => place().prop_map(Mutation::Unknown),
    ]
}

/// Pointers of all values that `wanted` takes.
fn places(value: &Value, at: &str, wanted: &impl Fn(&Value) -> bool, found: &mut Vec<String>) {
    if wanted(value) {
        found.push(at.to_owned());
    }
    match value {
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(index, value)| places(value, &format!("{at}/{index}"), wanted, found));
        }
        Value::Object(fields) => fields.iter().for_each(|(key, value)| {
            places(value, &format!("{at}/{}", key.replace('~', "~0").replace('/', "~1")), wanted, found);
        }),
        _ => {}
    }
}

fn place(document: &Value, index: &Index, wanted: impl Fn(&Value) -> bool) -> Option<String> {
    let mut found = Vec::new();
    places(document, "", &wanted, &mut found);
    (!found.is_empty()).then(|| index.get(&found).clone())
}

fn apply(document: &mut Value, mutation: &Mutation) -> Option<()> {
    let any = |_: &Value| true;
    match mutation {
        Mutation::Remove(index) => {
            let pointer = place(document, index, any)?;
            let (parent, key) = pointer.rsplit_once('/')?;
            match document.pointer_mut(parent)? {
                Value::Array(values) => drop(values.remove(key.parse().ok()?)),
                Value::Object(fields) => drop(fields.remove(&key.replace("~1", "/").replace("~0", "~"))),
                _ => {}
            }
        }
        Mutation::Double(index) => {
            let pointer = place(document, index, any)?;
            let copy = document.pointer(&pointer)?.clone();
            match document.pointer_mut(pointer.rsplit_once('/')?.0)? {
                Value::Array(values) => values.push(copy),
                _ => *document.pointer_mut(&pointer)? = json!([copy, copy]),
            }
        }
        Mutation::Swap(a, b) => {
            let [a, b] = [place(document, a, any)?, place(document, b, any)?];
            let (of_a, of_b) = (document.pointer(&a)?.clone(), document.pointer(&b)?.clone());
            *document.pointer_mut(&a)? = of_b;
            *document.pointer_mut(&b)? = of_a;
        }
        Mutation::Graft(to, from) => {
            let copy = document.pointer(&place(document, from, any)?)?.clone();
            *document.pointer_mut(&place(document, to, any)?)? = copy;
        }
        Mutation::Scale(index, power, minus) => {
            let at = document.pointer_mut(&place(document, index, Value::is_number)?)?;
            *at = json!(at.as_f64()? * 10f64.powi(*power) * if *minus { -1.0 } else { 1.0 });
        }
        Mutation::Edge(index, edge) => *document.pointer_mut(&place(document, index, Value::is_number)?)? = json!(edge),
        Mutation::Unknown(index) => {
            let pointer = place(document, index, Value::is_object)?;
            document.pointer_mut(&pointer)?.as_object_mut()?.insert("unknown~/field".to_owned(), json!(1));
        }
    }
    Some(())
}

/// Every error has words, and a place that is in the document or missing in a value that is.
fn tells(errors: &DocumentErrors, document: &Value) {
    assert!(!errors.0.is_empty(), "{document}");
    for error in &errors.0 {
        let there = |pointer: &str| document.pointer(pointer).is_some();
        let parent = error.pointer.rsplit_once('/').map_or("", |(parent, _)| parent);
        // what has a default is named within it
        let grandparent = parent.rsplit_once('/').map_or("", |(parent, _)| parent);
        let found = there(&error.pointer) || there(parent) || there(grandparent);
        assert!(found && !error.detail.is_empty(), "{error:?}: {document}");
    }
}

/// The same job with few sensors and pixels and little work.
fn small(document: &Value, method: &str) -> Option<Value> {
    let mut small = document.clone();
    let few = |list: &mut Value, field: &str| {
        for output in list.as_array_mut().into_iter().flatten() {
            for count in output[field].as_array_mut().into_iter().flatten() {
                *count = json!(count.as_u64().unwrap_or(1).min(3));
            }
        }
    };
    few(small.get_mut("grids")?, "cells");
    few(small.get_mut("views")?, "size_px");
    let kind = method.split(' ').next()?;
    small["method"] = match kind {
        "light_tracing" | "sppm" | "photon_mapping" => json!({ "kind": kind, "photons_per_pass": 256 }),
        "ppm" => json!({ "kind": kind, "photons_per_pass": 256, "samples_per_sensor": 4, "samples_per_pixel": 4 }),
        "path_tracing" => json!({ "kind": kind, "samples_per_sensor": 16, "samples_per_pixel": 16 }),
        "holigilm" => return None,
        _ => json!({ "kind": kind, "photons_per_pass": 256, "samples_per_sensor": 16, "samples_per_pixel": 16 }),
    };
    small["stop"] = json!({ "max_passes": 2, "relative_error": 1e-12 });
    Some(small)
}

fn judge(document: &Value, method: &str) {
    let valid = match parse_any(document) {
        Ok(valid) => valid,
        Err(errors) => return tells(&errors, document),
    };
    if let Err(errors) = to_scene(&valid, &Meshes) {
        return tells(&errors, document);
    }
    let Some(small) = small(document, method).and_then(|small| Some((parse_any(&small).ok()?, small))) else { return };
    match prepare_document(&small.0, &Meshes) {
        Err(errors) => tells(&errors, &small.1),
        Ok(prepared) => {
            let rendered = prepared.render(&Stop::default(), &mut |_, _| {});
            let mut rendered = rendered.unwrap_or_else(|error| panic!("{error}: {}", small.1));
            sound(&prepared, &mut rendered.estimate, &small.1);
        }
    }
}

fn mutated() -> impl Strategy<Value = Case> {
    (generator::document(Kind::Any), proptest::collection::vec(mutation(), 1..=3)).prop_map(
        |(mut document, mutations)| {
            for mutation in &mutations {
                let _ = apply(&mut document, mutation);
            }
            if !document.is_object() {
                document = Value::Object(Map::new());
            }
            Case(document)
        },
    )
}

fn methods() -> impl Strategy<Value = &'static str> {
    proptest::sample::select(METHODS.to_vec())
}

proptest! {
    #![proptest_config(config(cases(256)))]

    #[test]
    fn what_was_done_to_a_document_is_told_or_rendered(case in mutated(), method in methods()) {
        judge(&case.0, method);
    }
}

/// All failures are told at the end, each with its document.
#[test]
#[ignore = "minutes: 20 000 documents"]
fn what_was_done_to_many_documents_is_told_or_rendered() {
    let mut failures = Vec::new();
    let cases = cases(20_000);
    for (number, (case, method)) in generator::drawn(cases, (mutated(), methods())).enumerate() {
        if std::panic::catch_unwind(|| judge(&case.0, method)).is_err() {
            println!("case {number}, {method}: {case:?}");
            failures.push(number);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}
