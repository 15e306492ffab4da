//! All-weather sky of Perez, by the irradiances of a moment.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::time::day_of_year;
use crate::document::errors::Checks;
use crate::document::limits::{DEW_POINT_C, DIFFUSE_IRRADIANCE_W_M2, DIRECT_IRRADIANCE_W_M2};
use crate::sky::{Irradiances, PerezSky};

/// All-weather sky of Perez: distribution, level and beam follow from irradiances, as weather files have them. The distance of the sun is that
/// of the day of `time`, or the mean one if the sky gives the sun's position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PerezDocument {
    /// Direct normal irradiance in W/m2.
    pub direct_normal_irradiance_w_m2: f64,
    /// Diffuse horizontal irradiance in W/m2.
    pub diffuse_horizontal_irradiance_w_m2: f64,
    /// Dew point in degrees Celsius, on which the luminous efficacies depend a little.
    #[serde(default = "typical_dew_point")]
    #[schema(default = 11.0)]
    pub dew_point_c: f64,
}

/// Returns the dew point in degrees Celsius where none is given.
pub fn typical_dew_point() -> f64 {
    11.0
}

impl PerezDocument {
    /// Returns the state of the sky under a sun at the unit vector `sun`, on the day of `time` in RFC 3339.
    pub(super) fn state(&self, sun: DVec3, time: Option<&str>) -> PerezSky {
        PerezSky::new(self.irradiances(), sun, time.and_then(day_of_year))
    }

    /// Returns the irradiances with the dew point.
    pub fn irradiances(&self) -> Irradiances {
        Irradiances {
            direct_normal_w_m2: self.direct_normal_irradiance_w_m2,
            diffuse_horizontal_w_m2: self.diffuse_horizontal_irradiance_w_m2,
            dew_point_c: self.dew_point_c,
        }
    }

    /// Checks the numbers, which stand at the JSON pointer `at`.
    pub(in crate::document) fn check(&self, at: &str, checks: &mut Checks) {
        for (field, value, range) in [
            ("direct_normal_irradiance_w_m2", self.direct_normal_irradiance_w_m2, DIRECT_IRRADIANCE_W_M2),
            ("diffuse_horizontal_irradiance_w_m2", self.diffuse_horizontal_irradiance_w_m2, DIFFUSE_IRRADIANCE_W_M2),
            ("dew_point_c", self.dew_point_c, DEW_POINT_C),
        ] {
            checks.number(&format!("{at}/{field}"), value, range);
        }
    }
}
