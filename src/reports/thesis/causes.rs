//! Possible causes for photon mapping in the thesis being brighter than HOLIGILM: changes of the scene, each with its factor.

use std::f64::consts::PI;
use std::path::Path;

use serde_json::{Value, json};

use super::boundary::mean_loss;
use super::printed::{INITIAL_RADIUS_M, PPM};
use super::scenes;
use super::settings::Settings;
use crate::page::ReportError;
use crate::run::render;
use skyduct::estimate::{GridEstimate, TubeEstimate};

/// Uniform reflectances that are tried.
const REFLECTANCES: [f64; 3] = [0.1, 0.2, 0.3];

/// Change of the scene, with the mean illuminance of the floor by HOLIGILM.
pub struct Cause {
    pub name: String,
    pub mean_lux: f64,
    /// Mean illuminance of the case before the change.
    pub before_lux: f64,
}

impl Cause {
    pub fn factor(&self) -> f64 {
        self.mean_lux / self.before_lux
    }
}

pub struct Causes {
    pub list: Vec<Cause>,
    /// Fraction of the light at the collector an hour later that would have to come into the room for HOLIGILM's mean.
    pub transmission_later: f64,
    /// Uniform reflectance at which the factor is that of the thesis' PPM over HOLIGILM.
    pub reflectance: Option<f64>,
}

fn estimate_of(document: &Value) -> Result<(GridEstimate, TubeEstimate), ReportError> {
    let (_, mut estimate) = render(document, Path::new(""))?;
    let outputs = estimate.grids.pop().zip(estimate.tubes.pop());
    outputs.ok_or_else(|| ReportError::Case("a job without grid and tube".to_owned()))
}

pub fn mean_of(document: &Value) -> Result<f64, ReportError> {
    Ok(estimate_of(document)?.0.mean.mean)
}

pub fn causes(settings: &Settings) -> Result<Causes, ReportError> {
    let floor = |interreflection: bool| {
        let mut document = scenes::floor([settings.cells; 2], interreflection)?;
        document["method"] = "holigilm".into();
        Ok::<_, ReportError>(document)
    };
    let direct = floor(false)?;
    let (grid, tube) = estimate_of(&direct)?;
    let before = grid.mean.mean;
    let later = json!("2011-09-15T16:00:00+02:00");
    let changed = |name: &str, change: &dyn Fn(&mut Value)| {
        let mut document = direct.clone();
        change(&mut document);
        Ok::<_, ReportError>(Cause { name: name.to_owned(), mean_lux: mean_of(&document)?, before_lux: before })
    };
    let mut list = vec![
        changed("diffuse illuminance by the typical Dv/Ev of type 12, 0.10, instead of equation 3.5", &|document| {
            document["sky"]["dv_ev"] = 0.1.into();
        })?,
        changed("with the sun, which chapter 3 leaves out", &|document| {
            if let Some(sky) = document["sky"].as_object_mut() {
                sky.remove("direct_normal_illuminance_lux");
            }
        })?,
        changed("photon mapping's sky one hour earlier, 12:00 UTC", &|document| {
            document["time"] = "2011-09-15T14:00:00+02:00".into()
        })?,
        changed("photon mapping's sky one hour later, 14:00 UTC", &|document| document["time"] = later.clone())?,
        changed("55.46 N 12.30 E in decimal degrees, not in degrees and minutes (chapter 3)", &|document| {
            document["location"] = json!({ "latitude_deg": 55.46, "longitude_deg": 12.3 });
        })?,
    ];
    let mut at_later = direct.clone();
    at_later["time"] = later;
    let (grid_later, tube_later) = estimate_of(&at_later)?;
    list.push(Cause {
        name: "HOLIGILM's sky alone one hour later, 14:00 UTC".to_owned(),
        mean_lux: before,
        before_lux: grid_later.mean.mean,
    });
    let transmission_later = tube.into_room.mean / tube_later.at_collector.mean;
    let total = mean_of(&floor(true)?)?;
    list.push(Cause {
        name: "interreflection in photon mapping alone, floor 0.2, walls 0.5, ceiling 0.7".to_owned(),
        mean_lux: total,
        before_lux: before,
    });
    let mut returning = floor(true)?;
    returning["tubes"][0]["diffuser"] = json!({ "kind": "lambertian", "transmittance": 0.5 });
    let absorbing = mean_of(&returning)?;
    returning["tubes"][0]["diffuser"]["reflectance"] = 0.5.into();
    list.push(Cause {
        name: "a diffuser that sends half of the room's light down again instead of up the pipe (section 4.2)"
            .to_owned(),
        mean_lux: mean_of(&returning)?,
        before_lux: absorbing,
    });
    for (name, factor) in [
        ("a cosine too many in the diffuser's BTDF, equation 4.1, closed form", 2.0 / 3.0),
        ("a factor pi too few in the photons' flux, equation 5.9, closed form", 1.0 / PI),
        (
            "whole discs at the walls, 0.3 inch, equation 5.11, closed form",
            1.0 - mean_loss(INITIAL_RADIUS_M / scenes::ROOM_M),
        ),
    ] {
        list.push(Cause { name: name.to_owned(), mean_lux: factor * before, before_lux: before });
    }
    let mut factors = vec![(1.0, 0.0)];
    for reflectance in REFLECTANCES {
        let mut document = floor(true)?;
        let surface = json!({ "reflectance": reflectance });
        document["room"]["surfaces"] = json!({ "floor": surface, "walls": surface, "ceiling": surface });
        factors.push((mean_of(&document)? / before, reflectance));
    }
    Ok(Causes { list, transmission_later, reflectance: interpolated(&factors, PPM.excess()) })
}

/// Interpolates y at `x` linearly between points of ascending x; `None` outside of them.
pub fn interpolated(points: &[(f64, f64)], x: f64) -> Option<f64> {
    let pair = points.windows(2).find(|pair| pair[0].0 <= x && x <= pair[1].0)?;
    let share = (x - pair[0].0) / (pair[1].0 - pair[0].0);
    Some(pair[0].1 + share * (pair[1].1 - pair[0].1))
}
