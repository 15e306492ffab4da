//! Sky and sun of a document: position, absolute level, beam.

use std::str::FromStr;

use crate::document::errors::Checks;
use crate::document::job::JobDocument;
use crate::document::scene::{Provenance, RefractionProvenance, SunProvenance, ZenithProvenance};
use crate::document::sky::SkyDocument;
use crate::document::{FieldError, Warning};
use crate::scene::Daylight;
use crate::sky::sun::{self, UtcInstant};
use crate::sky::zenith::{self, EXTRATERRESTRIAL_LUX, ZenithFormula};
use crate::sky::{Sky, SkyDistribution, SkyType, Sun, direction};

/// Years for which the solar position algorithm holds.
pub fn year_range() -> (i32, i32) {
    (-2000, 6000)
}

/// A time of RFC 3339 with an offset as an instant in UTC; years outside 0..9999 have a sign and six digits.
///
/// A leap second counts as the second before it. The error says what is wrong.
pub fn instant(time: &str) -> Result<UtcInstant, String> {
    let shape = "must be RFC 3339 with an offset, such as 2011-09-15T15:00:00+02:00";
    match rfc_3339_shape(time) {
        Shape::Complete => {}
        Shape::NoOffset => {
            return Err(format!("{shape}: the offset is missing (Z or +hh:mm), without it {time:?} is ambiguous"));
        }
        Shape::Other => return Err(format!("{shape}, but is {time:?}")),
    }
    let timestamp = jiff::Timestamp::from_str(time).map_err(|error| format!("{shape}: {error}"))?;
    let civil = jiff::tz::Offset::UTC.to_datetime(timestamp);
    let field = |value: i8| u32::try_from(value).unwrap_or(0);
    Ok(UtcInstant {
        year: i32::from(civil.year()),
        month: field(civil.month()),
        day: field(civil.day()),
        hour: field(civil.hour()),
        minute: field(civil.minute()),
        second: f64::from(civil.second()) + 1e-9 * f64::from(civil.subsec_nanosecond()),
    })
}

enum Shape {
    Complete,
    NoOffset,
    Other,
}

/// The parser accepts more than RFC 3339 (time zone names, missing seconds): a document does not.
fn rfc_3339_shape(time: &str) -> Shape {
    let matches = |text: &str, pattern: &str| {
        text.len() == pattern.len()
            && text
                .bytes()
                .zip(pattern.bytes())
                .all(|(c, p)| if p == b'0' { c.is_ascii_digit() } else { c.eq_ignore_ascii_case(&p) })
    };
    let unsigned = match time.strip_prefix(['+', '-']) {
        // six digits of year: two go with the sign
        Some(rest) => match rest.split_at_checked(2) {
            Some((century, rest)) if century.bytes().all(|c| c.is_ascii_digit()) => rest,
            _ => return Shape::Other,
        },
        None => time,
    };
    let pattern = "0000-00-00T00:00:00";
    let Some((date_time, mut rest)) = unsigned.split_at_checked(pattern.len()) else {
        return Shape::Other;
    };
    if !matches(date_time, pattern) {
        return Shape::Other;
    }
    if let Some(fraction) = rest.strip_prefix('.') {
        rest = fraction.trim_start_matches(|c: char| c.is_ascii_digit());
        if rest.len() == fraction.len() {
            return Shape::Other;
        }
    }
    match rest {
        "" => Shape::NoOffset,
        "Z" | "z" => Shape::Complete,
        offset if matches(offset, "+00:00") || matches(offset, "-00:00") => Shape::Complete,
        _ => Shape::Other,
    }
}

/// Apparent position of the sun, radians, azimuth from true north.
struct Apparent {
    altitude: f64,
    azimuth: f64,
    refraction: RefractionProvenance,
}

