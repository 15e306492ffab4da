//! Figures of a grid: its values over the plan of the room, as illuminance, as daylight factor, or minus those of another job.

use glam::{DVec2, DVec3};
use serde::Deserialize;
use utoipa::ToSchema;

use super::mesh_outlines::{hull, object_pieces};
use super::subject::{Subject, by};
use crate::document::errors::Checks;
use crate::document::result::{GridResult, GridStatistics};
use crate::document::room::object::ObjectDocument;
use crate::document::room::plan::PartitionDocument;
use crate::document::tube::opening::PlacedOpening;
use crate::figure::isolines::{levels, levels_lux};
use crate::figure::plan_cells::GridValues;
use crate::figure::plan_map::{Numbers, PlanMap};
use crate::figure::room_plan::RoomPlan;
use crate::figure::scale::{ColourScale, Palette};
use crate::figure::ticks::{fixed, significant, with_error};
use crate::figure::{Drawing, Heading};
use crate::output::OutputError;

// Quantity of a grid that a figure shows: what stands in `///` here would be repeated in the description of the parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Illuminance in lux.
    Illuminance,
    /// Illuminance in percent of the unobstructed horizontal one: the daylight factor under an overcast sky.
    Ratio,
}

/// Options of a figure of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridWishes {
    /// Quantity that is shown.
    pub quantity: Quantity,
    /// Value at the upper end of the colour scale, above zero; `None` for the greatest value of the grid.
    pub scale_end: Option<f64>,
    /// Visibility of the number in each cell.
    pub numbers: Numbers,
}

impl Default for GridWishes {
    fn default() -> Self {
        Self { quantity: Quantity::Illuminance, scale_end: None, numbers: Numbers::Hidden }
    }
}

/// Draws the figure of a grid of a job.
pub fn grid_figure(subject: &Subject, grid: &GridResult, wishes: GridWishes) -> Result<Drawing, OutputError> {
    plan_map(subject, grid, wishes).draw()
}

/// Builds the figure of a grid: heading, plan of the room, values, colour scale and isolines.
pub fn plan_map(subject: &Subject, grid: &GridResult, wishes: GridWishes) -> PlanMap {
    let (values, unit) = values(grid, wishes.quantity);
    let [least, greatest] = ends(&values);
    let scale = ColourScale::from_zero(wishes.scale_end.unwrap_or(greatest), Palette::Viridis);
    let (title, levels, result) = match wishes.quantity {
        Quantity::Illuminance => ("Illuminance", levels_lux(least, greatest), statistics_in_words(&grid.statistics)),
        Quantity::Ratio => {
            let title = if grid.daylight_factor_percent.is_some() { "Daylight factor" } else { "Daylight ratio" };
            (title, levels(least, greatest), ratios_in_words(&values))
        }
    };
    let lines = vec![subject.circumstances(), of_grid(subject, grid), result];
    let heading = subject.heading(format!("{title}, {}", subject.name()), lines);
    PlanMap { numbers: wishes.numbers, ..map_of_values(subject, grid, (heading, values), (scale, unit, levels)) }
}

