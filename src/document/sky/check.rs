//! Checks of location, time and sky.

use super::time::instant;
use super::{LocationDocument, SkyDocument};
use crate::document::errors::Checks;
use crate::document::limits::{
    ALTITUDE_DEG, CIE_TYPE, DIFFUSE_RATIO, ELEVATION_M, LATITUDE_DEG, LIGHT, LONGITUDE_DEG, TURBID_TYPES, TURBIDITY,
    TURN_DEG, YEAR,
};

/// Adds faults for a location that is not on Earth.
pub(crate) fn check_location(location: &LocationDocument, checks: &mut Checks) {
    checks.number("/location/latitude_deg", location.latitude_deg, LATITUDE_DEG);
    checks.number("/location/longitude_deg", location.longitude_deg, LONGITUDE_DEG);
    checks.number("/location/elevation_m", location.elevation_m, ELEVATION_M);
}

/// Adds a fault for a text that is not a time with an offset, or a year out of range.
pub(crate) fn check_time(time: &str, checks: &mut Checks) {
    match instant(time) {
        Err(detail) => checks.refuse("/time", detail),
        Ok(instant) => {
            checks.number("/time", instant.year, YEAR);
        }
    }
}

/// Adds faults for numbers out of their bounds, a missing or doubly given sky, and a level that is given twice or does not apply
/// to the sky.
pub(crate) fn check_sky(sky: &SkyDocument, checks: &mut Checks) {
    match (sky.cie_type, sky.preset, sky.perez) {
        (Some(cie_type), None, None) => {
            checks.number("/sky/cie_type", cie_type, CIE_TYPE);
        }
        (None, Some(_), None) => {}
        (None, None, Some(perez)) => perez.check("/sky/perez", checks),
        (None, None, None) => checks.refuse("/sky/cie_type", "required, unless `preset` or `perez` is given"),
        (Some(_), Some(_), _) => {
            checks.refuse("/sky/preset", "must be left out if `cie_type` is given: only one of them may name the sky")
        }
        (_, _, Some(_)) => {
            let detail = "must be left out if `cie_type` or `preset` is given: only one of them may name the sky";
            checks.refuse("/sky/perez", detail);
        }
    }
    if let Some(position) = &sky.sun_position {
        checks.number("/sky/sun_position/altitude_deg", position.altitude_deg, ALTITUDE_DEG);
        checks.number("/sky/sun_position/azimuth_deg", position.azimuth_deg, TURN_DEG);
    }
    check_level(sky, checks);
    if let Some(beam) = sky.direct_normal_illuminance_lux {
        checks.number("/sky/direct_normal_illuminance_lux", beam, LIGHT);
    }
}

/// Checks that at most one field sets the level, and that it applies to the sky.
fn check_level(sky: &SkyDocument, checks: &mut Checks) {
    let levels = [
        ("/sky/zenith_luminance_cd_m2", sky.zenith_luminance_cd_m2, LIGHT),
        ("/sky/diffuse_horizontal_illuminance_lux", sky.diffuse_horizontal_illuminance_lux, LIGHT),
        ("/sky/dv_ev", sky.dv_ev, DIFFUSE_RATIO),
        ("/sky/luminous_turbidity", sky.luminous_turbidity, TURBIDITY),
    ];
    let given = levels.iter().filter_map(|(pointer, level, range)| Some((*pointer, (*level)?, *range)));
    for (index, (pointer, level, range)) in given.enumerate() {
        if index > 0 {
            let detail = "only one of `zenith_luminance_cd_m2`, `diffuse_horizontal_illuminance_lux`, `dv_ev` and \
                          `luminous_turbidity` may set the sky's level";
            checks.refuse(pointer, detail);
        }
        checks.number(pointer, level, range);
    }
    let not_turbid = sky.cie_type.filter(|cie_type| !TURBID_TYPES.contains(cie_type));
    if let Some(cie_type) = not_turbid.filter(|_| sky.luminous_turbidity.is_some()) {
        let (least, most) = (TURBID_TYPES.start(), TURBID_TYPES.end());
        let detail = format!("allowed only for the CIE types {least}..{most}, but `cie_type` is {cie_type}");
        checks.refuse("/sky/luminous_turbidity", detail);
    }
    for (pointer, level) in [("/sky/dv_ev", sky.dv_ev), ("/sky/luminous_turbidity", sky.luminous_turbidity)] {
        if level.is_some() && (sky.preset.is_some() || sky.perez.is_some()) {
            checks.refuse(pointer, "allowed only with `cie_type`: other skies have their own level");
        }
    }
}