fn sun_position(document: &JobDocument, sky: &SkyDocument) -> Result<Apparent, FieldError> {
    if let Some(position) = &sky.sun_position {
        return Ok(Apparent {
            altitude: position.altitude_deg.to_radians(),
            azimuth: position.azimuth_deg.to_radians(),
            refraction: RefractionProvenance::Given,
        });
    }
    let at = |pointer: &str, detail: String| FieldError { pointer: pointer.to_owned(), detail };
    let time = document.time.as_deref().ok_or_else(|| at("/time", "required, but missing".to_owned()))?;
    let location = document.location.ok_or_else(|| at("/location", "required, but missing".to_owned()))?;
    let instant = instant(time).map_err(|detail| at("/time", detail))?;
    let position = sun::position(instant, location.latitude_deg, location.longitude_deg, location.elevation_m)
        .map_err(|error| at("/time", error.to_string()))?;
    let airless_altitude_deg = position.airless_altitude.to_degrees();
    Ok(Apparent {
        altitude: position.altitude,
        azimuth: position.azimuth,
        refraction: RefractionProvenance::Applied { airless_altitude_deg },
    })
}

/// Sky and sun in the room frame, with what a reader must know of them; `None` without a sky, or after an error.
pub fn daylight(
    document: &JobDocument,
    checks: &mut Checks,
    warnings: &mut Vec<Warning>,
) -> Option<(Daylight, Provenance)> {
    let Some(sky) = &document.sky else {
        if document.location.is_some() || document.time.is_some() {
            let detail = "without `sky` there is no daylight: `location` and `time` change nothing".to_owned();
            warnings.push(Warning { code: "place_without_sky".to_owned(), detail });
        }
        return None;
    };
    let Some(sky_type) = sky.sky_type() else {
        checks.refuse("/sky/cie_type", "must be 1..16, or absent beside a `preset`");
        return None;
    };
    let apparent = match sun_position(document, sky) {
        Ok(apparent) => apparent,
        Err(FieldError { pointer, detail }) => {
            checks.refuse(pointer, detail);
            return None;
        }
    };
    let altitude = apparent.altitude;
    let toward_sun = direction(altitude, apparent.azimuth - document.room.rotation_deg.to_radians());
    let distribution = SkyDistribution::new(sky_type, toward_sun);
    let (formula, zenith_luminance_cd_m2) = level(sky, sky_type, &distribution, altitude);
    let (beam, source) = beam(sky, sky_type, altitude);

    let up = altitude > 0.0;
    let daylight = Daylight {
        sky: up.then_some(Sky { distribution, zenith_luminance_cd_m2 }),
        sun: (up && beam > 0.0).then_some(Sun { direction: toward_sun, normal_illuminance_lux: beam }),
        formula,
    };
    if up {
        warn_of_implausible(&daylight, altitude, warnings);
    } else {
        warnings.push(Warning {
            code: "sun_below_horizon".to_owned(),
            detail: format!(
                "the sun is at an altitude of {:.4} degrees: sky and sun give no light, {}",
                altitude.to_degrees(),
                if document.room.luminaires.is_empty() { "all results are zero" } else { "only luminaires do" }
            ),
        });
    }
    let (sky_lux, sun_lux) = daylight.horizontal_illuminance_lux();
    let (dv_ev, luminous_turbidity) = match formula {
        ZenithFormula::DiffuseRatio { dv_ev } => (Some(dv_ev), None),
        ZenithFormula::Turbidity { luminous_turbidity } => (None, Some(luminous_turbidity)),
        ZenithFormula::GivenZenithLuminance
        | ZenithFormula::GivenHorizontalIlluminance
        | ZenithFormula::IesHorizontalIlluminance => (None, None),
    };
    let provenance = Provenance {
        zenith: Some(ZenithProvenance {
            formula: formula.into(),
            dv_ev,
            luminous_turbidity,
            zenith_luminance_cd_m2: if up { zenith_luminance_cd_m2 } else { 0.0 },
            horizontal_illuminance_lux: sky_lux,
        }),
        sun: Some(SunProvenance {
            on: daylight.sun.is_some(),
            source,
            normal_illuminance_lux: daylight.sun.map_or(0.0, |sun| sun.normal_illuminance_lux),
            horizontal_illuminance_lux: sun_lux,
            altitude_deg: altitude.to_degrees(),
            azimuth_deg: apparent.azimuth.to_degrees().rem_euclid(360.0),
        }),
        refraction: Some(apparent.refraction),
        interreflection: true,
        guides: Vec::new(),
    };
    Some((daylight, provenance))
}

