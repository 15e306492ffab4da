//! Rule for the gather radius of progressive photon mapping.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::bounds::MOST_POINTS;
use crate::document::errors::Checks;
use crate::integrator::photon_map::progressive::Radius;

/// Rule for the gather radius of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RadiusKind {
    /// Schedule: the radius depends only on the number of the pass, so that passes are independent.
    Schedule,
    /// Per point: the radius depends on the photons that the sensor or pixel has found in earlier passes.
    PerPoint,
}

impl From<RadiusKind> for Radius {
    fn from(kind: RadiusKind) -> Self {
        match kind {
            RadiusKind::Schedule => Self::Schedule,
            RadiusKind::PerPoint => Self::PerPoint,
        }
    }
}

impl From<Radius> for RadiusKind {
    fn from(radius: Radius) -> Self {
        match radius {
            Radius::Schedule => Self::Schedule,
            Radius::PerPoint => Self::PerPoint,
        }
    }
}

impl RadiusKind {
    /// Adds a fault if there are more points than statistics can be kept for.
    pub(crate) fn check_points(self, points: u64, checks: &mut Checks) {
        if self == Self::PerPoint && points > MOST_POINTS {
            let detail = format!(
                "per_point allows at most {MOST_POINTS} samples over all sensors and pixels, but there are {points}: \
                 use `schedule` or fewer samples"
            );
            checks.refuse("/method/radius", detail);
        }
    }
}
