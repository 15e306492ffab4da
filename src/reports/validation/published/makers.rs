//! Makers' figures of the flux into rooms against computed bounds, and the transmittance of acrylic.

use super::levels::{beam_lux, sky, types};
use super::printed::{ACRYLIC, DOME_TRANSMITTANCE, Kind, MAKERS, MakersFlux};
use crate::page::Table;
use skyduct::guide::transmittance::{beam_transmission, sky_exitance};
use skyduct::optics::fresnel::slab_transmittance;
use skyduct::sky::CieType;

/// Compares published fluxes into the room with those of the worst and of the best tube of each kind.
pub fn fluxes() -> Table {
    let rows = MAKERS.iter().map(|figure| {
        let ([darker, brighter], altitude_deg) = types(figure.light);
        let (low, high) =
            (flux(figure, figure.least, darker, altitude_deg), flux(figure, figure.most, brighter, altitude_deg));
        let (from, to) = figure.flux_lm;
        let verdict = match figure.or_more {
            false if to < low || from > high => "outside",
            false => "within",
            true if from > high => "outside: more than the upper bound",
            true => "consistent with a lower bound",
        };
        let published = if from == to { format!("{from:.0}") } else { format!("{from:.0} to {to:.0}") };
        let more = if figure.or_more { "more than " } else { "" };
        vec![
            Kind::Maker.label(),
            format!("{} ({})", figure.product, figure.source),
            format!("{more}{published}"),
            format!("{low:.0} to {high:.0}"),
            verdict.to_owned(),
        ]
    });
    Table {
        caption: "Flux into the room in lm between bounds: lengths of 1 to 3 m, mirrors and diffusers of lower and higher grade, \
                  as none is stated; dome 0.92; lamps of 60 W as 700 to 890 lm, of 100 W as 1350 lm"
            .to_owned(),
        head: ["kind of source", "product", "published", "this program", "verdict"].map(str::to_owned).into(),
        rows: rows.collect(),
    }
}

/// Computes the flux in lm through dome, straight pipe (length in m, mirror) and diffuser under a sky and its sun, in closed
/// form.
fn flux(figure: &MakersFlux, tube: [f64; 3], cie_type: CieType, altitude_deg: f64) -> f64 {
    let [length_m, reflectance, diffuser] = tube;
    let aspect = length_m / figure.diameter_m;
    let area = 0.25 * std::f64::consts::PI * figure.diameter_m * figure.diameter_m;
    let altitude = altitude_deg.to_radians();
    let beam = beam_lux(cie_type, altitude_deg) * libm::sin(altitude);
    let exitance = sky_exitance(&sky(cie_type, altitude_deg), aspect, reflectance)
        + beam * beam_transmission(aspect, 1.0 / libm::tan(altitude), reflectance);
    exitance * area * DOME_TRANSMITTANCE * diffuser
}

/// Compares the transmittance of a sheet of acrylic at normal incidence with the published one.
pub fn acrylic() -> Table {
    let (index, measured) = ACRYLIC;
    let row = |name: &str, optical_depth: f64| {
        let ours = slab_transmittance(1.0, index, optical_depth);
        vec![Kind::Measured.label(), name.to_owned(), format!("above {measured}"), format!("{ours:.4}")]
    };
    Table {
        caption: format!(
            "Transmittance of 3 mm of acrylic, n = {index} (International Journal of Polymer Science 2013, 610132); a material, \
             no dome"
        ),
        head: ["kind of source", "sheet", "measured", "this program"].map(str::to_owned).into(),
        rows: vec![row("lossless", 0.0), row("absorption of 2 per metre", 2.0 * 0.003)],
    }
}
