//! From text to a validated document; every error names its JSON pointer.

mod stand_in;

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};
use serde_path_to_error::{Path, Segment};

use crate::document::errors::{Checks, escape};
use crate::document::hints;
use crate::document::validate::validate;
use crate::document::{DocumentErrors, FieldError, JobDocument};
use stand_in::{spoils, stand_in};

/// Numbers closer to zero count as zero: a denormal is never meant, and slows every product that it enters.
const SMALLEST: f64 = 1e-300;

/// Up to here every whole number is a number of its own: 2^53.
const MOST_EXACT: f64 = 9_007_199_254_740_992.0;

/// Errors of shape that are reported at most.
const MOST_SHAPE_ERRORS: usize = 100;

impl JobDocument {
    /// Parses and validates JSON text (UTF-8), and fills in the defaults.
    ///
    /// Errors name everything that is wrong: with the text (line and column), with its shape, and with the values.
    pub fn parse(text: &[u8]) -> Result<Self, DocumentErrors> {
        let mut value = value(text).map_err(|error| DocumentErrors(vec![error]))?;
        let mut checks = Checks::default();
        // pointers below which values were made up
        let mut spoiled: Vec<String> = Vec::new();
        let document = loop {
            match serde_path_to_error::deserialize::<_, Self>(&value) {
                Ok(document) => break document,
                Err(error) => {
                    let (error, misfit) = field_error(error.path(), &error.inner().to_string());
                    // what one error hides is seen once that error is out of the way
                    let repaired = match misfit {
                        Fault::OneTooMany => remove(&mut value, &error.pointer),
                        Fault::MissingOrWrong => replace(&mut value, &error.pointer, &mut spoiled),
                    };
                    checks.errors.push(error);
                    if !repaired || checks.errors.len() >= MOST_SHAPE_ERRORS {
                        return Err(DocumentErrors(checks.errors));
                    }
                }
            }
        };
        refuse_unnamed(&value, &serde_json::to_value(&document).unwrap_or_default(), "", &mut checks);
        let of_shape = checks.errors.len();
        validate(&document, &mut checks);
        let of_values = checks.errors.split_off(of_shape);
        checks
            .errors
            .extend(of_values.into_iter().filter(|error| !spoiled.iter().any(|spoiled| concerns(error, spoiled))));
        if checks.errors.is_empty() { Ok(document) } else { Err(DocumentErrors(checks.errors)) }
    }
}

/// Refuses lists where the document has objects: the types would take a list as the values of their fields in order.
fn refuse_unnamed(given: &Value, understood: &Value, pointer: &str, checks: &mut Checks) {
    match (given, understood) {
        (Value::Array(_), Value::Object(_)) => checks.refuse(pointer, "invalid type: sequence, expected an object"),
        (Value::Array(given), Value::Array(understood)) => {
            for (index, (given, understood)) in given.iter().zip(understood).enumerate() {
                refuse_unnamed(given, understood, &format!("{pointer}/{index}"), checks);
            }
        }
        (Value::Object(given), Value::Object(understood)) => {
            for (name, given) in given {
                if let Some(understood) = understood.get(name) {
                    refuse_unnamed(given, understood, &format!("{pointer}/{}", escape(name)), checks);
                }
            }
        }
        _ => {}
    }
}

/// Whether an error of values is about what stands at `spoiled` or below, or about its object beside others.
fn concerns(error: &FieldError, spoiled: &str) -> bool {
    let below = error.pointer.strip_prefix(spoiled).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    let object = spoiled.rsplit_once('/').map_or("", |(parent, _)| parent);
    below || (!object.is_empty() && error.detail.contains(object))
}

/// Lets a good value stand in for the one at `pointer`, which is missing or of a wrong type; false where none is known, or
/// where one stands in already.
fn replace(value: &mut Value, pointer: &str, spoiled: &mut Vec<String>) -> bool {
    let Some((place, stands_in)) = stand_in(pointer) else { return false };
    let place_spoiled = spoils(place);
    if spoiled.iter().any(|spoiled| spoiled == place) {
        return false;
    }
    let Some((parent, token)) = place.rsplit_once('/') else { return false };
    let key = token.replace("~1", "/").replace("~0", "~");
    match value.pointer_mut(parent) {
        Some(Value::Object(object)) => drop(object.insert(key, stands_in)),
        Some(Value::Array(array)) => match key.parse().ok().and_then(|index: usize| array.get_mut(index)) {
            Some(element) => *element = stands_in,
            None => return false,
        },
        _ => return false,
    }
    spoiled.push(place.to_owned());
    if place_spoiled != place {
        spoiled.push(place_spoiled.to_owned());
    }
    true
}

/// Parses JSON text; refuses duplicate keys and numbers that overflow, and takes denormals as zero.
pub fn value(text: &[u8]) -> Result<Value, FieldError> {
    let mut deserializer = serde_json::Deserializer::from_slice(text);
    let strict: Strict = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let inner = error.inner();
        let syntax = inner.is_syntax() || inner.is_eof();
        let overflow = inner.to_string().starts_with("number out of range");
        if syntax && !overflow {
            return FieldError { pointer: String::new(), detail: inner.to_string() };
        }
        field_error(error.path(), &inner.to_string()).0
    })?;
    deserializer.end().map_err(|error| FieldError { pointer: String::new(), detail: error.to_string() })?;
    Ok(strict.0)
}

