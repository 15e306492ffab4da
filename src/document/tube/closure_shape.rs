//! Shape of a closure other than the end of its pipe.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::diffuser::DiffuserDocument;
use crate::document::errors::Checks;
use crate::document::limits::{DIAMETER_M, RATIO, TURN_DEG};
use crate::scene::Transition;

/// Shape of a Lambertian closure other than the circle of its pipe. A transition between the two spreads the light of the pipe evenly over
/// the closure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ClosureShapeDocument {
    /// Shape of the closure.
    pub kind: ClosureShapeKind,
    /// Length of a side in metres, at least the diameter of the pipe; the opening must lie wholly in the ceiling.
    pub side_m: f64,
    /// Rotation of the sides in degrees, clockwise seen from outside; by default those of a level opening are parallel to the room's axes, and
    /// two of another one are level.
    #[serde(default)]
    #[schema(default = 0.0)]
    pub rotation_deg: f64,
    /// Fraction of the pipe's light that the transition passes to the closure; default: 1.
    #[serde(default = "all")]
    #[schema(default = 1.0)]
    pub transition_transmittance: f64,
}

/// Shape of a closure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClosureShapeKind {
    /// A square around the axis of the pipe.
    Square,
}

fn all() -> f64 {
    1.0
}

impl ClosureShapeDocument {
    /// Adds the faults of a shape at the tube's `pointer`, below a pipe of valid `diameter_m` if there is one.
    pub(super) fn check(
        &self,
        pointer: &str,
        diameter_m: Option<f64>,
        diffuser: &DiffuserDocument,
        checks: &mut Checks,
    ) {
        let Self { side_m, rotation_deg, transition_transmittance, .. } = *self;
        let side = format!("{pointer}/closure_shape/side_m");
        let is_good = checks.number(&side, side_m, DIAMETER_M);
        if let Some(diameter) = diameter_m.filter(|diameter| is_good && side_m < *diameter) {
            let detail = format!("must be >= {diameter}, the diameter of the pipe above the square, but is {side_m}");
            checks.refuse(side, detail);
        }
        checks.number(&format!("{pointer}/closure_shape/rotation_deg"), rotation_deg, TURN_DEG);
        let transmittance = format!("{pointer}/closure_shape/transition_transmittance");
        checks.number(&transmittance, transition_transmittance, RATIO);
        if !matches!(diffuser, DiffuserDocument::Lambertian(_)) {
            let detail = "must be `lambertian` with `closure_shape`, over which light is spread evenly";
            checks.refuse(format!("{pointer}/diffuser/kind"), detail);
        }
    }

    /// Returns the transition for the scene.
    pub fn transition(&self) -> Transition {
        Transition {
            side_m: self.side_m,
            azimuth: self.rotation_deg.to_radians(),
            transmittance: self.transition_transmittance,
        }
    }
}
