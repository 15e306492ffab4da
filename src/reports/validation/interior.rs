//! Rooms lit by luminaires, panes and roof openings, against closed forms: cases like those of CIE 171:2006.

use std::path::Path;

use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use super::deviations::Deviations;
use super::error::ValidationError;
use super::reference::{Row, cie_type, failed};
use crate::page::{Check, Figure, Section, Table, with_standard_error};
use crate::run::render;
use skyduct::estimate::Estimate;
use skyduct::figure::Heading;
use skyduct::figure::axes::Axis;
use skyduct::figure::curves::{Series, curves};
use skyduct::figure::svg::svg;
use skyduct::figure::ticks::Steps;
use skyduct::optics::fresnel::slab_transmittance;
use skyduct::sky::opening::illuminance_through_rectangle;
use skyduct::sky::{Sky, SkyDistribution, direction};

/// Flux of every luminaire in lm.
const FLUX_LM: f64 = 10_000.0;

/// Reflectances of the closed rooms.
const REFLECTANCES: [f64; 11] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95];

pub fn section(reference: &Path) -> Result<Section, ValidationError> {
    let (source_checks, source_table) = sources(reference)?;
    let (glass, glass_table) = glass();
    let (reflection, reflection_table) = diffuse_reflection(reference)?;
    let (interreflection, closure, interreflection_table, figure) = interreflection(reference)?;
    let mut checks = source_checks;
    checks.extend([
        glass.check(0.5e-4, "absolute (the printed digit)"),
        reflection.check(4.0, "standard errors"),
        interreflection.check(4.0, "standard errors"),
        closure.check(1e-9, "relative"),
    ]);
    Ok(Section {
        text:
            "The cases follow the kinds of CIE 171:2006 (point and area source, glass, diffuse reflection, closed-room \
               interreflection, flux conservation); their references are closed forms recomputed for these rooms, not \
               the tables of that publication. Roof openings stand with the skies."
                .to_owned(),
        checks,
        tables: vec![source_table, glass_table, reflection_table, interreflection_table],
        figures: vec![figure],
        ..Section::default()
    })
}

/// Returns the deviation of a row of the table of sky components in units of its tolerance; `None` for wall points under the
/// edge of the wide opening and skies with a cusp, where the reference does not resolve the sun's image.
pub fn roof_opening_deviation(row: &Row) -> Result<Option<f64>, ValidationError> {
    let side = row.number("opening_m")?;
    let cusp = cie_type(row.text("cie_type")?)?.parameters().is_some_and(|[_, _, c, ..]| c > 0.0);
    if side > 1.0 && cusp && row.text("normal")? == "+x" {
        return Ok(None);
    }
    let altitude = row.number("sun_alt")?.to_radians();
    // the table has the sun toward +x
    let sun = direction(altitude, std::f64::consts::FRAC_PI_2);
    let distribution = SkyDistribution::new(cie_type(row.text("cie_type")?)?, sun);
    let sky = Sky::new(distribution, 1.0);
    let normal = match row.text("normal")? {
        "+z" => DVec3::Z,
        "+x" => DVec3::X,
        other => return Err(failed("roof_opening_sky_component.csv", format!("unknown normal {other:?}"))),
    };
    let point = DVec3::new(row.number("x")?, row.number("y")?, row.number("z")?);
    let corner = DVec3::new(-0.5 * side, -0.5 * side, 3.0);
    let (lux, error) = illuminance_through_rectangle(&sky, corner, DVec2::splat(side), point, normal);
    let per_cent = 100.0 / sky.horizontal_illuminance_lux();
    let truth = row.number("SC_percent")?;
    Ok(Some((per_cent * lux - truth) / (1e-5 * truth + 0.5e-5 + per_cent * error)))
}

