//! A year in a report: its sentences, its figures, and its tables.

use super::JobYear;
use super::figures::{percent, with_half_width};
use crate::document::result::Verdict;
use crate::document::result::annual::{GridYearResult, WithInterval};
use crate::figure::sheet::{SheetFigure, SheetPart, Tone};
use crate::figure::ticks::{short, significant, with_error};
use crate::present::outputs::AUTONOMY;
use crate::present::subject::Subject;
use crate::present::target::WantedTarget;
use crate::present::verdict_words::verdict_in_words;

/// Largest number of grids that a report describes.
const MOST_GRIDS: usize = 3;

impl JobYear {
    /// Returns a sentence for each of the first grids: whether it has its target for long enough, or else on how much of the area the
    /// illuminance of the spatial daylight autonomy is there for so long. The first grid is compared with `wanted`, if given, in place of the
    /// target of the document.
    pub fn sentences(&self, wanted: Option<WantedTarget>) -> Vec<(Tone, String)> {
        let sda = &self.document.sda;
        let share = short(sda.time_percent);
        let summary = self.summary().first;
        let site = &summary.site.name;
        let sentence = |(index, (grid, of)): (usize, (&GridYearResult, &super::GridOfYear))| {
            let place = of.result.place_in_words();
            let target = wanted.filter(|_| index == 0).or_else(|| of.own_target());
            let whole = of.result.whole_in_words();
            let (tone, found) =
                target.and_then(|target| self.on_target(target, grid, (&place, whole))).unwrap_or_else(|| {
                    let (part, lux) = (percent(grid.sda_percent), short(sda.threshold_lux));
                    let text = format!(
                        "Over the year at {site}, at {place}, there are {lux} lx in {share} % of the occupied hours on \
                         {part} of the {whole}"
                    );
                    (Tone::Plain, text)
                });
            let mean = with_half_width(grid.mean_lux, "lx");
            (tone, format!("{found}; the mean of these hours is {mean} (95 % intervals of the numerical error)."))
        };
        summary.grids.iter().zip(&self.grids).take(MOST_GRIDS).enumerate().map(sentence).collect()
    }

    /// Says whether a grid, given by its place and what parts of it are parts of, has a target over the year, and by which number: the
    /// daylight autonomy, averaged over the area, or the part of the area that has the target for long enough. `None` if the year has no
    /// such number for this illuminance.
    fn on_target(
        &self,
        target: WantedTarget,
        grid: &GridYearResult,
        (place, whole): (&str, &str),
    ) -> Option<(Tone, String)> {
        let WantedTarget { lux, part } = target;
        let sda = &self.document.sda;
        let (found, least, words) = match part.least_percent() {
            None => {
                let found = grid.autonomies.iter().find(|autonomy| autonomy.lux == lux)?.da_percent;
                let words = format!("{place}, has it in {} of them, averaged over the {whole}", percent(found));
                (found, sda.time_percent, words)
            }
            Some(_) if sda.threshold_lux != lux => return None,
            Some(least) => {
                let words = format!("{place}, has it on {} of the {whole}", percent(grid.sda_percent));
                (grid.sda_percent, least, words)
            }
        };
        let (lux, part, share) = (short(lux), part.in_words(), short(sda.time_percent));
        let asked = format!("target of {lux} lx{part} in {share} % of the occupied hours");
        let site = &self.summary().first.site.name;
        Some(match Verdict::of_interval([found.low, found.high], least) {
            Verdict::Met => (Tone::Good, format!("The {asked} is met over the year at {site}: {words}")),
            Verdict::NotMet => (Tone::Bad, format!("The {asked} is not met over the year at {site}: {words}")),
            Verdict::Undecided => {
                let text = format!(
                    "Whether the {asked} is met over the year at {site} is not decided at this accuracy: {words}"
                );
                (Tone::Plain, text)
            }
        })
    }

    /// Draws the daylight autonomy of the first grid, for the target `wanted` if given, and its mean by day and hour.
    pub fn report_figures(&self, subject: &Subject, wanted: Option<WantedTarget>) -> Vec<SheetFigure> {
        let Some(of) = self.grids.first() else { return Vec::new() };
        let name = &of.grid.name;
        let figures = [
            (AUTONOMY, self.autonomy_figure(subject, name, wanted)),
            ("annual/by_hour.", self.hours_figure(subject, name)),
        ];
        let figure = |(path, drawing): (&str, Option<Result<_, _>>)| {
            Some(SheetFigure { name: format!("{path}{name}"), drawing: drawing?.ok()? })
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
            "The year with the weather of {}, {} occupied hours; ± is the half-width of the 95 % confidence interval",
            summary.site.name,
            short(summary.conventions.occupied_hours)
        );
        SheetPart::table(title, head.collect(), summary.grids.iter().take(MOST_GRIDS).map(row).collect())
    }

    /// Makes the table of the criteria of standards and schemes for the first grid.
    pub fn criteria_table(&self) -> SheetPart {
        let summary = self.summary().first;
        let (name, verdicts) =
            summary.grids.first().map_or(("", &[][..]), |grid| (grid.name.as_str(), grid.verdicts.as_slice()));
        SheetPart::Table {
            title: format!(
                "Criteria for {name}, as if the tubes were the room's only daylight; no scheme is met by single criteria"
            ),
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