/// A JSON value without duplicate keys.
struct Strict(Value);

impl<'de> Deserialize<'de> for Strict {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StrictVisitor).map(Self)
    }
}

struct StrictVisitor;

impl<'de> Visitor<'de> for StrictVisitor {
    type Value = Value;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("JSON")
    }

    fn visit_unit<E: Error>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        let value = if value.abs() < SMALLEST { 0.0 } else { value };
        // 5.0 is a whole number, too; -0.0 would lose its sign
        if value.fract() == 0.0 && value.abs() <= MOST_EXACT && !(value == 0.0 && value.is_sign_negative()) {
            return Ok((value as i64).into());
        }
        Number::from_f64(value).map(Value::Number).ok_or_else(|| E::custom("number out of range"))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
        Ok(Value::String(value.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Value, A::Error> {
        let mut values = Vec::new();
        while let Some(Strict(value)) = seq.next_element()? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        let mut values = Map::new();
        while let Some(key) = map.next_key::<String>()? {
            if values.contains_key(&key) {
                return Err(A::Error::custom(format!("field `{key}`: given twice")));
            }
            let Strict(value) = map.next_value()?;
            values.insert(key, value);
        }
        Ok(Value::Object(values))
    }
}

/// What does not fit about one field of an object whose fields depend on its kind.
#[derive(Debug)]
pub struct Misfit {
    field: &'static str,
    detail: String,
}

impl fmt::Display for Misfit {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        // read back by `field_error`
        write!(formatter, "field `{}`: {}", self.field, self.detail)
    }
}

/// What is wrong with one field of such an object.
pub fn misfit(field: &'static str, detail: String) -> Misfit {
    Misfit { field, detail }
}

const MISSING: &str = "required, but missing";
const NOT_A_FIELD: &str = "not a field of ";

/// The value of a field that this kind of object must have.
pub fn required<T>(value: Option<T>, field: &'static str) -> Result<T, Misfit> {
    value.ok_or_else(|| Misfit { field, detail: MISSING.to_owned() })
}

/// Refuses a field that this kind of object does not have.
pub fn absent<T>(value: &Option<T>, field: &'static str, of: &str) -> Result<(), Misfit> {
    if value.is_some() { Err(Misfit { field, detail: format!("{NOT_A_FIELD}{of}") }) } else { Ok(()) }
}

/// How an error of shape is taken out of the way of the next one.
enum Fault {
    /// Without the field.
    OneTooMany,
    /// With another value.
    MissingOrWrong,
}

/// The pointer and detail of an error of serde.
fn field_error(path: &Path, message: &str) -> (FieldError, Fault) {
    let mut pointer = pointer_of(path);
    if let Some((field, _)) = quoted(message, "missing field ") {
        pointer = format!("{pointer}/{}", escape(field));
        return (FieldError { pointer, detail: MISSING.to_owned() }, Fault::MissingOrWrong);
    }
    if let Some((field, detail)) = quoted(message, "field ") {
        pointer = format!("{pointer}/{}", escape(field));
        let detail = detail.trim_start_matches(": ").to_owned();
        let fault = if detail.starts_with(NOT_A_FIELD) { Fault::OneTooMany } else { Fault::MissingOrWrong };
        return (FieldError { pointer, detail }, fault);
    }
    let unknown = |prefix| quoted(message, prefix).map(|(name, rest)| (name, hints::of_known_names(name, rest)));
    if let Some((field, hint)) = unknown("unknown field ") {
        let token = format!("/{}", escape(field));
        if !pointer.ends_with(&token) {
            pointer.push_str(&token);
        }
        return (FieldError { pointer, detail: format!("{message}{hint}") }, Fault::OneTooMany);
    }
    let hint = unknown("unknown variant ").map_or(String::new(), |(_, hint)| hint);
    (FieldError { pointer, detail: format!("{message}{hint}") }, Fault::MissingOrWrong)
}

/// The name between backticks after `prefix`, and what follows it.
fn quoted<'a>(message: &'a str, prefix: &str) -> Option<(&'a str, &'a str)> {
    message.strip_prefix(prefix)?.strip_prefix('`')?.split_once('`')
}

fn pointer_of(path: &Path) -> String {
    let mut pointer = String::new();
    for segment in path {
        match segment {
            Segment::Seq { index } => pointer.push_str(&format!("/{index}")),
            Segment::Map { key } => pointer.push_str(&format!("/{}", escape(key))),
            // variants are strings or tags here, never a level of the document
            Segment::Enum { .. } | Segment::Unknown => {}
        }
    }
    pointer
}

/// Removes the field at `pointer`; false when there is none.
fn remove(value: &mut Value, pointer: &str) -> bool {
    let Some((parent, token)) = pointer.rsplit_once('/') else {
        return false;
    };
    let key = token.replace("~1", "/").replace("~0", "~");
    match value.pointer_mut(parent) {
        Some(Value::Object(object)) => object.remove(&key).is_some(),
        _ => false,
    }
}