/// Returns the document of a room of `size_m` whose faces all have the same reflectance, lit by one luminaire.
fn room(size_m: [f64; 3], reflectance: f64, luminaire: Value, grids: Value, relative_error: f64) -> Value {
    let surface = json!({ "reflectance": reflectance });
    json!({
        "room": {
            "size_m": size_m,
            "surfaces": { "floor": surface, "walls": surface, "ceiling": surface },
            "luminaires": [luminaire],
        },
        "tubes": [],
        "grids": grids,
        "method": "light_tracing",
        "stop": { "relative_error": relative_error, "max_seconds": 60 },
    })
}

/// Returns a rectangular luminaire of 10 000 lm from a corner and two edges.
fn luminaire(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Value {
    let area = DVec3::from(u).cross(DVec3::from(v)).length();
    json!({
        "kind": "rectangle", "corner_m": corner, "edge_u_m": u, "edge_v_m": v,
        "luminance_cd_m2": FLUX_LM / (std::f64::consts::PI * area),
    })
}

/// Compares the illuminance of the floor under a small and under a 1 x 1 m source in the ceiling of a black 4 x 4 x 3 m room
/// with closed forms.
fn sources(reference: &Path) -> Result<(Vec<Check>, Table), ValidationError> {
    // 8 x 8 cells of 0.5 m; the table shows a row of them, 0.25 m off the axis
    let grid = json!([{ "name": "floor", "height_m": 0.0, "cells": [8, 8], "estimate": "point" }]);
    let mut rows = Vec::new();
    let mut checks = Vec::new();
    for (name, side) in [("small source, 0.01 x 0.01 m (cos^4 law)", 0.01), ("area source, 1 x 1 m", 1.0)] {
        let low = 2.0 - 0.5 * side;
        // u x v points down
        let source = luminaire([low, low, 3.0], [0.0, side, 0.0], [side, 0.0, 0.0]);
        let (prepared, estimate) = render(&room([4.0, 4.0, 3.0], 0.0, source, grid.clone(), 0.001), reference)?;
        let mut deviations = Deviations::new(format!("{name}: direct illuminance of the floor"));
        for sensor in 0..64 {
            let (i, j) = (sensor % 8, sensor / 8);
            let point = DVec2::new(prepared.grids()[0].x_m[i] - 2.0, prepared.grids()[0].y_m[j] - 2.0);
            let truth = source_closed_form(side, point);
            let (value, error) = (lux(&estimate, sensor), standard_error(&estimate, sensor));
            // only rounding is left where the engine itself uses a closed form
            deviations.add((value - truth) / error.max(1e-4 * truth));
            if i >= 4 && j == 4 {
                let cells = [format!("{:.2}", point.x), with_standard_error(value, error, 3), format!("{truth:.3}")];
                rows.push([name.to_owned()].into_iter().chain(cells).collect());
            }
        }
        checks.push(deviations.check(4.0, "standard errors (at least 1e-4)"));
    }
    let table = Table {
        caption:
            "Direct illuminance in lx from 10 000 lm in the ceiling of a black 4 x 4 x 3 m room, 0.25 m off the axis"
                .to_owned(),
        head: ["source", "x in m", "this program", "closed form"].map(str::to_owned).into(),
        rows,
    };
    Ok((checks, table))
}

/// Computes the illuminance under a square Lambertian source of 10 000 lm at 3 m: the sum of four rectangles with a corner
/// above the point (textbook configuration factor of a parallel rectangle).
fn source_closed_form(side: f64, point: DVec2) -> f64 {
    let factor = |a: f64, b: f64| {
        let (x, y) = (a / 3.0, b / 3.0);
        let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / p * libm::atan(y / p) + y / q * libm::atan(x / q)) / std::f64::consts::TAU
    };
    let edges = |centre: f64| [0.5 * side - centre, -0.5 * side - centre];
    let ([right, left], [far, near]) = (edges(point.x), edges(point.y));
    let sum = factor(right, far) - factor(left, far) - factor(right, near) + factor(left, near);
    sum * FLUX_LM / (side * side)
}

