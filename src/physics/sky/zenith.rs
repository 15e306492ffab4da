//! Absolute zenith luminance of the CIE general skies (Kittler, Perez and Darula 1998; Darula and Kittler 2002). Checks of the table, and
//! the level above 75 degrees: docs/physics/sky_and_sun.md#absolute-level.

use super::SkyType;
use super::cie::{CieType, SkyDistribution};
use crate::sky::direction;

/// Extraterrestrial normal illuminance in lux, the value contained in the coefficients B and E.
pub const EXTRATERRESTRIAL_LUX: f64 = 133_800.0;

/// Solar altitude in degrees above which the published fits diverge (by 1/cos^D): above it the horizontal illuminance follows the sine of
/// the altitude.
const LAST_FITTED_ALTITUDE_DEG: f64 = 75.0;

struct ZenithRow {
    a1: f64,
    a2: f64,
    b: f64,
    c: f64,
    d: f64,
    e: f64,
    typical_dv_ev: f64,
    typical_turbidity: f64,
}

const fn row(values: [f64; 8]) -> ZenithRow {
    let [a1, a2, b, c, d, e, typical_dv_ev, typical_turbidity] = values;
    ZenithRow { a1, a2, b, c, d, e, typical_dv_ev, typical_turbidity }
}

/// Types 1 to 15: A1, A2 (types 7 to 15), B, C, D, E, typical Dv/Ev, typical luminous turbidity.
const ROWS: [ZenithRow; 15] = [
    row([0.0, 0.0, 54.63, 1.00, 0.00, 0.00, 0.10, 45.0]),
    row([0.0, 0.0, 12.35, 3.68, 0.59, 50.47, 0.18, 20.0]),
    row([0.0, 0.0, 48.30, 1.00, 0.00, 0.00, 0.15, 45.0]),
    row([0.0, 0.0, 12.23, 3.57, 0.57, 44.27, 0.22, 20.0]),
    row([0.0, 0.0, 42.59, 1.00, 0.00, 0.00, 0.20, 45.0]),
    row([0.0, 0.0, 11.84, 3.53, 0.55, 38.78, 0.38, 20.0]),
    row([0.957, 1.790, 21.72, 4.52, 0.64, 34.56, 0.42, 12.0]),
    row([0.830, 2.030, 29.35, 4.94, 0.70, 30.41, 0.41, 10.0]),
    row([0.600, 1.500, 10.34, 3.45, 0.50, 27.47, 0.40, 12.0]),
    row([0.567, 2.610, 18.41, 4.27, 0.63, 24.04, 0.36, 10.0]),
    row([1.440, -0.750, 24.41, 4.60, 0.72, 20.76, 0.23, 4.0]),
    row([1.036, 0.710, 23.00, 4.43, 0.74, 18.52, 0.10, 2.5]),
    row([1.244, -0.840, 27.45, 4.61, 0.76, 16.59, 0.28, 4.5]),
    row([0.881, 0.453, 25.54, 4.40, 0.79, 14.56, 0.28, 5.0]),
    row([0.418, 1.950, 28.08, 4.13, 0.79, 13.00, 0.30, 4.0]),
];

/// Formula by which the absolute level of a sky was found; part of every result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ZenithFormula {
    /// The zenith luminance was given.
    GivenZenithLuminance,
    /// The diffuse horizontal illuminance was given.
    GivenHorizontalIlluminance,
    /// Lz = (Dv/Ev) Ev / I, with the given ratio and Ev = 133.8 klx sin g: the sky's horizontal illuminance over Ev is exactly this ratio.
    GivenDiffuseRatio {
        /// Diffuse over extraterrestrial horizontal illuminance, > 0.
        dv_ev: f64,
    },
    /// Lz = (Dv/Ev) (B sin^C g / cos^D g + E sin g), with the typical Dv/Ev of a CIE type. This fit keeps the ratio of the
    /// horizontal illuminances within 4 % from 5 to 75 degrees.
    TypicalDiffuseRatio {
        /// Diffuse over extraterrestrial horizontal illuminance, > 0.
        dv_ev: f64,
    },
    /// Lz = A sin g + 0.7 (Tv + 1) sin^C g / cos^D g + 0.04 Tv, A = A1 Tv + A2, types 7 to 15, Tv <= 12.
    Turbidity {
        /// Luminous turbidity Tv, without unit: 1 is air that only its molecules dim.
        luminous_turbidity: f64,
    },
    /// Lz = D / I with the diffuse horizontal illuminance D of an IES sky.
    IesHorizontalIlluminance,
    /// Lz = D / I with the diffuse horizontal illuminance D that follows from an irradiance ([`super::PerezSky`]).
    LuminousEfficacy,
}

