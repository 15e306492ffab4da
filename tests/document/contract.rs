//! The schema of job documents against documents that run: nothing that the service takes is invalid.

use crate::schema;
use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;
use skyduct::cli::mesh_files::MeshFiles;
use skyduct::document::JobDocument;
use skyduct::document::limits::{self, Limit};

/// All JSON files of a folder that are job documents.
fn documents_of(folder: &str) -> Vec<(String, Value)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|file| file.extension().is_some_and(|extension| extension == "json"))
        .map(|file| (file.display().to_string(), serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap()))
        .filter(|(_, document): &(_, Value)| document["room"].is_object())
        .collect()
}

#[test]
fn examples_and_scenes_are_valid_as_written_and_as_understood() {
    let documents = [documents_of("examples"), documents_of("tests/reference/scenes")].concat();
    assert!(documents.len() >= 14, "{}", documents.len());
    for (file, document) in documents {
        assert_eq!(schema::faults(&document), [""; 0], "{file}");
        let understood = JobDocument::from_files(document, &MeshFiles::beside(Path::new(&file))).unwrap();
        let understood = serde_json::to_value(understood).unwrap();
        assert_eq!(schema::faults(&understood), [""; 0], "{file}, all defaults filled in");
    }
}

/// A client generator makes a class of each component, and reads which one from the discriminator.
#[test]
fn every_variant_is_a_component_and_tagged_ones_are_told_apart() {
    let schemas = schema::DESCRIPTION["components"]["schemas"].as_object().unwrap();
    let mut tagged = Vec::new();
    for (name, component) in schemas {
        assert!(!has_inline_variant(component), "{name} has a variant without a name");
        let Some(discriminator) = component.get("discriminator") else { continue };
        let tag = discriminator["propertyName"].as_str().unwrap();
        let mapping = discriminator["mapping"].as_object().unwrap();
        let variants: Vec<&Value> = component["oneOf"].as_array().unwrap().iter().map(|item| &item["$ref"]).collect();
        assert_eq!(mapping.len(), variants.len(), "{name}");
        for (value, reference) in mapping {
            assert!(variants.contains(&reference), "{name}: {reference}");
            let variant = &schemas[reference.as_str().unwrap().rsplit('/').next().unwrap()];
            // also one that has variants itself: else a reader does not know where the tag is
            assert_eq!(variant["type"], "object", "{name}: {value}");
            let of = variant["oneOf"].as_array().map_or(1, Vec::len);
            if of == 1 {
                assert_eq!(variant["properties"][tag]["enum"], serde_json::json!([value]), "{name}");
                let of_a_document = !["BeamSource", "RefractionProvenance"].contains(&name.as_str());
                assert_eq!(variant.get("additionalProperties").is_some(), of_a_document, "{name}: {value}");
            }
        }
        tagged.push(name.as_str());
    }
    let expected = [
        "BeamSource",
        "CeilingDocument",
        "CollectorDocument",
        "DaylightSavingDocument",
        "DiffuserDocument",
        "DiffuserPart",
        "MethodWithSettings",
        "ObjectDocument",
        "ObstructionDocument",
        "PartDocument",
        "RefractionProvenance",
        "ScheduleDocument",
    ];
    assert_eq!(tagged, expected);
}

fn has_inline_variant(schema: &Value) -> bool {
    let inline = |item: &Value| item.get("properties").is_some() || item.get("allOf").is_some();
    match schema {
        Value::Object(fields) => {
            // rules between fields stand under `not`, which generators pass over
            fields.get("oneOf").and_then(Value::as_array).is_some_and(|items| items.iter().any(inline))
                || fields.iter().any(|(name, value)| name != "not" && has_inline_variant(value))
        }
        Value::Array(items) => items.iter().any(has_inline_variant),
        _ => false,
    }
}

/// Fields that have a default need not be given.
#[test]
fn required_fields_have_no_default() {
    for (name, component) in schema::DESCRIPTION["components"]["schemas"].as_object().unwrap() {
        let required = component["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
        for field in required {
            assert!(component["properties"][field].get("default").is_none(), "{name}: {field}");
        }
    }
}

/// A bound of a field that does not exist would be told nowhere, and a number without bounds would be a bound forgotten.
#[test]
fn every_bound_is_told_and_every_number_of_a_document_has_bounds() {
    let schemas = schema::DESCRIPTION["components"]["schemas"].as_object().unwrap();
    let has = |schema: &Value, bounds: &[&str]| bounds.iter().any(|bound| !schema[bound].is_null());
    for (component, field, limit) in limits::FIELDS {
        let property = &schemas[*component]["properties"][field];
        let bounds = match limit {
            Limit::Number(_) => ["maximum", "exclusiveMaximum"],
            Limit::Items(_) => ["minItems", "maxItems"],
            Limit::Length(_) => ["minLength", "maxLength"],
            Limit::Fields(_) => ["minProperties", "maxProperties"],
        };
        assert!(has(property, &bounds), "{component}: {field}: {property}");
    }
    let mut met = BTreeSet::from(["JobDocument".to_owned()]);
    let mut waiting = vec![("JobDocument".to_owned(), &schemas["JobDocument"])];
    while let Some((place, part)) = waiting.pop() {
        if let Some(name) = part["$ref"].as_str().and_then(|reference| reference.rsplit('/').next()) {
            if met.insert(name.to_owned()) {
                waiting.push((name.to_owned(), &schemas[name]));
            }
            continue;
        }
        let of_type =
            |name: &str| part["type"] == name || part["type"].as_array().is_some_and(|it| it.contains(&name.into()));
        if of_type("number") || of_type("integer") {
            let bounded = has(part, &["minimum", "exclusiveMinimum"]) && has(part, &["maximum", "exclusiveMaximum"]);
            assert!(bounded, "{place}: {part}");
        }
        for (name, property) in part["properties"].as_object().into_iter().flatten() {
            waiting.push((format!("{place}/{name}"), property));
        }
        let variants = ["oneOf", "allOf"].into_iter().filter_map(|name| part[name].as_array()).flatten();
        let items = [&part["items"], &part["additionalProperties"]].into_iter().filter(|item| item.is_object());
        waiting.extend(variants.chain(items).map(|inner| (place.clone(), inner)));
    }
    assert!(met.len() > 40, "{met:?}");
}
