//! Losses of pipes by bends and by length.

use glam::DVec3;

use super::levels;
use super::printed::{BEND_LOSS, Kind, LENGTH_LOSS};
use crate::page::Table;
use skyduct::guide::performance;
use skyduct::guide::transmittance::{beam_transmission, sky_exitance};
use skyduct::guide::{BentGuide, Guide};
use skyduct::optics::mirror::Mirror;
use skyduct::sampling::Key;
use skyduct::sky::{CieType, Sky, direction};

/// Diameter of the pipe in metres.
const DIAMETER_M: f64 = 0.33;

/// Length of each of the three pieces of a pipe with two equal and opposite bends, in metres.
const PIECE_M: f64 = 0.4;

/// Number of rays in each of eight replicates.
const RAYS: u64 = 1 << 15;

const MIRRORS: [f64; 4] = [0.95, 0.96, 0.98, 0.995];

/// Tabulates the loss per bend in percent with its standard error: 1 less the square root of the flux that passes over that of
/// the straight pipe with an axis of the same length.
pub fn bends() -> Table {
    let overcast = levels::sky(CieType::TRADITIONAL_OVERCAST, 45.0);
    let mut rows: Vec<Vec<String>> = Vec::new();
    for (percent, kind, source) in BEND_LOSS {
        rows.push(
            [kind.label(), source.to_owned()].into_iter().chain([String::new(), format!("{percent} %")]).collect(),
        );
    }
    for reflectance in MIRRORS {
        for bend_deg in [30.0, 45.0, 90.0] {
            let cells = [format!("overcast, bends of {bend_deg} degrees"), reflectance.to_string()];
            rows.push(row(cells, loss(&overcast, None, reflectance, bend_deg)));
        }
    }
    let clear = levels::types(super::printed::Light::Clear(45.0)).0[0];
    let sky = levels::sky(clear, 45.0);
    for (side, azimuth_deg) in
        [("the side the axis leans to", 90.0), ("across", 180.0), ("the side it leans from", 270.0)]
    {
        for bend_deg in [30.0, 45.0] {
            let sun = (direction(45f64.to_radians(), f64::to_radians(azimuth_deg)), levels::beam_lux(clear, 45.0));
            let cells = [format!("type 12, sun at 45 degrees, {side}, bends of {bend_deg} degrees"), "0.95".to_owned()];
            rows.push(row(cells, loss(&sky_toward(&sky, sun.0), Some(sun), 0.95, bend_deg)));
        }
    }
    Table {
        caption: "Loss per bend of a 0.33 m pipe with two equal and opposite mitred bends, 1.2 m of axis".to_owned(),
        head: ["kind of source", "case", "mirror", "loss per bend"].map(str::to_owned).into(),
        rows,
    }
}

fn row(cells: [String; 2], (loss, error): (f64, f64)) -> Vec<String> {
    let value = format!("{:.2} % (s.e. {:.2})", 100.0 * loss, 100.0 * error);
    ["this program".to_owned()].into_iter().chain(cells).chain([value]).collect()
}

/// Returns a sky of the same level with its sun in another direction at the same altitude.
fn sky_toward(sky: &Sky, sun: DVec3) -> Sky {
    let distribution = skyduct::sky::SkyDistribution::new(sky.distribution.sky_type(), sun);
    Sky::new(distribution, sky.zenith_luminance_cd_m2)
}

/// Computes the loss per bend as a fraction, with its standard error, under a sky and an optional sun, given by direction and
/// normal illuminance in lux.
fn loss(sky: &Sky, sun: Option<(DVec3, f64)>, reflectance: f64, bend_deg: f64) -> (f64, f64) {
    let radius = 0.5 * DIAMETER_M;
    let leaning = direction((90.0 - bend_deg).to_radians(), 90f64.to_radians());
    let pieces = [(PIECE_M, DVec3::Z), (PIECE_M, leaning), (PIECE_M, DVec3::Z)];
    let guide = Guide::Bent(BentGuide::new(radius, &pieces, Mirror::Constant([reflectance; 3]), [1.0; 3]));
    let area = std::f64::consts::PI * radius * radius;
    let aspect = 3.0 * PIECE_M / DIAMETER_M;

    let of_sky = performance::sky(&guide, sky, Key::new(1), RAYS).arriving();
    let mut bent = of_sky.mean;
    let mut variance = of_sky.variance_of_mean();
    let mut straight = area * sky_exitance(sky, aspect, reflectance);
    if let Some((toward, lux)) = sun {
        let of_beam = performance::beam(&guide, toward, Key::new(2), RAYS).arriving();
        bent += lux * of_beam.mean;
        variance += lux * lux * of_beam.variance_of_mean();
        let tangent = libm::hypot(toward.x, toward.y) / toward.z;
        straight += area * lux * toward.z * beam_transmission(aspect, tangent, reflectance);
    }
    let kept = (bent / straight).sqrt();
    (1.0 - kept, 0.5 * variance.sqrt() / (straight * kept))
}

/// Tabulates the loss per metre between pipes of 1 and 3 m, in closed form.
pub fn metres() -> Table {
    let overcast = levels::sky(CieType::TRADITIONAL_OVERCAST, 45.0);
    let mut rows = vec![vec![
        Kind::Maker.label(),
        "the same handbook; nothing else stated".to_owned(),
        format!("{LENGTH_LOSS} %"),
        format!("{LENGTH_LOSS} %"),
    ]];
    let per_metre = |one: f64, three: f64| format!("{:.1} %", 100.0 * (1.0 - (three / one).sqrt()));
    for reflectance in [0.92, 0.95, 0.96, 0.98, 0.99, 0.995, 0.997] {
        let sky = |length: f64| sky_exitance(&overcast, length / DIAMETER_M, reflectance);
        let beam = |length: f64| beam_transmission(length / DIAMETER_M, libm::tan(30f64.to_radians()), reflectance);
        rows.push(vec![
            "this program".to_owned(),
            format!("mirror {reflectance}"),
            per_metre(sky(1.0), sky(3.0)),
            per_metre(beam(1.0), beam(3.0)),
        ]);
    }
    Table {
        caption: "Loss per metre of a 0.33 m pipe between 1 and 3 m".to_owned(),
        head: ["kind of source", "case", "overcast sky", "beam at 60 degrees"].map(str::to_owned).into(),
        rows,
    }
}