/// Compares the transmittance of lossless panes by angle of incidence with printed values of the closed form.
fn glass() -> (Deviations, Table) {
    let printed = [
        (1.52, [0.9183, 0.9160, 0.9095, 0.8912, 0.8435, 0.7247, 0.4560, 0.2456]),
        (1.5, [0.9231, 0.9207, 0.9143, 0.8960, 0.8481, 0.7287, 0.4585, 0.2469]),
    ];
    let angles: [f64; 8] = [0.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 85.0];
    let mut deviations = Deviations::new("transmittance of lossless panes, n = 1.5 and 1.52, 0 to 85 degrees");
    let mut rows = Vec::new();
    for (index, values) in printed {
        let mut row = vec![index.to_string()];
        for (angle, value) in angles.into_iter().zip(values) {
            let transmittance = slab_transmittance(libm::cos(angle.to_radians()), index, 0.0);
            deviations.add(transmittance - value);
            row.push(format!("{transmittance:.4}"));
        }
        rows.push(row);
    }
    let head = ["n".to_owned()].into_iter().chain(angles.map(|angle| angle.to_string()));
    (
        deviations,
        Table {
            caption: "Transmittance of panes by angle of incidence in degrees".to_owned(),
            head: head.collect(),
            rows,
        },
    )
}

/// Compares the light of a luminaire in the floor that the ceiling, the only surface that is not black, reflects to upward
/// sensors with a quadrature.
fn diffuse_reflection(reference: &Path) -> Result<(Deviations, Table), ValidationError> {
    const CEILING: f64 = 0.6;
    let source = luminaire([1.95, 1.95, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]);
    let grid = json!([{ "name": "up", "height_m": 1.0, "cells": [5, 5], "estimate": "point" }]);
    let mut document = room([4.0, 4.0, 3.0], 0.0, source, grid, 0.005);
    document["room"]["surfaces"]["ceiling"]["reflectance"] = CEILING.into();
    let (prepared, estimate) = render(&document, reference)?;
    let mut deviations = Deviations::new("light reflected by the ceiling alone, 25 sensors");
    let mut rows = Vec::new();
    for sensor in 0..25 {
        let (i, j) = (sensor % 5, sensor / 5);
        let point = DVec3::new(prepared.grids()[0].x_m[i], prepared.grids()[0].y_m[j], 1.0);
        let truth = reflected_closed_form(point, CEILING);
        let (value, error) = (lux(&estimate, sensor), standard_error(&estimate, sensor));
        deviations.add((value - truth) / error);
        if j == 2 {
            rows.push(vec![format!("{:.2}", point.x), with_standard_error(value, error, 3), format!("{truth:.3}")]);
        }
    }
    let table = Table {
        caption: "Illuminance in lx at 1 m, lit by the ceiling (reflectance 0.6) over 10 000 lm in the floor"
            .to_owned(),
        head: ["x in m", "this program", "quadrature"].map(str::to_owned).into(),
        rows,
    };
    Ok((deviations, table))
}

/// Computes the light reflected to a point from the configuration factors of source to ceiling and ceiling to point, by the
/// midpoint rule over the ceiling; its error is far below the engine's.
fn reflected_closed_form(point: DVec3, reflectance: f64) -> f64 {
    const STEPS: usize = 200;
    let step = 4.0 / STEPS as f64;
    let mut sum = 0.0;
    for k in 0..STEPS * STEPS {
        let x = (k % STEPS) as f64 * step + 0.5 * step;
        let y = (k / STEPS) as f64 * step + 0.5 * step;
        let to_source_squared = (x - 2.0).powi(2) + (y - 2.0).powi(2) + 9.0;
        // the source is small: 0.1 m at 3 m
        let ceiling_lux = FLUX_LM / std::f64::consts::PI * 9.0 / (to_source_squared * to_source_squared);
        let depth = 3.0 - point.z;
        let to_point_squared = (x - point.x).powi(2) + (y - point.y).powi(2) + depth * depth;
        sum += ceiling_lux * depth * depth / (to_point_squared * to_point_squared);
    }
    sum * reflectance / std::f64::consts::PI * step * step
}

