//! A year in a report: its sentences, its figures, and its tables.

use super::JobYear;
use super::figures::{percent, with_half_width};
use crate::document::result::annual::{GridYearResult, WithInterval};
use crate::figure::sheet::{SheetFigure, SheetPart, Tone};
use crate::figure::ticks::{short, significant, with_error};
use crate::present::subject::Subject;
use crate::present::verdict_words::verdict_in_words;

/// Largest number of grids that a report describes.
const MOST_GRIDS: usize = 3;

impl JobYear {
    /// Returns a sentence for each of the first grids: on how much of the area the illuminance of the spatial daylight autonomy is there for
    /// long enough.
    pub fn sentences(&self) -> Vec<(Tone, String)> {
        let sda = &self.document.sda;
        let (lux, share) = (short(sda.threshold_lux), short(sda.time_percent));
        let summary = self.summary().first;
        let sentence = |(grid, of): (&GridYearResult, &super::GridOfYear)| {
            let text = format!(
                "Over the year at {}, {} of the area of {} has {lux} lx in {share} % of the occupied hours (95 % interval of the numerical \
                 error); {}.",
                summary.site.name,
                percent(grid.sda_percent),
                of.result.place_in_words(),
                format_args!("the mean of these hours is {}", with_half_width(grid.mean_lux, "lx")),
            );
            (Tone::Plain, text)
        };
        summary.grids.iter().zip(&self.grids).take(MOST_GRIDS).map(sentence).collect()
    }

    /// Draws the daylight autonomy of the first grid, and its mean by day and hour.
    pub fn report_figures(&self, subject: &Subject) -> Vec<SheetFigure> {
        let Some(of) = self.grids.first() else { return Vec::new() };
        let name = &of.grid.name;
        let figures =
            [("autonomy", self.autonomy_figure(subject, name)), ("by_hour", self.hours_figure(subject, name))];
        let figure = |(kind, drawing): (&str, Option<Result<_, _>>)| {
            Some(SheetFigure { name: format!("annual/{kind}.{name}"), drawing: drawing?.ok()? })
        };
        figures.into_iter().filter_map(figure).collect()
    }

    /// Makes the table of the first grids' metrics.
    pub fn metrics_table(&self) -> SheetPart {
        let summary = self.summary().first;
        let row = |grid: &GridYearResult| {
            let autonomies = grid.autonomies.iter().map(|autonomy| value_in_words(autonomy.da_percent));
            std::iter::once(grid.name.clone())
                .chain([value_in_words(grid.mean_lux)])
                .chain(autonomies)
                .chain([
                    value_in_words(grid.udi.autonomous_percent),
                    percent(grid.sda_percent),
                    value_in_words(grid.exposure_klxh),
                ])
                .collect()
        };
        let thresholds = self.document.thresholds_lux.iter().map(|lux| format!("{} lx, % of hours", short(*lux)));
        let [_, least, most] = self.document.udi_lux.map(short);
        let head = ["grid".to_owned(), "mean, lx".to_owned()].into_iter().chain(thresholds).chain([
            format!("{least} to {most} lx, %"),
            "sDA, % of area".to_owned(),
            "exposure, klx h".to_owned(),
        ]);
        let title = format!(
            "The year at {}, {} occupied hours; ± is half an interval of 95 %",
            summary.site.name,
            short(summary.conventions.occupied_hours)
        );
        SheetPart::table(title, head.collect(), summary.grids.iter().take(MOST_GRIDS).map(row).collect())
    }

    /// Makes the table of the criteria of standards and schemes for the first grid.
    pub fn criteria_table(&self) -> SheetPart {
        let summary = self.summary().first;
        let verdicts = summary.grids.first().map_or(&[][..], |grid| grid.verdicts.as_slice());
        SheetPart::Table {
            title: "Criteria, as if the tubes were the room's only daylight; no scheme is met by single criteria"
                .to_owned(),
            head: ["criterion", "found", "asked", "outcome"].map(str::to_owned).to_vec(),
            rows: verdicts.iter().map(|verdict| verdict_in_words(verdict).to_vec()).collect(),
        }
    }
}

/// Formats a value with half of its interval, which a heading explains.
fn value_in_words(value: WithInterval) -> String {
    let half = 0.5 * (value.high - value.low);
    if half > 0.0 { with_error(value.value, half) } else { significant(value.value, 4) }
}
