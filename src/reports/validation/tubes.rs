//! Tubes against exact series, quadratures and an independent ray tracer.

use std::path::Path;

use glam::DVec3;

use super::deviations::Deviations;
use super::error::ValidationError;
use super::reference::{CsvTable, cie_type, failed, json};
use crate::page::{Figure, Section, Table, with_standard_error};
use skyduct::figure::Heading;
use skyduct::figure::axes::Axis;
use skyduct::figure::curves::{Series, curves};
use skyduct::figure::svg::svg;
use skyduct::figure::ticks::Steps;
use skyduct::guide::performance;
use skyduct::guide::transmittance::{beam_transmission, sky_exitance, zastrow_wittwer_transmission};
use skyduct::guide::{BentGuide, End, Guide, StraightGuide};
use skyduct::optics::mirror::Mirror;
use skyduct::sampling::{Key, PathRandom, warp};
use skyduct::sky::{CieType, Sky, SkyDistribution, direction};
use skyduct::statistics::Moments;

/// Radius of all tubes in metres.
const RADIUS: f64 = 0.127;

/// Number of rays in each of eight replicates.
const RAYS: u64 = 1024;

/// Number of random rays through each elbow.
const ELBOW_RAYS: u32 = 100_000;

/// Aspect ratio (length over diameter) of the drawn curves.
const DRAWN_ASPECT: f64 = 4.0;

pub fn section(reference: &Path) -> Result<Section, ValidationError> {
    let mut exact = Deviations::new("parallel light through straight tubes, exact series");
    let mut traced = Deviations::new("parallel light through straight tubes, traced");
    let mut marks = Vec::new();
    for (number, row) in CsvTable::read(reference, "tube_beam_transmission.csv")?.rows().enumerate() {
        let [elevation_deg, aspect, reflectance] =
            [row.number("elevation_deg")?, row.number("L_over_D")?, row.number("R")?];
        let truth = row.number("T_exact")?;
        let tangent = libm::tan((90.0 - elevation_deg).to_radians());
        exact.add(beam_transmission(aspect, tangent, reflectance) - truth);
        let guide = straight(2.0 * RADIUS * aspect, reflectance);
        let toward = direction(elevation_deg.to_radians(), 0.7);
        let transmission = performance::traced_beam(&guide, toward, Key::new(number as u64), RAYS).transmission();
        if transmission.standard_error > 0.0 {
            traced.add((transmission.value - truth) / transmission.standard_error);
        }
        if aspect == DRAWN_ASPECT {
            marks.push((reflectance, elevation_deg, transmission.value));
        }
    }

    let mut isotropic = Deviations::new("uniform sky through straight tubes, quadrature");
    let file = "tube_isotropic_transmission.json";
    let table = json(reference, file)?;
    for (key, truth) in table.as_object().ok_or_else(|| failed(file, "is not an object"))? {
        let mut numbers = key.split([',', '=']).filter_map(|part| part.parse::<f64>().ok());
        let (Some(aspect), Some(reflectance), Some(truth)) = (numbers.next(), numbers.next(), truth.as_f64()) else {
            return Err(failed(file, format!("{key:?} is not a tube")));
        };
        let uniform = sky(CieType::UNIFORM, 45.0);
        isotropic.add(sky_exitance(&uniform, aspect, reflectance) / uniform.horizontal_illuminance_lux() - truth);
    }

    let mut skies =
        Deviations::new("CIE skies through straight tubes, quadrature (every 16th row; the tests take all)");
    for row in CsvTable::read(reference, "tube_transmission_cie_skies.csv")?.rows().step_by(16) {
        let sky = sky(cie_type(row.text("cie_type")?)?, row.number("sun_alt_deg")?);
        let exitance = sky_exitance(&sky, row.number("aspect")?, row.number("rho")?);
        skies.add(exitance / sky.horizontal_illuminance_lux() - row.number("TTE")?);
    }

    let (elbows, elbow_table) = elbows(reference)?;
    let curve = |reflectance: f64| {
        let at = |degrees: u32| {
            let tangent = libm::tan(f64::from(90 - degrees).to_radians());
            (f64::from(degrees), beam_transmission(DRAWN_ASPECT, tangent, reflectance))
        };
        let marks = marks.iter().filter(|mark| mark.0 == reflectance).map(|mark| (mark.1, mark.2));
        Series {
            name: format!("R = {reflectance}"),
            line: (5..=90).map(at).collect(),
            marks: marks.collect(),
            ..Series::default()
        }
    };
    let mut series: Vec<Series> = [0.995, 0.98, 0.95, 0.9].into_iter().map(curve).collect();
    let approximate = |degrees: u32| {
        let tangent = libm::tan(f64::from(90 - degrees).to_radians());
        (f64::from(degrees), zastrow_wittwer_transmission(DRAWN_ASPECT, tangent, 0.9))
    };
    let line = (5..=90).map(approximate).collect();
    series.push(Series { name: "Zastrow-Wittwer, R = 0.9".to_owned(), line, ..Series::default() });
    let elevation = Axis::linear("elevation of the light in degrees", [0.0, 90.0], 6, Steps::Sexagesimal);
    let transmission = Axis::linear("transmission", [0.0, 1.0], 5, Steps::Decimal);
    let heading = Heading::of("Straight tubes, four diameters long: lines the exact series, marks traced rays");
    let figure = svg(&curves(&heading, &series, elevation, transmission))?;

    Ok(Section {
        text: "The transmission of straight mirror tubes for parallel light has an exact series (Swift and Smith \
               1995), for skies a quadrature over it; traced rays follow the closed form of a skew ray. Elbows are \
               compared with an independent ray tracer."
            .to_owned(),
        checks: vec![
            exact.check(1e-12, "absolute"),
            traced.check(5.0, "standard errors"),
            isotropic.check(1e-8, "absolute"),
            skies.check(1.5e-6, "absolute"),
            elbows.check(4.5, "combined standard errors"),
        ],
        tables: vec![elbow_table],
        figures: vec![Figure {
            file: "tubes.svg",
            caption: "Transmission for parallel light, L/D = 4: lines the exact series, marks traced rays; the \
                      approximation of Zastrow and Wittwer lies below the exact transmission everywhere."
                .to_owned(),
            bytes: figure.into_bytes(),
        }],
        ..Section::default()
    })
}