/// Returns the type's typical luminous turbidity; the traditional overcast sky has that of type 1.
pub fn typical_turbidity(cie_type: CieType) -> f64 {
    table(cie_type).typical_turbidity
}

/// Returns the formula used when the document gives no level: the typical Dv/Ev for types 1 to 6 and 16, the turbidity form for 7 to 15,
/// the diffuse illuminance of the IES for its skies, the luminous efficacy for skies of free parameters. The first two are not equivalent: at their typical values they differ by a factor of
/// 1.7 for type 12 at 35 degrees.
pub fn default_formula(sky_type: impl Into<SkyType>, luminous_turbidity: Option<f64>) -> ZenithFormula {
    let cie_type = match sky_type.into() {
        SkyType::Cie(cie_type) => cie_type,
        SkyType::Ies(_) => return ZenithFormula::IesHorizontalIlluminance,
        SkyType::Free(_) => return ZenithFormula::LuminousEfficacy,
    };
    if cie_type.is_sunless() {
        ZenithFormula::TypicalDiffuseRatio { dv_ev: table(cie_type).typical_dv_ev }
    } else {
        let luminous_turbidity = luminous_turbidity.unwrap_or_else(|| typical_turbidity(cie_type));
        ZenithFormula::Turbidity { luminous_turbidity }
    }
}

/// Computes the zenith luminance in cd/m2 by a ratio, `Turbidity` or `IesHorizontalIlluminance` at a solar altitude in radians (0 <
/// altitude <= pi/2).
///
/// Above 75 degrees the published fits diverge: there the horizontal illuminance continues as
/// D(75 deg) sin g / sin 75 deg and Lz = D / I, which is continuous and finite. Zero for a sun at or below the horizon, for a
/// given luminance, illuminance or irradiance, which sets the level itself, and for a formula that does not apply to the sky's type.
///
/// Under the uniform sky D = pi Lz is the given fraction of the 133.8 klx sin g from outside the atmosphere:
///
/// ```
/// use skyduct_physics::sky::zenith::{EXTRATERRESTRIAL_LUX, ZenithFormula, zenith_luminance_cd_m2};
/// use skyduct_physics::sky::{CieType, SkyDistribution, direction};
///
/// let altitude = 30f64.to_radians();
/// let sky = SkyDistribution::new(CieType::UNIFORM, direction(altitude, 0.0));
/// let zenith = zenith_luminance_cd_m2(&sky, ZenithFormula::GivenDiffuseRatio { dv_ev: 0.2 }, altitude);
/// let horizontal = std::f64::consts::PI * zenith;
/// assert!((horizontal / (0.2 * EXTRATERRESTRIAL_LUX * 0.5) - 1.0).abs() < 1e-12);
/// ```
pub fn zenith_luminance_cd_m2(distribution: &SkyDistribution, formula: ZenithFormula, altitude: f64) -> f64 {
    if altitude <= 0.0 {
        return 0.0;
    }
    let cie_type = match distribution.sky_type() {
        SkyType::Cie(cie_type) => cie_type,
        SkyType::Ies(sky) if formula == ZenithFormula::IesHorizontalIlluminance => {
            return sky.diffuse_horizontal_illuminance_lux(altitude) / distribution.horizontal_ratio();
        }
        SkyType::Ies(_) | SkyType::Free(_) => return 0.0,
    };
    if let ZenithFormula::GivenDiffuseRatio { dv_ev } = formula {
        return dv_ev * EXTRATERRESTRIAL_LUX * libm::sin(altitude) / distribution.horizontal_ratio();
    }
    let joint = LAST_FITTED_ALTITUDE_DEG.to_radians();
    if altitude <= joint {
        return fitted(cie_type, formula, altitude, distribution);
    }
    let sun = distribution.sun();
    let at_joint = SkyDistribution::new(cie_type, direction(joint, libm::atan2(sun.x, sun.y)));
    let horizontal_lux = fitted(cie_type, formula, joint, &at_joint) * at_joint.horizontal_ratio();
    horizontal_lux * libm::sin(altitude) / libm::sin(joint) / distribution.horizontal_ratio()
}

