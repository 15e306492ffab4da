//! Skies and sun against their tables.

use std::path::Path;

use super::deviations::Deviations;
use super::error::ValidationError;
use super::interior::roof_opening_deviation;
use super::reference::{CsvTable, cie_type};
use crate::page::{Figure, Section, Table};
use skyduct::figure::Heading;
use skyduct::figure::axes::Axis;
use skyduct::figure::curves::{Series, curves};
use skyduct::figure::svg::svg;
use skyduct::figure::ticks::Steps;
use skyduct::sky::sun::beam_normal_illuminance_lux;
use skyduct::sky::zenith::{default_formula, typical_turbidity, zenith_luminance_cd_m2};
use skyduct::sky::{CieType, SkyDistribution, direction};

/// CIE sky types whose curves are drawn.
const DRAWN: [u8; 5] = [1, 5, 7, 12, 15];

pub fn section(reference: &Path) -> Result<Section, ValidationError> {
    let table = CsvTable::read(reference, "sky_horizontal.csv")?;
    let mut ratios = Deviations::new("horizontal illuminance per zenith luminance, I = D/Lz");
    let mut levels = Deviations::new("absolute zenith luminance and horizontal illuminance, sun up to 75 degrees");
    let mut beams = Deviations::new("normal illuminance of the beam at the typical turbidity");
    let mut points: Vec<(u8, f64, f64)> = Vec::new();
    for row in table.rows() {
        let cie_type = cie_type(row.text("type")?)?;
        let altitude_deg = row.number("sun_alt_deg")?;
        let altitude = altitude_deg.to_radians();
        let distribution = SkyDistribution::new(cie_type, direction(altitude, 2.3));
        let ratio = row.number("I_sr")?;
        ratios.add(distribution.horizontal_ratio() / ratio - 1.0);
        points.push((cie_type.number(), altitude_deg, ratio));
        if altitude_deg <= 75.0 {
            let luminance = zenith_luminance_cd_m2(&distribution, default_formula(cie_type, None), altitude);
            levels.add(luminance / (1000.0 * row.number("Lz_kcd_m2")?) - 1.0);
            levels.add(luminance * distribution.horizontal_ratio() / row.number("D_h_lux")? - 1.0);
        }
        let beam = row.number("beam_normal_formula_lux")?;
        // printed to six decimals
        if beam > 1.0 {
            beams.add(beam_normal_illuminance_lux(altitude, typical_turbidity(cie_type)) / beam - 1.0);
        }
    }
    let above = CsvTable::read(reference, "sky_zenith_above_75.csv")?;
    let mut rule = Deviations::new("the rule for suns above 75 degrees: zenith luminance");
    for row in above.rows() {
        let altitude = row.number("sun_alt_deg")?.to_radians();
        let cie_type = cie_type(row.text("type")?)?;
        let distribution = SkyDistribution::new(cie_type, direction(altitude, 2.3));
        let luminance = zenith_luminance_cd_m2(&distribution, default_formula(cie_type, None), altitude);
        rule.add(luminance / (1000.0 * row.number("Lz_rule75_kcd_m2")?) - 1.0);
    }
    let opening = CsvTable::read(reference, "roof_opening_sky_component.csv")?;
    let mut components = Deviations::new(
        "sky components under roof openings, 16 skies, floor and wall points (not: wall points at the edge of the wide opening under skies with a cusp, where the reference does not resolve it)",
    );
    for row in opening.rows() {
        if let Some(deviation) = roof_opening_deviation(&row)? {
            components.add(deviation);
        }
    }
    let drawn = |number: u8| {
        let curve = (1..=90).map(|degrees| {
            let altitude = f64::from(degrees).to_radians();
            let distribution =
                SkyDistribution::new(CieType::new(number).unwrap_or(CieType::UNIFORM), direction(altitude, 0.0));
            (f64::from(degrees), distribution.horizontal_ratio())
        });
        let marks = points.iter().filter(move |point| point.0 == number).map(|point| (point.1, point.2));
        Series { name: format!("type {number}"), line: curve.collect(), marks: marks.collect(), ..Series::default() }
    };
    let series: Vec<Series> = DRAWN.into_iter().map(drawn).collect();
    let altitude = Axis::linear("altitude of the sun in degrees", [0.0, 90.0], 6, Steps::Sexagesimal);
    let ratio = Axis::linear("D / Lz in sr", [0.0, 12.0], 6, Steps::Decimal);
    let heading = Heading::of("Horizontal illuminance of a sky over the luminance of its zenith");
    let figure = svg(&curves(&heading, &series, altitude, ratio))?;
    let rows = DRAWN.into_iter().map(|number| {
        let at = |degrees: f64| {
            let found = points.iter().find(|point| point.0 == number && point.1 == degrees);
            found.map_or(String::new(), |point| format!("{:.4}", point.2))
        };
        [number.to_string()].into_iter().chain([5.0, 20.0, 35.0, 60.0, 85.0].map(at)).collect()
    });
    Ok(Section {
        text:
            "The luminance distributions are integrated over the hemisphere and compared with independent integrals; \
               the absolute levels with the published formulae of Kittler and Darula; the light through roof openings \
               with an independent quadrature of sky and geometry."
                .to_owned(),
        checks: vec![
            ratios.check(1e-11, "relative"),
            levels.check(1e-9, "relative"),
            beams.check(1e-6, "relative"),
            rule.check(1e-8, "relative"),
            components.check(1.0, "of the tolerance (1e-5 relative and the printed digit)"),
        ],
        tables: vec![Table {
            caption: "D/Lz in sr by sky type and altitude of the sun".to_owned(),
            head: ["type", "5", "20", "35", "60", "85"].map(str::to_owned).into(),
            rows: rows.collect(),
        }],
        figures: vec![Figure {
            file: "skies.svg",
            caption: "D/Lz against the altitude of the sun: lines this program, marks the reference.".to_owned(),
            bytes: figure.into_bytes(),
        }],
        ..Section::default()
    })
}
