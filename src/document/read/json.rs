//! JSON text as values, strictly.

use std::borrow::Cow;
use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

use super::fault::{self, Fault};
use super::pointer::escape;
use crate::document::errors::FieldError;
use crate::geometry::encoding::utf8;

/// Numbers closer to zero count as zero: a denormal is never meant, and slows every product that it enters.
const SMALLEST: f64 = 1e-300;

/// Number up to which every whole number is a number of its own, 2^53.
const MOST_EXACT: f64 = 9_007_199_254_740_992.0;

/// Text of a file or body, UTF-8 or UTF-16, without a byte order mark; an error with the reason where it is none.
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

/// Parses JSON [`text`]; refuses duplicate keys and numbers that overflow, and takes denormals as zero.
pub fn value(bytes: &[u8]) -> Result<Value, FieldError> {
    let text = text(bytes)?;
    let mut deserializer = serde_json::Deserializer::from_str(&text);
    let strict: Strict = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let inner = error.inner();
        let syntax = inner.is_syntax() || inner.is_eof();
        let overflow = inner.to_string().starts_with("number out of range");
        if syntax && !overflow {
            return FieldError::new("", inner.to_string());
        }
        let error = fault::of_error(&error);
        FieldError::new(error.pointer, error.message)
    })?;
    deserializer.end().map_err(|error| FieldError::new("", error.to_string()))?;
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
                let pointer = format!("/{}", escape(&key));
                return Err(A::Error::custom(Fault { pointer, message: "given twice".to_owned() }));
            }
            let Strict(value) = map.next_value()?;
            values.insert(key, value);
        }
        Ok(Value::Object(values))
    }
}
