//! Measured diffusers in documents.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::table::check_angles;
use crate::document::errors::Checks;
use crate::document::limits::{EXITS, INCIDENCES, SCATTERING_PER_SR};
use crate::document::schema::shapes::{ScatteringRow, TableAngle};
use crate::optics::MeasuredDiffuser;
use crate::optics::measured::TableError;

/// Fields of a measured diffuser: tables of scattering by the angles of incidence and of exit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredDocument {
    /// Angles of incidence in degrees, ascending from 0 to 90.
    #[schema(value_type = Vec<TableAngle>)]
    pub incidence_deg: Vec<f64>,
    /// Angles of exit in degrees from the normal, ascending from 0 to 90: of transmitted light on the far side, of reflected
    /// light on the near side.
    #[schema(value_type = Vec<TableAngle>)]
    pub exit_deg: Vec<f64>,
    /// Values of the BTDF in 1/sr: a row for each angle of incidence, a column for each angle of exit.
    #[schema(value_type = Vec<ScatteringRow>)]
    pub btdf_per_sr: Vec<Vec<f64>>,
    /// Values of the BRDF in 1/sr, in rows and columns like those of the BTDF; without it nothing is reflected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<ScatteringRow>>)]
    pub brdf_per_sr: Option<Vec<Vec<f64>>>,
}

impl MeasuredDocument {
    /// Returns the table for the engine. An error if its shape is wrong, or a row scatters more light than it receives.
    pub fn diffuser(&self) -> Result<MeasuredDiffuser, TableError> {
        let radians = |angles: &[f64]| angles.iter().map(|angle| angle.to_radians()).collect::<Vec<_>>();
        let (incidence, exit) = (radians(&self.incidence_deg), radians(&self.exit_deg));
        MeasuredDiffuser::new(&incidence, &exit, &self.btdf_per_sr, self.brdf_per_sr.as_deref())
    }

    /// Adds faults for angles and values out of their bounds, tables of a wrong shape, and rows that scatter more light than they
    /// receive.
    pub(crate) fn check(&self, pointer: &str, checks: &mut Checks) {
        let before = checks.errors.len();
        check_angles(&format!("{pointer}/incidence_deg"), &self.incidence_deg, &INCIDENCES, checks);
        check_angles(&format!("{pointer}/exit_deg"), &self.exit_deg, &EXITS, checks);
        self.check_table(&format!("{pointer}/btdf_per_sr"), &self.btdf_per_sr, checks);
        if let Some(table) = &self.brdf_per_sr {
            self.check_table(&format!("{pointer}/brdf_per_sr"), table, checks);
        }
        if checks.errors.len() > before {
            return;
        }
        match self.diffuser() {
            Ok(_) => {}
            Err(TableError::Gain { row, albedo }) => {
                let detail = format!(
                    "must scatter at most the light that it receives, but at an incidence of {} degrees it scatters \
                     {albedo} times as much (2 pi int f cos sin, transmitted plus reflected)",
                    self.incidence_deg[row]
                );
                checks.refuse(format!("{pointer}/btdf_per_sr/{row}"), detail);
            }
            Err(error) => checks.refuse(format!("{pointer}/btdf_per_sr"), error.to_string()),
        }
    }

    fn check_table(&self, pointer: &str, table: &[Vec<f64>], checks: &mut Checks) {
        let (rows, columns) = (self.incidence_deg.len(), self.exit_deg.len());
        if table.len() != rows {
            let detail =
                format!("must have one row for each of the {rows} angles of incidence, but has {}", table.len());
            checks.refuse(pointer, detail);
        }
        for (index, row) in table.iter().enumerate() {
            if row.len() != columns {
                let detail =
                    format!("must have one value for each of the {columns} angles of exit, but has {}", row.len());
                checks.refuse(format!("{pointer}/{index}"), detail);
            }
            checks.numbers(&format!("{pointer}/{index}"), row, SCATTERING_PER_SR);
        }
    }
}
