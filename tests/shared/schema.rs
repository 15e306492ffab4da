//! Validators made from the components of the API's description.
#![allow(dead_code)] // each test binary uses its part

use std::sync::LazyLock;

use schema_validator::Validator;
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, JobDocument, ValidJob};

pub static DESCRIPTION: LazyLock<Value> =
    LazyLock::new(|| serde_json::to_value(skyduct::http::openapi::description()).unwrap());

static JOB_DOCUMENT: LazyLock<Validator> = LazyLock::new(|| component("JobDocument"));

/// The validator of a component; formats such as `date-time` count.
pub fn component(name: &str) -> Validator {
    assert!(DESCRIPTION["components"]["schemas"][name].is_object(), "no component {name}");
    schema(json!({ "$ref": format!("#/components/schemas/{name}") }))
}

/// The validator of a schema that may refer to components.
pub fn schema(mut schema: Value) -> Validator {
    schema["components"] = DESCRIPTION["components"].clone();
    Validator::new(&schema).unwrap()
}

/// Faults that the schema of job documents finds in `document`.
pub fn faults(document: &Value) -> Vec<String> {
    JOB_DOCUMENT.faults(document)
}

#[track_caller]
pub fn assert_valid(validator: &Validator, value: &Value, what: &str) {
    let faults = validator.faults(value);
    assert!(faults.is_empty(), "{what}: {faults:#?}\n{value:#}");
}

/// Parses a document as the service does, and holds the schema to the verdict: what is accepted is valid, and what is refused
/// is invalid unless a schema cannot say why.
#[track_caller]
pub fn parse(document: &Value) -> Result<ValidJob, DocumentErrors> {
    let parsed = JobDocument::parse(document.to_string().as_bytes());
    let faults = faults(document);
    match &parsed {
        Ok(_) => assert_eq!(faults, [""; 0], "accepted, but not valid: {document}"),
        Err(errors) if faults.is_empty() => {
            for error in &errors.0 {
                let known = BEYOND_A_SCHEMA.iter().any(|(detail, _)| error.detail.contains(detail));
                assert!(known, "refused, but valid: {error}\n{document}");
            }
        }
        Err(_) => {}
    }
    parsed
}

/// Parses any JSON as the service does: what is accepted is valid.
#[track_caller]
pub fn parse_any(document: &Value) -> Result<ValidJob, DocumentErrors> {
    let parsed = JobDocument::parse(document.to_string().as_bytes())?;
    // null counts as absent everywhere; the schema says so of fields without a default only
    if !has_null(document) {
        assert_eq!(faults(document), [""; 0], "accepted, but not valid: {document}");
    }
    Ok(parsed)
}

fn has_null(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(values) => values.iter().any(has_null),
        Value::Object(fields) => fields.values().any(has_null),
        _ => false,
    }
}

