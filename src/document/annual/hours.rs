//! Request for the illuminances of a grid at some hours, by the kept responses of its room.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::document::errors::{Checks, DocumentErrors, FieldError, FieldErrorCode};
use crate::document::limits::HOURS;
use crate::document::read::shape;
use crate::document::sky::perez::{PerezDocument, typical_dew_point};
use crate::document::sky::time::{day_of_year, instant};
use crate::sky::Irradiances;
use crate::sky::sun::UtcInstant;

/// Hours of which the illuminances of a grid are asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct HourListDocument {
    /// Hours, 1 to 8784, in any order.
    pub hours: Vec<HourDocument>,
}

/// Moment with the irradiances of sky and sun, from which the sky of Perez follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct HourDocument {
    /// Moment of the sun's position, as `time` of a job (RFC 3339 with an offset).
    #[schema(example = "2026-06-21T12:00:00+02:00", format = DateTime)]
    pub time: String,
    /// Direct normal irradiance in W/m2.
    pub direct_normal_irradiance_w_m2: f64,
    /// Diffuse horizontal irradiance in W/m2.
    pub diffuse_horizontal_irradiance_w_m2: f64,
    /// Dew point in degrees Celsius, on which the luminous efficacies depend a little.
    #[serde(default = "typical_dew_point")]
    #[schema(default = 11.0)]
    pub dew_point_c: f64,
}

/// Hour that was read and checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidHour {
    /// Moment in UTC.
    pub instant: UtcInstant,
    /// Number of the day in its year, from 1.
    pub day_of_year: u16,
    /// Irradiances of sky and sun.
    pub irradiances: Irradiances,
}

impl HourListDocument {
    /// Checks a request that was read as JSON. Errors report every fault, with pointers into the request.
    pub fn from_value(value: Value) -> Result<Vec<ValidHour>, DocumentErrors> {
        let mut checks = Checks::default();
        let Some((request, _)) = shape::read::<Self>(value, &mut checks) else {
            return Err(DocumentErrors(checks.errors));
        };
        let count = request.hours.len();
        if !HOURS.contains(&count) {
            let detail = format!("must have {} to {} entries, but has {count}", HOURS.start(), HOURS.end());
            let code = if count > *HOURS.end() { FieldErrorCode::TooMany } else { FieldErrorCode::Invalid };
            checks.refuse_as(code, "/hours", detail);
            return Err(DocumentErrors(checks.errors));
        }
        let hours = request.hours.iter().enumerate();
        let hours: Vec<ValidHour> = hours.filter_map(|(number, hour)| hour.checked(number, &mut checks)).collect();
        if checks.errors.is_empty() { Ok(hours) } else { Err(DocumentErrors(checks.errors)) }
    }
}

impl HourDocument {
    fn checked(&self, number: usize, checks: &mut Checks) -> Option<ValidHour> {
        let at = format!("/hours/{number}");
        let sky = PerezDocument {
            direct_normal_irradiance_w_m2: self.direct_normal_irradiance_w_m2,
            diffuse_horizontal_irradiance_w_m2: self.diffuse_horizontal_irradiance_w_m2,
            dew_point_c: self.dew_point_c,
        };
        sky.check(&at, checks);
        match (instant(&self.time), day_of_year(&self.time)) {
            (Ok(instant), Some(day_of_year)) => {
                Some(ValidHour { instant, day_of_year, irradiances: sky.irradiances() })
            }
            (Err(detail), _) => {
                checks.errors.push(FieldError::new(format!("{at}/time"), detail));
                None
            }
            (Ok(_), None) => None,
        }
    }
}
