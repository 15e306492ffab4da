//! Sky and sun of a document: position of the sun, absolute level of the sky, and beam.

use std::f64::consts::FRAC_PI_2;
use std::ops::RangeInclusive;

use super::time::instant;
use super::{LocationDocument, SkyDocument};
use crate::document::errors::{Checks, FieldError, Warning, WarningCode};
use crate::document::provenance::{BeamSource, RefractionProvenance, SunProvenance, ZenithProvenance};
use crate::scene::Daylight;
use crate::sky::sun;
use crate::sky::zenith::{self, EXTRATERRESTRIAL_LUX, ZenithFormula};
use crate::sky::{IesSky, PerezSky, Sky, SkyDistribution, SkyType, Sun, direction};

/// Ratios of an overcast sky's level to the mean of measured overcast skies for which no warning is given: a third up or down.
const NEAR_THE_MEAN: RangeInclusive<f64> = 3.0 / 4.0..=4.0 / 3.0;

/// Properties of a document, other than the sky's own fields, that sky and sun depend on.
#[derive(Clone, Copy)]
pub struct Circumstances<'a> {
    /// Location on Earth; `None` if the document gives the sun's position.
    pub location: Option<&'a LocationDocument>,
    /// Time in RFC 3339; given together with the location.
    pub time: Option<&'a str>,
    /// Azimuth of the room's +y axis in degrees, clockwise from north.
    pub rotation_deg: f64,
    /// Number of luminaires, which give light even at night.
    pub luminaires: usize,
}

/// Sky and sun of a document, with their provenance.
pub struct Explained {
    /// Sky and sun in the room frame.
    pub daylight: Daylight,
    /// Provenance of the sky's absolute level.
    pub zenith: ZenithProvenance,
    /// Provenance of the sun's position and illuminance.
    pub sun: SunProvenance,
    /// Provenance of the refraction of the solar altitude.
    pub refraction: RefractionProvenance,
}

/// Apparent position of the sun in radians, with the azimuth clockwise from true north: the zenith where it is not needed.
struct Apparent {
    altitude: f64,
    azimuth: f64,
    refraction: RefractionProvenance,
}

fn sun_position(sky: &SkyDocument, around: Circumstances) -> Result<Apparent, FieldError> {
    if let Some(position) = &sky.sun_position {
        return Ok(Apparent {
            altitude: position.altitude_deg.to_radians(),
            azimuth: position.azimuth_deg.to_radians(),
            refraction: RefractionProvenance::Given,
        });
    }
    if !sky.needs_sun() && (around.time.is_none() || around.location.is_none()) {
        return Ok(Apparent { altitude: FRAC_PI_2, azimuth: 0.0, refraction: RefractionProvenance::NotNeeded });
    }
    let time = around.time.ok_or_else(|| FieldError::missing("/time"))?;
    let location = around.location.ok_or_else(|| FieldError::missing("/location"))?;
    let instant = instant(time).map_err(|detail| FieldError::new("/time", detail))?;
    let position = sun::position(instant, location.latitude_deg, location.longitude_deg, location.elevation_m)
        .map_err(|error| FieldError::new("/time", error.to_string()))?;
    let airless_altitude_deg = position.airless_altitude.to_degrees();
    Ok(Apparent {
        altitude: position.altitude,
        azimuth: position.azimuth,
        refraction: RefractionProvenance::Applied { airless_altitude_deg },
    })
}

