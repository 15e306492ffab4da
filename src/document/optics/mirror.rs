//! Reflectances of mirrors: a coefficient, or a table over the angle of incidence.

use std::fmt;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::errors::Checks;
use crate::document::optics::coefficient::Coefficient;
use crate::document::read::{Misfit, misfit};
use crate::document::schema::TableAngle;
use crate::document::validate::check_ratio;
use crate::optics::Mirror;
use crate::optics::mirror::MirrorTable;

const MOST_ROWS: usize = 1000;

/// Specular reflectance per bounce: a number or `[r, g, b]` for all angles, or a table.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum MirrorDocument {
    Constant(Coefficient),
    ByAngle(MirrorTableDocument),
}

/// Reflectance over the angle of incidence, measured from the mirror's normal; linear in the angle between its rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorTableDocument {
    /// Ascending from 0 to 90.
    #[schema(value_type = Vec<TableAngle>, min_items = 2, max_items = 1000)]
    pub incidence_deg: Vec<f64>,
    /// One for each angle.
    #[schema(min_items = 2, max_items = 1000)]
    pub reflectance: Vec<Coefficient>,
}

impl MirrorDocument {
    /// The mirror of a validated document.
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

    pub fn coefficients(&self) -> Vec<Coefficient> {
        match self {
            Self::Constant(coefficient) => vec![*coefficient],
            Self::ByAngle(table) => table.reflectance.clone(),
        }
    }

    /// The number or `[r, g, b]` of what has no table.
    pub fn constant(self, field: &'static str, of: &str) -> Result<Coefficient, Misfit> {
        match self {
            Self::Constant(coefficient) => Ok(coefficient),
            Self::ByAngle(_) => Err(misfit(field, format!("{of} has a number or [r, g, b], not a table"))),
        }
    }

    pub fn check(&self, pointer: &str, checks: &mut Checks) {
        let table = match self {
            Self::Constant(coefficient) => {
                check_ratio(pointer, *coefficient, checks);
                return;
            }
            Self::ByAngle(table) => table,
        };
        for (index, coefficient) in table.reflectance.iter().enumerate() {
            check_ratio(&format!("{pointer}/reflectance/{index}"), *coefficient, checks);
        }
        let rows = table.incidence_deg.len();
        if table.reflectance.len() != rows {
            let detail =
                format!("must have one value for each of the {rows} angles, but has {}", table.reflectance.len());
            checks.refuse(format!("{pointer}/reflectance"), detail);
        }
        check_angles(&format!("{pointer}/incidence_deg"), &table.incidence_deg, MOST_ROWS, checks);
    }
}

/// Angles of a table: ascending from 0 to 90 degrees.
pub(in crate::document) fn check_angles(pointer: &str, angles_deg: &[f64], most: usize, checks: &mut Checks) -> bool {
    let rows = angles_deg.len();
    if !(2..=most).contains(&rows) {
        checks.refuse(pointer, format!("must have 2..{most} angles, but has {rows}"));
        return false;
    }
    if let Some(index) = (1..rows).find(|index| angles_deg[*index - 1] >= angles_deg[*index]) {
        checks.refuse(format!("{pointer}/{index}"), "must be larger than the angle before it");
        return false;
    }
    for (index, end) in [(0, 0.0), (rows - 1, 90.0)] {
        if angles_deg[index] != end {
            let detail = format!("must be {end}: the angles run from 0 to 90; it is {}", angles_deg[index]);
            checks.refuse(format!("{pointer}/{index}"), detail);
            return false;
        }
    }
    true
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
