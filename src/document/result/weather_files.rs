//! Years of daylight by several weather files, and what they have in common.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::annual::{GridYearResult, YearResult};

/// Years of daylight of a job: that of its first weather file, and, where there are more, those of the others and the spread over all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AnnualResult {
    /// Year of the first weather file, whose tables and figures the other files of the job have.
    #[serde(flatten)]
    pub first: YearResult,
    /// Years of the other weather files; absent without any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<YearResult>,
    /// Metrics of each grid over all weather files; absent with one file alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub over_files: Vec<GridOverFiles>,
}

/// Metrics of a grid over several weather files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GridOverFiles {
    /// Name of the grid.
    pub name: String,
    /// Metrics of the area.
    pub metrics: Vec<MetricOverFiles>,
}

/// Metric over several weather files: how much years and places differ. The numerical error is not in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MetricOverFiles {
    /// Name of the metric with its unit, such as `da_300_percent`.
    pub name: String,
    /// Least value of a file.
    pub least: f64,
    /// Median of the files.
    pub median: f64,
    /// Largest value of a file.
    pub largest: f64,
}

impl AnnualResult {
    /// Gathers the years of one or more weather files.
    pub fn new(first: YearResult, others: Vec<YearResult>) -> Self {
        let grids = if others.is_empty() { 0 } else { first.grids.len() };
        let of_grid = |number: usize| {
            let years: Vec<&GridYearResult> =
                std::iter::once(&first).chain(&others).filter_map(|year| year.grids.get(number)).collect();
            GridOverFiles { name: years[0].name.clone(), metrics: over_files(&years) }
        };
        let over_files = (0..grids).map(of_grid).collect();
        Self { over_files, first, others }
    }
}

/// Returns the spread of the metrics of a grid over its years, at least one.
fn over_files(years: &[&GridYearResult]) -> Vec<MetricOverFiles> {
    let headlines = |year: &GridYearResult| -> Vec<(String, f64)> {
        let autonomies = year.autonomies.iter().map(|of| (format!("da_{}_percent", of.lux), of.da_percent.value));
        let provision =
            year.en17037.iter().map(|of| (format!("en17037_{}_percent", of.lux), of.by_hours_percent.value));
        let others = [
            ("sda_percent", year.sda_percent),
            ("mean_lux", year.mean_lux),
            ("median_lux", year.median_lux),
            ("exposure_klxh", year.exposure_klxh),
        ];
        let others = others.map(|(name, of)| (name.to_owned(), of.value));
        let saved = year.dimming.map(|dimming| ("saved_kwh".to_owned(), dimming.saved_kwh.value));
        autonomies.chain(provision).chain(others).chain(saved).collect()
    };
    let values: Vec<Vec<(String, f64)>> = years.iter().map(|year| headlines(year)).collect();
    let spread = |(number, (name, _)): (usize, &(String, f64))| {
        let mut sorted: Vec<f64> = values.iter().filter_map(|year| year.get(number)).map(|(_, value)| *value).collect();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len() - 1;
        let median = 0.5 * (sorted[last / 2] + sorted[sorted.len() / 2]);
        MetricOverFiles { name: name.clone(), least: sorted[0], median, largest: sorted[last] }
    };
    values[0].iter().enumerate().map(spread).collect()
}
