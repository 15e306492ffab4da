//! Deserialisation of a JSON value to typed data that collects all structural errors.

use std::collections::BTreeSet;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::fault::{self, Fault, quoted};
use super::pointer::{self, escape};
use super::stand_in::{spoils, stand_in};
use crate::document::errors::{Checks, FieldError, FieldErrorCode};
use crate::document::hints;

/// Largest number of structural errors that are reported.
const MOST_ERRORS: usize = 100;

/// Pointers to the values that were made up so that the rest could be read.
#[derive(Default)]
pub struct MadeUp(Vec<String>);

impl MadeUp {
    /// True if an error is about a made-up value, or mentions the object that contains it.
    pub fn concerns(&self, error: &FieldError) -> bool {
        self.0.iter().any(|made_up| {
            let below = error.pointer.strip_prefix(made_up.as_str());
            let below = below.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
            let object = made_up.rsplit_once('/').map_or("", |(parent, _)| parent);
            below || (!object.is_empty() && error.detail.contains(object))
        })
    }

    /// True if the shape of the room, or a part of it, is made up.
    pub fn has_room(&self) -> bool {
        let shapes = ["/room/size_m", "/room/plan", "/room/ceiling"];
        self.0.iter().any(|made_up| made_up == "/room" || shapes.iter().any(|shape| made_up.starts_with(shape)))
    }

    /// Replaces the value at `pointer`, which is missing or of a wrong type, by a valid one; false if none is available, or it
    /// was replaced before.
    fn replace(&mut self, value: &mut Value, pointer: &str) -> bool {
        let Some((place, stands_in)) = stand_in(pointer) else { return false };
        if self.0.iter().any(|made_up| made_up == place) || !pointer::insert(value, place, stands_in) {
            return false;
        }
        self.0.push(place.to_owned());
        let together = spoils(place);
        if together != place {
            self.0.push(together.to_owned());
        }
        true
    }
}

/// Deserialises `value` and adds its structural faults to `checks`; `None` if a value cannot be replaced by a valid one, or if
/// there are too many faults.
pub(crate) fn read<T: DeserializeOwned + Serialize>(mut value: Value, checks: &mut Checks) -> Option<(T, MadeUp)> {
    let (mut made_up, mut lists) = (MadeUp::default(), Lists::default());
    let data = loop {
        match serde_path_to_error::deserialize::<_, T>(&value) {
            Ok(data) => break data,
            Err(error) => {
                let mut fault = fault::of_error(&error);
                if let Some(pointer) = lists.for_object::<T>(&value, &fault.pointer) {
                    fault = Fault { pointer, message: LIST_FOR_OBJECT.to_owned() };
                }
                let (error, cure) = field_error(fault);
                // an error hides others, which are found once it is out of the way
                let cured = match cure {
                    Cure::Remove => pointer::remove(&mut value, &error.pointer),
                    Cure::Replace => made_up.replace(&mut value, &error.pointer),
                };
                checks.errors.push(error);
                if !cured || checks.errors.len() >= MOST_ERRORS {
                    return None;
                }
            }
        }
    };
    refuse_unnamed(&value, &serde_json::to_value(&data).unwrap_or_default(), "", checks);
    Some((data, made_up))
}

/// Message about a list in the place of an object.
const LIST_FOR_OBJECT: &str = "invalid type: sequence, expected an object";

/// Lists of a document that are known to be lists by right: their pointers, with `*` for numbers of items.
#[derive(Default)]
struct Lists(BTreeSet<String>);

impl Lists {
    /// Returns the pointer to the first list on the way to a fault that serde reads as the fields of an object in order, by which its messages
    /// about it cannot be understood; `None` without one. Such a list may be an empty object as well, apart from missing fields.
    fn for_object<T: DeserializeOwned>(&mut self, value: &Value, pointer: &str) -> Option<String> {
        let ends = pointer.match_indices('/').map(|(end, _)| end).chain([pointer.len()]);
        for place in ends.map(|end| &pointer[..end]) {
            let kind: Vec<&str> =
                place.split('/').map(|token| if token.parse::<usize>().is_ok() { "*" } else { token }).collect();
            let is_list = value.pointer(place).is_some_and(Value::is_array);
            if !is_list || !self.0.insert(kind.join("/")) {
                continue;
            }
            let mut with_object = value.clone();
            *with_object.pointer_mut(place)? = Value::Object(serde_json::Map::new());
            let fault =
                serde_path_to_error::deserialize::<_, T>(&with_object).err().map(|error| fault::of_error(&error));
            let is_list = |fault: &Fault| fault.pointer == place && !fault.message.starts_with("missing field ");
            if !fault.as_ref().is_some_and(is_list) {
                return Some(place.to_owned());
            }
        }
        None
    }
}

/// Remedy for a structural error, so that the next one can be found.
enum Cure {
    /// Remove the field.
    Remove,
    /// Replace the value by a valid one.
    Replace,
}

/// Converts a deserializer's fault to an error for the user, and chooses the remedy.
fn field_error(Fault { mut pointer, message }: Fault) -> (FieldError, Cure) {
    if let Some((field, _)) = quoted(&message, "missing field ") {
        pointer = format!("{pointer}/{}", escape(field));
        return (FieldError::missing(pointer), Cure::Replace);
    }
    let unknown = |prefix| quoted(&message, prefix).map(|(name, rest)| (name, hints::of_known_names(name, rest)));
    if let Some((field, hint)) = unknown("unknown field ") {
        let token = format!("/{}", escape(field));
        if !pointer.ends_with(&token) {
            pointer.push_str(&token);
        }
        let error = FieldError::new(pointer, format!("{message}{hint}"));
        return (error.coded(FieldErrorCode::UnknownField), Cure::Remove);
    }
    let hint = unknown("unknown variant ").map_or_else(|| hints::of_sensor(&pointer, &message), |(_, hint)| hint);
    (FieldError::new(pointer, format!("{message}{hint}")), Cure::Replace)
}

/// Adds a fault for each list in the place of an object, which serde would accept as the values of its fields in order.
fn refuse_unnamed(given: &Value, understood: &Value, pointer: &str, checks: &mut Checks) {
    match (given, understood) {
        (Value::Array(_), Value::Object(_)) => checks.refuse(pointer, LIST_FOR_OBJECT),
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
