//! Whole scenes against an independent light tracer, and the room of the thesis.

use std::path::Path;

use serde_json::{Value, json};

use super::deviations::Deviations;
use super::error::ValidationError;
use super::reference::{failed, json as read_json, numbers};
use crate::page::{Section, Table, with_standard_error};
use crate::run::render;

/// Document of the thesis' room, from the examples.
const THESIS: &str = include_str!("../../../examples/holigilm_thesis.json");

/// Scene, reference, true for averages over cells, and the fraction of systematic difference that facets explain.
const SCENES: [(&str, &str, bool, f64); 8] = [
    ("S1", "S1.exact.point", false, 0.0),
    ("S1", "S1.exact.cell_average", true, 0.0),
    ("S2", "S2.exact.point", false, 0.0),
    ("S2", "S2.exact.cell_average", true, 0.0),
    ("S3", "S3.mesh.point", false, 0.003),
    ("S3", "S3.mesh.cell_average", true, 0.003),
    ("S3_mesh", "S3.mesh.point", false, 0.0),
    ("S3_mesh", "S3.mesh.cell_average", true, 0.0),
];

pub fn section(reference: &Path) -> Result<Section, ValidationError> {
    let folder = reference.join("scenes");
    let mut checks = Vec::new();
    let mut rows = Vec::new();
    for (scene, truth_name, averaged, systematic) in SCENES {
        let truth = read_json(reference, &format!("scenes/{truth_name}.reference.json"))?;
        let (values, errors) = (numbers(&truth["illuminance_lux"]), numbers(&truth["standard_error_lux"]));
        let mut document = read_json(reference, &format!("scenes/{scene}.json"))?;
        // a standard error of 0.5 %: the stop rule is 1.96 times that
        document["stop"] = json!({ "relative_error": 0.0098, "max_seconds": 300 });
        if averaged {
            document["grids"][0]["estimate"] = Value::from("cell_average");
        }
        let (prepared, estimate) = render(&document, &folder)?;
        let grid = &estimate.grids[0];
        let kind = if averaged { "cell averages" } else { "points" };
        let mut deviations = Deviations::new(format!("{scene}, {kind}"));
        let mut squares = 0.0;
        for (sensor, (truth, error)) in values.iter().zip(&errors).enumerate() {
            let combined = libm::hypot(libm::hypot(grid.standard_error_lux(sensor), *error), systematic * truth);
            let z = (grid.illuminance_lux(sensor) - truth) / combined;
            squares += z * z;
            deviations.add(z);
        }
        let reference_mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        rows.push(vec![
            scene.to_owned(),
            kind.to_owned(),
            prepared.plan.methods.grids.as_ref().map_or("", |choice| choice.method.name()).to_owned(),
            with_standard_error(grid.mean.mean, grid.mean.standard_error(), 3),
            format!("{reference_mean:.3}"),
            format!("{:.2}", (squares / values.len().max(1) as f64).sqrt()),
            format!("{:.2}", deviations.worst),
        ]);
        checks.push(deviations.check(4.5, "combined standard errors"));
    }
    Ok(Section {
        text: "Job documents S1 (thesis room, Lambertian diffuser), S2 (sun through a clear closure) and S3 (two 45-degree \
               bends, as cylinders and as a mesh of 30 162 triangles), rendered to a standard error of 0.5 %, against an \
               independent light tracer; 81 sensors each. S3 as cylinders may differ from the mesh by 0.3 % (facets)."
            .to_owned(),
        checks,
        tables: vec![Table {
            caption: "Mean illuminance in lx and deviations in combined standard errors".to_owned(),
            head: ["scene", "estimate", "method", "mean", "reference", "rms z", "worst z"].map(str::to_owned).into(),
            rows,
        }],
        ..Section::default()
    })
}

/// Validates the HOLIGILM case of Schou 2012: direct light of a Lambertian disc, 519 lm into the room.
pub fn thesis(reference: &Path) -> Result<Section, ValidationError> {
    let document: Value =
        serde_json::from_str(THESIS).map_err(|error| failed("examples/holigilm_thesis.json", error))?;
    let mut mean = Deviations::new("mean illuminance of the floor against 29.80 lx");
    let mut maximum = Deviations::new("maximum illuminance of the floor against 40.2 lx");
    let mut rows = Vec::new();
    for method in ["holigilm", "light_tracing"] {
        let mut document = document.clone();
        document["method"] = method.into();
        let (_, estimate) = render(&document, reference)?;
        // points for the maximum, cell averages for the mean
        let [points, cells] = [&estimate.grids[0], &estimate.grids[1]];
        let highest = (0..points.sensors.len()).map(|sensor| points.illuminance_lux(sensor)).fold(0.0, f64::max);
        let flux = estimate.tubes[0].into_room.mean;
        // the flux is only known to 519 +- 5 lm, and the maximum was printed with one decimal
        mean.add((cells.mean.mean / 29.7978 - 1.0) / (5.0 / 519.0));
        maximum.add((highest - 40.2) / (40.2 * 5.0 / 519.0 + 0.05));
        rows.push(vec![
            method.to_owned(),
            format!("{flux:.1}"),
            format!("{:.2}", cells.mean.mean),
            format!("{highest:.2}"),
        ]);
    }
    rows.push(["HOLIGILM, as the thesis prints it", "", "29.80", "40.2"].map(str::to_owned).into());
    Ok(Section {
        text: "The thesis compares its photon maps with HOLIGILM: mean 29.80 and maximum 40.2 lx. These numbers follow from \
               a sky of type 12 at 13:00 UTC without sun, the turbidity form of the zenith luminance, 519 lm into the \
               room and no interreflection; the transmittance of the diffuser below is chosen to give that flux, as \
               the thesis does not state it."
            .to_owned(),
        checks: vec![mean.check(1.0, "of the uncertainty of the flux"), maximum.check(1.0, "of the uncertainty of the flux and the printed digit")],
        tables: vec![Table {
            caption: "Direct illuminance of the floor".to_owned(),
            head: ["method", "flux into the room in lm", "mean in lx", "maximum in lx"].map(str::to_owned).into(),
            rows,
        }],
        ..Section::default()
    })
}
