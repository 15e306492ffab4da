//! Points of a horizon, as documents give them.

use super::errors::Checks;
use super::limits::{HORIZON_ALTITUDE_DEG, HORIZON_POINTS, Range};
use crate::sky::Horizon;

/// Adds the faults of a horizon's points of azimuth and altitude in degrees: numbers out of bounds, and azimuths that do not ascend.
pub fn check_points(pointer: &str, points: &[[f64; 2]], azimuths: Range, checks: &mut Checks) {
    if points.is_empty() {
        checks.refuse(pointer, "must have at least one point, or be left out");
    }
    checks.at_most(pointer, points.len(), &HORIZON_POINTS, " points");
    let mut before = f64::NEG_INFINITY;
    for (index, [azimuth, altitude]) in points.iter().enumerate() {
        checks.number(&format!("{pointer}/{index}/0"), *azimuth, azimuths);
        checks.number(&format!("{pointer}/{index}/1"), *altitude, HORIZON_ALTITUDE_DEG);
        if *azimuth <= before {
            let detail = format!("must be above the azimuth before it, {before}, but is {azimuth}");
            checks.refuse(format!("{pointer}/{index}/0"), detail);
        }
        before = *azimuth;
    }
}

/// Returns the horizon of checked points in the frame of a room whose +y axis has the azimuth `rotation_deg`; azimuth 0 of the points is at
/// `zero_deg` from north. `None` if no part of it is above 0.
pub fn horizon(points: &[[f64; 2]], zero_deg: f64, rotation_deg: f64) -> Option<Horizon> {
    let point = |[azimuth, altitude]: &[f64; 2]| ((azimuth + zero_deg).to_radians(), altitude.to_radians());
    Horizon::new(points.iter().map(point).collect(), rotation_deg.to_radians())
}
