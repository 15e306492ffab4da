//! Fields of a Honeybee model (HBJSON) that are read.

use std::fmt;
use std::marker::PhantomData;

use serde::Deserialize;
use serde::de::{Deserializer, Error as _, IgnoredAny, SeqAccess, Visitor};

use crate::document::limits::{CORNERS, FACES, HOLES};

/// Fields of a model that are read; all others are passed over.
#[derive(Deserialize)]
pub(super) struct Model {
    #[serde(default)]
    pub(super) units: Units,
    #[serde(default)]
    pub(super) tolerance: Option<f64>,
    #[serde(default)]
    pub(super) rooms: Option<Vec<ModelRoom>>,
}

/// Unit of the coordinates of a model.
#[derive(Clone, Copy, Default, Deserialize)]
pub(super) enum Units {
    #[default]
    Meters,
    Millimeters,
    Centimeters,
    Feet,
    Inches,
}

#[derive(Deserialize)]
pub(super) struct ModelRoom {
    pub(super) identifier: String,
    #[serde(default)]
    pub(super) display_name: Option<String>,
    #[serde(deserialize_with = "at_most::<_, _, MOST_FACES>")]
    pub(super) faces: Vec<ModelFace>,
    #[serde(default)]
    pub(super) indoor_shades: Option<Vec<IgnoredAny>>,
}

#[derive(Deserialize)]
pub(super) struct ModelFace {
    pub(super) identifier: String,
    pub(super) face_type: FaceType,
    pub(super) geometry: Face3d,
    #[serde(default)]
    pub(super) apertures: Option<Vec<IgnoredAny>>,
    #[serde(default)]
    pub(super) doors: Option<Vec<IgnoredAny>>,
}

#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
pub(super) enum FaceType {
    Wall,
    Floor,
    RoofCeiling,
    AirBoundary,
}

#[derive(Deserialize)]
pub(super) struct Face3d {
    pub(super) boundary: Ring,
    #[serde(default)]
    pub(super) holes: Option<Holes>,
}

/// Corners of a boundary or a hole.
#[derive(Deserialize)]
pub(super) struct Ring(#[serde(deserialize_with = "at_most::<_, _, MOST_CORNERS>")] pub(super) Vec<[f64; 3]>);

#[derive(Deserialize)]
pub(super) struct Holes(#[serde(deserialize_with = "at_most::<_, _, MOST_HOLES>")] pub(super) Vec<Ring>);

const MOST_FACES: usize = *FACES.end();
const MOST_HOLES: usize = *HOLES.end();
const MOST_CORNERS: usize = *CORNERS.end();

/// Reads a list of at most `MOST` values: what is longer is refused before it takes memory.
fn at_most<'de, D: Deserializer<'de>, T: Deserialize<'de>, const MOST: usize>(source: D) -> Result<Vec<T>, D::Error> {
    struct Few<T, const MOST: usize>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>, const MOST: usize> Visitor<'de> for Few<T, MOST> {
        type Value = Vec<T>;

        fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
            write!(formatter, "an array")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Vec<T>, A::Error> {
            let mut read = Vec::new();
            while let Some(item) = items.next_element()? {
                if read.len() == MOST {
                    return Err(A::Error::custom(format!("must have at most {MOST} items")));
                }
                read.push(item);
            }
            Ok(read)
        }
    }
    source.deserialize_seq(Few::<T, MOST>(PhantomData))
}

impl Units {
    /// Converts a length to metres; a division where that is exact.
    pub(super) fn metres(self, length: f64) -> f64 {
        match self {
            Self::Meters => length,
            Self::Millimeters => length / 1000.0,
            Self::Centimeters => length / 100.0,
            Self::Feet => length * 0.3048,
            Self::Inches => length * 0.0254,
        }
    }
}

impl ModelRoom {
    pub(super) fn is_named(&self, name: &str) -> bool {
        self.identifier == name || self.display_name.as_deref() == Some(name)
    }
}