/// Faults that the service refuses and the schema does not: part of the detail, and why a schema cannot say it.
pub const BEYOND_A_SCHEMA: &[(&str, &str)] = &[
    ("must be the name of one of `grids`", "compares with the names of grids"),
    ("must ascend", "limits of useful daylight illuminances"),
    ("must be later than `from`", "ends of occupied hours"),
    ("must be a time of day", "times of a schedule"),
    ("must be a day of the year", "days of a period"),
    ("must be inside the room", "compares with the size of the room"),
    ("must lie wholly inside the ceiling", "compares with the size of the room"),
    ("and below the ceiling", "compares with the height of the room"),
    ("half the room", "compares with the size of the room"),
    ("the ceiling's shorter edge", "compares with the size of the room"),
    ("the diameter of the pipe above the square", "compares two fields"),
    ("must be `lambertian` with `closure_shape`", "the kind of a field depends on another field"),
    ("the opening overlaps", "geometry of two tubes"),
    ("passes through /tubes/", "geometry of two tubes"),
    ("must not cover the opening", "geometry of a luminaire and a tube"),
    ("or a part of it, in its plane", "geometry of an object and a tube"),
    ("of the plan meet at", "geometry of a polygon"),
    ("the hole lies", "geometry of a polygon"),
    ("corners that are", "geometry of a polygon"),
    ("the outline's extent", "geometry of a polygon"),
    ("the ceiling must be above the floor", "geometry of a ceiling and a plan"),
    ("leave the room open", "geometry of several faces"),
    ("more than two faces meet", "geometry of several faces"),
    ("has the same corners as the face", "compares several faces"),
    ("corners with those of the boundary", "a sum of the lengths of two lists"),
    ("of the face meet at", "geometry of a polygon"),
    ("the face has no area", "geometry of a polygon"),
    ("from the face's plane", "geometry of a polygon"),
    ("the room's extent along", "geometry of several faces"),
    ("the room's lowest corner", "geometry of several faces"),
    ("closed surfaces that share no edge", "geometry of several faces"),
    ("close up in a twist", "geometry of several faces"),
    ("enclose no volume", "geometry of several faces"),
    ("crosses the face", "geometry of two faces"),
    ("has a surface for the face of this name", "names of faces"),
    ("needs a closed face", "geometry of a tube and the room"),
    ("must be [x, y]: a level opening", "the length of a list depends on another field"),
    ("the opening lies in the plane of its face", "compares two fields"),
    ("the first segment runs along the normal", "compares two fields"),
    ("off the plane of", "geometry of a tube and the room"),
    ("on the vertical face", "geometry of a tube and the room"),
    ("lies on no ceiling or wall", "geometry of a tube and the room"),
    ("no ceiling or wall has the name", "names of faces"),
    ("no tube can come through it", "geometry of a tube and the room"),
    ("the guide must stay behind its face", "geometry of a tube"),
    ("must be above `eaves_m`", "compares two fields"),
    ("hangs below the sloped ceiling", "geometry of a tube and the room"),
    ("the height of the ceiling there", "geometry of a tube and the room"),
    ("no ceiling is above", "geometry of a tube and the room"),
    ("no ceiling has the name", "names of faces"),
    ("lies outside of the face", "geometry of a tube and the room"),
    ("the opening must lie wholly inside the room", "geometry of a tube and the room"),
    ("the room has no face of this name", "names of faces"),
    ("must lie within the room", "geometry of a partition and the room"),
    ("the ceiling's height over", "geometry of a partition and the room"),
    ("must not cross a wall", "geometry of a partition and the room"),
    ("must not cut the opening", "geometry of a partition and a tube"),
    ("must differ from `from_m`", "compares two fields"),
    ("must neither reach into", "geometry of a luminaire and an object"),
    ("in the same plane", "geometry of two luminaires"),
    ("emits out of the room", "geometry of a luminaire and the room"),
    ("must be at a right angle", "a scalar product"),
    ("m long, but is", "the length of a vector"),
    ("must differ from `eye_m`", "compares two fields"),
    ("must not be zero", "the length of a vector"),
    ("must not be parallel", "a vector product"),
    ("so that its mitres", "geometry of a tube"),
    ("of lying across the axis", "geometry of a tube"),
    ("away from the centre of the upper end", "geometry of a tube and an obstruction"),
    ("above the azimuth before it", "compares two items"),
    ("must be within 0..360, but is", "bounds of an item by its place make tuples of lists in clients"),
    ("must be within -180..180, but is", "bounds of an item by its place make tuples of lists in clients"),
    ("must be within 0..90, but is", "bounds of an item by its place make tuples of lists in clients"),
    ("successive segments must turn", "geometry of a tube"),
    ("must stay above the ceiling", "geometry of a tube"),
    ("a first segment that is not vertical", "bounds of an item by its place make tuples of lists in clients"),
    ("cells, but there are", "a product of two numbers"),
    ("cells along an axis", "compares with the size of the room"),
    ("pixels, but there are", "a product of two numbers"),
    ("samples over all sensors or pixels", "a product of numbers of several fields"),
    ("samples over all sensors and pixels", "a product of numbers of several fields"),
    ("must not be that of a file of", "compares names of several items"),
    ("must be unique", "compares names of several items"),
    ("transmittance + reflectance must be <= 1", "a sum of two fields"),
    ("reflectance + specular must be < 1", "a sum of two fields"),
    ("must be within 0..0.127", "compares with the diameter of the tube"),
    ("one value for each of the", "compares the lengths of two lists"),
    ("one row for each of the", "compares the lengths of two lists"),
    ("must be larger than the angle before it", "compares items of a list"),
    ("the angles run from 0 to 90", "the last item of a list"),
    ("at most the light that it receives", "an integral over a table"),
    ("diffuser optics that differ", "compares fields of two parts"),
    ("only a face of the room can be open", "surfaces of objects and faces share a component"),
    ("years", "the years of a time"),
];