/// Compares closed 4 m cubes of one reflectance with the closed form: the mean of the six faces is exactly flux / (area (1 -
/// reflectance)) for any source. A source in one face lights its own, the opposite and four equal faces, so that three
/// positions of the source give the mean of all faces from the floor alone.
fn interreflection(reference: &Path) -> Result<(Deviations, Deviations, Table, Figure), ValidationError> {
    let grids = json!([{ "name": "floor", "height_m": 0.0, "cells": [4, 4], "estimate": "cell_average" }]);
    // luminaires are black: these take 1e-6 of the area, and 2e-5 of the light at the highest reflectance
    let (low, side) = (1.995, 0.01);
    let ceiling = luminaire([low, low, 4.0], [0.0, side, 0.0], [side, 0.0, 0.0]);
    let floor = luminaire([low, low, 0.0], [side, 0.0, 0.0], [0.0, side, 0.0]);
    let wall = luminaire([0.0, low, low], [0.0, side, 0.0], [0.0, 0.0, side]);
    let mut deviations = Deviations::new("closed rooms, reflectance 0.05 to 0.95: mean indirect illuminance");
    let mut closure = Deviations::new("closed rooms: emitted flux minus accounted flux");
    let (mut rows, mut marks) = (Vec::new(), Vec::new());
    let indirect = |reflectance: f64| FLUX_LM / 96.0 * reflectance / (1.0 - reflectance);
    for reflectance in REFLECTANCES {
        let (mut mean, mut variance) = (0.0, 0.0);
        for (source, weight) in [(&ceiling, 1.0 / 6.0), (&floor, 1.0 / 6.0), (&wall, 4.0 / 6.0)] {
            let document = room([4.0; 3], reflectance, source.clone(), grids.clone(), 0.005);
            let (_, estimate) = render(&document, reference)?;
            let of_floor = &estimate.grids[0].mean;
            mean += weight * of_floor.mean;
            variance += weight * weight * of_floor.variance_of_mean();
            closure.add(estimate.energy.relative_closure_error());
        }
        let value = mean - FLUX_LM / 96.0;
        deviations.add((value - indirect(reflectance)) / variance.sqrt());
        rows.push(vec![
            reflectance.to_string(),
            with_standard_error(value, variance.sqrt(), 2),
            format!("{:.2}", indirect(reflectance)),
        ]);
        marks.push((reflectance, value));
    }
    let line = (1..=96).map(|k| f64::from(k) * 0.01).map(|r| (r, indirect(r))).collect();
    let series = Series { name: "line: closed form, marks: this program".to_owned(), line, marks, ..Series::default() };
    let reflectance = Axis::linear("reflectance of all surfaces", [0.0, 1.0], 10, Steps::Decimal);
    let illuminance = Axis::logarithmic("mean indirect illuminance in lx", [1.0, 1e4], "");
    let heading = Heading::of("Closed rooms: a cube of 4 m with 10 000 lm");
    let drawn = svg(&curves(&heading, &[series], reflectance, illuminance))?;
    let table = Table {
        caption: "Mean indirect illuminance in lx of closed 4 m cubes with 10 000 lm".to_owned(),
        head: ["reflectance", "this program", "closed form"].map(str::to_owned).into(),
        rows,
    };
    let figure = Figure {
        file: "interreflection.svg",
        caption: "Mean indirect illuminance of closed rooms against the reflectance of their surfaces.".to_owned(),
        bytes: drawn.into_bytes(),
    };
    Ok((deviations, closure, table, figure))
}

fn lux(estimate: &Estimate, sensor: usize) -> f64 {
    estimate.grids[0].illuminance_lux(sensor)
}

fn standard_error(estimate: &Estimate, sensor: usize) -> f64 {
    estimate.grids[0].standard_error_lux(sensor)
}