/// The formula of the absolute level and the zenith luminance in cd/m2 (docs/physics/sky_and_sun.md#absolute-level).
fn level(sky: &SkyDocument, sky_type: SkyType, distribution: &SkyDistribution, altitude: f64) -> (ZenithFormula, f64) {
    if let Some(luminance) = sky.zenith_luminance_cd_m2 {
        return (ZenithFormula::GivenZenithLuminance, luminance);
    }
    if let Some(illuminance) = sky.diffuse_horizontal_illuminance_lux {
        return (ZenithFormula::GivenHorizontalIlluminance, illuminance / distribution.horizontal_ratio());
    }
    let formula = match sky.dv_ev {
        Some(dv_ev) => ZenithFormula::DiffuseRatio { dv_ev },
        None => zenith::default_formula(sky_type, sky.luminous_turbidity),
    };
    (formula, zenith::zenith_luminance_cd_m2(distribution, formula, altitude))
}

/// Normal illuminance of the beam in lux and where it comes from (docs/physics/sky_and_sun.md#the-sun).
fn beam(sky: &SkyDocument, sky_type: SkyType, altitude: f64) -> (f64, crate::document::scene::BeamSource) {
    use crate::document::scene::BeamSource;
    if let Some(illuminance) = sky.direct_normal_illuminance_lux {
        return (illuminance, BeamSource::Given);
    }
    let cie_type = match sky_type {
        SkyType::Cie(cie_type) => cie_type,
        SkyType::Ies(sky) => {
            let source = sky.extinction().map_or(BeamSource::SunlessType, |extinction| BeamSource::Ies { extinction });
            return (sky.beam_normal_illuminance_lux(altitude), source);
        }
    };
    // type 9 is "obscured sun"
    if cie_type.is_sunless() || cie_type.number() == 9 {
        return (0.0, BeamSource::SunlessType);
    }
    let luminous_turbidity = sky.luminous_turbidity.unwrap_or_else(|| zenith::typical_turbidity(cie_type));
    (sun::beam_normal_illuminance_lux(altitude, luminous_turbidity), BeamSource::Turbidity { luminous_turbidity })
}

/// More light than arrives outside the atmosphere is possible to ask for, but hardly meant.
fn warn_of_implausible(daylight: &Daylight, altitude: f64, warnings: &mut Vec<Warning>) {
    let (diffuse, _) = daylight.horizontal_illuminance_lux();
    let mut warn = |detail| warnings.push(Warning { code: "implausible_illuminance".to_owned(), detail });
    let outside = EXTRATERRESTRIAL_LUX * altitude.sin();
    if diffuse > outside {
        warn(format!(
            "the sky gives {diffuse:.0} lx on the horizontal, more than the sun outside the atmosphere ({outside:.0} lx)"
        ));
    }
    let beam = daylight.sun.map_or(0.0, |sun| sun.normal_illuminance_lux);
    if beam > EXTRATERRESTRIAL_LUX {
        warn(format!(
            "the beam has {beam:.0} lx, more than the sun outside the atmosphere ({EXTRATERRESTRIAL_LUX:.0} lx)"
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_and_utc_are_the_same_instant() {
        let here = instant("2011-09-15T15:00:00+02:00").unwrap();
        assert_eq!(here, instant("2011-09-15T13:00:00Z").unwrap());
        assert_eq!((here.year, here.month, here.day, here.hour), (2011, 9, 15, 13));
    }

    #[test]
    fn refuses_what_is_not_an_instant() {
        assert!(instant("2011-09-15T15:00:00").unwrap_err().contains("offset is missing"));
        for time in [
            "",
            "2011-02-30T12:00:00Z",
            "2011-09-15",
            "2011-09-15T15:00:00[Europe/Copenhagen]",
            "2011-09-15T15:00:00+02:00[Europe/Copenhagen]",
            "2011-09-15T15:00+02:00",
            "2011-09-15T25:00:00Z",
            "2011-09-15T15:00:00.Z",
            "2011-09-15T15:00:00+25:99",
            "20110915T150000Z",
            "ää11-09-15T15:00:00Z",
            "+é011-09-15T15:00:00Z",
        ] {
            assert!(instant(time).is_err(), "{time:?}");
        }
        // refused or taken as the second before it, never a panic
        let _ = instant("2016-12-31T23:59:60Z");
    }

    #[test]
    fn years_of_six_digits() {
        assert_eq!(instant("-001999-06-01T12:00:00Z").unwrap().year, -1999);
        assert_eq!(instant("+006001-06-01T12:00:00Z").unwrap().year, 6001);
    }
}
