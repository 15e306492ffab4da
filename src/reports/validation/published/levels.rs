//! Default levels of sky and sun, against averages of measured skies.

use super::printed::{Kind, Light};
use crate::page::Table;
use skyduct::sky::sun::beam_normal_illuminance_lux;
use skyduct::sky::zenith::{default_formula, typical_turbidity, zenith_luminance_cd_m2};
use skyduct::sky::{CieType, IesSky, Sky, SkyDistribution, direction};

/// Altitudes of the sun in degrees.
const ALTITUDES_DEG: [f64; 6] = [10.0, 20.0, 35.0, 50.0, 60.0, 70.0];

/// Returns the sky of a type at its default level, with the sun due south.
pub fn sky(cie_type: CieType, altitude_deg: f64) -> Sky {
    let altitude = altitude_deg.to_radians();
    let distribution = SkyDistribution::new(cie_type, direction(altitude, std::f64::consts::PI));
    let formula = default_formula(cie_type, None);
    let zenith_luminance_cd_m2 = zenith_luminance_cd_m2(&distribution, formula, altitude);
    Sky::new(distribution, zenith_luminance_cd_m2)
}

/// Returns the normal illuminance in lux of the sun's beam that goes with [`sky`]; 0 for sunless types.
pub fn beam_lux(cie_type: CieType, altitude_deg: f64) -> f64 {
    if cie_type.is_sunless() {
        return 0.0;
    }
    beam_normal_illuminance_lux(altitude_deg.to_radians(), typical_turbidity(cie_type))
}

/// Returns the sky types that bound a maker's sky, the darker first, and the altitude of the sun in degrees.
pub fn types(light: Light) -> ([CieType; 2], f64) {
    match light {
        Light::Clear(altitude_deg) => ([CIE_CLEAR; 2], altitude_deg),
        Light::Overcast(altitude_deg) => ([CIE_OVERCAST, CIE_LIGHTER_OVERCAST], altitude_deg),
    }
}

const CIE_OVERCAST: CieType = cie(1);
const CIE_LIGHTER_OVERCAST: CieType = cie(3);
const CIE_CLEAR: CieType = cie(12);

const fn cie(number: u8) -> CieType {
    match CieType::new(number) {
        Some(cie_type) => cie_type,
        None => CieType::UNIFORM,
    }
}

/// Tabulates illuminances of the default levels beside those of the IES formulae, with the deviations.
pub fn table() -> Table {
    let rows = ALTITUDES_DEG.iter().flat_map(|&altitude_deg| {
        let altitude = altitude_deg.to_radians();
        let level = |number: CieType| sky(number, altitude_deg).horizontal_illuminance_lux();
        let beam = beam_lux(CIE_CLEAR, altitude_deg);
        let ies_beam = IesSky::Clear.beam_normal_illuminance_lux(altitude);
        let [ies_clear, ies_overcast] =
            [IesSky::Clear, IesSky::Overcast].map(|sky| sky.diffuse_horizontal_illuminance_lux(altitude));
        let clear = level(CIE_CLEAR);
        let sin = libm::sin(altitude);
        [
            ("beam, normal", ies_beam, beam),
            ("clear sky, type 12", ies_clear, clear),
            ("clear sky and sun", ies_clear + ies_beam * sin, clear + beam * sin),
            ("overcast, type 1", ies_overcast, level(CIE_OVERCAST)),
            ("overcast, type 16", ies_overcast, level(CieType::TRADITIONAL_OVERCAST)),
            ("overcast, type 3", ies_overcast, level(CIE_LIGHTER_OVERCAST)),
        ]
        .map(|(name, theirs, ours)| {
            vec![
                Kind::Fit.label(),
                altitude_deg.to_string(),
                name.to_owned(),
                format!("{theirs:.0}"),
                format!("{ours:.0}"),
                format!("{:+.1} %", 100.0 * (ours / theirs - 1.0)),
            ]
        })
    });
    Table {
        caption: "Illuminances in lx of the default levels by the altitude of the sun in degrees, beside the averages of \
                  measured skies (IES 1984: beam 127.5 exp(-0.21 / sin h), clear 0.8 + 15.5 sqrt(sin h), overcast 0.3 + 21 \
                  sin h klx)"
            .to_owned(),
        head: ["kind of source", "sun", "quantity", "IES", "this program", "deviation"].map(str::to_owned).into(),
        rows: rows.collect(),
    }
}
