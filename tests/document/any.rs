//! Any input is judged without panic, and good documents read back as they were written.

use crate::given::{SquarePipe, base, mesh_tube, with};
use crate::schema::{parse, parse_any};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};
use skyduct::document::{JobDocument, to_scene};

/// Any JSON value, biased toward the names of the document.
fn any_json() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        any::<u64>().prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        (-2.0..2.0f64).prop_map(Value::from),
        "[a-z_~/é]{0,8}".prop_map(Value::from),
        Just(json!("lambertian")),
        Just(json!("sppm")),
    ];
    let key = prop_oneof![
        "[a-z_~/]{0,6}",
        proptest::sample::select(vec![
            "kind",
            "sky",
            "room",
            "tubes",
            "size_m",
            "reflectance",
            "mesh",
            "parts",
            "role"
        ])
        .prop_map(str::to_owned),
    ];
    leaf.prop_recursive(4, 48, 6, move |inner| {
        prop_oneof![
            proptest::collection::vec(inner.clone(), 0..5).prop_map(Value::from),
            proptest::collection::btree_map(key.clone(), inner, 0..5)
                .prop_map(|map| Value::Object(map.into_iter().collect())),
        ]
    })
}

/// Pointers of all values in `value`.
fn pointers(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(index, value)| pointers(value, &format!("{at}/{index}"), found));
        }
        Value::Object(values) => values.iter().for_each(|(key, value)| {
            pointers(value, &format!("{at}/{}", key.replace('~', "~0").replace('/', "~1")), found);
        }),
        _ => {}
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn any_json_is_judged_without_panic(value in any_json()) {
        let _ = parse_any(&value);
    }

    #[test]
    fn any_bytes_are_judged_without_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = JobDocument::parse(&bytes);
    }

    /// One value of a good document replaced by anything: a scene, or errors, and never a panic.
    #[test]
    fn one_wrong_value_is_judged_without_panic(value in any_json(), place in any::<proptest::sample::Index>(), mesh in any::<bool>()) {
        let mut document = if mesh { with(base(), "/tubes/0", mesh_tube()) } else { base() };
        let mut places = Vec::new();
        pointers(&document, "", &mut places);
        *document.pointer_mut(place.get::<String>(&places)).unwrap() = value;
        if let Ok(document) = parse_any(&document) {
            let _ = to_scene(&document, &SquarePipe);
        }
    }

    /// Document -> text -> document is the identity, and filling in defaults is done once.
    #[test]
    fn serialised_documents_parse_to_themselves(
        altitude in -90.0..=90.0f64, radius in 1e-6..0.2f64, rgb in proptest::array::uniform3(0.0..0.99f64),
        length in 0.2..10.0f64, cells in proptest::array::uniform2(1u32..300), seed: u64, mesh in any::<bool>(),
        coloured in any::<bool>(), method in proptest::sample::select(vec!["auto", "sppm"]),
    ) {
        let mut document = base();
        document["sky"]["sun_position"]["altitude_deg"] = json!(altitude);
        document["room"]["surfaces"]["wall_west"] = if coloured { json!({ "reflectance": rgb }) } else { json!({ "reflectance": rgb[0] }) };
        document["tubes"][0]["segments"][1]["length_m"] = json!(length);
        document["tubes"][0]["diameter_m"] = json!(2.0 * radius);
        document["grids"][0]["cells"] = json!(cells);
        document["method"] = json!(method);
        document["seed"] = json!(seed);
        if mesh {
            document["tubes"][0] = mesh_tube();
        }
        let parsed = parse(&document).unwrap();
        let text = serde_json::to_string(&parsed).unwrap();
        prop_assert_eq!(&JobDocument::parse(text.as_bytes()).unwrap(), &parsed);
    }
}
