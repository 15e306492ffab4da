//! Centres of openings: in plan, or in space on faces that the plan does not place.

use std::fmt;

use glam::DVec2;
use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{Serialize, Serializer};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{OneOfBuilder, Schema};
use utoipa::{PartialSchema, ToSchema};

use crate::document::limits::COORDINATE_M;
use crate::document::schema::shapes::{array, number};

/// Centre of an opening in metres, `[x, y]` or `[x, y, z]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CentreDocument {
    /// Place in plan.
    pub plan: [f64; 2],
    /// Height above the floor, if it is given.
    pub height_m: Option<f64>,
}

impl CentreDocument {
    /// Returns the place in plan in metres.
    pub fn in_plan(&self) -> DVec2 {
        self.plan.into()
    }
}

impl PartialSchema for CentreDocument {
    fn schema() -> RefOr<Schema> {
        let in_plan = array(2, number(COORDINATE_M)).description(Some("x and y in metres."));
        let in_space = array(3, number(COORDINATE_M)).description(Some("x, y and z in metres."));
        RefOr::from(OneOfBuilder::new().item(in_plan).item(in_space))
    }
}

impl ToSchema for CentreDocument {}

impl Serialize for CentreDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.plan.iter().chain(&self.height_m))
    }
}

impl<'de> Deserialize<'de> for CentreDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Coordinates)
    }
}

struct Coordinates;

impl<'de> Visitor<'de> for Coordinates {
    type Value = CentreDocument;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("an array of 2 or 3 numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<CentreDocument, A::Error> {
        let mut plan = [0.0; 2];
        for (index, number) in plan.iter_mut().enumerate() {
            *number = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
        }
        let height_m = seq.next_element()?;
        let mut length = 3;
        while seq.next_element::<serde::de::IgnoredAny>()?.is_some() {
            length += 1;
        }
        if length > 3 {
            return Err(A::Error::invalid_length(length, &self));
        }
        Ok(CentreDocument { plan, height_m })
    }
}
