//! Strict parsing of JSON text.

use std::borrow::Cow;
use std::cell::Cell;
use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

use super::fault::{self, Fault};
use super::pointer::escape;
use crate::document::errors::{FieldError, FieldErrorCode};
use crate::geometry::encoding::utf8;

/// Absolute value below which numbers are read as zero: a denormal is never intended, and slows down every product that it
/// enters.
pub const SMALLEST: f64 = 1e-300;

/// Largest number up to which every whole number is represented exactly, 2^53.
const MOST_EXACT: f64 = 9_007_199_254_740_992.0;

/// Number of values that an object counts as in addition to itself, for the memory that it takes.
const VALUES_OF_OBJECT: usize = 8;

/// Decodes the text of a file or body, UTF-8 or UTF-16, without its byte order mark. The error says why the text cannot be
/// decoded.
pub fn text(bytes: &[u8]) -> Result<Cow<'_, str>, FieldError> {
    let bytes = utf8(bytes).map_err(|reason| FieldError::new("", format!("the text {reason}")))?;
    let not_utf8 = |error: std::str::Utf8Error| {
        FieldError::new("", format!("the text is not UTF-8 after byte {}", error.valid_up_to()))
    };
    match bytes {
        Cow::Borrowed(bytes) => std::str::from_utf8(bytes).map(Cow::Borrowed).map_err(not_utf8),
        Cow::Owned(bytes) => String::from_utf8(bytes).map(Cow::Owned).map_err(|error| not_utf8(error.utf8_error())),
    }
}

/// Parses JSON [`text`]; refuses duplicate keys and numbers that overflow, and reads denormals as zero.
pub fn value(bytes: &[u8]) -> Result<Value, FieldError> {
    value_within(bytes, usize::MAX)
}

/// Parses like [`value`], but refuses text with more than `most` values, where an object counts as nine, because a short text can
/// be a large value.
pub fn value_within(bytes: &[u8], most: usize) -> Result<Value, FieldError> {
    let text = text(bytes)?;
    let mut deserializer = serde_json::Deserializer::from_str(&text);
    let mut track = serde_path_to_error::Track::new();
    let left = Cell::new(Some(most));
    let strict = Strict { left: &left, most };
    let tracked = serde_path_to_error::Deserializer::new(&mut deserializer, &mut track);
    let value = strict.deserialize(tracked).map_err(|error| {
        let syntax = error.is_syntax() || error.is_eof();
        let overflow = error.to_string().starts_with("number out of range");
        if syntax && !overflow {
            return FieldError::new("", error.to_string());
        }
        let error = fault::of_error(&serde_path_to_error::Error::new(track.path(), error));
        let error = FieldError::new(error.pointer, error.message);
        if left.get().is_none() { error.coded(FieldErrorCode::TooMany) } else { error }
    })?;
    deserializer.end().map_err(|error| FieldError::new("", error.to_string()))?;
    Ok(value)
}

/// Visitor that reads a JSON value and refuses duplicate keys.
#[derive(Clone, Copy)]
struct Strict<'a> {
    /// Number of values that may still follow; `None` once there were too many.
    left: &'a Cell<Option<usize>>,
    /// Number of values that are allowed in all.
    most: usize,
}

impl Strict<'_> {
    fn count<E: Error>(&self, values: usize) -> Result<(), E> {
        self.left.set(self.left.get().and_then(|left| left.checked_sub(values)));
        if self.left.get().is_some() {
            return Ok(());
        }
        let most = self.most;
        Err(E::custom(format!(
            "the document may have at most {most} values (an object counts as nine); the limit is reached here"
        )))
    }
}

impl<'de> DeserializeSeed<'de> for Strict<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        self.count(1)?;
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Strict<'_> {
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
        while let Some(value) = seq.next_element_seed(self)? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        self.count(VALUES_OF_OBJECT)?;
        let mut values = Map::new();
        while let Some(key) = map.next_key::<String>()? {
            if values.contains_key(&key) {
                let pointer = format!("/{}", escape(&key));
                return Err(A::Error::custom(Fault { pointer, message: "given twice".to_owned() }));
            }
            let value = map.next_value_seed(self)?;
            values.insert(key, value);
        }
        Ok(Value::Object(values))
    }
}
