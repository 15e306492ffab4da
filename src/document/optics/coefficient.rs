//! Reflectances, transmittances and luminances: one photopic number or linear Rec.709.

use std::fmt;

use serde::Serialize;
use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};

/// One photopic number, or linear Rec.709 `[r, g, b]` with Y = 0.2126 R + 0.7152 G + 0.0722 B.
///
/// Reflectances and transmittances are within 0..1 in every channel. A scene with numbers only is computed in one
/// photopic channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Coefficient {
    /// The same for all light.
    Photopic(f64),
    /// Linear Rec.709 red, green, blue.
    Rgb([f64; 3]),
}

impl Coefficient {
    pub const ZERO: Self = Self::Photopic(0.0);

    /// As linear Rec.709: one number counts for all three.
    pub fn rgb(self) -> [f64; 3] {
        match self {
            Self::Photopic(value) => [value; 3],
            Self::Rgb(rgb) => rgb,
        }
    }

    pub fn is_coloured(self) -> bool {
        matches!(self, Self::Rgb(_))
    }

    /// The channels as written in the document, each with what a JSON pointer adds to name it.
    pub fn channels(self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Photopic(value) => vec![("", value)],
            Self::Rgb([r, g, b]) => vec![("/0", r), ("/1", g), ("/2", b)],
        }
    }
}

impl Default for Coefficient {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<'de> Deserialize<'de> for Coefficient {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(CoefficientVisitor)
    }
}

struct CoefficientVisitor;

impl<'de> Visitor<'de> for CoefficientVisitor {
    type Value = Coefficient;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a number or [r, g, b]")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Coefficient, E> {
        Ok(Coefficient::Photopic(value))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Coefficient, E> {
        Ok(Coefficient::Photopic(value as f64))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Coefficient, E> {
        Ok(Coefficient::Photopic(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Coefficient, A::Error> {
        let mut rgb = [0.0; 3];
        for (index, channel) in rgb.iter_mut().enumerate() {
            *channel = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
        }
        let mut length = rgb.len();
        while seq.next_element::<serde::de::IgnoredAny>()?.is_some() {
            length += 1;
        }
        if length > rgb.len() {
            return Err(A::Error::invalid_length(length, &self));
        }
        Ok(Coefficient::Rgb(rgb))
    }
}