fn elbows(reference: &Path) -> Result<(Deviations, Table), ValidationError> {
    let mut deviations = Deviations::new("mitred elbows: forward and back, isotropic and axial light");
    let mut rows = Vec::new();
    for (number, row) in CsvTable::read(reference, "elbow_transmission.csv")?.rows().enumerate() {
        let isotropic = match row.text("illumination")? {
            "isotropic" => true,
            "collimated axial" => false,
            _ => continue,
        };
        let [bend, reflectance] = [row.number("bend_deg")?, row.number("R")?];
        let [through, back] = elbow(bend, reflectance, isotropic, Key::new(number as u64));
        // the reference ends paths after 400 bounces, and prints six digits
        let reference_error =
            libm::hypot(libm::hypot(row.number("stderr")?, row.number("fraction_cut_at_400_bounces")?), 0.5e-6);
        for (value, truth) in [(through, row.number("T_forward")?), (back, row.number("back_reflected_out_of_top")?)] {
            deviations.add((value.mean - truth) / libm::hypot(value.standard_error(), reference_error));
        }
        if isotropic {
            let cells = [bend, reflectance].map(|value| value.to_string()).into_iter();
            let values = [through, back].map(|value| with_standard_error(value.mean, value.standard_error(), 4));
            rows.push(cells.chain(values).collect());
        }
    }
    let table = Table {
        caption: "Isotropic light through mitred elbows of two 0.5 m pieces, r = 0.127 m".to_owned(),
        head: ["bend in degrees", "R", "forward", "back out of the top"].map(str::to_owned).into(),
        rows,
    };
    Ok((deviations, table))
}

/// Computes the forward and back-reflected fractions of isotropic or axial light that enters an elbow of two equal pieces.
fn elbow(bend_deg: f64, reflectance: f64, isotropic: bool, key: Key) -> [Moments; 2] {
    let (sin, cos) = libm::sincos(bend_deg.to_radians());
    let axis = DVec3::new(sin, 0.0, cos);
    let mirror = Mirror::Constant([reflectance; 3]);
    let guide = Guide::Bent(BentGuide::new(RADIUS, &[(0.5, DVec3::Z), (0.5, axis)], mirror, [1.0; 3]));
    let mut random = PathRandom::new(key);
    let (mut through, mut back) = (Moments::default(), Moments::default());
    for _ in 0..ELBOW_RAYS {
        let local = if isotropic { warp::cosine_hemisphere(random.uniform2()) } else { DVec3::Z };
        let direction = -warp::around(axis, local);
        // light that does not go down the axis does not enter
        let Some(entry) = guide.entry(random.uniform2(), direction) else { continue };
        let transit = guide.down::<1>(entry.position, direction, &mut random);
        let weight = transit.weight().0[0];
        through.push(if transit.end == End::Opening { weight } else { 0.0 });
        back.push(if transit.end == End::Top { weight } else { 0.0 });
    }
    [through, back]
}

fn straight(length: f64, reflectance: f64) -> Guide {
    let reflectance = Mirror::Constant([reflectance; 3]);
    Guide::Straight(StraightGuide { radius: RADIUS, length, reflectance, collector_transmittance: [1.0; 3] })
}

fn sky(cie_type: CieType, altitude_deg: f64) -> Sky {
    let distribution = SkyDistribution::new(cie_type, direction(altitude_deg.to_radians(), 0.0));
    Sky::new(distribution, 1.0)
}
