//! Results of a year as small tables for a terminal.

use std::io::Write as _;

use super::results_table::{table, table_of_tubes};
use crate::document::result::annual::VerdictResult;
use crate::document::result::weather_files::{AnnualResult, MetricOverFiles};
use crate::figure::ticks::significant;
use crate::present::verdict_words::{interval_in_words, verdict_in_words};

/// Prints metrics and verdicts of a year to standard output.
pub fn print_year(year: &AnnualResult) {
    // the reader of the pipe may be gone
    let _ = std::io::stdout().write_all(year_table(year).as_bytes());
}

fn year_table(result: &AnnualResult) -> String {
    let year = &result.first;
    let mut text = format!("\n{}: {} occupied hours\n", year.site.name, year.conventions.occupied_hours);
    let tubes = year.tubes.iter().map(|tube| {
        let hours = tube.luminance_hours.first().map_or_else(String::new, |above| above.hours.to_string());
        (tube.klm_h.value, [interval_in_words(tube.klm_h), significant(100.0 * tube.sky_share, 3), hours])
    });
    table_of_tubes(&mut text, ["klm h", "of the sky, %", "hours above 6000 cd/m2"], tubes.collect());
    for grid in &year.grids {
        let mut rows: Vec<Vec<String>> = Vec::new();
        for autonomy in &grid.autonomies {
            rows.push(vec![
                format!("daylight autonomy {} lx, %", autonomy.lux),
                interval_in_words(autonomy.da_percent),
            ]);
        }
        rows.push(vec!["spatial daylight autonomy, % of the area".to_owned(), interval_in_words(grid.sda_percent)]);
        rows.push(vec!["median lux of the daylight hours".to_owned(), interval_in_words(grid.median_lux)]);
        rows.push(vec!["exposure, klx h".to_owned(), interval_in_words(grid.exposure_klxh)]);
        if let Some(dimming) = grid.dimming {
            rows.push(vec![
                "electric energy saved, kWh (upper estimate)".to_owned(),
                interval_in_words(dimming.saved_kwh),
            ]);
        }
        table(&mut text, vec![&grid.name, "value"], rows);
        let verdict = |verdict: &VerdictResult| {
            let [criterion, value, limit, outcome] = verdict_in_words(verdict);
            vec![outcome, criterion, value, limit]
        };
        table(&mut text, vec!["verdict", "criterion", "value", "limit"], grid.verdicts.iter().map(verdict).collect());
    }
    for grid in &result.over_files {
        let row = |metric: &MetricOverFiles| {
            let MetricOverFiles { least, median, largest, .. } = *metric;
            std::iter::once(metric.name.clone())
                .chain([least, median, largest].map(|value| significant(value, 4)))
                .collect()
        };
        let over = format!("{} over {} files", grid.name, result.others.len() + 1);
        table(&mut text, vec![&over, "least", "median", "largest"], grid.metrics.iter().map(row).collect());
    }
    text
}
