//! Values that are one number or a list of three.

use std::fmt;

use serde::Serialize;
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};

/// One number, or one for each channel or axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum OneOrThree {
    /// One number.
    One(f64),
    /// Three numbers.
    Three([f64; 3]),
}

impl OneOrThree {
    /// Reads the value; `what` describes it in messages, e.g. "a number or [r, g, b]".
    pub fn read<'de, D: Deserializer<'de>>(deserializer: D, what: &'static str) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader { what })
    }

    /// Returns the numbers as written in the document, each with the suffix that names it in a JSON pointer.
    pub fn numbers(self) -> Vec<(&'static str, f64)> {
        match self {
            Self::One(value) => vec![("", value)],
            Self::Three([a, b, c]) => vec![("/0", a), ("/1", b), ("/2", c)],
        }
    }
}

struct Reader {
    what: &'static str,
}

impl<'de> Visitor<'de> for Reader {
    type Value = OneOrThree;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(self.what)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<OneOrThree, E> {
        Ok(OneOrThree::One(value))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<OneOrThree, E> {
        Ok(OneOrThree::One(value as f64))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<OneOrThree, E> {
        Ok(OneOrThree::One(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<OneOrThree, A::Error> {
        let mut numbers = [0.0; 3];
        for (index, number) in numbers.iter_mut().enumerate() {
            *number = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
        }
        let mut length = numbers.len();
        while seq.next_element::<serde::de::IgnoredAny>()?.is_some() {
            length += 1;
        }
        if length > numbers.len() {
            return Err(A::Error::invalid_length(length, &self));
        }
        Ok(OneOrThree::Three(numbers))
    }

    /// Refuses an object, with words that say what the value may be.
    fn visit_map<A: MapAccess<'de>>(self, _: A) -> Result<OneOrThree, A::Error> {
        Err(A::Error::custom(format!("must be {}, not a table", self.what)))
    }
}
