//! Faults that a deserializer finds, with their places in the document.

use std::fmt;

use serde_path_to_error::Path;

use super::pointer;

/// A message of serde with the place that it refers to.
#[derive(Debug)]
pub struct Fault {
    /// Place of the fault as a JSON pointer below the value that was read.
    pub pointer: String,
    /// Message of the deserializer about that place.
    pub message: String,
}

/// Writes a fault as text that [`of_path`] parses, because a nested deserializer can only pass on a text.
impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{PLACE}{}: {}", serde_json::Value::from(self.pointer.as_str()), self.message)
    }
}

/// Prefix of the text of a fault, with which no message of serde begins.
const PLACE: &str = "at ";

/// Returns the fault that stopped a deserializer, with the place of a nested deserializer's fault appended to its own.
pub fn of_error<E: fmt::Display>(error: &serde_path_to_error::Error<E>) -> Fault {
    of_path(error.path(), &error.inner().to_string())
}

fn of_path(path: &Path, message: &str) -> Fault {
    let outer = pointer::of_path(path);
    match inner(message) {
        Some((below, message)) => Fault { pointer: outer + &below, message: message.to_owned() },
        None => Fault { pointer: outer, message: message.to_owned() },
    }
}

/// Parses the place and the message of a fault that was written as text.
fn inner(message: &str) -> Option<(String, &str)> {
    let text = message.strip_prefix(PLACE)?;
    let mut place = serde_json::Deserializer::from_str(text).into_iter::<String>();
    let below = place.next()?.ok()?;
    Some((below, text[place.byte_offset()..].strip_prefix(": ")?))
}

/// Returns the name between backticks after `prefix`, and the text after it.
pub fn quoted<'a>(message: &'a str, prefix: &str) -> Option<(&'a str, &'a str)> {
    message.strip_prefix(prefix)?.strip_prefix('`')?.split_once('`')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let fault = Fault { pointer: "/parts/a \"b\": `c`".to_owned(), message: "missing field `kind`".to_owned() };
        let text = fault.to_string();
        assert_eq!(inner(&text), Some((fault.pointer, fault.message.as_str())));
        assert_eq!(inner("invalid type: map"), None);
        assert_eq!(inner("at home"), None);
    }
}
