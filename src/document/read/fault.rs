//! What a deserializer found wrong, and where.

use std::fmt;

use serde_path_to_error::Path;

use super::pointer;

/// A message of serde and the place that it is about.
#[derive(Debug)]
pub struct Fault {
    /// Place of the fault as a JSON pointer below the value that was read.
    pub pointer: String,
    /// What is wrong there, in the words of the deserializer.
    pub message: String,
}

/// Read back by [`of_path`]: a deserializer inside another one can hand on a text alone.
impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{PLACE}{}: {}", serde_json::Value::from(self.pointer.as_str()), self.message)
    }
}

/// Begins the text of a fault; no message of serde begins so.
const PLACE: &str = "at ";

/// Fault that stopped a deserializer, inner places and messages taken apart.
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

/// The place and the message of a fault that was written as text.
fn inner(message: &str) -> Option<(String, &str)> {
    let text = message.strip_prefix(PLACE)?;
    let mut place = serde_json::Deserializer::from_str(text).into_iter::<String>();
    let below = place.next()?.ok()?;
    Some((below, text[place.byte_offset()..].strip_prefix(": ")?))
}

/// The name between backticks after `prefix`, and what follows it.
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