fn fitted(cie_type: CieType, formula: ZenithFormula, altitude: f64, distribution: &SkyDistribution) -> f64 {
    let row = table(cie_type);
    let (sin, cos) = libm::sincos(altitude);
    let power = libm::pow(sin, row.c) / libm::pow(cos, row.d);
    let thousand_cd_m2 = match formula {
        ZenithFormula::TypicalDiffuseRatio { dv_ev } if cie_type == CieType::TRADITIONAL_OVERCAST => {
            // no published fit: the same diffuse illuminance ratio as type 1, through this sky's own D/Lz
            dv_ev * EXTRATERRESTRIAL_LUX * 1e-3 * sin / distribution.horizontal_ratio()
        }
        ZenithFormula::TypicalDiffuseRatio { dv_ev } => dv_ev * (row.b * power + row.e * sin),
        ZenithFormula::Turbidity { luminous_turbidity } => {
            let a = row.a1 * luminous_turbidity + row.a2;
            a * sin + 0.7 * (luminous_turbidity + 1.0) * power + 0.04 * luminous_turbidity
        }
        ZenithFormula::GivenZenithLuminance
        | ZenithFormula::GivenHorizontalIlluminance
        | ZenithFormula::GivenDiffuseRatio { .. }
        | ZenithFormula::IesHorizontalIlluminance
        | ZenithFormula::LuminousEfficacy => 0.0,
    };
    1000.0 * thousand_cd_m2
}

fn table(cie_type: CieType) -> &'static ZenithRow {
    ROWS.get(usize::from(cie_type.number()) - 1).unwrap_or(&ROWS[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A at the typical turbidity, which is printed beside A1 and A2, is a checksum of both.
    #[test]
    fn turbidity_coefficients_match_their_checksum() {
        let printed = [13.27, 10.33, 8.70, 8.28, 5.01, 3.30, 4.76, 4.86, 3.62];
        for (row, printed) in ROWS[6..].iter().zip(printed) {
            assert!((row.a1 * row.typical_turbidity + row.a2 - printed).abs() < 0.0051);
        }
    }

    /// The sky's horizontal illuminance over that from outside the atmosphere is the given ratio, of every type at every
    /// altitude; the fit of Kittler and Darula would be 2 % off for type 11 at 3 degrees.
    #[test]
    fn a_given_ratio_is_that_of_the_horizontal_illuminances() {
        for number in 1..=16 {
            for altitude_deg in [0.5f64, 3.0, 40.0, 75.0, 85.0, 90.0] {
                let altitude = altitude_deg.to_radians();
                let distribution = SkyDistribution::new(CieType::new(number).unwrap(), direction(altitude, 1.0));
                let formula = ZenithFormula::GivenDiffuseRatio { dv_ev: 0.3 };
                let horizontal =
                    zenith_luminance_cd_m2(&distribution, formula, altitude) * distribution.horizontal_ratio();
                let ratio = horizontal / (EXTRATERRESTRIAL_LUX * altitude.sin());
                assert!((ratio / 0.3 - 1.0).abs() < 1e-12, "type {number} at {altitude_deg}: {ratio}");
            }
        }
    }

    #[test]
    fn continuous_at_the_joint() {
        for number in 1..=16 {
            let cie_type = CieType::new(number).unwrap();
            let at = |altitude_deg: f64| {
                let altitude = altitude_deg.to_radians();
                let distribution = SkyDistribution::new(cie_type, direction(altitude, 1.0));
                zenith_luminance_cd_m2(&distribution, default_formula(cie_type, None), altitude)
            };
            let (below, above) = (at(75.0 - 1e-7), at(75.0 + 1e-7));
            assert!((above / below - 1.0).abs() < 1e-6, "type {number}: {below} {above}");
            assert!(at(90.0).is_finite() && at(1e-9).is_finite());
        }
    }
}