/// Returns sky and sun in the room frame, with their provenance, and adds warnings about them; `None` after an error.
pub(crate) fn daylight(
    sky: &SkyDocument,
    around: Circumstances,
    checks: &mut Checks,
    warnings: &mut Vec<Warning>,
) -> Option<Explained> {
    let apparent = match sun_position(sky, around) {
        Ok(apparent) => apparent,
        Err(error) => {
            checks.errors.push(error);
            return None;
        }
    };
    let altitude = apparent.altitude;
    let toward_sun = direction(altitude, apparent.azimuth - around.rotation_deg.to_radians());
    let Some(sky_type) = sky.sky_type(toward_sun, around.time) else {
        checks.refuse("/sky/cie_type", "must be within 1..16, or left out if `preset` or `perez` is given");
        return None;
    };
    let perez = sky.perez.map(|perez| perez.state(toward_sun, around.time));
    let distribution = SkyDistribution::new(sky_type, toward_sun);
    let (formula, zenith_luminance_cd_m2) = level(sky, perez.as_ref(), &distribution, altitude);
    let (beam, source) = beam(sky, perez.as_ref(), sky_type, altitude);

    let up = altitude > 0.0;
    let daylight = Daylight {
        sky: up.then_some(Sky::new(distribution, zenith_luminance_cd_m2)),
        sun: (up && beam > 0.0).then_some(Sun { direction: toward_sun, normal_illuminance_lux: beam }),
        formula,
    };
    if up {
        warn_of_implausible(&daylight, altitude, warnings);
    } else {
        warnings.push(Warning {
            code: WarningCode::SunBelowHorizon,
            detail: format!(
                "the sun is at an altitude of {:.4} degrees: sky and sun give no light, {}",
                altitude.to_degrees(),
                if around.luminaires == 0 { "all results are zero" } else { "only luminaires do" }
            ),
        });
    }
    let (sky_lux, sun_lux) = daylight.horizontal_illuminance_lux();
    let overcast = up.then(|| typical_overcast(sky_type, formula, sky_lux, altitude)).flatten();
    if let Some(overcast) = &overcast {
        overcast.warn(sky_type, warnings);
    }
    let (dv_ev, luminous_turbidity) = match formula {
        ZenithFormula::GivenDiffuseRatio { dv_ev } | ZenithFormula::TypicalDiffuseRatio { dv_ev } => {
            (Some(dv_ev), None)
        }
        ZenithFormula::Turbidity { luminous_turbidity } => (None, Some(luminous_turbidity)),
        ZenithFormula::GivenZenithLuminance
        | ZenithFormula::GivenHorizontalIlluminance
        | ZenithFormula::IesHorizontalIlluminance
        | ZenithFormula::LuminousEfficacy => (None, None),
    };
    let has_position = apparent.refraction != RefractionProvenance::NotNeeded;
    Some(Explained {
        zenith: ZenithProvenance {
            formula: formula.into(),
            dv_ev,
            luminous_turbidity,
            clearness: perez.map(|perez| perez.clearness),
            brightness: perez.map(|perez| perez.brightness),
            zenith_luminance_cd_m2: if up { zenith_luminance_cd_m2 } else { 0.0 },
            horizontal_illuminance_lux: sky_lux,
            ratio_to_mean_overcast: overcast.map(|overcast| overcast.ratio()),
        },
        sun: SunProvenance {
            on: daylight.sun.is_some(),
            source,
            normal_illuminance_lux: daylight.sun.map_or(0.0, |sun| sun.normal_illuminance_lux),
            horizontal_illuminance_lux: sun_lux,
            altitude_deg: has_position.then(|| altitude.to_degrees()),
            azimuth_deg: has_position.then(|| apparent.azimuth.to_degrees().rem_euclid(360.0)),
        },
        refraction: apparent.refraction,
        daylight,
    })
}

/// Returns the formula of the absolute level, and the zenith luminance in cd/m2 (docs/physics/sky_and_sun.md#absolute-level).
fn level(
    sky: &SkyDocument,
    perez: Option<&PerezSky>,
    distribution: &SkyDistribution,
    altitude: f64,
) -> (ZenithFormula, f64) {
    if let Some(luminance) = sky.zenith_luminance_cd_m2 {
        return (ZenithFormula::GivenZenithLuminance, luminance);
    }
    if let Some(illuminance) = sky.diffuse_horizontal_illuminance_lux {
        return (ZenithFormula::GivenHorizontalIlluminance, illuminance / distribution.horizontal_ratio());
    }
    if let Some(perez) = perez {
        let level = perez.diffuse_horizontal_illuminance_lux() / distribution.horizontal_ratio();
        return (ZenithFormula::LuminousEfficacy, level);
    }
    let formula = match sky.dv_ev {
        Some(dv_ev) => ZenithFormula::GivenDiffuseRatio { dv_ev },
        None => zenith::default_formula(distribution.sky_type(), sky.luminous_turbidity),
    };
    (formula, zenith::zenith_luminance_cd_m2(distribution, formula, altitude))
}

