//! Reflectances of mirrors: a coefficient, or a table by the angle of incidence.

use std::fmt;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::coefficient::Coefficient;
use super::table::check_angles;
use crate::document::errors::Checks;
use crate::document::limits::MIRROR_ROWS;
use crate::document::schema::shapes::TableAngle;
use crate::optics::Mirror;
use crate::optics::mirror::MirrorTable;

/// Specular reflectance per bounce: a number or `[r, g, b]` for all angles, or a table by the angle of incidence.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum MirrorDocument {
    /// Reflectance that is the same at every angle of incidence.
    Constant(Coefficient),
    /// Reflectance by the angle of incidence.
    ByAngle(MirrorTableDocument),
}

/// Table of reflectance by the angle of incidence, measured from the mirror's normal and interpolated linearly in the angle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorTableDocument {
    /// Angles of incidence in degrees, ascending from 0 to 90.
    #[schema(value_type = Vec<TableAngle>)]
    pub incidence_deg: Vec<f64>,
    /// Reflectances, one for each angle.
    pub reflectance: Vec<Coefficient>,
}

impl MirrorDocument {
    /// Returns the mirror of a validated document.
    pub fn mirror(&self) -> Mirror {
        match self {
            Self::Constant(coefficient) => Mirror::Constant(coefficient.rgb()),
            Self::ByAngle(table) => {
                let rows: Vec<_> = table
                    .incidence_deg
                    .iter()
                    .zip(&table.reflectance)
                    .map(|(angle, value)| (angle.to_radians(), value.rgb()))
                    .collect();
                MirrorTable::new(&rows).map_or(Mirror::Constant([0.0; 3]), |table| Mirror::ByAngle(table.into()))
            }
        }
    }

    /// Returns all reflectances: one, or one for each row of the table.
    pub fn coefficients(&self) -> Vec<Coefficient> {
        match self {
            Self::Constant(coefficient) => vec![*coefficient],
            Self::ByAngle(table) => table.reflectance.clone(),
        }
    }

    /// Adds faults for reflectances outside 0..1 and tables of a wrong shape.
    pub(crate) fn check(&self, pointer: &str, checks: &mut Checks) {
        let table = match self {
            Self::Constant(coefficient) => {
                coefficient.check(pointer, checks);
                return;
            }
            Self::ByAngle(table) => table,
        };
        for (index, coefficient) in table.reflectance.iter().enumerate() {
            coefficient.check(&format!("{pointer}/reflectance/{index}"), checks);
        }
        let rows = table.incidence_deg.len();
        if table.reflectance.len() != rows {
            let detail =
                format!("must have one value for each of the {rows} angles, but has {}", table.reflectance.len());
            checks.refuse(format!("{pointer}/reflectance"), detail);
        }
        check_angles(&format!("{pointer}/incidence_deg"), &table.incidence_deg, &MIRROR_ROWS, checks);
    }
}

impl From<Coefficient> for MirrorDocument {
    fn from(coefficient: Coefficient) -> Self {
        Self::Constant(coefficient)
    }
}

impl<'de> Deserialize<'de> for MirrorDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MirrorVisitor)
    }
}

struct MirrorVisitor;

impl<'de> Visitor<'de> for MirrorVisitor {
    type Value = MirrorDocument;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a number, [r, g, b], or a table of `incidence_deg` and `reflectance`")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<MirrorDocument, E> {
        Ok(Coefficient::Photopic(value).into())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<MirrorDocument, E> {
        Ok(Coefficient::Photopic(value as f64).into())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<MirrorDocument, E> {
        Ok(Coefficient::Photopic(value as f64).into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<MirrorDocument, A::Error> {
        Coefficient::deserialize(SeqAccessDeserializer::new(seq)).map(MirrorDocument::Constant)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MirrorDocument, A::Error> {
        MirrorTableDocument::deserialize(MapAccessDeserializer::new(map)).map(MirrorDocument::ByAngle)
    }
}
