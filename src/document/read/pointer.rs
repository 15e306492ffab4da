//! JSON pointers (RFC 6901) to the fields of a document.

use serde_json::Value;
use serde_path_to_error::{Path, Segment};

/// Escapes `token` for a JSON pointer (RFC 6901, section 3).
pub fn escape(token: &str) -> String {
    token.replace('~', "~0").replace('/', "~1")
}

/// Splits a pointer into that of the parent and the name of the field or item; `None` for the whole document.
pub fn split(pointer: &str) -> Option<(&str, String)> {
    let (parent, token) = pointer.rsplit_once('/')?;
    Some((parent, token.replace("~1", "/").replace("~0", "~")))
}

/// Returns the JSON pointer to the place where a deserializer stopped.
pub fn of_path(path: &Path) -> String {
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

/// Removes the field at `pointer`; false if there is none.
pub fn remove(value: &mut Value, pointer: &str) -> bool {
    let Some((parent, name)) = split(pointer) else { return false };
    match value.pointer_mut(parent) {
        Some(Value::Object(object)) => object.remove(&name).is_some(),
        _ => false,
    }
}

/// Sets the field or item at `pointer`, whose parent must exist; false if there is no such place.
pub fn insert(value: &mut Value, pointer: &str, inserted: Value) -> bool {
    let Some((parent, name)) = split(pointer) else { return false };
    match value.pointer_mut(parent) {
        Some(Value::Object(object)) => {
            object.insert(name, inserted);
            true
        }
        Some(Value::Array(array)) => match name.parse().ok().and_then(|index: usize| array.get_mut(index)) {
            Some(item) => {
                *item = inserted;
                true
            }
            None => false,
        },
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escapes_of_rfc_6901() {
        assert_eq!(escape("a/b~c"), "a~1b~0c");
        assert_eq!(split("/x/a~1b~0c"), Some(("/x", "a/b~c".to_owned())));
        assert_eq!(split(""), None);
    }
}