/// Returns the normal illuminance of the beam in lux, and its source (docs/physics/sky_and_sun.md#the-sun).
fn beam(sky: &SkyDocument, perez: Option<&PerezSky>, sky_type: SkyType, altitude: f64) -> (f64, BeamSource) {
    if let Some(illuminance) = sky.direct_normal_illuminance_lux {
        return (illuminance, BeamSource::Given);
    }
    let cie_type = match sky_type {
        SkyType::Cie(cie_type) => cie_type,
        SkyType::Ies(sky) => {
            let source = sky.extinction().map_or(BeamSource::SunlessType, |extinction| BeamSource::Ies { extinction });
            return (sky.beam_normal_illuminance_lux(altitude), source);
        }
        SkyType::Free(_) => {
            let illuminance = perez.map_or(0.0, PerezSky::direct_normal_illuminance_lux);
            return (illuminance, BeamSource::LuminousEfficacy);
        }
    };
    // type 9 is "obscured sun"
    if cie_type.is_sunless() || cie_type.number() == 9 {
        return (0.0, BeamSource::SunlessType);
    }
    let luminous_turbidity = sky.luminous_turbidity.unwrap_or_else(|| zenith::typical_turbidity(cie_type));
    (sun::beam_normal_illuminance_lux(altitude, luminous_turbidity), BeamSource::Turbidity { luminous_turbidity })
}

/// Level of an overcast sky that is typical of its type, beside the mean of measured overcast skies.
struct TypicalOvercast {
    dv_ev: f64,
    /// Unobstructed horizontal illuminance of this sky in lux; `mean_lux` is that of measured overcast skies.
    lux: f64,
    mean_lux: f64,
}

/// Returns the level of an overcast sky if it follows from its type alone; `altitude` is that of the sun in radians, above 0.
fn typical_overcast(sky_type: SkyType, formula: ZenithFormula, lux: f64, altitude: f64) -> Option<TypicalOvercast> {
    match (sky_type, formula) {
        (SkyType::Cie(cie_type), ZenithFormula::TypicalDiffuseRatio { dv_ev }) if cie_type.is_overcast() => {
            Some(TypicalOvercast {
                dv_ev,
                lux,
                mean_lux: IesSky::Overcast.diffuse_horizontal_illuminance_lux(altitude),
            })
        }
        _ => None,
    }
}

impl TypicalOvercast {
    fn ratio(&self) -> f64 {
        self.lux / self.mean_lux
    }

    /// Adds a warning if the level, though right for its type, is far from the mean, which most people expect of "an overcast
    /// day".
    fn warn(&self, sky_type: SkyType, warnings: &mut Vec<Warning>) {
        if NEAR_THE_MEAN.contains(&self.ratio()) {
            return;
        }
        let detail = format!(
            "the sky's level is the typical one of {sky_type}, Dv/Ev = {}: {:.0} lx on the horizontal, {:.2} times the \
             mean of measured overcast skies ({:.0} lx at this solar altitude, IES 1984); all illuminances are \
             proportional to it, daylight factors do not depend on it; set another level with \
             `diffuse_horizontal_illuminance_lux` or `dv_ev`, or use the mean with the preset `ies_overcast`",
            self.dv_ev,
            self.lux,
            self.ratio(),
            self.mean_lux,
        );
        warnings.push(Warning { code: WarningCode::TypicalOvercastLevel, detail });
    }
}

/// Adds warnings for a sky or a beam that is brighter than the sun outside the atmosphere.
fn warn_of_implausible(daylight: &Daylight, altitude: f64, warnings: &mut Vec<Warning>) {
    let (diffuse, _) = daylight.horizontal_illuminance_lux();
    let mut warn = |detail| warnings.push(Warning { code: WarningCode::ImplausibleIlluminance, detail });
    let outside = EXTRATERRESTRIAL_LUX * libm::sin(altitude);
    if diffuse > outside {
        warn(format!(
            "the sky gives {diffuse:.0} lx on the horizontal, more than the sun outside the atmosphere ({outside:.0} lx)"
        ));
    }
    let beam = daylight.sun.map_or(0.0, |sun| sun.normal_illuminance_lux);
    if beam > EXTRATERRESTRIAL_LUX {
        warn(format!(
            "the sun's beam has a normal illuminance of {beam:.0} lx, more than the sun outside the atmosphere \
             ({EXTRATERRESTRIAL_LUX:.0} lx)"
        ));
    }
}