/// Builds a map of values of the sensors of a grid over the plan of its room, with a colour scale, its unit and isolines.
pub fn map_of_values(
    subject: &Subject,
    grid: &GridResult,
    (heading, values): (Heading, Vec<f64>),
    (scale, unit, levels): (ColourScale, &'static str, Vec<f64>),
) -> PlanMap {
    let grid = placed(subject, grid, values);
    PlanMap { heading, room: room(subject, &grid), grid, scale, unit, levels, numbers: Numbers::Hidden }
}

/// Draws a grid minus the same grid of another job; returns an error where their numbers of cells differ.
pub fn difference_figure(
    subject: &Subject,
    grid: &GridResult,
    (other, less): (&Subject, &GridResult),
    wishes: GridWishes,
) -> Result<Drawing, OutputError> {
    let [(of_grid_values, unit), (of_less, _)] = [grid, less].map(|grid| values(grid, wishes.quantity));
    if grid.cells != less.cells {
        let [width, height] = grid.cells;
        return Err(OutputError::Size { values: of_less.len(), width, height, channels: 1 });
    }
    let values: Vec<f64> = of_grid_values.iter().zip(&of_less).map(|(value, less)| value - less).collect();
    let magnitudes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    let scale = ColourScale::around_zero(wishes.scale_end.unwrap_or(ends(&magnitudes)[1]));
    let [least, greatest] = ends(&values);
    // no difference where one of both has no value
    let known: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
    let sign = if mean > 0.0 { "+" } else { "" };
    let heading = subject.heading(
        format!("{} minus {}", subject.name(), other.name()),
        vec![
            subject.circumstances(),
            format!("minus: {}", other.circumstances()),
            format!("{} · mean {sign}{} {unit}", of_grid(subject, grid), significant(mean, 3)),
        ],
    );
    let grid = placed(subject, grid, values);
    let (room, levels, numbers) = (room(subject, &grid), levels(least, greatest), wishes.numbers);
    PlanMap { heading, room, grid, scale, unit, levels, numbers }.draw()
}

/// Returns the values of a grid, not-a-number where there is none, and their unit.
fn values(grid: &GridResult, quantity: Quantity) -> (Vec<f64>, &'static str) {
    let (rows, unit) = match quantity {
        Quantity::Illuminance => (&grid.illuminance_lux, "lx"),
        Quantity::Ratio => (&grid.illuminance_ratio_percent, "%"),
    };
    (rows.iter().flatten().map(|value| value.unwrap_or(f64::NAN)).collect(), unit)
}

/// Returns the least and the greatest of the finite values; zeros where there are none.
fn ends(values: &[f64]) -> [f64; 2] {
    let finite = values.iter().copied().filter(|value| value.is_finite());
    let [least, greatest] =
        finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    if least <= greatest { [least, greatest] } else { [0.0, 0.0] }
}

fn of_grid(subject: &Subject, grid: &GridResult) -> String {
    format!("{}{}", grid.place_in_words(), by(&subject.grids_method))
}

fn statistics_in_words(statistics: &GridStatistics) -> String {
    let GridStatistics { mean_lux, median_lux, min_lux, max_lux, uniformity, .. } = *statistics;
    let half = statistics.coverage_factor.zip(statistics.mean_lux_standard_error).map(|(factor, error)| factor * error);
    let (mean, interval) = match half.filter(|half| *half > 0.0) {
        Some(half) => (with_error(mean_lux, half), " (95 %)"),
        None => (significant(mean_lux, 4), ""),
    };
    let [median, least, greatest] = [median_lux, min_lux, max_lux].map(|value| significant(value, 3));
    let uniformity =
        uniformity.map_or_else(String::new, |uniformity| format!(" · uniformity {}", fixed(uniformity, 2)));
    let count = |points: usize, place: &str| match points {
        0 => String::new(),
        points => format!(" · {points} points {place}"),
    };
    let inside = count(statistics.points_inside_solids, "inside solids");
    format!("mean {mean} lx{interval} · median {median} · minimum {least} · maximum {greatest}{uniformity}{inside}")
}

fn ratios_in_words(values: &[f64]) -> String {
    let mut finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    let Some(median) = finite.get(finite.len() / 2) else { return String::new() };
    let mean = finite.iter().sum::<f64>() / finite.len() as f64;
    let [mean, median, least, greatest] =
        [mean, *median, finite[0], finite[finite.len() - 1]].map(|value| significant(value, 3));
    format!("mean {mean} % · median {median} · minimum {least} · maximum {greatest}")
}

/// Places the values in the room, by the grid's margin in the document, or by the centres of the cells where the document is not known.
fn placed(subject: &Subject, grid: &GridResult, values: Vec<f64>) -> GridValues {
    let document = subject.document.as_ref();
    let named =
        document.and_then(|document| Some((document, document.grids.iter().find(|one| one.name == grid.name)?)));
    let [from_m, to_m] = match named {
        Some((document, named)) => {
            let [low, high] = document.room.bounds_m().map(DVec3::truncate);
            match (named.spacing_m, &grid.points_m) {
                (_, Some(_)) => [low, high],
                (Some(spacing), None) => [low, low + spacing * DVec2::new(grid.cells[0] as f64, grid.cells[1] as f64)],
                (None, None) => [low + named.margin_m, high - named.margin_m],
            }
        }
        None => {
            let [x, y] = [&grid.x_m, &grid.y_m].map(|centres| along(centres));
            [DVec2::new(x[0], y[0]), DVec2::new(x[1], y[1])]
        }
    };
    let points = grid.points_m.iter().flatten().map(|[x, y, ..]| DVec2::new(*x, *y)).collect();
    let outside = grid.area_m2.iter().flatten().flatten().map(|area| *area == 0.0).collect();
    GridValues { cells: grid.cells, from_m, to_m, values, points, outside }
}

/// Returns the outer ends of a row of cells with these centres.
fn along(centres: &[f64]) -> [f64; 2] {
    match centres {
        [] => [0.0, 1.0],
        [only] => [only - 0.5, only + 0.5],
        [first, second, .., last] | [first, second @ last] => {
            let half = 0.5 * (second - first);
            [first - half, last + half]
        }
    }
}

/// Returns the plan of a job's room; an empty one that ends with the grid where the document is not known.
fn room(subject: &Subject, grid: &GridValues) -> RoomPlan {
    let Some(document) = &subject.document else {
        return RoomPlan::rectangle(DVec2::ZERO, grid.to_m);
    };
    let enclosure = document.room.enclosure(&mut Checks::default());
    let placed = |tube| enclosure.as_ref().and_then(|room| PlacedOpening::of(tube, room));
    let tubes = document.tubes.iter().filter_map(|tube| placed(tube).map(|opening| (opening.frame, opening.shape)));
    let objects = document.room.objects.iter().filter_map(footprint);
    let ends = |partition: &PartitionDocument| [partition.from_m, partition.to_m].map(DVec2::from).to_vec();
    let of_meshes = subject.meshes.iter().flat_map(object_pieces);
    let of_meshes = of_meshes.map(|piece| hull(piece.iter().map(|corner| corner.truncate())));
    let objects = objects.chain(of_meshes).chain(document.room.partitions.iter().map(ends));
    RoomPlan {
        rings: document.room.rings(),
        rotation_deg: document.room.rotation_deg,
        tubes: tubes.collect(),
        objects: objects.collect(),
    }
}

/// Returns the outline of a box from above; `None` for a mesh, whose outlines follow from its triangles.
fn footprint(object: &ObjectDocument) -> Option<Vec<DVec2>> {
    let ObjectDocument::Box(object) = object else { return None };
    Some(object.footprint().to_vec())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::present::subject::tests::document;

    fn grid(lux: [f64; 4]) -> GridResult {
        let [a, b, c, d] = lux;
        let ratios = lux.map(|lux| lux / 100.0);
        serde_json::from_value(json!({
            "name": "floor", "height_m": 0.8, "cells": [2, 2], "estimate": "point", "unit": "lux",
            "x_m": [1.0, 3.0], "y_m": [1.5, 4.5], "illuminance_lux": [[a, b], [c, d]],
            "standard_error_lux": [[1, 1], [1, null]],
            "illuminance_ratio_percent": [ratios[..2], ratios[2..]],
            "external_horizontal_illuminance_lux": { "sky": 10000, "sun": 0 },
            "statistics": { "mean_lux": 211.0437, "mean_lux_standard_error": 0.3142, "coverage_factor": 2.0, "median_lux": 187.2, "min_lux": 51.0,
                            "max_lux": 484.0, "uniformity": 0.2417 }
        }))
        .unwrap()
    }

    fn texts(drawing: &Drawing) -> Vec<&str> {
        drawing.texts().collect()
    }

    #[test]
    fn a_grid_is_told_with_its_room_and_its_error() {
        let subject = Subject::new(&document(), &json!(null));
        let drawing = grid_figure(&subject, &grid([51.0, 100.0, 200.0, 484.0]), GridWishes::default()).unwrap();
        let texts = texts(&drawing);
        for text in [
            "Illuminance, bath",
            "mean 211.04 ± 0.63 lx (95 %) · median 187 · minimum 51.0 · maximum 484 · uniformity 0.24",
            "floor, 0.8 m above the floor",
            "tube 1",
            "minimum 51.0 lx",
            "maximum 484 lx",
            "400",
        ] {
            assert!(texts.contains(&text), "{text}: {texts:?}");
        }
    }

    #[test]
    fn ratios_and_differences_come_from_the_same_figure() {
        let subject = Subject::new(&document(), &json!(null));
        let wishes = GridWishes { quantity: Quantity::Ratio, scale_end: Some(5.0), numbers: Numbers::Hidden };
        let one = grid([50.0, 100.0, 200.0, 480.0]);
        let ratio = grid_figure(&subject, &one, wishes).unwrap();
        assert!(texts(&ratio).contains(&"Daylight ratio, bath") && texts(&ratio).contains(&"5"), "{:?}", texts(&ratio));
        let other = grid([70.0, 100.0, 100.0, 480.0]);
        let less = difference_figure(&subject, &one, (&subject, &other), GridWishes::default()).unwrap();
        for text in ["bath minus bath", "−100", "100", "minimum −20.0 lx", "maximum 100 lx"] {
            assert!(texts(&less).contains(&text), "{text}: {:?}", texts(&less));
        }
        let mut wider = other.clone();
        wider.cells = [4, 1];
        assert!(difference_figure(&subject, &one, (&subject, &wider), GridWishes::default()).is_err());
    }

    #[test]
    fn a_job_whose_document_is_not_known_has_a_figure_all_the_same() {
        let subject = Subject::new(&json!(null), &json!(null));
        let drawing = grid_figure(&subject, &grid([0.0; 4]), GridWishes::default()).unwrap();
        assert!(texts(&drawing).contains(&"Illuminance, unnamed job"));
        assert_eq!(along(&[1.0, 3.0]), [0.0, 4.0]);
        assert_eq!(along(&[1.0, 2.0, 3.0]), [0.5, 3.5]);
    }
}
