//! Predictions for measured tubes whose published values have not been read.

use super::levels;
use super::printed::{Kind, LAMP_TUBES, OVERCAST_TUBE};
use crate::page::Table;
use skyduct::guide::transmittance::{beam_transmission, sky_exitance};
use skyduct::sky::{CieType, Sky};

/// Altitudes of the parallel light in degrees.
const ALTITUDES_DEG: [f64; 7] = [20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0];

/// Predicts the diffuse transmission of a tube under an artificial sky.
pub fn overcast() -> Table {
    let tube = &OVERCAST_TUBE;
    let overcast = levels::sky(CieType::TRADITIONAL_OVERCAST, 45.0);
    let uniform = levels::sky(CieType::UNIFORM, 45.0);
    let aspect = tube.length_m / tube.diameters_m[0];
    let rows = tube.reflectances.iter().map(|&reflectance| {
        let of =
            |sky: &Sky| format!("{:.4}", sky_exitance(sky, aspect, reflectance) / sky.horizontal_illuminance_lux());
        vec![Kind::Prediction.label(), reflectance.to_string(), of(&overcast), of(&uniform)]
    });
    Table {
        caption: format!(
            "Transmission of a tube of {} x {} m by its mirror ({})",
            tube.diameters_m[0], tube.length_m, tube.source
        ),
        head: ["kind of source", "mirror", "traditional overcast sky", "uniform sky"].map(str::to_owned).into(),
        rows: rows.collect(),
    }
}

/// Predicts the transmission of parallel light by its altitude.
pub fn beams() -> Table {
    let mut rows = Vec::new();
    for tube in &LAMP_TUBES {
        for &diameter_m in tube.diameters_m {
            for &reflectance in tube.reflectances {
                let of = |altitude_deg: f64| {
                    let tangent = libm::tan((90.0 - altitude_deg).to_radians());
                    format!("{:.4}", beam_transmission(tube.length_m / diameter_m, tangent, reflectance))
                };
                let tube =
                    [tube.source.to_owned(), format!("{diameter_m} x {} m", tube.length_m), reflectance.to_string()];
                rows.push([Kind::Prediction.label()].into_iter().chain(tube).chain(ALTITUDES_DEG.map(of)).collect());
            }
        }
    }
    let head = ["kind of source", "measured by", "tube", "mirror"].map(str::to_owned).into_iter();
    Table {
        caption: "Transmission for parallel light by its altitude in degrees".to_owned(),
        head: head.chain(ALTITUDES_DEG.map(|altitude_deg| altitude_deg.to_string())).collect(),
        rows,
    }
}
