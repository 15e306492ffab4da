//! Comparison with EnergyPlus' tube code: beam transmittances and daylight factors.

use std::path::Path;

use serde_json::json;

use super::super::deviations::Deviations;
use super::super::error::ValidationError;
use super::printed::{ENERGYPLUS_BEAMS, ENERGYPLUS_DIFFUSE_TRANSMITTANCE, ENERGYPLUS_ROOMS, Kind};
use crate::page::{Table, with_standard_error};
use crate::run::render;
use skyduct::guide::transmittance::beam_transmission;

/// Compares ratios of the beam transmittances of two tubes that differ in mirror or length alone.
pub fn beams() -> (Deviations, Table) {
    let mut deviations = Deviations::new("beam transmittance of two tubes, their ratio, against EnergyPlus");
    let rows = ENERGYPLUS_BEAMS.map(|(altitude_deg, upper, lower, theirs)| {
        let tangent = libm::tan((90.0 - altitude_deg).to_radians());
        let of = |(aspect, reflectance)| beam_transmission(aspect, tangent, reflectance);
        let ours = of(upper) / of(lower);
        let percent = 100.0 * (ours / theirs - 1.0);
        deviations.add(percent);
        let tube = |(aspect, reflectance): (f64, f64)| format!("{aspect:.3}, {reflectance}");
        vec![
            Kind::Program.label(),
            format!("{altitude_deg:.1}"),
            tube(upper),
            tube(lower),
            format!("{theirs:.5}"),
            format!("{ours:.5}"),
            format!("{percent:+.2} %"),
        ]
    });
    let table = Table {
        caption: "Ratios of beam transmittances by the altitude of the sun in degrees (EnergyPlus 25.2; its table is \
                  interpolated in the cosine)"
            .to_owned(),
        head: ["kind of source", "sun", "tube: L/D, R", "over tube: L/D, R", "EnergyPlus", "this program", "deviation"]
            .map(str::to_owned)
            .into(),
        rows: rows.into(),
    };
    (deviations, table)
}

/// Compares the daylight factor over the diffuse transmittance of the tube, in a black room and in reflecting ones.
pub fn rooms(reference: &Path) -> Result<([Deviations; 2], Table), ValidationError> {
    let mut black = Deviations::new("daylight factor over transmittance in a black room, against EnergyPlus");
    let mut reflecting = Deviations::new("the same in rooms of reflectance 0.2 to 0.8, against EnergyPlus");
    let mut rows = Vec::new();
    for (reflectance, daylight_factor) in ENERGYPLUS_ROOMS {
        let theirs = daylight_factor / ENERGYPLUS_DIFFUSE_TRANSMITTANCE;
        for method in ["holigilm", "light_tracing"] {
            let surface = json!({ "reflectance": reflectance });
            let document = json!({
                "sky": {
                    "cie_type": 16,
                    "sun_position": { "altitude_deg": 45, "azimuth_deg": 180 },
                    "diffuse_horizontal_illuminance_lux": 10_000,
                },
                "room": {
                    "size_m": [4, 4, 3],
                    "surfaces": { "floor": surface, "walls": surface, "ceiling": surface },
                },
                "tubes": [{
                    "centre_m": [2, 2], "diameter_m": DIAMETER_M, "reflectance": 0.95,
                    "segments": [{ "length_m": 1.4 }],
                    "collector": { "kind": "open" },
                    "diffuser": { "kind": "lambertian", "transmittance": 1.0 },
                }],
                "grids": [{ "name": "floor", "height_m": 0, "cells": [1, 1] }],
                "method": method,
                "stop": { "relative_error": 0.002, "max_seconds": 60 },
            });
            let (_, estimate) = render(&document, reference)?;
            // the flux through the opening over its area is the outdoor illuminance times the transmittance of the tube
            let area = 0.25 * std::f64::consts::PI * DIAMETER_M * DIAMETER_M;
            let per_lux = 100.0 * area / estimate.tubes[0].into_room.mean;
            let (ours, error) =
                (per_lux * estimate.grids[0].illuminance_lux(0), per_lux * estimate.grids[0].standard_error_lux(0));
            let percent = 100.0 * (ours / theirs - 1.0);
            if reflectance == 0.0 {
                black.add(percent)
            } else {
                reflecting.add(percent)
            }
            rows.push(vec![
                Kind::Program.label(),
                reflectance.to_string(),
                method.to_owned(),
                format!("{theirs:.5}"),
                with_standard_error(ours, error, 5),
                format!("{percent:+.2} %"),
            ]);
        }
    }
    let table = Table {
        caption:
            "Daylight factor in percent of the floor below the diffuser over the diffuse transmittance of the tube, \
                  traditional overcast sky, room of 4 x 4 x 3 m (EnergyPlus 25.2)"
                .to_owned(),
        head: ["kind of source", "reflectance", "method", "EnergyPlus", "this program", "deviation"]
            .map(str::to_owned)
            .into(),
        rows,
    };
    Ok(([black, reflecting], table))
}

/// Diameter of the tube in m: that of tube 1 of EnergyPlus' example.
const DIAMETER_M: f64 = 0.3556;
