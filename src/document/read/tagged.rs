//! Objects whose fields depend on their kind: a tag names the kind, and each kind has its own fields.
//!
//! Serde's tagged enums lose the place of an error below the tag, and its untagged ones lose the error itself. Here the tag is
//! read first, and the rest as the kind's own struct, which denies unknown fields; so every error has the place of its field.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{DeserializeOwned, Deserializer, Error, Unexpected};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::fault::{self, Fault, quoted};
use super::pointer::escape;

/// Type of objects of several kinds.
pub trait Tagged: Sized + 'static {
    /// Name of the field that distinguishes the kinds.
    const TAG: &'static str;
    /// Words for such an object in messages, e.g. "a diffuser".
    const WHAT: &'static str;
    /// Names of the kinds, each with the reader of its other fields.
    const KINDS: &'static [(&'static str, Reader<Self>)];
}

/// Reader of the fields of one kind; the text describes it in messages, e.g. "a diffuser of kind `open`".
pub type Reader<T> = fn(Fields, &str) -> Result<T, Fault>;

/// Reads an object of any of the kinds.
pub fn deserialize<'de, T: Tagged, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    let reader = |kind: &str| T::KINDS.iter().find(|(name, _)| *name == kind).map(|(_, reader)| *reader);
    let names = T::KINDS.iter().map(|(name, _)| *name);
    read_kind(Fields::deserialize(deserializer)?, T::TAG, T::WHAT, reader, names).map_err(D::Error::custom)
}

/// Reads an object by the reader of its kind, which its `tag` names; `names` are those of all kinds.
pub fn read_kind<T>(
    mut fields: Fields,
    tag: &str,
    what: &str,
    reader: impl Fn(&str) -> Option<Reader<T>>,
    names: impl Iterator<Item = &'static str>,
) -> Result<T, Fault> {
    let Some(kind) = fields.0.remove(tag) else {
        return Err(Fault { pointer: String::new(), message: format!("missing field `{tag}`") });
    };
    let at_tag = |message| Fault { pointer: format!("/{tag}"), message };
    let kind = String::deserialize(kind).map_err(|error| at_tag(error.to_string()))?;
    match reader(&kind) {
        Some(reader) => reader(fields, &format!("{what} of {tag} `{kind}`")),
        None => Err(at_tag(unknown_kind(&kind, names))),
    }
}

/// Returns the message about a name that is not that of a kind.
pub fn unknown_kind(name: &str, names: impl Iterator<Item = &'static str>) -> String {
    let names: Vec<_> = names.map(|name| format!("`{name}`")).collect();
    format!("unknown variant `{name}`, expected one of {}", names.join(", "))
}

/// Fields of an object that have a value; null counts as absent.
pub struct Fields(Map<String, Value>);

impl Fields {
    /// True if the object has the field with a value.
    pub fn has(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// Removes the fields whose names are `wanted`, and reads each as an object of one type.
    pub fn take<T: DeserializeOwned>(&mut self, wanted: impl Fn(&str) -> bool) -> Result<BTreeMap<String, T>, Fault> {
        let names: Vec<String> = self.0.keys().filter(|name| wanted(name)).cloned().collect();
        let mut taken = BTreeMap::new();
        for name in names {
            let Some(value) = self.0.remove(&name) else { continue };
            let value = serde_path_to_error::deserialize(value).map_err(|error| {
                let fault = fault::of_error(&error);
                Fault { pointer: format!("/{}{}", escape(&name), fault.pointer), ..fault }
            })?;
            taken.insert(name, value);
        }
        Ok(taken)
    }

    /// Reads a struct that denies unknown fields; `of` describes it in the message about an unknown field.
    pub fn read<T: DeserializeOwned>(self, of: &str) -> Result<T, Fault> {
        serde_path_to_error::deserialize(Value::Object(self.0)).map_err(|error| {
            let fault = fault::of_error(&error);
            match quoted(&fault.message, "unknown field ") {
                // a fault in a nested object has its own message
                Some((name, rest)) if fault.pointer == format!("/{}", escape(name)) => {
                    let message = format!("unknown field `{name}`: not a field of {of}{rest}");
                    Fault { message, ..fault }
                }
                _ => fault,
            }
        })
    }

    /// Reads an object that has no fields.
    pub fn none(self, of: &str) -> Result<(), Fault> {
        self.read::<Empty>(of).map(drop)
    }
}

/// A variant without fields.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Empty {}

impl<'de> Deserialize<'de> for Fields {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Value::deserialize(deserializer)? {
            Value::Object(fields) => Ok(Self(fields.into_iter().filter(|(_, value)| !value.is_null()).collect())),
            other => Err(D::Error::invalid_type(unexpected(&other), &"an object")),
        }
    }
}

fn unexpected(value: &Value) -> Unexpected<'_> {
    match value {
        Value::Null => Unexpected::Unit,
        Value::Bool(value) => Unexpected::Bool(*value),
        Value::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(whole), _) => Unexpected::Unsigned(whole),
            (None, Some(whole)) => Unexpected::Signed(whole),
            (None, None) => Unexpected::Float(number.as_f64().unwrap_or(f64::NAN)),
        },
        Value::String(text) => Unexpected::Str(text),
        Value::Array(_) => Unexpected::Seq,
        Value::Object(_) => Unexpected::Map,
    }
}

impl fmt::Debug for Fields {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.debug_map().entries(&self.0).finish()
    }
}
