//! Target of a grid in a report: that of its document, or one that a reader of the report has.

use serde::Deserialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::document::result::{GridResult, TargetResult, Verdict};

// Part of a grid: what stands in `///` here would be repeated in the description of the parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TargetPart {
    /// Mean over the grid.
    #[default]
    Mean,
    /// Half of the area.
    Half,
    /// Most of the area: 95 % of it.
    Most,
}

impl TargetPart {
    /// Returns the percentage of the area that must have the target, 0..100; `None` where the mean must.
    pub fn least_percent(self) -> Option<f64> {
        match self {
            Self::Mean => None,
            Self::Half => Some(50.0),
            Self::Most => Some(95.0),
        }
    }

    /// Returns the words that follow a target in a sentence; empty for the mean.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Mean => "",
            Self::Half => " on half of the area",
            Self::Most => " on 95 % of the area",
        }
    }
}

/// Target that a reader of a report has for the first grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedTarget {
    /// Illuminance in lux, > 0.
    pub lux: f64,
    /// Part of the grid that should have it.
    pub part: TargetPart,
}

/// Target of a grid, compared with its result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgedTarget {
    /// Part of the grid that should have the target.
    pub part: TargetPart,
    /// Comparison; its verdict is on `part`.
    pub result: TargetResult,
}

impl JudgedTarget {
    /// Takes the comparison of a grid's statistics, as a job has them, with the target of the document; `None` if that has no target.
    pub fn of_document(statistics: &Value) -> Option<Self> {
        let result = TargetResult::deserialize(&statistics["target"]).ok()?;
        Some(Self { part: TargetPart::Mean, result })
    }

    /// Compares a grid with the target of a reader: the mean by its interval of 95 %, a part of the area by that of each cell. `outdoors`
    /// is the unobstructed horizontal illuminance in lux, where it alone lights the room.
    pub fn of_reader(wanted: WantedTarget, grid: &GridResult, outdoors: Option<f64>) -> Self {
        let WantedTarget { lux, part } = wanted;
        let of = &grid.statistics;
        let half =
            of.coverage_factor.zip(of.mean_lux_standard_error).map_or(f64::INFINITY, |(times, error)| times * error);
        let [from, area_percent, to] = percent_with(grid, lux);
        let verdict = match part.least_percent() {
            None => Verdict::of_interval([of.mean_lux - half, of.mean_lux + half], lux),
            Some(least) => Verdict::of_interval([from, to], least),
        };
        // what the mean needs tells nothing of a part
        let outdoors = outdoors.filter(|_| part == TargetPart::Mean);
        let external_lux = outdoors.map(|outdoors| outdoors * lux / of.mean_lux).filter(|lux| lux.is_finite());
        Self { part, result: TargetResult { lux, verdict, area_percent, external_lux } }
    }
}

/// Returns the percentages of the area, 0..100, that have an illuminance in lux: if all cells lie at the lower ends of their intervals, as
/// they are, and at the upper ends.
fn percent_with(grid: &GridResult, lux: f64) -> [f64; 3] {
    let times = grid.coverage_factor;
    let (mut all, mut having) = (0.0, [0.0; 3]);
    for (row, values) in grid.illuminance_lux.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            let Some(value) = value else { continue };
            let half =
                times.zip(grid.standard_error_lux[row][column]).map_or(f64::INFINITY, |(times, error)| times * error);
            let area = grid.area_m2.as_ref().map_or(1.0, |areas| areas[row][column]);
            all += area;
            for (sum, end) in having.iter_mut().zip([value - half, *value, value + half]) {
                *sum += if end >= lux { area } else { 0.0 };
            }
        }
    }
    having.map(|sum| if all > 0.0 { 100.0 * sum / all } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Three cells of 1, 1 and 2 m2 with 90 ± 2, 110 ± 2 and 130 ± 12 lx, and one outside the room; their mean is 100 ± 2 lx.
    fn grid() -> GridResult {
        let grid = json!({
            "name": "desk", "height_m": 0.8, "cells": [2, 2], "estimate": "point", "unit": "lux", "x_m": [1.0, 2.0], "y_m": [1.0, 2.0],
            "area_m2": [[1.0, 1.0], [2.0, 0.0]], "illuminance_lux": [[90.0, 110.0], [130.0, null]],
            "standard_error_lux": [[1.0, 1.0], [6.0, null]], "coverage_factor": 2.0, "illuminance_ratio_percent": [],
            "external_horizontal_illuminance_lux": { "sky": 5000.0, "sun": 0.0 },
            "statistics": { "coverage_factor": 2.0, "mean_lux": 100.0, "mean_lux_standard_error": 1.0, "min_lux": 90.0, "max_lux": 130.0,
                            "uniformity": 0.9, "area_above": [] }
        });
        GridResult::deserialize(grid).unwrap()
    }

    #[test]
    fn a_mean_and_a_part_are_judged_by_their_intervals() {
        use TargetPart::{Half, Mean, Most};
        let grid = grid();
        let judged = |lux: f64, part| JudgedTarget::of_reader(WantedTarget { lux, part }, &grid, Some(5000.0)).result;
        for (lux, part, verdict) in [
            (98.0, Mean, Verdict::Met),
            (101.0, Mean, Verdict::Undecided),
            (102.1, Mean, Verdict::NotMet),
            (100.0, Half, Verdict::Met),
            (120.0, Half, Verdict::Undecided),
            (143.0, Half, Verdict::NotMet),
            (88.0, Most, Verdict::Met),
            (91.0, Most, Verdict::Undecided),
            (113.0, Most, Verdict::NotMet),
        ] {
            assert_eq!(judged(lux, part).verdict, verdict, "{lux} {part:?}");
        }
        assert_eq!((judged(111.0, Half).area_percent, judged(111.0, Half).external_lux), (50.0, None));
        assert_eq!(judged(200.0, Mean).external_lux, Some(10_000.0));
    }

    #[test]
    fn without_errors_nothing_is_decided() {
        let mut grid = grid();
        (grid.coverage_factor, grid.statistics.coverage_factor) = (None, None);
        for part in [TargetPart::Mean, TargetPart::Half, TargetPart::Most] {
            let judged = JudgedTarget::of_reader(WantedTarget { lux: 1.0, part }, &grid, None);
            assert_eq!(judged.result.verdict, Verdict::Undecided);
        }
    }
}
